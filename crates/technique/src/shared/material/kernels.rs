//! The reflectance's factor of techniques that see it about a central direction: its slices, and itself for
//! the lights that no map holds.

use crate::certify;
use crate::shared::material::reflectance;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Material, Part};
use steradian_base::Task;
use steradian_brdf::central::{CentralError, Centre, MAX_ORDER, Slice, Slices};
use steradian_brdf::model::strand::Kind;
use steradian_brdf::{Brdf, Files, Form, SharedBrdf, parse_with};

/// Error of the integrals, relative to the error that truncation of orders may cause.
const QUADRATURE: f64 = 0.01;
/// RMS error to which reflectance is integrated where centres are compared.
pub const COARSE: f64 = 1e-3;
/// Step in elevations at which the required orders are determined.
const EVERY: usize = 8;

/// Slices of one reflectance.
#[derive(Debug, Clone)]
pub struct Kernels {
    /// The slices.
    pub slices: Slices,
    /// The reflectance, where its spec and the file contents saved with it restore it, GPUs have text of it,
    /// and it is a formula: millions of measurements do not belong in a bake.
    pub brdf: Option<SharedBrdf>,
}

/// A refusal or a cancellation as a bake's.
pub fn refused(slug: &'static str) -> impl Fn(CentralError) -> BakeError {
    move |e| match e {
        CentralError::Cancelled(c) => BakeError::Cancelled(c),
        e => BakeError::Material { slug, why: format!("{e}; or use reference") },
    }
}

/// Accepts isotropic reflectance, and reflectance that depends on t·wi and t·wo alone, of measurable
/// sharpness.
pub fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    let strand = matches!(brdf.form(), Form::Strand { kind: Kind::KajiyaKay | Kind::BanksMap, .. });
    if brdf.is_isotropic() || strand {
        return certify::measurable(brdf);
    }
    Err(format!(
        "takes isotropic reflectance, kajiya-kay and banks-map, not anisotropic {}: use reference",
        brdf.info().name
    ))
}

impl Kernels {
    /// Slices at `elevations` up to the first of `orders` (F and Q, ascending) that hold each elevation up to
    /// `views` radians but for `share` of its energy, else up to the last. Orders that every eighth elevation
    /// finds too low are computed at no others.
    pub fn new(
        material: &Material,
        centre: Centre,
        elevations: &[Slice],
        orders: &[[usize; 2]],
        views: f64,
        share: f64,
        task: &Task,
    ) -> Result<Self, CentralError> {
        let tolerance = QUADRATURE * share.sqrt();
        let made = |of: &[Slice], orders: [usize; 2]| {
            Slices::to(&*material.brdf, centre, of.to_vec(), orders, tolerance, task)
        };
        let raised = |s: &Slices, now: [usize; 2], next: [usize; 2]| {
            let more = missing(s, views, share);
            std::array::from_fn(|i| if more[i] { next[i] } else { now[i] })
        };
        let few: Vec<Slice> = elevations.iter().step_by(EVERY).copied().collect();
        let (mut now, mut higher) = (orders[0], &orders[1..]);
        while let [next, others @ ..] = higher {
            let raised = raised(&made(&few, now)?, now, *next);
            if raised == now {
                break;
            }
            (now, higher) = (raised, others);
        }
        let mut slices = made(elevations, now)?;
        for next in higher {
            let raised = raised(&slices, now, *next);
            if raised != now {
                now = raised;
                slices = made(elevations, now)?;
            }
        }
        Ok(Self { slices, brdf: nameable(&material.brdf) })
    }
}

/// See [`Kernels::brdf`].
fn nameable(brdf: &SharedBrdf) -> Option<SharedBrdf> {
    let held = brdf.held();
    let files = held.as_deref().map_or(Files::None, Files::Held);
    let formula = brdf.shader().is_some_and(|s| s.cells().is_none());
    let whole = formula && parse_with(&brdf.spec(), files).is_ok();
    whole.then(|| brdf.clone())
}

