//! Cameras.

use glam::{BVec3, Vec3};

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

    /// The camera that shows the box from `min` to `max` as [`Framing::default`] does, with a vertical field of view of
    /// `fov_y` (radians) on films of any aspect ratio `width / height`.
    pub fn framing(min: Vec3, max: Vec3, fov_y: f32, aspect: f32) -> Self {
        Framing { fov_y, aspect, ..Framing::default() }.camera(min, max)
    }
}

/// How a camera looks at an object: from where, and how much of the film it fills.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Framing {
    /// The object's up axis.
    pub up: Vec3,
    /// Direction of the camera about the up axis, radians; 0 is where +Z is for an up axis of +Y.
    pub azimuth: f32,
    /// Height of the camera above the object's centre, as an angle in radians.
    pub elevation: f32,
    /// Share of the film's width or height, whichever the box fills more of.
    pub share: f32,
    /// Vertical field of view, radians.
    pub fov_y: f32,
    /// Width over height of the film.
    pub aspect: f32,
}

impl Default for Framing {
    /// From three quarters, a little above the height of the object's centre, 70 % of a square film.
    fn default() -> Self {
        Self { up: Vec3::Y, azimuth: 0.5, elevation: 0.1, share: 0.7, fov_y: 0.56, aspect: 1.0 }
    }
}

impl Framing {
    /// The camera that looks at the centre of the box from `min` to `max`, as near as its corners allow.
    pub fn camera(&self, min: Vec3, max: Vec3) -> Camera {
        self.at(min, max, self.distance(min, max))
    }

    /// Cameras of a turntable: `count` steps about the up axis, all from the distance that the widest side needs, so that
    /// the object keeps its size.
    pub fn orbit(&self, min: Vec3, max: Vec3, count: usize) -> Vec<Camera> {
        let step = std::f32::consts::TAU / count.max(1) as f32;
        let turned = |k: usize| Self { azimuth: self.azimuth + step * k as f32, ..*self };
        let farthest = (0..count).map(|k| turned(k).distance(min, max)).fold(0.0, f32::max);
        (0..count).map(|k| turned(k).at(min, max, farthest)).collect()
    }

    fn at(&self, min: Vec3, max: Vec3, distance: f32) -> Camera {
        let at = 0.5 * (min + max);
        let up = self.up.normalize_or(Vec3::Y);
        Camera::Pinhole { from: at + self.away() * distance, at, up, fov_y: self.fov_y }
    }

    /// From the object to the camera.
    fn away(&self) -> Vec3 {
        let up = self.up.normalize_or(Vec3::Y);
        let front =
            [Vec3::Z, Vec3::X].into_iter().find(|v| v.cross(up).length_squared() > 0.5).unwrap_or(Vec3::X);
        let front = (front - up * front.dot(up)).normalize();
        let side = up.cross(front);
        let level = front * self.azimuth.cos() + side * self.azimuth.sin();
        level * self.elevation.cos() + up * self.elevation.sin()
    }

    /// The least distance at which no corner lies beyond the share of the film.
    fn distance(&self, min: Vec3, max: Vec3) -> f32 {
        let half = 0.5 * (max - min);
        let [right, up, forward] = self.at(min, max, 1.0).axes();
        let tangent = (0.5 * self.fov_y).tan() * self.share;
        let corner = |i: u32| {
            half * Vec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), Vec3::ONE, Vec3::NEG_ONE)
        };
        let needed = |p: Vec3| {
            let across = (p.dot(right).abs() / self.aspect).max(p.dot(up).abs());
            across / tangent - p.dot(forward)
        };
        (0..8).map(|i| needed(corner(i))).fold(1e-6, f32::max)
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

    /// The largest share of the film that a corner of the box reaches.
    fn filled(c: &Camera, min: Vec3, max: Vec3, aspect: f32) -> f32 {
        let [r, u, f] = c.axes();
        let Camera::Pinhole { from, fov_y, .. } = *c else { unreachable!() };
        let reach = |i: u32| {
            let p = Vec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), min, max) - from;
            let t = (0.5 * fov_y).tan() * p.dot(f);
            (p.dot(u).abs() / t).max(p.dot(r).abs() / (t * aspect))
        };
        (0..8).map(reach).fold(0.0, f32::max)
    }

    #[test]
    fn framed_boxes_fill_their_share_of_the_film_for_any_up_axis() {
        let (min, max) = (Vec3::new(-1.0, 0.0, -3.0), Vec3::new(2.0, 1.0, 0.5));
        for aspect in [0.5, 1.0, 2.0] {
            for up in [Vec3::Y, Vec3::Z, Vec3::NEG_X] {
                let framing = Framing { up, aspect, ..Framing::default() };
                let c = framing.camera(min, max);
                assert!((filled(&c, min, max, aspect) - 0.7).abs() < 1e-4);
                let Camera::Pinhole { from, at, .. } = c else { unreachable!() };
                let height = (from - at).normalize().dot(up);
                assert!((height - 0.1f32.sin()).abs() < 1e-5, "{height}");
            }
        }
        assert!((filled(&Camera::framing(min, max, 0.7, 2.0), min, max, 2.0) - 0.7).abs() < 1e-4);
    }

    #[test]
    fn a_turntable_keeps_its_distance_and_comes_round() {
        let (min, max) = (Vec3::new(-1.0, 0.0, -0.2), Vec3::new(1.0, 0.5, 0.2));
        let cameras = Framing::default().orbit(min, max, 8);
        let eye =
            |c: &Camera| if let Camera::Pinhole { from, at, .. } = *c { from - at } else { unreachable!() };
        let distance = eye(&cameras[0]).length();
        let sum: Vec3 = cameras.iter().map(eye).sum();
        assert!(cameras.iter().all(|c| (eye(c).length() / distance - 1.0).abs() < 1e-5));
        close(sum / (8.0 * distance), Vec3::Y * 0.1f32.sin());
        let fills: Vec<f32> = cameras.iter().map(|c| filled(c, min, max, 1.0)).collect();
        assert!(fills.iter().all(|f| *f < 0.7 + 1e-4) && fills.iter().any(|f| (f - 0.7).abs() < 1e-4));
    }
}
