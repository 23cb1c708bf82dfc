//! Table 5.2: representations of the four-dimensional reflected light field B(C, wo'), C the mirror direction
//! and wo' the direction of the viewer about it, and measurements beside each word of the paper's table.
//!
//! All represent one field, that of an isotropic reflectance under an environment, to one error: each grows
//! until its error at random points is at most [`ASKED`]. Points are those of balls: normals with density cos
//! θ about views drawn uniformly. Tables come from harmonics, not from sums over the light's texels, whose
//! time is extrapolated from a few of them.

use super::picture::{baked, certified, reference};
use super::{Options, light, percent, say};
use anyhow::{Context, Result};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Instant;
use steradian_base::Task;
use steradian_brdf::central::{Centre, Lpq};
use steradian_brdf::{Brdf, parse};
use steradian_light::Lights;
use steradian_numerics::clusters::{Clusters, Settings};
use steradian_numerics::matrix::Matrix;
use steradian_numerics::svd::{Svd, leading};
use steradian_prefilter::shrm::explicit::{self, Planes};
use steradian_prefilter::shrm::{CoefficientMaps, Grid, Plan, Term, angles_in, frame, global, pairs};
use steradian_reference::ReferencePoint;
use steradian_sphere::sh::{self, ColumnsRgb, ShTransform};
use steradian_sphere::{Frame, Layout};
use steradian_techniques::{PointsBuf, Radiance, View};

const SPEC: &str = "microfacet:sigma=0.2";
/// Relative RMS error that each representation is grown to.
const ASKED: f64 = 0.05;
/// What the tables that others compress may err by themselves.
const TABLE: f64 = 0.8 * ASKED;
/// Order of the light that counts: the paper's.
const F: usize = 30;
/// Order of the viewer to which tables are computed.
const P: usize = 24;
/// Central directions.
const GRID: [usize; 2] = [65, 128];
/// Views and points of each.
const VIEWS: usize = 12;
const POINTS: usize = 160;
/// Of the reference.
const TRUTH: f64 = 1e-3;
/// Evaluations that are timed, at least.
const TIMED: usize = 20_000;
/// Components at most.
const COMPONENTS: usize = 48;

/// A point where the field is asked for.
struct Point {
    at: ReferencePoint,
    /// The mirror direction of the viewer.
    c: DVec3,
    /// (θ_o, φ_o) of the viewer about it.
    angles: [f64; 2],
}

/// A line of the table.
struct Line {
    name: String,
    size: String,
    bytes: usize,
    seconds: f64,
    error: f64,
    /// Nanoseconds a point, one thread.
    nanoseconds: f64,
    /// What states the error before a point is evaluated.
    stated: String,
}

/// The field.
struct Field<'a> {
    brdf: &'a dyn Brdf,
    points: Vec<Point>,
    truth: Vec<[f64; 3]>,
    light: ColumnsRgb,
    maps: CoefficientMaps,
    /// Seconds of the light's coefficients.
    analysis: f64,
    /// Seconds of the maps, the light's and the reflectance's coefficients among them.
    seconds: f64,
}

