//! Functions of order 2 on the sphere ([`Quadric`]) in files and on GPUs.

use crate::Part;
use crate::gpu::{Uniform, Value};
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use glam::Mat4;
pub use steradian_sphere::sh::Quadric;

/// The matrices as uniforms `names`.
pub fn uniforms(q: &Quadric, names: [&'static str; 3]) -> impl Iterator<Item = Uniform> {
    let m = q.0;
    (0..3).map(move |k| Uniform { name: names[k], value: Value::Mat4(m[k].to_cols_array_2d()) })
}

impl Part for Quadric {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let data = self.0.iter().flat_map(Mat4::to_cols_array).collect();
        put_f32(to, format!("{prefix}.quadric"), vec![3, 4, 4], data);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.quadric");
        let (shape, v) = get_f32(from, &name, 3)?;
        if shape != [3, 4, 4] {
            return Err(PartError::Unexpected(name));
        }
        Ok(Self(std::array::from_fn(|k| Mat4::from_cols_array(&std::array::from_fn(|i| v[16 * k + i])))))
    }

    fn bytes(&self) -> usize {
        3 * 64
    }
}
