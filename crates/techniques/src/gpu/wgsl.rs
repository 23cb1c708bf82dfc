//! Generates what surrounds a room's WGSL.

use super::{GpuRoom, Shape, Table};
use std::fmt::Write;

/// What a binding holds; bindings are numbered 0, 1, … within their group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binding {
    /// `@group(0)`: the uniform buffer of [`GpuRoom::uniform_bytes`].
    Uniforms,
    /// `@group(0)`: table i of [`GpuRoom::tables`], a 2D-array texture (6 layers a cube, 1 a plane).
    Table(usize),
    /// `@group(0)`: buffer i of [`GpuRoom::buffers`], read-only storage of f32.
    Buffer(usize),
    /// `@group(1)`: points as planes of f32 n.x n.y n.z t.x … wo.x … p.x … p.z, then for rooms that
    /// vary the six planes of [`crate::Points::lobe`], for rooms that read sites the planes of three indices, two
    /// weights, u and v; read-only storage.
    Points,
    /// `@group(1)`: planes r g b of f32, storage.
    Radiance,
}

/// Bindings of group 0 and of group 1, in order.
pub fn bindings(room: &GpuRoom) -> [Vec<Binding>; 2] {
    let mut zero = Vec::new();
    if !room.uniforms.is_empty() {
        zero.push(Binding::Uniforms);
    }
    zero.extend((0..room.tables.len()).map(Binding::Table));
    zero.extend((0..room.buffers.len()).map(Binding::Buffer));
    [zero, vec![Binding::Points, Binding::Radiance]]
}

/// The complete module: [`library`] and a compute entry point `main` (workgroups of 64) that shades a planar
/// buffer of points.
pub fn module(room: &GpuRoom) -> String {
    let call = match (room.sited(), room.varies()) {
        (true, _) => SHADE_SITE,
        (_, true) => SHADE_LOBE,
        _ => SHADE,
    };
    library(room) + &MAIN.replace("SHADE", call)
}

/// Bindings of group 0, `fetch_NAME` functions and the room's text, without an entry point: what any shader
/// that calls the room's `shade(n, t, wo, p)` (or `shade_lobe`, or `shade_site`) starts with.
pub fn library(room: &GpuRoom) -> String {
    let mut out = String::new();
    let [zero, _] = bindings(room);
    for (i, b) in zero.iter().enumerate() {
        bind(&mut out, room, i, *b);
    }
    if room.tables.iter().any(|t| t.shape.is_cube()) {
        out.push_str(EDGE_CUBE);
    }
    for t in &room.tables {
        out.push_str(&fetch(t));
    }
    if room.sited() {
        out.push_str(SITE);
    }
    for b in &room.buffers {
        let text = FETCH_BUFFER.to_owned() + if room.sited() { FETCH_SITE } else { "" };
        out.push_str(&text.replace("NAME", b.name).replace("STRIDE", &b.stride.to_string()));
    }
    out.push_str(&room.wgsl);
    out
}

/// Writes to a `String` cannot fail, hence the ignored results.
fn bind(out: &mut String, room: &GpuRoom, i: usize, b: Binding) {
    match b {
        Binding::Uniforms => {
            out.push_str("struct Room {\n");
            for u in &room.uniforms {
                let _ = writeln!(out, "    {}: {},", u.name, u.value.wgsl());
            }
            let _ = writeln!(out, "}}\n@group(0) @binding({i}) var<uniform> room: Room;");
        }
        Binding::Table(k) => {
            let name = room.tables[k].name;
            let _ = writeln!(out, "@group(0) @binding({i}) var table_{name}: texture_2d_array<f32>;");
        }
        Binding::Buffer(k) => {
            let name = room.buffers[k].name;
            let _ = writeln!(out, "@group(0) @binding({i}) var<storage, read> buffer_{name}: array<f32>;");
        }
        Binding::Points | Binding::Radiance => {}
    }
}

/// The linear third coordinate over `fetch_NAME_layer`.
fn stacked(at: &str, value: &str, per: &str) -> String {
    FETCH_STACK.replace("AT", at).replace("VALUE", value).replace("PER", per)
}

