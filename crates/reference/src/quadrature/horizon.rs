//! The horizon n·wi = 0 in a chart: an analytic curve θ_h(φ).

use super::geometry::{Chart, Rect};
use std::f64::consts::{PI, TAU};

/// n·wi = sin θ · B cos(φ − φ_n) + n_y cos θ in chart coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Horizon {
    /// Height of the pole above the tangent plane, n·pole.
    ny: f64,
    /// B = √(n_x² + n_z²).
    b: f64,
    /// φ_n.
    phi: f64,
}

/// Position of a rectangle relative to the horizon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// All above, or clipping is off.
    Above,
    /// Nothing above.
    Below,
    /// Both.
    Crossing,
}

impl Horizon {
    /// The horizon of a chart's shading frame.
    pub fn of(chart: &Chart) -> Self {
        let (nx, ny, nz) = (chart.x.z, chart.y.z, chart.z.z);
        Self { ny, b: nx.hypot(nz), phi: nz.atan2(nx) }
    }

    /// Smallest and largest B cos(φ − φ_n) over an interval of φ.
    fn swing(&self, phi: [f64; 2]) -> [f64; 2] {
        let a = (phi[0] - self.phi).rem_euclid(TAU);
        let e = a + (phi[1] - phi[0]);
        let (c0, c1) = (a.cos(), e.cos());
        let low = if (a <= PI && PI <= e) || e >= PI + TAU { -1.0 } else { c0.min(c1) };
        let high = if e >= TAU || a == 0.0 { 1.0 } else { c0.max(c1) };
        [self.b * low, self.b * high]
    }

    /// Position of a rectangle. A sliver thinner than rounding counts as below.
    pub fn side(&self, rect: &Rect) -> Side {
        let [low, high] = self.swing(rect.phi);
        let [t0, t1] = rect.theta;
        let at = |a: f64, t: f64| a * t.sin() + self.ny * t.cos();
        // n·wi = R cos(θ − ψ) with ψ = atan2(a, n_y).
        let psi = high.atan2(self.ny);
        let inside = t0 <= psi && psi <= t1;
        let top = if inside { high.hypot(self.ny) } else { at(high, t0).max(at(high, t1)) };
        if top <= 1e-15 {
            return Side::Below;
        }
        let anti = low.atan2(self.ny) + if low < 0.0 { PI } else { -PI };
        let bottom =
            if t0 <= anti && anti <= t1 { -low.hypot(self.ny) } else { at(low, t0).min(at(low, t1)) };
        if bottom >= 0.0 { Side::Above } else { Side::Crossing }
    }

    /// The part of [t0, t1] above the horizon at azimuth φ; empty intervals have equal ends.
    ///
    /// With A = B cos(φ − φ_n): A sin θ + n_y cos θ > 0 is θ < θ_h where the pole is above, θ > θ_h where it
    /// is below; θ_h = atan2(|n_y|, −sign(n_y) A).
    pub fn clip(&self, phi: f64, [t0, t1]: [f64; 2]) -> [f64; 2] {
        let a = self.b * (phi - self.phi).cos();
        if self.ny > 0.0 {
            [t0, self.ny.atan2(-a).clamp(t0, t1)]
        } else if self.ny < 0.0 {
            [(-self.ny).atan2(a).clamp(t0, t1), t1]
        } else if a > 0.0 {
            [t0, t1]
        } else {
            [t0, t0]
        }
    }

    /// Azimuths inside (φ0, φ1), ascending, where the horizon passes through the rectangle's edges θ = t0,
    /// t1.
    ///
    /// B cos(φ − φ_n) = −n_y cot θ.
    pub fn breaks(&self, rect: &Rect) -> Vec<f64> {
        let mut out = vec![rect.phi[0], rect.phi[1]];
        for t in rect.theta {
            let c = -self.ny * t.cos() / (self.b * t.sin());
            if !(-1.0..=1.0).contains(&c) {
                continue;
            }
            let delta = c.acos();
            for root in [self.phi + delta, self.phi - delta] {
                let phi = rect.phi[0] + (root - rect.phi[0]).rem_euclid(TAU);
                if phi < rect.phi[1] {
                    out.push(phi);
                }
            }
        }
        out.sort_by(f64::total_cmp);
        out.dedup_by(|a, b| (*a - *b).abs() < 1e-15);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DQuat, DVec3};

    fn charts() -> Vec<Chart> {
        let mut out = Vec::new();
        for k in 0..40 {
            let s = f64::from(k);
            let m = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, s * 0.7, s * 1.3, s * 0.4));
            out.push(Chart { x: m.x_axis, y: m.y_axis, z: m.z_axis });
        }
        out.push(Chart { x: DVec3::X, y: DVec3::Y, z: DVec3::Z });
        out.push(Chart { x: DVec3::X, y: DVec3::Z, z: -DVec3::Y });
        out.push(Chart { x: DVec3::X, y: -DVec3::Z, z: DVec3::Y });
        out
    }

    #[test]
    fn sides_agree_with_dense_points() {
        for chart in charts() {
            let h = Horizon::of(&chart);
            for i in 0..12 {
                for j in 0..6 {
                    let (dp, dt) = (TAU / 12.0, PI / 6.0);
                    let (p, t) = (f64::from(i) * dp - PI, f64::from(j) * dt);
                    let rect = Rect { phi: [p, p + dp], theta: [t, (t + dt).min(PI)] };
                    let (mut above, mut below) = (0, 0);
                    for a in 1..40 {
                        for b in 1..40 {
                            let z =
                                chart.direction(p + dp * f64::from(a) / 40.0, t + dt * f64::from(b) / 40.0).z;
                            if z > 1e-12 {
                                above += 1
                            } else if z < -1e-12 {
                                below += 1
                            }
                        }
                    }
                    match h.side(&rect) {
                        Side::Above => assert_eq!(below, 0, "{rect:?} {chart:?}"),
                        Side::Below => assert_eq!(above, 0, "{rect:?} {chart:?}"),
                        Side::Crossing => {}
                    }
                    if above > 0 && below > 0 {
                        assert_eq!(h.side(&rect), Side::Crossing);
                    }
                }
            }
        }
    }

    #[test]
    fn clip_ends_on_the_horizon() {
        for chart in charts() {
            let h = Horizon::of(&chart);
            for k in 0..50 {
                let phi = f64::from(k) * 0.13 - PI;
                let [lo, hi] = h.clip(phi, [0.0, PI]);
                for t in [lo, hi] {
                    if t > 0.0 && t < PI && chart.y.z != 0.0 {
                        assert!(chart.direction(phi, t).z.abs() < 1e-12);
                    }
                }
                if hi > lo {
                    assert!(chart.direction(phi, 0.5 * (lo + hi)).z > -1e-12);
                }
                if lo > 1e-9 {
                    assert!(chart.direction(phi, 0.5 * lo).z < 1e-12);
                }
            }
        }
    }
}
