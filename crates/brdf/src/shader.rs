//! A reflectance as plain data for a GPU: WGSL text and numbers. No types of any graphics library.

use crate::{Domain, Peak};
use std::borrow::Cow;
use std::sync::Arc;

/// `fn brdf_atan2(y: f32, x: f32) -> f32`, accurate to 2e-7: WGSL's own atan2 may be off by 4096 units in the
/// last place, which is visible where a lookup by angle reads large values that cancel.
pub const ATAN2: &str = include_str!("atan2.wgsl");

/// Cells of a [`BrdfShader`] at most: 8192 rows of 2048, the texture that every device has room for.
pub const MAX_CELLS: usize = 1 << 24;

/// Functions for every model's text: the twin of `math.rs`.
const MATH: &str = include_str!("math.wgsl");

/// The default of [`crate::Brdf::f_cos`].
const F_COS: &str = "
fn brdf_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if wi.z <= 0.0 {
        return vec3<f32>(0.0);
    }
    return brdf_eval(wi, wo) * wi.z;
}
";

/// A reflectance as plain data for a GPU.
///
/// The text declares `struct Brdf`, whose members are vec4 or arrays of vec4 in the order of
/// [`BrdfShader::uniforms`], and reads a variable `brdf: Brdf` that its user declares. It defines
///
/// - `brdf_value(wi, wo) -> vec3<f32>`: f · ⟨n·wi⟩, [`crate::Brdf::f_cos`] in the local frame;
/// - `brdf_scale(wi, wo, radius) -> f32`: [`Peak::scale`];
/// - `brdf_is_whole() -> bool`: is light taken from below the horizon too?
///
/// Where there are [`BrdfShader::cells`] it calls `brdf_cell(i: u32) -> vec3<f32>`, cell i, which its user
/// defines.
#[derive(Debug, Clone, PartialEq)]
pub struct BrdfShader {
    /// The model's own functions.
    source: Cow<'static, str>,
    /// Values of `brdf`: factor and domain, peak, then the model's parameters.
    uniforms: Vec<[f32; 4]>,
    cells: Option<Arc<Vec<[f32; 3]>>>,
}

impl BrdfShader {
    /// The text of a model and its parameters.
    pub(crate) fn new(
        source: impl Into<Cow<'static, str>>,
        peak: Peak,
        domain: Domain,
        parameters: impl IntoIterator<Item = [f32; 4]>,
    ) -> Self {
        let whole = if domain == Domain::Sphere { 1.0 } else { 0.0 };
        let [kind, narrow, wide] = peak.packed();
        let mut uniforms = vec![[1.0, 1.0, 1.0, whole], [kind, narrow, wide, 0.0]];
        uniforms.extend(parameters);
        Self { source: source.into(), uniforms, cells: None }
    }

    /// The shader with numbers that are too many for uniforms.
    pub(crate) fn with_cells(self, cells: Arc<Vec<[f32; 3]>>) -> Self {
        Self { cells: Some(cells), ..self }
    }

    /// The shader with f multiplied by `factor`, per channel.
    pub(crate) fn scaled(mut self, factor: [f64; 3]) -> Self {
        for (to, by) in self.uniforms[0].iter_mut().zip(factor) {
            *to *= by as f32;
        }
        self
    }

    /// The complete text.
    pub fn wgsl(&self) -> String {
        let own = self.source.contains("fn brdf_f_cos(");
        [ATAN2, MATH, &self.source, if own { "" } else { F_COS }].concat()
    }

    /// The complete text with the values in it, and nothing left to declare but `brdf_cell` where there are
    /// [`BrdfShader::cells`]. Under a prefix ([`crate::wgsl::scoped`]) two such texts, or one and
    /// [`BrdfShader::wgsl`], may stand in one module.
    pub fn closed(&self) -> String {
        let text = self.wgsl();
        let mut values = self.uniforms.iter().map(|v| {
            let [x, y, z, w] = v.map(|x| if x.is_finite() { x } else { f32::MAX.copysign(x) });
            format!("vec4<f32>({x:?}, {y:?}, {z:?}, {w:?})")
        });
        let members =
            text.split_once("struct Brdf {").and_then(|(_, t)| t.split_once('}')).map_or("", |t| t.0);
        let mut arguments = Vec::new();
        for member in members.lines().map(str::trim).filter(|m| m.ends_with(',') && !m.starts_with("//")) {
            // name: array<vec4<f32>, N>,
            let count = member
                .split_once("array<vec4<f32>,")
                .and_then(|(_, n)| n.trim_end_matches(['>', ',']).trim().parse().ok());
            let all: Vec<String> = values.by_ref().take(count.unwrap_or(1)).collect();
            let all = all.join(", ");
            arguments.push(count.map_or_else(|| all.clone(), |n| format!("array<vec4<f32>, {n}>({all})")));
        }
        text + &format!("\nvar<private> brdf: Brdf = Brdf({});\n", arguments.join(", "))
    }

    /// The values of `brdf`, one vec4 after another.
    pub fn uniforms(&self) -> &[[f32; 4]] {
        &self.uniforms
    }

    /// Numbers that shaders read from a texture: measurements. At most [`MAX_CELLS`].
    pub fn cells(&self) -> Option<&[[f32; 3]]> {
        self.cells.as_ref().map(|c| c.as_slice())
    }
}

/// r/g/b as a vec4.
pub(crate) fn rgb(v: [f64; 3]) -> [f32; 4] {
    [v[0] as f32, v[1] as f32, v[2] as f32, 0.0]
}

/// r/g/b and a fourth number.
pub(crate) fn with(v: [f64; 3], w: f64) -> [f32; 4] {
    [v[0] as f32, v[1] as f32, v[2] as f32, w as f32]
}

/// Numbers as a vec4.
pub(crate) fn four(v: [f64; 4]) -> [f32; 4] {
    v.map(|x| x as f32)
}
