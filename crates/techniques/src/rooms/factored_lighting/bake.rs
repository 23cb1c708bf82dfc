//! The factors: gauge, halves, certificate.

use super::FactoredLighting;
use super::fit::{Fit, LINE, Layout, PER_UNKNOWN, Samples, fit};
use super::maps::CubeGrid;
use super::params::Params;
use crate::certify::Report;
use crate::shared::light::distant::DistantLight;
use crate::shared::material::views::Seen;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Material, Part, Technique};
use half::f16;
use steradian_base::Task;
use steradian_formats::{Tensor, TensorData};
use steradian_numerics::lsqr::Rgb;
use steradian_prefilter::EdgeCube;

/// Tolerance of the samples where the user gives none.
const TOLERANCE: f64 = 0.01;
/// Highest band of light and reflectance; maps of these sizes cannot represent higher ones.
pub(super) const ORDER: usize = 48;

/// The slices of a material, from which the image of any view follows.
pub(super) fn seen(m: &Material, task: &Task) -> Result<Seen, BakeError> {
    let tolerance = task.tolerance().unwrap_or(TOLERANCE).clamp(1e-3, 0.1);
    Ok(Seen::bake(m, false, tolerance, ORDER, task)?)
}

/// The logarithms of the factors, in steps of halves.
#[derive(Debug, Clone, PartialEq)]
pub struct Factors {
    /// The factors over n, r and wo; one that is not used is a cube of one interval.
    pub cubes: [EdgeCube; 3],
    /// Flags of the factors used: over n, r, wo and n·wo.
    pub used: [bool; 4],
    /// The factor over n·wo, at values of √(n·wo) equally spaced from 0 to 1.
    pub line: Vec<[f32; 4]>,
    /// L_o where all factors are 1, W sr⁻¹ m⁻².
    pub scale: [f32; 3],
}

fn half(x: f64) -> f32 {
    f16::from_f64(x.clamp(-60.0, 60.0)).to_f32()
}

/// Moves the mean of each factor's logarithms to the scale, since only the sum of all means is determined.
fn gauge(layout: &Layout, x: &mut [Rgb], scale: &mut Rgb) {
    for range in (0..4).map(|k| layout.range(k)).filter(|r| !r.is_empty()) {
        let n = range.len() as f64;
        for c in 0..3 {
            let mean = x[range.clone()].iter().map(|x| x[c]).sum::<f64>() / n;
            x[range.clone()].iter_mut().for_each(|x| x[c] -= mean);
            scale[c] *= mean.exp();
        }
    }
}

impl Factors {
    fn new(layout: &Layout, mut fit: Fit) -> Self {
        gauge(layout, &mut fit.x, &mut fit.scale);
        let texel = |x: Rgb| {
            let [r, g, b] = x.map(half);
            [r, g, b, 1.0]
        };
        let one = || EdgeCube::from_fn(1, |_| [0.0; 3]);
        let cube = |k: usize, grid: &Option<CubeGrid>| {
            let Some(g) = grid else { return one() };
            let start = layout.range(k).start;
            let texels: Vec<_> = (0..g.texels()).map(|t| texel(fit.x[start + g.unknown(t)])).collect();
            let size = ((texels.len() / 6) as f64).sqrt().round() as usize - 1;
            EdgeCube::from_texels(size, texels).unwrap_or_else(one)
        };
        let line: Vec<_> = fit.x[layout.range(3)].iter().map(|x| texel(*x)).collect();
        Self {
            cubes: [cube(0, &layout.n), cube(1, &layout.r), cube(2, &layout.wo)],
            used: [layout.n.is_some(), layout.r.is_some(), layout.wo.is_some(), layout.line],
            line: if line.is_empty() { vec![[0.0, 0.0, 0.0, 1.0]; 2] } else { line },
            scale: fit.scale.map(|s| if s.is_finite() { s as f32 } else { 0.0 }),
        }
    }
}

/// Joins light and reflectance.
pub fn link(light: &DistantLight, m: &Seen, p: &Params, task: &Task) -> Result<(Factors, Report), BakeError> {
    let order = m.slices.order();
    let size = p.size.unwrap_or_else(|| (order / 2).next_multiple_of(8).max(16));
    let unknowns = 12 * (size + 1) * (size + 1);
    let (slug, allowed) = (FactoredLighting::CARD.slug, task.max_memory());
    // Samples, rows of the matrix twice, vectors of the solution.
    let need = (unknowns * (PER_UNKNOWN * (72 + 28 * 8 + 96) + 240)) as u64;
    if need > allowed {
        return Err(BakeError::Memory { slug, need, allowed });
    }
    let layout = Layout::new(p, size);
    let samples = Samples::new(&m.slices, &light.source().coefficients(order), layout.count(), task)?;
    let fit = fit(&layout, &samples, p.weight, task)?;
    let details = [
        ("residual", fit.residual),
        ("residual of the logarithm", fit.log_residual),
        ("samples", fit.samples as f64),
        ("steps", fit.steps as f64),
        ("order", order as f64),
        ("blur", m.slices.blur),
        ("size", size as f64),
    ];
    let factors = Factors::new(&layout, fit);
    Ok((factors, details.into_iter().fold(Report::default(), |r, (name, value)| r.detail(name, value))))
}

const CUBES: [&str; 3] = ["normal", "mirror", "viewer"];

impl Part for Factors {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let halves =
            |v: &[[f32; 4]]| v.iter().flat_map(|t| [t[0], t[1], t[2]].map(f16::from_f32)).collect::<Vec<_>>();
        for (cube, name) in self.cubes.iter().zip(CUBES) {
            let shape = vec![6, cube.size() + 1, cube.size() + 1, 3];
            let data = TensorData::F16(halves(cube.texels()));
            to.tensors.insert(format!("{prefix}.{name}"), Tensor { shape, data });
        }
        let data = TensorData::F16(halves(&self.line));
        to.tensors.insert(format!("{prefix}.elevation"), Tensor { shape: vec![self.line.len(), 3], data });
        let used = self.used.map(|u| if u { 1.0 } else { 0.0 });
        put_f32(to, format!("{prefix}.scale"), vec![7], [&self.scale[..], &used].concat());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let cube = |name| crate::shared::tables::load_cube(from, &format!("{prefix}.{name}"));
        let [n, r, wo] = CUBES.map(cube);
        let name = format!("{prefix}.elevation");
        let (shape, v) = get_f32(from, &name, 2)?;
        if shape[0] < 2 || shape[0] > 4 * LINE || shape[1] != 3 {
            return Err(PartError::Unexpected(name));
        }
        let line = v.as_chunks::<3>().0.iter().map(|t| [t[0], t[1], t[2], 1.0]).collect();
        let name = format!("{prefix}.scale");
        let (_, v) = get_f32(from, &name, 1)?;
        let [x, y, z, a, b, c, d] = v[..] else { return Err(PartError::Unexpected(name)) };
        Ok(Self { cubes: [n?, r?, wo?], used: [a, b, c, d].map(|u| u == 1.0), line, scale: [x, y, z] })
    }

    fn bytes(&self) -> usize {
        let cubes: usize = self.cubes.iter().map(crate::shared::tables::cube_bytes).sum();
        cubes + 16 * self.line.len()
    }
}
