// A generalised cosine lobe of red, green and blue: factor, C in x, y and z, exponent.
struct CosineLobe {
    rho: vec3<f32>,
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
    n: vec3<f32>,
}

// The reflectance of a texel or of a point: the diffuse albedo, and lobes of which cosine_count() are used.
struct CosineLobes {
    rho_d: vec3<f32>,
    lobes: array<CosineLobe, 4>,
}

// Sums over texels: of the largest value, and of that value times C, 1/n and |C|^2.
struct CosineSums {
    rho: vec3<f32>,
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
    s: vec3<f32>,
    q: vec3<f32>,
}

fn cosine_square(t: vec3<f32>, low: vec3<f32>, span: vec3<f32>) -> vec3<f32> {
    return low + span * t * t;
}

fn cosine_linear(t: vec3<f32>, low: vec3<f32>, span: vec3<f32>) -> vec3<f32> {
    return low + span * t;
}

fn cosine_exponential(t: vec3<f32>, low: vec3<f32>, span: vec3<f32>) -> vec3<f32> {
    return low * exp(span * t);
}

// The lobe of the averages over a footprint.
fn cosine_mean(sums: CosineSums) -> CosineLobe {
    let weight = 1.0 / max(sums.rho, vec3<f32>(1e-30));
    let x = weight * sums.x;
    let y = weight * sums.y;
    let z = weight * sums.z;
    let s = max(weight * sums.s, vec3<f32>(1e-30));
    let q = weight * sums.q;
    let square = x * x + y * y + z * z;
    let scatter = vec3<f32>(1.0) - square / max(q, vec3<f32>(1e-30));
    let scattered = scatter > vec3<f32>(1e-5);
    let wide = select(s, s + 0.5 * scatter, scattered);
    let longer = select(vec3<f32>(1.0), sqrt(q / max(square, vec3<f32>(1e-30))), scattered);
    let scale = select(vec3<f32>(1.0), s * (1.0 + wide) / (wide * (1.0 + s)), scattered);
    return CosineLobe(sums.rho * scale, x * longer, y * longer, z * longer, 1.0 / wide);
}

// The lobes at uv, averaged over a square of side `footprint`.
fn cosine_lobes(uv: vec2<f32>, footprint: f32) -> CosineLobes {
    var taps = cosine_taps(uv, footprint);
    var sums: array<CosineSums, 4>;
    var out: CosineLobes;
    for (var i = 0u; i < 8u; i++) {
        let weight = taps[i].weight;
        if !(weight > 0.0) {
            continue;
        }
        var texel = cosine_texel(taps[i].texel);
        out.rho_d += weight * texel.rho_d;
        for (var k = 0u; k < cosine_count(); k++) {
            let l = texel.lobes[k];
            let rho = weight * l.rho;
            sums[k].rho += rho;
            sums[k].x += rho * l.x;
            sums[k].y += rho * l.y;
            sums[k].z += rho * l.z;
            sums[k].s += rho / l.n;
            sums[k].q += rho * (l.x * l.x + l.y * l.y + l.z * l.z);
        }
    }
    for (var k = 0u; k < cosine_count(); k++) {
        out.lobes[k] = cosine_mean(sums[k]);
    }
    return out;
}
