//! What each consumer of filtered maps takes: one row of fields per profile, no code.

use crate::irradiance::CoefficientForm;
use steradian_formats::TexelFormat;
use steradian_light::load::Profile;
use steradian_sphere::SphereImage;

/// From level m of 0 … L to perceptual roughness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curve {
    /// m/L
    Linear,
    /// 1 − √(1 − m/L), so that the lookup is L r (2 − r)
    Sqrt,
    /// 2^((m − L + 2)/1.2) and 0 for level 0: Unreal's captures, level L − 2 at 1 (ROUGHEST_MIP 1, SCALE 1.2)
    Log2,
    /// (1.7 − √(2.89 − 2.8 m/L))/1.4, so that the lookup is L r (1.7 − 0.7 r): Unity
    Unity,
    /// alpha = 2^(m/0.8 − L) and 0 for level 0, so that in a whole chain, of width 2^L, the lookup is 0.8
    /// log2(width alpha): Babylon.js (`getLodFromAlphaG` with its usual `lodGenerationScale`)
    Babylon,
}

impl Curve {
    /// The perceptual roughness of level `m`, where `last` is the last one.
    pub fn roughness(self, m: usize, last: usize) -> f64 {
        let t = if last == 0 { 0.0 } else { m as f64 / last as f64 };
        match self {
            Self::Linear => t,
            Self::Sqrt => 1.0 - (1.0 - t).sqrt(),
            Self::Log2 if m == 0 => 0.0,
            Self::Log2 => ((m as f64 - last as f64 + 2.0) / 1.2).exp2().min(1.0),
            Self::Unity => (1.7 - (2.89 - 2.8 * t).sqrt()) / 1.4,
            Self::Babylon if m == 0 => 0.0,
            Self::Babylon => (m as f64 / 0.8 - last as f64).exp2().min(1.0).sqrt(),
        }
    }

    /// How perceptual roughness r or alpha follows from level m of 0 … L.
    pub fn formula(self) -> &'static str {
        match self {
            Self::Linear => "r = m/L",
            Self::Sqrt => "r = 1 - sqrt(1 - m/L)",
            Self::Log2 => "r = 2^((m - L + 2)/1.2)",
            Self::Unity => "m = L r (1.7 - 0.7 r)",
            Self::Babylon => "alpha = 2^(m/0.8 - L)",
        }
    }

    /// The engines whose files follow it.
    pub fn engines(self) -> impl Iterator<Item = &'static str> {
        ENGINES.iter().filter(move |e| e.curve == self && !e.unfiltered()).map(|e| e.name)
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Sqrt => "sqrt",
            Self::Log2 => "log2",
            Self::Unity => "unity",
            Self::Babylon => "babylon",
        }
    }
}

/// Which files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Files {
    /// A KTX2 cube for specular light, another for diffuse light.
    Ktx2 {
        /// Name of the specular light's; {} is the input's.
        specular: &'static str,
        /// Of the diffuse light's.
        diffuse: Option<&'static str>,
    },
    /// `sheen.ktx2` beside them.
    Khronos,
    /// KTX1 and `sh.txt`.
    Filament,
    /// A glTF file and PNGs.
    Gltf,
    /// A DDS cube of specular light.
    Dds {
        /// Its name; {} is the input's.
        specular: &'static str,
    },
    /// The light as it is, lat-long, and for `cube` a DDS cube beside it: the consumer filters by itself.
    LatLong {
        /// Name of the image.
        image: &'static str,
        /// Half floats, where they hold the light?
        half: bool,
        /// Name of the cube.
        cube: Option<&'static str>,
    },
}

/// How a consumer's file differs from ours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Engine {
    /// The name that commands take.
    pub name: &'static str,
    /// One line: whose, and what is particular.
    pub doc: &'static str,
    /// Which files.
    pub files: Files,
    /// Texels.
    pub format: TexelFormat,
    /// Is the texture compressed?
    pub zstd: bool,
    /// Default size of level 0.
    pub size: usize,
    /// Size of the last level by default.
    pub last: usize,
    /// Smallest size of level 0 that the consumer takes.
    pub least: usize,
    /// Does the consumer take no other last level?
    pub last_fixed: bool,
    /// From levels to perceptual roughness.
    pub curve: Curve,
    /// Largest radiance that the consumer itself keeps of light that it filters by itself; what is beyond it
    /// and is a sun belongs into a light of its own.
    pub largest: f64,
    /// Does it read and filter 32-bit floats, so that a file of them may hold what halves cannot?
    pub floats: bool,
    /// What nine coefficients of diffuse light are in its files, where there are any.
    pub coefficients: CoefficientForm,
    /// Are the conventions our own? Then a file says itself which roughness each of its levels has.
    pub own: bool,
}

