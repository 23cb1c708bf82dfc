//! Required contents of a `.bsdf` file, and the numbers of it that are used.

use super::super::spectrum;
use std::collections::BTreeMap;
use steradian_base::brief;
use steradian_formats::Tensor;

/// An array of any number of dimensions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Array {
    pub shape: Vec<usize>,
    pub values: Vec<f32>,
}

/// The arrays, in the order in which they are kept: φ_i, θ_i, σ, D, visible D, luminance, colours, and
/// whether the colours are to be multiplied by D/(4σ).
#[derive(Debug, Clone)]
pub(super) struct Arrays(pub [Array; 8]);

/// Numbers of one array at most: 256 MiB.
const MAX_NUMBERS: usize = 64 << 20;

impl Arrays {
    /// The arrays of a file, checked, and the count of negative numbers, which are set to 0.
    pub fn of_file(fields: &BTreeMap<String, Tensor>) -> Result<(Self, usize), String> {
        let array = |name: &str| -> Result<Array, String> {
            let names = || fields.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            let found = fields
                .get(name)
                .ok_or_else(|| format!("has no field '{name}'; it has {}", brief(&names())))?;
            Ok(Array { shape: found.shape.clone(), values: found.data.to_f32().into_owned() })
        };
        let colours = if fields.contains_key("rgb") {
            array("rgb")?
        } else {
            coloured(&array("spectra")?, &array("wavelengths")?)?
        };
        let jacobian = array("jacobian").unwrap_or(Array { shape: vec![1], values: vec![1.0] });
        let mut all = Self([
            array("phi_i")?,
            array("theta_i")?,
            array("sigma")?,
            array("ndf")?,
            array("vndf")?,
            array("luminance")?,
            colours,
            jacobian,
        ]);
        all.check()?;
        let mut negative = 0;
        for a in &mut all.0[2..7] {
            for v in a.values.iter_mut().filter(|v| **v < 0.0) {
                *v = 0.0;
                negative += 1;
            }
        }
        Ok((all, negative))
    }

    /// See [`crate::Brdf::held`]: per array the number of dimensions, the dimensions, the numbers.
    pub fn numbers(&self) -> Vec<f64> {
        let mut out = Vec::new();
        for a in &self.0 {
            out.push(a.shape.len() as f64);
            out.extend(a.shape.iter().map(|d| *d as f64));
            out.extend(a.values.iter().map(|v| f64::from(*v)));
        }
        out
    }

    /// [`Arrays::numbers`] undone.
    pub fn of_numbers(mut numbers: &[f64]) -> Option<Self> {
        let whole = |x: f64| (x >= 0.0 && x <= MAX_NUMBERS as f64 && x.fract() == 0.0).then_some(x as usize);
        let mut next = || -> Option<Array> {
            let (dimensions, rest) = numbers.split_first()?;
            let (shape, rest) = rest.split_at_checked(whole(*dimensions).filter(|d| *d <= 8)?)?;
            let shape: Vec<usize> = shape.iter().map(|d| whole(*d)).collect::<Option<_>>()?;
            let count = shape.iter().try_fold(1usize, |n, d| n.checked_mul(*d))?;
            let (values, rest) = rest.split_at_checked(count)?;
            numbers = rest;
            Some(Array { shape, values: values.iter().map(|v| *v as f32).collect() })
        };
        let all: Vec<Array> = (0..8).map(|_| next()).collect::<Option<_>>()?;
        let all = Self(all.try_into().ok()?);
        (numbers.is_empty() && all.check().is_ok()).then_some(all)
    }

    /// Dimensions that go together, finite numbers.
    fn check(&self) -> Result<(), String> {
        let [phi, theta, sigma, ndf, vndf, luminance, colours, jacobian] = &self.0;
        let names = ["phi_i", "theta_i", "sigma", "ndf", "vndf", "luminance", "rgb or spectra", "jacobian"];
        for (a, name) in self.0.iter().zip(names) {
            let count = a.shape.iter().try_fold(1usize, |n, d| n.checked_mul(*d));
            if count != Some(a.values.len()) || a.values.is_empty() || a.values.len() > MAX_NUMBERS {
                return Err(format!("field '{name}' of shape {:?} does not fit", a.shape));
            }
            if let Some(v) = a.values.iter().find(|v| !v.is_finite()) {
                return Err(format!("field '{name}' holds {v}"));
            }
        }
        for (a, name) in [(phi, "phi_i"), (theta, "theta_i")] {
            if a.shape.len() != 1 || a.values.windows(2).any(|w| w[0] >= w[1]) {
                return Err(format!("field '{name}' is no ascending list"));
            }
        }
        let (np, nt) = (phi.values.len(), theta.values.len());
        let plane = |a: &Array, name: &str, front: &[usize]| -> Result<(), String> {
            let (head, tail) = a.shape.split_at(a.shape.len().saturating_sub(2));
            let fits = head == front && tail.len() == 2 && tail.iter().all(|d| *d >= 2);
            if fits {
                Ok(())
            } else {
                Err(format!("field '{name}' has the shape {:?}, not {front:?} and two more", a.shape))
            }
        };
        plane(sigma, names[2], &[])?;
        plane(ndf, names[3], &[])?;
        plane(vndf, names[4], &[np, nt])?;
        plane(luminance, names[5], &[np, nt])?;
        plane(colours, names[6], &[np, nt, 3])?;
        if jacobian.values.len() != 1 {
            return Err("field 'jacobian' is not one number".into());
        }
        Ok(())
    }
}

/// [φ][θ][wavelength][y][x] → [φ][θ][3][y][x].
fn coloured(spectra: &Array, wavelengths: &Array) -> Result<Array, String> {
    let &[np, nt, nw, h, w] = spectra.shape.as_slice() else {
        return Err(format!("field 'spectra' has the shape {:?}, not five dimensions", spectra.shape));
    };
    let nm: Vec<f64> = wavelengths.values.iter().map(|v| f64::from(*v)).collect();
    if nm.len() != nw {
        return Err(format!("field 'wavelengths' has {} lengths for {nw} spectra", nm.len()));
    }
    let plane = h.checked_mul(w).filter(|n| *n > 0).ok_or("field 'spectra' is empty")?;
    let weights = spectrum::weights_of(&nm)?;
    let mut values = Vec::with_capacity(np * nt * 3 * plane);
    for slice in spectra.values.chunks_exact(nw * plane) {
        for c in 0..3 {
            values.extend((0..plane).map(|i| {
                let sum: f64 =
                    weights.iter().enumerate().map(|(k, w)| w[c] * f64::from(slice[k * plane + i])).sum();
                // Outside Rec. 709 a channel would be negative.
                sum.max(0.0) as f32
            }));
        }
    }
    Ok(Array { shape: vec![np, nt, 3, h, w], values })
}
