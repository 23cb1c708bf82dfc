//! The reflectance's factor: its lobes themselves and the images that vary them, so that no file has to be
//! there when a bake is loaded.

use super::LafortuneEnv;
use crate::shared::surface::cosine_lobes::{
    Averages, CosineLobes, MOST as MOST_VARIED, PLANES, Storage, TOLERANCE, Widths, lobes_of,
};
use crate::shared::surface::kept;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Material, Part, Technique};
use glam::DVec3;
use std::sync::Arc;
use steradian_base::Task;
use steradian_brdf::model::lafortune::{Cosine, Lafortune};
use steradian_brdf::{Brdf, SharedBrdf, spec_without_folders};
use steradian_scene::surface::Planes;

/// Most terms (lobes times different channels) that shading sums.
const MOST: usize = 64;
/// Number of texels that certificates use.
const LOOKED_AT: usize = 64;

/// Key of the metadata that give the bytes of ρ, C and n by texel.
const BYTES: &str = "lobes.bytes";

fn widths(words: &str) -> Option<Storage> {
    let bytes: Vec<usize> = words.split(' ').map_while(|w| w.parse().ok()).collect();
    match bytes[..] {
        [rho, c, n] if [rho, c, n].iter().all(|b| (1..=3).contains(b)) => {
            Some(Storage::Of(Widths { rho, c, n }))
        }
        _ => None,
    }
}

/// Generalised cosine lobes and a diffuse part.
pub struct Cosines {
    /// The reflectance, for parameters without an image.
    pub own: Lafortune,
    /// The lobes by texel, where images give some of their parameters.
    pub varied: Option<CosineLobes>,
    /// The images.
    planes: Planes,
}

/// Channels of a lobe that share C and n: one lookup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// (C_x, C_y, C_z).
    pub c: DVec3,
    /// Exponent.
    pub n: f64,
    /// ρ per channel, 0 where the channel has another term.
    pub k: [f64; 3],
}

impl Cosines {
    /// The material's lobes.
    pub fn of(m: &Material, task: &Task) -> Result<Self, BakeError> {
        let slug = LafortuneEnv::CARD.slug;
        let refuse = |why: String| BakeError::Material { slug, why };
        let own = lobes_of(&*m.brdf).ok_or_else(|| refuse("takes lafortune and lambert only".into()))?;
        let named = PLANES.iter().any(|p| m.textures.has(p.name));
        if named && own.lobes.len() > MOST_VARIED {
            let why = format!("varies {MOST_VARIED} lobes at most, not {}", own.lobes.len());
            return Err(refuse(why));
        }
        let storage = Storage::Within(task.tolerance().unwrap_or(TOLERANCE));
        let own = Self::new(own, if named { m.textures.clone() } else { Planes::default() }, storage);
        let count = own.terms().len();
        if count > MOST {
            return Err(refuse(format!(
                "takes up to {MOST} lookups, not {count}: use fewer lobes, or reference"
            )));
        }
        Ok(own)
    }

    fn new(own: Lafortune, planes: Planes, storage: Storage) -> Self {
        let varied = (!planes.is_empty()).then(|| CosineLobes::new(own.kd, &own.lobes, &planes, storage));
        Self { own, varied, planes }
    }

    /// Is there an image of this name?
    pub fn has(&self, name: &str) -> bool {
        self.planes.has(name)
    }

    /// Texture coordinates of some texels' centres, spread over the images, and the reflectance there with
    /// the numbers of the images.
    pub fn looked_at(&self) -> Option<Vec<([f32; 2], SharedBrdf)>> {
        self.varied.as_ref()?;
        let varied = Averages::new(self.own.kd, &self.own.lobes, &self.planes);
        let (width, height) = varied.size();
        let at = |k: usize| {
            let u = |by: f64, n: usize| (((k as f64 * by + 0.5).fract() * n as f64).floor() + 0.5) / n as f64;
            let uv = [u(0.754_877_666, width), u(0.569_840_291, height)].map(|x| x as f32);
            (uv, Arc::new(varied.reflectance(uv)) as SharedBrdf)
        };
        Some((0..LOOKED_AT).map(at).collect())
    }

    /// The terms that shading sums where nothing varies over the surface.
    pub fn terms(&self) -> Vec<Term> {
        let mut all: Vec<Term> = Vec::new();
        for lobe in &self.own.lobes {
            let first = all.len();
            for (channel, cosine) in lobe.iter().enumerate().filter(|(_, l)| l.ks > 0.0) {
                let same = |t: &&mut Term| t.c == cosine.c && t.n == cosine.n;
                if let Some(t) = all[first..].iter_mut().find(same) {
                    t.k[channel] = cosine.ks;
                } else {
                    let mut k = [0.0; 3];
                    k[channel] = cosine.ks;
                    all.push(Term { c: cosine.c, n: cosine.n, k });
                }
            }
        }
        all
    }
}

impl Part for Cosines {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        to.metadata.insert(format!("steradian.{prefix}.brdf"), spec_without_folders(&self.own.spec));
        let cosine = |l: &Cosine| [l.c.x, l.c.y, l.c.z, l.n, l.ks];
        let lobes = self.own.lobes.iter().flatten().flat_map(cosine).collect();
        put_f64(to, format!("{prefix}.lobes"), vec![self.own.lobes.len(), 3, 5], lobes);
        put_f64(to, format!("{prefix}.kd"), vec![3], self.own.kd.to_vec());
        if let Some(Widths { rho, c, n }) = self.varied.as_ref().map(|v| v.widths) {
            to.metadata.insert(format!("steradian.{prefix}.{BYTES}"), format!("{rho} {c} {n}"));
        }
        kept::put(to, &format!("{prefix}.plane."), &self.planes);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let key = format!("steradian.{prefix}.brdf");
        let spec = from.metadata.get(&key).ok_or(PartError::Missing(key))?.clone();
        let name = format!("{prefix}.lobes");
        let (shape, v) = get_f64(from, &name, 3)?;
        if shape[1..] != [3, 5] || v.iter().any(|x| !x.is_finite()) {
            return Err(PartError::Unexpected(name));
        }
        let cosine =
            |v: &[f64]| Cosine { c: DVec3::new(v[0], v[1], v[2]), n: v[3].max(0.0), ks: v[4].max(0.0) };
        let lobes: Vec<_> =
            v.chunks_exact(15).map(|l| std::array::from_fn(|c| cosine(&l[5 * c..]))).collect();
        let name = format!("{prefix}.kd");
        let (_, kd) = get_f64(from, &name, 1)?;
        let kd = kd.try_into().map_err(|_| PartError::Unexpected(name))?;
        let before = format!("{prefix}.plane.");
        let planes = kept::planes(from, &before)?;
        let known = |name: &str| PLANES.iter().find(|p| p.name == name);
        let odd = planes.iter().find(|(name, t)| known(name).is_none_or(|p| p.beyond(t).is_some()));
        if let Some((name, _)) = odd {
            return Err(PartError::Unexpected(format!("{before}{name}")));
        }
        if !planes.is_empty() && lobes.len() > MOST_VARIED {
            return Err(PartError::Unexpected(format!("{prefix}.lobes")));
        }
        let key = format!("steradian.{prefix}.{BYTES}");
        let storage = match from.metadata.get(&key) {
            Some(words) => widths(words).ok_or(PartError::Unexpected(key))?,
            None => Storage::Within(TOLERANCE),
        };
        Ok(Self::new(Lafortune { spec, kd, lobes }, planes, storage))
    }

    fn bytes(&self) -> usize {
        0
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        Some(&self.own)
    }
}
