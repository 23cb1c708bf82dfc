//! The functions by which a technique's WGSL reads tables and buffers.

use super::{Buffer, GpuTechnique, Numbers, Shape, Storage, Table};

const CUBE: &str = include_str!("cube.wgsl");
const PLANE: &str = include_str!("plane.wgsl");
const GLOBE: &str = include_str!("globe.wgsl");
const LINE: &str = include_str!("line.wgsl");
const BETWEEN: &str = include_str!("between.wgsl");
const TEXTURE: &str = include_str!("texture.wgsl");

/// The helper functions for the shapes of the technique's tables, then `fetch_NAME` of each table and buffer.
pub fn functions(technique: &GpuTechnique, storage: Storage) -> String {
    let any = |f: fn(&Shape) -> bool| technique.tables.iter().any(|t| f(&t.shape));
    let shared = [
        (any(Shape::is_cube), CUBE),
        (any(|s| matches!(s, Shape::Plane | Shape::PlaneStack)), PLANE),
        (any(|s| *s == Shape::GlobeStack), GLOBE),
        (any(|s| *s == Shape::Line), LINE),
        (any(|s| matches!(s, Shape::Texture { .. } | Shape::Patch(_))), TEXTURE),
        (any(|s| matches!(s, Shape::EdgeCubeChain(_) | Shape::CubeStack | Shape::PlaneStack)), BETWEEN),
    ];
    let mut out: String = shared.iter().filter(|s| s.0).map(|s| s.1).collect();
    technique.tables.iter().for_each(|t| out += &table(t));
    technique.buffers.iter().for_each(|b| out += &buffer(b, technique.entry.site, storage));
    out
}

/// A function of one expression.
fn function(name: &str, arguments: &str, of: &str, value: &str) -> String {
    format!("fn fetch_{name}({arguments}) -> {of} {{\n    return {value};\n}}\n")
}

fn table(t: &Table) -> String {
    let name = t.name;
    let one = |arguments: &str, of: &str, value: String| function(name, arguments, of, &value);
    match &t.shape {
        Shape::EdgeCube => one("d: vec3<f32>", "vec3<f32>", format!("cube_layers(table_{name}, d, 0u)")),
        Shape::EdgeCubeChain(places) => chain(name, places),
        Shape::CubeStack => {
            let layer = format!("cube_layers(table_{name}, at, 6u * k)");
            stack(name, ["vec3<f32>", "vec3<f32>", "/ 6u"], &layer)
        }
        Shape::Plane => one("uv: vec2<f32>", "vec4<f32>", format!("plane_texels(table_{name}, uv, 0u)")),
        Shape::PlaneStack => {
            let layer = format!("plane_texels(table_{name}, at, k)");
            stack(name, ["vec2<f32>", "vec4<f32>", "/ 1u"], &layer)
        }
        Shape::GlobeStack => {
            one("uv: vec2<f32>, k: u32", "vec4<f32>", format!("globe_texels(table_{name}, uv, k)"))
        }
        Shape::Line => one("u: f32", "vec4<f32>", format!("line_texels(table_{name}, u)")),
        Shape::Texture { levels, rows, wrap } => {
            let shape = format!("vec3<u32>({levels}u, {rows}u, {wrap}u)");
            let value = format!("texture_texels(table_{name}, uv, footprint, k, {shape})");
            one("uv: vec2<f32>, footprint: f32, k: u32", "vec4<f32>", value)
        }
        Shape::Patch([columns, rows, levels, wrap]) => {
            let place = format!("vec2<u32>(i % {ROW}u, i / {ROW}u)");
            let shape = format!("vec4<u32>({columns}u, {rows}u, {levels}u, {wrap}u)");
            one("i: u32, k: u32", "vec4<f32>", format!("textureLoad(table_{name}, {place}, k, 0)"))
                + &format!(
                    "fn taps_{name}(uv: vec2<f32>, footprint: f32) -> array<TextureTap, 8> {{
    return texture_taps(uv, footprint, {shape});
}}
"
                )
        }
        Shape::Texels => {
            let place = format!("vec2<u32>(i % {ROW}u, i / {ROW}u)");
            one("i: u32", "vec4<f32>", format!("textureLoad(table_{name}, {place}, 0u, 0)"))
        }
    }
}

/// The function of single layers, and the one that interpolates linearly between them; `at` is the
/// coordinate's declaration, `value` the type returned, `per` the number of layers per entry.
fn stack(name: &str, [at, value, per]: [&str; 3], layer: &str) -> String {
    function(&format!("{name}_layer"), &format!("at: {at}, k: u32"), value, layer)
        + &format!(
            "fn fetch_{name}(at: {at}, w: f32) -> {value} {{
    let l = between(w, textureNumLayers(table_{name}) {per});
    return mix(fetch_{name}_layer(at, l.a), fetch_{name}_layer(at, l.b), l.weight);
}}
"
        )
}

