//! Frame state and shading of the suns that are shaded exactly; `exact.wgsl` has the same functions.

use super::light_rotation::LightRotation;
use super::sun;
use crate::direct::{self, Direct};
use crate::gpu::{Buffer, Table, Uniform, Value, own_reflectance};
use crate::{GpuTechnique, Points, Radiance, View};
use steradian_brdf::{BrdfShader, SharedBrdf};
use steradian_prefilter::Sun;

/// The light of a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TurnedSuns {
    /// Where the light is turned to.
    pub turn: LightRotation,
    suns: Direct,
}

impl TurnedSuns {
    /// `suns` and the light rotated as `v` says.
    pub fn new(suns: &[Sun], v: &View) -> Self {
        Self { turn: LightRotation::new(v.light_rotation), suns: sun::direct(suns).turned(v) }
    }

    /// Adds the radiance of the suns to `out`.
    pub fn add(&self, brdf: Option<&SharedBrdf>, q: &Points<'_>, out: &mut Radiance<'_>) {
        let Some(brdf) = brdf.filter(|_| !self.suns.is_empty()) else { return };
        self.suns.add(&**brdf, q, out);
        // Points that face away in single precision stay black.
        for i in 0..q.len() {
            let facing = (0..3).map(|k| q.n[k][i] * q.wo[k][i]).sum::<f32>() > 0.0;
            if !facing {
                out.rgb.iter_mut().for_each(|plane| plane[i] = 0.0);
            }
        }
    }
}

const NO_SUNS: &str = "
fn exact_radiance(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}
";

/// The text of suns with the exact reflectance, and the tables that it reads.
fn exact(shader: &BrdfShader) -> (String, Vec<Table>) {
    let suns = direct::suns_wgsl() + include_str!("exact.wgsl");
    own_reflectance(shader, "exact", "exact_cells", &suns)
}

/// Adds these suns to `technique`, whose text calls `exact_radiance(n, t, wo)` and which has the uniform
/// `turn`.
pub fn gpu(mut technique: GpuTechnique, suns: &[Sun], brdf: Option<&SharedBrdf>) -> GpuTechnique {
    let Some(shader) = brdf.filter(|_| !suns.is_empty()).and_then(|f| f.shader()) else {
        technique.modules.insert(0, NO_SUNS.into());
        return technique;
    };
    let numbers = |s: &Sun| s.numbers().map(|x| x as f32);
    let count = suns.len() as f32;
    let (text, tables) = exact(&shader);
    technique.modules.insert(0, text.into());
    technique.tables.extend(tables);
    technique.uniforms.push(Uniform { name: "suns", value: Value::Vec4([count, 0.0, 0.0, 0.0]) });
    technique.buffers.push(Buffer::new("suns", Sun::NUMBERS, suns.iter().flat_map(numbers).collect()));
    technique
}
