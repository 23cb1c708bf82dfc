//! The twelve maps, and irradiance for the Lambertian part.

use super::ReflectionSpaceIbr;
use super::icosahedron::{VIEWS, vertex};
use crate::certify::Report;
use crate::shared::light::distant::DistantLight;
use crate::shared::material::views::{MOST, Seen};
use crate::shared::tables::chain::Chain;
use crate::shared::tables::{cube_bytes, load_cube, save_cube};
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Material, Part, Technique};
use steradian_base::{ParamInfo, Task, params};
use steradian_parallel::prelude::*;
use steradian_prefilter::ViewImage;
use steradian_prefilter::{Cosine, EdgeCube, filter, probe};
use steradian_sphere::sh::ShRgb;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Intervals per cube edge; where `None`, as many as the tolerance needs.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 512.0], 0.0, "intervals per cube edge of each of the twelve maps; auto: what the tolerance needs, at most 64").auto(0.0).unit("texels"),
        /// Is the Lambertian part split off?
        pub diffuse_split: bool = ParamInfo::switch("diffuse_split", true, "the Lambertian part of the reflectance has a map of its own, looked up by n; off: as published"),
        /// Direction that the warp keeps: 0 the normal, 1 the mirror direction.
        pub warp: usize = ParamInfo::choice("warp", &["normal", "mirror-direction"], "what the warp from one view to another keeps").numbered(0.0).preset("mirror-direction"),
    }
}

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 0.01;
/// Highest band of light and reflectance.
pub(super) const ORDER: usize = MOST;
/// Largest size that the tolerance chooses.
const LARGEST: usize = 64;
/// Directions at which each map is compared with the function that it tabulates.
const PROBES: usize = 96;

fn tolerance(task: &Task) -> f64 {
    task.tolerance().unwrap_or(TOLERANCE).clamp(1e-4, 0.1)
}

/// The slices of a material, from which the image of any view follows.
pub(super) fn seen(m: &Material, p: &Params, task: &Task) -> Result<Seen, BakeError> {
    Ok(Seen::bake(m, p.diffuse_split, tolerance(task), ORDER, task)?)
}

/// B_i over r for the twelve views, and irradiance over n.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewMaps {
    /// B_i of view i, over the direction into which that view is mirrored.
    pub views: Chain,
    /// Irradiance over n.
    pub irradiance: EdgeCube,
    /// f of the Lambertian part, sr⁻¹.
    pub diffuse: [f32; 3],
    /// Does the warp keep r? Else it keeps n.
    pub mirror: bool,
}

fn black() -> EdgeCube {
    EdgeCube::from_fn(1, |_| [0.0; 3])
}

/// The maps at one size.
fn cubes(images: &[ViewImage], size: usize) -> Vec<EdgeCube> {
    images.iter().map(|v| EdgeCube::from_fn(size, |r| v.towards(r))).collect()
}

/// Relative RMS error of lookups in the cubes, against the images.
fn interpolation(images: &[ViewImage], cubes: &[EdgeCube]) -> f64 {
    let pairs: Vec<_> = images
        .par_iter()
        .zip(cubes)
        .flat_map_iter(|(v, c)| {
            (0..PROBES).map(|k| {
                let r = probe::direction(k, PROBES);
                let [x, y, z, _] = c.sample(r.as_vec3().to_array()).map(f64::from);
                ([x, y, z], v.towards(r))
            })
        })
        .collect();
    probe::relative_rms(pairs.into_iter())
}

/// The maps at the size that the parameters give, or at the smallest one whose interpolation error is within
/// the tolerance.
fn tabulate(images: &[ViewImage], p: &Params, task: &Task) -> Result<(Vec<EdgeCube>, f64), BakeError> {
    let mut size = p.size.unwrap_or(8);
    loop {
        let need = (VIEWS * 6 * 16 * (size + 1) * (size + 1)) as u64;
        if need > task.max_memory() {
            let (slug, allowed) = (ReflectionSpaceIbr::CARD.slug, task.max_memory());
            return Err(BakeError::Memory { slug, need, allowed });
        }
        task.check()?;
        let made = cubes(images, size);
        let error = interpolation(images, &made);
        if p.size.is_some() || size >= LARGEST || error <= 0.5 * tolerance(task) {
            return Ok((made, error));
        }
        size *= 2;
    }
}

