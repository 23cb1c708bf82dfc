//! The small function as tensors: halves, as it is shaded with.

use super::bake::{MOST, Tables};
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use glam::DVec3;
use half::f16;
use steradian_formats::{Tensor, TensorData};
use steradian_relight::btf::{Chained, Compressed, Corners, Levels, Local, Model, View};

const METHOD: &str = "steradian.btf.method";
/// Most texels a side and most directions, as for the functions themselves.
const LARGEST: usize = 1 << 16;

fn put_halves(to: &mut TensorFile, name: &str, shape: Vec<usize>, data: &[f32]) {
    let data = TensorData::F16(data.iter().map(|x| f16::from_f32(*x)).collect());
    to.tensors.insert(name.into(), Tensor { shape, data });
}

fn put_indices(to: &mut TensorFile, name: &str, shape: Vec<usize>, data: Vec<u32>) {
    to.tensors.insert(name.into(), Tensor { shape, data: TensorData::U32(data) });
}

fn put_directions(to: &mut TensorFile, name: &str, all: &[DVec3]) {
    put_f64(to, name.into(), vec![all.len(), 3], all.iter().flat_map(|d| d.to_array()).collect());
}

pub(super) fn save(t: &Tables, to: &mut TensorFile) {
    let s = &t.small;
    let (width, height, _) = s.levels.level(0);
    put_indices(to, "size", vec![2], vec![width as u32, height as u32]);
    put_f32(to, "scale".into(), vec![1], vec![t.scale]);
    put_directions(to, "views", &s.views);
    put_directions(to, "lights", &s.lights);
    put_f64(to, "errors".into(), vec![s.errors.len()], s.errors.clone());
    let pairs = s.views.len() * s.lights.len();
    let method = match &s.model {
        Model::Local(m) => {
            put_halves(to, "tables", vec![m.len(), m.components + 1, m.dimension], &m.tables);
            put_indices(to, "cluster", vec![m.cluster.len()], m.cluster.clone());
            put_halves(to, "weights", vec![m.cluster.len(), m.components], &m.weights);
            "local"
        }
        Model::View(m) => {
            put_halves(to, "pictures", vec![s.views.len(), m.components + 1, 3 * m.texels], &m.pictures);
            put_halves(to, "weights", vec![pairs, m.components], &m.weights);
            "view"
        }
        Model::Chained(m) => {
            let corners = m.places.iter().flat_map(|p| p.of).collect();
            put_indices(to, "corners", vec![pairs, 3], corners);
            let weights = m.places.iter().flat_map(|p| p.weights).collect();
            put_f32(to, "corner_weights".into(), vec![pairs, 3], weights);
            put_halves(to, "light", vec![s.lights.len()], &m.light);
            put_halves(to, "factors", vec![pairs, m.terms], &m.factors);
            put_halves(to, "products", vec![s.levels.all(), m.halves, 3 * m.terms], &m.texels);
            put_indices(to, "differences", vec![1], vec![m.differences as u32]);
            "chained"
        }
    };
    to.metadata.insert(METHOD.into(), method.into());
}

fn unexpected(name: &str) -> PartError {
    PartError::Unexpected(name.into())
}

fn get_indices(from: &TensorFile, name: &str, shape: &[usize]) -> Result<Vec<u32>, PartError> {
    let t = from.tensors.get(name).ok_or_else(|| PartError::Missing(name.into()))?;
    match &t.data {
        TensorData::U32(v) if t.shape == shape && v.len() == shape.iter().product::<usize>() => Ok(v.clone()),
        _ => Err(unexpected(name)),
    }
}

/// A tensor of a given shape, in which 0 means any extent.
fn get<const N: usize>(
    from: &TensorFile,
    name: &str,
    want: [usize; N],
) -> Result<([usize; N], Vec<f32>), PartError> {
    let (shape, data) = get_f32(from, name, N)?;
    let shape: [usize; N] = shape.try_into().map_err(|_| unexpected(name))?;
    let fits = shape.iter().zip(want).all(|(s, w)| w == ANY || *s == w);
    if fits { Ok((shape, data)) } else { Err(unexpected(name)) }
}