/// Does F, does Q miss more than `share` of the energy of any elevation up to `views`?
fn missing(s: &Slices, views: f64, share: f64) -> [bool; 2] {
    let mut more = [false; 2];
    for (i, _) in s.slices.iter().enumerate().filter(|(_, s)| s.theta_v.abs() < views) {
        let captured = s.captured(i, s.order, s.azimuth);
        for c in 0..3 {
            let rest = s.energy[i][c] - captured[c];
            let turns = turns(s, i, c);
            let most = share * s.energy[i][c];
            more[0] |= rest - turns > most;
            more[1] |= turns > most;
        }
    }
    more
}

/// The energy of a slice beyond Q, as the rows of Q/2 and of Q say: e_q ∝ q^−p gives e_Q Q/(p − 1), which
/// holds for edges (p = 2) as for smooth lobes.
pub fn turns(s: &Slices, slice: usize, channel: usize) -> f64 {
    if s.azimuth < 2 {
        return 0.0;
    }
    let energy = |q: usize| 2.0 * s.row(slice, q)[channel].iter().map(|k| k * k).sum::<f64>();
    let (half, last) = (energy(s.azimuth / 2), energy(s.azimuth));
    let power = (half / last.max(f64::MIN_POSITIVE)).log2().clamp(1.5, 16.0);
    last * s.azimuth as f64 / (power - 1.0)
}

/// The number of a centre in parameters and files.
pub fn word(centre: Centre) -> f64 {
    match centre {
        Centre::Reflection => 1.0,
        Centre::Normal => 2.0,
        Centre::Tangent => 3.0,
    }
}

/// The centre that a number in parameters and files means.
pub fn centre_of(word: f64) -> Option<Centre> {
    [Centre::Reflection, Centre::Normal, Centre::Tangent].into_iter().find(|c| self::word(*c) == word)
}

impl Part for Kernels {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let s = &self.slices;
        let head = vec![word(s.centre), s.accuracy];
        put_f64(to, format!("{prefix}.centre"), vec![2], head);
        let one = |i: usize| {
            let (v, e, c) = (&s.slices[i], &s.energy[i], &s.cosine[i]);
            [v.theta_v, v.gamma, e[0], e[1], e[2], c[0], c[1], c[2]]
        };
        let elevations = (0..s.slices.len()).flat_map(one).collect();
        put_f64(to, format!("{prefix}.elevations"), vec![s.slices.len(), 8], elevations);
        let shape = vec![s.slices.len(), s.azimuth + 1, 3, s.order + 1];
        put_f64(to, format!("{prefix}.kernels"), shape, s.k.clone());
        if let Some(brdf) = &self.brdf {
            reflectance::put(to, &format!("{prefix}.brdf"), &**brdf);
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let bad = |name: &str| PartError::Unexpected(format!("{prefix}.{name}"));
        let (_, head) = get_f64(from, &format!("{prefix}.centre"), 1)?;
        let [centre, accuracy] = head[..] else { return Err(bad("centre")) };
        let centre = centre_of(centre).ok_or_else(|| bad("centre"))?;
        let (shape, elevations) = get_f64(from, &format!("{prefix}.elevations"), 2)?;
        if shape[1] != 8 || shape[0] < 3 {
            return Err(bad("elevations"));
        }
        let (of, k) = get_f64(from, &format!("{prefix}.kernels"), 4)?;
        let whole = of[0] == shape[0] && of[2] == 3 && (1..=MAX_ORDER + 1).contains(&of[3]);
        if !whole || !(1..=of[3]).contains(&of[1]) || !k.iter().all(|k| k.is_finite()) {
            return Err(bad("kernels"));
        }
        let rows = elevations.as_chunks::<8>().0;
        let key = format!("{prefix}.brdf");
        let named = from.metadata.contains_key(&key);
        let brdf = named.then(|| reflectance::kept(from, &key)).transpose()?;
        let slices = Slices {
            centre,
            order: of[3] - 1,
            azimuth: of[1] - 1,
            slices: rows.iter().map(|r| Slice { theta_v: r[0], gamma: r[1] }).collect(),
            k,
            energy: rows.iter().map(|r| [r[2], r[3], r[4]]).collect(),
            cosine: rows.iter().map(|r| [r[5], r[6], r[7]]).collect(),
            accuracy,
        };
        Ok(Self { slices, brdf })
    }

    fn bytes(&self) -> usize {
        8 * self.slices.k.len()
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        self.brdf.as_deref()
    }
}
