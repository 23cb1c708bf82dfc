//! Materials of a kilobyte beside what engines make of the same data: GGX over Lambert, fitted to it, by the
//! split sum.
//!
//! Both models are fitted to the published descriptions of MERL's measurements by the squared error of f·cos,
//! relative to that of each view; both are shaded by their techniques under real lights, and held against the
//! integral of the data itself, over a sphere.

use super::gaussians::sets;
use super::picture::{Ball, bake, reference};
use super::{Options, light, percent, say};
use anyhow::Result;
use glam::DVec3;
use std::f64::consts::PI;
use std::time::Instant;
use steradian_base::Task;
use steradian_brdf::fit::gaussian::LAST;
use steradian_brdf::{Brdf, Files, SharedBrdf, parse, parse_with};
use steradian_parallel::prelude::*;
use steradian_reference::Reference;
use steradian_render::{Film, errors};

/// Real lights: small bright windows, a courtyard, a nave.
const LIGHTS: [&str; 3] = ["probulator_ennis.hdr", "probulator_uffizi.hdr", "probulator_grace.hdr"];
/// Pixels of a sphere's side.
const SIDE: usize = 40;
/// Elevations of the view that GGX is fitted at.
const VIEWS: usize = 12;

/// Evaluations of the reflectance at each point at most: the first of these of which the next tells that the
/// integral is off by no more than [`ENOUGH`]. What the reference estimates of its own error adds up cells
/// whose errors cancel, so that for a table it would go on a hundred times as long.
const EVALUATIONS: [u64; 4] = [10_000, 50_000, 250_000, 1_250_000];
const ENOUGH: f64 = 0.01;

/// GGX over Lambert.
struct Ggx {
    alpha: f64,
    f0: [f64; 3],
    albedo: [f64; 3],
}

/// A point of a view: weight over the view's ∫ T², the direction, and T of the data.
struct Node {
    weight: f64,
    wi: DVec3,
    wo: DVec3,
    t: [f64; 3],
}

/// Points about the mirror direction of each view, denser towards it.
fn nodes(brdf: &dyn Brdf) -> Vec<Node> {
    const RINGS: usize = 44;
    const TURNS: usize = 40;
    let mut out = Vec::new();
    for v in 0..VIEWS {
        let theta = LAST * v as f64 / VIEWS as f64;
        let (s, c) = theta.sin_cos();
        let (wo, r, along) = (DVec3::new(s, 0.0, c), DVec3::new(-s, 0.0, c), DVec3::new(-c, 0.0, -s));
        // Rings from 1e-3 to π by equal factors.
        let edge =
            |k: usize| if k == 0 { 0.0 } else { PI * (1e-3f64 / PI).powf(1.0 - k as f64 / RINGS as f64) };
        let mut view = Vec::new();
        for k in 0..RINGS {
            let (a, b) = (edge(k), edge(k + 1));
            let solid = 2.0 * PI * (a.cos() - b.cos()) / TURNS as f64;
            let (sine, cosine) = (0.5 * (a + b)).sin_cos();
            for j in 0..TURNS {
                let (y, x) = (2.0 * PI * (j as f64 + 0.5) / TURNS as f64).sin_cos();
                let wi = r * cosine + (along * x + DVec3::Y * y) * sine;
                if wi.z > 0.0 {
                    view.push(Node { weight: solid, wi, wo, t: brdf.f_cos(wi, wo) });
                }
            }
        }
        let all: f64 = view.iter().map(|n| n.weight * n.t.iter().map(|t| t * t).sum::<f64>()).sum();
        view.iter_mut().for_each(|n| n.weight /= all.max(f64::MIN_POSITIVE));
        out.extend(view);
    }
    out
}

