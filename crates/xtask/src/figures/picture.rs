//! Spheres: every pixel of one a point with a normal and a view, shaded by the reference or by a technique.

use super::say;
use anyhow::{Context, Result, anyhow};
use glam::{DVec3, Vec3};
use steradian_base::{Certificate, ParamValues, Task};
use steradian_brdf::{Brdf, SharedBrdf};
use steradian_light::Lights;
use steradian_prefilter::shrm::frame;
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_render::tone::auto_exposure;
use steradian_render::{Cell, Develop, Display, Errors, Film, ToneMapper, errors};
use steradian_sphere::Frame;
use steradian_techniques::{AnyBake, Material, PointsBuf, Radiance, View};

/// Relative error of the reference at each pixel: far below what is compared.
const TRUTH: f64 = 1e-3;

/// The pixels of a disc and their points.
pub struct Ball {
    side: usize,
    pixels: Vec<usize>,
    points: Vec<ReferencePoint>,
}

/// Points of the front half of the unit sphere, seen from afar along +Z: pixel and direction.
fn disc(side: usize) -> impl Iterator<Item = (usize, DVec3)> {
    let at = move |k: usize| (2.0 * k as f64 + 1.0) / side as f64 - 1.0;
    (0..side * side).filter_map(move |k| {
        let (x, y) = (at(k % side), -at(k / side));
        let z2 = 1.0 - x * x - y * y;
        (z2 > 0.0).then(|| (k, DVec3::new(x, y, z2.sqrt())))
    })
}

impl Ball {
    /// A reflection map: a pixel is a central direction C, the mirror direction of a view that stands at
    /// (θ_o, φ_o) about C everywhere (RH02, figure 5.6).
    pub fn map(side: usize, theta_o: f64, phi_o: f64) -> Self {
        let point = |c: DVec3| {
            let [x, y, z] = frame(c);
            let (s, cosine) = theta_o.sin_cos();
            let wo = s * (phi_o.cos() * x + phi_o.sin() * y) + cosine * z;
            let n = (c + wo).normalize();
            ReferencePoint { frame: Frame::from_normal(n), wo, position: None }
        };
        Self::of(side, point)
    }

    /// A ball seen along +Z; tangents go around +Y.
    pub fn seen(side: usize) -> Self {
        Self::of(side, |n| {
            let t = DVec3::Y.cross(n).try_normalize().unwrap_or(DVec3::X);
            ReferencePoint { frame: Frame::from_normal_tangent(n, t), wo: DVec3::Z, position: None }
        })
    }

    fn of(side: usize, point: impl Fn(DVec3) -> ReferencePoint) -> Self {
        let (pixels, points) = disc(side).map(|(k, d)| (k, point(d))).unzip();
        Self { side, pixels, points }
    }

    /// The same strands seen along another direction: their normals turn about the tangents to face it.
    pub fn strands_seen(&self, wo: DVec3) -> Self {
        let turned = |p: &ReferencePoint| {
            let t = p.frame.t;
            let n = (wo - wo.dot(t) * t).try_normalize().unwrap_or(p.frame.n);
            ReferencePoint { frame: Frame::from_normal_tangent(n, t), wo, position: None }
        };
        let points = self.points.iter().map(turned).collect();
        Self { side: self.side, pixels: self.pixels.clone(), points }
    }

    fn film(&self, rgb: impl Fn(usize) -> [f32; 3]) -> Film {
        let mut film = Film::new(self.side, self.side);
        for (i, &k) in self.pixels.iter().enumerate() {
            (0..3).for_each(|c| film.rgb[c][k] = rgb(i)[c]);
            film.alpha[k] = 1.0;
        }
        film
    }

    /// The integral.
    pub fn truth(&self, reference: &Reference, brdf: &dyn Brdf) -> Result<Film> {
        let all = reference.radiance_batch(brdf, &self.points, TRUTH, &Task::quiet())?;
        Ok(self.film(|i| all[i].rgb.map(|v| v as f32)))
    }

    /// How far the integral by two references is apart, relative RMS over every eighth point.
    pub fn apart(&self, by: [&Reference; 2], brdf: &dyn Brdf) -> Result<f64> {
        let some: Vec<ReferencePoint> = self.points.iter().step_by(8).copied().collect();
        let [a, b] = by.map(|r| r.radiance_batch(brdf, &some, TRUTH, &Task::quiet()));
        let (mut off, mut energy) = (0.0, 0.0);
        for (a, b) in a?.iter().zip(&b?) {
            for (x, y) in a.rgb.iter().zip(b.rgb) {
                off += (x - y) * (x - y);
                energy += y * y;
            }
        }
        Ok((off / energy).sqrt())
    }