pub fn run(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/probulator_grace.hdr")?;
    let lights = Lights { environment: lights.environment, ..Lights::default() };
    let spec = o.brdfs.first().map_or(SPEC, String::as_str);
    let brdf = parse(spec)?;
    let field = Field::new(&*brdf, &lights)?;
    say(&format!(
        "RH02 table 5.2: {spec} under {name}, relative RMS error of at most {} asked",
        percent(ASKED)
    ));
    say(
        "| representation | size | bytes | prefiltering, s | error | ns a point | error stated beforehand | the paper: simple, compact, rendering, analysis, speed |",
    );
    say("|---|---|---|---|---|---|---|---|");
    let (table, t) = field.tabular();
    print(&table, "yes, no, yes, no, no");
    let dense = Table::new(&field.maps, t);
    for components in [0, 4] {
        print(&field.compressed(&dense, components, &table), "no, yes, maybe, *, no");
    }
    print(&field.factored(&dense, &table), "yes, yes, yes, *, no");
    for line in field.harmonics()? {
        let words = if line.name.starts_with("coefficients") {
            "yes, yes, no, yes, yes"
        } else {
            "yes, yes, yes, yes, yes"
        };
        print(&line, words);
    }
    say(&format!(
        "A table of {t} x {t} views by sums over the light's texels, as without harmonics: {:.0} s of one thread",
        field.angular(&lights)? * (t * t * GRID[0] * GRID[1]) as f64
    ));
    say("");
    say("The same points by this library's techniques, as they come:");
    say("| technique | bytes | bake, s | error | ns a point | stated |");
    say("|---|---|---|---|---|---|");
    for (slug, what) in [
        ("reflection_space_ibr", "tabular, twelve views"),
        ("lobe_maps", "tabular over elevations"),
        ("factored_lighting", "factored"),
        ("sh_brdf", "coefficients"),
        ("shrm", "SHRM"),
        ("shrm_slices", "SHRM by elevation"),
        ("shrm_global", "SHRM, one map a view"),
    ] {
        say(&field.technique(slug, what, &brdf, &lights)?);
    }
    Ok(())
}

fn print(l: &Line, words: &str) {
    say(&format!(
        "| {} | {} | {} | {:.3} | {} | {:.0} | {} | {words} |",
        l.name,
        l.size,
        l.bytes,
        l.seconds,
        percent(l.error),
        l.nanoseconds,
        l.stated
    ));
}

/// Numbers of [0, 1) that fill it evenly: the fractional parts of multiples of 1/g, g the root of x^(d+1) =
/// x + 1.
fn even(k: usize, dimension: i32) -> f64 {
    const ROOT: f64 = 1.220_744_084_605_76;
    (0.5 + (k + 1) as f64 * ROOT.powi(-dimension)).fract()
}

fn points() -> Vec<Point> {
    let mut out = Vec::new();
    for v in 0..VIEWS {
        let (z, turn) = (1.0 - 2.0 * even(v, 1), 2.0 * PI * even(v, 2));
        let wo = DVec3::new((1.0 - z * z).sqrt() * turn.cos(), z, (1.0 - z * z).sqrt() * turn.sin());
        let [x, y, _] = frame(wo);
        for k in 0..POINTS {
            let (r, turn) = (even(v * POINTS + k, 3).sqrt(), 2.0 * PI * even(v * POINTS + k, 1));
            let n = r * (turn.cos() * x + turn.sin() * y) + (1.0 - r * r).sqrt() * wo;
            let c = (2.0 * n.dot(wo) * n - wo).normalize();
            let at = ReferencePoint { frame: Frame::from_normal(n), wo, position: None };
            out.push(Point { at, c, angles: angles_in(&frame(c), wo) });
        }
    }
    out
}

fn seconds<T>(run: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let out = run();
    (out, start.elapsed().as_secs_f64())
}

/// Weights and places of the two neighbours of x among `count` places at k + ½; the ends are held, or met by
/// turning round.
fn neighbours(x: f64, count: usize, turns: bool) -> [(usize, f64); 2] {
    let x = x - 0.5;
    let low = x.floor();
    let w = x - low;
    let at = |k: f64| {
        let n = count as f64;
        let k = if turns { k.rem_euclid(n) } else { k.clamp(0.0, n - 1.0) };
        (k as usize).min(count - 1)
    };
    [(at(low), 1.0 - w), (at(low + 1.0), w)]
}

/// The four views of T × T around (θ_o, φ_o) (see [`explicit::set`]).
fn around(t: usize, [theta, phi]: [f64; 2]) -> [(usize, f64); 4] {
    let rows = neighbours(theta / PI * t as f64, t, false);
    let columns = neighbours((0.5 + phi / (2.0 * PI)) * t as f64, t, true);
    std::array::from_fn(|k| {
        let (i, j) = (rows[k / 2], columns[k % 2]);
        (i.0 * t + j.0, i.1 * j.1)
    })
}

/// B at T × T views of each central direction, by central direction, view and channel.
struct Table {
    t: usize,
    values: Vec<f32>,
}

