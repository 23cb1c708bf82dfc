//! The table and its shading for a GPU: `kernel.rs` in WGSL, written out for the number of bands, since
//! arrays with constant indices stay in registers.

use super::kernel::LightLanes;
use super::{Places, ViewTable};
use crate::gpu::{Buffer, Numbers, Uniform, Value};
use std::borrow::Cow;
use std::fmt::Write;
use steradian_brdf::views::paraboloid::lattice;
use steradian_sphere::sh::Exchange;

const FRAME: &str = include_str!("frame.wgsl");

/// Uniforms that hold the light's coefficients, sixteen numbers each: 225 coefficients of three channels at
/// most.
const LIGHT_NAMES: [&str; 43] = [
    "light_0", "light_1", "light_2", "light_3", "light_4", "light_5", "light_6", "light_7", "light_8",
    "light_9", "light_10", "light_11", "light_12", "light_13", "light_14", "light_15", "light_16",
    "light_17", "light_18", "light_19", "light_20", "light_21", "light_22", "light_23", "light_24",
    "light_25", "light_26", "light_27", "light_28", "light_29", "light_30", "light_31", "light_32",
    "light_33", "light_34", "light_35", "light_36", "light_37", "light_38", "light_39", "light_40",
    "light_41", "light_42",
];

/// The light as uniforms.
pub fn light_uniforms(light: &LightLanes) -> Vec<Uniform> {
    let flat = light.coefficients().as_flattened();
    let block = |(name, v): (&&'static str, &[f32])| {
        let at = |k: usize| v.get(k).copied().unwrap_or_default();
        let columns = std::array::from_fn(|i| std::array::from_fn(|j| at(4 * i + j)));
        Uniform { name, value: Value::Mat4(columns) }
    };
    LIGHT_NAMES.iter().zip(flat.chunks(16)).map(block).collect()
}

/// Number `k` of the light's coefficients in WGSL.
fn light(k: usize) -> String {
    format!("technique.{}[{}].{}", LIGHT_NAMES[k / 16], k % 16 / 4, ["x", "y", "z", "w"][k % 4])
}

/// The table as a buffer, a texel a site.
pub fn views_buffer(table: &ViewTable, halves: bool) -> Buffer {
    let n = table.bands * table.bands;
    let all = table.data.chunks_exact(table.stride).flat_map(|c| &c[..n]).copied();
    let data = if halves {
        Numbers::F16(all.map(half::f16::from_f32).collect())
    } else {
        Numbers::F32(all.collect())
    };
    Buffer { name: "views", stride: table.channels * n, data }
}

/// `fn views_radiance(n, t, wo) -> vec3<f32>`, n·wo > 0.
pub fn modules(table: &ViewTable) -> Vec<Cow<'static, str>> {
    vec![FRAME.into(), turns(table.bands).into(), turned(table).into(), radiance(table).into()]
}

/// `fn views_radiance(n, t, wo, site) -> vec3<f32>`, n·wo > 0, for reflectance that varies over the surface,
/// with the table "places" ([`Places::table`]): the twin of [`super::shade_places`].
pub fn place_modules(table: &ViewTable, places: &Places) -> Vec<Cow<'static, str>> {
    vec![
        FRAME.into(),
        turns(table.bands).into(),
        tables_around(table, places).into(),
        turned_between(table, places).into(),
        radiance_with(table, ", site: Site", "    let tables = views_tables(site);\n", ", tables").into(),
    ]
}

/// The tables around a point: first texels and weights.
fn tables_around(table: &ViewTable, places: &Places) -> String {
    let ([nx, ny], texels) = (places.nodes(), table.size * table.size);
    let (right, down) = ((nx > 1) as usize * texels, (ny > 1) as usize * nx * texels);
    format!(
        "struct ViewsTables {{
    texel: vec4<u32>,
    weights: vec4<f32>,
}}

fn views_tables(site: Site) -> ViewsTables {{
    let p = fetch_places(site.uv, site.footprint, 0u).xy;
    let c = min(floor(max(p, vec2<f32>(0.0))), vec2<f32>({:?}, {:?}));
    let w = clamp(p - c, vec2<f32>(0.0), vec2<f32>(1.0));
    let m = vec2<f32>(1.0) - w;
    let first = (u32(c.y) * {nx}u + u32(c.x)) * {texels}u;
    return ViewsTables(
        vec4<u32>(first, first + {right}u, first + {down}u, first + {}u),
        vec4<f32>(m.x * m.y, w.x * m.y, m.x * w.y, w.x * w.y));
}}
",
        nx.saturating_sub(2) as f32,
        ny.saturating_sub(2) as f32,
        right + down
    )
}

