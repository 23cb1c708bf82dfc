//! Bumps of a surface: normals, and the heights that they come from.

use crate::local::{Content, Plane};
use crate::shared::maths::vector::dot;
use crate::{BakeError, Material};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use steradian_base::ParamInfo;
use steradian_relight::height::HeightField;
use steradian_scene::surface::{NormalMap, Texture, Wrap};

/// Name of the plane of heights, 0 … 1.
pub const HEIGHT: &str = "height";
/// The plane of unit normals.
pub const NORMAL: &str = "normal";

/// The files of bumps: heights and normals.
pub const PLANES: [Plane; 2] = [Plane::new(HEIGHT, Content::Heights), Plane::new(NORMAL, Content::Normals)];
/// The parameter that names the height map.
pub const HEIGHT_FILE: ParamInfo =
    ParamInfo::file(HEIGHT, "height map, which repeats: its alpha, else its luminance; auto: none")
        .auto(f64::NAN);
/// The parameter that names the normal map.
pub const NORMAL_FILE: ParamInfo = ParamInfo::file(
    NORMAL,
    "normal map, green up, in place of the heights' normals; auto: that of the material",
)
.auto(f64::NAN);
/// Height of white in the height map.
pub const RELIEF: ParamInfo = ParamInfo::real(
    "relief",
    [-10.0, 10.0],
    0.05,
    "height of white above black, in widths of the height map",
);
/// Least n'·wo, unless the unbumped surface itself is seen at less.
const GRAZING: f32 = 0.01;

/// Normals, and where needed data of the height field, of a bumpy surface.
#[derive(Debug, Clone)]
pub struct Bumps {
    /// The normals with their moments.
    pub map: Arc<NormalMap>,
    /// The heights in texels, where there are any.
    pub field: Option<Arc<HeightField>>,
}

/// The texels of the finest level.
fn finest(t: &Texture) -> (usize, usize, &[[f32; 3]]) {
    t.levels().next().unwrap_or((0, 0, &[]))
}

impl Bumps {
    /// The bumps of a material's planes; `None` where it has none. White is `relief` times the width of the
    /// height map above black. Normals are those of the plane of normals where there is one, else the
    /// heights' by central differences.
    pub fn of(slug: &'static str, m: &Material, relief: f64) -> Result<Option<Self>, BakeError> {
        let field = match m.textures.get(HEIGHT) {
            Some(t) => {
                let (width, height, texels) = finest(t);
                let scale = (relief * width as f64) as f32;
                let z = texels.iter().map(|v| scale * v[0]).collect();
                let field = HeightField::new(width, height, z);
                let field = field.map_err(|e| BakeError::Material { slug, why: format!("{HEIGHT}: {e}") })?;
                Some((field, t.wrap()))
            }
            None => None,
        };
        let normals = |width: usize, height: usize, all: &[Vec3], wrap: [Wrap; 2]| {
            let map = NormalMap::from_normals(width, height, all);
            map.map(|map| Arc::new(map.with_wrap(wrap)))
        };
        let map = match (m.textures.get(NORMAL), &field) {
            (Some(t), _) => {
                let (width, height, texels) = finest(t);
                let all: Vec<Vec3> =
                    texels.iter().map(|n| Vec3::from_array(*n).try_normalize().unwrap_or(Vec3::Z)).collect();
                normals(width, height, &all, t.wrap())
            }
            (None, Some((f, wrap))) => {
                let (width, height) = (f.width(), f.height());
                let all: Vec<Vec3> = (0..width * height).map(|k| f.normal(k % width, k / width)).collect();
                normals(width, height, &all, *wrap)
            }
            (None, None) => None,
        };
        Ok(map.map(|map| Self { map, field: field.map(|f| Arc::new(f.0)) }))
    }

    /// The unit normal of a texel.
    pub fn normal(&self, [i, j]: [usize; 2]) -> DVec3 {
        let (width, _, texels) = finest(self.map.mean());
        texels.get(j * width + i).map_or(DVec3::Z, |n| Vec3::from_array(*n).as_dvec3().normalize_or(DVec3::Z))
    }
}

/// Tangent and bitangent across the unit normal `n`, in the frame whose third axis is the surface's own
/// normal: the first axis projected, and n × it.
#[inline(always)]
pub fn frame([x, y, z]: [f32; 3]) -> [[f32; 3]; 2] {
    let t = [1.0 - x * x, -x * y, -x * z];
    let square = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
    // A normal along the first axis has no part of it to project.
    let t = if square > 1e-12 { t.map(|v| v / square.sqrt()) } else { [0.0, 0.0, -1.0] };
    [t, [y * t[2] - z * t[1], z * t[0] - x * t[2], x * t[1] - y * t[0]]]
}

