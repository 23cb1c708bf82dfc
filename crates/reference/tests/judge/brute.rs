//! The integral once more, by brute force and other code: Gauss–Legendre on small pieces of every texel;
//! pieces that the horizon crosses are halved many times.

use crate::support::{difference, reference, stormy, view};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_brdf::{Brdf, Domain};
use steradian_light::{DiskLight, Lights};
use steradian_reference::{Lookup, Reference};
use steradian_sphere::quadrature::gauss_legendre;
use steradian_sphere::{Frame, SphereImage};

/// Reads radiance at a direction given by (φ, θ).
type Light<'a> = &'a dyn Fn(f64, f64) -> [f64; 3];

pub struct Brute<'a> {
    brdf: &'a dyn Brdf,
    frame: Frame,
    wo: DVec3,
    rule: (Vec<f64>, Vec<f64>),
}

impl<'a> Brute<'a> {
    pub fn new(brdf: &'a dyn Brdf, frame: Frame, wo: DVec3) -> Self {
        Self { brdf, frame, wo: frame.to_local(wo), rule: gauss_legendre(8) }
    }

    fn local(&self, phi: f64, theta: f64) -> DVec3 {
        let d = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        self.frame.to_local(d)
    }

    fn piece(&self, p: [f64; 2], t: [f64; 2], depth: u32, light: Light<'_>, sum: &mut [f64; 3]) {
        if self.brdf.domain() == Domain::Hemisphere {
            let radius = 0.5 * (p[1] - p[0]).hypot(t[1] - t[0]);
            let z = self.local(0.5 * (p[0] + p[1]), 0.5 * (t[0] + t[1])).z;
            if z.abs() > radius.sin() {
                if z < 0.0 {
                    return;
                }
            } else if depth > 0 {
                let (mp, mt) = (0.5 * (p[0] + p[1]), 0.5 * (t[0] + t[1]));
                for p in [[p[0], mp], [mp, p[1]]] {
                    for t in [[t[0], mt], [mt, t[1]]] {
                        self.piece(p, t, depth - 1, light, sum);
                    }
                }
                return;
            }
        }
        self.gauss(p, t, light, sum);
    }

    fn gauss(&self, p: [f64; 2], t: [f64; 2], light: Light<'_>, sum: &mut [f64; 3]) {
        let (x, w) = &self.rule;
        let (hp, ht) = (0.5 * (p[1] - p[0]), 0.5 * (t[1] - t[0]));
        for a in 0..x.len() {
            for b in 0..x.len() {
                let (phi, theta) = (0.5 * (p[0] + p[1]) + hp * x[a], 0.5 * (t[0] + t[1]) + ht * x[b]);
                let f = self.brdf.f_cos(self.local(phi, theta), self.wo);
                let l = light(phi, theta);
                for c in 0..3 {
                    sum[c] += f[c] * l[c] * theta.sin() * w[a] * w[b] * hp * ht;
                }
            }
        }
    }

    /// The sum over every texel, each cut into pieces × pieces; the horizon is resolved by `depth` more
    /// halvings.
    pub fn sum(&self, image: &SphereImage, pieces: usize, depth: u32) -> [f64; 3] {
        let (w, h) = (image.width, image.height);
        let mut sum = [0.0; 3];
        let step = [2.0 * PI / (w * pieces) as f64, PI / (h * pieces) as f64];
        for j in 0..h * pieces {
            for i in 0..w * pieces {
                let l = image.texel(0, i / pieces, j / pieces).map(f64::from);
                if l == [0.0; 3] {
                    continue;
                }
                let p = [i as f64 * step[0] - PI, (i + 1) as f64 * step[0] - PI];
                let t = [j as f64 * step[1], (j + 1) as f64 * step[1]];
                self.piece(p, t, depth, &|_, _| l, &mut sum);
            }
        }
        sum
    }

    /// The sum with radiance from `light`, on a grid of cells × cells/2 over the sphere.
    pub fn smooth(&self, light: Light<'_>, cells: usize, depth: u32) -> [f64; 3] {
        let step = 2.0 * PI / cells as f64;
        let mut sum = [0.0; 3];
        for j in 0..cells / 2 {
            for i in 0..cells {
                let p = [i as f64 * step - PI, (i + 1) as f64 * step - PI];
                let t = [j as f64 * step, (j + 1) as f64 * step];
                self.piece(p, t, depth, light, &mut sum);
            }
        }
        sum
    }
}