/// The least squares for one α: f0 and the albedo are linear in f, both 0 to 1; and the error.
fn solved(nodes: &[Node], alpha: f64) -> Result<(f64, Ggx)> {
    let [none, full] = [0.0, 1.0].map(|f0| parse(&format!("ggx:alpha={alpha},f0={f0}")));
    let (none, full) = (none?, full?);
    // Per channel: ∫ of products of the two bases (that of f0, of the albedo) and of what is left of the
    // data.
    let (mut a, mut b, mut square) = ([0.0; 3], [[0.0; 2]; 3], [0.0; 3]);
    for n in nodes {
        let (low, high) = (none.f_cos(n.wi, n.wo)[0], full.f_cos(n.wi, n.wo)[0]);
        let base = [high - low, n.wi.z / PI];
        a[0] += n.weight * base[0] * base[0];
        a[1] += n.weight * base[0] * base[1];
        a[2] += n.weight * base[1] * base[1];
        for c in 0..3 {
            let rest = n.t[c] - low;
            (0..2).for_each(|k| b[c][k] += n.weight * base[k] * rest);
            square[c] += n.weight * rest * rest;
        }
    }
    let mut out = Ggx { alpha, f0: [0.0; 3], albedo: [0.0; 3] };
    let mut error = 0.0;
    for c in 0..3 {
        let cost = |x: [f64; 2]| {
            let quadratic = a[0] * x[0] * x[0] + 2.0 * a[1] * x[0] * x[1] + a[2] * x[1] * x[1];
            square[c] - 2.0 * (b[c][0] * x[0] + b[c][1] * x[1]) + quadratic
        };
        let determinant = a[0] * a[2] - a[1] * a[1];
        let inner = [
            (b[c][0] * a[2] - b[c][1] * a[1]) / determinant,
            (b[c][1] * a[0] - b[c][0] * a[1]) / determinant,
        ];
        let inside = |x: [f64; 2]| x.iter().all(|v| (0.0..=1.0).contains(v));
        // The inner minimum, or the best of the four edges.
        let edges = [0.0, 1.0].into_iter().flat_map(|v: f64| {
            let other = ((b[c][1] - a[1] * v) / a[2]).clamp(0.0, 1.0);
            let one = ((b[c][0] - a[1] * v) / a[0]).clamp(0.0, 1.0);
            [[v, other], [one, v]]
        });
        let best = edges.min_by(|x, y| cost(*x).total_cmp(&cost(*y))).unwrap_or_default();
        let best = if inside(inner) { inner } else { best };
        (out.f0[c], out.albedo[c]) = (best[0], best[1]);
        error += cost(best);
    }
    Ok((error / VIEWS as f64, out))
}

/// The best α: of a scale by equal factors, then between the neighbours of its best.
fn fitted(brdf: &dyn Brdf) -> Result<(f64, Ggx)> {
    let nodes = nodes(brdf);
    let mut at: Vec<f64> = (0..16).map(|k| 0.015 * (1.0f64 / 0.015).powf(f64::from(k) / 15.0)).collect();
    let mut best: Option<(f64, Ggx)> = None;
    for _ in 0..4 {
        for alpha in &at {
            let one = solved(&nodes, *alpha)?;
            if best.as_ref().is_none_or(|b| one.0 < b.0) {
                best = Some(one);
            }
        }
        let centre = best.as_ref().map_or(0.1, |b| b.1.alpha);
        let step = (at[at.len() - 1] / at[0]).powf(1.0 / (at.len() - 1) as f64);
        at = (0..5).map(|k| (centre * step.powf(0.4 * (f64::from(k) - 2.0))).clamp(0.01, 1.0)).collect();
    }
    best.ok_or_else(|| anyhow::anyhow!("nothing fitted"))
}

impl Ggx {
    fn glossy(&self) -> Result<SharedBrdf> {
        let [r, g, b] = self.f0;
        Ok(parse(&format!("ggx:alpha={},f0={r}/{g}/{b}", self.alpha))?)
    }

    fn diffuse(&self) -> Result<SharedBrdf> {
        let [r, g, b] = self.albedo;
        Ok(parse(&format!("lambert:albedo={r}/{g}/{b}"))?)
    }
}

/// A light with what is baked under it.
struct Lit {
    name: String,
    lights: steradian_light::Lights,
    /// One for each of [`EVALUATIONS`].
    references: [Reference; 4],
}

fn plus(mut a: Film, b: &Film) -> Film {
    for (to, from) in a.rgb.iter_mut().zip(&b.rgb) {
        to.iter_mut().zip(from).for_each(|(x, y)| *x += y);
    }
    a
}

/// A material's errors of f·cos, and of radiance under each light: by lobes and by GGX.
struct Found {
    name: String,
    ggx: f64,
    radiance: Vec<[f64; 2]>,
    /// Relative RMS error of the reference, the largest of all lights.
    truth: f64,
}

impl Found {
    /// In the RMS over the lights.
    fn mean(&self, k: usize) -> f64 {
        let n = self.radiance.len().max(1) as f64;
        (self.radiance.iter().map(|e| e[k] * e[k]).sum::<f64>() / n).sqrt()
    }
}

