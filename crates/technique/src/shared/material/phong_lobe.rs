//! The reflectance's factor of techniques that convolve with Phong's lobe at the mirror direction.

use crate::Part;
use crate::shared::maths::harmonics;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use steradian_brdf::{Brdf, Domain, Form};
use steradian_sphere::sh::zonal;

/// Phong's lobe: f_cos = factor · (r·wi)₊ⁿ above the horizon.
#[derive(Debug, Clone, PartialEq)]
pub struct PhongLobe {
    n: f64,
    /// Factor per channel.
    pub factor: [f64; 3],
}

impl PhongLobe {
    /// The lobe of a reflectance that [`PhongLobe::materials`] accepts.
    pub fn of(brdf: &dyn Brdf) -> Self {
        let Form::Phong { n, factor, .. } = brdf.form() else { return Self { n: 1.0, factor: [0.0; 3] } };
        Self { n, factor }
    }

    /// Takes `phong` ([`crate::Card::materials`]).
    pub fn materials(brdf: &dyn Brdf) -> Result<(), String> {
        match brdf.form() {
            Form::Phong { domain: Domain::Hemisphere, .. } => Ok(()),
            _ => Err(format!("takes phong, whose lobe ends at the horizon, not {}", brdf.info().name)),
        }
    }

    /// k_l of every coefficient l² + l + m of so many bands.
    pub fn scale(&self, bands: usize) -> Vec<f32> {
        let kernel = self.kernel(bands - 1);
        (0..bands * bands).map(|i| kernel[i.isqrt()] as f32).collect()
    }

    /// `fn lobe(r: vec3<f32>) -> array<f32, N>` in WGSL: k_l y_lm(r).
    pub fn wgsl(&self, bands: usize) -> String {
        let times = |(i, k): (usize, &f32)| format!("    y[{i}] *= {k:?};\n");
        let scale: String = self.scale(bands).iter().enumerate().map(times).collect();
        format!(
            "{}// Coefficients of Phong's lobe about r.\nfn lobe(r: vec3<f32>) -> array<f32, {}> {{\n    var y = harmonics(r);\n{scale}    return y;\n}}\n",
            harmonics::wgsl(bands - 1),
            bands * bands
        )
    }

    /// The text of [`PhongLobe::wgsl`] without k_l.
    pub fn plain_wgsl(bands: usize) -> String {
        format!(
            "{}fn lobe(r: vec3<f32>) -> array<f32, {}> {{\n    return harmonics(r);\n}}\n",
            harmonics::wgsl(bands - 1),
            bands * bands
        )
    }

    /// Does a file hold one?
    pub fn is_kept(from: &TensorFile, prefix: &str) -> bool {
        from.tensors.contains_key(&format!("{prefix}.phong"))
    }

    /// k_l without the factor, l = 0 … order.
    pub fn kernel(&self, order: usize) -> Vec<f64> {
        zonal::phong(order, self.n)
    }
}

impl Part for PhongLobe {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let [r, g, b] = self.factor;
        put_f64(to, format!("{prefix}.phong"), vec![4], vec![self.n, r, g, b]);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.phong");
        match get_f64(from, &name, 1)?.1[..] {
            [n, r, g, b] if n > -1.0 => Ok(Self { n, factor: [r, g, b] }),
            _ => Err(PartError::Unexpected(name)),
        }
    }

    fn bytes(&self) -> usize {
        32
    }
}
