//! Tables as source text: WGSL, GLSL, HLSL and Rust, an array and the function that reads it.

use super::lut::{Layout, Lut};
use std::fmt::Write;

/// A language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// WGSL.
    Wgsl,
    /// GLSL 3.30, GLSL ES 3.00 and later.
    Glsl,
    /// HLSL of shader model 4 and later.
    Hlsl,
    /// Rust.
    Rust,
}

impl Language {
    /// The language of files with this extension.
    pub fn of_extension(extension: &str) -> Option<Self> {
        match extension {
            "wgsl" => Some(Self::Wgsl),
            "glsl" => Some(Self::Glsl),
            "hlsl" => Some(Self::Hlsl),
            "rs" => Some(Self::Rust),
            _ => None,
        }
    }
}

/// Channels of the table in text. E_avg, which is constant over a row, is an array of its own ([`averages`]).
fn channels(lut: &Lut) -> usize {
    match lut.layout {
        Layout::ScaleBias => 2,
        l => l.channels().len(),
    }
}

/// The table and a function `dfg` that reads it bilinearly. `notes` go into the comment above, one line each.
pub fn source(lut: &Lut, language: Language, notes: &[String]) -> String {
    let mut out = head(lut, notes);
    match language {
        Language::Wgsl => wgsl(lut, &mut out),
        Language::Glsl => glsl(lut, &mut out),
        Language::Hlsl => hlsl(lut, &mut out),
        Language::Rust => rust(lut, &mut out),
    }
    out
}

/// The comment at the head, the same in every language.
fn head(lut: &Lut, notes: &[String]) -> String {
    let mut out = format!("// {} table, {} x {} texels.\n", lut.layout.name(), lut.size, lut.size);
    for (c, what) in ["x", "y", "z"].iter().zip(&lut.layout.channels()[..channels(lut)]) {
        out.push_str(&format!("// {c}: {what}\n"));
    }
    for line in wrapped(Lut::AXES) {
        out.push_str(&format!("// {line}\n"));
    }
    notes.iter().for_each(|n| out.push_str(&format!("// {}\n", n.replace(['\n', '\r'], " "))));
    out
}

fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(l) if l.len() + word.len() < 100 => {
                let space = if l.is_empty() { "" } else { " " };
                l.push_str(&format!("{space}{word}"));
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

/// The shortest text that gives each number back to 1e-6, eight in a line.
fn numbers(lut: &Lut, item: impl Fn(&[f32]) -> String) -> String {
    let mut out = String::new();
    for line in lut.values.chunks(if channels(lut) == 1 { 8 } else { 4 }) {
        let items: Vec<String> = line.iter().map(|v| item(&v[..channels(lut)])).collect();
        // Writing to a String cannot fail.
        let _ = writeln!(out, "    {},", items.join(", "));
    }
    out
}

/// E_avg of every row, where the layout has it.
fn averages(lut: &Lut) -> Option<String> {
    let row = lut.values.iter().step_by(lut.size).map(|v| decimal(v[2]));
    (lut.layout == Layout::ScaleBias).then(|| row.collect::<Vec<_>>().join(", "))
}

const AVERAGES: &str =
    "E_avg = 2 * integral of E(mu) mu, E = A + B, at every row's roughness: Kulla & Conty 2017.";

fn decimal(v: f32) -> String {
    format!("{v:.6}")
}

fn joined(v: &[f32]) -> String {
    v.iter().map(|v| decimal(*v)).collect::<Vec<_>>().join(", ")
}

fn wgsl(lut: &Lut, out: &mut String) {
    let (n, kind) = (lut.size, ["f32", "vec2<f32>", "vec3<f32>"][channels(lut) - 1]);
    let item = |v: &[f32]| if v.len() == 1 { joined(v) } else { format!("{kind}({})", joined(v)) };
    let table = numbers(lut, item);
    let _ = write!(
        out,
        "const DFG_SIZE: i32 = {n};\n\
         const DFG: array<{kind}, {}> = array<{kind}, {}>(\n{table});\n\n\
         fn dfg(n_dot_v: f32, perceptual_roughness: f32) -> {kind} {{\n\
         \x20   // Indexing with a variable needs a variable.\n\
         \x20   var table = DFG;\n\
         \x20   let at = clamp(vec2<f32>(n_dot_v, perceptual_roughness) * f32(DFG_SIZE) - 0.5, vec2<f32>(0.0), vec2<f32>(f32(DFG_SIZE - 1)));\n\
         \x20   let low = vec2<i32>(floor(at));\n\
         \x20   let high = min(low + vec2<i32>(1), vec2<i32>(DFG_SIZE - 1));\n\
         \x20   let t = at - floor(at);\n\
         \x20   let top = mix(table[low.y * DFG_SIZE + low.x], table[low.y * DFG_SIZE + high.x], t.x);\n\
         \x20   let bottom = mix(table[high.y * DFG_SIZE + low.x], table[high.y * DFG_SIZE + high.x], t.x);\n\
         \x20   return mix(top, bottom, t.y);\n\
         }}\n",
        n * n,
        n * n,
    );
    if matches!(lut.layout, Layout::ScaleBias | Layout::Khronos) {
        out.push_str(
            "\n// F_ss (x) and the share of diffuse light E/pi that multiple scattering adds (y): Fdez-Aguera 2019.\n\
             fn dfg_multiscatter(f0: f32, ab: vec2<f32>) -> vec2<f32> {\n    \
             let single = f0 * ab.x + ab.y;\n    \
             let lost = 1.0 - (ab.x + ab.y);\n    \
             let f_avg = f0 + (1.0 - f0) / 21.0;\n    \
             return vec2<f32>(single, single * f_avg / (1.0 - f_avg * lost) * lost);\n}\n",
        );
    }
    if let Some(row) = averages(lut) {
        let _ = write!(
            out,
            "\n// {AVERAGES}\n\
             const DFG_E_AVG: array<f32, {n}> = array<f32, {n}>({row});\n\n\
             fn dfg_e_avg(perceptual_roughness: f32) -> f32 {{\n\
             \x20   var row = DFG_E_AVG;\n\
             \x20   let at = clamp(perceptual_roughness * f32(DFG_SIZE) - 0.5, 0.0, f32(DFG_SIZE - 1));\n\
             \x20   let low = i32(floor(at));\n\
             \x20   return mix(row[low], row[min(low + 1, DFG_SIZE - 1)], at - floor(at));\n\
             }}\n",
        );
    }
}

fn glsl(lut: &Lut, out: &mut String) {
    let (n, kind) = (lut.size, ["float", "vec2", "vec3"][channels(lut) - 1]);
    let item = |v: &[f32]| if v.len() == 1 { joined(v) } else { format!("{kind}({})", joined(v)) };
    let table = numbers(lut, item);
    // No comma behind the last item.
    let table = table.trim_end().trim_end_matches(',');
    let _ = write!(
        out,
        "const int DFG_SIZE = {n};\n\
         const {kind} DFG[{0}] = {kind}[{0}](\n{table}\n);\n\n\
         {kind} dfg(float n_dot_v, float perceptual_roughness) {{\n\
         \x20   vec2 at = clamp(vec2(n_dot_v, perceptual_roughness) * float(DFG_SIZE) - 0.5, vec2(0.0), vec2(float(DFG_SIZE - 1)));\n\
         \x20   ivec2 low = ivec2(floor(at));\n\
         \x20   ivec2 high = min(low + ivec2(1), ivec2(DFG_SIZE - 1));\n\
         \x20   vec2 t = fract(at);\n\
         \x20   {kind} top = mix(DFG[low.y * DFG_SIZE + low.x], DFG[low.y * DFG_SIZE + high.x], t.x);\n\
         \x20   {kind} bottom = mix(DFG[high.y * DFG_SIZE + low.x], DFG[high.y * DFG_SIZE + high.x], t.x);\n\
         \x20   return mix(top, bottom, t.y);\n\
         }}\n",
        n * n,
    );
    if matches!(lut.layout, Layout::ScaleBias | Layout::Khronos) {
        out.push_str(
            "\n// F_ss (x) and the share of diffuse light E/pi that multiple scattering adds (y): Fdez-Aguera 2019.\n\
             vec2 dfg_multiscatter(float f0, vec2 ab) {\n    \
             float single = f0 * ab.x + ab.y;\n    \
             float lost = 1.0 - (ab.x + ab.y);\n    \
             float f_avg = f0 + (1.0 - f0) / 21.0;\n    \
             return vec2(single, single * f_avg / (1.0 - f_avg * lost) * lost);\n}\n",
        );
    }
    if let Some(row) = averages(lut) {
        let _ = write!(
            out,
            "\n// {AVERAGES}\n\
             const float DFG_E_AVG[{n}] = float[{n}]({row});\n\n\
             float dfg_e_avg(float perceptual_roughness) {{\n\
             \x20   float at = clamp(perceptual_roughness * float(DFG_SIZE) - 0.5, 0.0, float(DFG_SIZE - 1));\n\
             \x20   int low = int(floor(at));\n\
             \x20   return mix(DFG_E_AVG[low], DFG_E_AVG[min(low + 1, DFG_SIZE - 1)], fract(at));\n\
             }}\n",
        );
    }
}

fn hlsl(lut: &Lut, out: &mut String) {
    let (n, kind) = (lut.size, ["float", "float2", "float3"][channels(lut) - 1]);
    let item = |v: &[f32]| if v.len() == 1 { joined(v) } else { format!("{kind}({})", joined(v)) };
    let table = numbers(lut, item);
    let table = table.trim_end().trim_end_matches(',');
    let _ = write!(
        out,
        "static const int DFG_SIZE = {n};\n\
         static const {kind} DFG[{0}] = {{\n{table}\n}};\n\n\
         {kind} dfg(float n_dot_v, float perceptual_roughness) {{\n\
         \x20   float2 at = clamp(float2(n_dot_v, perceptual_roughness) * float(DFG_SIZE) - 0.5, 0.0, float(DFG_SIZE - 1));\n\
         \x20   int2 low = int2(floor(at));\n\
         \x20   int2 high = min(low + 1, DFG_SIZE - 1);\n\
         \x20   float2 t = frac(at);\n\
         \x20   {kind} top = lerp(DFG[low.y * DFG_SIZE + low.x], DFG[low.y * DFG_SIZE + high.x], t.x);\n\
         \x20   {kind} bottom = lerp(DFG[high.y * DFG_SIZE + low.x], DFG[high.y * DFG_SIZE + high.x], t.x);\n\
         \x20   return lerp(top, bottom, t.y);\n\
         }}\n",
        n * n,
    );
    if matches!(lut.layout, Layout::ScaleBias | Layout::Khronos) {
        out.push_str(
            "\n// F_ss (x) and the share of diffuse light E/pi that multiple scattering adds (y): Fdez-Aguera 2019.\n\
             float2 dfg_multiscatter(float f0, float2 ab) {\n    \
             float single = f0 * ab.x + ab.y;\n    \
             float lost = 1.0 - (ab.x + ab.y);\n    \
             float f_avg = f0 + (1.0 - f0) / 21.0;\n    \
             return float2(single, single * f_avg / (1.0 - f_avg * lost) * lost);\n}\n",
        );
    }
    if let Some(row) = averages(lut) {
        let _ = write!(
            out,
            "\n// {AVERAGES}\n\
             static const float DFG_E_AVG[{n}] = {{ {row} }};\n\n\
             float dfg_e_avg(float perceptual_roughness) {{\n\
             \x20   float at = clamp(perceptual_roughness * float(DFG_SIZE) - 0.5, 0.0, float(DFG_SIZE - 1));\n\
             \x20   int low = int(floor(at));\n\
             \x20   return lerp(DFG_E_AVG[low], DFG_E_AVG[min(low + 1, DFG_SIZE - 1)], frac(at));\n\
             }}\n",
        );
    }
}

fn rust(lut: &Lut, out: &mut String) {
    let (n, c) = (lut.size, channels(lut));
    let table = numbers(lut, |v| format!("[{}]", joined(v)));
    let _ = write!(
        out,
        "/// Texels a side.\n\
         pub const DFG_SIZE: usize = {n};\n\n\
         /// The table, row by row.\n\
         pub static DFG: [[f32; {c}]; {}] = [\n{table}];\n\n\
         /// Bilinear lookup.\n\
         pub fn dfg(n_dot_v: f32, perceptual_roughness: f32) -> [f32; {c}] {{\n\
         \x20   let last = (DFG_SIZE - 1) as f32;\n\
         \x20   let x = (n_dot_v * DFG_SIZE as f32 - 0.5).max(0.0).min(last);\n\
         \x20   let y = (perceptual_roughness * DFG_SIZE as f32 - 0.5).max(0.0).min(last);\n\
         \x20   let (i, j) = (x as usize, y as usize);\n\
         \x20   let (i1, j1) = ((i + 1).min(DFG_SIZE - 1), (j + 1).min(DFG_SIZE - 1));\n\
         \x20   let (s, t) = (x - i as f32, y - j as f32);\n\
         \x20   let mut out = [0.0; {c}];\n\
         \x20   for (c, out) in out.iter_mut().enumerate() {{\n\
         \x20       let top = DFG[j * DFG_SIZE + i][c] * (1.0 - s) + DFG[j * DFG_SIZE + i1][c] * s;\n\
         \x20       let bottom = DFG[j1 * DFG_SIZE + i][c] * (1.0 - s) + DFG[j1 * DFG_SIZE + i1][c] * s;\n\
         \x20       *out = top * (1.0 - t) + bottom * t;\n\
         \x20   }}\n\
         \x20   out\n\
         }}\n",
        n * n,
    );
    if let Some(row) = averages(lut) {
        let _ = write!(
            out,
            "\n/// {AVERAGES}\n\
             pub static DFG_E_AVG: [f32; DFG_SIZE] = [{row}];\n\n\
             /// Linear lookup.\n\
             pub fn dfg_e_avg(perceptual_roughness: f32) -> f32 {{\n\
             \x20   let at = (perceptual_roughness * DFG_SIZE as f32 - 0.5).max(0.0).min((DFG_SIZE - 1) as f32);\n\
             \x20   let low = at as usize;\n\
             \x20   let t = at - low as f32;\n\
             \x20   DFG_E_AVG[low] * (1.0 - t) + DFG_E_AVG[(low + 1).min(DFG_SIZE - 1)] * t\n\
             }}\n",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_base::Task;

    fn lut(layout: Layout) -> Lut {
        Lut::new(layout, 4, &Task::quiet()).unwrap()
    }

    #[test]
    fn texts_hold_the_table_s_numbers() {
        for layout in Layout::ALL {
            let lut = lut(layout);
            for language in [Language::Wgsl, Language::Glsl, Language::Hlsl, Language::Rust] {
                let text = source(&lut, language, &["a\nnote".into()]);
                assert!(text.contains("// a note\n"));
                let start = ["= [", "](", ">(", "= {"].iter().find_map(|s| text.find(s)).unwrap();
                let body = &text[start..];
                let found: Vec<f32> = body
                    .split(|c: char| !(c.is_ascii_digit() || c == '.'))
                    .filter(|t| t.len() == 8)
                    .map(|t| t.parse().unwrap())
                    .collect();
                let mut want: Vec<f32> =
                    lut.values.iter().flat_map(|v| v[..channels(&lut)].to_vec()).collect();
                if layout == Layout::ScaleBias {
                    want.extend(lut.values.iter().step_by(lut.size).map(|v| v[2]));
                }
                assert_eq!(found.len(), want.len(), "{layout:?} {language:?}");
                assert!(found.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-6));
            }
        }
    }

    /// Naga reads the text and finds nothing wrong with it.
    #[test]
    fn wgsl_is_valid() {
        for layout in Layout::ALL {
            let text = source(&lut(layout), Language::Wgsl, &[]);
            let module = naga::front::wgsl::parse_str(&text).expect("WGSL");
            let mut v = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::empty(),
            );
            v.validate(&module).unwrap_or_else(|e| panic!("{layout:?}: {e:?}"));
        }
    }

    /// Naga reads GLSL too.
    #[test]
    fn glsl_is_valid() {
        for layout in Layout::ALL {
            let body = source(&lut(layout), Language::Glsl, &[]);
            let call = match layout {
                Layout::ScaleBias => "vec4(dfg_multiscatter(0.5, dfg(0.3, r)), dfg_e_avg(r), 1.0)",
                Layout::Khronos => "vec4(dfg_multiscatter(0.5, dfg(0.3, r).xy), dfg(0.3, r).z, 1.0)",
                l if l.channels().len() == 1 => "vec4(dfg(0.3, r))",
                l if l.channels().len() == 2 => "vec4(dfg(0.3, r), 0.0, 1.0)",
                _ => "vec4(dfg(0.3, r), 1.0)",
            };
            let text = format!(
                "#version 450\n{body}\nlayout(location = 0) in float r;\nlayout(location = 0) out vec4 colour;\n\
                 void main() {{ colour = {call}; }}\n"
            );
            let options = naga::front::glsl::Options::from(naga::ShaderStage::Fragment);
            let module = naga::front::glsl::Frontend::default()
                .parse(&options, &text)
                .unwrap_or_else(|e| panic!("{layout:?}: {}", e.emit_to_string(&text)));
            let mut v = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::empty(),
            );
            v.validate(&module).unwrap_or_else(|e| panic!("{layout:?}: {e:?}"));
        }
    }

    /// HLSL in GLSL's names is GLSL, up to how arrays begin and what a scalar does beside a vector.
    #[test]
    fn hlsl_is_glsl_by_other_names() {
        for layout in Layout::ALL {
            let [hlsl, glsl] = [Language::Hlsl, Language::Glsl].map(|l| source(&lut(layout), l, &[]));
            let (n, kind) = (4, ["float", "vec2", "vec3"][channels(&lut(layout)) - 1]);
            let named = [
                ("static const", "const"),
                ("float2", "vec2"),
                ("float3", "vec3"),
                ("int2", "ivec2"),
                ("lerp(", "mix("),
                ("frac(", "fract("),
                (
                    "0.5, 0.0, float(DFG_SIZE - 1));\n    ivec2",
                    "0.5, vec2(0.0), vec2(float(DFG_SIZE - 1)));\n    ivec2",
                ),
                ("low + 1, DFG_SIZE - 1);", "low + ivec2(1), ivec2(DFG_SIZE - 1));"),
                ("\n};", "\n);"),
                (" };", ");"),
            ]
            .into_iter()
            .fold(hlsl, |text, (from, to)| text.replace(from, to))
            .replace("DFG[16] = {", &format!("DFG[{}] = {kind}[{}](", n * n, n * n))
            .replace("DFG_E_AVG[4] = { ", "DFG_E_AVG[4] = float[4](");
            assert_eq!(named, glsl, "{layout:?}");
        }
    }

    /// The Rust text compiles, and its function returns the values of the table's lookup.
    #[test]
    fn rust_compiles_and_gives_the_same_values() {
        let lut = lut(Layout::ScaleBias);
        let dir = std::env::temp_dir().join(format!("steradian-dfg-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let points = [(0.1f32, 0.9f32), (0.5, 0.5), (0.0, 0.0), (1.0, 1.0), (0.77, 0.23)];
        let calls: String = points
            .iter()
            .map(|(a, b)| {
                format!(
                    "let v = dfg({a:?}, {b:?}); println!(\"{{}} {{}} {{}}\", v[0], v[1], dfg_e_avg({b:?}));"
                )
            })
            .collect();
        let text = format!("{}\nfn main() {{ {calls} }}\n", source(&lut, Language::Rust, &[]));
        let (file, binary) = (dir.join("dfg.rs"), dir.join("dfg"));
        std::fs::write(&file, text).unwrap();
        let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
        let status = std::process::Command::new(rustc)
            .args(["--edition", "2021", "-D", "warnings", "-o"])
            .arg(&binary)
            .arg(&file)
            .status()
            .expect("the compiler that compiled this test");
        assert!(status.success());
        let out = std::process::Command::new(&binary).output().unwrap();
        let out = String::from_utf8(out.stdout).unwrap();
        for ((mu, r), line) in points.iter().zip(out.lines()) {
            let got: Vec<f64> = line.split(' ').map(|v| v.parse().unwrap()).collect();
            let want = lut.lookup(f64::from(*mu), f64::from(*r));
            assert!((0..3).all(|c| (got[c] - want[c]).abs() < 2e-6), "{line} {want:?}");
        }
        assert_eq!(out.lines().count(), points.len());
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
