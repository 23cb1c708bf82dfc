// Scattering modes (Koenderink, van Doorn & Stavridi 1996): the twin of curet.rs and zernike.rs.
struct Brdf {
    scale: vec4<f32>,
    peak: vec4<f32>,
}

const BRDF_ORDER: i32 = 8;

// R_n^l for n = l, l + 2, ... up to the order: rho^l times Jacobi's polynomials P_k^(0, l) at 2 rho^2 - 1, rho^2 = 1 - cos theta.
fn brdf_radial(cosine: f32, l: i32) -> array<f32, 5> {
    let square = clamp(1.0 - cosine, 0.0, 1.0);
    let rho = sqrt(square);
    let x = 2.0 * square - 1.0;
    let b = f32(l);
    var power = 1.0;
    for (var i = 0; i < l; i++) {
        power *= rho;
    }
    var out: array<f32, 5>;
    var before = 0.0;
    var last = 1.0;
    out[0] = power;
    for (var k = 1; k < 5; k++) {
        let n = f32(k);
        let t = 2.0 * n + b;
        var next = 1.0 + 0.5 * (b + 2.0) * (x - 1.0);
        if k > 1 {
            let top = (t - 1.0) * (t * (t - 2.0) * x - b * b) * last - 2.0 * (n - 1.0) * (n + b - 1.0) * t * before;
            next = top / (2.0 * n * (n + b) * (t - 2.0));
        }
        before = last;
        last = next;
        out[k] = power * next;
    }
    return out;
}

fn brdf_eval(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if !brdf_above(wi, wo) {
        return vec3<f32>(0.0);
    }
    let size = max(length(wi.xy) * length(wo.xy), 1e-37);
    let cosine = clamp(dot(wi.xy, wo.xy) / size, -1.0, 1.0);
    // cos l phi of l and l + 1.
    var turn = vec2<f32>(1.0, cosine);
    var sum = vec3<f32>(0.0);
    var mode = 0u;
    for (var l = 0; l <= BRDF_ORDER; l++) {
        var a = brdf_radial(wi.z, l);
        var b = brdf_radial(wo.z, l);
        for (var i = 0; 2 * i <= BRDF_ORDER - l; i++) {
            for (var j = 0; j <= i; j++) {
                sum += turn.x * (a[i] * b[j] + a[j] * b[i]) * brdf_cell(mode);
                mode++;
            }
        }
        turn = vec2<f32>(turn.y, 2.0 * cosine * turn.y - turn.x);
    }
    return max(sum, vec3<f32>(0.0));
}