/// `fn shade_site(n, t, wo, p, site)`: [`super::shade_sites`], by way of `transferred(site, c)`, the sum of
/// coefficients times those of the light that reaches a site.
pub fn site_modules(table: &ViewTable) -> Vec<Cow<'static, str>> {
    let n = table.bands * table.bands;
    let mut out = format!(
        "fn shade_site(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {{
    if !(dot(n, wo) > 0.0) {{
        return vec3<f32>(0.0);
    }}
    let frame = views_frame(n, t);
    let place = {};
    var f: array<f32, {n}>;
    views_turned(place, frame, 0u, &f);
    var l = transferred(site, f);
",
        place(table)
    );
    for (c, channel) in ["y", "z"].into_iter().enumerate().take(table.channels - 1) {
        let first = (c + 1) * n;
        let _ = writeln!(
            out,
            "    views_turned(place, frame, {first}u, &f);
    l.{channel} = transferred(site, f).{channel};"
        );
    }
    out += "    return l;\n}\n";
    vec![FRAME.into(), turns(table.bands).into(), turned(table).into(), out.into()]
}

/// WGSL of the position of a point's view in the table.
fn place(table: &ViewTable) -> String {
    format!("views_place(wo * frame, {})", place_numbers(table))
}

/// The arguments of `views_place` after the view.
fn place_numbers(table: &ViewTable) -> String {
    let [reach, h] = lattice(table.size);
    format!("{}u, {:?}, {:?}, {:?}", table.size, reach as f32, (1.0 / h) as f32, table.pole)
}

