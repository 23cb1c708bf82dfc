//! Explicit elevation slices: k_lq(θ_o) at chosen elevations.

use super::geometry::{Centre, Slice};
use super::kernel::{self, Kernel, Request};
use super::theta::Polar;
use super::{CentralError, MAX_ORDER, choose};
use crate::Brdf;
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_parallel::prelude::*;
use steradian_sphere::sh::zonal;

/// Target RMS error of the quadrature of f_cos, relative to its norm; mostly the error reached is 1e-8 or
/// less.
const TOLERANCE: f64 = 1e-6;
/// Error of the integrals, relative to the error that truncation of orders may cause. Slices of a measured
/// file (`rgl:`, a kink per cell) took 7.3 s; at 0.03 they took 12.3, and the certificate differed in the
/// fifth digit.
const QUADRATURE: f64 = 0.1;
/// Step in elevations at which the required orders are determined.
const EVERY: usize = 8;

/// k_lq at a list of elevations: B(C, wo) = Σ_q a_q(φ_o) Σ_l k_l|q| L'_lq, with a_q = (1, √2 cos qφ, √2 sin
/// |q|φ).
#[derive(Debug, Clone)]
pub struct Slices {
    /// The centre of the request; slices may lean away from it.
    pub centre: Centre,
    /// F: the highest l.
    pub order: usize,
    /// Q: the highest q, at most F; 0 about the tangent.
    pub azimuth: usize,
    /// The elevations.
    pub slices: Vec<Slice>,
    /// `[slice][q][channel][l]`, zero for l < q.
    pub k: Vec<f64>,
    /// ∫ f_cos² dwi of each slice, sr⁻¹: the total that [`Slices::captured`] tends to.
    pub energy: Vec<[f64; 3]>,
    /// ∫ f_cos (n·wi)₊ dwi of each slice.
    pub cosine: Vec<[f64; 3]>,
    /// Estimated RMS error of the quadrature relative to f_cos, of the worst slice.
    pub accuracy: f64,
}

impl Slices {
    /// Integrates f_cos at each slice up to orders `f` and `q` (clamped to `f`, and to 0 about the tangent).
    /// Panels follow lobes and the horizon, and are halved until the estimated error is below 1e-6 of f_cos,
    /// or a limit is reached (tabulated data has a kink per cell); [`Slices::accuracy`] is the error
    /// estimate.
    pub fn new(
        brdf: &dyn Brdf,
        centre: Centre,
        slices: Vec<Slice>,
        f: usize,
        q: usize,
        task: &Task,
    ) -> Result<Self, CentralError> {
        Self::to(brdf, centre, slices, [f, q], TOLERANCE, task)
    }

    /// [`Slices::new`] to another RMS error of f_cos, relative to its norm, than 1e-6: measurements, whose
    /// tables have a kink per cell, take minutes to that.
    pub fn to(
        brdf: &dyn Brdf,
        centre: Centre,
        slices: Vec<Slice>,
        [f, q]: [usize; 2],
        tolerance: f64,
        task: &Task,
    ) -> Result<Self, CentralError> {
        slices.iter().try_for_each(|s| s.check(centre))?;
        let setup = Setup::new(brdf, centre, (f, q), tolerance.max(TOLERANCE))?;
        task.begin("BRDF slices", slices.len() as u64);
        let kernels = setup.kernels(&slices, task);
        task.end();
        let (mut k, mut energy, mut cosine, mut accuracy) = (Vec::new(), Vec::new(), Vec::new(), 0.0f64);
        for kernel in kernels? {
            k.extend(kernel.k);
            energy.push(kernel.energy);
            cosine.push(kernel.cosine);
            accuracy = accuracy.max(kernel.accuracy);
        }
        let azimuth = setup.request.q;
        Ok(Self { centre, order: f, azimuth, slices, k, energy, cosine, accuracy })
    }

