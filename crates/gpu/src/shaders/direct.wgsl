// Lights shaded with the exact reflectance: the twin of steradian_technique::direct.
struct GpuLight {
    // Disk or direction: unit direction and angular radius (0: a direction). Point: position.
    place: vec4<f32>,
    // Radiance, irradiance or radiant intensity; w: 1 for a point.
    power: vec4<f32>,
}

struct GpuLights {
    // Number of lights, in x.
    counts: vec4<u32>,
    // Gauss-Legendre nodes and weights on 0 ... 1; the rule of n = 1, 2, 4, 8, 16, 32 starts at n - 1.
    gauss: array<vec4<f32>, 63>,
    lights: array<GpuLight, GPU_CAPACITY>,
}
@group(2) @binding(1) var<uniform> gpu_lights: GpuLights;
@group(2) @binding(2) var<uniform> brdf: Brdf;

fn gpu_node(i: u32) -> vec2<f32> {
    return gpu_lights.gauss[i].xy;
}

// Radiance of all lights from a point with unit normal and tangent towards unit wo.
fn gpu_direct(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    let frame = transpose(mat3x3<f32>(t, cross(n, t), n));
    let o = frame * wo;
    if o.z <= 0.0 {
        return vec3<f32>(0.0);
    }
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < gpu_lights.counts.x; k++) {
        let light = gpu_lights.lights[k];
        if light.place.w > 0.0 {
            sum += gpu_seen_disk(light.place, frame, o, n, p) * light.power.rgb;
            continue;
        }
        var d = light.place.xyz;
        var distance = 3e38;
        var e = light.power.rgb;
        if light.power.w > 0.0 {
            let to = d - p;
            let d2 = dot(to, to);
            if !(d2 > 0.0) {
                continue;
            }
            distance = sqrt(d2);
            d = to / distance;
            e = clamp(e / d2, vec3<f32>(-1e30), vec3<f32>(1e30));
        }
        // One evaluation for both kinds: compilers put its text at every call.
        sum += brdf_value(frame * d, o) * e * gpu_arriving(p, n, d, distance);
    }
    return sum;
}
