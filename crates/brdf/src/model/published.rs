//! Published sets of Lafortune lobes: three isotropic lobes and a diffuse albedo per channel.
//!
//! - `skin-steve` (also `skin`) and `skin-mahesh`: Marschner, Westin, Lafortune, Torrance, Greenberg 1999,
//!   Image-Based BRDF Measurement Including Human Skin; the Cornell Program of Computer Graphics' fits, as
//!   BRDFLab ships them.
//! - `blue-paint`: light blue house paint, gonioreflectometer measurements, Lafortune et al. 1997; the
//!   numbers of pbrt's BluePaint (Cornell's format page of `blLfrtn` prints three of them differently).
//! - `krylon-blue`: Krylon 7205 "True Blue" spray enamel under a glass frosting. Cornell published its
//!   measurements but no lobes, and `blue-paint` is not it (its diffuse part is four times as bright). This
//!   is our own fit: least squares of f^(1/3) weighted by √(cos θ_i cos θ_o), elevations below 81°, to the
//!   1439 spectra in linear Rec. 709 (flat spectrum = white); rms error 2.6, 1.9 and 1.8 % of unit f^(1/3).
//!   The enamel's diffuse blue lies outside Rec. 709, so red has no diffuse part.
//! - `clay`, `felt`, `primer`, `brushed-metal`: the same laboratory's, as in pbrt's Clay, Felt, Primer and
//!   BrushedMetal; `bluish`: as in BRDFLab.

use super::lafortune::{Cosine, Lafortune};
use crate::SpecError;
use glam::DVec3;
use steradian_base::nearest;

/// Diffuse albedo, then per lobe c_xy, c_z and n, all per channel.
struct Set {
    name: &'static str,
    kd: [f64; 3],
    lobes: &'static [[[f64; 3]; 3]],
}

const STEVE: Set = Set {
    name: "skin-steve",
    kd: [0.428425, 0.301341, 0.331054],
    lobes: &[
        [
            [-1.131747, -1.016939, -0.966018],
            [-1.209182, -1.462488, -1.222419],
            [6.421658, 3.699932, 3.524889],
        ],
        [[-0.546570, -0.643533, -0.638934], [0.380123, 0.410559, 0.437367], [3.685044, 4.266495, 4.539742]],
        [
            [-0.998888, -1.020153, -1.027479],
            [0.857998, 0.703913, 0.573625],
            [64.208486, 63.919687, 43.809866],
        ],
    ],
};

/// BRDFLab stores the diffuse part as f; times π.
const fn albedo(f: [f64; 3]) -> [f64; 3] {
    let pi = std::f64::consts::PI;
    [f[0] * pi, f[1] * pi, f[2] * pi]
}

