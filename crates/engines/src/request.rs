//! What is asked for, and what of it is refused before any work: parameters that would be ignored, maps too
//! large.

use crate::companions::{DIFFUSE, has_diffuse, has_sheen};
use crate::plan::{Kernel, Plan, has_roughness};
use crate::{Engine, EngineError, Files};
use std::path::{Path, PathBuf};
use steradian_base::unknown;
use steradian_brdf::SharedBrdf;
use steradian_formats::{Container, TexelFormat};
use steradian_light::DiskLight;
use steradian_prefilter::methods::Method;
use steradian_sphere::Layout;

/// A map, a chain of levels or an engine's files, as they are asked for. `None` asks for the default.
#[derive(Clone)]
pub struct Request {
    /// File, or with an engine the folder.
    pub output: PathBuf,
    /// What the files of an engine are called by.
    pub name: String,
    /// Do files that an engine gives fixed names go into a folder of their own below `output`, called by
    /// `name`?
    pub own_folder: bool,
    /// Kernel, as [`kernel_name`] gives it.
    pub kernel: String,
    /// The reflectance of a kernel `brdf:SPEC`.
    pub brdf: Option<SharedBrdf>,
    /// Perceptual roughness of microfacet kernels, 0 to 1; 0 is a mirror.
    pub perceptual_roughness: Option<f64>,
    /// Their width: perceptual roughness squared.
    pub alpha: Option<f64>,
    /// Exponent of phong and blinn-phong.
    pub exponent: Option<f64>,
    /// Standard deviation of gaussian and spherical-gaussian, degrees.
    pub sigma: Option<f64>,
    /// Whose files; `None` for a single file of ours.
    pub engine: Option<&'static Engine>,
    /// Width and height of level 0; equal numbers are a side, of a lat-long image its width.
    pub size: Option<(usize, usize)>,
    /// Levels of a chain.
    pub levels: Option<usize>,
    /// Texels of a texture.
    pub format: Option<TexelFormat>,
    /// Relative RMS error of a level.
    pub tolerance: f64,
    /// Texels of each level that are compared with the integral over all texels of the light.
    pub check: usize,
    /// How levels are filtered.
    pub method: MethodChoice,
    /// Are lat-long images of the levels written beside the output?
    pub dump: bool,
    /// Suns that were taken out of the light.
    pub suns: Vec<DiskLight>,
}

/// A way to prefilter by name, or the usual choice.
#[derive(Debug, Clone, Copy, Default)]
pub struct MethodChoice(pub Option<Method>);

impl MethodChoice {
    /// `auto`, or a method's name; `-` and `_` are the same.
    pub fn parse(text: &str) -> Result<Self, String> {
        let name = text.to_ascii_lowercase().replace('_', "-");
        if name == "auto" {
            return Ok(Self(None));
        }
        let names: Vec<&str> = ["auto"].into_iter().chain(Method::ALL.map(Method::name)).collect();
        let found = Method::from_name(&name).map(|m| Self(Some(m)));
        found.ok_or_else(|| unknown("method", text, &names))
    }
}

/// Names of the kernels, beside `brdf:SPEC`.
pub const KERNELS: [&str; 8] =
    ["ggx", "beckmann", "charlie", "phong", "blinn-phong", "lambert", "gaussian", "spherical-gaussian"];
/// What precedes the spec of a reflectance.
pub(crate) const BRDF: &str = "brdf:";

/// The parameters that a kernel takes, as the command's options are called.
fn parameters(kernel: &str) -> &'static [&'static str] {
    match kernel {
        k if has_roughness(k) => &["perceptual-roughness", "alpha"],
        "phong" | "blinn-phong" => &["exponent"],
        "gaussian" | "spherical-gaussian" => &["sigma"],
        _ => &[],
    }
}

/// The kernels that take a parameter.
pub fn kernels_with(parameter: &str) -> Vec<&'static str> {
    KERNELS.into_iter().filter(|k| parameters(k).contains(&parameter)).collect()
}

/// The canonical name of a kernel, or `brdf:SPEC` as it stands.
pub fn kernel_name(text: &str) -> Result<String, String> {
    if text.starts_with(BRDF) {
        return Ok(text.into());
    }
    let name = text.to_ascii_lowercase().replace('_', "-");
    let found = KERNELS.into_iter().find(|k| *k == name);
    found.map(String::from).ok_or_else(|| unknown("kernel", text, &KERNELS))
}

impl Request {
    /// An engine's usual files in the folder `output`, called by `name`.
    pub fn of(engine: &'static Engine, output: PathBuf, name: &str) -> Self {
        Self {
            output,
            name: name.into(),
            own_folder: false,
            kernel: Self::KERNEL.into(),
            brdf: None,
            perceptual_roughness: None,
            alpha: None,
            exponent: None,
            sigma: None,
            engine: Some(engine),
            size: None,
            levels: None,
            format: None,
            tolerance: Self::TOLERANCE,
            check: Self::CHECK,
            method: MethodChoice::default(),
            dump: false,
            suns: Vec::new(),
        }
    }

