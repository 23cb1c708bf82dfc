//! Lookups and sums; `shade.wgsl`, and of each method `local.wgsl`, `view.wgsl` and `chained.wgsl`, have the
//! same functions.

use super::bake::{MOST, Tables};
use crate::gpu::{Buffer, Numbers, Uniform, Value};
use crate::local::{LocalText, Place};
use half::f16;
use steradian_relight::btf::{Chained, Local, Model, Net, Tap, View};

/// Numbers of a row of the nets' buffer.
const NET: usize = 16;

/// Three views around the viewer, and their weights.
#[derive(Debug, Clone, Copy)]
pub struct Around {
    corners: [u32; 3],
    weights: [f32; 3],
}

/// The compressed function at a point, ready to be evaluated.
#[derive(Debug, Clone, Copy)]
pub enum Texel {
    /// By clusters: clusters of the texels around the point, and weights of their tables.
    Local {
        /// The views.
        views: Around,
        /// Number of clusters.
        count: usize,
        /// The clusters.
        cluster: [u32; 8],
        /// For each cluster the weights of mean and components.
        weights: [[f32; MOST + 1]; 8],
    },
    /// By views: the pictures of each view at the point, with the view's weight.
    View {
        /// The views.
        views: Around,
        /// Mean and components in red, green and blue.
        pictures: [[[f32; 3]; MOST + 1]; 3],
    },
    /// By a chain of products: the texels around the point.
    Chained {
        /// The views.
        views: Around,
        /// The texels.
        taps: [Tap; 8],
    },
}

pub(super) fn texel(t: &Tables, at: Place, wo: [f32; 3]) -> Texel {
    let (corners, weights) = t.views.around(wo);
    let views = Around { corners, weights };
    let taps = t.small.levels.taps(at.uv, at.footprint);
    match &t.small.model {
        Model::Local(m) => local_texel(m, views, taps),
        Model::View(m) => view_texel(m, views, taps),
        Model::Chained(_) => Texel::Chained { views, taps },
    }
}

pub(super) fn f_cos(t: &Tables, x: &Texel, wi: [f32; 3]) -> [f32; 3] {
    // False for NaN too.
    if wi[2] > 0.0 {
        let (lights, weights) = t.lights.around(wi);
        let mut sum = [0.0f32; 3];
        for (l, w) in lights.into_iter().zip(weights) {
            let by = w * wi[2] / t.cosines[l as usize];
            let value = value(t, x, l as usize);
            (0..3).for_each(|c| sum[c] += by * value[c]);
        }
        sum.map(|s| t.scale * s.max(0.0))
    } else {
        [0.0; 3]
    }
}

/// The function under a light, between the views.
fn value(t: &Tables, x: &Texel, light: usize) -> [f32; 3] {
    let lights = t.cosines.len();
    match (&t.small.model, x) {
        (Model::Local(m), Texel::Local { views, count, cluster, weights }) => {
            let mut sum = [0.0f32; 3];
            for (v, w) in views.corners.iter().zip(views.weights) {
                let pair = *v as usize * lights + light;
                for (k, own) in cluster[..*count].iter().zip(weights) {
                    let first = *k as usize * (m.components + 1) * m.dimension + 3 * pair;
                    for (j, a) in own[..=m.components].iter().enumerate() {
                        let e = &m.tables[first + j * m.dimension..][..3];
                        (0..3).for_each(|c| sum[c] += w * a * e[c]);
                    }
                }
            }
            sum
        }
        (Model::View(m), Texel::View { views, pictures }) => {
            let mut sum = [0.0f32; 3];
            for (v, own) in views.corners.iter().zip(pictures) {
                let weights = &m.weights[(*v as usize * lights + light) * m.components..][..m.components];
                (0..3).for_each(|c| sum[c] += own[0][c]);
                for (a, e) in weights.iter().zip(&own[1..]) {
                    (0..3).for_each(|c| sum[c] += a * e[c]);
                }
            }
            sum
        }
        (Model::Chained(m), Texel::Chained { views, taps }) => {
            let mut sum = [0.0f32; 3];
            for (v, w) in views.corners.iter().zip(views.weights) {
                let pair = *v as usize * lights + light;
                let (place, by) = (&m.places[pair], w * m.light[light]);
                let factors = &m.factors[pair * m.terms..][..m.terms];
                for (texel, a) in taps.iter().filter(|t| t.1 > 0.0) {
                    for (h, u) in place.of.iter().zip(place.weights) {
                        let p = &m.texels[(texel * m.halves + *h as usize) * 3 * m.terms..];
                        for (p, q) in p.chunks_exact(3).zip(factors) {
                            (0..3).for_each(|c| sum[c] += by * a * u * q * p[c]);
                        }
                    }
                }
            }
            sum
        }
        // A texel is made of the tables that it is looked up in.
        _ => [0.0; 3],
    }
}

fn local_texel(m: &Local, views: Around, taps: [Tap; 8]) -> Texel {
    let (mut count, mut cluster, mut weights) = (0, [0u32; 8], [[0.0f32; MOST + 1]; 8]);
    for (texel, w) in taps.into_iter().filter(|t| t.1 > 0.0) {
        let k = m.cluster[texel];
        let at = cluster[..count].iter().position(|c| *c == k).unwrap_or(count);
        if at == count {
            cluster[count] = k;
            count += 1;
        }
        weights[at][0] += w;
        for j in 0..m.components {
            weights[at][j + 1] += w * m.weights[texel * m.components + j];
        }
    }
    Texel::Local { views, count, cluster, weights }
}