    /// A technique's.
    pub fn shaded(&self, bake: &mut dyn AnyBake) -> Film {
        let mut buf = PointsBuf::with_capacity(self.points.len());
        for p in &self.points {
            buf.push(p.frame.n.as_vec3(), p.frame.t.as_vec3(), p.wo.as_vec3(), Vec3::ZERO);
        }
        bake.frame(&View { eye: 1e6 * Vec3::Z, forward: -Vec3::Z, ..View::default() });
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; buf.len()]);
        bake.shade(&buf.as_points(), &mut Radiance::of(&mut rgb));
        self.film(|i| [rgb[0][i], rgb[1][i], rgb[2][i]])
    }

    /// The angles between normal and view, degrees, pixel by pixel.
    pub fn elevations(&self) -> impl Iterator<Item = (usize, f64)> {
        self.pixels.iter().zip(&self.points).map(|(k, p)| (*k, p.frame.n.angle_between(p.wo).to_degrees()))
    }
}

/// The reference of lights, each texel of constant radiance.
pub fn reference(lights: &Lights) -> Result<Reference> {
    Ok(Reference::new(lights, Lookup::Constant, &Task::quiet())?)
}

/// A technique's bake with parameters; those that it lacks are said and left out.
pub fn bake(
    slug: &str,
    brdf: &SharedBrdf,
    lights: &Lights,
    params: &[(&str, f64)],
) -> Result<Box<dyn AnyBake>> {
    baked(slug, brdf, lights, params, None)
}

/// [`bake`] to a tolerance.
pub fn baked(
    slug: &str,
    brdf: &SharedBrdf,
    lights: &Lights,
    params: &[(&str, f64)],
    tolerance: Option<f64>,
) -> Result<Box<dyn AnyBake>> {
    let technique =
        steradian_techniques::find(slug).with_context(|| format!("this build has no technique {slug}"))?;
    let mut values = ParamValues::default();
    for (name, value) in params {
        if technique.params().iter().any(|p| p.name == *name) {
            values.0.insert((*name).into(), (*value).into());
        } else {
            say(&format!("{slug} has no parameter {name}"));
        }
    }
    let task = Task::quiet().with_tolerance(tolerance);
    technique.bake(lights, &Material::new(brdf.clone()), None, &values, &task).map_err(|e| anyhow!("{e}"))
}

/// Error and its knowledge in a word: `0.034 (measured)`.
pub fn certified(c: &Certificate) -> String {
    format!("{} ({})", super::percent(c.error), c.known.word())
}

/// How pictures of one truth are shown: linear, no curve, so that differences compare.
pub struct Show<'a> {
    truth: &'a Film,
    develop: Develop,
}

impl<'a> Show<'a> {
    /// At the exposure that suits the truth.
    pub fn of(truth: &'a Film) -> Self {
        let ev = auto_exposure(truth, |i| truth.alpha[i]) - 0.7;
        Self { truth, develop: Develop { ev, mapper: ToneMapper::Linear } }
    }

    /// The picture with its caption.
    pub fn cell(&self, film: &Film, caption: Vec<String>) -> Option<Cell> {
        Some(Cell { picture: self.picture(film), caption })
    }

    /// Absolute differences at the same exposure, not amplified, as in the paper; what `gain` says where they
    /// are.
    pub fn difference(&self, film: &Film, gain: f32) -> Option<Cell> {
        let mut d = film.clone();
        for c in 0..3 {
            for (x, y) in d.rgb[c].iter_mut().zip(&self.truth.rgb[c]) {
                *x = gain * (*x - y).abs();
            }
        }
        let caption = if gain == 1.0 { "difference".into() } else { format!("difference x {gain}") };
        Some(Cell { picture: self.picture(&d), caption: vec![caption] })
    }

    /// Over the pixels of the ball.
    pub fn errors(&self, film: &Film) -> Errors {
        errors(film, self.truth, |i| self.truth.alpha[i] > 0.0)
    }

    /// Relative RMS error of the pixels whose view stands between two angles of the normal, degrees.
    pub fn between(&self, film: &Film, ball: &Ball, [low, high]: [f64; 2]) -> f64 {
        let mut belt = vec![false; film.len()];
        ball.elevations().filter(|(_, a)| (low..high).contains(a)).for_each(|(k, _)| belt[k] = true);
        errors(film, self.truth, |i| belt[i]).relative_rms
    }

    fn picture(&self, film: &Film) -> Display {
        const PAPER: [u8; 3] = [22, 24, 28];
        let mut shown = self.develop.film(film);
        for (pixel, alpha) in shown.rgb.as_chunks_mut::<3>().0.iter_mut().zip(&film.alpha) {
            if *alpha == 0.0 {
                *pixel = PAPER;
            }
        }
        shown
    }
}