impl Table {
    fn new(maps: &CoefficientMaps, t: usize) -> Self {
        let planes = explicit::local(maps, P, &explicit::set(t)).expect("the maps are complete");
        Self { t, values: by_texel(&planes, maps.grid.texels()) }
    }

    /// Numbers of a central direction.
    fn row(&self) -> usize {
        3 * self.t * self.t
    }

    fn value(&self, grid: Grid, p: &Point, of: impl Fn(usize, usize) -> f64) -> [f64; 3] {
        let views = around(self.t, p.angles);
        let mut sum = [0.0; 3];
        for (texel, w) in grid.bilinear(p.c) {
            for (view, u) in views {
                (0..3).for_each(|c| sum[c] += w * u * of(texel, 3 * view + c));
            }
        }
        sum
    }
}

fn by_texel(planes: &Planes, texels: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(3 * planes.len() * texels);
    for texel in 0..texels {
        planes.iter().for_each(|p| out.extend(p.iter().map(|channel| channel[texel])));
    }
    out
}

impl<'a> Field<'a> {
    fn new(brdf: &'a dyn Brdf, lights: &Lights) -> Result<Self> {
        let points = points();
        let at: Vec<ReferencePoint> = points.iter().map(|p| p.at).collect();
        let truth = reference(lights)?.radiance_batch(brdf, &at, TRUTH, &Task::quiet())?;
        let truth = truth.iter().map(|e| e.rgb).collect();
        let image = &lights.environment.as_ref().context("the light has no environment")?.image;
        let start = Instant::now();
        let mut light = ColumnsRgb::default();
        ShTransform::new(F, image.width, image.height, sh::Grid::Equirectangular)
            .analyze_columns(image.planes.each_ref().map(Vec::as_slice), &mut light);
        let analysis = start.elapsed().as_secs_f64();
        let maps = maps(&light, &project(brdf, P)?, P)?;
        let seconds = start.elapsed().as_secs_f64();
        Ok(Self { brdf, points, truth, light, maps, analysis, seconds })
    }

    fn error(&self, of: &[[f64; 3]]) -> f64 {
        let (mut off, mut energy) = (0.0, 0.0);
        for (x, y) in of.iter().flatten().zip(self.truth.iter().flatten()) {
            off += (x - y) * (x - y);
            energy += y * y;
        }
        (off / energy).sqrt()
    }

    /// The error of a representation.
    fn try_out(&self, value: &impl Fn(&Point) -> [f64; 3]) -> f64 {
        let all: Vec<[f64; 3]> = self.points.iter().map(value).collect();
        self.error(&all)
    }

    /// Nanoseconds of a value.
    fn timed(&self, value: &impl Fn(&Point) -> [f64; 3]) -> f64 {
        let turns = TIMED.div_ceil(self.points.len());
        let ((), s) = seconds(|| {
            for _ in 0..turns {
                self.points.iter().for_each(|p| {
                    black_box(value(p));
                });
            }
        });
        1e9 * s / (turns * self.points.len()) as f64
    }

    /// The table with the fewest views that does not err more than [`TABLE`].
    fn tabular(&self) -> (Line, usize) {
        let mut t = 2;
        loop {
            let (table, s) = seconds(|| Table::new(&self.maps, t));
            let value = |p: &Point| {
                table.value(self.maps.grid, p, |texel, k| f64::from(table.values[texel * table.row() + k]))
            };
            let error = self.try_out(&value);
            if error <= TABLE || t >= 32 {
                let line = Line {
                    name: "tabular".into(),
                    size: format!("{t} x {t} views"),
                    bytes: 4 * table.values.len(),
                    seconds: self.seconds + s,
                    error,
                    nanoseconds: self.timed(&value),
                    stated: "no".into(),
                };
                return (line, t);
            }
            t += 2;
        }
    }