fn view_texel(m: &View, views: Around, taps: [Tap; 8]) -> Texel {
    let mut pictures = [[[0.0f32; 3]; MOST + 1]; 3];
    for ((own, v), w) in pictures.iter_mut().zip(views.corners).zip(views.weights) {
        for (k, to) in own[..=m.components].iter_mut().enumerate() {
            let first = m.picture(v as usize, k);
            for (texel, a) in taps.iter().filter(|t| t.1 > 0.0) {
                let e = &m.pictures[first + 3 * texel..][..3];
                (0..3).for_each(|c| to[c] += w * a * e[c]);
            }
        }
    }
    Texel::View { views, pictures }
}

/// Rows of a net: corners, triangles across, the weights of two corners; and of each cell where to start.
fn rows(net: &Net) -> Vec<f32> {
    let count = net.triangles.len().max(net.starts.len());
    let mut out = vec![0.0; NET * count];
    for (row, t) in out.chunks_exact_mut(NET).zip(&net.triangles) {
        let numbers = t.corners.iter().chain(&t.across).map(|x| *x as f32).chain(t.weights.concat());
        row.iter_mut().zip(numbers).for_each(|(to, x)| *to = x);
    }
    out.chunks_exact_mut(NET).zip(&net.starts).for_each(|(row, s)| row[12] = *s as f32);
    out
}

/// Cosines of lights, with the factor R of a chain.
fn lights(t: &Tables) -> Vec<f32> {
    let factor = |l: usize| match &t.small.model {
        Model::Chained(m) => m.light[l],
        _ => 1.0,
    };
    t.cosines.iter().enumerate().flat_map(|(l, c)| [*c, factor(l)]).collect()
}

/// For each pair of directions the grid's half vectors around its own, and their weights.
fn places(m: &Chained) -> Vec<f32> {
    m.places.iter().flat_map(|p| p.of.map(|h| h as f32).into_iter().chain(p.weights)).collect()
}

/// Numbers of single precision on a GPU.
pub(super) fn singles(t: &Tables) -> Vec<Vec<f32>> {
    let mut out = vec![[rows(&t.views), rows(&t.lights)].concat(), lights(t)];
    if let Model::Chained(m) = &t.small.model {
        out.push(places(m));
    }
    out
}

/// Numbers of half precision: of tables, and of texels or pairs.
pub(super) fn halves(model: &Model) -> [std::borrow::Cow<'_, [f32]>; 2] {
    match model {
        Model::Local(m) => {
            let c = m.components;
            let row = |(x, k): (usize, &u32)| {
                std::iter::once(*k as f32).chain(m.weights[x * c..][..c].iter().copied())
            };
            let texels: Vec<f32> = m.cluster.iter().enumerate().flat_map(row).collect();
            [m.tables.as_slice().into(), texels.into()]
        }
        // A buffer is never empty.
        Model::View(m) if m.components == 0 => [m.pictures.as_slice().into(), vec![0.0; 2].into()],
        Model::View(m) => [m.pictures.as_slice().into(), m.weights.as_slice().into()],
        Model::Chained(m) => [m.texels.as_slice().into(), m.factors.as_slice().into()],
    }
}

/// Bytes on a GPU.
pub(super) fn bytes(t: &Tables) -> usize {
    2 * halves(&t.small.model).iter().map(|h| h.len()).sum::<usize>()
        + 4 * singles(t).iter().map(Vec::len).sum::<usize>()
}

pub(super) fn text(t: &Tables) -> LocalText {
    let levels = &t.small.levels;
    let (width, height, _) = levels.level(0);
    let number = |x: usize| x as f32;
    let (own, names, strides, shape) = match &t.small.model {
        Model::Local(m) => (
            include_str!("local.wgsl"),
            ["local_tables", "local_texels"],
            [3, m.components + 1],
            [number(m.components), number(m.dimension / 3), 0.0],
        ),
        Model::View(m) => (
            include_str!("view.wgsl"),
            ["local_pictures", "local_weights"],
            [3, m.components.max(1)],
            [number(m.components), number(m.texels), 0.0],
        ),
        Model::Chained(m) => (
            include_str!("chained.wgsl"),
            ["local_products", "local_factors"],
            [3, m.terms],
            [number(m.terms), number(m.halves), 0.0],
        ),
    };
    let net = t.views.triangles.len().max(t.views.starts.len());
    let uniform = |name, value| Uniform { name, value: Value::Vec4(value) };
    let uniforms = vec![
        uniform("local_patch", [number(width), number(height), number(levels.len()), number(net)]),
        uniform("local_shape", [shape[0], shape[1], number(t.cosines.len()), t.scale]),
    ];
    let singles = singles(t);
    let mut buffers: Vec<Buffer> = ["local_net", "local_cosines", "local_places"]
        .into_iter()
        .zip([NET, 2, 6])
        .zip(singles)
        .map(|((name, stride), data)| Buffer::new(name, stride, data))
        .collect();
    for ((name, stride), data) in names.into_iter().zip(strides).zip(halves(&t.small.model)) {
        let data = Numbers::F16(data.iter().map(|x| f16::from_f32(*x)).collect());
        buffers.push(Buffer { name, stride, data });
    }
    let module = [include_str!("shade.wgsl"), own].concat();
    LocalText { module: module.into(), tables: Vec::new(), uniforms, buffers }
}