static SETS: &[Set] = &[
    Set { name: "skin", ..STEVE },
    STEVE,
    Set {
        name: "skin-mahesh",
        kd: albedo([0.065704, 0.043181, 0.049810]),
        lobes: &[
            [
                [-0.418599, -0.418849, -0.663313],
                [0.399808, 0.397372, 0.591432],
                [3.327653, 3.502029, 5.782860],
            ],
            [
                [-1.030919, -1.030556, -1.042135],
                [0.832314, 0.823648, 0.797070],
                [28.298369, 25.766759, 31.002562],
            ],
        ],
    },
    Set {
        name: "blue-paint",
        kd: [0.3094, 0.39667, 0.70837],
        lobes: &[
            [
                [0.870567, 0.857255, 0.670982],
                [0.803624, 0.774290, 0.586674],
                [21.820103, 18.597755, 7.472717],
            ],
            [
                [-0.451218, -0.406681, -0.477976],
                [0.023123, 0.017625, 0.227295],
                [2.774499, 2.581499, 3.677653],
            ],
            [
                [-1.031545, -1.029426, -1.026588],
                [0.706734, 0.696530, 0.687715],
                [66.899060, 63.767912, 57.489181],
            ],
        ],
    },
    Set {
        name: "krylon-blue",
        kd: [0.0, 0.039713, 0.157104],
        lobes: &[
            [
                [-0.983538, -0.997521, -1.007516],
                [0.938002, 0.946274, 0.901907],
                [34.814207, 44.858411, 25.618279],
            ],
            [
                [-1.019316, -1.024671, -1.022068],
                [0.945876, 0.924749, 0.918969],
                [196.404951, 154.766599, 213.996061],
            ],
            [
                [-1.001236, -0.682062, -0.000372],
                [0.577085, 0.498048, 0.001353],
                [16.843228, 5.461470, 0.495915],
            ],
        ],
    },
    Set {
        name: "clay",
        kd: [0.383626, 0.260749, 0.274207],
        lobes: &[
            [
                [-1.089701, -1.102701, -1.107603],
                [-1.354682, -2.714801, -1.569866],
                [17.968505, 11.024489, 21.270282],
            ],
            [
                [-0.733381, -0.793320, -0.848206],
                [0.676108, 0.679314, 0.726031],
                [8.219745, 9.055139, 11.261951],
            ],
            [
                [-1.010548, -1.012378, -1.011263],
                [0.910783, 0.885239, 0.892451],
                [152.912795, 141.937171, 201.046802],
            ],
        ],
    },
    Set {
        name: "felt",
        kd: [0.025865; 3],
        lobes: &[
            [[-0.304075; 3], [-0.065992; 3], [3.047892; 3]],
            [[-0.749561; 3], [-1.167929; 3], [6.931827; 3]],
            [[1.004921; 3], [-0.205529; 3], [94.117332; 3]],
        ],
    },
    Set {
        name: "primer",
        kd: [0.118230, 0.121218, 0.133209],
        lobes: &[
            [
                [-0.399286, -1.033473, -1.058104],
                [0.167504, 0.009545, -0.068002],
                [2.466633, 7.637253, 8.117645],
            ],
            [
                [-1.041861, -1.100108, -1.087779],
                [0.014375, -0.198147, -0.053605],
                [7.993722, 29.446268, 41.988990],
            ],
            [
                [-1.098605, -0.379883, -0.449038],
                [-0.145110, 0.159127, 0.173224],
                [31.899719, 2.372852, 2.636161],
            ],
        ],
    },
    Set {
        name: "bluish",
        kd: albedo([0.010648, 0.008233, 0.014273]),
        lobes: &[
            [
                [-0.277165, -0.304075, -0.027758],
                [-0.093227, -0.065992, -0.020082],
                [2.799133, 3.047892, 1.194497],
            ],
            [
                [-0.750466, -0.749561, -0.741817],
                [-1.130948, -1.167929, -0.806141],
                [6.860946, 6.931827, 6.484858],
            ],
            [
                [-1.001165, -1.004921, -1.007235],
                [-0.476192, -0.205529, -0.249148],
                [69.053333, 94.117332, 94.094831],
            ],
        ],
    },
    Set {
        name: "brushed-metal",
        kd: [0.0; 3],
        lobes: &[
            [[-1.11854, -1.11845, -1.11999], [1.01272, 1.01469, 1.01942], [15.8708, 15.6489, 15.4571]],
            [[-1.05334, -1.06409, -1.08378], [0.69541, 0.662178, 0.626672], [111.267, 88.9222, 65.2179]],
            [[-1.01684, -1.01635, -1.01529], [1.00132, 1.00112, 1.00108], [180.181, 184.152, 195.773]],
        ],
    },
];

/// The names, without `@`.
pub(crate) fn names() -> Vec<&'static str> {
    SETS.iter().map(|s| s.name).collect()
}

/// The set of a name, with or without `@`.
pub(crate) fn find(name: &str) -> Result<Lafortune, SpecError> {
    let bare = name.trim_start_matches('@').to_ascii_lowercase().replace('_', "-");
    match SETS.iter().find(|s| s.name == bare) {
        Some(set) => Ok(set.brdf()),
        None => {
            let available = names();
            let nearest = nearest(&bare, &available);
            Err(SpecError::UnknownSet { model: "lafortune", name: name.into(), nearest, available })
        }
    }
}

impl Set {
    fn brdf(&self) -> Lafortune {
        let lobe = |l: &[[f64; 3]; 3]| {
            std::array::from_fn(|i| Cosine { c: DVec3::new(l[0][i], l[0][i], l[1][i]), n: l[2][i], ks: 1.0 })
        };
        let lobes = self.lobes.iter().map(lobe).collect();
        Lafortune { spec: format!("lafortune:@{}", self.name), kd: self.kd, lobes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Brdf;

    #[test]
    fn the_page_names_every_set() {
        let page = super::super::lafortune::INFO.parameters[0].doc;
        assert!(names().iter().all(|n| page.contains(n)), "{page}");
    }

    /// Cornell's measurements, at the three wavelengths where they are nearest to the Rec. 709 primaries'
    /// hues.
    #[test]
    fn krylon_blue_follows_the_measured_blue() {
        let Some(path) = steradian_testkit::data("brdfs/cornell/krylon_blue.brdf") else { return };
        let text = std::fs::read_to_string(path).expect("readable");
        let lines = text.lines().filter(|l| !l.starts_with('#'));
        let numbers: Vec<f64> =
            lines.flat_map(str::split_whitespace).map(|x| x.parse().expect("number")).collect();
        let brdf = find("krylon-blue").expect("known");
        let mut ratios: Vec<f64> = Vec::new();
        for r in numbers[32..].chunks_exact(35).filter(|r| r[0] < 1.2 && r[2] < 1.2) {
            let (wi, wo) = (crate::math::spherical(r[0], r[1]), crate::math::spherical(r[2], r[3]));
            ratios.push(brdf.eval(wi, wo)[2] / r[4 + 6]);
        }
        ratios.sort_by(f64::total_cmp);
        let middle = ratios[ratios.len() / 2];
        // As many of the file's 1439 samples lie below 1.2 rad on both sides.
        assert_eq!(ratios.len(), 660);
        assert!((0.75..1.33).contains(&middle), "{middle}");
    }
}