fn fetch(t: &Table) -> String {
    let text = match &t.shape {
        Shape::EdgeCube => FETCH_BILINEAR.to_owned() + FETCH_CUBE,
        Shape::EdgeCubeChain(places) => {
            let text = stack(places).unwrap_or_else(|| {
                let place = |p: &[u32; 3]| format!("vec3<u32>({}u, {}u, {}u)", p[0], p[1], p[2]);
                let places: Vec<_> = places.iter().map(place).collect();
                FETCH_CHAIN.replace("PLACES", &places.join(", "))
            });
            FETCH_BILINEAR.to_owned() + &text.replace("COUNT", &places.len().to_string())
        }
        Shape::CubeStack => FETCH_CUBE_LAYER.to_owned() + &stacked("vec3<f32>", "vec3<f32>", " / 6u"),
        Shape::Plane => FETCH_PLANE.to_owned(),
        Shape::PlaneStack => FETCH_PLANE_LAYER.to_owned() + &stacked("vec2<f32>", "vec4<f32>", ""),
        Shape::GlobeStack => FETCH_GLOBE.to_owned(),
        Shape::Line => FETCH_LINE.to_owned(),
    };
    text.replace("NAME", t.name)
}

/// The text of a chain whose cubes have one size and stand in rows: places are computed, not listed.
fn stack(places: &[[u32; 3]]) -> Option<String> {
    let [x, y, size] = *places.first()?;
    let step = size + 1;
    let row = places.iter().take_while(|p| p[1] == y).count() as u32;
    let regular = |(k, p): (usize, &[u32; 3])| {
        let k = k as u32;
        *p == [k % row * step, k / row * step, size]
    };
    if places.len() < STACK || [x, y] != [0, 0] || !places.iter().enumerate().all(regular) {
        return None;
    }
    let text = FETCH_ROWS.replace("ROW", &row.to_string()).replace("STEP", &step.to_string());
    Some(text.replace("SIZE", &size.to_string()))
}

/// Face and position on it, Khronos orientation; the CPU's `tables::edge_cube::face_position`.
const EDGE_CUBE: &str = "
struct FacePosition {
    face: u32,
    s: f32,
    t: f32,
}

fn face_position(d: vec3<f32>) -> FacePosition {
    let a = abs(d);
    var face: u32;
    var s: f32;
    var t: f32;
    var m: f32;
    if a.x >= a.y && a.x >= a.z {
        m = a.x;
        face = select(0u, 1u, d.x < 0.0);
        s = select(-d.z, d.z, d.x < 0.0);
        t = -d.y;
    } else if a.y >= a.z {
        m = a.y;
        face = select(2u, 3u, d.y < 0.0);
        s = d.x;
        t = select(d.z, -d.z, d.y < 0.0);
    } else {
        m = a.z;
        face = select(4u, 5u, d.z < 0.0);
        s = select(d.x, -d.x, d.z < 0.0);
        t = -d.y;
    }
    return FacePosition(face, 0.5 * (s / m) + 0.5, 0.5 * (t / m) + 0.5);
}
";

/// The cube of `place.z` intervals at `place.xy` of the atlas.
const FETCH_BILINEAR: &str = "
fn fetch_place_NAME(d: vec3<f32>, place: vec3<u32>) -> vec3<f32> {
    let at = face_position(d);
    let last = f32(place.z);
    let x = clamp(at.s, 0.0, 1.0) * last;
    let y = clamp(at.t, 0.0, 1.0) * last;
    let i = min(floor(x), last - 1.0);
    let j = min(floor(y), last - 1.0);
    let c = place.xy + vec2<u32>(u32(i), u32(j));
    let t00 = textureLoad(table_NAME, c, at.face, 0u).rgb;
    let t10 = textureLoad(table_NAME, c + vec2<u32>(1u, 0u), at.face, 0u).rgb;
    let t01 = textureLoad(table_NAME, c + vec2<u32>(0u, 1u), at.face, 0u).rgb;
    let t11 = textureLoad(table_NAME, c + vec2<u32>(1u, 1u), at.face, 0u).rgb;
    return mix(mix(t00, t10, x - i), mix(t01, t11, x - i), y - j);
}
";

const FETCH_CUBE: &str = "
fn fetch_NAME(d: vec3<f32>) -> vec3<f32> {
    return fetch_place_NAME(d, vec3<u32>(0u, 0u, textureDimensions(table_NAME).x - 1u));
}
";

const FETCH_CHAIN: &str = "
fn fetch_NAME(d: vec3<f32>, level: f32) -> vec3<f32> {
    var places = array<vec3<u32>, COUNT>(PLACES);
    let last = COUNTu - 1u;
    let l = clamp(level, 0.0, f32(last));
    let a = min(u32(l), last);
    let b = min(a + 1u, last);
    return mix(fetch_place_NAME(d, places[a]), fetch_place_NAME(d, places[b]), l - f32(a));
}
";

/// From this many cubes on, computed places are shorter than a list.
const STACK: usize = 4;
const FETCH_ROWS: &str = "
fn fetch_slice_NAME(d: vec3<f32>, k: u32) -> vec3<f32> {
    return fetch_place_NAME(d, vec3<u32>(k % ROWu * STEPu, k / ROWu * STEPu, SIZEu));
}

