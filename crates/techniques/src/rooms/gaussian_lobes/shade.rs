//! Per lobe two lookups in tables of views and one in the chain, times the visibility there; the `.wgsl`
//! files have the same functions.

use super::GaussianLobes;
use super::frame::Frame;
use super::light::Light;
use super::lookups::{SCALE, TAPS, elevation, mean, number, row};
use super::views::Views;
use super::visibility::{self, Blocked, DIFFUSE, MOST};

use crate::gpu::{Buffer, Entry, Format, Level, Shape, Table, Uniform, Value, texels};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Block, BlockShader, Lanes, WIDTH};
use crate::shared::points::central;
use crate::shared::tables::chain::Chain;
use crate::shared::tables::{cube_table, texel_bytes};
use crate::shared::{light::sh_light, maths::harmonics};
use crate::{Bake, GpuTechnique, Points, Radiance, Technique};
use steradian_prefilter::EdgeCube;
use steradian_prefilter::lookup::Places;

pub(super) fn shade(b: &Bake<GaussianLobes>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    match b.transfer.bands() {
        0 => run::<0>(b, f, q, out),
        1 => run::<1>(b, f, q, out),
        2 => run::<2>(b, f, q, out),
        3 => run::<3>(b, f, q, out),
        _ => run::<4>(b, f, q, out),
    }
}

fn run<const BANDS: usize>(b: &Bake<GaussianLobes>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let shader = Shader::<BANDS> { light: &b.light, v: &b.linked, blocked: &b.transfer, f, q };
    batch::shade_blocks(q, out, &shader);
}

/// One lobe of each point of a block.
struct Row<'a> {
    angle: Lanes,
    /// The levels about its own, their sizes, and the weight of the second.
    near: [&'a EdgeCube; WIDTH],
    far: [&'a EdgeCube; WIDTH],
    sizes: [Lanes; 2],
    part: Lanes,
    sweep: Lanes,
    /// Places and weights of its lookups, and the largest number of them.
    taps: [&'static [[f32; 2]]; WIDTH],
    most: usize,
    zonal: [Lanes; 4],
    weight: [[f32; 4]; WIDTH],
}

impl<'a> Row<'a> {
    #[inline(always)]
    fn new<const BANDS: usize>(chain: &'a Chain, v: &Views, lobe: usize, x: &Lanes) -> Self {
        let (count, taps_of) = (v.count(), &**TAPS);
        let (first, sharpest) = (lobe * count, &chain.levels()[0]);
        let mut out = Self {
            angle: [0.0; WIDTH],
            near: [sharpest; WIDTH],
            far: [sharpest; WIDTH],
            sizes: [[0.0; WIDTH]; 2],
            part: [0.0; WIDTH],
            sweep: [0.0; WIDTH],
            taps: [&[]; WIDTH],
            most: 0,
            zonal: [[1.0; WIDTH]; 4],
            weight: [[0.0; 4]; WIDTH],
        };
        for (k, x) in x.iter().enumerate() {
            let [angle, level, sweep, taps] = row(&v.means, first, count, *x);
            (out.angle[k], out.sweep[k]) = (angle, sweep);
            (out.near[k], out.far[k], out.part[k]) = chain.around(level);
            (out.sizes[0][k], out.sizes[1][k]) = (out.near[k].size() as f32, out.far[k].size() as f32);
            out.weight[k] = row(&v.weights, first, count, *x);
            let lookups = taps_of.get(number(taps)).map_or(&[][..], |t| t);
            out.taps[k] = if out.weight[k] == [0.0; 4] { &[] } else { lookups };
            out.most = out.most.max(out.taps[k].len());
            if BANDS > 1 && !v.zonal.is_empty() {
                let zonal = row(&v.zonal, first, count, *x);
                (0..4).for_each(|l| out.zonal[l][k] = zonal[l]);
            }
        }
        out
    }
}

/// Shader with `BANDS` bands of visibility.
struct Shader<'a, const BANDS: usize> {
    light: &'a Light,
    v: &'a Views,
    blocked: &'a Blocked,
    f: &'a Frame,
    q: &'a Points<'a>,
}

#[inline(always)]
fn lane(v: &[Lanes; 3], k: usize) -> [f32; 3] {
    [v[0][k], v[1][k], v[2][k]]
}

/// Directions turned as the light is.
#[inline(always)]
fn turned(turn: &LightRotation, d: &[Lanes; 3]) -> [Lanes; 3] {
    let mut out = [[0.0; WIDTH]; 3];
    for k in 0..WIDTH {
        [out[0][k], out[1][k], out[2][k]] = turn.apply(lane(d, k));
    }
    out
}

impl<const BANDS: usize> BlockShader for Shader<'_, BANDS> {
    #[inline(always)]
    fn shade(&self, p: &Block) -> [[f32; 4]; WIDTH] {
        let Self { light, v, blocked, f, q } = *self;
        let turn = &f.turn;
        let (mut sine, mut x) = ([0.0; WIDTH], [0.0; WIDTH]);
        for k in 0..WIDTH {
            [sine[k], x[k]] = elevation(p.cos_o[k]);
        }
        let mut sum = [[0.0; 4]; WIDTH];
        let even = Places::new(&turned(turn, &p.n)).cells(&[light.irradiance.size() as f32; WIDTH]);
        for (k, sum) in sum.iter_mut().enumerate() {
            let e = even.sample(&light.irradiance, k);
            for c in 0..3 {
                sum[c] = v.diffuse[c] * e[c];
            }
            if BANDS > 0 {
                let less = f.blocked(q, p.index[k]);
                for c in 0..3 {
                    sum[c] = (sum[c] - less[c]).max(0.0);
                }
            }
        }
        let seen = visibility::at::<BANDS>(&blocked.visibility, q, &p.index);
        for i in 0..v.lobes {
            let row = Row::new::<BANDS>(&light.chain, v, i, &x);
            for tap in 0..row.most {
                let (mut places, mut tapped) = ([0.0; WIDTH], [0.0; WIDTH]);
                for k in 0..WIDTH {
                    if let Some(t) = row.taps[k].get(tap) {
                        [places[k], tapped[k]] = *t;
                    }
                }
                let mut d = [[0.0; WIDTH]; 3];
                for k in 0..WIDTH {
                    let angle = row.angle[k] + row.sweep[k] * places[k];
                    let m = mean(lane(&p.n, k), lane(&p.r, k), [sine[k], p.cos_o[k]], angle);
                    [d[0][k], d[1][k], d[2][k]] = m;
                }
                if BANDS > 0 {
                    for k in 0..WIDTH {
                        let mut b = [0.0; MOST * MOST];
                        for l in 0..BANDS * BANDS {
                            b[l] = seen[l][k];
                        }
                        let zonal = [row.zonal[0][k], row.zonal[1][k], row.zonal[2][k], 0.0];
                        let v = visibility::ratio::<BANDS>(&b, lane(&p.n, k), zonal, lane(&d, k));
                        tapped[k] *= v.clamp(0.0, 1.0);
                    }
                }
                let places = Places::new(&turned(turn, &d));
                let [near, far] = row.sizes.map(|size| places.cells(&size));
                for (k, sum) in sum.iter_mut().enumerate() {
                    if tap < row.taps[k].len() {
                        let (l0, l1) = (near.sample(row.near[k], k), far.sample(row.far[k], k));
                        for c in 0..4 {
                            let l = l0[c] + (l1[c] - l0[c]) * row.part[k];
                            sum[c] += row.weight[k][c] * tapped[k] * l;
                        }
                    }
                }
            }
        }
        sum
    }
}

