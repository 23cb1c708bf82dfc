//! The maps of the lobes.

use super::LobeMaps;
use super::material::Fitted;
use super::params::Params;
use crate::certify::Report;
use crate::shared::light::distant::DistantLight;
use crate::shared::tables::chain::Chain;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use std::cell::OnceCell;
use steradian_base::{Cancelled, Task};
use steradian_brdf::fit::radial::{ByCosine, RadialFit, RadialLobe, Rings};
use steradian_prefilter::{EdgeCube, Zonal, edge_cube, filter};

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 5e-3;
/// Intervals per cube edge where the user gives none.
const LARGEST: usize = 128;
/// Rows of an atlas: the largest texture that every GPU takes.
const ROWS: usize = 8192;
/// Directions, over all maps, whose integrals are summed directly.
const DIRECT: usize = 60_000;

/// The maps of all lobes one after another, and the lookups of each view.
#[derive(Debug, Clone, PartialEq)]
pub struct LobeChains {
    /// The levels of the first lobe, then of the second, and so on.
    pub chain: Chain,
    /// A per channel and b of each view, lobe after lobe.
    pub views: Vec<[f32; 4]>,
    /// Lobes.
    pub lobes: usize,
}

impl LobeChains {
    /// Levels of each lobe.
    pub fn levels(&self) -> usize {
        self.chain.levels().len() / self.lobes
    }
}

/// A profile as a kernel.
struct Profile {
    curve: ByCosine,
    width: f64,
    support: f64,
    signed: bool,
}

impl Profile {
    fn new(rings: &Rings, values: &[f64]) -> Self {
        let curve = rings.curve(values);
        Self {
            width: curve.width(),
            support: curve.support(),
            curve: ByCosine::new(&curve),
            signed: values.iter().any(|v| *v < 0.0),
        }
    }
}

impl Zonal for Profile {
    fn value(&self, x: f64) -> f64 {
        self.curve.at(x)
    }

    fn width(&self) -> f64 {
        self.width
    }

    fn support(&self) -> f64 {
        self.support
    }

    fn signed(&self) -> bool {
        self.signed
    }
}

/// Do two profiles differ by rounding only?
fn same(a: &[f64], b: &[f64]) -> bool {
    let peak = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * peak)
}

/// Figures of the filtering, for the report.
#[derive(Default)]
struct Found {
    clipped: f64,
    order: usize,
    size: usize,
}

struct Filtering<'a> {
    light: &'a DistantLight,
    /// The unfiltered light, for profiles narrower than its texels.
    mirror: OnceCell<EdgeCube>,
    largest: usize,
    size: filter::Size,
    /// Most directions of a map whose integrals are summed directly.
    direct: usize,
    tolerance: f64,
    task: &'a Task,
}

impl Filtering<'_> {
    fn filter(&self, k: &Profile, size: filter::Size) -> Result<filter::Filtered, Cancelled> {
        let size = (size, self.direct);
        filter::filter_within(self.light.source(), &self.light.tree, k, size, self.tolerance, self.task)
    }

    /// Texel means of the light, suns spread over texels.
    fn mirror(&self) -> &EdgeCube {
        self.mirror.get_or_init(|| self.light.mirror(self.largest))
    }

    /// Is the profile of this channel narrower than the texels of the largest map, so that the unfiltered
    /// light serves in its place?
    fn is_mirror(&self, rings: &Rings, profile: &[f64]) -> bool {
        rings.radius(profile, 0.9) < 0.5 * edge_cube::spacing(self.largest)
    }

    /// The map of a profile per channel; channels of the same profile share a filtering.
    fn map(&self, rings: &Rings, shape: &[Vec<f64>; 3], found: &mut Found) -> Result<EdgeCube, Cancelled> {
        let dark = |c: usize| shape[c].iter().all(|v| *v == 0.0);
        if (0..3).all(|c| self.is_mirror(rings, &shape[c])) && (0..3).any(|c| !dark(c)) {
            found.size = found.size.max(self.largest);
            let k = shape.each_ref().map(|s| rings.integral(s) as f32);
            let scaled = |t: &[f32; 4]| [t[0] * k[0], t[1] * k[1], t[2] * k[2], 1.0];
            let texels = self.mirror().texels().iter().map(scaled).collect();
            return Ok(EdgeCube::from_texels(self.largest, texels).unwrap_or_default());
        }
        let mut made: Vec<(usize, EdgeCube)> = Vec::new();
        let mut source = [None; 3];
        for c in (0..3).filter(|c| !dark(*c)) {
            let shared = made.iter().position(|(d, _)| same(&shape[*d], &shape[c]));
            source[c] = Some(shared.unwrap_or(made.len()));
            if shared.is_some() {
                continue;
            }
            let profile = Profile::new(rings, &shape[c]);
            let size = match made.first() {
                Some((_, cube)) => filter::Size::Fixed(cube.size()),
                None => self.size,
            };
            let f = self.filter(&profile, size)?;
            found.clipped = found.clipped.max(f.clipped);
            if let filter::CubeMethod::Frequency { order } = f.way {
                found.order = found.order.max(order);
            }
            found.size = found.size.max(f.cube.size());
            made.push((c, f.cube));
        }
        let Some((_, first)) = made.first() else { return Ok(EdgeCube::from_fn(1, |_| [0.0; 3])) };
        let at = |c: usize, i: usize| source[c].map_or(0.0, |s| made[s].1.texels()[i][c]);
        let texels = (0..first.texels().len()).map(|i| [at(0, i), at(1, i), at(2, i), 1.0]).collect();
        Ok(EdgeCube::from_texels(first.size(), texels).unwrap_or_default())
    }
}

