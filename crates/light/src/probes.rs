//! Incident light that varies over space: spherical harmonics at the corners of a grid, interpolated (Kautz, Sloan & Snyder
//! 2002, *Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical Harmonics*, section 4).

use glam::{DVec3, UVec3};
use steradian_formats::{Tensor, TensorData, TensorFile};
use steradian_sphere::sh::ShRgb;
use thiserror::Error;

/// A light field: coefficients of incident radiance, W sr⁻¹ m⁻², over world axes, at `size` points of a box.
#[derive(Debug, Clone, PartialEq)]
pub struct Probes {
    /// The first probe and the last, metres.
    pub bounds: [DVec3; 2],
    /// Probes along x, y and z.
    pub size: UVec3,
    /// What each sees, x fastest, then y; `None` inside solids. All have the same order.
    pub light: Vec<Option<ShRgb>>,
}

/// What is wrong with a file of probes.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("no light field: {0}")]
pub struct NoProbes(String);

/// Most bands of a probe.
const MAX_BANDS: usize = 64;

impl Probes {
    /// Where probe `k` is.
    pub fn position(&self, k: usize) -> DVec3 {
        Self::positions(self.bounds, self.size, k)
    }

    /// Where probe `k` of a grid over `bounds` is: its corners and what divides it evenly; the middle along an axis with
    /// one probe.
    pub fn positions(bounds: [DVec3; 2], size: UVec3, k: usize) -> DVec3 {
        let [nx, ny, nz] = size.to_array().map(|n| n.max(1) as usize);
        let at = [k % nx, k / nx % ny, k / (nx * ny)];
        let part = |i: usize, n: usize| if n == 1 { 0.5 } else { i as f64 / (n - 1) as f64 };
        let t = DVec3::new(part(at[0], nx), part(at[1], ny), part(at[2], nz));
        bounds[0] + (bounds[1] - bounds[0]) * t
    }

    /// Incident light at `p`: trilinear between probes, of which those inside solids are left out and the weights of the
    /// others renormalised; outside the box that of its nearest point. `None` where all eight are inside solids, or p is
    /// not finite.
    pub fn at(&self, p: DVec3) -> Option<ShRgb> {
        let [lo, hi] = self.bounds;
        let size = self.size.to_array().map(|n| n.max(1) as usize);
        let mut corner = [[0usize; 2]; 3];
        let mut weight = [[0.0f64; 2]; 3];
        for k in 0..3 {
            let (n, extent) = (size[k], hi[k] - lo[k]);
            let x = if n == 1 || extent <= 0.0 { 0.0 } else { (p[k] - lo[k]) / extent * (n - 1) as f64 };
            if !x.is_finite() {
                return None;
            }
            let x = x.clamp(0.0, (n - 1) as f64);
            let i = (x as usize).min(n.saturating_sub(2));
            let f = x - i as f64;
            corner[k] = [i, (i + 1).min(n - 1)];
            weight[k] = [1.0 - f, f];
        }
        let mut out: Option<ShRgb> = None;
        let mut sum = 0.0;
        for c in 0..8usize {
            let [a, b, d] = [c & 1, c >> 1 & 1, c >> 2];
            let w = weight[0][a] * weight[1][b] * weight[2][d];
            let index = corner[0][a] + size[0] * (corner[1][b] + size[1] * corner[2][d]);
            let Some(Some(light)) = self.light.get(index) else { continue };
            if w <= 0.0 {
                continue;
            }
            let to = out.get_or_insert_with(|| ShRgb::zero(light.order));
            sum += w;
            for (to, from) in to.c.iter_mut().zip(&light.c) {
                to.iter_mut().zip(from).for_each(|(t, x)| *t += w * x);
            }
        }
        if let Some(light) = &mut out {
            light.c.iter_mut().flatten().for_each(|x| *x /= sum);
        }
        out
    }

    /// As tensors: `sh` (probes, 3, bands²), zeros inside solids; `outside` (probes), 1 or 0; `bounds` (2, 3); `size` (3).
    pub fn tensors(&self) -> TensorFile {
        let count = self.light.iter().flatten().map(|l| l.c[0].len()).next().unwrap_or(1);
        let mut sh = Vec::with_capacity(self.light.len() * 3 * count);
        for light in &self.light {
            match light {
                Some(light) => sh.extend(light.c.iter().flatten()),
                None => sh.resize(sh.len() + 3 * count, 0.0),
            }
        }
        let n = self.light.len();
        let outside = self.light.iter().map(|l| u32::from(l.is_some())).collect();
        let bounds = self.bounds.iter().flat_map(|b| b.to_array()).collect();
        let mut file = TensorFile::default();
        let whole = |data: Vec<u32>| Tensor { shape: vec![data.len()], data: TensorData::U32(data) };
        file.tensors.insert("sh".into(), Tensor::f64([n, 3, count], sh));
        file.tensors.insert("outside".into(), whole(outside));
        file.tensors.insert("bounds".into(), Tensor::f64([2, 3], bounds));
        file.tensors.insert("size".into(), whole(self.size.to_array().to_vec()));
        file
    }

