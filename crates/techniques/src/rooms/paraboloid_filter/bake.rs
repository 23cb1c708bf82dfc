//! The filtered paraboloids.

use super::ParaboloidFilter;
use super::lobe::PhongLobe;
use crate::certify::Report;
use crate::shared::light::distant::DistantLight;
use crate::shared::material::reflectance::Reflectance;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use steradian_base::{ParamInfo, Task, params};
use steradian_parallel::prelude::*;
use steradian_prefilter::methods::{Footprint, Lookup, Paraboloids, paraboloids};
use steradian_prefilter::{EdgeCube, Power, angular, probe};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Texels across the disk; those of the filter where `None`.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 2048.0], 0.0, "texels across each paraboloid's disk; auto: those of the filter, as the footprint needs, at most 1024").auto(0.0).unit("texels"),
        /// Smallest radius of the kernel, texels.
        pub footprint: usize = ParamInfo::whole("footprint", [2.0, 64.0], 12.0, "smallest radius of the kernel in texels of the map that is filtered: wide kernels take small maps").unit("texels"),
        /// Radii that are blended.
        pub radii: usize = ParamInfo::whole("radii", [2.0, 16.0], 2.0, "filters of radii between R_S and 2 R_S, of which neighbours are blended; 2: as published"),
    }
}

/// ∫ (d·wi)₊^n L over d on two paraboloids, and the factor of the lookup.
#[derive(Debug, Clone, PartialEq)]
pub struct FilteredParaboloids {
    /// Front (+Z) and back (−Z): r, g, b, 1; rows of growing y.
    pub planes: [Vec<[f32; 4]>; 2],
    /// Texels a side.
    pub side: usize,
    /// Paraboloid coordinate of the outermost texel centres.
    pub extent: f32,
    /// Factor of the lobe.
    pub factor: [f32; 3],
    /// 1: about n; 0: about r.
    pub about_normal: f32,
}

impl FilteredParaboloids {
    fn new(made: &Paraboloids, lobe: &PhongLobe) -> Self {
        let plane = |p: &Vec<[f32; 3]>| p.iter().map(|t| [t[0], t[1], t[2], 1.0]).collect();
        Self {
            planes: made.planes().each_ref().map(plane),
            side: made.side(),
            extent: made.extent() as f32,
            factor: lobe.factor.map(|f| f as f32),
            about_normal: if lobe.about_normal { 1.0 } else { 0.0 },
        }
    }
}

/// Number of directions at which the maps are compared with the exact convolution.
const PROBES: usize = 240;
/// Rings of the disks: ρ² up to 1/5, to 4/5, to 1.
const RINGS: [&str; 3] = ["maps, middle", "maps, between", "maps, rim"];

/// Filters; the report compares the maps with the exact convolution.
pub fn link(
    light: &DistantLight,
    m: &Reflectance,
    p: &Params,
    task: &Task,
) -> Result<(FilteredParaboloids, Report), BakeError> {
    let lobe = PhongLobe::new(m);
    let side = p.size.map_or(1024, |size| size as u64 + 6);
    let need = 2 * (side * side * 32 + 1024 * 1024 * 16);
    if need > task.max_memory() {
        let (slug, allowed) = (ParaboloidFilter::CARD.slug, task.max_memory());
        return Err(BakeError::Memory { slug, need, allowed });
    }
    let footprint = Footprint {
        texels: p.footprint,
        radii: p.radii,
        size: p.size.unwrap_or(0),
        // With a cut at 60° lambert's error would be twice as large; exponents above 5 do not change.
        farthest: FRAC_PI_2,
    };
    let kernel = Power { n: lobe.n };
    let lookup = |n: usize| lookup(light, n);
    let (made, _) = paraboloids(&lookup, &light.source().small_lights, &kernel, &footprint, task)?;
    let maps = FilteredParaboloids::new(&made, &lobe);
    let (all, rings) = map_errors(light, &kernel, &made);
    let report = Report::default().detail("side", maps.side as f64).detail("maps", all);
    Ok((maps, RINGS.into_iter().zip(rings).fold(report, |r, (name, error)| r.detail(name, error))))
}

/// The light in texels like those of a cube of n × n.
fn lookup(light: &DistantLight, n: usize) -> Lookup {
    let Some(base) = &light.source().base else { return Box::new(|_| [0.0; 3]) };
    let cube = EdgeCube::from_image(base, n.clamp(8, 2 * base.height.max(4)));
    Box::new(move |d: DVec3| {
        let [r, g, b, _] = cube.sample(d.as_vec3().to_array());
        [r, g, b]
    })
}

/// Relative RMS errors of the maps against the exact convolution: over the sphere, and over rings of each
/// disk, the latter relative to the whole as well.
pub fn map_errors(light: &DistantLight, kernel: &Power, made: &Paraboloids) -> (f64, [f64; 3]) {
    let at = |k: usize| {
        let d = probe::direction(k, PROBES);
        let rho2 = (d.x * d.x + d.y * d.y) / (1.0 + d.z.abs()).powi(2);
        let (got, exact) = (made.bilinear(d), angular::convolve_at(&light.tree, kernel, d));
        let squares = |f: &dyn Fn(usize) -> f64| (0..3).map(|c| f(c).powi(2)).sum::<f64>();
        (
            usize::from(rho2 > 0.2) + usize::from(rho2 > 0.8),
            squares(&|c| got[c] - exact[c]),
            squares(&|c| exact[c]),
        )
    };
    let all: Vec<_> = (0..PROBES).into_par_iter().map(at).collect();
    let (mut count, mut sum, mut energy) = ([0.0; 3], [0.0; 3], 0.0);
    for (ring, error, square) in all {
        count[ring] += 1.0;
        sum[ring] += error;
        energy += square;
    }
    let part = |sum: f64, count: f64| {
        let (mean, whole) = (sum / f64::max(count, 1.0), energy / PROBES as f64);
        if whole > 0.0 { (mean / whole).sqrt() } else { 0.0 }
    };
    (part(sum.iter().sum(), PROBES as f64), std::array::from_fn(|k| part(sum[k], count[k])))
}

impl Part for FilteredParaboloids {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let shape = vec![2, self.side, self.side, 3];
        let data = self.planes.iter().flatten().flat_map(|t| [t[0], t[1], t[2]]).collect();
        put_f32(to, format!("{prefix}.paraboloids"), shape, data);
        let factors = [&self.factor[..], &[self.extent, self.about_normal]].concat();
        put_f32(to, format!("{prefix}.factors"), vec![5], factors);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.paraboloids");
        let (shape, v) = get_f32(from, &name, 4)?;
        let side = shape[1];
        if side < 2 || shape != [2, side, side, 3] {
            return Err(PartError::Unexpected(name));
        }
        let mut planes = v
            .chunks_exact(3 * side * side)
            .map(|plane| plane.chunks_exact(3).map(|t| [t[0], t[1], t[2], 1.0]).collect::<Vec<[f32; 4]>>());
        let planes = std::array::from_fn(|_| planes.next().unwrap_or_default());
        let name = format!("{prefix}.factors");
        let (_, v) = get_f32(from, &name, 1)?;
        let [r, g, b, extent, about_normal] = v[..] else { return Err(PartError::Unexpected(name)) };
        Ok(Self { planes, side, extent, factor: [r, g, b], about_normal })
    }

    fn bytes(&self) -> usize {
        2 * 16 * self.side * self.side + 20
    }
}
