//! The geometry's factor of techniques with sites: transfer per vertex or per given point.

use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Geometry, Part, Points, Sites};
use half::f16;
use steradian_base::Task;
use steradian_brdf::Form;
use steradian_scene::Mesh;
use steradian_transfer::{Saved, Scene, Settings, Site, Transfer, TransferError, points_kind, transfer};

/// Numbers per site.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PerSite {
    /// Number of values of each site.
    pub stride: usize,
    /// Site after site.
    pub data: Vec<f32>,
}

impl PerSite {
    /// The numbers of a site; `None` beyond the end.
    #[inline(always)]
    pub fn at(&self, site: u32) -> Option<&[f32]> {
        let start = site as usize * self.stride;
        self.data.get(start..start + self.stride)
    }

    /// Appends to the numbers of each site those of the same site in `other`.
    #[must_use]
    pub fn beside(&self, other: &Self) -> Self {
        let both = self.data.chunks(self.stride.max(1)).zip(other.data.chunks(other.stride.max(1)));
        let data = both.flat_map(|(a, b)| a.iter().chain(b)).copied().collect();
        Self { stride: self.stride + other.stride, data }
    }

    /// These values rounded to 16-bit floats.
    #[must_use]
    pub fn rounded(mut self) -> Self {
        self.data.iter_mut().for_each(|x| *x = f16::from_f32(*x).to_f32());
        self
    }
}

impl Part for PerSite {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let sites = self.data.len() / self.stride.max(1);
        put_f32(to, format!("{prefix}.sites"), vec![sites, self.stride], self.data.clone());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let (shape, data) = get_f32(from, &format!("{prefix}.sites"), 2)?;
        Ok(Self { stride: shape[1], data })
    }

    fn bytes(&self) -> usize {
        4 * self.data.len()
    }
}

/// The places of a geometry.
pub fn sites(slug: &'static str, g: &Geometry) -> Result<Vec<Site>, BakeError> {
    match &g.sites {
        Sites::Vertices => Ok(Site::vertices(&g.mesh)),
        Sites::Slots(slots) => Ok(Site::vertices_in(&g.mesh, slots)),
        Sites::Points { p, n } if p.len() == n.len() => {
            Ok(p.iter().zip(n.iter()).map(|(&p, &n)| Site { p, n }).collect())
        }
        Sites::Points { .. } => {
            Err(BakeError::Geometry { slug, why: "needs a normal for each point".into() })
        }
        Sites::Texels { .. } => {
            Err(BakeError::Geometry { slug, why: "bakes per vertex or per point, not per texel".into() })
        }
    }
}

/// Transfer at the places of `g`. Where light is reflected between surfaces, each slot of the mesh has the
/// albedo of its material, and `albedo` where it is the one that is baked.
pub fn bake(
    slug: &'static str,
    g: &Geometry,
    albedo: [f64; 3],
    settings: Settings,
    task: &Task,
) -> Result<Transfer, BakeError> {
    let slot = |m: &crate::Material| match m.brdf.form() {
        Form::Lambert { albedo } => Ok(albedo),
        _ => Err(BakeError::Geometry {
            slug,
            why: format!("reflections between surfaces are lambert's, not those of {}", m.brdf.spec()),
        }),
    };
    let mut slots = Vec::new();
    if settings.bounces > 1 {
        slots = g.materials.iter().map(slot).collect::<Result<_, _>>()?;
    }
    slots.push(albedo);
    let settings = Settings { albedo: slots, ..settings };
    let error = |e: TransferError| match e {
        TransferError::Cancelled(c) => c.into(),
        TransferError::Memory { needed, allowed, .. } => BakeError::Memory { slug, need: needed, allowed },
        e => BakeError::Geometry { slug, why: e.to_string() },
    };
    if let Some(saved) = &g.transfer {
        let kind = match &g.sites {
            Sites::Vertices | Sites::Slots(_) => "vertices".into(),
            _ => points_kind(&sites(slug, g)?),
        };
        return known(saved, &g.mesh, &kind, &settings).map_err(|why| BakeError::Transfer { slug, why });
    }
    let scene = Scene::new(&g.mesh).map_err(error)?;
    let places = match &g.sites {
        // Light that arrives at the vertices of all slots is reflected to those baked.
        Sites::Slots(_) if settings.bounces > 1 => Site::vertices(&g.mesh),
        _ => sites(slug, g)?,
    };
    transfer(&scene, &places, &settings, None, task).map_err(error)
}

