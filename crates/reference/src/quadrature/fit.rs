//! The Legendre interpolant of a function on a rectangle and how far it is to be trusted.

use super::legendre::{CHECKS, N, RULE, Row, Wide, WideSquare, polynomials, wide};
use steradian_simd::{Arch, Kernel, run};

/// A function sampled on the Gauss grid, `[channel][x][y]`, at the check points, and where the light is
/// brightest.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    /// At Gauss nodes.
    pub grid: [WideSquare; 3],
    /// At the check points, `[point][channel]`.
    pub checks: [[f64; 3]; CHECKS.len()],
    /// An additional point (x, y) with its value.
    pub peak: Option<([f64; 2], [f64; 3])>,
}

impl Samples {
    /// All zero.
    pub const ZERO: Self = Self { grid: [[[0.0; 8]; N]; 3], checks: [[0.0; 3]; CHECKS.len()], peak: None };
}

/// Legendre coefficients with error estimates, per channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    /// `[i][j]`.
    pub c: WideSquare,
    /// Estimate of max |g − interpolant|.
    pub loose: f64,
    /// Estimate of the error of the mean of g by Gauss–Legendre. It misses degrees 12 and up only, but of a
    /// crease (ρ ≈ 0.6) it gains no more than ρ² on the interpolant, and creases set the law.
    pub tight: f64,
    /// The bound where g's derivatives may be unbounded at the border (maps onto clipped pieces).
    pub tight_at_border: f64,
    /// Shares of φ and θ in `loose`.
    pub share: [f64; 2],
}

/// Decay of coefficients towards the highest degrees, from the sums of |c| per degree along one axis.
///
/// τ = max of the last two, s = max of the two before: ratio per degree ρ = √(τ/s). The interpolant misses
/// degrees 6 and up, about τ ρ^1.5/(1 − ρ) at the geometric rate. The estimate is τ·ρ; smooth functions,
/// whose coefficients fall faster than geometrically, stay below it.
#[inline(always)]
fn decay(e: &[f64]) -> (f64, f64) {
    let last = e[N - 1].max(e[N - 2]);
    let before = e[N - 3].max(e[N - 4]);
    let rho = if last < before { (last / before).sqrt() } else { 1.0 };
    (last, rho)
}

/// Fits each channel.
pub(super) fn fit(s: &Samples) -> [Fit; 3] {
    run(Fits(s))
}

/// Fits with the same operations in the same order on every instruction set, so that the bits are equal.
struct Fits<'a>(&'a Samples);

impl Kernel for Fits<'_> {
    type Output = [Fit; 3];

    #[inline(always)]
    fn run<A: Arch>(self) -> [Fit; 3] {
        fit_channels(self.0)
    }
}

#[inline(always)]
fn fit_channels(s: &Samples) -> [Fit; 3] {
    let first = fit_channel(s, 0);
    let grey = s.grid[1] == s.grid[0]
        && s.grid[2] == s.grid[0]
        && s.checks.iter().all(|c| c[0] == c[1] && c[0] == c[2])
        && s.peak.is_none_or(|(_, c)| c[0] == c[1] && c[0] == c[2]);
    if grey { [first; 3] } else { [first, fit_channel(s, 1), fit_channel(s, 2)] }
}

#[inline(always)]
fn fit_channel(s: &Samples, channel: usize) -> Fit {
    let c = coefficients(&s.grid[channel]);
    let (mut ex, mut ey) = ([0.0; N], [0.0; 8]);
    for i in 0..N {
        for j in 0..8 {
            ey[j] += c[i][j].abs();
        }
        ex[i] = c[i][..N].iter().map(|v| v.abs()).sum();
    }
    let ((tx, rx), (ty, ry)) = (decay(&ex), decay(&ey[..N]));
    let share = [tx * rx, ty * ry];
    let decayed = share[0] + share[1];
    let missed = 1.5 * discrepancy(&c, s, channel);
    // Where the checks contradict the decay of the coefficients, the decay is not used.
    let rho = if missed > 4.0 * decayed { 1.0 } else { rx.max(ry) };
    let loose = decayed.max(missed);
    // The sum of a geometric tail; near ρ = 1 nothing is resolved, and anything may lie beyond the last node.
    let tail = loose * rho / (1.0 - rho.min(0.9));
    Fit { c, loose, tight: tail * rho, tight_at_border: tail, share }
}

/// Rows of all degrees, so that their numbers are computed side by side.
#[inline(always)]
fn coefficients(g: &WideSquare) -> WideSquare {
    let (t, of_node) = (&RULE.to_degree, &RULE.of_node);
    let mut c = [[0.0; 8]; N];
    for i in 0..N {
        let mut half = [0.0; 8];
        for q in 0..N {
            for b in 0..8 {
                half[b] += t[i][q] * g[q][b];
            }
        }
        for b in 0..N {
            for j in 0..8 {
                c[i][j] += of_node[b][j] * half[b];
            }
        }
    }
    c
}

/// Largest |value − interpolant| of each channel, over points (x, y) in [−1, 1]².
pub(super) fn largest_difference(fits: &[Fit; 3], points: &[([f64; 2], [f64; 3])]) -> [f64; 3] {
    run(Differences { fits, points })
}

struct Differences<'a> {
    fits: &'a [Fit; 3],
    points: &'a [([f64; 2], [f64; 3])],
}

impl Kernel for Differences<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn run<A: Arch>(self) -> [f64; 3] {
        let mut worst = [0.0_f64; 3];
        for ([x, y], value) in self.points {
            let (px, py) = (polynomials(*x), wide(&polynomials(*y)));
            for c in 0..3 {
                worst[c] = worst[c].max((value[c] - blend(&self.fits[c].c, &px, &py)).abs());
            }
        }
        worst
    }
}

#[inline(always)]
fn blend(c: &WideSquare, px: &Row, py: &Wide) -> f64 {
    let mut row = [0.0; 8];
    for i in 0..N {
        for j in 0..8 {
            row[j] += px[i] * c[i][j];
        }
    }
    (0..N).map(|j| row[j] * py[j]).sum()
}

/// Largest |g − interpolant| over the check points.
#[inline(always)]
fn discrepancy(c: &WideSquare, s: &Samples, channel: usize) -> f64 {
    let mut worst: f64 = 0.0;
    // All check points side by side.
    let [of_x, of_y] = &RULE.checks;
    let mut p = [0.0; 8];
    for i in 0..N {
        let mut row = [0.0; 8];
        for j in 0..N {
            for k in 0..8 {
                row[k] += c[i][j] * of_y[j][k];
            }
        }
        for k in 0..8 {
            p[k] += of_x[i][k] * row[k];
        }
    }
    for (check, p) in s.checks.iter().zip(p) {
        worst = worst.max((check[channel] - p).abs());
    }
    if let Some(([x, y], g)) = s.peak {
        let p = blend(c, &polynomials(x), &wide(&polynomials(y)));
        worst = worst.max((g[channel] - p).abs());
    }
    worst
}