/// A write to a `String` cannot fail, hence the ignored results.
fn turns(bands: usize) -> String {
    let count = bands * bands;
    let mut out = format!(
        "// R_z of coefficients: (c, s) <- (c cos ma - s sin ma, c sin ma + s cos ma).
fn views_turn_z(f: ptr<function, array<f32, {count}>>, angle: vec2<f32>) {{
    var a = angle;
    var c = 0.0;
    var s = 0.0;
"
    );
    for m in 1..bands {
        for l in m..bands {
            let (p, n) = (l * l + l + m, l * l + l - m);
            let _ = writeln!(
                out,
                "    c = (*f)[{p}];
    s = (*f)[{n}];
    (*f)[{p}] = c * a.x - s * a.y;
    (*f)[{n}] = c * a.y + s * a.x;"
            );
        }
        let _ =
            writeln!(out, "    a = vec2<f32>(a.x * angle.x - a.y * angle.y, a.y * angle.x + a.x * angle.y);");
    }
    let _ = writeln!(
        out,
        "}}
// The exchange of y and z.
fn views_exchange(f: ptr<function, array<f32, {count}>>) {{
    let g = *f;"
    );
    for (to, row) in Exchange::new(bands).rows().iter().enumerate() {
        let terms: Vec<String> = row.iter().map(|(from, x)| format!("{x:?} * g[{from}]")).collect();
        let _ = writeln!(out, "    (*f)[{to}] = {};", terms.join(" + "));
    }
    out + "}\n"
}

fn turned(table: &ViewTable) -> String {
    let size = table.size;
    turned_with(
        table,
        "",
        &format!(
            "        let near = vec2<f32>(fetch_views(place.texel, i), fetch_views(place.texel + 1u, i));
        let far = vec2<f32>(fetch_views(place.texel + {size}u, i), fetch_views(place.texel + {size}u + 1u, i));
        (*f)[k] = dot(place.weights, vec4<f32>(near, far));
"
        ),
    )
}

fn turned_between(table: &ViewTable, places: &Places) -> String {
    let (size, count) = (table.size, places.around_each());
    turned_with(
        table,
        ", tables: ViewsTables",
        &format!(
            "        var sum = 0.0;
        for (var j = 0u; j < {count}u; j++) {{
            let t = place.texel + tables.texel[j];
            let near = vec2<f32>(fetch_views(t, i), fetch_views(t + 1u, i));
            let far = vec2<f32>(fetch_views(t + {size}u, i), fetch_views(t + {size}u + 1u, i));
            sum += tables.weights[j] * dot(place.weights, vec4<f32>(near, far));
        }}
        (*f)[k] = sum;
"
        ),
    )
}

/// `views_turned` with another parameter, and the lines that make number `i` of a texel coefficient `k`.
fn turned_with(table: &ViewTable, parameter: &str, lines: &str) -> String {
    let n = table.bands * table.bands;
    format!(
        "// Coefficients of one channel at a view, turned to the world.
fn views_turned(place: ViewsPlace, frame: mat3x3<f32>{parameter}, first: u32, f: ptr<function, array<f32, {n}>>) {{
    for (var k = 0u; k < {n}u; k++) {{
        let i = first + k;
{lines}    }}
    let angles = views_angles(frame);
    views_turn_z(f, angles[0].xy);
    views_exchange(f);
    views_turn_z(f, angles[0].zw);
    views_exchange(f);
    views_turn_z(f, angles[1].xy);
}}
"
    )
}

fn radiance(table: &ViewTable) -> String {
    radiance_with(table, "", "", "")
}

/// `views_radiance` with another parameter, lines that make an argument of it, and that argument of
/// `views_turned`.
fn radiance_with(table: &ViewTable, parameter: &str, lines: &str, argument: &str) -> String {
    let n = table.bands * table.bands;
    let mut out = format!(
        "fn views_radiance(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>{parameter}) -> vec3<f32> {{
    let frame = views_frame(n, t);
    let place = {};
{lines}    var f: array<f32, {n}>;
    var l = vec3<f32>(0.0);
",
        place(table)
    );
    for c in 0..table.channels {
        let _ = writeln!(out, "    views_turned(place, frame{argument}, {}u, &f);", c * n);
        for i in 0..n {
            let _ = if table.channels == 1 {
                let [r, g, b] = [0, 1, 2].map(|k| light(3 * i + k));
                writeln!(out, "    l += f[{i}] * vec3<f32>({r}, {g}, {b});")
            } else {
                writeln!(out, "    l.{} += f[{i}] * {};", ["x", "y", "z"][c], light(3 * i + c))
            };
        }
    }
    out + "    return l;\n}\n"
}

/// `fn views_at_site(site, n, wo) -> vec3<f32>`: [`super::shade_local`], with the buffers "frames"
/// ([`super::SiteFrames::numbers`]) and "light" ([`super::LocalLight::numbers`]).
pub fn local_modules(table: &ViewTable) -> Vec<Cow<'static, str>> {
    let n = table.bands * table.bands;
    let (size, place) = (table.size, place_numbers(table));
    let fetch = |c: usize| {
        let first = c * n;
        format!(
            "dot(place.weights, vec4<f32>(fetch_views(place.texel, i + {first}u), fetch_views(place.texel + 1u, i + {first}u), fetch_views(place.texel + {size}u, i + {first}u), fetch_views(place.texel + {size}u + 1u, i + {first}u)))"
        )
    };
    let value = if table.channels == 1 {
        format!("vec3<f32>({})", fetch(0))
    } else {
        format!("vec3<f32>({}, {}, {})", fetch(0), fetch(1), fetch(2))
    };
    let local = format!(
        "// Radiance by the light of one site, with the view in its frame.
fn views_local(s: u32, normal: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {{
    let n = vec3<f32>(fetch_frames(s, 0u), fetch_frames(s, 1u), fetch_frames(s, 2u));
    let along = vec3<f32>(fetch_frames(s, 3u), fetch_frames(s, 4u), fetch_frames(s, 5u));
    // The view turns with the normal.
    let both = normal + n;
    let carried = wo - dot(both, wo) / max(1.0 + dot(normal, n), 1e-6) * both + 2.0 * dot(normal, wo) * n;
    var v = carried * views_frame(n, along);
    v.z = max(v.z, 0.0);
    var l = vec3<f32>(0.0);
    let place = views_place(v, {place});
    for (var i = 0u; i < {n}u; i++) {{
        let light = vec3<f32>(fetch_light(s, i), fetch_light(s, {n}u + i), fetch_light(s, 2u * {n}u + i));
        l += {value} * light;
    }}
    return l;
}}
"
    );
    vec![FRAME.into(), local.into(), include_str!("local.wgsl").into()]
}

/// `fn views_fixed(site) -> vec3<f32>`: Σ_i L_i c_i of sites whose reflectance towards the viewer lies in the
/// buffer "reflectance" ([`super::WorldViews::numbers`]).
pub fn fixed_modules(table: &ViewTable) -> Vec<Cow<'static, str>> {
    let n = table.bands * table.bands;
    let mut out = String::from("fn views_fixed(site: Site) -> vec3<f32> {\n    var l = vec3<f32>(0.0);\n");
    for i in 0..n {
        let [r, g, b] = [0, 1, 2].map(|k| light(3 * i + k));
        let at = |c: usize| format!("fetch_reflectance_at(site, {}u)", c % table.channels * n + i);
        let value =
            if table.channels == 1 { at(0) } else { format!("vec3<f32>({}, {}, {})", at(0), at(1), at(2)) };
        let _ = writeln!(out, "    l += {value} * vec3<f32>({r}, {g}, {b});");
    }
    vec![FRAME.into(), (out + "    return l;\n}\n").into()]
}