/// The largest half float.
pub(crate) const HALF: f64 = 65504.0;

/// What rows of the table have in common where they say nothing else.
const USUAL: Engine = Engine {
    name: "",
    doc: "",
    files: Files::Ktx2 { specular: "{}_specular.ktx2", diffuse: Some("{}_diffuse.ktx2") },
    format: TexelFormat::Rgba32f,
    zstd: false,
    size: 256,
    last: 16,
    least: 1,
    last_fixed: false,
    curve: Curve::Linear,
    largest: f64::INFINITY,
    floats: false,
    coefficients: CoefficientForm::Polynomial,
    own: false,
};

/// Every profile.
pub static ENGINES: [Engine; 12] = [
    Engine {
        name: "bevy",
        doc: "Bevy 0.20 (EnvironmentMapLight): level = perceptual roughness x L, looked up with (x, y, -z)",
        files: Files::Ktx2 {
            specular: "{}_specular_rgb9e5_zstd.ktx2",
            diffuse: Some("{}_diffuse_rgb9e5_zstd.ktx2"),
        },
        format: TexelFormat::Rgb9e5,
        zstd: true,
        size: 512,
        last: 8,
        ..USUAL
    },
    Engine {
        name: "three",
        doc: "three.js r187: level L r (2 - r), last face 8, looked up with (-x, y, z); the last level, GGX at 1, is its diffuse light too",
        files: Files::Ktx2 { specular: "{}_pmrem.ktx2", diffuse: None },
        format: TexelFormat::Rgba16f,
        last: 8,
        least: 256,
        last_fixed: true,
        curve: Curve::Sqrt,
        floats: true,
        ..USUAL
    },
    Engine {
        name: "filament",
        doc: "Filament as cmgen --deploy writes: KTX1, level L r (2 - r), last face 16, sh",
        files: Files::Filament,
        format: TexelFormat::R11g11b10,
        curve: Curve::Sqrt,
        ..USUAL
    },
    Engine {
        name: "gltf",
        doc: "glTF EXT_lights_image_based: RGBD PNGs mirrored left to right, irradiance coefficients",
        files: Files::Gltf,
        coefficients: CoefficientForm::Harmonics,
        ..USUAL
    },
    Engine {
        name: "khronos",
        doc: "glTF-IBL-Sampler: diffuse.ktx2, specular.ktx2, sheen.ktx2, outputLUT.png, r = m/L",
        files: Files::Khronos,
        format: TexelFormat::Rgba16f,
        floats: true,
        ..USUAL
    },
    Engine {
        name: "godot",
        doc: "Godot 4 (PanoramaSkyMaterial filters by itself): lat-long EXR, u = atan2(x, -z)/2pi, its centre looks to +Z",
        files: Files::LatLong { image: "{}.exr", half: true, cube: None },
        largest: HALF,
        ..USUAL
    },
    Engine {
        name: "unreal",
        doc: "Unreal (captures filter by themselves): DDS cube over (x, z, y), lat-long .hdr, its centre looks to -Z; with `levels` a chain, r = 2^((m - N + 3)/1.2)",
        files: Files::LatLong { image: "{}.hdr", half: false, cube: Some("{}.dds") },
        format: TexelFormat::Rgba16f,
        size: 512,
        last: 512,
        curve: Curve::Log2,
        largest: HALF,
        ..USUAL
    },
    Engine {
        name: "blender",
        doc: "Blender (world shader, studio lights; Cycles and EEVEE filter by themselves): lat-long EXR, its centre looks to +X",
        files: Files::LatLong { image: "{}.exr", half: true, cube: None },
        floats: true,
        ..USUAL
    },
    Engine {
        name: "babylon",
        doc: "Babylon.js 8 (CubeTexture.CreateFromPrefilteredData, right-handed scenes): DDS cube, a whole chain, level 0.8 log2(width alpha), looked up with (x, y, -z)",
        files: Files::Dds { specular: "{}.dds" },
        format: TexelFormat::Rgba16f,
        last: 1,
        last_fixed: true,
        curve: Curve::Babylon,
        floats: true,
        ..USUAL
    },
    Engine {
        name: "playcanvas",
        doc: "PlayCanvas 2 (EnvLighting filters by itself, into texels that end at 64): lat-long .hdr, u = 0.5 + atan2(-x, z)/2pi, its centre looks to +Z",
        files: Files::LatLong { image: "{}.hdr", half: false, cube: None },
        largest: 64.0,
        ..USUAL
    },
    Engine {
        name: "unity",
        doc: "Unity (Skybox/Panoramic; reflection probes filter by themselves): lat-long EXR over (-x, y, z), u = 0.5 - atan2(Z, X)/2pi, its centre looks to -X",
        files: Files::LatLong { image: "{}.exr", half: true, cube: None },
        largest: HALF,
        ..USUAL
    },
    Engine { name: "raw", doc: "our own conventions, 32-bit floats", floats: true, own: true, ..USUAL },
];

