//! One lookup along n; `shade.wgsl` has the same functions.

use super::bake::Albedo;
use crate::gpu::{Entry, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Point};
use crate::shared::surface::lobe;
use crate::shared::tables::cube_table;
use crate::{GpuTechnique, Points, Radiance, Technique};
use steradian_prefilter::EdgeCube;

pub(super) fn shade(
    map: &EdgeCube,
    albedo: &Albedo,
    turn: &LightRotation,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    batch::shade(q, out, |p: Point| {
        let e = map.sample(turn.apply(p.n));
        std::array::from_fn(|c| albedo.0[c] * e[c])
    });
}

/// [`shade`] where every point has its own normals: the mean of four lookups.
pub(super) fn shade_lobe(
    map: &EdgeCube,
    albedo: &Albedo,
    turn: &LightRotation,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    lobe::shade(q, out, |p| {
        let e = lobe::normals(p).map(|n| map.sample(turn.apply(n)));
        std::array::from_fn(|c| 0.25 * albedo.0[c] * (e[0][c] + e[1][c] + e[2][c] + e[3][c]))
    });
}

/// [`gpu`] with a lobe per point.
pub(super) fn gpu_lobe(map: &EdgeCube, albedo: &Albedo, turn: &LightRotation) -> GpuTechnique {
    let modules =
        vec![lobe::WGSL.into(), include_str!("shade.wgsl").into(), include_str!("shade_lobe.wgsl").into()];
    GpuTechnique { modules, entry: Entry::LOBE, ..gpu(map, albedo, turn) }
}

pub(super) fn gpu(map: &EdgeCube, albedo: &Albedo, turn: &LightRotation) -> GpuTechnique {
    let [r, g, b] = albedo.0;
    GpuTechnique {
        slug: super::DiffuseMap::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![cube_table("irradiance_over_pi", map)],
        uniforms: vec![turn.uniform(), Uniform { name: "albedo", value: Value::Vec4([r, g, b, 0.0]) }],
        buffers: Vec::new(),
    }
}