/// [`frame`] in double precision.
pub fn exact_frame(n: DVec3) -> [DVec3; 2] {
    let t = (DVec3::X - n * n.x).normalize_or(DVec3::NEG_Z);
    [t, n.cross(t)]
}

/// The unit vector along a mean of normals, the surface's own normal where they cancel, and the length of the
/// mean.
#[inline(always)]
pub fn unit(mean: [f32; 3]) -> ([f32; 3], f32) {
    let length = dot(mean, mean).sqrt();
    (if length > 0.0 { mean.map(|x| x / length) } else { [0.0, 0.0, 1.0] }, length)
}

/// The normal bent towards the viewer just so far that n·wo is at least 0.01, or at least that of the
/// unbumped surface if that is less.
#[inline(always)]
pub fn facing(n: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    facing_by(n, wo, wo[2].min(GRAZING))
}

/// [`facing`] for one bump seen from another, which may lie below the horizon of the unbumped surface: n·wo
/// is at least 0.01 in any case.
#[inline(always)]
pub fn facing_bump(n: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    facing_by(n, wo, GRAZING)
}

#[inline(always)]
fn facing_by(n: [f32; 3], wo: [f32; 3], least: f32) -> [f32; 3] {
    let c = dot(n, wo);
    if c >= least {
        return n;
    }
    let across: [f32; 3] = std::array::from_fn(|k| n[k] - wo[k] * c);
    let scale = (1.0 - least * least).sqrt() / dot(across, across).sqrt().max(1e-30);
    std::array::from_fn(|k| wo[k] * least + across[k] * scale)
}

/// [`facing`] in double precision.
pub fn exact_facing(n: DVec3, wo: DVec3) -> DVec3 {
    let (c, least) = (n.dot(wo), wo.z.min(f64::from(GRAZING)));
    if c >= least {
        return n;
    }
    wo * least + (n - wo * c).normalize_or_zero() * (1.0 - least * least).sqrt()
}

/// ln(1 − x), which keeps its digits where x is small.
#[inline(always)]
pub fn log_less(x: f32) -> f32 {
    if x < 0.02 { -x * (1.0 + x * (0.5 + x * (0.333_333_34 + x * 0.25))) } else { (1.0 - x).max(0.0).ln() }
}

/// The twins of [`frame`], as `local_frame(n: vec3<f32>) -> LocalFrame` with members t and b, [`unit()`],
/// without the length, [`facing`], [`facing_bump`] and [`log_less`], their names after `local_`.
pub const TEXT: &str = include_str!("bumps.wgsl");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_of_the_surface_itself_has_its_own_bits() {
        assert_eq!(frame([0.0, 0.0, 1.0]), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        for n in [Vec3::new(0.6, -0.2, 0.7), Vec3::X, Vec3::new(-0.99, 0.1, 0.05)] {
            let n = n.normalize();
            let [t, b] = frame(n.to_array()).map(Vec3::from_array);
            assert!((t.length() - 1.0).abs() < 1e-6 && (b.length() - 1.0).abs() < 1e-6);
            assert!(t.dot(n).abs() < 1e-6 && t.cross(b).dot(n) < -0.999 || t.cross(b).dot(n) > 0.999);
            let [u, v] = exact_frame(n.as_dvec3());
            assert!((u.as_vec3() - t).length() < 1e-5 && (v.as_vec3() - b).length() < 1e-5, "{n}");
        }
    }

    /// Heights a sin kx: the error of the normals falls as the square of the distance between texels.
    #[test]
    fn central_differences_are_of_second_order() {
        let error = |n: usize| {
            let phase = |i: usize| std::f64::consts::TAU * (i as f64 + 0.5) / n as f64;
            let row: Vec<f32> = (0..n).map(|i| (0.5 + 0.5 * phase(i).sin()) as f32).collect();
            let plane: Vec<f32> = (0..4).flat_map(|_| row.clone()).collect();
            let t = Texture::new(n, 4, &[plane.clone(), plane.clone(), plane]).map(Arc::new);
            let brdf = steradian_brdf::parse("lambert").expect("a spec");
            let material = Material::new(brdf);
            let planes = material.textures.clone().with(HEIGHT, t.expect("texels"));
            let b = Bumps::of("test", &material.with_textures(planes), 0.1).expect("finite").expect("bumps");
            (0..n)
                .map(|i| {
                    let slope = 0.1 * 0.5 * std::f64::consts::TAU * phase(i).cos();
                    (b.normal([i, 1]) - DVec3::new(-slope, 0.0, 1.0).normalize()).length()
                })
                .fold(0.0, f64::max)
        };
        for n in [32, 64] {
            let ratio = error(n) / error(2 * n);
            assert!((3.6..4.4).contains(&ratio), "{n}: {ratio}");
        }
    }
}