impl Engine {
    /// The engine of a name.
    pub fn find(name: &str) -> Option<&'static Self> {
        ENGINES.iter().find(|e| e.name.eq_ignore_ascii_case(name))
    }

    /// The engine of a name; the error lists the known ones.
    pub fn parse(name: &str) -> Result<&'static Self, String> {
        Self::find(name).ok_or_else(|| steradian_base::unknown("profile", name, &ENGINES.map(|e| e.name)))
    }

    /// How its files lie.
    pub fn profile(&self) -> &'static Profile {
        Profile::find(self.recorded()).unwrap_or_else(Profile::own)
    }

    /// A cube or a lat-long image over world directions, as the file holds it.
    pub fn arrange(&self, image: &SphereImage) -> SphereImage {
        self.profile().export(image)
    }

    /// Does the consumer filter by itself, so that it takes the light as it is?
    pub fn unfiltered(&self) -> bool {
        matches!(self.files, Files::LatLong { .. })
    }

    /// The name by which readers undo the arrangement.
    pub fn recorded(&self) -> &'static str {
        if self.own { Profile::own().name } else { self.name }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use steradian_sphere::Layout;

    #[test]
    fn every_engine_has_a_profile_of_its_own() {
        for engine in &ENGINES {
            assert_eq!(Profile::find(engine.recorded()).map(|p| p.name), Some(engine.recorded()));
        }
    }

    #[test]
    fn curves_start_at_the_mirror_and_end_at_one() {
        for curve in [Curve::Linear, Curve::Sqrt, Curve::Unity] {
            assert_eq!(curve.roughness(0, 5), 0.0);
            assert!((curve.roughness(5, 5) - 1.0).abs() < 1e-12);
            assert_eq!(curve.roughness(0, 0), 0.0);
        }
        // lookup: lod = L r (2 − r)
        for m in 0..=5 {
            let r = Curve::Sqrt.roughness(m, 5);
            assert!((5.0 * r * (2.0 - r) - m as f64).abs() < 1e-12);
            let r = Curve::Unity.roughness(m, 5);
            assert!((5.0 * r * (1.7 - 0.7 * r) - m as f64).abs() < 1e-12);
        }
        // Babylon.js: lod = 0.8 log2(width alpha) in a chain of width 2^8, alpha 1 at level 6.4.
        for m in 1..9 {
            let alpha = Curve::Babylon.roughness(m, 8).powi(2);
            let lod = 0.8 * (256.0 * alpha).log2();
            assert!(if m <= 6 { (lod - m as f64).abs() < 1e-12 } else { alpha == 1.0 }, "{m}: {alpha}");
        }
        assert_eq!(Curve::Babylon.roughness(0, 8), 0.0);
        // N = 9: mip = N − 2 − (1 − 1.2 log2 r), so that mip 6 holds 1 and each 1.2 below it half.
        for m in 1..9 {
            let r = Curve::Log2.roughness(m, 8);
            let mip = 9.0 - 2.0 - (1.0 - 1.2 * r.log2());
            assert!(if m <= 6 { (mip - m as f64).abs() < 1e-12 } else { r == 1.0 }, "{m}: {r}");
        }
    }

    #[test]
    fn readers_undo_what_profiles_do() {
        for (layout, w, h) in [(Layout::Cube, 8, 8), (Layout::LatLong, 16, 8)] {
            let image = SphereImage::from_fn(layout, w, h, |d| [d.x as f32, d.y as f32, d.z as f32]);
            for engine in &ENGINES {
                let profile = Profile::find(engine.recorded()).unwrap();
                let back = profile.import(engine.arrange(&image));
                let worst = (0..3)
                    .flat_map(|c| back.planes[c].iter().zip(&image.planes[c]))
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f32::max);
                assert!(worst < 1e-6, "{} {layout:?}: {worst}", engine.name);
            }
        }
    }

    #[test]
    fn consumers_find_world_directions() {
        let cube = SphereImage::from_fn(Layout::Cube, 4, 4, |d| [d.x as f32, d.y as f32, d.z as f32]);
        let bevy = Engine::find("bevy").unwrap().arrange(&cube);
        // World +Z is looked up as −Z.
        assert!(bevy.nearest(-DVec3::Z)[2] > 0.9);
        // Babylon.js in right-handed scenes: REFLECTIONMAP_OPPOSITEZ.
        let babylon = Engine::find("babylon").unwrap().arrange(&cube);
        assert!(babylon.nearest(-DVec3::Z)[2] > 0.9 && babylon.nearest(DVec3::X)[0] > 0.9);
        let three = Engine::find("three").unwrap().arrange(&cube);
        assert!(three.nearest(-DVec3::X)[0] > 0.9 && three.nearest(DVec3::Z)[2] > 0.9);
        let gltf = Engine::find("gltf").unwrap().arrange(&cube);
        assert_eq!(gltf.texel(4, 0, 2)[0], cube.texel(4, 3, 2)[0]);
        // Unreal's X Y Z are our x z y: its +Z face shows our +Y.
        let unreal = Engine::find("unreal").unwrap().arrange(&cube);
        assert!(unreal.nearest(DVec3::Z)[1] > 0.9 && unreal.nearest(DVec3::Y)[2] > 0.9);
    }

    #[test]
    fn panoramas_lie_as_their_consumers_look_them_up() {
        use std::f64::consts::PI;
        let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |d| [d.x as f32, d.y as f32, d.z as f32]);
        let godot = |d: DVec3| (d.x.atan2(-d.z) / (2.0 * PI)).rem_euclid(1.0);
        let unreal = |d: DVec3| 0.5 + d.x.atan2(-d.z) / (2.0 * PI);
        // Cycles: u = 0.5 − atan2(y, x)/2π over (x, −z, y).
        let cycles = |d: DVec3| 0.5 - (-d.z).atan2(d.x) / (2.0 * PI);
        // calcReflection and toSphericalUv: the reflected direction times (−1, 1, 1), u = 0.5 + atan(x,
        // z)/2π.
        let playcanvas = |d: DVec3| 0.5 + (-d.x).atan2(d.z) / (2.0 * PI);
        // ToRadialCoords of Skybox/Panoramic over (−x, y, z).
        let unity = |d: DVec3| 0.5 - d.z.atan2(-d.x) / (2.0 * PI);
        let cases: [(&str, &dyn Fn(DVec3) -> f64); 5] = [
            ("godot", &godot),
            ("unreal", &unreal),
            ("blender", &cycles),
            ("playcanvas", &playcanvas),
            ("unity", &unity),
        ];
        for (name, u) in cases {
            let file = Engine::find(name).unwrap().arrange(&image);
            for k in 0..40 {
                let phi = 0.7 + k as f64;
                let d = DVec3::new(0.8 * phi.cos(), 0.6, 0.8 * phi.sin());
                let i = ((u(d).rem_euclid(1.0) * 64.0) as usize).min(63);
                let j = (d.y.acos() / PI * 32.0) as usize;
                let got = glam::Vec3::from(file.texel(0, i, j)).as_dvec3();
                assert!(got.distance(d) < 0.1, "{name}: {got} {d}");
            }
        }
    }
}
