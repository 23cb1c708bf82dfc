//! Local shading frames.

use glam::{DMat3, DVec3};

/// An orthonormal right-handed frame: tangent `t`, bitangent `b = n × t`, normal `n`.
/// Local coordinates are `(v·t, v·b, v·n)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Tangent (local x).
    pub t: DVec3,
    /// Bitangent (local y).
    pub b: DVec3,
    /// Normal (local z).
    pub n: DVec3,
}

impl Frame {
    /// The frame of a unit normal where nothing else gives a tangent: a = +Y if |n·y| < 0.99 else +X;
    /// t = normalize(a × n), b = n × t.
    pub fn from_normal(n: DVec3) -> Self {
        let a = if n.y.abs() < 0.99 { DVec3::Y } else { DVec3::X };
        let t = a.cross(n).normalize();
        Self { t, b: n.cross(t), n }
    }

    /// The frame of a unit normal and a direction near the tangent, which is projected to the tangent plane;
    /// [`Frame::from_normal`] where they are parallel.
    pub fn from_normal_tangent(n: DVec3, tangent: DVec3) -> Self {
        let t = tangent - n * n.dot(tangent);
        if t.length_squared() <= 1e-20 * tangent.length_squared() || !t.is_finite() {
            return Self::from_normal(n);
        }
        let t = t.normalize();
        Self { t, b: n.cross(t), n }
    }

    /// World → local.
    #[inline]
    pub fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(v.dot(self.t), v.dot(self.b), v.dot(self.n))
    }

    /// Local → world.
    #[inline]
    pub fn to_world(&self, v: DVec3) -> DVec3 {
        self.t * v.x + self.b * v.y + self.n * v.z
    }

    /// The matrix that takes local to world vectors.
    pub fn matrix(&self) -> DMat3 {
        DMat3::from_cols(self.t, self.b, self.n)
    }
}

/// The mirror direction of `wo` about `n`: r = 2(n·wo)n − wo.
#[inline]
pub fn reflect(wo: DVec3, n: DVec3) -> DVec3 {
    n * (2.0 * n.dot(wo)) - wo
}
