//! Materials as small neural networks.
//!
//! Sztrajman, Rainer, Ritschel & Weyrich 2021, Neural BRDF Representation and Importance Sampling: f is a
//! network of layers 6 → 21 → 21 → 3 with rectifiers, of the half vector and the difference vector
//! (Rusinkiewicz 1998) with the half vector's azimuth turned to 0:
//!
//! **f = max(0, exp(x) − 1)**, x the output, sr⁻¹ per channel.
//!
//! File: 675 little-endian 32-bit floats per material, `W₁[6][21] b₁[21] W₂[21][21] b₂[21] W₃[21][3] b₃[3]`,
//! inputs outermost; names beside it, one per line, in the file called like it with `_names.txt` for
//! `_f32le.bin`. A network is not reciprocal in its difference vector; here f is the mean of the network over
//! both orders of the directions.

use super::materials;
use super::tabulated::{self, Tabulated, Twin};
use crate::math::half;
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Info, SharedBrdf, SpecError};
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;
use steradian_base::ParamInfo;
use steradian_formats::{Limits, NBRDF_NUMBERS, decode_nbrdf};

/// The page.
pub static INFO: Info = Info {
    name: "nbrdf",
    source: "Sztrajman, Rainer, Ritschel & Weyrich 2021",
    formula: "f = max(0, exp(x) − 1), x a network 6 → 21 → 21 → 3 of half and difference vectors; the mean over both orders of wi and wo",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::file("file", "path of the networks (merl_nbrdf_f32le.bin)").positional(),
        ParamInfo::name("material", "a material of its list, such as gold-metallic-paint").positional(),
        ParamInfo::file("names", "path of the list; beside the networks, _names.txt for _f32le.bin"),
    ],
    reciprocity: "reciprocal",
    energy: "as fitted to measurements",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// Neurons of each of the two hidden layers.
const HIDDEN: usize = 21;
/// More materials than any such file has.
const MAX_BYTES: u64 = 16 << 20;
/// Three layers of up to 21 products each then stay below 1e31, so that no sum overflows. Trained weights are
/// of order 10.
const MAX_WEIGHT: f32 = 1e9;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let bytes = a.bytes(path, MAX_BYTES, "a file of networks")?;
        let names = materials::list(path, &names(path), a);
        let row = materials::find(&names, a.name("material").as_deref(), a)?;
        let weights = decode_nbrdf(path, &bytes, row, &Limits::default())?;
        Network::new(&weights).ok_or_else(|| SpecError::File {
            file: path.display().to_string(),
            what: format!("a weight of the material lies beyond {MAX_WEIGHT:e}"),
        })
    };
    let keep = |numbers: &[f64]| {
        let weights: Vec<f32> = numbers.iter().map(|v| *v as f32).collect();
        Network::new(&weights)
    };
    tabulated::make(a, "nbrdf:merl_nbrdf_f32le.bin,chrome", read, keep)
}

/// The list of names in the folder of a file of networks.
pub(super) fn names(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let stem = name.strip_suffix(".bin").unwrap_or(&name);
    format!("{}_names.txt", stem.strip_suffix("_f32le").unwrap_or(stem))
}

/// One material.
#[derive(Debug, Clone)]
struct Network {
    weights: Vec<f32>,
}

/// One layer: `inputs` outermost in `w`.
fn layer<const N: usize>(inputs: &[f32], w: &[f32], bias: &[f32]) -> [f32; N] {
    let mut out = [0.0; N];
    out.copy_from_slice(bias);
    for (x, row) in inputs.iter().zip(w.chunks_exact(N)) {
        out.iter_mut().zip(row).for_each(|(o, w)| *o += x * w);
    }
    out
}

impl Network {
    fn new(weights: &[f32]) -> Option<Self> {
        if weights.len() != NBRDF_NUMBERS || weights.iter().any(|v| !(-MAX_WEIGHT..=MAX_WEIGHT).contains(v)) {
            return None;
        }
        Some(Self { weights: weights.to_vec() })
    }

