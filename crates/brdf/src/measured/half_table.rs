//! An isotropic grid in half and difference angles, looked up at many directions to the light.
//!
//! With v = wi + wo and e = wi − wo, which stand at right angles: tan θ_h = |(v_x, v_y)|/v_z, tan θ_d =
//! |e|/|v|, and φ_d is the azimuth of e about v from the direction in which θ_h grows. No vector is
//! normalised and no angle taken by its cosine, so small ones are accurate; and f is reciprocal to the bit,
//! since e changes its sign only.

use glam::DVec3;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI};
use steradian_simd::{Arch, Kernel};

/// f of each of `wi` and `wo`, above the horizon. Eight directions are placed at a time; the bits are those
/// of one alone.
pub(super) struct Lookup<'a> {
    /// √θ_h, θ_d and φ_d, the last fastest.
    pub cells: &'a [[f32; 3]],
    /// Cells along each.
    pub sizes: [usize; 3],
    pub wi: &'a [DVec3],
    pub wo: DVec3,
    pub out: &'a mut [[f64; 3]],
}

impl Kernel for Lookup<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Self { cells, sizes, wi, wo, out } = self;
        let (eights, rest) = wi.as_chunks::<8>();
        let (out, last) = out[..wi.len()].as_chunks_mut::<8>();
        for (wi, out) in eights.iter().zip(out) {
            let places = places(wi, wo, sizes);
            for (k, f) in out.iter_mut().enumerate() {
                *f = interpolated(cells, sizes, places.map(|p| p[k]));
            }
        }
        for (wi, f) in rest.iter().zip(last) {
            *f = interpolated(cells, sizes, places(&[*wi], wo, sizes).map(|p| p[0]));
        }
    }
}

/// Coordinates among the cells, whose centres have whole numbers.
#[inline(always)]
fn places<const N: usize>(wi: &[DVec3; N], wo: DVec3, sizes: [usize; 3]) -> [[f64; N]; 3] {
    let [nh, nd, nt] = sizes.map(|n| n as f64);
    let (x, y, z) = (wi.map(|w| w.x), wi.map(|w| w.y), wi.map(|w| w.z));
    let (mut h, mut d, mut t) = ([0.0; N], [0.0; N], [0.0; N]);
    for k in 0..N {
        let (vx, vy, vz) = (x[k] + wo.x, y[k] + wo.y, z[k] + wo.z);
        let (ex, ey, ez) = (x[k] - wo.x, y[k] - wo.y, z[k] - wo.z);
        let flat2 = vx * vx + vy * vy;
        let (flat, length) = (flat2.sqrt(), (flat2 + vz * vz).sqrt());
        let theta_h = first_quadrant(flat, vz);
        let theta_d = first_quadrant((ex * ex + ey * ey + ez * ez).sqrt(), length);
        // At the pole of half vectors any direction is that in which θ_h grows.
        let (along, across) = if flat > 0.0 {
            (vz * (vx * ex + vy * ey) - flat2 * ez, length * (ey * vx - ex * vy))
        } else {
            (ex, ey)
        };
        let acute = first_quadrant(across.abs(), along.abs());
        // Modulo π: e and −e are equivalent.
        let phi_d = if (across < 0.0) == (along < 0.0) { acute } else { PI - acute };
        h[k] = nh * (theta_h * FRAC_2_PI).sqrt() - 0.5;
        d[k] = nd * (theta_d * FRAC_2_PI) - 0.5;
        t[k] = nt * (phi_d / PI) - 0.5;
    }
    [h, d, t]
}

/// The angle whose tangent is y/x, for y, x ≥ 0 and finite; 0 where both are 0. Cephes' rational function
/// (Moshier 1989) for tangents up to 0.66; errors are 3e-16 at most.
#[inline(always)]
fn first_quadrant(y: f64, x: f64) -> f64 {
    const P: [f64; 5] = [
        -6.485_021_904_942_025e1,
        -1.228_866_684_490_136_2e2,
        -7.500_855_792_314_705e1,
        -1.615_753_718_733_365e1,
        -8.750_608_600_031_904e-1,
    ];
    const Q: [f64; 5] = [
        1.945_506_571_482_614e2,
        4.853_903_996_359_137e2,
        4.328_810_604_912_903e2,
        1.650_270_098_316_988_5e2,
        2.485_846_490_142_306_3e1,
    ];
    let (low, high) = if y > x { (x, y) } else { (y, x) };
    let near = low > 0.66 * high;
    let (above, below) = if near { (low - high, low + high) } else { (low, high) };
    let r = above / if below > 0.0 { below } else { 1.0 };
    let q = r * r;
    let top = P[0] + q * (P[1] + q * (P[2] + q * (P[3] + q * P[4])));
    let under = Q[0] + q * (Q[1] + q * (Q[2] + q * (Q[3] + q * (Q[4] + q))));
    let angle = r + r * (q * top / under) + if near { FRAC_PI_4 } else { 0.0 };
    if y > x { FRAC_PI_2 - angle } else { angle }
}