    /// `count` slices about `centre`, evenly spaced in θ_o over what can be seen, both ends included.
    pub fn even(
        brdf: &dyn Brdf,
        centre: Centre,
        count: usize,
        f: usize,
        q: usize,
        task: &Task,
    ) -> Result<Self, CentralError> {
        let last = count.saturating_sub(1).max(1) as f64;
        let slices = (0..count).map(|i| centre.slice(centre.reach() * i as f64 / last)).collect();
        Self::new(brdf, centre, slices, f, q, task)
    }

    /// Slices up to the first of `orders` (F and Q, ascending) that hold each elevation up to `views` radians
    /// but for `share` of its energy, else up to the last. Orders that every eighth elevation finds too low
    /// are computed at no others.
    pub fn sufficient(
        brdf: &dyn Brdf,
        centre: Centre,
        elevations: &[Slice],
        orders: &[[usize; 2]],
        views: f64,
        share: f64,
        task: &Task,
    ) -> Result<Self, CentralError> {
        let tolerance = QUADRATURE * share.sqrt();
        let made =
            |of: &[Slice], orders: [usize; 2]| Self::to(brdf, centre, of.to_vec(), orders, tolerance, task);
        let raised = |s: &Self, now: [usize; 2], next: [usize; 2]| {
            let more = s.missing(views, share);
            std::array::from_fn(|i| if more[i] { next[i] } else { now[i] })
        };
        let few: Vec<Slice> = elevations.iter().step_by(EVERY).copied().collect();
        let (mut now, mut higher) = (orders[0], &orders[1..]);
        while let [next, others @ ..] = higher {
            let raised = raised(&made(&few, now)?, now, *next);
            if raised == now {
                break;
            }
            (now, higher) = (raised, others);
        }
        let mut slices = made(elevations, now)?;
        for next in higher {
            let raised = raised(&slices, now, *next);
            if raised != now {
                now = raised;
                slices = made(elevations, now)?;
            }
        }
        Ok(slices)
    }

    /// Does F, does Q miss more than `share` of the energy of any elevation up to `views`?
    fn missing(&self, views: f64, share: f64) -> [bool; 2] {
        let mut more = [false; 2];
        for (i, _) in self.slices.iter().enumerate().filter(|(_, s)| s.theta_v.abs() < views) {
            let captured = self.captured(i, self.order, self.azimuth);
            for c in 0..3 {
                let rest = self.energy[i][c] - captured[c];
                let beyond = self.beyond_azimuth(i, c);
                let most = share * self.energy[i][c];
                more[0] |= rest - beyond > most;
                more[1] |= beyond > most;
            }
        }
        more
    }

    /// The energy of a slice beyond Q, as the rows of Q/2 and of Q say: e_q ∝ q^−p gives e_Q Q/(p − 1), which
    /// holds for edges (p = 2) as for smooth lobes.
    pub fn beyond_azimuth(&self, slice: usize, channel: usize) -> f64 {
        if self.azimuth < 2 {
            return 0.0;
        }
        let energy = |q: usize| 2.0 * self.row(slice, q)[channel].iter().map(|k| k * k).sum::<f64>();
        let (half, last) = (energy(self.azimuth / 2), energy(self.azimuth));
        let power = (half / last.max(f64::MIN_POSITIVE)).log2().clamp(1.5, 16.0);
        last * self.azimuth as f64 / (power - 1.0)
    }

    /// k_lq over l = 0 … F of one slice, per channel; the rows of q also serve −q. Zero below l = q.
    pub fn row(&self, slice: usize, q: usize) -> [&[f64]; 3] {
        let bands = self.order + 1;
        let at = (slice * (self.azimuth + 1) + q) * 3 * bands;
        std::array::from_fn(|c| &self.k[at + c * bands..at + (c + 1) * bands])
    }