#[test]
fn models_at_every_angle() {
    for (spec, pieces) in [
        ("lambert", 1),
        ("phong:n=30", 1),
        ("phong-map:n=100", 2),
        ("ggx:alpha=0.3", 2),
        ("ggx:alpha=0.1", 4),
    ] {
        let Ok(brdf) = steradian_brdf::parse(spec) else { continue };
        for (k, angle) in [0.0, 40.0, 85.0].into_iter().enumerate() {
            let sky = stormy(48, 24, k as u64 + 1);
            let (frame, wo) = view(DVec3::new(0.3, 0.2 - k as f64 * 0.3, 0.8), angle, 0.9);
            let truth = Brute::new(brdf.as_ref(), frame, wo).sum(&sky, pieces, 7);
            let e = reference(sky, Lookup::Constant).radiance(brdf.as_ref(), &frame, wo, None, 1e-4);
            let d = difference(e.rgb, truth);
            assert!(d <= e.error + 2e-6, "{spec} {angle}: off by {d:.1e}, said {:.1e}", e.error);
            assert!(e.error <= 1.001e-4);
        }
    }
}

/// Bilinear lookup in other code: along φ, then along θ, rows beyond the poles from the opposite side.
fn bilinear(image: &SphereImage, phi: f64, theta: f64) -> [f64; 3] {
    let (w, h) = (image.width as i64, image.height as i64);
    let x = (phi / (2.0 * PI) + 0.5) * w as f64 - 0.5;
    let y = theta / PI * h as f64 - 0.5;
    let (x0, y0) = (x.floor(), y.floor());
    let (u, v) = (x - x0, y - y0);
    let texel = |i: i64, j: i64| {
        let (i, j) = if j < 0 {
            (i + w / 2, 0)
        } else if j >= h {
            (i + w / 2, h - 1)
        } else {
            (i, j)
        };
        image.texel(0, i.rem_euclid(w) as usize, j as usize).map(f64::from)
    };
    let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(k, l)| texel(x0 as i64 + k, y0 as i64 + l));
    std::array::from_fn(|k| (a[k] * (1.0 - u) + b[k] * u) * (1.0 - v) + (c[k] * (1.0 - u) + d[k] * u) * v)
}

#[test]
fn bilinear_lookup() {
    for spec in ["lambert", "phong:n=5", "ggx:alpha=0.3"] {
        let brdf = steradian_brdf::parse(spec).expect("a known model");
        for (k, n) in
            [DVec3::Y, DVec3::new(-0.9, 0.1, 0.02), DVec3::new(0.1, -1.0, 0.3)].into_iter().enumerate()
        {
            let sky = stormy(16, 8, 20 + k as u64);
            let (frame, wo) = view(n, 30.0 + 25.0 * k as f64, 0.5);
            let light = |phi, theta| bilinear(&sky, phi, theta);
            // Cells of half a texel, so that no piece has a crease of L inside.
            let truth = Brute::new(brdf.as_ref(), frame, wo).smooth(&light, 64, 6);
            let e = reference(sky.clone(), Lookup::Bilinear).radiance(brdf.as_ref(), &frame, wo, None, 1e-5);
            let d = difference(e.rgb, truth);
            assert!(d <= e.error + 2e-5, "{spec} {n}: off by {d:.1e}, said {:.1e}", e.error);
        }
    }
}

/// A half-degree sun in and next to narrow highlights, against Gauss rules on 64 × 64 pieces of its disk.
#[test]
fn suns() {
    let rho = 0.00465;
    let rule = gauss_legendre(4);
    for spec in ["ggx:alpha=0.04", "ggx:alpha=0.005", "ward:ax=0.02,ay=0.2", "cook-torrance:m=0.05"] {
        let brdf = steradian_brdf::parse(spec).expect("a known model");
        for (degrees, off) in [(0.0, 0.0), (60.0, 0.004), (85.0, 0.0), (85.0, 0.01)] {
            let (frame, wo) = view(DVec3::new(0.5, 0.7, -0.2), degrees, 1.0);
            let l = frame.to_local(wo);
            let sun = DVec3::new(-l.x + off, -l.y - 0.5 * off, l.z).normalize();
            let (a, b) = sun.any_orthonormal_pair();
            let mut sum = 0.0;
            for k in 0..64 * 4 {
                for m in 0..64 * 4 {
                    let at = |k: usize| ((k / 4) as f64 + 0.5 + 0.5 * rule.0[k % 4]) / 64.0;
                    let (r, psi) = (rho * at(k), 2.0 * PI * at(m));
                    let w = rule.1[k % 4] * rule.1[m % 4] / (4.0 * 64.0 * 64.0) * rho * 2.0 * PI * r.sin();
                    let wi = sun * r.cos() + (a * psi.cos() + b * psi.sin()) * r.sin();
                    sum += w * brdf.f_cos(wi, l)[0];
                }
            }
            let mut lights = Lights::default();
            lights.disks.push(DiskLight {
                direction: frame.to_world(sun),
                angular_radius: rho,
                radiance: [1e4; 3],
            });
            let reference = Reference::new(&lights, Lookup::Constant, &Task::quiet()).expect("sound light");
            let e = reference.radiance(brdf.as_ref(), &frame, wo, None, 1e-4);
            let d = (e.rgb[0] / (1e4 * sum) - 1.0).abs();
            assert!(d <= e.error + 1e-9 && e.error <= 1e-4, "{spec} {degrees}: off by {d:.1e}, {e:?}");
        }
    }
}