    /// Clusters of the table's rows: vector quantisation, or principal components of each cluster.
    fn compressed(&self, table: &Table, components: usize, whole: &Line) -> Line {
        let start = Instant::now();
        let mut clusters = if components == 0 { 128 } else { 4 };
        loop {
            let settings = Settings { clusters, components, rounds: 20 };
            let c = Clusters::new(&table.values, table.row(), settings, || true);
            let value = |p: &Point| {
                table.value(self.maps.grid, p, |texel, k| {
                    let basis = c.basis(c.cluster[texel] as usize);
                    let weights = &c.weights[texel * c.components..][..c.components];
                    let more = weights
                        .iter()
                        .enumerate()
                        .map(|(i, w)| f64::from(*w) * basis[(i + 1) * table.row() + k]);
                    basis[k] + more.sum::<f64>()
                })
            };
            let error = self.try_out(&value);
            if error <= ASKED || 2 * clusters >= self.maps.grid.texels() {
                // Bases and weights as f32, clusters as 16 bits.
                let bytes = 4 * (c.bases.len() + c.weights.len()) + 2 * c.cluster.len();
                let name = if components == 0 {
                    "compressed: vector quantisation"
                } else {
                    "compressed: components by cluster"
                };
                let size = if components == 0 {
                    format!("{clusters} codewords")
                } else {
                    format!("{clusters} x {components}")
                };
                return Line {
                    name: name.into(),
                    size,
                    bytes,
                    seconds: whole.seconds + start.elapsed().as_secs_f64(),
                    error,
                    nanoseconds: self.timed(&value),
                    stated: format!("{} of the table", percent(self.distance(table, &c))),
                };
            }
            clusters *= 2;
        }
    }

    /// How far clusters stand from the table, relative.
    fn distance(&self, table: &Table, c: &Clusters) -> f64 {
        let energy: f64 = table.values.iter().map(|v| f64::from(*v).powi(2)).sum();
        let off = c.errors.last().copied().unwrap_or(0.0) * c.cluster.len() as f64;
        (off / energy).sqrt()
    }

    /// Sums of products (5.4): rows are central directions and channels, columns are views.
    fn factored(&self, table: &Table, whole: &Line) -> Line {
        let start = Instant::now();
        let (views, texels) = (table.t * table.t, self.maps.grid.texels());
        let mut data = vec![0.0; table.values.len()];
        for (texel, row) in table.values.chunks_exact(table.row()).enumerate() {
            for (k, x) in row.iter().enumerate() {
                data[(3 * texel + k % 3) * views + k / 3] = *x;
            }
        }
        let matrix = Matrix::new(3 * texels, views, data).expect("as many numbers as rows times columns");
        let svd = leading(&matrix, COMPONENTS, 1e-4);
        let mut terms = 1;
        loop {
            let value = |p: &Point| {
                let views = around(table.t, p.angles);
                let near = self.maps.grid.bilinear(p.c);
                product(&svd, terms, &near, &views)
            };
            let error = self.try_out(&value);
            if error <= ASKED || terms >= svd.values.len() {
                return Line {
                    name: "factored".into(),
                    size: format!("{terms} products"),
                    bytes: 4 * terms * (3 * texels + views),
                    seconds: whole.seconds + start.elapsed().as_secs_f64(),
                    error,
                    nanoseconds: self.timed(&value),
                    stated: format!("{} of the table", percent((svd.rest(terms) / svd.square).sqrt())),
                };
            }
            terms += 1;
        }
    }