/// Rows of the table per interval between the fit's views.
const FINER: usize = 4;

/// A per channel and b = sin γ/sin θ_v, cubic between the views of the fit.
fn views(fit: &RadialFit, lobe: &RadialLobe) -> Vec<[f32; 4]> {
    let row = |k: usize| {
        // b's limit at the normal view is that of its neighbour.
        let near = k.max(1);
        let [red, green, blue] = lobe.amplitude[k];
        [red, green, blue, lobe.gamma[near].sin() / fit.views.theta[near].sin()]
    };
    let rows: Vec<[f64; 4]> = (0..fit.views.len()).map(row).collect();
    let last = rows.len() - 1;
    let at = |i: usize| {
        let (k, t) = ((i / FINER).min(last - 1), (i as f64 / FINER as f64));
        let t = t - k as f64;
        let (p, q) = (rows[k], rows[k + 1]);
        std::array::from_fn(|c| {
            // Catmull–Rom; at the ends the slope is the secant's.
            let before = if k > 0 { 0.5 * (q[c] - rows[k - 1][c]) } else { q[c] - p[c] };
            let after = if k + 2 <= last { 0.5 * (rows[k + 2][c] - p[c]) } else { q[c] - p[c] };
            let (u, v) = (1.0 - t, t);
            let value = u * u * (1.0 + 2.0 * v) * p[c] + v * v * (1.0 + 2.0 * u) * q[c];
            (value + u * u * v * before - u * v * v * after) as f32
        })
    };
    (0..=last * FINER).map(at).collect()
}

/// Filters the light by every profile of every lobe.
pub fn link(
    light: &DistantLight,
    m: &Fitted,
    p: &Params,
    task: &Task,
) -> Result<(LobeChains, Report), BakeError> {
    let (slug, fit) = (LobeMaps::CARD.slug, &m.fit);
    let levels: usize = fit.lobes.iter().map(|l| l.shapes.len()).sum();
    let rows = |size: usize| levels.saturating_sub(1).max(1) * (size + 1);
    let fitting = |size: usize| (0..12).map(|k| size >> k).find(|s| rows(*s) <= ROWS).unwrap_or(1).max(1);
    let largest = fitting(p.size.unwrap_or(LARGEST));
    let need = (levels * 6 * 16 * (largest + 1) * (largest + 1)) as u64;
    if need > task.max_memory() {
        return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
    }
    let size = p.size.map_or(filter::Size::UpTo(largest), |_| filter::Size::Fixed(largest));
    let direct = p.size.map_or(DIRECT / levels.max(1), |_| usize::MAX);
    let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
    let filtering = Filtering { light, mirror: OnceCell::new(), largest, size, direct, tolerance, task };
    let mut found = Found::default();
    task.begin("prefilter", levels as u64);
    let mut cubes = Vec::with_capacity(levels);
    for shape in fit.lobes.iter().flat_map(|l| &l.shapes) {
        cubes.push(filtering.map(&fit.rings, shape, &mut found)?);
        task.advance(1);
    }
    task.end();
    let chain = Chain::new(cubes).ok_or_else(|| BakeError::Light { slug, why: "no maps".into() })?;
    let views = fit.lobes.iter().flat_map(|l| views(fit, l)).collect();
    let maps = LobeChains { chain, views, lobes: fit.lobes.len() };
    let report = Report::default()
        .detail("maps", levels as f64)
        .detail("order", found.order as f64)
        .detail("size", found.size as f64)
        .detail("energy of f without azimuthal symmetry", fit.residual)
        .detail("clipped", found.clipped);
    Ok((maps, report))
}

impl Part for LobeChains {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.chain.save(to, &format!("{prefix}.maps"));
        let data = self.views.iter().flatten().copied().collect();
        let shape = vec![self.lobes, self.views.len() / self.lobes, 4];
        put_f32(to, format!("{prefix}.views"), shape, data);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let chain = Chain::load(from, &format!("{prefix}.maps"))?;
        let name = format!("{prefix}.views");
        let (shape, v) = get_f32(from, &name, 3)?;
        let lobes = shape[0];
        if lobes == 0 || shape[1] < 2 || shape[2] != 4 || chain.levels().len() % lobes != 0 {
            return Err(PartError::Unexpected(name));
        }
        let views = v.chunks_exact(4).map(|v| [v[0], v[1], v[2], v[3]]).collect();
        Ok(Self { chain, views, lobes })
    }

    fn bytes(&self) -> usize {
        self.chain.bytes() + 16 * self.views.len()
    }
}
