//! Tone mappers as WGSL: the functions of `steradian_render::tone`.

/// The tone mappers that pages know.
pub const TONE_MAPPERS: [&str; 7] =
    ["linear", "reinhard", "hable", "aces", "aces-narkowicz", "agx", "neutral"];

/// The text that defines `gpu_tone`.
pub fn source(name: &str) -> Option<&'static str> {
    Some(match name {
        "linear" => LINEAR,
        "reinhard" => REINHARD,
        "hable" => HABLE,
        "aces" => ACES,
        "aces-narkowicz" => NARKOWICZ,
        "agx" => AGX,
        "neutral" => NEUTRAL,
        _ => return None,
    })
}

const LINEAR: &str = "
fn gpu_tone(x: vec3<f32>) -> vec3<f32> {
    return x;
}
";

const REINHARD: &str = "
fn gpu_tone(x: vec3<f32>) -> vec3<f32> {
    let l = gpu_luminance(x);
    return x * ((1.0 + l / 16.0) / (1.0 + l));
}
";

const HABLE: &str = "
fn gpu_hable(x: vec3<f32>) -> vec3<f32> {
    return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
}

fn gpu_tone(x: vec3<f32>) -> vec3<f32> {
    return gpu_hable(2.0 * x) / gpu_hable(vec3<f32>(11.2));
}
";

const ACES: &str = "
fn gpu_tone(x: vec3<f32>) -> vec3<f32> {
    let v = x * mat3x3<f32>(0.59719, 0.35458, 0.04823, 0.07600, 0.90834, 0.01566, 0.02840, 0.13383, 0.83777);
    let c = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081);
    return c * mat3x3<f32>(1.60475, -0.53108, -0.07367, -0.10208, 1.10813, -0.00605, -0.00327, -0.07276, 1.07602);
}
";

const NARKOWICZ: &str = "
fn gpu_tone(x: vec3<f32>) -> vec3<f32> {
    return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}
";

const AGX: &str = "
fn gpu_tone(x: vec3<f32>) -> vec3<f32> {
    let v = x * mat3x3<f32>(0.84247906, 0.0784336, 0.079223745, 0.042328242, 0.87846864, 0.07916613, 0.042375655, 0.0784336, 0.87914297);
    let t = clamp((log2(max(v, vec3<f32>(1e-10))) + 12.47393) / 16.499999, vec3<f32>(0.0), vec3<f32>(1.0));
    let t2 = t * t;
    let t4 = t2 * t2;
    let c = 15.5 * t4 * t2 - 40.14 * t4 * t + 31.96 * t4 - 6.868 * t2 * t + 0.4298 * t2 + 0.1191 * t - 0.00232;
    let o = c * mat3x3<f32>(1.196879, -0.09802088, -0.09902974, -0.05289685, 1.1519031, -0.09896118, -0.052971635, -0.09804345, 1.1510737);
    return pow(max(o, vec3<f32>(0.0)), vec3<f32>(2.2));
}
";

const NEUTRAL: &str = "
fn gpu_tone(x: vec3<f32>) -> vec3<f32> {
    let low = min(x.x, min(x.y, x.z));
    let c = x - select(0.04, low - 6.25 * low * low, low < 0.08);
    let peak = max(c.x, max(c.y, c.z));
    if peak < 0.76 {
        return c;
    }
    let top = 1.0 - 0.0576 / (peak - 0.52);
    let g = 1.0 - 1.0 / (0.15 * (peak - top) + 1.0);
    return mix(c * (top / peak), vec3<f32>(top), g);
}
";
