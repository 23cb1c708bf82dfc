//! Lights that are shaded with the exact reflectance, in addition to the light that a technique has in its
//! data.
//!
//! > L_o += Σ_disks L ∫_disk f(wi, wo)⟨n·wi⟩ dwi + Σ_directional E f⟨n·wi⟩ + Σ_points I/r² f⟨n·wi⟩
//!
//! Every technique can be lit by such lights, whatever its own factors are made of: [`split`] says which
//! lights go into a technique's data and which are added here. They are unshadowed (V = 1), as in techniques
//! without geometry and in the reference, or shadowed by occluders ([`Shadows`]), as with techniques that
//! have geometry. Disks are integrated by rules whose size follows from the reflectance's width there
//! ([`steradian_brdf::Peak`]), in elevation and azimuth where grazing views see them at the horizon: relative
//! to the largest radiance that the disk causes, the error is at most about 1e-3 and mostly far below
//! ([`rule`]); 4e-3 at grazing views of metals whose lobe is a thousand times narrower than the disk. Light
//! rotation turns disks and directional lights, not point lights.

mod adaptive;
mod cell;
mod horizon;
pub mod rule;
mod shadow;
#[cfg(test)]
mod tests;

use crate::{Points, Radiance, View};
use glam::DVec3;
use horizon::Horizon;
use rule::Cap;
use shadow::Place;
pub use shadow::Shadows;
use std::f64::consts::TAU;
use std::sync::Arc;
pub use steradian_brdf::BrdfShader;
use steradian_brdf::{Brdf, Domain};
use steradian_light::{CellLight, DirectionalLight, DiskLight, LARGEST, Lights, PointLight};
use steradian_sphere::Frame;

/// `gpu_disk(c, radius, wo) -> vec3<f32>`, the integral of f_cos over a disk in the local frame: the WGSL
/// twin of [`Direct::radiance`]'s. It calls `brdf_value`, `brdf_scale` and `brdf_is_whole` of
/// [`BrdfShader::wgsl`], and `gpu_node(i: u32) -> vec2<f32>`, entry i of [`rule::gauss`].
pub const DISK_WGSL: &str = concat!(include_str!("horizon.wgsl"), include_str!("disk.wgsl"));

/// [`DISK_WGSL`] with its `gpu_node`, and `gpu_cell(pole, meridian, theta, half, wo) -> vec3<f32>`, the twin
/// of the integral over a [`CellLight`].
pub fn suns_wgsl() -> String {
    const CELL_WGSL: &str = include_str!("cell.wgsl");
    let nodes: Vec<String> = rule::gauss().map(|(x, w)| format!("vec2<f32>({x:?}, {w:?})")).collect();
    format!(
        "{DISK_WGSL}{CELL_WGSL}
var<private> gpu_gauss: array<vec2<f32>, {}> = array<vec2<f32>, {}>({});

fn gpu_node(i: u32) -> vec2<f32> {{
    return gpu_gauss[i];
}}
",
        nodes.len(),
        nodes.len(),
        nodes.join(", ")
    )
}

/// How disks and directional lights are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Suns {
    /// They are shaded with the exact reflectance.
    #[default]
    Exact,
    /// They become part of a technique's data, as published techniques take them.
    Fold,
}

/// Lights that are shaded with the exact reflectance.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Direct {
    /// Suns.
    pub disks: Vec<DiskLight>,
    /// Suns of images, texel by texel.
    pub cells: Vec<CellLight>,
    /// Directional lights.
    pub directionals: Vec<DirectionalLight>,
    /// Point lights: radiant intensity over the square of the distance.
    pub points: Vec<PointLight>,
}