/// Texels a row of the textures that hold buffers.
pub const ROW: usize = 2048;

/// From this number of cubes on, the generated text computes their places instead of listing them, which is
/// shorter.
const ROWS_FROM: usize = 4;

/// A chain of cubes in one atlas, trilinear.
fn chain(name: &str, places: &[[u32; 3]]) -> String {
    let count = places.len();
    let level = match rows(places) {
        Some([row, step, size]) => {
            format!("    let place = vec3<u32>(k % {row}u * {step}u, k / {row}u * {step}u, {size}u);\n")
        }
        None => {
            let place = |p: &[u32; 3]| format!("vec3<u32>({}u, {}u, {}u)", p[0], p[1], p[2]);
            let all: Vec<_> = places.iter().map(place).collect();
            format!(
                "    var places = array<vec3<u32>, {count}>({});\n    let place = places[k];\n",
                all.join(", ")
            )
        }
    };
    format!(
        "fn fetch_{name}_level(d: vec3<f32>, k: u32) -> vec3<f32> {{
{level}    return cube_texels(table_{name}, d, place, 0u);
}}
fn fetch_{name}(d: vec3<f32>, level: f32) -> vec3<f32> {{
    let l = between(level, {count}u);
    return mix(fetch_{name}_level(d, l.a), fetch_{name}_level(d, l.b), l.weight);
}}
"
    )
}

/// Cubes a row, texels from one to the next, and intervals, where all have one size and stand in rows.
fn rows(places: &[[u32; 3]]) -> Option<[u32; 3]> {
    let [x, y, size] = *places.first()?;
    let step = size + 1;
    let row = places.iter().take_while(|p| p[1] == y).count() as u32;
    let regular = |(k, p): (usize, &[u32; 3])| {
        let k = k as u32;
        *p == [k % row * step, k / row * step, size]
    };
    let all = places.len() >= ROWS_FROM && [x, y] == [0, 0] && places.iter().enumerate().all(regular);
    all.then_some([row, step, size])
}

fn buffer(b: &Buffer, sited: bool, storage: Storage) -> String {
    let (name, stride) = (b.name, b.stride);
    let value = match (&b.data, storage) {
        (Numbers::F32(_), Storage::Buffers) => format!("buffer_{name}[i]"),
        (Numbers::F16(_), Storage::Buffers) => format!("unpack2x16float(buffer_{name}[i / 2u])[i % 2u]"),
        (Numbers::Unorm8 { low, high, .. }, Storage::Buffers) => {
            format!("mix({low:?}, {high:?}, unpack4x8unorm(buffer_{name}[i / 4u])[i % 4u])")
        }
        (Numbers::F32(_), Storage::Textures) => format!("bitcast<f32>(word_{name}(i))"),
        (Numbers::F16(_), Storage::Textures) => format!("unpack2x16float(word_{name}(i / 2u))[i % 2u]"),
        // GLSL ES 3.00 has no unpackUnorm4x8.
        (Numbers::Unorm8 { low, high, .. }, Storage::Textures) => {
            let byte = format!("(word_{name}(i / 4u) >> (8u * (i % 4u))) & 255u");
            format!("mix({low:?}, {high:?}, f32({byte}) / 255.0)")
        }
    };
    let mut out = match storage {
        Storage::Buffers => String::new(),
        Storage::Textures => format!(
            "fn word_{name}(i: u32) -> u32 {{
    return textureLoad(buffer_{name}, vec2<u32>(i % {ROW}u, i / {ROW}u), 0).x;
}}
"
        ),
    };
    let count = match (&b.data, storage) {
        (Numbers::F32(_), Storage::Buffers) => format!("arrayLength(&buffer_{name}) / {stride}u"),
        (data, _) => format!("{}u", data.len() / stride.max(1)),
    };
    out += &format!("fn count_{name}() -> u32 {{\n    return {count};\n}}\n");
    out += &format!(
        "fn fetch_{name}(site: u32, k: u32) -> f32 {{
    let i = site * {stride}u + k;
    return {value};
}}
"
    );
    if sited {
        out += &format!(
            "fn fetch_{name}_at(site: Site, k: u32) -> f32 {{
    let i = site.index;
    return dot(site.weight, vec3<f32>(fetch_{name}(i.x, k), fetch_{name}(i.y, k), fetch_{name}(i.z, k)));
}}
"
        );
    }
    out
}
