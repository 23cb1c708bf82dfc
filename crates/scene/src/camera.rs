//! Cameras.

use glam::Vec3;

/// A ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

/// A camera: `look_from` towards `look_at`, +Y up unless said otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Camera {
    /// Perspective.
    Pinhole {
        /// Position.
        from: Vec3,
        /// Target.
        at: Vec3,
        /// Up.
        up: Vec3,
        /// Vertical field of view, radians.
        fov_y: f32,
    },
    /// Parallel.
    Orthographic {
        /// Position.
        from: Vec3,
        /// Target.
        at: Vec3,
        /// Up.
        up: Vec3,
        /// Height of the picture in metres.
        height: f32,
    },
}

impl Camera {
    /// The ray through the point (`x`, `y`) of a film of `width` × `height` pixels: x to the right from the
    /// left edge, y downwards from the top edge, in pixels, so that pixel (i, j) has its centre at
    /// (i + ½, j + ½). Pixels are square; the field of view (or the height) spans the film's height.
    pub fn ray(&self, x: f32, y: f32, width: u32, height: u32) -> Ray {
        let h = height.max(1) as f32;
        let sx = (x - 0.5 * width as f32) / h;
        let sy = 0.5 - y / h;
        let [right, up, forward] = self.axes();
        match *self {
            Self::Pinhole { from, fov_y, .. } => {
                let scale = 2.0 * (0.5 * fov_y).tan();
                let d = forward + right * (scale * sx) + up * (scale * sy);
                Ray { origin: from, direction: d.normalize_or(forward) }
            }
            Self::Orthographic { from, height, .. } => {
                Ray { origin: from + right * (height * sx) + up * (height * sy), direction: forward }
            }
        }
    }

    /// Right, up and forward: orthonormal, right × up = −forward. An `up` parallel to the view direction is
    /// replaced (by +Z, or +X), and a camera at its own target looks along −Z.
    pub fn axes(&self) -> [Vec3; 3] {
        let (Self::Pinhole { from, at, up, .. } | Self::Orthographic { from, at, up, .. }) = *self;
        let forward = (at - from).normalize_or(Vec3::NEG_Z);
        let right = [up, Vec3::Z, Vec3::X]
            .into_iter()
            .map(|u| forward.cross(u.normalize_or_zero()))
            .find(|r| r.length_squared() > 1e-10)
            .unwrap_or(Vec3::X)
            .normalize();
        [right, right.cross(forward), forward]
    }

    /// The camera that shows a whole box from three quarters above: a pinhole of `fov_y` (radians) looking at
    /// the box's centre from the direction (0.55, 0.4, 1), as near as the box's bounding sphere allows with a
    /// margin of 5 %, for films of any aspect ratio `width / height`.
    pub fn framing(min: Vec3, max: Vec3, fov_y: f32, aspect: f32) -> Self {
        let at = 0.5 * (min + max);
        let radius = (0.5 * (max - min).length()).max(1e-6);
        let half = (0.5 * fov_y).tan() * aspect.min(1.0);
        let distance = 1.05 * radius / half.atan().sin();
        let from = at + Vec3::new(0.55, 0.4, 1.0).normalize() * distance;
        Self::Pinhole { from, at, up: Vec3::Y, fov_y }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    fn close(a: Vec3, b: Vec3) {
        assert!((a - b).length() < 1e-6, "{a} {b}");
    }

    #[test]
    fn the_centre_of_the_film_looks_at_the_target_and_the_corners_lie_on_the_field_of_view() {
        let c = Camera::Pinhole { from: Vec3::Z * 3.0, at: Vec3::ZERO, up: Vec3::Y, fov_y: FRAC_PI_2 };
        close(c.ray(100.0, 50.0, 200, 100).direction, Vec3::NEG_Z);
        close(c.ray(100.0, 0.0, 200, 100).direction, Vec3::new(0.0, 1.0, -1.0).normalize());
        close(c.ray(0.0, 100.0, 200, 100).direction, Vec3::new(-2.0, -1.0, -1.0).normalize());
    }

    #[test]
    fn an_orthographic_film_spans_its_height() {
        let c = Camera::Orthographic { from: Vec3::X, at: Vec3::ZERO, up: Vec3::Y, height: 2.0 };
        let r = c.ray(0.5, 0.5, 2, 2);
        close(r.direction, Vec3::NEG_X);
        close(r.origin, Vec3::new(1.0, 0.5, 0.5));
    }

    #[test]
    fn degenerate_cameras_still_have_axes() {
        for (from, at, up) in [
            (Vec3::Y, Vec3::ZERO, Vec3::Y),
            (Vec3::Z, Vec3::Z, Vec3::Y),
            (Vec3::Z, Vec3::ZERO, Vec3::Z),
            (Vec3::X, Vec3::ZERO, Vec3::ZERO),
        ] {
            let [r, u, f] = Camera::Pinhole { from, at, up, fov_y: 1.0 }.axes();
            close(r.cross(u), -f);
            assert!((r.length() - 1.0).abs() < 1e-6 && (u.length() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn framing_keeps_every_corner_inside_the_film() {
        let (min, max) = (Vec3::new(-1.0, 0.0, -3.0), Vec3::new(2.0, 1.0, 0.5));
        for aspect in [0.5, 1.0, 2.0] {
            let c = Camera::framing(min, max, 0.7, aspect);
            let [r, u, f] = c.axes();
            let Camera::Pinhole { from, fov_y, .. } = c else { unreachable!() };
            for i in 0..8 {
                let p = Vec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), min, max) - from;
                let t = (0.5 * fov_y).tan() * p.dot(f);
                assert!(p.dot(u).abs() < t && p.dot(r).abs() < t * aspect);
            }
        }
    }
}
