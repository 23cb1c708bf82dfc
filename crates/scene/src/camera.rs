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
}

/// View of an object: direction, and the part of the film that the object fills.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Framing {
    /// The object's up axis.
    pub up: Vec3,
    /// Direction of the camera about the up axis, radians; 0 is where +Z is for an up axis of +Y.
    pub azimuth: f32,
    /// Height of the camera above the object's centre, as an angle in radians.
    pub elevation: f32,
    /// Share of the film's width or height, whichever the object fills more of.
    pub share: f32,
    /// Vertical field of view, radians.
    pub fov_y: f32,
    /// Width over height of the film.
    pub aspect: f32,
}

impl Default for Framing {
    /// A view from the front and the right, a little above the height of the object's centre, on a square
    /// film of which the object fills 70 %.
    fn default() -> Self {
        Self { up: Vec3::Y, azimuth: 0.5028, elevation: 0.1564, share: 0.7, fov_y: 0.56, aspect: 1.0 }
    }
}

/// Most points that are used for framing.
const MOST_POINTS: usize = 1 << 16;
/// Steps in which the centre and the distance settle.
const STEPS: usize = 6;

impl Framing {
    /// The pinhole that sees the object with these points in the middle of the film, as near as its share
    /// allows; `None` without points.
    pub fn camera(&self, points: &[Vec3]) -> Option<Camera> {
        let first = *points.first()?;
        let (low, high) = points.iter().fold((first, first), |(l, h), p| (l.min(*p), h.max(*p)));
        let radius = (0.5 * (high - low).length()).max(1e-6);
        let up = self.up.normalize_or(Vec3::Y);
        let axis = self.away(up);
        let camera = |at: Vec3, distance: f32| Camera::Pinhole {
            from: at + axis * distance,
            at,
            up,
            fov_y: self.fov_y,
        };
        let (tan, aspect) = ((0.5 * self.fov_y).tan(), self.aspect);
        // Extent on the film, in half frames: right, left, up, down of its centre.
        let extent = |at: Vec3, distance: f32| {
            let [right, up, forward] = camera(at, distance).axes();
            let from = at + axis * distance;
            let step = points.len().div_ceil(MOST_POINTS);
            points.iter().step_by(step).fold([f32::MIN; 4], |e, p| {
                let v = *p - from;
                let depth = v.dot(forward).max(1e-3 * radius) * tan;
                let (x, y) = (v.dot(right) / (depth * aspect), v.dot(up) / depth);
                [e[0].max(x), e[1].max(-x), e[2].max(y), e[3].max(-y)]
            })
        };
        let (mut at, mut distance) = (0.5 * (low + high), 2.0 * radius / (tan * aspect.min(1.0)));
        for _ in 0..STEPS {
            // The object is centred, then the distance is set by the part of the film that it fills.
            let [right, up, _] = camera(at, distance).axes();
            let [e, w, n, s] = extent(at, distance);
            at += (0.5 * (e - w) * aspect * right + 0.5 * (n - s) * up) * (distance * tan);
            let fills = (0.5 * (e + w)).max(0.5 * (n + s)).max(1e-6);
            distance = (distance * fills / self.share).max(1.05 * radius);
        }
        Some(camera(at, distance))
    }

    /// Direction from the object to the camera.
    fn away(&self, up: Vec3) -> Vec3 {
        let front =
            [Vec3::Z, Vec3::X].into_iter().find(|v| v.cross(up).length_squared() > 0.5).unwrap_or(Vec3::X);
        let front = (front - up * front.dot(up)).normalize();
        let side = up.cross(front);
        let level = front * self.azimuth.cos() + side * self.azimuth.sin();
        level * self.elevation.cos() + up * self.elevation.sin()
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
    fn objects_fill_their_share_and_stand_in_the_middle_for_any_up_axis() {
        for name in ["sphere", "teapot", "torus", "knot", "plane"] {
            let points = crate::shapes::by_name(name).expect("a shape").positions;
            for (aspect, up) in [(0.5, Vec3::Y), (1.0, Vec3::Z), (2.0, Vec3::NEG_X), (2.0, Vec3::Y)] {
                let c = Framing { up, aspect, ..Framing::default() }.camera(&points).expect("points");
                let [r, u, f] = c.axes();
                let Camera::Pinhole { from, at, fov_y, .. } = c else { unreachable!() };
                let mut e = [f32::MIN; 4];
                for p in &points {
                    let v = *p - from;
                    let t = (0.5 * fov_y).tan() * v.dot(f);
                    assert!(t > 0.0);
                    let (x, y) = (v.dot(r) / (t * aspect), v.dot(u) / t);
                    e = [e[0].max(x), e[1].max(-x), e[2].max(y), e[3].max(-y)];
                }
                let most = e.into_iter().fold(0.0, f32::max);
                assert!((0.6..0.8).contains(&most), "{name} {aspect} {up}: {most}");
                assert!(
                    (e[0] - e[1]).abs() < 0.05 && (e[2] - e[3]).abs() < 0.05,
                    "{name} {aspect} {up}: {e:?}"
                );
                let height = (from - at).normalize().dot(up);
                assert!((height - 0.1564f32.sin()).abs() < 1e-3, "{height}");
            }
        }
        assert_eq!(Framing::default().camera(&[]), None);
    }
}
