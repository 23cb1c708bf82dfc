//! The function of a map or of a reflectance, made small and rounded to half precision.

use crate::local::FileName;
use crate::{BakeError, Material};
use half::f16;
use std::f64::consts::PI;
use steradian_base::{Cancelled, ParamInfo, Task, params};
use steradian_brdf::Brdf;
use steradian_relight::btf::{Btf, BtfError, Compressed, Method, Model, Net, bonn};

/// Name of the plane of the function.
pub const MAP: &str = "map";
/// Most components of a method.
pub const MOST: usize = 16;
/// Difference vectors of a chain.
const DIFFERENCES: usize = 128;
/// Methods in the order of the parameter.
const METHODS: [&str; 3] = ["local", "view", "chained"];

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// The map.
        pub map: Option<FileName> = ParamInfo::file("map", "pictures of a bidirectional texture function (.csv), as capture writes them; auto: the reflectance").auto(f64::NAN),
        /// Form of the compressed function.
        pub method: usize = ParamInfo::choice("method", &METHODS, "principal components of clusters of texels, or of each view's pictures, or a chain of sums of products over half vector and difference, and light").numbered(0.0).preset("local"),
        /// Clusters of texels.
        pub clusters: usize = ParamInfo::whole("clusters", [1.0, 256.0], 32.0, "clusters of texels of method=local"),
        /// Components in addition to means, or products.
        pub components: usize = ParamInfo::whole("components", [0.0, MOST as f64], 8.0, "components beside the mean of each cluster or view, or products of method=chained (1 at least)"),
        /// Half vectors.
        pub halves: usize = ParamInfo::whole("halves", [1.0, 64.0], 21.0, "half vectors of method=chained"),
    }
}

impl Params {
    fn method(&self) -> Method {
        let components = self.components;
        match METHODS[self.method] {
            "local" => Method::Local { clusters: self.clusters, components },
            "view" => Method::View { components },
            _ => Method::Chained { terms: components.max(1), halves: self.halves, differences: DIFFERENCES },
        }
    }
}

/// The small function.
#[derive(Debug, Clone)]
pub struct Tables {
    /// The compressed function in half precision, divided by [`Tables::scale`].
    pub small: Compressed,
    /// Triangles of views.
    pub views: Net,
    /// Triangles of lights.
    pub lights: Net,
    /// n·l of the lights.
    pub cosines: Vec<f32>,
    /// The largest number over π.
    pub scale: f32,
}

pub(super) fn bake(m: &Material, p: &Params, task: &Task) -> Result<Tables, BakeError> {
    let own = match &m.apparent {
        Some(_) => None,
        None => Some(of_reflectance(&*m.brdf).map_err(|_| BakeError::NotFinite { slug: "btf_pca" })?),
    };
    let Some(btf) = m.apparent.as_deref().or(own.as_ref()) else {
        return Err(BakeError::NotFinite { slug: "btf_pca" });
    };
    task.begin("compression", 1);
    let go_on = || task.check().is_ok();
    let mut small = Compressed::new(btf, p.method(), &go_on).ok_or(Cancelled)?;
    task.end();
    let largest = btf.largest();
    let scale = if largest > 0.0 { largest } else { 1.0 };
    rounded(&mut small.model, scale);
    Ok(Tables::of(small, (f64::from(scale) / PI) as f32))
}

impl Tables {
    /// Tables of a compressed function that has been rounded already.
    pub(super) fn of(small: Compressed, scale: f32) -> Self {
        Self {
            views: Net::new(&small.views),
            lights: Net::new(&small.lights),
            cosines: small.lights.iter().map(|l| l.z as f32).collect(),
            scale,
            small,
        }
    }
}

/// The function of a reflectance: one texel.
fn of_reflectance(brdf: &dyn Brdf) -> Result<Btf, BtfError> {
    let all = bonn();
    Btf::of((1, 1), &all, &all, |_, v, l| brdf.f_cos(all[l], all[v]).map(|x| (PI * x) as f32))
}

fn half(x: f32) -> f32 {
    f16::from_f32(x).to_f32()
}

/// Largest absolute number, 1 where there is none.
fn largest<'a>(all: impl Iterator<Item = &'a f32>) -> f32 {
    let m = all.fold(0.0f32, |m, x| m.max(x.abs()));
    if m > 0.0 { m } else { 1.0 }
}

/// Numbers of the function over `scale`, and those of tables over the largest of each, in half precision.
fn rounded(model: &mut Model, scale: f32) {
    match model {
        Model::View(m) => {
            m.pictures.iter_mut().for_each(|x| *x = half(*x / scale));
            m.weights.iter_mut().for_each(|x| *x = half(*x));
        }
        Model::Local(m) => {
            let (d, c) = (m.dimension, m.components);
            let mut sizes = Vec::with_capacity(m.len() * c);
            for table in m.tables.chunks_exact_mut((c + 1) * d) {
                let (mean, rest) = table.split_at_mut(d);
                mean.iter_mut().for_each(|x| *x = half(*x / scale));
                for e in rest.chunks_exact_mut(d) {
                    let size = largest(e.iter());
                    e.iter_mut().for_each(|x| *x = half(*x / size));
                    sizes.push(size / scale);
                }
            }
            for (k, w) in m.cluster.iter().zip(m.weights.chunks_exact_mut(c.max(1))) {
                w.iter_mut().zip(&sizes[*k as usize * c..]).for_each(|(w, s)| *w = half(*w * s));
            }
        }
        Model::Chained(m) => {
            let terms = m.terms;
            let light = largest(m.light.iter());
            m.light.iter_mut().for_each(|x| *x = half(*x / light));
            for j in 0..terms {
                let size = largest(m.factors.iter().skip(j).step_by(terms));
                m.factors.iter_mut().skip(j).step_by(terms).for_each(|x| *x = half(*x / size));
                let by = size * light / scale;
                for p in m.texels.chunks_exact_mut(3).skip(j).step_by(terms) {
                    p.iter_mut().for_each(|x| *x = half(*x * by));
                }
            }
        }
    }
}