    /// What [`Probes::tensors`] made.
    ///
    /// # Errors
    /// If a tensor is missing, of another shape or not finite.
    pub fn read(file: &TensorFile) -> Result<Self, NoProbes> {
        let tensor = |name: &str| file.require(name).map_err(NoProbes);
        let wrong = |why: &str| NoProbes(why.into());
        let bounds = tensor("bounds")?.data.to_f64();
        let (&[a, b, c, d, e, f], TensorData::U32(size)) = (&*bounds, &tensor("size")?.data) else {
            return Err(wrong("'bounds' are 6 numbers and 'size' whole ones"));
        };
        let &[x, y, z] = size.as_slice() else { return Err(wrong("'size' is 3 numbers")) };
        let TensorData::U32(outside) = &tensor("outside")?.data else {
            return Err(wrong("'outside' is of whole numbers"));
        };
        let sh = tensor("sh")?;
        let n = [x, y, z].iter().try_fold(1usize, |n, k| n.checked_mul(*k as usize));
        let &[probes, 3, count] = sh.shape.as_slice() else {
            return Err(wrong("'sh' is of probes, 3 channels and squares of bands"));
        };
        let bands = count.isqrt();
        if n != Some(probes) || probes == 0 || outside.len() != probes {
            return Err(wrong("its grid and its probes differ in number"));
        }
        if bands == 0 || bands > MAX_BANDS || bands * bands != count {
            return Err(NoProbes(format!("{count} coefficients are no square of 1 to {MAX_BANDS} bands")));
        }
        let values = sh.data.to_f64();
        if !values.iter().chain(bounds.iter()).all(|v| v.is_finite()) {
            return Err(wrong("a number is not finite"));
        }
        let light = values.chunks_exact(3 * count).zip(outside).map(|(v, outside)| {
            (*outside != 0).then(|| ShRgb {
                order: bands - 1,
                c: [0, 1, 2].map(|k| v[k * count..(k + 1) * count].to_vec()),
            })
        });
        Ok(Self {
            bounds: [DVec3::new(a, b, c), DVec3::new(d, e, f)],
            size: UVec3::new(x, y, z),
            light: light.collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coefficients that are linear in position.
    fn linear(p: DVec3) -> ShRgb {
        let mut sh = ShRgb::zero(2);
        for (c, values) in sh.c.iter_mut().enumerate() {
            for (i, v) in values.iter_mut().enumerate() {
                *v = 0.3 * i as f64 + p.dot(DVec3::new(1.0 + c as f64, -0.5, 0.1 * i as f64));
            }
        }
        sh
    }

    fn field() -> Probes {
        let (bounds, size) = ([DVec3::new(-1.0, 0.0, 2.0), DVec3::new(2.0, 1.5, 4.0)], UVec3::new(4, 3, 2));
        let light = (0..24).map(|k| Some(linear(Probes::positions(bounds, size, k)))).collect();
        Probes { bounds, size, light }
    }

    fn distance(a: &ShRgb, b: &ShRgb) -> f64 {
        a.c.iter().flatten().zip(b.c.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_linear_field_is_reproduced() {
        let field = field();
        for k in 0..200 {
            let part = |a: f64| (0.5 + f64::from(k) * a).fract();
            let t = DVec3::new(part(0.819), part(0.671), part(0.549));
            let p = field.bounds[0] + t * (field.bounds[1] - field.bounds[0]);
            assert!(distance(&field.at(p).unwrap(), &linear(p)) < 1e-12);
        }
        // Outside it is that of the nearest point of the box.
        let nearest = linear(DVec3::new(2.0, 0.0, 3.0));
        assert!(distance(&field.at(DVec3::new(9.0, -7.0, 3.0)).unwrap(), &nearest) < 1e-12);
    }

    #[test]
    fn light_has_no_seam_at_the_borders_of_cells() {
        let mut field = field();
        for (k, light) in field.light.iter_mut().enumerate() {
            light.as_mut().unwrap().c[0][0] = ((k * 7) % 11) as f64;
        }
        // x = 0 and y = 0.75 are borders between cells.
        for border in [DVec3::new(0.0, 0.4, 3.1), DVec3::new(0.4, 0.75, 3.1)] {
            for e in [DVec3::X, DVec3::Y] {
                let [a, b] = [-1e-9, 1e-9].map(|s| field.at(border + s * e).unwrap());
                assert!(distance(&a, &b) < 1e-6);
            }
        }
    }

    /// The light of an interpolation is a mean of the probes that there are.
    #[test]
    fn probes_inside_solids_are_left_out() {
        let mut field = field();
        let all = ShRgb { order: 2, c: std::array::from_fn(|_| vec![2.5; 9]) };
        field.light.fill(Some(all.clone()));
        for k in [0, 5, 6, 13, 22] {
            field.light[k] = None;
        }
        let p = DVec3::new(-0.7, 0.3, 2.6);
        assert!(distance(&field.at(p).unwrap(), &all) < 1e-12);
        assert_eq!(field.at(field.position(0)), None);
        field.light.fill(None);
        assert_eq!(field.at(p), None);
        assert_eq!(field.at(DVec3::NAN), None);
    }

    #[test]
    fn files_come_back_and_their_faults_are_said() {
        let mut field = field();
        field.light[3] = None;
        let file = field.tensors();
        assert_eq!(Probes::read(&file).unwrap(), field);
        let fails = |change: &dyn Fn(&mut TensorFile)| {
            let mut file = file.clone();
            change(&mut file);
            Probes::read(&file).unwrap_err().to_string()
        };
        assert!(fails(&|f| drop(f.tensors.remove("sh"))).contains("'sh'"));
        assert!(fails(&|f| f.tensors.get_mut("sh").unwrap().shape = vec![24, 27]).contains("channels"));
        assert!(fails(&|f| f.tensors.get_mut("sh").unwrap().shape = vec![27, 3, 8]).contains("differ"));
        let size = |n: u32| Tensor { shape: vec![3], data: TensorData::U32(vec![n; 3]) };
        assert!(fails(&|f| drop(f.tensors.insert("size".into(), size(u32::MAX)))).contains("differ"));
        let mut bad = file.tensors["sh"].data.to_f64().to_vec();
        bad[7] = f64::NAN;
        assert!(
            fails(&|f| f.tensors.get_mut("sh").unwrap().data = TensorData::F64(bad.clone()))
                .contains("finite")
        );
    }
}