fn fetch_NAME(d: vec3<f32>, level: f32) -> vec3<f32> {
    let last = COUNTu - 1u;
    let l = clamp(level, 0.0, f32(last));
    let a = min(u32(l), last);
    return mix(fetch_slice_NAME(d, a), fetch_slice_NAME(d, min(a + 1u, last)), l - f32(a));
}
";

const FETCH_PLANE: &str = "
fn fetch_NAME(uv: vec2<f32>) -> vec4<f32> {
    let last = vec2<f32>(textureDimensions(table_NAME, 0u) - vec2<u32>(1u, 1u));
    let p = clamp(uv, vec2<f32>(0.0), vec2<f32>(1.0)) * last;
    let q = min(floor(p), last - vec2<f32>(1.0));
    let c = vec2<u32>(q);
    let t00 = textureLoad(table_NAME, c, 0u, 0u);
    let t10 = textureLoad(table_NAME, c + vec2<u32>(1u, 0u), 0u, 0u);
    let t01 = textureLoad(table_NAME, c + vec2<u32>(0u, 1u), 0u, 0u);
    let t11 = textureLoad(table_NAME, c + vec2<u32>(1u, 1u), 0u, 0u);
    let w = p - q;
    return mix(mix(t00, t10, w.x), mix(t01, t11, w.x), w.y);
}
";

const FETCH_CUBE_LAYER: &str = "
fn fetch_NAME_layer(d: vec3<f32>, k: u32) -> vec3<f32> {
    let at = face_position(d);
    let layer = 6u * k + at.face;
    let last = f32(textureDimensions(table_NAME).x - 1u);
    let x = clamp(at.s, 0.0, 1.0) * last;
    let y = clamp(at.t, 0.0, 1.0) * last;
    let i = min(floor(x), last - 1.0);
    let j = min(floor(y), last - 1.0);
    let c = vec2<u32>(u32(i), u32(j));
    let t00 = textureLoad(table_NAME, c, layer, 0u).rgb;
    let t10 = textureLoad(table_NAME, c + vec2<u32>(1u, 0u), layer, 0u).rgb;
    let t01 = textureLoad(table_NAME, c + vec2<u32>(0u, 1u), layer, 0u).rgb;
    let t11 = textureLoad(table_NAME, c + vec2<u32>(1u, 1u), layer, 0u).rgb;
    return mix(mix(t00, t10, x - i), mix(t01, t11, x - i), y - j);
}
";

const FETCH_PLANE_LAYER: &str = "
fn fetch_NAME_layer(uv: vec2<f32>, k: u32) -> vec4<f32> {
    let last = vec2<f32>(textureDimensions(table_NAME, 0u) - vec2<u32>(1u, 1u));
    let p = clamp(uv, vec2<f32>(0.0), vec2<f32>(1.0)) * last;
    let q = min(floor(p), last - vec2<f32>(1.0));
    let c = vec2<u32>(q);
    let t00 = textureLoad(table_NAME, c, k, 0u);
    let t10 = textureLoad(table_NAME, c + vec2<u32>(1u, 0u), k, 0u);
    let t01 = textureLoad(table_NAME, c + vec2<u32>(0u, 1u), k, 0u);
    let t11 = textureLoad(table_NAME, c + vec2<u32>(1u, 1u), k, 0u);
    let w = p - q;
    return mix(mix(t00, t10, w.x), mix(t01, t11, w.x), w.y);
}
";

const FETCH_STACK: &str = "
fn fetch_NAME(at: AT, w: f32) -> VALUE {
    let last = textureNumLayers(table_NAME)PER - 1u;
    let l = clamp(w, 0.0, f32(last));
    let a = min(u32(l), last);
    return mix(fetch_NAME_layer(at, a), fetch_NAME_layer(at, min(a + 1u, last)), l - f32(a));
}
";

const FETCH_GLOBE: &str = "
fn fetch_NAME(uv: vec2<f32>, k: u32) -> vec4<f32> {
    let size = textureDimensions(table_NAME);
    let x = fract(uv.x - 0.5 / f32(size.x)) * f32(size.x);
    let y = clamp(uv.y, 0.0, 1.0) * f32(size.y - 1u);
    let i = min(u32(x), size.x - 1u);
    let j = min(u32(y), size.y - 2u);
    let e = (i + 1u) % size.x;
    let t00 = textureLoad(table_NAME, vec2<u32>(i, j), k, 0u);
    let t10 = textureLoad(table_NAME, vec2<u32>(e, j), k, 0u);
    let t01 = textureLoad(table_NAME, vec2<u32>(i, j + 1u), k, 0u);
    let t11 = textureLoad(table_NAME, vec2<u32>(e, j + 1u), k, 0u);
    let u = x - f32(i);
    return mix(mix(t00, t10, u), mix(t01, t11, u), y - f32(j));
}
";