/// Linear in each coordinate; constant beyond the outermost cells, φ_d periodic.
#[inline(always)]
fn interpolated(cells: &[[f32; 3]], [nh, nd, nt]: [usize; 3], [h, d, t]: [f64; 3]) -> [f64; 3] {
    let ((h0, h1, u), (d0, d1, v)) = (between(h, nh), between(d, nd));
    // Within [−½, n − ½].
    let floor = t.floor();
    let (w, i) = (t - floor, floor as isize);
    let t0 = if i < 0 { nt - 1 } else { (i as usize).min(nt - 1) };
    let t1 = if t0 + 1 == nt { 0 } else { t0 + 1 };
    let places = [(h0, d0), (h0, d1), (h1, d0), (h1, d1)];
    let mut corners = [[0.0; 3]; 4];
    for (f, (h, d)) in corners.iter_mut().zip(places) {
        *f = row(&cells[(h * nd + d) * nt..][..nt], t0, t1, w);
    }
    let mut f = [0.0; 3];
    for k in 0..3 {
        let [a, b, c, e] = [corners[0][k], corners[1][k], corners[2][k], corners[3][k]];
        let (low, high) = (a + v * (b - a), c + v * (e - c));
        f[k] = low + u * (high - low);
    }
    f
}

/// Interpolates between the cells i and j of a row.
#[inline(always)]
fn row(row: &[[f32; 3]], i: usize, j: usize, t: f64) -> [f64; 3] {
    let (a, b) = (row[i], row[j]);
    let mut f = [0.0; 3];
    for k in 0..3 {
        let (a, b) = (f64::from(a[k]), f64::from(b[k]));
        f[k] = a + t * (b - a);
    }
    f
}

/// The two cells about a place and the share of the second.
#[inline(always)]
fn between(x: f64, n: usize) -> (usize, usize, f64) {
    let last = n - 1;
    let t = x.clamp(0.0, last as f64);
    let i = (t as usize).min(last);
    (i, (i + 1).min(last), t - i as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::spherical;
    use crate::measured::grid::half_angles;
    use std::f64::consts::TAU;
    use steradian_simd::run;

    #[test]
    fn angles_are_exact_to_rounding() {
        for k in 0..4000 {
            let angle = FRAC_PI_2 * f64::from(k) / 3999.0;
            for scale in [1.0, 1e-9, 3.7] {
                let (s, c) = angle.sin_cos();
                let (y, x) = (scale * s, (scale * c).max(0.0));
                assert!((first_quadrant(y, x) - y.atan2(x)).abs() < 5e-16, "{angle}");
            }
        }
        for (y, x, angle) in [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1e-20, 1.0, 1e-20), (1.0, 0.0, FRAC_PI_2)] {
            assert_eq!(first_quadrant(y, x), angle);
        }
    }

    #[test]
    fn places_are_those_of_the_angles() {
        for k in 0..2000 {
            let u = |m: f64| (f64::from(k) * m).fract();
            // Some near the mirror direction, some near the view.
            let wo = spherical(1.57 * u(0.618), TAU * u(0.414));
            let wi = match k % 3 {
                0 => spherical(1.57 * u(0.732), TAU * u(0.236)),
                1 => (DVec3::new(-wo.x, -wo.y, wo.z) + 1e-3 * spherical(1.57, TAU * u(0.37))).normalize(),
                _ => (wo + 1e-3 * spherical(1.57, TAU * u(0.37))).normalize(),
            };
            let [th, _, td, pd] = half_angles(wi, wo);
            let [h, d, t] = places(&[wi], wo, [90, 90, 180]).map(|p| p[0]);
            assert!((h - (90.0 * (th / FRAC_PI_2).sqrt() - 0.5)).abs() < 1e-9, "{wi} {wo} {h}");
            assert!((d - (90.0 * td / FRAC_PI_2 - 0.5)).abs() < 1e-9, "{wi} {wo} {d}");
            let turn = (t - (180.0 * pd / PI - 0.5)).abs();
            assert!(turn.min(180.0 - turn) < 1e-7, "{wi} {wo} {t}");
        }
    }

    #[test]
    fn many_directions_give_the_bits_of_one_at_a_time_and_of_exchanged_ones() {
        let sizes = [5, 4, 7];
        let cells: Vec<[f32; 3]> = (0..140).map(|k| [k as f32, (k * 37 % 11) as f32, 1.0]).collect();
        let wi: Vec<DVec3> = (0..21).map(|k| spherical(0.077 * f64::from(k), 2.4 * f64::from(k))).collect();
        for wo in [DVec3::Z, spherical(0.7, 1.0), spherical(1.5, 4.0), wi[3]] {
            let value = |wi: &[DVec3], wo: DVec3| {
                let mut out = vec![[0.0; 3]; wi.len()];
                run(Lookup { cells: &cells, sizes, wi, wo, out: &mut out });
                out
            };
            for (wi, f) in wi.iter().zip(value(&wi, wo)) {
                assert_eq!(value(&[*wi], wo), [f]);
                assert_eq!(value(&[wo], *wi), [f], "{wi} {wo}");
                assert_eq!(f[2], 1.0);
            }
        }
    }
}
