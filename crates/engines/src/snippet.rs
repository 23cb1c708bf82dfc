//! What a user of an engine pastes into a project.

use crate::{Engine, Filtered, sun};
use steradian_formats::TexelFormat;

impl Filtered {
    /// Source text in the engine's language that loads the files and adds the suns taken out of the light as
    /// lights. `None` for files of no engine.
    pub fn snippet(&self) -> Option<String> {
        let engine = self.request.engine?;
        let map = snippet(&self.engine(), &self.request.name);
        Some(map + &sun::lines(engine.name, &self.request.suns))
    }
}

/// What loads the files of `engine`, whose texels are of the format that it has here.
fn snippet(engine: &Engine, name: &str) -> String {
    let format = engine.format.name();
    match engine.name {
        "bevy" => format!(
            "commands.spawn((Camera3d::default(), EnvironmentMapLight {{\n    \
             diffuse_map: asset_server.load(\"{name}_diffuse_{format}_zstd.ktx2\"),\n    \
             specular_map: asset_server.load(\"{name}_specular_{format}_zstd.ktx2\"),\n    \
             intensity: 1000.0, // radiance 1 in the map is this many cd/m2\n    ..default()\n}}));\n"
        ),
        "three" => {
            let (bytes, array, kind) = match engine.format {
                TexelFormat::Rgba32f => (16, "Float32Array", "Float"),
                _ => (8, "Uint16Array", "HalfFloat"),
            };
            format!(
            "import {{ read }} from 'three/addons/libs/ktx-parse.module.js';\n\
             const ktx = read(new Uint8Array(await (await fetch('{name}_pmrem.ktx2')).arrayBuffer()));\n\
             const faces = [0, 1, 2, 3, 4, 5].map(f => ({{ width: ktx.pixelWidth, height: ktx.pixelWidth,\n  \
             mipmaps: ktx.levels.map((l, m) => {{ const n = ktx.pixelWidth >> m;\n    \
             const b = l.levelData.slice(f * n * n * {bytes}, (f + 1) * n * n * {bytes});\n    \
             return {{ data: new {array}(b.buffer), width: n, height: n }}; }}) }}));\n\
             const env = new THREE.CompressedCubeTexture(faces, THREE.RGBAFormat, THREE.{kind}Type);\n\
             Object.assign(env, {{ isPMREMTexture: true, mapping: THREE.CubeReflectionMapping, generateMipmaps: false,\n  \
             minFilter: THREE.LinearMipmapLinearFilter, magFilter: THREE.LinearFilter,\n  \
             colorSpace: THREE.LinearSRGBColorSpace, needsUpdate: true }});\n\
             scene.environment = env;\n"
        )
        }
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
        "khronos" => "// diffuse.ktx2: E/pi; specular.ktx2: GGX, lod = perceptual roughness x (levels - 1); sheen.ktx2: Charlie;\n\
             // outputLUT.png: F0 * R + G at (n.v, perceptual roughness), row 0 at 0\n".into(),
        "godot" => format!(
            "# {name}.exr in the project's folder\n\
             var sky_material := PanoramaSkyMaterial.new()\n\
             sky_material.panorama = load(\"res://{name}.exr\")\n\
             var sky := Sky.new()\n\
             sky.sky_material = sky_material\n\
             var environment := Environment.new()\n\
             environment.background_mode = Environment.BG_SKY\n\
             environment.sky = sky\n\
             $WorldEnvironment.environment = environment\n"
        ),
        "unreal" => format!(
            "# in the editor's Python console; {name}.hdr (lat-long) or {name}.dds (cube) becomes a TextureCube\n\
             import unreal\n\
             task = unreal.AssetImportTask()\n\
             task.set_editor_property('filename', '{name}.hdr')\n\
             task.set_editor_property('destination_path', '/Game/Light')\n\
             task.set_editor_property('automated', True)\n\
             unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task])\n\
             cube = unreal.load_asset('/Game/Light/{name}')\n\
             for light in unreal.GameplayStatics.get_all_actors_of_class(\n        \
             unreal.EditorLevelLibrary.get_editor_world(), unreal.SkyLight):\n    \
             component = light.get_editor_property('light_component')\n    \
             component.set_editor_property('source_type', unreal.SkyLightSourceType.SLS_SPECIFIED_CUBEMAP)\n    \
             component.set_editor_property('cubemap', cube)\n"
        ),
        "blender" => format!(
            "import bpy\n\
             world = bpy.context.scene.world or bpy.data.worlds.new('World')\n\
             bpy.context.scene.world = world\n\
             world.use_nodes = True\n\
             nodes, links = world.node_tree.nodes, world.node_tree.links\n\
             image = nodes.new('ShaderNodeTexEnvironment')\n\
             image.image = bpy.data.images.load('//{name}.exr')\n\
             links.new(image.outputs['Color'], nodes['Background'].inputs['Color'])\n"
        ),
        "babylon" => format!(
            "scene.useRightHandedSystem = true;\n\
             scene.environmentTexture = BABYLON.CubeTexture.CreateFromPrefilteredData('{name}.dds', scene);\n"
        ),
        "playcanvas" => format!(
            "const asset = new pc.Asset('{name}', 'texture', {{ url: '{name}.hdr' }}, {{ mipmaps: false }});\n\
             app.assets.add(asset);\n\
             asset.ready(() => {{\n  \
             asset.resource.projection = pc.TEXTUREPROJECTION_EQUIRECT;\n  \
             app.scene.skybox = pc.EnvLighting.generateSkyboxCubemap(asset.resource);\n  \
             const source = pc.EnvLighting.generateLightingSource(asset.resource);\n  \
             app.scene.envAtlas = pc.EnvLighting.generateAtlas(source);\n\
             }});\napp.assets.load(asset);\n"
        ),
        "unity" => format!(
            "// {name}.exr in Assets/Resources, imported as a 2D texture without sRGB and without compression\n\
             var sky = new Material(Shader.Find(\"Skybox/Panoramic\"));\n\
             sky.SetTexture(\"_MainTex\", Resources.Load<Texture2D>(\"{name}\"));\n\
             RenderSettings.skybox = sky;\n\
             RenderSettings.ambientMode = UnityEngine.Rendering.AmbientMode.Skybox;\n\
             DynamicGI.UpdateEnvironment();\n"
        ),
        _ => format!("steradian sample {name}_specular.ktx2 --level 1 --directions d.csv\n"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_reads_texels_as_they_are() {
        let three = Engine::find("three").expect("known");
        assert!(snippet(three, "x").contains("n * n * 8)") && snippet(three, "x").contains("HalfFloatType"));
        let floats = snippet(&Engine { format: TexelFormat::Rgba32f, ..*three }, "x");
        assert!(floats.contains("n * n * 16)") && floats.contains("Float32Array"), "{floats}");
        assert!(floats.contains("THREE.FloatType"), "{floats}");
    }
}