const FETCH_LINE: &str = "
fn fetch_NAME(u: f32) -> vec4<f32> {
    let last = f32(textureDimensions(table_NAME).x - 1u);
    let x = clamp(u, 0.0, 1.0) * last;
    let i = min(floor(x), last - 1.0);
    let a = textureLoad(table_NAME, vec2<u32>(u32(i), 0u), 0u, 0u);
    let b = textureLoad(table_NAME, vec2<u32>(u32(i) + 1u, 0u), 0u, 0u);
    return mix(a, b, x - i);
}
";

const FETCH_BUFFER: &str = "
fn fetch_NAME(site: u32, k: u32) -> f32 {
    return buffer_NAME[site * STRIDEu + k];
}
";

/// Where a point lies among the sites of a bake.
const SITE: &str = "
struct Site {
    index: vec3<u32>,
    weight: vec3<f32>,
    uv: vec2<f32>,
}
";

const FETCH_SITE: &str = "
fn fetch_NAME_at(site: Site, k: u32) -> f32 {
    let f = vec3<f32>(fetch_NAME(site.index.x, k), fetch_NAME(site.index.y, k), fetch_NAME(site.index.z, k));
    return dot(site.weight, f);
}
";

/// What `main` calls.
const SHADE: &str = "shade(n, t, wo, p)";
/// The same for a room that varies.
const SHADE_LOBE: &str = "shade_lobe(n, t, wo, p, Lobe(points[12u * count + i], points[13u * count + i], \
                          points[14u * count + i], point_plane(15u, i, count)))";
/// The same for a room that reads sites: the indices are bits of integers.
const SHADE_SITE: &str = "shade_site(n, t, wo, p, Site(bitcast<vec3<u32>>(point_plane(12u, i, count)), \
                          vec3<f32>(1.0 - points[15u * count + i] - points[16u * count + i], \
                          points[15u * count + i], points[16u * count + i]), \
                          vec2<f32>(points[17u * count + i], points[18u * count + i])))";
const MAIN: &str = "
@group(1) @binding(0) var<storage, read> points: array<f32>;
@group(1) @binding(1) var<storage, read_write> radiance: array<f32>;

fn point_plane(k: u32, i: u32, count: u32) -> vec3<f32> {
    return vec3<f32>(points[k * count + i], points[(k + 1u) * count + i], points[(k + 2u) * count + i]);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = arrayLength(&radiance) / 3u;
    let i = id.x;
    if i >= count {
        return;
    }
    let n = point_plane(0u, i, count);
    let t = point_plane(3u, i, count);
    let wo = point_plane(6u, i, count);
    let p = point_plane(9u, i, count);
    let l = SHADE;
    radiance[i] = l.x;
    radiance[count + i] = l.y;
    radiance[2u * count + i] = l.z;
}
";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Format, Level};

    /// Every shape in one module.
    #[test]
    fn fetches_of_every_shape_are_valid() {
        let shapes = [
            ("cube", Shape::EdgeCube, "fetch_cube(n)"),
            ("chain", Shape::EdgeCubeChain(vec![[0, 0, 1]]), "fetch_chain(n, 0.5)"),
            ("cubes", Shape::CubeStack, "fetch_cubes(n, 0.5) + fetch_cubes_layer(n, 1u)"),
            ("plane", Shape::Plane, "fetch_plane(n.xy).rgb"),
            ("planes", Shape::PlaneStack, "fetch_planes(n.xy, 0.5).rgb + fetch_planes_layer(n.xy, 1u).rgb"),
            ("globes", Shape::GlobeStack, "fetch_globes(n.xy, 1u).rgb"),
            ("line", Shape::Line, "fetch_line(n.x).rgb"),
        ];
        let sum: Vec<_> = shapes.iter().map(|s| s.2).collect();
        let sum = sum.join(" + ");
        let signature = "fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32>";
        let wgsl = format!("{signature} {{ return {sum}; }}").into();
        let level = || Level { width: 2, height: 2, layers: 12, bytes: vec![0; 16 * 48] };
        let table = |(name, shape, _)| Table { name, shape, format: Format::Rgba32Float, level: level() };
        let tables = shapes.into_iter().map(table).collect();
        let room = GpuRoom { slug: "all", wgsl, tables, uniforms: Vec::new(), buffers: Vec::new() };
        let text = module(&room);
        let parsed = naga::front::wgsl::parse_str(&text).map_err(|e| e.emit_to_string(&text));
        let flags = naga::valid::ValidationFlags::all();
        let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
        assert!(validator.validate(&parsed.unwrap()).is_ok());
    }
}
