//! The frame state of techniques that look light up by direction: the light's rotation.

use crate::gpu::{Uniform, Value};
use glam::Mat3;

/// World to light: the inverse of the light's rotation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LightRotation(Mat3);

impl LightRotation {
    /// The frame in which the light is turned by `rotation`.
    pub fn new(rotation: Mat3) -> Self {
        Self(rotation.transpose())
    }

    /// The direction at bake time that `d` shows now.
    #[inline(always)]
    pub fn apply(&self, d: [f32; 3]) -> [f32; 3] {
        let (a, b, c) = (self.0.x_axis, self.0.y_axis, self.0.z_axis);
        let [x, y, z] = d;
        [a.x * x + b.x * y + c.x * z, a.y * x + b.y * y + c.y * z, a.z * x + b.z * y + c.z * z]
    }

    /// `technique.turn` in WGSL.
    pub fn uniform(&self) -> Uniform {
        Uniform { name: "turn", value: Value::Mat3(self.0.to_cols_array_2d()) }
    }
}
