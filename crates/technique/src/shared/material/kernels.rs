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

/// RMS error to which reflectance is integrated where centres are compared.
pub const COARSE: f64 = 1e-3;

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
    /// [`Slices::sufficient`] of a material, and the reflectance itself.
    pub fn new(
        material: &Material,
        centre: Centre,
        elevations: &[Slice],
        orders: &[[usize; 2]],
        views: f64,
        share: f64,
        task: &Task,
    ) -> Result<Self, CentralError> {
        let slices = Slices::sufficient(&*material.brdf, centre, elevations, orders, views, share, task)?;
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

impl Part for Kernels {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let s = &self.slices;
        let head = vec![s.centre.number(), s.accuracy];
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
        let centre = Centre::from_number(centre).ok_or_else(|| bad("centre"))?;
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
