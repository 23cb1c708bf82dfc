//! What each consumer of filtered maps takes: one row of fields per profile, no code.

use glam::DVec3;
use steradian_formats::TexelFormat;
use steradian_sphere::{Layout, SphereImage};

/// From level m of 0 … L to perceptual roughness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curve {
    /// m/L
    Linear,
    /// 1 − √(1 − m/L), so that the lookup is L r (2 − r)
    Sqrt,
}

impl Curve {
    /// The perceptual roughness of level `m`, where `last` is the last one.
    pub fn roughness(self, m: usize, last: usize) -> f64 {
        let t = if last == 0 { 0.0 } else { m as f64 / last as f64 };
        match self {
            Self::Linear => t,
            Self::Sqrt => 1.0 - (1.0 - t).sqrt(),
        }
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Sqrt => "sqrt",
        }
    }
}

/// Which files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Files {
    /// A KTX2 cube for specular light, another for diffuse light.
    Ktx2 { specular: &'static str, diffuse: Option<&'static str> },
    /// `sheen.ktx2` beside them.
    Khronos,
    /// KTX1 and `sh.txt`.
    Filament,
    /// A glTF file and PNGs.
    Gltf,
}

/// How a consumer's file differs from ours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Engine {
    pub name: &'static str,
    pub doc: &'static str,
    pub files: Files,
    pub format: TexelFormat,
    pub zstd: bool,
    /// Default size of level 0 and of the last level.
    pub size: usize,
    pub last: usize,
    pub curve: Curve,
    /// The consumer looks a world direction d up under these signs times d.
    pub lookup: [f64; 3],
    /// Each face mirrored left to right.
    pub flip: bool,
}

const RAW: Engine = Engine {
    name: "raw",
    doc: "our own conventions, 32-bit floats",
    files: Files::Ktx2 { specular: "{}_specular.ktx2", diffuse: Some("{}_diffuse.ktx2") },
    format: TexelFormat::Rgba32f,
    zstd: false,
    size: 256,
    last: 16,
    curve: Curve::Linear,
    lookup: [1.0, 1.0, 1.0],
    flip: false,
};

/// Every profile.
pub static ENGINES: [Engine; 6] = [
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
        lookup: [1.0, 1.0, -1.0],
        ..RAW
    },
    Engine {
        name: "three",
        doc: "three.js r187: level L r (2 - r), last face 8, looked up with (-x, y, z)",
        files: Files::Ktx2 { specular: "{}_pmrem.ktx2", diffuse: None },
        format: TexelFormat::Rgba16f,
        last: 8,
        curve: Curve::Sqrt,
        lookup: [-1.0, 1.0, 1.0],
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
        doc: "glTF-IBL-Sampler: diffuse.ktx2, specular.ktx2, sheen.ktx2, r = m/L",
        files: Files::Khronos,
        format: TexelFormat::Rgba16f,
        ..RAW
    },
    RAW,
];

impl Engine {
    /// The profile of a name.
    pub fn parse(text: &str) -> Result<&'static Self, String> {
        let names = ENGINES.map(|e| e.name);
        let found = ENGINES.iter().find(|e| e.name.eq_ignore_ascii_case(text));
        found.ok_or_else(|| steradian_render::scenefile::unknown("profile", text, &names))
    }

    /// A cube over world directions, as the file holds it. Texels change places only.
    pub fn arrange(&self, cube: &SphereImage) -> SphereImage {
        let signs = DVec3::from_array(self.lookup);
        let n = cube.width;
        let mut out = if signs == DVec3::ONE {
            cube.clone()
        } else {
            // The signs are their own inverse.
            SphereImage::from_fn(Layout::Cube, n, n, |d| cube.nearest(signs * d))
        };
        if self.flip {
            out.planes.iter_mut().for_each(|p| p.chunks_exact_mut(n).for_each(|row| row.reverse()));
        }
        out
    }

    /// The name by which readers undo the arrangement.
    pub fn recorded(&self) -> &'static str {
        if self.name == "raw" { "steradian" } else { self.name }
    }
}

