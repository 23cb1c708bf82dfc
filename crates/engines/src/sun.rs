//! Suns that were taken out of an engine's map, as lights in the engine's axes, units and language.

use glam::DVec3;
use std::fmt::Write;
use steradian_light::DiskLight;

/// A sun as engines describe one: a direction, a strength and a colour whose largest part is 1.
struct Sun {
    /// Towards the sun, our world.
    direction: DVec3,
    /// Irradiance of the strongest channel on a surface that faces it, in units of the map's radiance times
    /// steradians.
    irradiance: f64,
    colour: [f64; 3],
    /// From rim to rim, radians.
    diameter: f64,
}

impl Sun {
    fn of(d: &DiskLight) -> Self {
        let area = std::f64::consts::PI * d.angular_radius.sin().powi(2);
        let e = d.radiance.map(|l| l * area);
        let irradiance = e.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        Self {
            direction: d.direction,
            irradiance,
            colour: e.map(|v| v / irradiance),
            diameter: 2.0 * d.angular_radius,
        }
    }
}

/// `x, y, z` with what a picture needs of digits.
fn triple(v: [f64; 3]) -> String {
    v.map(|x| format!("{x:.5}")).join(", ")
}

/// Lines that add the suns to a scene; nothing without suns.
pub(crate) fn lines(engine: &str, suns: &[DiskLight]) -> String {
    let mut out = String::new();
    for (i, disk) in suns.iter().enumerate() {
        let sun = Sun::of(disk);
        // Writing to a string does not fail.
        let _ = out.write_str(&one(engine, i, &sun));
    }
    out
}

fn one(engine: &str, i: usize, s: &Sun) -> String {
    let pi = std::f64::consts::PI;
    let (e, colour) = (s.irradiance, triple(s.colour));
    let towards = triple(s.direction.to_array());
    let away = triple((-s.direction).to_array());
    match engine {
        "bevy" => format!(
            "commands.spawn((DirectionalLight {{ color: Color::linear_rgb({colour}),\n    \
             illuminance: {:.5}, // irradiance {e:.5} x the map's intensity\n    ..default() }},\n    \
             Transform::default().looking_to(Vec3::new({away}), Vec3::Y)));\n",
            1000.0 * e
        ),
        "three" => format!(
            "const sun{i} = new THREE.DirectionalLight(new THREE.Color().setRGB({colour}), {e:.5});\n\
             sun{i}.position.set({towards});\nscene.add(sun{i});\n"
        ),
        "filament" => format!(
            "LightManager::Builder(LightManager::Type::{}).color({{ {colour} }}).direction({{ {away} }})\n    \
             .intensity({:.5}f).build(*engine, EntityManager::get().create()); // irradiance x the light's intensity\n",
            if i == 0 { "SUN" } else { "DIRECTIONAL" },
            30000.0 * e
        ),
        "gltf" => {
            // glTF's lights shine along −Z of their node.
            let q = glam::DQuat::from_rotation_arc(DVec3::NEG_Z, -s.direction);
            format!(
                "// sun {i}: extensions.KHR_lights_punctual.lights[{i}], and a node that holds it\n\
                 {{ \"type\": \"directional\", \"color\": [{colour}], \"intensity\": {e:.5} }}\n\
                 {{ \"rotation\": [{:.6}, {:.6}, {:.6}, {:.6}], \"extensions\": {{ \"KHR_lights_punctual\": {{ \"light\": {i} }} }} }}\n",
                q.x, q.y, q.z, q.w
            )
        }
        "godot" => format!(
            "var sun{i} := DirectionalLight3D.new()\nadd_child(sun{i})\n\
             sun{i}.look_at_from_position(Vector3({towards}), Vector3.ZERO)\n\
             sun{i}.light_color = Color({colour}).linear_to_srgb()\n\
             sun{i}.light_energy = {:.5} # irradiance / pi\nsun{i}.light_angular_distance = {:.4}\n",
            e / pi,
            s.diameter.to_degrees()
        ),
        "unreal" => {
            let d = -s.direction;
            format!(
                "rotation = unreal.MathLibrary.make_rot_from_x(unreal.Vector({}))\n\
                 sun = unreal.EditorLevelLibrary.spawn_actor_from_class(unreal.DirectionalLight, unreal.Vector(0, 0, 0), rotation)\n\
                 component = sun.get_editor_property('light_component')\n\
                 component.set_editor_property('intensity', {e:.5}) # lux, where the map is in cd/m2\n\
                 component.set_light_color(unreal.LinearColor({colour}))\n\
                 component.set_editor_property('light_source_angle', {:.4})\n",
                triple([d.x, d.z, d.y]),
                s.diameter.to_degrees()
            )
        }
        "blender" => format!(
            "import mathutils\n\
             sun = bpy.data.lights.new('Sun', 'SUN')\n\
             sun.energy, sun.color, sun.angle = {e:.5}, ({colour}), {:.6}\n\
             lamp = bpy.data.objects.new('Sun', sun)\n\
             lamp.rotation_euler = mathutils.Vector(({})).to_track_quat('Z', 'Y').to_euler()\n\
             bpy.context.scene.collection.objects.link(lamp)\n",
            s.diameter,
            triple([s.direction.x, -s.direction.z, s.direction.y])
        ),
        "babylon" => format!(
            "const sun{i} = new BABYLON.DirectionalLight('sun{i}', new BABYLON.Vector3({away}), scene);\n\
             sun{i}.diffuse = sun{i}.specular = new BABYLON.Color3({colour});\nsun{i}.intensity = {e:.5};\n"
        ),
        "playcanvas" => format!(
            "const sun{i} = new pc.Entity();\n\
             sun{i}.addComponent('light', {{ type: 'directional', color: new pc.Color({colour}),\n  \
             intensity: {:.5} }}); // irradiance / pi\n\
             sun{i}.lookAt({away});\nsun{i}.rotateLocal(90, 0, 0); // a light shines along -Y of its entity\n\
             app.root.addChild(sun{i});\n",
            e / pi
        ),
        "unity" => {
            let d = -s.direction;
            format!(
                "var sun{i} = new GameObject(\"Sun\").AddComponent<Light>();\n\
                 sun{i}.type = LightType.Directional;\nsun{i}.color = new Color({}).gamma;\n\
                 sun{i}.intensity = {:.5}f; // irradiance / pi\n\
                 sun{i}.transform.rotation = Quaternion.LookRotation(new Vector3({}));\n",
                suffixed(s.colour),
                e / pi,
                suffixed([-d.x, d.y, d.z])
            )
        }
        _ => format!(
            "// sun {i}: towards ({towards}), irradiance {} on a surface that faces it, {:.4} degrees across\n",
            triple(s.colour.map(|c| c * e)),
            s.diameter.to_degrees()
        ),
    }
}