    /// Coefficients, maps of coefficients, and the maps of a view: one series, kept in three ways.
    fn harmonics(&self) -> Result<[Line; 3]> {
        let mut p = 0;
        loop {
            let start = Instant::now();
            let lpq = project(self.brdf, p)?;
            let projected = self.analysis + start.elapsed().as_secs_f64();
            let maps = maps(&self.light, &lpq, p)?;
            let made = self.analysis + start.elapsed().as_secs_f64();
            // y_pq in the maps' order.
            let order: Vec<usize> =
                maps.keys.iter().map(|k| sh::index(pairs(p)[k.term].0, k.q as isize)).collect();
            let value = |at: &Point| {
                let y = harmonics(p, local(at.angles));
                let near = maps.grid.bilinear(at.c);
                let mut sum = [0.0; 3];
                for (plane, k) in maps.planes.iter().zip(&order) {
                    for (texel, w) in near {
                        (0..3).for_each(|c| sum[c] += y[*k] * w * f64::from(plane[c][texel]));
                    }
                }
                sum
            };
            let error = self.try_out(&value);
            if error > ASKED && p < P {
                p += 1;
                continue;
            }
            let stated = format!("{} of f_cos", percent((1.0 - lpq.share(F, p)).max(0.0).sqrt()));
            let shrm = Line {
                name: "SHRM".into(),
                size: format!("F = {F}, P = {p}: {} maps", sh::count(p)),
                bytes: maps.bytes(),
                seconds: made,
                error,
                nanoseconds: self.timed(&value),
                stated: stated.clone(),
            };
            return Ok([
                self.coefficients(&lpq, projected, &stated)?,
                shrm,
                self.view(&maps, made, &stated)?,
            ]);
        }
    }

    /// Σ B̂_lmpq y_lm(C) y_pq(wo), summed at each point.
    fn coefficients(&self, lpq: &Lpq, projected: f64, stated: &str) -> Result<Line> {
        let p = lpq.p;
        let pairs = pairs(p);
        let terms = terms(lpq, &pairs);
        let (columns, made) = seconds(|| global::coefficients(&self.light, F, &terms, p, &Task::quiet()));
        let each: Vec<_> = columns?.iter().map(ColumnsRgb::to_sh).collect();
        let order = F + p;
        let value = |at: &Point| {
            let (y, view) = (harmonics(order, DVec3::new(at.c.x, at.c.z, at.c.y)), harmonics(p, at.at.wo));
            let mut sum = [0.0; 3];
            for (b, v) in each.iter().zip(&view) {
                for (s, c) in sum.iter_mut().zip(&b.c) {
                    *s += v * c.iter().zip(&y).map(|(b, y)| b * y).sum::<f64>();
                }
            }
            sum
        };
        Ok(Line {
            name: "coefficients".into(),
            size: format!("{} x {}", sh::count(order), sh::count(p)),
            bytes: 4 * 3 * sh::count(order) * sh::count(p),
            seconds: projected + made,
            error: self.try_out(&value),
            nanoseconds: self.timed(&value),
            stated: stated.into(),
        })
    }

    /// One map a view (5.35), a lookup a point.
    fn view(&self, maps: &CoefficientMaps, prepared: f64, stated: &str) -> Result<Line> {
        let p = maps.planes.len().isqrt() - 1;
        let (whole, made) = seconds(|| global::from_local(maps, p));
        let whole = whole.context("the maps are complete")?;
        let mut all = Vec::new();
        let (mut frames, mut looked) = (0.0, 0.0);
        for points in self.points.chunks(POINTS) {
            let (map, s) = seconds(|| whole.frame(points[0].at.wo));
            frames += s;
            let value = |p: &Point| {
                let near = maps.grid.bilinear(p.c);
                std::array::from_fn(|c| near.iter().map(|(at, w)| w * f64::from(map[c][*at])).sum())
            };
            looked += self.timed(&value) / VIEWS as f64;
            all.extend(points.iter().map(value));
        }
        Ok(Line {
            name: "SHRM, one map a view".into(),
            size: format!("{:.2} ms a view", 1e3 * frames / VIEWS as f64),
            bytes: maps.bytes(),
            seconds: prepared + made,
            error: self.error(&all),
            nanoseconds: looked,
            stated: stated.into(),
        })
    }

