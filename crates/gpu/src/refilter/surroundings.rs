//! The light that is refiltered, on the device.

use super::kernel;
use super::plan::Plan;
use crate::layout::filled;
use crate::packed::bytes;
use crate::{Gpu, GpuError};
use glam::DVec3;
use steradian_light::Lights;
use steradian_prefilter::{EdgeCube, SmallLight};
use steradian_sphere::quadrature::gauss_legendre;
use steradian_sphere::{Frame, Layout, SphereImage, sh};

/// Light on the device: an uploaded image with its suns, or the scene captured into a cube.
#[derive(Clone)]
pub struct Surroundings {
    pub(super) texels: wgpu::Buffer,
    /// 0 lat-long or 1 faces, width, height, angle of a texel.
    shape: [f32; 4],
    suns: Vec<SmallLight>,
    positive: bool,
}

impl Surroundings {
    /// Uploads distant light: the environment's image, disks and directional lights. For a sky of another
    /// hour call it again with the result of [`steradian_light::sky::by_name`].
    pub fn from_lights(gpu: &Gpu, lights: &Lights) -> Result<Self, GpuError> {
        if !lights.points.is_empty() {
            return Err(GpuError::Scene("environment maps have no place for point lights".into()));
        }
        let black = SphereImage::new(Layout::LatLong, 4, 2);
        let image = lights.environment.as_ref().map_or(&black, |e| &e.image);
        let mut out = Self::from_image(gpu, image)?;
        out.suns.extend(lights.disks.iter().map(SmallLight::from));
        out.suns.extend(lights.directionals.iter().map(SmallLight::from));
        Ok(out)
    }

    /// Uploads a lat-long image.
    pub fn from_image(gpu: &Gpu, image: &SphereImage) -> Result<Self, GpuError> {
        let (w, h) = (image.width, image.height);
        if image.layout != Layout::LatLong || w == 0 || h == 0 {
            return Err(GpuError::Scene("light to refilter is a lat-long image".into()));
        }
        let [r, g, b] = &image.planes;
        if [r, g, b].into_iter().flatten().any(|x| !x.is_finite()) {
            return Err(GpuError::Scene("light to refilter has texels that are not finite".into()));
        }
        fits(gpu, 16 * w as u64 * h as u64)?;
        let texels: Vec<f32> = (0..w * h).flat_map(|i| [r[i], g[i], b[i], 1.0]).collect();
        let data = bytes(&texels);
        let texels = gpu.scoped("light", || filled(gpu, "light", wgpu::BufferUsages::STORAGE, &data))?;
        let positive = image.planes.iter().flatten().all(|x| *x >= 0.0);
        let shape = [0.0, w as f32, h as f32, std::f32::consts::PI / h as f32];
        Ok(Self { texels, shape, suns: Vec::new(), positive })
    }

    /// Six pictures of `side` pixels from the inside of a cube.
    pub(super) fn of_faces(texels: wgpu::Buffer, side: usize) -> Self {
        let shape = [1.0, side as f32, side as f32, std::f32::consts::FRAC_PI_2 / side as f32];
        Self { texels, shape, suns: Vec::new(), positive: true }
    }

    /// Suns as points, as samples of mirrors and as coefficients: the shaders' `extras`.
    pub(super) fn extras(&self, plan: &Plan) -> Vec<u8> {
        let width = plan.levels().iter().map(|l| kernel::width(l.kernel)).fold(1.0, f64::min);
        let points: Vec<_> = self.suns.iter().flat_map(|s| points(s, width)).collect();
        let samples = self.samples(plan);
        let counts = [points.len() as f32, samples.len() as f32, f32::from(u8::from(self.positive)), 0.0];
        let mut rows = vec![counts, self.shape];
        for (d, flux) in &points {
            rows.push(d.as_vec3().extend(0.0).to_array());
            rows.push([flux[0] as f32, flux[1] as f32, flux[2] as f32, 0.0]);
        }
        rows.extend(samples.into_iter().flatten());
        let c = self.coefficients(2);
        rows.extend((0..9).map(|i| [c[0][i] as f32, c[1][i] as f32, c[2][i] as f32, 0.0]));
        bytes(rows.as_flattened())
    }

    /// Coefficients of the suns.
    pub(super) fn coefficients(&self, order: usize) -> [Vec<f64>; 3] {
        let mut out: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; sh::count(order)]);
        let mut y = vec![0.0; sh::count(order)];
        for sun in &self.suns {
            sh::eval(order, sun.direction, &mut y);
            for (l, b) in sun.spread(order).into_iter().enumerate() {
                for i in l * l..(l + 1) * (l + 1) {
                    (0..3).for_each(|c| out[c][i] += sun.flux[c] * b * y[i]);
                }
            }
        }
        out
    }

    /// Contributions of suns to the samples of mirrors: size, face, i, j and radiance, once for each size.
    fn samples(&self, plan: &Plan) -> Vec<[[f32; 4]; 2]> {
        let mirrors = plan.levels().iter().filter(|l| l.kernel.zonal().is_none());
        let mut sizes: Vec<u32> = mirrors.map(|l| l.size).collect();
        sizes.sort_unstable();
        sizes.dedup();
        if self.suns.is_empty() {
            return Vec::new();
        }
        sizes.into_iter().flat_map(|size| self.cube(size)).collect()
    }

    fn cube(&self, size: u32) -> Vec<[[f32; 4]; 2]> {
        let mut cube = EdgeCube::from_fn(size as usize, |_| [0.0; 3]);
        self.suns.iter().for_each(|s| cube.add(s));
        let row = size as usize + 1;
        let lit = cube.texels().iter().enumerate().filter(|(_, t)| t[..3] != [0.0; 3]);
        let entry = |(k, t): (usize, &[f32; 4])| {
            let at = [k / (row * row), k % row, k / row % row].map(|x| x as f32);
            [[size as f32, at[0], at[1], at[2]], [t[0], t[1], t[2], 0.0]]
        };
        lit.map(entry).collect()
    }
}

/// Is there space for so many bytes?
pub(super) fn fits(gpu: &Gpu, size: u64) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    if size > limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) {
        return Err(GpuError::Memory(format!("{size} bytes of light to refilter")));
    }
    Ok(())
}

/// Directions and fluxes whose sum over a kernel that varies over `width` is that over the disk:
/// Gauss–Legendre in the height 1 − cos θ, in which the area is uniform, and equal steps around.
fn points(sun: &SmallLight, width: f64) -> Vec<(DVec3, [f64; 3])> {
    let ratio = sun.radius / width;
    if ratio < 1.0 / 32.0 {
        return vec![(sun.direction, sun.flux)];
    }
    let rings = (1.0 + 2.0 * ratio).ceil().min(12.0) as usize;
    let around = 6 * rings;
    let frame = Frame::from_normal(sun.direction);
    let height = 2.0 * (0.5 * sun.radius).sin().powi(2);
    let (x, w) = gauss_legendre(rings);
    let mut out = Vec::new();
    for (k, (x, w)) in x.iter().zip(&w).enumerate() {
        let h = 0.5 * (1.0 + x) * height;
        let r = (h * (2.0 - h)).max(0.0).sqrt();
        for i in 0..around {
            let phi = std::f64::consts::TAU * (i as f64 + 0.5 * (k % 2) as f64) / around as f64;
            let d = frame.to_world(DVec3::new(r * phi.cos(), r * phi.sin(), 1.0 - h));
            out.push((d, sun.flux.map(|f| f * 0.5 * w / around as f64)));
        }
    }
    out
}