/// Splits `lights` into those that a technique bakes and those that are shaded exactly. Point lights are
/// always shaded exactly; disks of at most 20 degrees (0.35 radians) radius and directional lights are with
/// [`Suns::Exact`], and the baked lights then keep a copy of them in [`Lights::apart`], for what surfaces
/// reflect of them.
pub fn split(lights: &Lights, suns: Suns) -> (Lights, Direct) {
    let mut baked = lights.clone();
    let mut direct = Direct { points: std::mem::take(&mut baked.points), ..Direct::default() };
    if suns == Suns::Exact {
        (direct.disks, baked.disks) = std::mem::take(&mut baked.disks)
            .into_iter()
            .partition(|d| d.angular_radius <= DiskLight::WIDEST_SUN);
        direct.directionals = std::mem::take(&mut baked.directionals);
        let apart = Lights {
            disks: direct.disks.clone(),
            directionals: direct.directionals.clone(),
            ..Lights::default()
        };
        let any = !apart.disks.is_empty() || !apart.directionals.is_empty();
        baked.apart = any.then(|| Arc::new(apart));
    }
    (baked, direct)
}

impl Direct {
    /// No lights at all?
    pub fn is_empty(&self) -> bool {
        let distant = self.disks.len() + self.cells.len() + self.directionals.len();
        distant == 0 && self.points.is_empty()
    }

    /// The lights of a frame: distant ones turn with the light's rotation.
    pub fn turned(&self, view: &View) -> Self {
        let turn = view.light_rotation.as_dmat3();
        let mut out = self.clone();
        out.disks.iter_mut().for_each(|d| d.direction = (turn * d.direction).normalize_or(d.direction));
        out.cells.iter_mut().for_each(|c| *c = c.turned(&turn));
        out.directionals
            .iter_mut()
            .for_each(|d| d.direction = (turn * d.direction).normalize_or(d.direction));
        out
    }

    /// Adds the radiance that leaves the points of `q` to `out`. Points that face away get nothing; point
    /// lights give nothing where the batch has no positions.
    pub fn add(&self, brdf: &dyn Brdf, q: &Points<'_>, out: &mut Radiance<'_>) {
        self.add_behind(None, brdf, q, out);
    }

    /// [`Direct::add`] with shadows, where the batch has positions.
    pub fn add_behind(
        &self,
        shadows: Option<Shadows<'_>>,
        brdf: &dyn Brdf,
        q: &Points<'_>,
        out: &mut Radiance<'_>,
    ) {
        if self.is_empty() || !q.is_consistent() || out.rgb.iter().any(|p| p.len() != q.len()) {
            return;
        }
        let at = |v: &[&[f32]; 3], i: usize| DVec3::from_array(v.map(|c| f64::from(c[i])));
        for i in 0..q.len() {
            let (n, wo) = (at(&q.n, i).normalize_or_zero(), at(&q.wo, i).normalize_or_zero());
            let facing = n.dot(wo) > 0.0;
            if !facing {
                continue;
            }
            let frame = match q.t[0].is_empty() {
                true => Frame::from_normal(n),
                false => Frame::from_normal_tangent(n, at(&q.t, i)),
            };
            let p = (!q.p[0].is_empty()).then(|| at(&q.p, i));
            let place = shadows.zip(p).map(|(shadows, position)| Place { shadows, position, normal: n });
            let l = self.arriving(brdf, &frame, wo, p, place);
            let single = |x: f64| x.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
            (0..3).for_each(|c| out.rgb[c][i] += single(l[c]));
        }
    }

    /// Radiance that leaves one point towards unit `wo` (world space), unshadowed.
    pub fn radiance(&self, brdf: &dyn Brdf, frame: &Frame, wo: DVec3, position: Option<DVec3>) -> [f64; 3] {
        self.arriving(brdf, frame, wo, position, None)
    }

    /// Bit k is set where the centre of light k, of the first 64, is visible from a point of unit normal
    /// `normal`. A shadow's edge runs between points whose bits differ.
    pub fn seen_from(&self, shadows: Shadows<'_>, position: DVec3, normal: DVec3) -> u64 {
        let place = Place { shadows, position, normal };
        let disks = self.disks.iter().map(|d| d.direction);
        let cells = self.cells.iter().map(|c| c.inside(0.5, 0.5));
        let distant = disks.chain(cells).chain(self.directionals.iter().map(|d| d.direction));
        let distant = distant.map(|d| (d, f64::INFINITY));
        let near = self.points.iter().map(|p| {
            let to = p.position.as_dvec3() - position;
            (to.normalize_or_zero(), to.length())
        });
        // At the horizon light fades out, without an edge.
        let seen = |(d, distance): (DVec3, f64)| d.dot(normal) <= 0.0 || place.sees(d, distance);
        distant.chain(near).take(64).enumerate().map(|(k, light)| u64::from(seen(light)) << k).sum()
    }