    /// Seconds of a sum over all of the light's texels, one thread, the mean over some points.
    fn angular(&self, lights: &Lights) -> Result<f64> {
        let image = &lights.environment.as_ref().context("the light has no environment")?.image;
        let (w, h) = (image.width, image.height);
        let texels: Vec<(DVec3, [f64; 3])> = (0..w * h)
            .filter_map(|k| {
                let area = Layout::LatLong.solid_angle(w, h, 0, k % w, k / w);
                let d = Layout::LatLong.texel_direction(w, h, 0, k % w, k / w)?;
                Some((d, image.texel(0, k % w, k / w).map(|l| f64::from(l) * area)))
            })
            .collect();
        let some: Vec<&Point> = self.points.iter().step_by(self.points.len() / 16).collect();
        let sum = |p: &Point| {
            let (frame, wo) = (p.at.frame, p.at.frame.to_local(p.at.wo));
            let wi: Vec<DVec3> = texels.iter().map(|(d, _)| frame.to_local(*d)).collect();
            let mut f = vec![[0.0; 3]; wi.len()];
            self.brdf.f_cos_batch(&wi, wo, &mut f);
            let mut sum = [0.0; 3];
            f.iter().zip(&texels).for_each(|(f, (_, l))| (0..3).for_each(|c| sum[c] += f[c] * l[c]));
            sum
        };
        let (_, s) = seconds(|| some.iter().map(|p| black_box(sum(p))).collect::<Vec<_>>());
        Ok(s / some.len() as f64)
    }

    fn technique(
        &self,
        slug: &str,
        what: &str,
        brdf: &steradian_brdf::SharedBrdf,
        lights: &Lights,
    ) -> Result<String> {
        let (bake, made) = seconds(|| baked(slug, brdf, lights, &[], None));
        let mut bake = match bake {
            Ok(bake) => bake,
            Err(e) => return Ok(format!("| `{slug}`, {what} | | | {e} | | |")),
        };
        let (mut all, mut shading) = (Vec::new(), 0.0);
        for points in self.points.chunks(POINTS) {
            let wo = points[0].at.wo.as_vec3();
            bake.frame(&View { eye: 1e6 * wo, forward: -wo, ..View::default() });
            let mut buf = PointsBuf::with_capacity(TIMED);
            for p in points.iter().cycle().take(TIMED) {
                buf.push(p.at.frame.n.as_vec3(), p.at.frame.t.as_vec3(), wo, Vec3::ZERO);
            }
            let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; buf.len()]);
            let ((), s) = seconds(|| bake.shade(&buf.as_points(), &mut Radiance::of(&mut rgb)));
            shading += 1e9 * s / (TIMED * VIEWS) as f64;
            all.extend((0..points.len()).map(|i| rgb.each_ref().map(|c| f64::from(c[i]))));
        }
        Ok(format!(
            "| `{slug}`, {what} | {} | {made:.2} | {} | {shading:.0} | {} |",
            bake.bytes(),
            percent(self.error(&all)),
            certified(bake.certificate())
        ))
    }
}

/// Σ_k σ_k g_k(C) h_k(wo').
fn product(svd: &Svd, terms: usize, near: &[(usize, f64); 4], views: &[(usize, f64); 4]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for k in 0..terms {
        let h: f64 = svd.values[k] * views.iter().map(|(at, w)| w * svd.right[k][*at]).sum::<f64>();
        for (texel, w) in near {
            (0..3).for_each(|c| sum[c] += h * w * svd.left[k][3 * texel + c]);
        }
    }
    sum
}

fn project(brdf: &dyn Brdf, p: usize) -> Result<Lpq> {
    Ok(Lpq::project(brdf, Centre::Reflection, F, p, &Task::quiet())?)
}

fn terms<'a>(lpq: &'a Lpq, pairs: &[(usize, usize)]) -> Vec<Term<'a>> {
    pairs.iter().map(|&(p, q)| Term { q, k: lpq.row(p, q) }).collect()
}

fn maps(light: &ColumnsRgb, lpq: &Lpq, p: usize) -> Result<CoefficientMaps> {
    let plan = Plan::new(F, p, Grid::new(GRID[0], GRID[1]));
    Ok(plan.maps(light, &terms(lpq, &pairs(p)), &Task::quiet())?)
}

fn local([theta, phi]: [f64; 2]) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

fn harmonics(order: usize, d: DVec3) -> Vec<f64> {
    let mut y = vec![0.0; sh::count(order)];
    sh::eval(order, d, &mut y);
    y
}
