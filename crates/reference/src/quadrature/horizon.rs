//! The horizon n·wi = 0 in a chart: an analytic curve θ_h(φ).

use super::geometry::{Chart, Patch};
use std::f64::consts::{PI, TAU};

/// n·wi = A(φ) sin θ + n_y cos θ in chart coordinates, with A(φ) = n_x cos φ + n_z sin φ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Horizon {
    /// n in the chart's coordinates; n_y is the height of the pole above the tangent plane.
    n: [f64; 3],
    /// √(n_x² + n_z²), the largest A.
    b: f64,
    /// The azimuth of the largest A.
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
        let n = [chart.x.z, chart.y.z, chart.z.z];
        Self { n, b: n[0].hypot(n[2]), phi: n[2].atan2(n[0]) }
    }

    /// A(φ) of an azimuth's sine and cosine.
    fn a(&self, (sin, cos): (f64, f64)) -> f64 {
        self.n[0] * cos + self.n[2] * sin
    }

    /// Smallest and largest A(φ) over the azimuths of a patch.
    fn swing(&self, patch: &Patch) -> [f64; 2] {
        let [from, to] = patch.ends[0];
        let (c0, c1) = (self.a(from), self.a(to));
        let [mut low, mut high] = [c0.min(c1), c0.max(c1)];
        let width = patch.rect.size()[0];
        if width <= 3.0 {
            // Within less than half a turn A has one extreme at most, where dA/dφ changes its sign.
            let [d0, d1] = [from, to].map(|(sin, cos)| self.n[2] * cos - self.n[0] * sin);
            high = if d0 >= 0.0 && d1 <= 0.0 { self.b } else { high };
            low = if d0 <= 0.0 && d1 >= 0.0 { -self.b } else { low };
        } else {
            let a = (patch.rect.phi[0] - self.phi).rem_euclid(TAU);
            let e = a + width;
            high = if e >= TAU || a == 0.0 { self.b } else { high };
            low = if (a <= PI && PI <= e) || e >= PI + TAU { -self.b } else { low };
        }
        [low, high]
    }

    /// Position of a rectangle. A sliver thinner than rounding counts as below.
    pub fn side(&self, patch: &Patch) -> Side {
        let [low, high] = self.swing(patch);
        // n·wi along θ where A is extreme, at both ends, and its derivative there: over half a turn at most
        // it has one extreme within, ±√(A² + n_y²), where the derivative changes its sign.
        let at = |a: f64| patch.ends[1].map(|(sin, cos)| a * sin + self.n[1] * cos);
        let slope = |a: f64| patch.ends[1].map(|(sin, cos)| a * cos - self.n[1] * sin);
        let extreme = |a: f64| (a * a + self.n[1] * self.n[1]).sqrt();
        let ([t0, t1], [d0, d1]) = (at(high), slope(high));
        let top = if d0 >= 0.0 && d1 <= 0.0 { extreme(high) } else { t0.max(t1) };
        if top <= 1e-15 {
            return Side::Below;
        }
        let ([t0, t1], [d0, d1]) = (at(low), slope(low));
        let bottom = if d0 <= 0.0 && d1 >= 0.0 { -extreme(low) } else { t0.min(t1) };
        if bottom >= 0.0 { Side::Above } else { Side::Crossing }
    }

    /// The part of [t0, t1] above the horizon at an azimuth's sine and cosine; empty intervals have equal
    /// ends.
    ///
    /// A sin θ + n_y cos θ > 0 is θ < θ_h where the pole is above, θ > θ_h where it is below; θ_h =
    /// atan2(|n_y|, −sign(n_y) A).
    pub fn clip(&self, azimuth: (f64, f64), [t0, t1]: [f64; 2]) -> [f64; 2] {
        let (a, ny) = (self.a(azimuth), self.n[1]);
        if ny > 0.0 {
            [t0, ny.atan2(-a).clamp(t0, t1)]
        } else if ny < 0.0 {
            [(-ny).atan2(a).clamp(t0, t1), t1]
        } else if a > 0.0 {
            [t0, t1]
        } else {
            [t0, t0]
        }
    }

    /// Azimuths inside (φ0, φ1), ascending, where the horizon passes through the rectangle's edges θ = t0,
    /// t1.
    ///
    /// A(φ) = −n_y cot θ.
    pub fn breaks(&self, patch: &Patch) -> Vec<f64> {
        let rect = &patch.rect;
        let mut out = vec![rect.phi[0], rect.phi[1]];
        for (sin, cos) in patch.ends[1] {
            let c = -self.n[1] * cos / (self.b * sin);
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
    use super::super::geometry::Rect;
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
                    match h.side(&Patch::new(rect)) {
                        Side::Above => assert_eq!(below, 0, "{rect:?} {chart:?}"),
                        Side::Below => assert_eq!(above, 0, "{rect:?} {chart:?}"),
                        Side::Crossing => {}
                    }
                    if above > 0 && below > 0 {
                        assert_eq!(h.side(&Patch::new(rect)), Side::Crossing);
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
                let [lo, hi] = h.clip(phi.sin_cos(), [0.0, PI]);
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