/// What to paste.
pub fn snippet(engine: &Engine, name: &str) -> String {
    match engine.name {
        "bevy" => format!(
            "commands.spawn((Camera3d::default(), EnvironmentMapLight {{\n    \
             diffuse_map: asset_server.load(\"{name}_diffuse_rgb9e5_zstd.ktx2\"),\n    \
             specular_map: asset_server.load(\"{name}_specular_rgb9e5_zstd.ktx2\"),\n    \
             intensity: 1000.0, // radiance 1 in the map is this many cd/m2\n    ..default()\n}}));\n"
        ),
        "three" => format!(
            "import {{ read }} from 'three/addons/libs/ktx-parse.module.js';\n\
             const ktx = read(new Uint8Array(await (await fetch('{name}_pmrem.ktx2')).arrayBuffer()));\n\
             const faces = [0, 1, 2, 3, 4, 5].map(f => ({{ width: ktx.pixelWidth, height: ktx.pixelWidth,\n  \
             mipmaps: ktx.levels.map((l, m) => {{ const n = ktx.pixelWidth >> m;\n    \
             const b = l.levelData.slice(f * n * n * 8, (f + 1) * n * n * 8);\n    \
             return {{ data: new Uint16Array(b.buffer), width: n, height: n }}; }}) }}));\n\
             const env = new THREE.CompressedCubeTexture(faces, THREE.RGBAFormat, THREE.HalfFloatType);\n\
             Object.assign(env, {{ isPMREMTexture: true, mapping: THREE.CubeReflectionMapping, generateMipmaps: false,\n  \
             minFilter: THREE.LinearMipmapLinearFilter, magFilter: THREE.LinearFilter,\n  \
             colorSpace: THREE.LinearSRGBColorSpace, needsUpdate: true }});\n\
             scene.environment = env;\n"
        ),
        "filament" => format!(
            "// buffer: the bytes of {name}/{name}_ibl.ktx\n\
             auto* ibl = new image::Ktx1Bundle(buffer, size);\n\
             float3 sh[9]; ibl->getSphericalHarmonics(sh);\n\
             auto* texture = ktxreader::Ktx1Reader::createTexture(engine, ibl, false);\n\
             auto* light = IndirectLight::Builder().reflections(texture).irradiance(3, sh).intensity(30000).build(*engine);\n"
        ),
        "gltf" => format!(
            "// the light of {name}.gltf, with its images, goes into a scene as\n\
             \"scenes\": [{{ \"extensions\": {{ \"EXT_lights_image_based\": {{ \"light\": 0 }} }} }}]\n"
        ),
        "khronos" => "// diffuse.ktx2: E/pi; specular.ktx2: GGX, lod = perceptual roughness x (levels - 1); sheen.ktx2: Charlie\n".into(),
        _ => format!("steradian sample {name}_specular.ktx2 --level 1 --directions d.csv\n"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_light::load::Profile;

    #[test]
    fn curves_start_at_the_mirror_and_end_at_one() {
        for curve in [Curve::Linear, Curve::Sqrt] {
            assert_eq!(curve.roughness(0, 5), 0.0);
            assert_eq!(curve.roughness(5, 5), 1.0);
            assert_eq!(curve.roughness(0, 0), 0.0);
        }
        // lookup: lod = L r (2 − r)
        for m in 0..=5 {
            let r = Curve::Sqrt.roughness(m, 5);
            assert!((5.0 * r * (2.0 - r) - m as f64).abs() < 1e-12);
        }
    }

    #[test]
    fn readers_undo_what_profiles_do() {
        let cube = SphereImage::from_fn(Layout::Cube, 8, 8, |d| [d.x as f32, d.y as f32, d.z as f32]);
        for engine in &ENGINES {
            let profile = Profile::find(engine.recorded()).unwrap();
            let back = profile.import(engine.arrange(&cube));
            let worst = (0..3)
                .flat_map(|c| back.planes[c].iter().zip(&cube.planes[c]))
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f32::max);
            assert!(worst < 1e-6, "{}: {worst}", engine.name);
        }
    }

    #[test]
    fn consumers_find_world_directions() {
        let cube = SphereImage::from_fn(Layout::Cube, 4, 4, |d| [d.x as f32, d.y as f32, d.z as f32]);
        let bevy = Engine::parse("bevy").unwrap().arrange(&cube);
        // World +Z is looked up as −Z.
        assert!(bevy.nearest(-DVec3::Z)[2] > 0.9);
        let three = Engine::parse("three").unwrap().arrange(&cube);
        assert!(three.nearest(-DVec3::X)[0] > 0.9 && three.nearest(DVec3::Z)[2] > 0.9);
        let gltf = Engine::parse("gltf").unwrap().arrange(&cube);
        assert_eq!(gltf.texel(4, 0, 2)[0], cube.texel(4, 3, 2)[0]);
    }
}
