//! A technique's description of itself. Indices, menus, tables, the book and the conformance suite are made
//! from it.

use steradian_brdf::Brdf;
use steradian_light::Lights;

/// A technique's page in short.
#[derive(Debug, Clone, Copy)]
pub struct Card {
    /// Rust module name; the command line takes `-` for `_`.
    pub slug: &'static str,
    /// A few words.
    pub title: &'static str,
    /// Authors, year, title, equation numbers.
    pub citation: &'static str,
    /// The equation that shading evaluates.
    pub equation: &'static str,
    /// Representation of the light L.
    pub light: &'static str,
    /// Representation of the visibility V.
    pub visibility: &'static str,
    /// Representation of the reflectance f.
    pub reflectance: &'static str,
    /// Accepts a reflectance, or says why it is refused and what to use instead.
    pub materials: fn(&dyn Brdf) -> Result<(), String>,
    /// Specs of reflectances that represent those accepted; the conformance suite runs each.
    pub specimens: &'static [&'static str],
    /// Cases in which the technique equals the integral.
    pub exact_when: &'static [Claim],
    /// The row of STAR04's figure 11.
    pub capabilities: Capabilities,
    /// The inputs that a bake and shading need.
    pub needs: Needs,
    /// Conformance checks that do not make sense here, each with its reason.
    pub waived: &'static [(Check, &'static str)],
}

/// A case in which a technique equals the integral, as a test can run it.
#[derive(Debug, Clone, Copy)]
pub struct Claim {
    /// In words.
    pub statement: &'static str,
    /// The light of the case.
    pub light: fn() -> Lights,
    /// The reflectance spec of the case.
    pub brdf: &'static str,
    /// Parameters that differ from their defaults.
    pub params: &'static [(&'static str, f64)],
    /// Largest relative error that counts as equal: rounding and interpolation of the tables.
    pub within: f64,
}

impl Claim {
    /// A case with the technique's default parameters.
    pub const fn new(
        statement: &'static str,
        light: fn() -> Lights,
        brdf: &'static str,
        within: f64,
    ) -> Self {
        Self { statement, light, brdf, params: &[], within }
    }

    /// This case with other parameters.
    #[must_use]
    pub const fn with(self, params: &'static [(&'static str, f64)]) -> Self {
        Self { params, ..self }
    }
}

/// Columns of STAR04's figure 11: what a technique supports.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Capabilities {
    /// Light from environments (global) rather than point lights (local).
    pub global: bool,
    /// Diffuse reflectance.
    pub diffuse: bool,
    /// Certain isotropic reflectances.
    pub certain_isotropic: bool,
    /// Certain anisotropic reflectances.
    pub certain_anisotropic: bool,
    /// All isotropic reflectances.
    pub all_isotropic: bool,
    /// All anisotropic reflectances.
    pub all_anisotropic: bool,
    /// Reflectance that varies over the surface.
    pub shift_variant: bool,
    /// Bump mapping.
    pub bump_mapping: bool,
    /// Self-shadowing.
    pub self_shadowing: bool,
    /// Interreflections.
    pub interreflections: bool,
    /// Light that changes in every frame (any light may be rotated).
    pub dynamic_lighting: bool,
    /// Objects that deform.
    pub dynamic_objects: bool,
}

impl Capabilities {
    /// Supports nothing; Cards start from it.
    pub const NONE: Self = Self {
        global: false,
        diffuse: false,
        certain_isotropic: false,
        certain_anisotropic: false,
        all_isotropic: false,
        all_anisotropic: false,
        shift_variant: false,
        bump_mapping: false,
        self_shadowing: false,
        interreflections: false,
        dynamic_lighting: false,
        dynamic_objects: false,
    };
}

/// The inputs that a bake and shading need.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Needs {
    /// Distant light: an environment, disks or directional lights.
    pub environment: bool,
    /// Sites on a mesh: a [`crate::Geometry`] at bake time.
    pub sites: bool,
    /// Texture coordinates of the points.
    pub uv: bool,
    /// Tangents of the points.
    pub tangents: bool,
    /// [`crate::AnyBake::frame`] before shading, whenever the view changes.
    pub view: bool,
}

/// The checks that every technique gets unless its Card waives them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Check {
    /// Under constant light the result is the directional albedo.
    Furnace,
    /// Twice the light is twice the result; the sum of two lights the sum of two results.
    Linearity,
    /// Turning light and frame together changes nothing.
    Rotation,
    /// Each claim of [`Card::exact_when`] against the reference.
    ExactWhen,
    /// The recorded error against the reference elsewhere.
    ErrorBound,
    /// Finite at grazing, at the poles, for the sharpest and the brightest.
    Extremes,
    /// The shader module is valid WGSL and equals the CPU.
    Shader,
    /// Two bakes are bit-identical.
    Determinism,
    /// A bake that was saved and loaded shades the same bits.
    RoundTrip,
}

impl Check {
    /// All checks, in the order of reports.
    pub const ALL: [Self; 9] = [
        Self::Furnace,
        Self::Linearity,
        Self::Rotation,
        Self::ExactWhen,
        Self::ErrorBound,
        Self::Extremes,
        Self::Shader,
        Self::Determinism,
        Self::RoundTrip,
    ];
}

impl Card {
    /// Why `check` makes no sense for this technique, where it does not.
    pub fn waived(&self, check: Check) -> Option<&'static str> {
        self.waived.iter().find(|(c, _)| *c == check).map(|(_, why)| *why)
    }
}
