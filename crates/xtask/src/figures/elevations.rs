//! Errors by elevation: the split sum, a stack of round lobes, spherical harmonic reflection maps and their
//! slices.
//!
//! First on the level of the reflectance, from coefficients: ‖f_cos − f~_cos‖/‖f_cos‖ over the light
//! directions of one view. Then of outgoing radiance, technique by technique, against the reference: under
//! white noise, whose harmonics all have one power, so that it measures the reflectance as a whole, and under
//! a real light; each with its bytes and with what its certificate states.

use super::picture::{baked, reference};
use super::{Options, light, percent, say};
use anyhow::Result;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{Elevation, Task};
use steradian_brdf::central::{Centre, Lpq, Slice, Slices};
use steradian_brdf::{Brdf, SharedBrdf, dfg, parse};
use steradian_light::{Environment, Lights};
use steradian_prefilter::{GgxMirror, Zonal, probe};
use steradian_reference::ReferencePoint;
use steradian_sphere::{Frame, Layout, SphereImage};
use steradian_techniques::{AnyBake, PointsBuf, Radiance};

/// Angles between normal and view, degrees.
const DEGREES: [f64; 11] = [0.0, 15.0, 30.0, 45.0, 60.0, 65.0, 70.0, 75.0, 80.0, 85.0, 88.0];
/// Orders of the series.
const F: usize = 30;
const P: usize = 5;
/// Orders to which stacks and the split sum are followed.
const FAR: usize = 60;
/// The width, and the spec, of the comparison.
const ALPHA: f64 = 0.36;
const SPEC: &str = "ggx:alpha=0.36";
/// Points of each elevation.
const POINTS: usize = 96;

pub fn run(o: &Options) -> Result<()> {
    let brdf = parse(SPEC)?;
    reflectance(&*brdf)?;
    say("");
    radiance("white noise", &noise(64, 32), &brdf)?;
    say("");
    let (name, lights) = light::of(o, "environments/latlong/probulator_grace.hdr")?;
    radiance(&name, &lights, &brdf)
}

fn head(what: &str) -> String {
    let angles: String = DEGREES.iter().map(|d| format!("{:>8}", format!("{d}°"))).collect();
    format!("{what:<34}{angles}")
}

fn line(what: &str, errors: impl Iterator<Item = f64>) -> String {
    format!("{what:<34}{}", errors.map(|e| format!("{:>8}", percent(e))).collect::<String>())
}

/// Errors of f_cos itself, from its harmonics about the mirror direction.
fn reflectance(brdf: &dyn Brdf) -> Result<()> {
    let task = Task::quiet();
    let slices: Vec<Slice> = DEGREES.iter().map(|d| Slice::reflection(d.to_radians())).collect();
    let exact = Slices::new(brdf, Centre::Reflection, slices.clone(), FAR, P, &task)?;
    let series = Lpq::project(brdf, Centre::Reflection, F, P, &task)?;
    let lobe = GgxMirror::new(ALPHA).coefficients(FAR);
    say(&head(&format!("f_cos of {SPEC}")));
    let at = |k: &dyn Fn(usize, usize) -> Vec<f64>| -> Vec<f64> {
        (0..slices.len()).map(|i| residual(&exact, i, &|q| k(i, q))).collect()
    };
    let split = at(&|i, q| {
        let d = dfg::ggx(DEGREES[i].to_radians().cos(), ALPHA);
        let band = |l: usize| ((2 * l + 1) as f64 / (4.0 * PI)).sqrt() * lobe[l] * (d.scale + d.bias);
        if q == 0 { (0..=FAR).map(band).collect() } else { Vec::new() }
    });
    let stack = at(&|i, q| if q == 0 { exact.row(i, 0)[0].to_vec() } else { Vec::new() });
    let plain = at(&|i, q| series.slice(slices[i].theta_o()).get(q).map_or_else(Vec::new, |k| k[0].clone()));
    let slice = at(&|i, q| exact.row(i, q)[0][..=F].to_vec());
    say(&line("split sum", split.iter().copied()));
    say(&line("round lobe at each elevation", stack.into_iter()));
    say(&line(&format!("harmonics F {F}, P {P}, projected"), plain.iter().copied()));
    say(&line(&format!("slices F {F}, Q {P}"), slice.into_iter()));
    let ratio: String =
        split.iter().zip(&plain).map(|(s, p)| format!("{:>8}", format!("{:.1} x", s / p))).collect();
    say(&format!("{:<34}{ratio}", "split sum / projected"));
    Ok(())
}