    fn arriving(
        &self,
        brdf: &dyn Brdf,
        frame: &Frame,
        wo: DVec3,
        position: Option<DVec3>,
        place: Option<Place<'_>>,
    ) -> [f64; 3] {
        let wo = frame.to_local(wo);
        let luminous = |d: DVec3| brdf.f_cos(frame.to_local(d), wo).iter().sum::<f64>();
        let open = |d: DVec3, distance: f64| place.map_or(1.0, |p| p.arriving(d, distance));
        let mut sum = [0.0; 3];
        let mut gather =
            |value: [f64; 3], times: [f64; 3]| (0..3).for_each(|c| sum[c] += value[c] * times[c]);
        for d in &self.disks {
            let cap = Cap { centre: frame.to_local(d.direction), radius: d.angular_radius };
            let value = disk(brdf, &cap, wo);
            let seen = match place.filter(|_| value != [0.0; 3]) {
                Some(p) => {
                    let top = 2.0 * (0.5 * d.angular_radius).sin().powi(2);
                    let around = Cap { centre: d.direction, radius: d.angular_radius };
                    p.seen(|x, y| around.direction(x * top, TAU * y), luminous)
                }
                None => 1.0,
            };
            gather(value, d.radiance.map(|l| l * seen));
        }
        for c in &self.cells {
            let value = cell::integral(c, brdf, frame, wo);
            let seen = match place.filter(|_| value != [0.0; 3]) {
                Some(p) => p.seen(|x, y| c.inside(x, y), luminous),
                None => 1.0,
            };
            gather(value, c.radiance.map(|l| l * seen));
        }
        for d in &self.directionals {
            let value = brdf.f_cos(frame.to_local(d.direction), wo);
            if value != [0.0; 3] {
                let open = open(d.direction, f64::INFINITY);
                gather(value, d.irradiance.map(|e| e * open));
            }
        }
        for (p, from) in self.points.iter().zip(std::iter::repeat(position)) {
            let Some(from) = from else { break };
            let to = p.position.as_dvec3() - from;
            let d2 = to.length_squared();
            if d2 > 0.0 {
                let f = brdf.f_cos(frame.to_local(to / d2.sqrt()), wo);
                if f != [0.0; 3] {
                    let open = open(to / d2.sqrt(), d2.sqrt());
                    // On the light itself the irradiance is infinite; it is clamped to the range of single
                    // precision.
                    gather(f, p.intensity.map(|i| open * (f64::from(i) / d2).clamp(-LARGEST, LARGEST)));
                }
            }
        }
        sum
    }
}

/// ∫ f_cos over a disk, per channel.
fn disk(brdf: &dyn Brdf, cap: &Cap, wo: DVec3) -> [f64; 3] {
    let whole = brdf.domain() == Domain::Sphere;
    let reach = cap.radius.sin();
    if !whole && cap.radius < 1.5 && cap.centre.z <= -reach {
        return [0.0; 3];
    }
    let crossed = !whole && (cap.radius >= 1.5 || cap.centre.z < reach);
    let scale = brdf.peak().scale(cap.centre, wo, cap.radius);
    let f = |wi: DVec3| brdf.f_cos(wi, wo);
    if let Some(h) = Horizon::of(brdf, cap.centre, cap.radius, scale, wo) {
        return h.disk(cap.centre, cap.radius, &f);
    }
    match rule::rings(cap.radius / scale, crossed) {
        Some(n) if crossed => cap.strips(n, f),
        Some(n) => cap.polar(n, f),
        None => {
            let scale = |wi, radius| brdf.peak().scale(wi, wo, radius);
            adaptive::cap(cap, &scale, &|wi, out| brdf.f_cos_batch(wi, wo, out))
        }
    }
}
