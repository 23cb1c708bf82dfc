//! What each consumer of filtered maps takes: one row of fields per profile, no code.

use glam::{DMat3, DVec3};
use steradian_formats::TexelFormat;
use steradian_sphere::{Layout, SphereImage};

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
        }
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Sqrt => "sqrt",
            Self::Log2 => "log2",
            Self::Unity => "unity",
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
    /// The light as it is, lat-long, and for `cube` a DDS cube beside it: the consumer filters by itself.
    LatLong {
        /// Name of the image.
        image: &'static str,
        /// Half floats?
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
    /// Default size of level 0 and of the last level.
    pub size: usize,
    /// The last level.
    pub last: usize,
    /// From levels to perceptual roughness.
    pub curve: Curve,
    /// The consumer looks a world direction d up under this times d in a cube.
    pub lookup: DMat3,
    /// The same for a lat-long image, where our formulas take the result to a texel.
    pub panorama: DMat3,
    /// Each face mirrored left to right.
    pub flip: bool,
}

const fn diagonal(x: f64, y: f64, z: f64) -> DMat3 {
    DMat3::from_cols(DVec3::new(x, 0.0, 0.0), DVec3::new(0.0, y, 0.0), DVec3::new(0.0, 0.0, z))
}

/// (z, y, −x): the centre of a lat-long image looks to +Z.
const CENTRE_Z: DMat3 =
    DMat3::from_cols(DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 0.0));

/// (−z, y, x): it looks to −Z.
const CENTRE_MINUS_Z: DMat3 =
    DMat3::from_cols(DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 0.0), DVec3::new(-1.0, 0.0, 0.0));

/// (x, z, y): our world in left-handed axes with Z up.
const Z_UP: DMat3 =
    DMat3::from_cols(DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 0.0));

const RAW: Engine = Engine {
    name: "raw",
    doc: "our own conventions, 32-bit floats",
    files: Files::Ktx2 { specular: "{}_specular.ktx2", diffuse: Some("{}_diffuse.ktx2") },
    format: TexelFormat::Rgba32f,
    zstd: false,
    size: 256,
    last: 16,
    curve: Curve::Linear,
    lookup: DMat3::IDENTITY,
    panorama: DMat3::IDENTITY,
    flip: false,
};

/// Every profile.
pub static ENGINES: [Engine; 9] = [
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
        lookup: diagonal(1.0, 1.0, -1.0),
        ..RAW
    },
    Engine {
        name: "three",
        doc: "three.js r187: level L r (2 - r), last face 8, looked up with (-x, y, z); the last level, GGX at 1, is its diffuse light too",
        files: Files::Ktx2 { specular: "{}_pmrem.ktx2", diffuse: None },
        format: TexelFormat::Rgba16f,
        last: 8,
        curve: Curve::Sqrt,
        lookup: diagonal(-1.0, 1.0, 1.0),
        ..RAW
    },
    Engine {
        name: "filament",
        doc: "Filament as cmgen --deploy writes: KTX1, level L r (2 - r), last face 16, sh",
        files: Files::Filament,
        format: TexelFormat::R11g11b10,
        curve: Curve::Sqrt,
        ..RAW
    },
    Engine {
        name: "gltf",
        doc: "glTF EXT_lights_image_based: RGBD PNGs mirrored left to right, irradiance coefficients",
        files: Files::Gltf,
        flip: true,
        ..RAW
    },
    Engine {
        name: "khronos",
        doc: "glTF-IBL-Sampler: diffuse.ktx2, specular.ktx2, sheen.ktx2, outputLUT.png, r = m/L",
        files: Files::Khronos,
        format: TexelFormat::Rgba16f,
        ..RAW
    },
    Engine {
        name: "godot",
        doc: "Godot 4 (PanoramaSkyMaterial filters by itself): lat-long EXR, u = atan2(x, -z)/2pi, its centre looks to +Z",
        files: Files::LatLong { image: "{}.exr", half: true, cube: None },
        panorama: CENTRE_Z,
        ..RAW
    },
    Engine {
        name: "unreal",
        doc: "Unreal (captures filter by themselves): DDS cube over (x, z, y), lat-long .hdr, its centre looks to -Z; with --levels a chain, r = 2^((m - N + 3)/1.2)",
        files: Files::LatLong { image: "{}.hdr", half: false, cube: Some("{}.dds") },
        format: TexelFormat::Rgba16f,
        size: 512,
        last: 512,
        curve: Curve::Log2,
        lookup: Z_UP,
        panorama: CENTRE_MINUS_Z,
        ..RAW
    },
    Engine {
        name: "blender",
        doc: "Blender (world shader, studio lights; Cycles and EEVEE filter by themselves): lat-long EXR, its centre looks to +X",
        files: Files::LatLong { image: "{}.exr", half: true, cube: None },
        ..RAW
    },
    RAW,
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

    /// A cube or a lat-long image over world directions, as the file holds it. Texels change places only (of a
    /// lat-long image where its width is a multiple of four).
    pub fn arrange(&self, image: &SphereImage) -> SphereImage {
        let (layout, w, h) = (image.layout, image.width, image.height);
        let axes = if layout == Layout::Cube { self.lookup } else { self.panorama };
        let back = axes.transpose();
        let mut out = if axes == DMat3::IDENTITY {
            image.clone()
        } else if layout == Layout::Cube || w % 4 == 0 {
            SphereImage::from_fn(layout, w, h, |d| image.nearest(back * d))
        } else {
            image.rotate(axes)
        };
        if self.flip && layout == Layout::Cube {
            out.planes.iter_mut().for_each(|p| p.chunks_exact_mut(w).for_each(|row| row.reverse()));
        }
        out
    }

    /// Does the consumer filter by itself, so that it takes the light as it is?
    pub fn unfiltered(&self) -> bool {
        matches!(self.files, Files::LatLong { .. })
    }

    /// The name by which readers undo the arrangement.
    pub fn recorded(&self) -> &'static str {
        if self.name == "raw" { "steradian" } else { self.name }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_light::load::Profile;

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
        let cases: [(&str, &dyn Fn(DVec3) -> f64); 3] =
            [("godot", &godot), ("unreal", &unreal), ("blender", &cycles)];
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