/// Stands for any extent in a shape.
const ANY: usize = usize::MAX;

fn get_directions(from: &TensorFile, name: &str) -> Result<Vec<DVec3>, PartError> {
    let (shape, data) = get_f64(from, name, 2)?;
    let all: Vec<DVec3> = data.chunks_exact(3).map(DVec3::from_slice).collect();
    let unit = |d: &DVec3| (d.length() - 1.0).abs() < 1e-6 && d.z > 0.0;
    let sound = shape[1] == 3 && (1..=LARGEST).contains(&all.len()) && all.iter().all(unit);
    if sound { Ok(all) } else { Err(unexpected(name)) }
}

pub(super) fn load(from: &TensorFile) -> Result<Tables, PartError> {
    let size = get_indices(from, "size", &[2])?;
    let [width, height] = [size[0] as usize, size[1] as usize];
    if [width, height].iter().any(|n| !(1..=LARGEST).contains(n)) {
        return Err(unexpected("size"));
    }
    let levels = Levels::new(width, height);
    let (_, scale) = get(from, "scale", [1])?;
    let (views, lights) = (get_directions(from, "views")?, get_directions(from, "lights")?);
    let (_, errors) = get_f64(from, "errors", 1)?;
    let (texels, pairs) = (levels.all(), views.len() * lights.len());
    let method = from.metadata.get(METHOD).ok_or_else(|| PartError::Missing(METHOD.into()))?;
    let few = |n: usize, name: &str| if n <= MOST { Ok(n) } else { Err(unexpected(name)) };
    let model = match method.as_str() {
        "local" => {
            let ([clusters, rows, dimension], tables) = get(from, "tables", [ANY, ANY, 3 * pairs])?;
            let components = few(rows.wrapping_sub(1), "tables")?;
            let cluster = get_indices(from, "cluster", &[texels])?;
            if cluster.iter().any(|k| *k as usize >= clusters) {
                return Err(unexpected("cluster"));
            }
            let (_, weights) = get(from, "weights", [texels, components])?;
            Model::Local(Local { dimension, components, tables, cluster, weights })
        }
        "view" => {
            let ([_, rows, _], pictures) = get(from, "pictures", [views.len(), ANY, 3 * texels])?;
            let components = few(rows.wrapping_sub(1), "pictures")?;
            let (_, weights) = get(from, "weights", [pairs, components])?;
            Model::View(View { components, lights: lights.len(), texels, pictures, weights })
        }
        "chained" => {
            let ([_, terms], factors) = get(from, "factors", [pairs, ANY])?;
            let terms = few(terms, "factors")?;
            let ([_, halves, _], products) = get(from, "products", [texels, ANY, 3 * terms])?;
            let corners = get_indices(from, "corners", &[pairs, 3])?;
            if corners.iter().any(|h| *h as usize >= halves) {
                return Err(unexpected("corners"));
            }
            let (_, weights) = get(from, "corner_weights", [pairs, 3])?;
            let place = |(of, weights): (&[u32], &[f32])| Corners {
                of: std::array::from_fn(|k| of[k]),
                weights: std::array::from_fn(|k| weights[k]),
            };
            let places = corners.chunks_exact(3).zip(weights.chunks_exact(3)).map(place).collect();
            let (_, light) = get(from, "light", [lights.len()])?;
            let differences = get_indices(from, "differences", &[1])?[0] as usize;
            Model::Chained(Chained { terms, halves, differences, places, light, factors, texels: products })
        }
        _ => return Err(unexpected(METHOD)),
    };
    Ok(Tables::of(Compressed { levels, views, lights, model, errors }, scale[0]))
}