pub fn run(o: &Options) -> Result<()> {
    let ball = Ball::seen(o.side.unwrap_or(SIDE));
    let mut lit = Vec::new();
    for file in LIGHTS {
        let (name, lights) = light::of(o, &format!("environments/latlong/{file}"))?;
        let full = reference(&lights)?;
        let references = EVALUATIONS.map(|n| full.clone().with_budget(n));
        lit.push(Lit { name, references, lights });
        if o.light.is_some() {
            break;
        }
    }
    // One bake a light and technique: only the material changes.
    let stretched = |l: &Lit| {
        let plain = steradian_techniques::find("gaussian_lobes")
            .ok_or_else(|| anyhow::anyhow!("no gaussian_lobes"))?;
        let values = [("shape", "stretched")].into_iter().collect();
        let material = steradian_techniques::Material::new(parse("lambert")?);
        plain.bake(&l.lights, &material, None, &values, &Task::quiet()).map_err(|e| anyhow::anyhow!("{e}"))
    };
    let mut bakes = Vec::new();
    for l in &lit {
        let ggx = bake("split_sum", &parse("ggx:alpha=0.2")?, &l.lights, &[])?;
        let matte = bake("sh_irradiance", &parse("lambert")?, &l.lights, &[])?;
        bakes.push([stretched(l)?, ggx, matte]);
    }
    for (set, specs) in sets(o)? {
        let start = Instant::now();
        let one = |spec: &String| -> Result<Found> {
            let brdf = parse_with(spec, Files::Any)?;
            let (error, model) = fitted(&*brdf)?;
            let (mut radiance, mut own) = (Vec::new(), 0.0f64);
            for (l, bakes) in lit.iter().zip(&bakes) {
                let (mut k, mut off) = (0, f64::INFINITY);
                while off > ENOUGH && k + 1 < EVALUATIONS.len() {
                    off = ball.apart([&l.references[k], &l.references[k + 1]], &*brdf)?;
                    k += 1;
                }
                let truth = ball.truth(&l.references[k - 1], &*brdf)?;
                own = own.max(off);
                let shaded = |k: usize, brdf: SharedBrdf| -> Result<Film> {
                    let material = steradian_techniques::Material::new(brdf);
                    // What is held against the reference here needs no certificate of its own.
                    let bake = bakes[k].preview(None, Some(&material), &Task::quiet());
                    Ok(ball.shaded(&mut *bake.map_err(|e| anyhow::anyhow!("{e}"))?))
                };
                let lobes = shaded(0, brdf.clone())?;
                let ggx = plus(shaded(1, model.glossy()?)?, &shaded(2, model.diffuse()?)?);
                radiance
                    .push([&lobes, &ggx].map(|f| errors(f, &truth, |i| truth.alpha[i] > 0.0).relative_rms));
            }
            let name = spec.rsplit([',', ':']).next().unwrap_or(spec).to_owned();
            let found = Found { name, ggx: error, radiance, truth: own };
            say(&format!(
                "  {:<28} lobes {}, GGX {}, the integral itself {}",
                found.name,
                percent(found.mean(0)),
                percent(found.mean(1)),
                percent(found.truth)
            ));
            Ok(found)
        };
        let all: Vec<Result<Found>> = specs.par_iter().with_max_len(1).map(one).collect();
        let all: Vec<Found> = all.into_iter().collect::<Result<_>>()?;
        summary(&set, &all, &lit, start.elapsed().as_secs_f64());
    }
    Ok(())
}

fn summary(set: &str, all: &[Found], lit: &[Lit], seconds: f64) {
    let median = |mut v: Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v.get(v.len() / 2).copied().unwrap_or_default()
    };
    say(&format!(
        "{set}: {} materials, {seconds:.0} s; relative RMS error of radiance over a sphere",
        all.len()
    ));
    for (k, l) in lit.iter().enumerate() {
        let of = |m: usize| median(all.iter().map(|f| f.radiance[k][m]).collect());
        let better = all.iter().filter(|f| f.radiance[k][0] < f.radiance[k][1]).count();
        say(&format!(
            "  {:<26} lobes {} in the median, GGX {}; lobes are nearer for {better}",
            l.name,
            percent(of(0)),
            percent(of(1))
        ));
    }
    let own: Vec<f64> = all.iter().map(|f| f.truth).collect();
    say(&format!(
        "  the integral itself is off by {} in the median, {} at most",
        percent(median(own.clone())),
        percent(own.into_iter().fold(0.0, f64::max))
    ));
    let better = all.iter().filter(|f| f.mean(0) < f.mean(1)).count();
    say(&format!(
        "  over the lights: lobes {} in the median, GGX {} (its fit, squared: {}); lobes are nearer for {better} of {}",
        percent(median(all.iter().map(|f| f.mean(0)).collect())),
        percent(median(all.iter().map(|f| f.mean(1)).collect())),
        percent(median(all.iter().map(|f| f.ggx).collect())),
        all.len()
    ));
    let mut worse: Vec<&Found> = all.iter().filter(|f| f.mean(0) >= f.mean(1)).collect();
    worse.sort_by(|a, b| (b.mean(0) - b.mean(1)).total_cmp(&(a.mean(0) - a.mean(1))));
    let named = |f: &&Found| format!("{} {} against {}", f.name, percent(f.mean(0)), percent(f.mean(1)));
    let named: Vec<String> = worse.iter().take(12).map(named).collect();
    if !named.is_empty() {
        say(&format!("  GGX is nearer for {}", named.join(", ")));
    }
}