/// The bands of a file's transfer at sites of a kind that `settings` ask for, or why the file does not have
/// them.
fn known(saved: &Saved, mesh: &Mesh, kind: &str, settings: &Settings) -> Result<Transfer, String> {
    saved.fits(mesh, settings.bands).map_err(|e| e.to_string())?;
    let (t, wide) = (&saved.transfer, settings.wide());
    if saved.sites != kind || kind == "vertices" && t.len() != mesh.positions.len() {
        return Err(format!("the transfer given is that of {}, not of {kind}", saved.sites));
    }
    if t.wide < wide {
        let why = format!("the transfer given has {} bands of visibility, of {wide} that are needed", t.wide);
        return Err(format!("{why}: transfer with `matrices` writes them"));
    }
    if t.bounces != settings.bounces {
        let has = format!("the transfer given has {} scattering events", t.bounces);
        if settings.matrices {
            let why = "this technique lets the reflectance change, which reflections between surfaces hold";
            return Err(format!("{has}, and {why}: transfer without `bounces`, or prt_diffuse"));
        }
        return Err(format!("{has}, not the {} of the parameter bounces", settings.bounces));
    }
    let slots = 0..=mesh.materials.iter().copied().max().unwrap_or(0) as usize;
    let at = |all: &[[f64; 3]], slot: usize| all.get(slot).or(all.last()).copied().unwrap_or_default();
    let differs = |slot: usize| {
        let [a, b] = [&saved.albedo, &settings.albedo].map(|all| at(all, slot));
        a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-6)
    };
    if let Some(slot) = slots.into_iter().find(|s| t.bounces > 1 && differs(*s)) {
        let [a, b] = [&saved.albedo, &settings.albedo].map(|all| at(all, slot));
        return Err(format!("the transfer given has reflections of albedo {a:?} in slot {slot}, not {b:?}"));
    }
    let first = |all: &[f32], of: usize, n: usize| -> Vec<f32> {
        all.chunks_exact(of * of).flat_map(|v| &v[..n * n]).copied().collect()
    };
    Ok(Transfer {
        bands: settings.bands,
        wide,
        t: first(&t.t, t.bands, settings.bands),
        direct: t.direct.as_ref().map(|d| first(d, t.bands, settings.bands)),
        v: first(&t.v, t.wide, wide),
        ..t.clone()
    })
}

/// The interreflected part of the transfer vectors, that is all less direct light: empty where there is none,
/// else one vector a site, or one for each channel.
pub fn reflected(t: &Transfer) -> PerSite {
    let n = t.bands * t.bands;
    let Some(direct) = &t.direct else { return PerSite::default() };
    let site = |(all, direct): (&[f32], &[f32])| -> Vec<f32> {
        all.iter().enumerate().map(|(i, x)| x - direct[i % n]).collect()
    };
    PerSite {
        stride: t.channels * n,
        data: t.t.chunks(t.channels * n).zip(direct.chunks(n)).flat_map(site).collect(),
    }
}

/// Interpolates `value` over the sites around point `i`; 0 where the point has no sites, or faces away.
#[inline(always)]
pub fn gather(q: &Points<'_>, i: usize, value: impl Fn(u32) -> [f32; 3]) -> [f32; 3] {
    let facing = (0..3).map(|k| q.n[k][i] * q.wo[k][i]).sum::<f32>();
    if facing <= 0.0
        || q.site.index.iter().any(|s| s.is_empty())
        || q.site.weight.iter().any(|s| s.is_empty())
    {
        return [0.0; 3];
    }
    let [u, v] = q.site.weight.map(|w| w[i]);
    let mut out = [0.0; 3];
    for (s, w) in q.site.index.iter().zip([1.0 - u - v, u, v]) {
        let x = value(s[i]);
        (0..3).for_each(|c| out[c] += w * x[c]);
    }
    out
}