    /// f of the half vector (sin θ_h, 0, cos θ_h) and the difference vector.
    fn apply(&self, h: [f64; 2], d: DVec3) -> [f64; 3] {
        let input = [h[0], 0.0, h[1], d.x, d.y, d.z].map(|v| v as f32);
        let (w1, rest) = self.weights.split_at(6 * HIDDEN);
        let (b1, rest) = rest.split_at(HIDDEN);
        let (w2, rest) = rest.split_at(HIDDEN * HIDDEN);
        let (b2, rest) = rest.split_at(HIDDEN);
        let (w3, b3) = rest.split_at(HIDDEN * 3);
        let one = layer::<HIDDEN>(&input, w1, b1).map(|x| x.max(0.0));
        let two = layer::<HIDDEN>(&one, w2, b2).map(|x| x.max(0.0));
        // A network may run away far from its data: beyond e³⁰ nothing was measured.
        layer::<3>(&two, w3, b3).map(|x| f64::from(x).clamp(0.0, 30.0).exp_m1())
    }
}

impl Tabulated for Network {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn is_interpolated(&self) -> bool {
        false
    }

    fn held(&self) -> Vec<f64> {
        self.weights.iter().map(|v| f64::from(*v)).collect()
    }

    fn twin(&self) -> Option<Twin> {
        // 675 numbers are 225 cells of three.
        let cells = self.weights.as_chunks::<3>().0.to_vec();
        let source = concat!(include_str!("half.wgsl"), include_str!("nbrdf.wgsl"));
        Some(Twin { source, parameters: Vec::new(), cells: Arc::new(cells) })
    }

    fn value(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let h = half(wi, wo);
        let s = h.x.hypot(h.y);
        let (cp, sp) = if s > 0.0 { (h.x / s, h.y / s) } else { (1.0, 0.0) };
        let (x, y) = (DVec3::new(h.z * cp, h.z * sp, -s), DVec3::new(-sp, cp, 0.0));
        let d = DVec3::new(x.dot(wi), y.dot(wi), h.dot(wi));
        let swapped = DVec3::new(-d.x, -d.y, d.z);
        let (a, b) = (self.apply([s, h.z], d), self.apply([s, h.z], swapped));
        std::array::from_fn(|c| 0.5 * (a[c] + b[c]))
    }
}

/// Pairs of directions within 70° of the normal (R4 sequence of Roberts 2018).
#[cfg(test)]
pub(super) fn pairs(n: u32) -> impl Iterator<Item = (DVec3, DVec3)> {
    (0..n).map(|i| {
        let u = |g: f64| (0.5 + g * f64::from(i)).fract();
        let at = |a: f64, b: f64| crate::math::spherical(1.22 * a, crate::math::turn(b));
        (at(u(0.856_674_9), u(0.733_891_9)), at(u(0.628_706_7), u(0.538_595_5)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::check_measured;
    use crate::{Files, parse_with};

    #[test]
    fn the_published_networks() {
        let Some(path) = steradian_testkit::data("brdfs/merl_reduced/merl_nbrdf_f32le.bin") else { return };
        for name in ["chrome", "blue-acrylic", "white-fabric"] {
            let spec = format!("nbrdf:{},{name}", path.display());
            check_measured(&*parse_with(&spec, Files::Any).expect("valid"));
        }
        let Some(path) = steradian_testkit::data("brdfs/merl_reduced/rgl-isotropic_nbrdf_f32le.bin") else {
            return;
        };
        let spec = format!("nbrdf:{},paper_white_rgb", path.display());
        check_measured(&*parse_with(&spec, Files::Any).expect("valid"));
    }

    /// Two independent models of the same measurements: median difference of the logarithms.
    #[test]
    fn near_the_tabulated_factors() {
        let Some(folder) = steradian_testkit::data("brdfs/merl_reduced") else { return };
        let folder = folder.display();
        let mut logs = Vec::new();
        for name in ["gold-metallic-paint", "pink-felt", "blue-acrylic", "alum-bronze"] {
            let open = |spec: String| parse_with(&spec, Files::Any).expect("valid");
            let npf = open(format!("npf:{folder}/npf.bin,{name}"));
            let net = open(format!("nbrdf:{folder}/merl_nbrdf_f32le.bin,{name}"));
            logs.extend(pairs(200).map(|(i, o)| (npf.eval(i, o)[1] / net.eval(i, o)[1]).ln().abs()));
        }
        logs.sort_by(f64::total_cmp);
        assert!(logs[logs.len() / 2] < 0.15, "{}", logs[logs.len() / 2]);
    }
}