    /// The usual kernel, and that of engines' files.
    pub const KERNEL: &'static str = "ggx";
    /// The usual relative RMS error of a level.
    pub const TOLERANCE: f64 = 2e-3;
    /// The usual number of texels of each level whose error is measured.
    pub const CHECK: usize = 64;

    /// The folder of the output.
    pub fn folder(&self) -> PathBuf {
        let fixed = self.engine.is_some_and(|e| e.files == Files::Khronos);
        if self.own_folder && fixed { self.output.join(&self.name) } else { self.output.clone() }
    }

    /// The file below [`Self::folder`] that holds the suns which the maps cannot.
    pub fn suns_file(&self) -> String {
        format!("{}_suns.json", self.name)
    }

    /// A texture of an engine whose files have fixed names, which another input's would replace.
    pub fn fixed_file(&self) -> Option<PathBuf> {
        self.engine.filter(|e| e.files == Files::Khronos).map(|_| self.folder().join("specular.ktx2"))
    }

    /// Is this, below [`Self::folder`], the name of a file that its engine may get?
    pub fn writes(&self, file: &Path) -> bool {
        let Some(engine) = self.engine else { return false };
        let (file, name) = (file.to_string_lossy().replace('\\', "/"), &*self.name);
        let is = |pattern: &str| {
            let named = pattern.replace("{}", name);
            file == named || file == named.replace("rgb9e5", self.format.unwrap_or(engine.format).name())
        };
        file == self.suns_file()
            || match engine.files {
                Files::Ktx2 { specular, diffuse } => is(specular) || diffuse.is_some_and(is),
                Files::Khronos => {
                    ["specular.ktx2", "diffuse.ktx2", "sheen.ktx2", "outputLUT.png"].into_iter().any(is)
                }
                Files::Filament => ["{}/{}_ibl.ktx", "{}/{}_skybox.ktx", "{}/sh.txt"].into_iter().any(is),
                Files::Gltf => {
                    let face = format!("{name}_specular_");
                    is("{}.gltf") || (file.starts_with(&face) && file.ends_with(".png"))
                }
                Files::Dds { specular } => is(specular),
                Files::LatLong { image, cube, .. } => is(image) || cube.is_some_and(is),
            }
    }

    /// Is this the name of a level in a folder of them?
    pub fn dumps(&self, file: &Path) -> bool {
        let file = file.to_string_lossy();
        let number = file.strip_prefix(&format!("{}_level", self.name)).and_then(|f| f.strip_suffix(".exr"));
        number.is_some_and(|n| n.parse::<u8>().is_ok())
    }

    /// The spec of a kernel `brdf:SPEC`.
    pub fn brdf_spec(&self) -> Option<&str> {
        self.kernel.strip_prefix(BRDF)
    }

    /// Refuses parameters that nothing would come of.
    pub(crate) fn check_options(&self) -> Result<(), EngineError> {
        if let (Some(m), 0) = (self.method.0, self.check) {
            let why = format!("`method` {}: its error has no bound; give `check` 1 or more", m.name());
            return Err(EngineError::Request(why));
        }
        let chain = self.engine.is_some() || self.levels.is_some();
        let (takes, by): (&[&str], _) = match self.kernel.as_str() {
            _ if self.engine.is_some() => {
                (&[], "`profile`: its levels go over the roughness by themselves".into())
            }
            _ if chain => (&[], "`levels`: they go over the roughness by themselves".into()),
            k => (parameters(k), format!("`kernel` {k}")),
        };
        let given = [
            ("perceptual-roughness", self.perceptual_roughness.is_some()),
            ("alpha", self.alpha.is_some()),
            ("exponent", self.exponent.is_some()),
            ("sigma", self.sigma.is_some()),
        ];
        if let Some((option, _)) = given.into_iter().find(|(name, given)| *given && !takes.contains(name)) {
            return Err(EngineError::Request(format!("--{option} has no part in {by}; leave it out")));
        }
        self.check_format()
    }

    fn check_format(&self) -> Result<(), EngineError> {
        let Some(engine) = self.engine else {
            let texture = Container::of_name(&self.output).is_some();
            return match self.format {
                Some(f) if !texture => Err(EngineError::Request(format!(
                    "{}: `format` {} is for .ktx2, .ktx and .dds",
                    self.output.display(),
                    f.name()
                ))),
                _ => Ok(()),
            };
        };
        if self.kernel != Self::KERNEL {
            let why = format!("`kernel` {}: the files of a profile are of {}", self.kernel, Self::KERNEL);
            return Err(EngineError::Request(why));
        }
        let refused = |f: TexelFormat, why: &str| {
            let why = format!("`profile` {}: `format` {}: {why}", engine.name, f.name());
            Err(EngineError::Request(why))
        };
        match (engine.files, self.format) {
            (Files::Gltf, Some(f)) => refused(f, "its texels are RGBD in .png"),
            (Files::LatLong { cube: None, .. }, Some(f))
                if !matches!(f, TexelFormat::Rgba16f | TexelFormat::Rgba32f) =>
            {
                refused(f, "its file is an .exr: rgba16f or rgba32f")
            }
            _ => Ok(()),
        }
    }

