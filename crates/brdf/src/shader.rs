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
    /// Is `brdf_f_cos` among them?
    own_f_cos: bool,
    /// The constants by which they declare the last members of `Brdf` as arrays, and the lengths of these.
    arrays: Vec<(&'static str, usize)>,
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
        Self { source: source.into(), own_f_cos: false, arrays: Vec::new(), uniforms, cells: None }
    }

    /// The shader whose text defines `brdf_f_cos` in place of `brdf_eval`.
    pub(crate) fn with_f_cos(self) -> Self {
        Self { own_f_cos: true, ..self }
    }

    /// The shader whose last parameters make arrays of these lengths. The text declares the members with the
    /// constants of these names, `array<vec4<f32>, NAME>`.
    pub(crate) fn with_arrays(self, arrays: impl Into<Vec<(&'static str, usize)>>) -> Self {
        Self { arrays: arrays.into(), ..self }
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

    /// The modules of the text, in order. [`ATAN2`] is one of them: what brings it too keeps it once.
    pub fn modules(&self) -> Vec<Cow<'static, str>> {
        let constant = |(name, length): &(&str, usize)| format!("const {name}: u32 = {length}u;\n");
        let constants: String = self.arrays.iter().map(constant).collect();
        let f_cos = if self.own_f_cos { "" } else { F_COS };
        vec![ATAN2.into(), MATH.into(), constants.into(), self.source.clone(), f_cos.into()]
    }

    /// The complete text.
    pub fn wgsl(&self) -> String {
        self.modules().concat()
    }

    /// The complete text with the values in it, and nothing left to declare but `brdf_cell` where there are
    /// [`BrdfShader::cells`]. Under a prefix ([`crate::wgsl::scoped`]) two such texts, or one and
    /// [`BrdfShader::wgsl`], may stand in one module.
    pub fn closed(&self) -> String {
        let mut values = self.uniforms.iter().map(|v| {
            let [x, y, z, w] = v.map(|x| if x.is_finite() { x } else { f32::MAX.copysign(x) });
            format!("vec4<f32>({x:?}, {y:?}, {z:?}, {w:?})")
        });
        let in_arrays: usize = self.arrays.iter().map(|a| a.1).sum();
        let mut members: Vec<String> = values.by_ref().take(self.uniforms.len() - in_arrays).collect();
        for (_, length) in &self.arrays {
            let all: Vec<String> = values.by_ref().take(*length).collect();
            members.push(format!("array<vec4<f32>, {length}>({})", all.join(", ")));
        }
        self.wgsl() + &format!("\nvar<private> brdf: Brdf = Brdf({});\n", members.join(", "))
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
