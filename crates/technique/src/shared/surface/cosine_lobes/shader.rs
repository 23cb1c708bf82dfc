//! The integers as a table of a GPU, and the text that decodes them.

use super::CosineLobes;
use super::packed::{Code, Field};
use crate::gpu::{Format, Level, ROW, Shape, Table, Uniform, Value, wrap_word};
use std::fmt::Write;

/// What a technique takes into its module to look lobes up.
pub struct CosineText {
    /// `fn cosine_lobes(uv: vec2<f32>, footprint: f32) -> CosineLobes`, `fn cosine_count() -> u32`, and what
    /// they need.
    pub module: String,
    /// The integers.
    pub table: Table,
    /// Their ranges.
    pub uniforms: Vec<Uniform>,
}

/// Names of the uniforms, eight ranges each, by the table's name.
const RANGES: [(&str, [&str; 8]); 2] = [
    ("lobes", ["lobes_0", "lobes_1", "lobes_2", "lobes_3", "lobes_4", "lobes_5", "lobes_6", "lobes_7"]),
    (
        "local_lobes",
        [
            "local_lobes_0",
            "local_lobes_1",
            "local_lobes_2",
            "local_lobes_3",
            "local_lobes_4",
            "local_lobes_5",
            "local_lobes_6",
            "local_lobes_7",
        ],
    ),
];

/// The integer of a field over its largest value, from the words of a texel, whose bytes are over 255.
fn fraction(f: &Field) -> String {
    let byte = |k: usize| format!("w{}.{}", (f.at + k) / 4, ["x", "y", "z", "w"][(f.at + k) % 4]);
    match f.bytes {
        1 => byte(0),
        2 => format!("({} * 256.0 + {}) / 257.0", byte(0), byte(1)),
        _ => format!("({} * 65536.0 + {} * 256.0 + {}) / 65793.0", byte(0), byte(1), byte(2)),
    }
}

/// The expression of three fields, or of one for all channels.
fn decoded(fields: &[(usize, &Field)], names: &[&str]) -> String {
    let vector = |of: &dyn Fn(usize, &Field) -> String| {
        let all: Vec<String> = fields.iter().map(|(i, f)| of(*i, f)).collect();
        format!("vec3<f32>({})", all.join(", "))
    };
    let range =
        |i: usize, which: [&str; 2]| format!("technique.{}[{}].{}", names[i / 8], i % 8 / 2, which[i % 2]);
    let function = match fields.first().map(|f| f.1.code) {
        Some(Code::Square) => "cosine_square",
        Some(Code::Exponential) => "cosine_exponential",
        _ => "cosine_linear",
    };
    let t = vector(&|_, f| fraction(f));
    let low = vector(&|i, _| range(i, ["x", "z"]));
    let span = vector(&|i, _| range(i, ["y", "w"]));
    format!("{function}({t}, {low}, {span})")
}

impl CosineLobes {
    /// The text of `cosine_lobes` with its table `name`, which is `lobes` or `local_lobes`.
    pub fn text(&self, name: &'static str) -> CosineText {
        let names = RANGES.iter().find(|r| r.0 == name).map_or(RANGES[0].1, |r| r.1);
        let mut module = String::from(include_str!("lookup.wgsl"));
        let count = self.count;
        // Writes to a `String` cannot fail.
        let _ = write!(
            module,
            "
fn cosine_count() -> u32 {{
    return {count}u;
}}

fn cosine_taps(uv: vec2<f32>, footprint: f32) -> array<TextureTap, 8> {{
    return taps_{name}(uv, footprint);
}}

fn cosine_texel(i: u32) -> CosineLobes {{
    var out: CosineLobes;
"
        );
        for w in 0..self.stride / 4 {
            let _ = writeln!(module, "    let w{w} = fetch_{name}(i, {w}u);");
        }
        let all: Vec<(usize, &Field)> = self.fields.iter().enumerate().collect();
        let mut rest = all.as_slice();
        let mut take = |n: usize| {
            let (some, others) = rest.split_at(n.min(rest.len()));
            rest = others;
            some
        };
        let _ = writeln!(module, "    out.rho_d = {};", decoded(take(3), &names));
        for (k, own) in self.own.iter().enumerate().take(count) {
            let rho = decoded(take(3), &names);
            let shape = take(if *own { 12 } else { 4 });
            let part = |j: usize| {
                let of: Vec<_> = shape.iter().skip(j).step_by(4).copied().collect();
                decoded(&of, &names)
            };
            let [x, y, z, n] = [0, 1, 2, 3].map(part);
            let _ = writeln!(module, "    out.lobes[{k}] = CosineLobe({rho}, {x}, {y}, {z}, {n});");
        }
        module += "    return out;\n}\n";
        CosineText { module, table: self.table(name), uniforms: self.uniforms(&names) }
    }

    fn uniforms(&self, names: &[&'static str; 8]) -> Vec<Uniform> {
        let ranges: Vec<f32> = self.fields.iter().flat_map(|f| [f.low, f.span]).collect();
        let matrix = |(name, eight): (&&'static str, &[f32])| {
            let at = |c: usize, k: usize| eight.get(4 * c + k).copied().unwrap_or(0.0);
            let columns = std::array::from_fn(|c| std::array::from_fn(|k| at(c, k)));
            Uniform { name, value: Value::Mat4(columns) }
        };
        names.iter().zip(ranges.chunks(16)).map(matrix).collect()
    }

    fn table(&self, name: &'static str) -> Table {
        let (texels, layers) = (self.patch.texels(), self.stride / 4);
        let height = texels.div_ceil(ROW);
        let mut bytes = vec![0; 4 * ROW * height * layers];
        for (layer, plane) in bytes.chunks_exact_mut(4 * ROW * height).enumerate() {
            let words = self.codes.chunks_exact(self.stride).map(|t| &t[4 * layer..][..4]);
            plane.chunks_exact_mut(4).zip(words).for_each(|(to, word)| to.copy_from_slice(word));
        }
        let ((width, rows), [u, v]) = (self.patch.size(), self.patch.wrap().map(wrap_word));
        let patch = [width as u32, rows as u32, self.patch.levels() as u32, u | v << 2];
        Table {
            name,
            shape: Shape::Patch(patch),
            format: Format::Rgba8Unorm,
            level: Level { width: ROW, height, layers, bytes },
        }
    }
}