/// `fn hidden(b, zonal, d)`: Σ A_l b_lm y_lm(d), written out for as many bands.
fn hidden(bands: usize) -> String {
    let n = bands * bands;
    let band = |l: usize| {
        let terms: Vec<String> = (l * l..(l + 1) * (l + 1)).map(|k| format!("b[{k}] * y[{k}]")).collect();
        let factor = ["", "zonal.x * ", "zonal.y * ", "zonal.z * "][l];
        format!("{factor}({})", terms.join(" + "))
    };
    let sum: Vec<String> = (0..bands).map(band).collect();
    format!(
        "{}alias Blocked = array<f32, {n}>;\n\n\
         // What is blocked at a point.\n\
         fn blocked_at(site: Site) -> Blocked {{\n    var b: Blocked;\n    for (var k = 0u; k < {n}u; k += 1u) {{\n        \
         b[k] = fetch_blocked_at(site, k);\n    }}\n    return b;\n}}\n\n\
         // Sum of A_l b_lm y_lm(d).\n\
         fn hidden(b: Blocked, zonal: vec4<f32>, d: vec3<f32>) -> f32 {{\n    let y = harmonics(d);\n    return {};\n}}\n",
        harmonics::wgsl(bands - 1),
        sum.join(" + ")
    )
}

/// WGSL text of `fn hidden_diffuse(site)`, the radiance that the diffuse part loses to occlusion.
fn hidden_diffuse(diffuse: bool) -> String {
    let mut terms = String::new();
    if diffuse {
        for i in 0..DIFFUSE * DIFFUSE {
            terms +=
                &format!("    l += {} * fetch_blocked_irradiance_at(site, {i}u);\n", sh_light::uniform(i));
        }
    }
    format!(
        "fn hidden_diffuse(site: Site) -> vec3<f32> {{\n    var l = vec3<f32>(0.0);\n{terms}    return l;\n}}\n"
    )
}