/// `xf, yf, zf`
fn suffixed(v: [f64; 3]) -> String {
    v.map(|x| format!("{x:.5}f")).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ENGINES;

    /// The numbers between `from` and the next `)`.
    fn numbers(text: &str, from: &str) -> DVec3 {
        let at = text.find(from).unwrap_or_else(|| panic!("{from} in {text}")) + from.len();
        let end = at + text[at..].find([')', '}']).expect("an end");
        let v: Vec<f64> = text[at..end]
            .split(',')
            .map(|x| x.trim().trim_end_matches('f').parse().expect("a number"))
            .collect();
        DVec3::new(v[0], v[1], v[2])
    }

    /// Each engine's light comes from where the sun is, in the engine's axes.
    #[test]
    fn suns_shine_from_where_they_are() {
        let d = DVec3::new(0.48, 0.6, 0.64);
        let disk = DiskLight { direction: d, angular_radius: 0.005, radiance: [4e4, 2e4, 1e4] };
        let e = 4e4 * std::f64::consts::PI * 0.005f64.sin().powi(2);
        for (engine, from, want) in [
            ("bevy", "Vec3::new(", -d),
            ("three", "position.set(", d),
            ("filament", "direction({", -d),
            ("godot", "look_at_from_position(Vector3(", d),
            ("unreal", "unreal.Vector(", -DVec3::new(d.x, d.z, d.y)),
            // Blender's Z-up world: (x, −z, y); its sun shines along −Z of the object.
            ("blender", "mathutils.Vector((", DVec3::new(d.x, -d.z, d.y)),
            ("babylon", "Vector3(", -d),
            ("playcanvas", "lookAt(", -d),
            ("unity", "LookRotation(new Vector3(", DVec3::new(d.x, -d.y, -d.z)),
            ("raw", "towards (", d),
        ] {
            let text = lines(engine, &[disk]);
            assert!(numbers(&text, from).distance(want) < 1e-4, "{engine}: {text}");
        }
        let text = lines("gltf", &[disk]);
        let at = text.find("\"rotation\": [").expect("a rotation") + 13;
        let q: Vec<f64> = text[at..at + text[at..].find(']').expect("its end")]
            .split(',')
            .map(|v| v.trim().parse().expect("a number"))
            .collect();
        let shines = glam::DQuat::from_xyzw(q[0], q[1], q[2], q[3]) * DVec3::NEG_Z;
        assert!(shines.distance(-d) < 1e-5, "{shines}");
        for engine in &ENGINES {
            let text = lines(engine.name, &[disk, disk]);
            let strengths = [e, e / std::f64::consts::PI, 1000.0 * e, 30000.0 * e].map(|v| format!("{v:.5}"));
            let raw = engine.name == "raw" || engine.name == "khronos";
            assert!(raw || text.contains("0.25000"), "{}: its colour: {text}", engine.name);
            assert!(raw || strengths.iter().any(|s| text.contains(s)), "{}: {text}", engine.name);
            assert_eq!(lines(engine.name, &[]), "");
        }
    }
}
