//! The reflectance's slices at all elevations that may become nodes.

use crate::shared::material::kernels::{COARSE, Kernels, refused};
use crate::{BakeError, Material};
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::Brdf;
use steradian_brdf::central::{CentralError, Centre, Slice, Slices};

/// Tolerance where the user gives none.
pub const TOLERANCE: f64 = 0.01;
/// Elevations of the slices, about the mirror direction and about the tangent.
const ELEVATIONS: [usize; 2] = [41, 81];
/// Last elevation, degrees: at 90° itself lobes degenerate.
const LAST: f64 = 89.5;
/// Elevations at which centres are chosen.
const CENTRES: usize = 11;
/// F and Q of the slices at first, and larger ones for lobes that need them.
const ORDERS: [[usize; 2]; 3] = [[64, 16], [128, 32], [255, 64]];
/// Views up to which they must represent the lobe, degrees.
const VIEWS: f64 = 86.5;

/// Memory of the maps at most, MiB, without and with a tolerance of the user's.
const MEBIBYTES: [f64; 2] = [96.0, 320.0];

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// F; by tolerance where `None`.
        pub order: Option<usize> = ParamInfo::whole("order", [0.0, 255.0], 0.0, "F, the highest l; auto: what the tolerance needs").auto(-1.0),
        /// Intervals from pole to pole; by tolerance where `None`.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 1024.0], 0.0, "intervals from pole to pole of the maps; auto: what the tolerance needs, slice by slice").auto(0.0).unit("texels"),
        /// Memory of the maps, MiB; [`MEBIBYTES`] where `None`.
        pub mebibytes: Option<f64> = ParamInfo::real("mebibytes", [0.0, 4096.0], 0.0, "memory of the maps at most: beyond it resolutions fall and the certificate says what that costs; auto: 96, or 320 where a tolerance is asked for").auto(0.0).unit("MiB"),
        /// 16-bit maps.
        pub halves: bool = ParamInfo::switch("halves", false, "maps of 16-bit floats"),
        /// Number of small lights that are shaded separately; by tolerance where `None`.
        pub lights: Option<usize> = ParamInfo::whole("lights", [0.0, 256.0], 0.0, "small disks that are taken out of the light and shaded with the exact reflectance; auto: suns, and what else the tolerance needs, at most 128").auto(-1.0),
    }
}

impl Params {
    /// Bytes of the maps at most.
    pub fn budget(&self, task: &Task) -> usize {
        let usual = MEBIBYTES[usize::from(task.tolerance().is_some())];
        (self.mebibytes.unwrap_or(usual) * f64::from(1 << 20)) as usize
    }
}

/// The coordinate, 0 … 1, along the elevations of an angle between n and wo.
#[inline(always)]
pub fn place(theta_v: f32) -> f32 {
    const INVERSE: f32 = (180.0 / (LAST * PI)) as f32;
    1.0 - (1.0 - (theta_v * INVERSE).min(1.0)).sqrt()
}

/// The inverse of [`place`].
fn angle(s: f64) -> f64 {
    LAST.to_radians() * (1.0 - (1.0 - s) * (1.0 - s))
}

/// Candidate centres, as a part of the way from the mirror direction to the middle of the lobe (the direction
/// of ∫ f_cos² wi dwi): a small part for lobes, whose tails need fewer q about the mirror direction, all of
/// it for reflectance that is nearly diffuse.
const LEANS: [f64; 2] = [0.3, 1.0];
/// F and Q at which these candidates are compared.
const TRIAL: [usize; 2] = [48, 8];

/// Angle γ between n and C at the coordinates 0 … 1 of [`place`], for that candidate of [`LEANS`] that leaves
/// the least energy beyond Q.
fn centres(brdf: &dyn Brdf, task: &Task) -> Result<Vec<f64>, CentralError> {
    let middle = |i: usize| Slice::leaning(brdf, angle(i as f64 / (CENTRES - 1) as f64));
    let middles = (0..CENTRES).map(middle).collect::<Result<Vec<_>, _>>()?;
    let mut best = (f64::INFINITY, Vec::new());
    for lean in LEANS {
        let gamma = |m: &Slice| (m.theta_v + lean * (m.gamma - m.theta_v)).clamp(0.0, FRAC_PI_2);
        let gammas: Vec<f64> = middles.iter().map(gamma).collect();
        let slices = middles.iter().zip(&gammas).map(|(m, g)| Slice { theta_v: m.theta_v, gamma: *g });
        let s = Slices::to(brdf, Centre::Reflection, slices.collect(), TRIAL, COARSE, task)?;
        let beyond = (0..CENTRES).map(|i| beyond(&s, i)).sum::<f64>();
        if beyond < best.0 {
            best = (beyond, gammas);
        }
    }
    Ok(best.1)
}

/// The share of a slice's energy that its orders miss.
fn beyond(s: &Slices, slice: usize) -> f64 {
    let energy: f64 = s.energy[slice].iter().sum();
    let captured: f64 = s.captured(slice, s.order, s.azimuth).iter().sum();
    if energy > 0.0 { (1.0 - captured / energy).max(0.0) } else { 0.0 }
}

/// Slices about centres between the mirror direction and the middle of the lobe, denser towards grazing:
/// θ_v = 89.5° (1 − (1 − s)²), s evenly spaced. About the tangent θ_o is evenly spaced.
pub fn bake(slug: &'static str, m: &Material, p: &Params, task: &Task) -> Result<Kernels, BakeError> {
    let refused = refused(slug);
    let brdf = &*m.brdf;
    let [about_mirror, about_tangent] = ELEVATIONS;
    let (centre, slices): (_, Vec<Slice>) = if brdf.is_isotropic() {
        let gamma = centres(brdf, task).map_err(&refused)?;
        let lean = |s: f64| {
            let x = s * (CENTRES - 1) as f64;
            let i = (x as usize).min(CENTRES - 2);
            gamma[i] + (gamma[i + 1] - gamma[i]) * (x - i as f64)
        };
        let part = |i: usize| i as f64 / (about_mirror - 1) as f64;
        let slice = |i: usize| Slice { theta_v: angle(part(i)), gamma: lean(part(i)) };
        (Centre::Reflection, (0..about_mirror).map(slice).collect())
    } else {
        let part = |i: usize| i as f64 / (about_tangent - 1) as f64;
        (Centre::Tangent, (0..about_tangent).map(|i| Slice::tangent(PI * part(i))).collect())
    };
    let share = (0.4 * task.tolerance().unwrap_or(TOLERANCE)).powi(2);
    let orders = ORDERS.map(|[f, q]| [p.order.unwrap_or(f), q]);
    let views = VIEWS.to_radians();
    Kernels::new(m, centre, &slices, &orders, views, share, task).map_err(refused)
}