pub(super) fn gpu(b: &Bake<GaussianLobes>, f: &Frame) -> GpuTechnique {
    let (light, v, blocked) = (&b.light, &b.linked, &b.transfer);
    // Where lobes depend on the elevation alone, they lie one after another in a line; else each has a plane.
    let views = |name, rows: &[[f32; 4]]| {
        let bytes = texel_bytes(rows.iter());
        let (shape, [width, height, layers]) = match v.columns {
            1 => (Shape::Line, [rows.len(), 1, 1]),
            columns => (Shape::PlaneStack, [columns, v.count() / columns, v.lobes]),
        };
        Table { name, shape, format: Format::Rgba32Float, level: Level { width, height, layers, bytes } }
    };
    let mut counts = match v.is_turned() {
        false => [v.lobes as f32, v.count() as f32, (v.weights.len() - 1) as f32, SCALE],
        true => [v.lobes as f32, SCALE, 0.0, 0.0],
    };
    let [red, green, blue] = v.diffuse;
    let mut tables = vec![
        light.chain.table("chain"),
        cube_table("irradiance", &light.irradiance),
        views("weights", &v.weights),
    ];
    let halves = !v.half_vectors.is_empty();
    if halves {
        tables.push(texels("half_vectors", &v.half_vectors));
        // Four in a texel, as many for each place, with -1 after the last.
        let quads = v.used.iter().map(|u| u.len() / 4 + 1).max().unwrap_or(1);
        let used = |u: &Vec<u32>| -> Vec<[f32; 4]> {
            (0..quads)
                .map(|i| std::array::from_fn(|k| u.get(4 * i + k).map_or(-1.0, |x| *x as f32)))
                .collect()
        };
        tables.push(texels("used", &v.used.iter().flat_map(used).collect::<Vec<_>>()));
        counts = [(v.count() / v.columns) as f32, SCALE, v.columns as f32, quads as f32];
    } else {
        tables.push(views("means", &v.means));
    }
    if !v.sweeps.is_empty() {
        tables.push(views("sweeps", &v.sweeps));
    }
    let mut uniforms = f.uniforms();
    uniforms.push(Uniform { name: "counts", value: Value::Vec4(counts) });
    uniforms.push(Uniform { name: "diffuse", value: Value::Vec4([red, green, blue, 0.0]) });
    let (mut modules, mut buffers) = (Vec::new(), Vec::new());
    let bands = blocked.bands();
    let entry = if bands == 0 {
        modules.push(include_str!("open.wgsl").into());
        Entry::PLAIN
    } else {
        modules.push(hidden(bands).into());
        modules.push(hidden_diffuse(!f.light.is_empty()).into());
        let open = ["", include_str!("ambient.wgsl"), include_str!("published.wgsl")][bands.min(2)];
        let third = if bands > 3 { "0.21875" } else { "0.0" };
        modules.extend([format!("const THIRD: f32 = {third};\n").into(), open.into()]);
        let per = |name, s: &crate::shared::geometry::transport::PerSite| {
            Buffer::new(name, s.stride, s.data.clone())
        };
        buffers.push(per("blocked", &blocked.visibility));
        if !f.light.is_empty() {
            buffers.push(per("blocked_irradiance", &blocked.irradiance));
        }
        Entry::SITE
    };
    let (arguments, fetch) = match v.is_turned() {
        false => ("at: f32", "fetch_zonal(at)"),
        true if halves => ("i: u32", "fetch_zonal(i)"),
        true => ("at: vec2<f32>, i: u32", "fetch_zonal_layer(at, i)"),
    };
    let zonal = if v.zonal.is_empty() { "vec4<f32>(1.0)" } else { fetch };
    modules.push(format!("fn zonal_at({arguments}) -> vec4<f32> {{\n    return {zonal};\n}}\n").into());
    if !v.zonal.is_empty() {
        tables.push(if halves { texels("zonal", &v.zonal) } else { views("zonal", &v.zonal) });
    }
    if halves {
        modules.extend([central::TANGENT.into(), include_str!("halves.wgsl").into()]);
    } else if v.is_turned() {
        let texts = [include_str!("taps.wgsl"), central::TANGENT, include_str!("turned.wgsl")];
        modules.extend(texts.map(Into::into));
    } else {
        modules.extend([include_str!("taps.wgsl").into(), include_str!("shade.wgsl").into()]);
    }
    modules.push(if bands == 0 { include_str!("plain.wgsl") } else { include_str!("site.wgsl") }.into());
    GpuTechnique { slug: GaussianLobes::CARD.slug, modules, entry, tables, uniforms, buffers }
}
