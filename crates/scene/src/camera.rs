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
