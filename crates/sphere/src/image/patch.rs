//! Parts of a layout that show a convex piece of the sphere without seams, poles or folds.

use crate::layout::{Layout, cube, paraboloid};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// The patches of a layout at a size: cube faces, octants of an octahedral map, hemispheres of a paraboloid
/// pair, eighths of a turn about the axis of the others.
#[derive(Clone, Copy)]
pub struct Patches {
    layout: Layout,
    w: f64,
    h: f64,
}

impl Patches {
    pub fn new(layout: Layout, width: usize, height: usize) -> Self {
        Self { layout, w: width as f64, h: height as f64 }
    }

    pub fn count(self) -> usize {
        match self.layout {
            Layout::Cube => 6,
            Layout::DualParaboloid => 2,
            _ => 8,
        }
    }

    /// The face that a patch lies on.
    pub fn face(self, patch: usize) -> usize {
        if matches!(self.layout, Layout::Cube | Layout::DualParaboloid) { patch } else { 0 }
    }

    /// Are lines in the image great circles?
    pub fn straight(self) -> bool {
        matches!(self.layout, Layout::Cube | Layout::Octahedral)
    }

    /// The patch that holds a direction.
    pub fn home(self, d: DVec3) -> usize {
        match self.layout {
            Layout::Cube => cube::face(d),
            Layout::DualParaboloid => usize::from(d.z < 0.0),
            Layout::Octahedral => {
                usize::from(d.x < 0.0) + 2 * usize::from(d.y < 0.0) + 4 * usize::from(d.z < 0.0)
            }
            _ => {
                // The eighth that holds the azimuth, counted from −π.
                let (a, b) = self.around(d);
                match (b < 0.0, a < 0.0) {
                    (true, true) => usize::from(b < a),
                    (true, false) => 2 + usize::from(a >= -b),
                    (false, false) => 4 + usize::from(b >= a),
                    (false, true) => 6 + usize::from(b < -a),
                }
            }
        }
    }

    /// Does a direction lie within `angle` of a point that the image shows as a line?
    pub fn singular(self, d: DVec3, angle: f64) -> bool {
        match self.layout {
            Layout::LatLong => d.x.hypot(d.z) < angle,
            Layout::SphereMap => d.z < 0.0 && d.x.hypot(d.y) < angle,
            Layout::AngularMap | Layout::AngularLattice => d.z > 0.0 && d.x.hypot(d.y) < angle,
            _ => false,
        }
    }

    /// Components across the axis that eighths of a turn go round.
    fn around(self, d: DVec3) -> (f64, f64) {
        if self.layout == Layout::LatLong { (d.x, d.z) } else { (d.x, d.y) }
    }

    /// Normals n with n·d ≥ 0 in the patch.
    pub fn planes(self, patch: usize) -> ([DVec3; 4], usize) {
        let sign = |bit: usize| if patch & bit == 0 { 1.0 } else { -1.0 };
        let none = DVec3::ZERO;
        match self.layout {
            Layout::Cube => {
                let mut axis = [0.0; 3];
                axis[patch / 2] = 1.0 - 2.0 * (patch % 2) as f64;
                let a = DVec3::from_array(axis);
                let (u, v) = (DVec3::new(a.y, a.z, a.x).abs(), DVec3::new(a.z, a.x, a.y).abs());
                ([a - u, a + u, a - v, a + v], 4)
            }
            Layout::DualParaboloid => ([DVec3::Z * sign(1), none, none, none], 1),
            Layout::Octahedral => ([DVec3::X * sign(1), DVec3::Y * sign(2), DVec3::Z * sign(4), none], 3),
            _ => {
                let from = patch as f64 * FRAC_PI_4 - PI;
                let normal = |angle: f64, side: f64| {
                    let (s, c) = angle.sin_cos();
                    let (a, b) = (-side * s, side * c);
                    if self.layout == Layout::LatLong { DVec3::new(a, 0.0, b) } else { DVec3::new(a, b, 0.0) }
                };
                ([normal(from, 1.0), normal(from + FRAC_PI_4, -1.0), none, none], 2)
            }
        }
    }

    /// Where the image shows `d`, taken as part of the patch. `None` on the axis of an eighth, which is a
    /// line.
    pub fn map(self, patch: usize, d: DVec3) -> Option<(f64, f64)> {
        if matches!(self.layout, Layout::Cube | Layout::DualParaboloid | Layout::Octahedral) {
            return Some(self.map_square(patch, d));
        }
        let (a, b) = self.around(d);
        if DVec2::new(a, b).length() < 1e-9 * d.length() {
            return None;
        }
        // The azimuth, without a jump inside the patch or at its borders.
        let (middle, s, c) = middle(patch);
        Some(self.at(middle + (b * c - a * s).atan2(a * c + b * s), self.polar(d)))
    }

    /// The place on the axis' line that a neighbour at `d` sees: its azimuth at the axis' polar angle.
    pub fn map_axis(self, patch: usize, axis: DVec3, d: DVec3) -> (f64, f64) {
        let (a, b) = self.around(d);
        let (middle, s, c) = middle(patch);
        self.at(middle + (b * c - a * s).atan2(a * c + b * s), self.polar(axis))
    }

    /// Angle from the direction at r = 0 of a disc, or from +Y.
    fn polar(self, d: DVec3) -> f64 {
        match self.layout {
            Layout::LatLong => DVec2::new(d.x, d.z).length().atan2(d.y),
            Layout::SphereMap => d.truncate().length().atan2(d.z),
            _ => d.truncate().length().atan2(-d.z),
        }
    }

    fn at(self, phi: f64, theta: f64) -> (f64, f64) {
        if self.layout == Layout::LatLong {
            return ((0.5 + phi / TAU) * self.w, theta / PI * self.h);
        }
        let r = if self.layout == Layout::SphereMap { (0.5 * theta).sin() } else { theta / PI };
        let (s, c) = phi.sin_cos();
        let o = self.layout.offset();
        (0.5 * (r * c + 1.0) * self.w + o, 0.5 * (1.0 - r * s) * self.h + o)
    }

    fn map_square(self, patch: usize, d: DVec3) -> (f64, f64) {
        let (s, t) = match self.layout {
            Layout::Cube => cube::project(patch, d),
            Layout::DualParaboloid => {
                let (s, t) = paraboloid::project(patch, d.normalize());
                (s, -t)
            }
            _ => {
                let k = 1.0 / (d.x.abs() + d.y.abs() + d.z.abs());
                let (s, t) = ((d.x * k).abs(), (d.z * k).abs());
                let (s, t) = if patch & 2 == 0 { (s, t) } else { (1.0 - t, 1.0 - s) };
                (if patch & 1 == 0 { s } else { -s }, if patch & 4 == 0 { t } else { -t })
            }
        };
        (0.5 * (s + 1.0) * self.w, 0.5 * (t + 1.0) * self.h)
    }
}

/// Azimuth in the middle of an eighth, its sine and cosine.
fn middle(patch: usize) -> (f64, f64, f64) {
    // cos π/8 and sin π/8.
    const C: f64 = 0.923_879_532_511_286_8;
    const S: f64 = 0.382_683_432_365_089_8;
    const SINES: [f64; 8] = [-S, -C, -C, -S, S, C, C, S];
    let k = patch & 7;
    ((k as f64 + 0.5) * FRAC_PI_4 - PI, SINES[k], SINES[(k + 2) & 7])
}
