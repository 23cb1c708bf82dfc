// A small network: the twin of nbrdf.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
}

const BRDF_HIDDEN: u32 = 21u;

// Number i of the file: weights of the layers, inputs outermost, each with its biases behind.
fn brdf_weight(i: u32) -> f32 {
    return brdf_cell(i / 3u)[i % 3u];
}

// The network at half vector (h.x, 0, h.y) and a difference vector.
fn brdf_network(h: vec2<f32>, d: vec3<f32>) -> vec3<f32> {
    var input = array<f32, 6>(h.x, 0.0, h.y, d.x, d.y, d.z);
    var one: array<f32, 21>;
    var two: array<f32, 21>;
    var at = 0u;
    for (var j = 0u; j < BRDF_HIDDEN; j++) {
        var sum = brdf_weight(at + 6u * BRDF_HIDDEN + j);
        for (var i = 0u; i < 6u; i++) {
            sum += input[i] * brdf_weight(at + i * BRDF_HIDDEN + j);
        }
        one[j] = max(sum, 0.0);
    }
    at += 7u * BRDF_HIDDEN;
    for (var j = 0u; j < BRDF_HIDDEN; j++) {
        var sum = brdf_weight(at + BRDF_HIDDEN * BRDF_HIDDEN + j);
        for (var i = 0u; i < BRDF_HIDDEN; i++) {
            sum += one[i] * brdf_weight(at + i * BRDF_HIDDEN + j);
        }
        two[j] = max(sum, 0.0);
    }
    // The last layer has three outputs: a cell each.
    at = (at + BRDF_HIDDEN * BRDF_HIDDEN + BRDF_HIDDEN) / 3u;
    var x = brdf_cell(at + BRDF_HIDDEN);
    for (var i = 0u; i < BRDF_HIDDEN; i++) {
        x += two[i] * brdf_cell(at + i);
    }
    let c = clamp(x, vec3<f32>(0.0), vec3<f32>(30.0));
    return vec3<f32>(brdf_exp_m1(c.x), brdf_exp_m1(c.y), brdf_exp_m1(c.z));
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let h = brdf_halved(wi, wo);
    let d = h.light;
    return 0.5 * (brdf_network(h.tilt.yx, d) + brdf_network(h.tilt.yx, vec3<f32>(-d.xy, d.z)));
}
