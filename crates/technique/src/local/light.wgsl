// Directional and point lights: eight numbers a light, as Light::row has them.
struct LocalLight {
    d: vec3<f32>,
    // Distance in metres; 3e38 for a directional light.
    distance: f32,
    e: vec3<f32>,
    // Does the light exist here? A point light does not shine on its own place.
    there: bool,
}

fn local_light(k: u32, p: vec3<f32>) -> LocalLight {
    let place = vec3<f32>(fetch_local_lights(k, 0u), fetch_local_lights(k, 1u), fetch_local_lights(k, 2u));
    let power = vec3<f32>(fetch_local_lights(k, 4u), fetch_local_lights(k, 5u), fetch_local_lights(k, 6u));
    if !(fetch_local_lights(k, 3u) > 0.0) {
        return LocalLight(place, 3e38, power, true);
    }
    let to = place - p;
    let d2 = dot(to, to);
    if !(d2 > 0.0) {
        return LocalLight(place, 0.0, power, false);
    }
    return LocalLight(to / sqrt(d2), sqrt(d2), clamp(power / d2, vec3<f32>(-1e30), vec3<f32>(1e30)), true);
}