    /// Refuses maps beyond `most` bytes; a size that is not known yet passes.
    pub(crate) fn check_memory(&self, plan: &Plan, most: u64) -> Result<(), EngineError> {
        let bytes = bytes(self.engine.is_some(), self.dump, plan);
        if plan.size.0 > 0 && bytes > u128::from(most) {
            let (w, h) = plan.size;
            return Err(EngineError::Failed(format!(
                "`size` {w}x{h}: the levels need {} MiB, beyond the limit of {} MiB (`max-memory` raises it)",
                bytes >> 20,
                most >> 20
            )));
        }
        Ok(())
    }

    /// The kernel of a reflectance, where one is given.
    pub(crate) fn given(&self) -> Result<Option<Kernel>, EngineError> {
        self.brdf.as_ref().map(|brdf| crate::plan::normal_incidence(&self.kernel, brdf.clone())).transpose()
    }
}

/// Refuses a chain that the engine does not take.
pub(crate) fn check_levels(engine: &Engine, size: usize, levels: usize) -> Result<(), EngineError> {
    let refused = |option: &str, value: usize, why: String| {
        Err(EngineError::Request(format!("`profile` {}: {option} {value}: {why}", engine.name)))
    };
    if size < engine.least {
        let why = format!("its first level has {} texels a side or more", engine.least);
        return refused("`size`", size, why);
    }
    if engine.last_fixed && size >> (levels - 1) != engine.last {
        let texels = if engine.last == 1 { "texel" } else { "texels" };
        let why = format!("its last level has {} {texels} a side; leave `levels` out", engine.last);
        return refused("`levels`", levels, why);
    }
    Ok(())
}

/// Bytes of a texel of the output: three floats filtered, four on the way to the file.
const TEXEL: u128 = 28;
/// Of a lat-long image that is written as it was filtered: three floats, and halves or codes of them in the
/// file.
const DUMPED: u128 = 24;

/// What the maps of a plan take: all that are filtered, and the largest that is dumped.
fn bytes(engine: bool, dump: bool, plan: &Plan) -> u128 {
    let faces = if plan.layout == Layout::Cube { 6 } else { 1 };
    let side = |n: usize, m: usize| n.checked_shr(m as u32).unwrap_or(0).max(1) as u128;
    let texels = |m: usize| side(plan.size.0, m) * side(plan.size.1, m) * faces;
    let levels = (0..plan.filters.len()).map(texels).sum::<u128>();
    let companions = match engine {
        true if has_sheen(plan.engine) => levels + 6 * (DIFFUSE * DIFFUSE) as u128,
        true if has_diffuse(plan.engine) => 6 * (DIFFUSE * DIFFUSE) as u128,
        _ => 0,
    };
    // Level 0 as lat-long: 4n × 2n for a cube of side n.
    let (w, h) = (plan.size.0 as u128, plan.size.1 as u128);
    let dumped = if plan.layout == Layout::Cube { 8 * w * w } else { w * h };
    (levels + companions) * TEXEL + if dump { dumped * DUMPED } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_that_an_engine_does_not_take_are_refused_by_option() {
        let levels = |engine, size, levels| check_levels(Engine::find(engine).expect("known"), size, levels);
        assert!(levels("three", 64, 4).is_err_and(|e| e.to_string().contains("`size` 64")));
        assert!(levels("three", 256, 3).is_err_and(|e| e.to_string().contains("`levels` 3")));
        assert!(levels("three", 256, 6).is_ok() && levels("khronos", 32, 1).is_ok());
        assert!(levels("babylon", 64, 6).is_err_and(|e| e.to_string().contains("1 texel a side")));
        assert!(levels("babylon", 64, 7).is_ok());
    }

    #[test]
    fn kernels_have_canonical_names() {
        assert_eq!(kernel_name("Blinn_Phong").as_deref(), Ok("blinn-phong"));
        assert_eq!(kernels_with("sigma"), ["gaussian", "spherical-gaussian"]);
        assert_eq!(kernels_with("alpha"), ["ggx", "beckmann", "charlie"]);
        assert_eq!(kernel_name("brdf:ggx:alpha=0.2").as_deref(), Ok("brdf:ggx:alpha=0.2"));
        assert!(kernel_name("gx").is_err_and(|e| e.contains("did you mean 'ggx'")));
    }
}
