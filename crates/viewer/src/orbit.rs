//! A camera that turns around what it looks at.

use glam::Vec3;
use serde::{Deserialize, Serialize};
use steradian_scene::Camera;

/// Radians from the poles that a camera keeps.
const POLE: f32 = 0.02;

/// Where the camera stands, around what it looks at.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Orbit {
    /// What it looks at, metres.
    pub at: [f32; 3],
    /// Distance from it, metres.
    pub distance: f32,
    /// Angle about +Y, radians; 0 is where +Z is.
    pub azimuth: f32,
    /// Angle above the horizontal plane, radians.
    pub elevation: f32,
    /// Vertical field of view, radians.
    pub fov_y: f32,
}

impl Orbit {
    /// The orbit on which a camera stands. Parallel rays become those of a distant eye.
    pub fn of(camera: &Camera) -> Self {
        let (from, at, fov_y) = match *camera {
            Camera::Pinhole { from, at, fov_y, .. } => (from, at, fov_y),
            Camera::Orthographic { from, at, height, .. } => {
                const FOV: f32 = 0.1;
                let away = (from - at).normalize_or(Vec3::Z) * (0.5 * height / (0.5 * FOV).tan());
                (at + away, at, FOV)
            }
        };
        let away = from - at;
        let distance = away.length().max(1e-6);
        let elevation = (away.y / distance).clamp(-1.0, 1.0).asin();
        Self { at: at.to_array(), distance, azimuth: away.x.atan2(away.z), elevation, fov_y }
    }

    /// The camera's position, metres.
    pub fn from(&self) -> [f32; 3] {
        let (s, c) = self.azimuth.sin_cos();
        let (up, out) = self.elevation.sin_cos();
        let away = Vec3::new(s * out, up, c * out) * self.distance;
        (Vec3::from(self.at) + away).to_array()
    }

    /// The camera.
    pub fn camera(&self) -> Camera {
        let (from, at) = (Vec3::from(self.from()), Vec3::from(self.at));
        Camera::Pinhole { from, at, up: Vec3::Y, fov_y: self.fov_y }
    }

    /// Turns by angles in radians.
    pub fn turn(&mut self, azimuth: f32, elevation: f32) {
        let pole = std::f32::consts::FRAC_PI_2 - POLE;
        self.azimuth = (self.azimuth + azimuth).rem_euclid(std::f32::consts::TAU);
        self.elevation = (self.elevation + elevation).clamp(-pole, pole);
    }

    /// Moves across the line of sight by parts of the picture's height, to the right and up.
    pub fn shift(&mut self, right: f32, up: f32) {
        let height = 2.0 * self.distance * (0.5 * self.fov_y).tan();
        let [x, y, _] = self.camera().axes();
        let moved = Vec3::from(self.at) + (x * right + y * up) * height;
        self.at = moved.to_array();
    }

    /// Goes nearer by a factor below 1, farther by one above.
    pub fn zoom(&mut self, factor: f32) {
        self.distance = (self.distance * factor).clamp(1e-4, 1e6);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_come_back_from_their_orbits() {
        let from = Vec3::new(1.0, 2.0, -3.0);
        let camera = Camera::Pinhole { from, at: Vec3::new(0.5, 0.0, 0.25), up: Vec3::Y, fov_y: 0.5 };
        let mut o = Orbit::of(&camera);
        assert!(Vec3::from(o.from()).distance(from) < 1e-5);
        o.shift(0.0, 1.0);
        assert!(
            (Vec3::from(o.from()) - Vec3::from(o.at) - (from - Vec3::new(0.5, 0.0, 0.25))).length() < 1e-4
        );
        o.turn(0.0, 9.0);
        assert!(o.elevation < std::f32::consts::FRAC_PI_2);
    }
}