/// Clamps negative texels, which truncated series have next to bright light, to 0; returns their share of all
/// radiance.
fn clip(cubes: &mut [EdgeCube]) -> f64 {
    let (mut lost, mut all) = (0.0, 0.0);
    for cube in cubes {
        let mut texels = cube.texels().to_vec();
        for x in texels.iter_mut().flat_map(|t| &mut t[..3]) {
            all += f64::from(x.abs());
            lost += f64::from((-*x).max(0.0));
            *x = x.max(0.0);
        }
        if let Some(c) = EdgeCube::from_texels(cube.size(), texels) {
            *cube = c;
        }
    }
    if all > 0.0 { lost / all } else { 0.0 }
}

fn views(light: &ShRgb, m: &Seen, p: &Params, task: &Task) -> Result<(Vec<EdgeCube>, f64), BakeError> {
    if m.slices.is_zero() {
        return Ok((vec![black(); VIEWS], 0.0));
    }
    task.begin("views", VIEWS as u64);
    let image = |k| {
        task.advance(1);
        ViewImage::new(&m.slices, light, vertex(k))
    };
    let images: Vec<_> = (0..VIEWS).into_par_iter().map(image).collect();
    task.end();
    tabulate(&images, p, task)
}

/// Joins light and reflectance.
pub fn link(
    light: &DistantLight,
    m: &Seen,
    p: &Params,
    task: &Task,
) -> Result<(ViewMaps, Report), BakeError> {
    let (mut cubes, interpolation) = views(&light.source().coefficients(m.slices.order()), m, p, task)?;
    let diffuse = m.slices.diffuse;
    let split = diffuse != [0.0; 3];
    // Without its Lambertian part the reflected light may rightly be negative.
    let clipped = if split || light.source().negative { 0.0 } else { clip(&mut cubes) };
    let irradiance = if split {
        let size = filter::Size::UpTo(LARGEST);
        filter(light.source(), &light.tree, &Cosine, size, 0.5 * tolerance(task), task)?.cube
    } else {
        black()
    };
    let size = cubes[0].size();
    let slug = ReflectionSpaceIbr::CARD.slug;
    let views = Chain::new(cubes).ok_or_else(|| BakeError::Light { slug, why: "no views".into() })?;
    let maps = ViewMaps { views, irradiance, diffuse: diffuse.map(|f| f as f32), mirror: p.warp == 1 };
    let report = Report::default()
        .detail("order", m.slices.order() as f64)
        .detail("missing", m.slices.missing)
        .detail("blur", m.slices.blur)
        .detail("size", size as f64)
        .detail("interpolation", interpolation)
        .detail("clipped", clipped);
    Ok((maps, report))
}

impl Part for ViewMaps {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.views.save(to, &format!("{prefix}.views"));
        save_cube(&self.irradiance, to, format!("{prefix}.irradiance"));
        let [r, g, b] = self.diffuse;
        put_f32(to, format!("{prefix}.diffuse"), vec![4], vec![r, g, b, if self.mirror { 1.0 } else { 0.0 }]);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.views");
        let views = Chain::load(from, &name)?;
        let size = views.levels()[0].size();
        if views.levels().len() != VIEWS || views.levels().iter().any(|c| c.size() != size) {
            return Err(PartError::Unexpected(name));
        }
        let irradiance = load_cube(from, &format!("{prefix}.irradiance"))?;
        let name = format!("{prefix}.diffuse");
        let (_, v) = get_f32(from, &name, 1)?;
        let [r, g, b, mirror] = v[..] else { return Err(PartError::Unexpected(name)) };
        Ok(Self { views, irradiance, diffuse: [r, g, b], mirror: mirror == 1.0 })
    }

    fn bytes(&self) -> usize {
        self.views.bytes() + cube_bytes(&self.irradiance)
    }
}