    /// Σ k² over l ≤ `f` and |q| ≤ `q` of one slice: its energy up to there.
    pub fn captured(&self, slice: usize, f: usize, q: usize) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for q in 0..=q.min(self.azimuth) {
            let both = if q == 0 { 1.0 } else { 2.0 };
            for (sum, row) in sum.iter_mut().zip(self.row(slice, q)) {
                *sum += both * row[..=f.min(self.order)].iter().map(|k| k * k).sum::<f64>();
            }
        }
        sum
    }

    /// The slices of f_cos − albedo/π (n·wi)₊, for techniques that represent the diffuse part separately by a
    /// map about n. The clamped cosine about n has k_lq = A_l/π f_lq(γ), A_l as in Ramamoorthi &
    /// Hanrahan 2001.
    pub fn without_diffuse(&self, albedo: [f64; 3]) -> Self {
        let mut rest = self.clone();
        let bands = self.order + 1;
        let each = (self.azimuth + 1) * 3 * bands;
        for ((slice, k), i) in self.slices.iter().zip(rest.k.chunks_exact_mut(each)).zip(0..) {
            for (d, k) in self.diffuse(slice).iter().zip(k.chunks_exact_mut(3 * bands)) {
                for (a, k) in albedo.iter().zip(k.chunks_exact_mut(bands)) {
                    k.iter_mut().zip(d).for_each(|(k, d)| *k -= a * d);
                }
            }
            for c in 0..3 {
                // ∫ (n·wi)₊² dwi = 2π/3.
                let (a, x) = (albedo[c], self.cosine[i][c]);
                rest.energy[i][c] += a * (2.0 / (3.0 * PI) * a - 2.0 / PI * x);
                rest.cosine[i][c] -= 2.0 / 3.0 * a;
            }
        }
        rest
    }

    /// `[q][l]` of (n·wi)₊/π about a slice's centre.
    pub(super) fn diffuse(&self, slice: &Slice) -> Vec<Vec<f64>> {
        let cosine = zonal::cosine(self.order);
        let mut rows = Polar::new(self.order, self.azimuth).rows(slice.lean().abs());
        for (q, row) in rows.iter_mut().enumerate() {
            // A centre that leans towards the viewer has n at azimuth π.
            let side = if slice.gamma < 0.0 && q % 2 == 1 { -1.0 } else { 1.0 };
            row.iter_mut().zip(&cosine).for_each(|(f, a)| *f *= side * a / PI);
        }
        rows
    }
}

/// Common inputs of all expansions of one reflectance.
pub(super) struct Setup<'a> {
    brdf: &'a dyn Brdf,
    pub request: Request,
    polar: Polar,
}

impl<'a> Setup<'a> {
    pub fn new(
        brdf: &'a dyn Brdf,
        centre: Centre,
        (f, q): (usize, usize),
        tolerance: f64,
    ) -> Result<Self, CentralError> {
        if f.max(q) > MAX_ORDER {
            return Err(CentralError::Order { order: f.max(q) });
        }
        choose::check(brdf, centre)?;
        let q = if centre == Centre::Tangent { 0 } else { q.min(f) };
        let two_sided = centre != Centre::Tangent && choose::has_two_sides(brdf);
        let request = Request { f, q, tolerance, two_sided };
        Ok(Self { brdf, request, polar: Polar::new(f, q) })
    }

    /// The slices, on all cores; the bits do not depend on their number.
    pub fn kernels(&self, slices: &[Slice], task: &Task) -> Result<Vec<Kernel>, CentralError> {
        let one = |slice: &Slice| {
            let kernel = kernel::slice(self.brdf, slice, &self.request, &self.polar, task)?;
            task.advance(1);
            if kernel.energy.iter().chain(&kernel.cosine).all(|e| e.is_finite()) {
                return Ok(kernel);
            }
            Err(CentralError::NotFinite { spec: self.brdf.spec(), theta_v: slice.theta_v })
        };
        slices.par_iter().map(one).collect()
    }
}