/// ‖f − f~‖/‖f‖ of one elevation, f~ given by its rows k~_l|q|: |f|² − 2⟨f, f~⟩ + |f~|².
fn residual(exact: &Slices, i: usize, rows: &dyn Fn(usize) -> Vec<f64>) -> f64 {
    let energy = exact.energy[i][0];
    let mut square = energy;
    for q in 0..=P {
        let both = if q == 0 { 1.0 } else { 2.0 };
        for (k, t) in exact.row(i, q)[0].iter().zip(rows(q)) {
            square += both * (t * t - 2.0 * k * t);
        }
    }
    (square.max(0.0) / energy).sqrt()
}

/// Texels of independent normal deviates over the roots of their solid angles: every harmonic has one power.
fn noise(width: usize, height: usize) -> Lights {
    let mut image = SphereImage::new(Layout::LatLong, width, height);
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut uniform = || {
        // Marsaglia 2003, Xorshift RNGs, with the multiplier of Vigna 2016.
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        ((state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    for j in 0..height {
        let omega = image.layout.solid_angle(width, height, 0, 0, j);
        for i in 0..width {
            for c in 0..3 {
                let normal = (-2.0 * uniform().ln()).sqrt() * (2.0 * PI * uniform()).cos();
                image.planes[c][j * width + i] = (normal / omega.sqrt()) as f32;
            }
        }
    }
    Lights { environment: Some(Arc::new(Environment { image })), ..Lights::default() }
}

/// Techniques: title, slug, parameters, tolerance.
type Variant = (&'static str, &'static str, &'static [(&'static str, f64)], Option<f64>);

const VARIANTS: [Variant; 5] = [
    ("split_sum", "split_sum", &[], None),
    ("lobe_maps", "lobe_maps", &[], None),
    ("reflection_space_ibr", "reflection_space_ibr", &[], None),
    ("shrm, P = 5", "shrm", &[("p", 5.0), ("order", 30.0)], None),
    ("shrm_slices to 3 %", "shrm_slices", &[], Some(0.03)),
];

fn radiance(name: &str, lights: &Lights, brdf: &SharedBrdf) -> Result<()> {
    let points: Vec<Vec<ReferencePoint>> = DEGREES.iter().map(|d| belt(d.to_radians())).collect();
    let reference = reference(lights)?;
    let mut truth = Vec::new();
    for p in &points {
        truth.push(reference.radiance_batch(&**brdf, p, 1e-3, &Task::quiet())?);
    }
    say(&format!("{}{:>11}", head(&format!("radiance under {name}")), "bytes"));
    for (title, slug, params, tolerance) in VARIANTS {
        let bake = match baked(slug, brdf, lights, params, tolerance) {
            Ok(bake) => bake,
            Err(e) => {
                say(&format!("{title:<34}{e}"));
                continue;
            }
        };
        let measured = points.iter().zip(&truth).map(|(p, t)| {
            let got = shade(&*bake, p);
            probe::relative_rms(got.into_iter().zip(t.iter().map(|e| e.rgb)))
        });
        say(&format!("{}{:>11}", line(title, measured), bake.bytes()));
        let c = bake.certificate();
        let stated = |d: &f64| {
            let near = |e: &&Elevation| (e.theta_o.to_degrees() - d).abs() < 1e-6;
            c.elevations.iter().find(near).map(|e| e.error)
        };
        let all: String =
            DEGREES.iter().map(|d| format!("{:>8}", stated(d).map_or_else(|| "-".into(), percent))).collect();
        say(&format!("{:<34}{all}", format!("  stated; all views {}", percent(c.error))));
    }
    Ok(())
}

/// Normals spread over the sphere, views at one angle, azimuths in turn.
fn belt(theta: f64) -> Vec<ReferencePoint> {
    let point = |k: usize| {
        let frame = Frame::from_normal(probe::direction(k, POINTS));
        let (s, c) = (2.0 * PI * (k as f64 * 0.569_840_291).fract()).sin_cos();
        let wo = frame.to_world(DVec3::new(theta.sin() * c, theta.sin() * s, theta.cos()));
        ReferencePoint { frame, wo, position: None }
    };
    (0..POINTS).map(point).collect()
}

fn shade(bake: &dyn AnyBake, points: &[ReferencePoint]) -> Vec<[f64; 3]> {
    let mut buf = PointsBuf::with_capacity(points.len());
    for p in points {
        buf.push(p.frame.n.as_vec3(), p.frame.t.as_vec3(), p.wo.as_vec3(), Vec3::ZERO);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    bake.shade(&buf.as_points(), &mut Radiance::of(&mut rgb));
    (0..points.len()).map(|k| [rgb[0][k], rgb[1][k], rgb[2][k]].map(f64::from)).collect()
}
