//! One slice: the first two passes of 5.22, k_lq(θ_o) = ∫ (∫ f_cos cos qφ dφ) f_lq(θ_i) sin θ_i dθ_i.

use super::bands::{Bands, Rgb};
use super::geometry::{Slice, Zone};
use super::ring::{Rings, width};
use super::rule::{self, Node, POINTS};
use super::theta::Polar;
use crate::adaptive::graded;
use crate::{Brdf, Domain};
use steradian_base::{Cancelled, Task};

/// Orders and accuracy that [`slice`] must reach.
#[derive(Debug, Clone, Copy)]
pub(super) struct Request {
    pub f: usize,
    pub q: usize,
    /// RMS error of f_cos relative to its norm.
    pub tolerance: f64,
    /// f_cos(φ) ≠ f_cos(−φ).
    pub two_sided: bool,
}

/// Circles per slice, in panels, at most; two more rounds may finish.
const MAX_PANELS: usize = 256;
/// A part of a panel spans at most this many radians of f_lq: a wave of 9 radians is integrated to 2e-6 by
/// the 7-point rule, by whose difference panels are divided, and to rounding by the 15-point rule.
const MAX_PHASE: f64 = 9.0;
/// Longest panel before any refinement, in the zone's parameter.
const MAX_LENGTH: f64 = 1.0;

/// One slice's coefficients.
#[derive(Debug, Clone)]
pub(super) struct Kernel {
    /// `[q][c][l]`.
    pub k: Vec<f64>,
    /// ∫ f_cos² dwi.
    pub energy: [f64; 3],
    /// ∫ f_cos (n·wi)₊ dwi.
    pub cosine: [f64; 3],
    /// Estimated RMS error of f_cos relative to its norm.
    pub accuracy: f64,
}

/// A panel of elevations with the circle integrals at its nodes. It is as short as the reflectance asks for:
/// where f_lq has more than [`MAX_PHASE`] radians in it, the circle integrals are interpolated to the nodes
/// of its parts, since circles take most of the time. (With panels as short as f_lq's waves, slices of GGX of
/// α = 0.1 for a bake of `shrm_slices` took 1.25 s on two cores, with interpolation 0.65; those of a file of
/// `rgl:` 8.2, now 2.3.)
struct Panel {
    zone: Zone,
    ends: [f64; 2],
    /// `[node][width]`, times sin θ dθ/ds.
    rings: Vec<f64>,
    /// Length of a part at most.
    wave: f64,
}

/// The coefficients of one slice. Tabulated data needs thousands of circles of thousands of evaluations, so
/// cancellation is checked between panels.
pub(super) fn slice(
    brdf: &dyn Brdf,
    slice: &Slice,
    request: &Request,
    polar: &Polar,
    task: &Task,
) -> Result<Kernel, Cancelled> {
    let hemisphere = brdf.domain() == Domain::Hemisphere;
    let mut rings = Rings::new(brdf, slice, request.q, request.two_sided, 0.3 * request.tolerance);
    let mut panels: Vec<Panel> = Vec::new();
    for (zone, ends) in Zone::of(slice, hemisphere) {
        let breaks = graded(ends[0], ends[1], &centres(&rings, zone, slice));
        let slope = if let Zone::Band { gamma, .. } = zone { gamma } else { 1.0 };
        let wave = MAX_PHASE / (request.f.max(1) as f64 * slope);
        for ends in rule::split(&breaks, wave.max(MAX_LENGTH)) {
            task.check()?;
            panels.push(sample(&mut rings, zone, ends, wave));
        }
    }
    refine(panels, &mut rings, request, polar, task)
}

/// Places at which lobes and the horizon need short panels: (parameter, width).
fn centres(rings: &Rings, zone: Zone, slice: &Slice) -> Vec<(f64, f64)> {
    let scale = if let Zone::Band { gamma, .. } = zone { gamma } else { 1.0 };
    let mut at: Vec<(f64, f64)> =
        rings.spots.iter().map(|s| (zone.parameter(s.theta), s.width / scale)).collect();
    if slice.lean() == 0.0 || scale != 1.0 {
        return at;
    }
    at.push((zone.parameter(std::f64::consts::FRAC_PI_2 - slice.lean().abs()), 0.5));
    at
}

/// The circle integrals at the nodes of a panel.
fn sample(rings: &mut Rings, zone: Zone, ends: [f64; 2], wave: f64) -> Panel {
    let n = width(rings.order());
    let mut out = vec![0.0; POINTS * n];
    let nodes = rule::nodes(ends[0], ends[1]);
    for (node, out) in nodes.iter().zip(out.chunks_exact_mut(n)) {
        let at = zone.elevation(node.at);
        rings.integrate(&at, out);
        let area = at.theta.sin() * at.slope;
        out.iter_mut().for_each(|x| *x *= area);
    }
    Panel { zone, ends, rings: out, wave }
}

/// Rounds of bisection until the estimated error is small.
fn refine(
    mut panels: Vec<Panel>,
    rings: &mut Rings,
    request: &Request,
    polar: &Polar,
    task: &Task,
) -> Result<Kernel, Cancelled> {
    let n = width(request.q);
    let tail = 3 * (request.q + 1);
    let total: f64 = panels.iter().map(|p| integral(p, n, tail..tail + 3)).sum();
    rings.floor = 0.1 * request.tolerance * (std::f64::consts::PI * total).sqrt();
    let mut made = panels.len();
    let mut bands = Bands::new(request, polar);
    let mut k: Vec<Rgb> = vec![Default::default(); bands.sum.len()];
    let mut sum = k.clone();
    let mut kernel = Kernel { k: Vec::new(), energy: [0.0; 3], cosine: [0.0; 3], accuracy: 0.0 };
    let mut square_error = 0.0;
    let enough = request.tolerance * total.sqrt() / (made as f64).sqrt();
    while !panels.is_empty() {
        let mut next = Vec::new();
        for panel in panels {
            task.check()?;
            let [a, b] = panel.ends;
            let parts = ((b - a) / panel.wave).ceil().max(1.0) as usize;
            let missed = missed(&panel, n, tail);
            // An error of the energy weighs as half of it on the norm. Interpolation's error is about that of
            // the 7-point rule for a square: g of 15 nodes is a polynomial of degree 14, g² is integrated up
            // to 13.
            let mut error = 0.5 * missed / total.sqrt().max(f64::MIN_POSITIVE);
            if parts > 1 {
                let here = integral(&panel, n, tail..tail + 3).max(0.0).sqrt();
                error = error.max(missed / here.max(f64::MIN_POSITIVE));
            }
            let projected = error <= enough;
            if projected {
                error = error.max(project(&mut bands, &mut sum, &panel, parts, n, tail));
            }
            if error > enough && made + 2 <= MAX_PANELS.max(2 * panel_limit(request)) && b - a > 1e-9 {
                let middle = 0.5 * (a + b);
                next.extend(
                    [[a, middle], [middle, b]].map(|ends| sample(rings, panel.zone, ends, panel.wave)),
                );
                made += 2;
                continue;
            }
            if !projected {
                project(&mut bands, &mut sum, &panel, parts, n, tail);
            }
            square_error += error * error;
            add(&mut k, &sum);
            for c in 0..3 {
                kernel.energy[c] += integral(&panel, n, tail + c..tail + c + 1);
                kernel.cosine[c] += integral(&panel, n, tail + 3 + c..tail + 4 + c);
            }
        }
        panels = next;
    }
    kernel.k = bands.rows(&k);
    let energy: f64 = kernel.energy.iter().sum();
    kernel.accuracy = if energy > 0.0 { (square_error / energy).sqrt() } else { 0.0 };
    Ok(kernel)
}

/// Panels that an order needs before any refinement.
fn panel_limit(request: &Request) -> usize {
    (request.f as f64 * std::f64::consts::PI / MAX_PHASE) as usize
}

/// The 15-point rule over some of the circle integrals.
fn integral(panel: &Panel, n: usize, range: std::ops::Range<usize>) -> f64 {
    let nodes = rule::nodes(panel.ends[0], panel.ends[1]);
    let one = |node: &Node, ring: &[f64]| node.weight * ring[range.clone()].iter().sum::<f64>();
    nodes.iter().zip(panel.rings.chunks_exact(n)).map(|(node, ring)| one(node, ring)).sum()
}

/// A panel's share of k_lq into `sum`; returns its estimated error.
fn project(bands: &mut Bands, sum: &mut [Rgb], panel: &Panel, parts: usize, n: usize, tail: usize) -> f64 {
    let [a, b] = panel.ends;
    let mut square = 0.0;
    sum.fill(Default::default());
    let mut between = vec![0.0; if parts > 1 { panel.rings.len() } else { 0 }];
    for part in 0..parts {
        let at = |i: usize| a + (b - a) * i as f64 / parts as f64;
        let nodes = rule::nodes(at(part), at(part + 1));
        let thetas = nodes.map(|node| panel.zone.elevation(node.at).theta);
        let rings = if parts > 1 {
            for (node, to) in nodes.iter().zip(between.chunks_exact_mut(n)) {
                to.fill(0.0);
                let weights = rule::interpolation((2.0 * node.at - a - b) / (b - a));
                for (w, ring) in weights.iter().zip(panel.rings.chunks_exact(n)) {
                    to.iter_mut().zip(ring).for_each(|(to, g)| *to += w * g);
                }
            }
            &between
        } else {
            &panel.rings
        };
        square += bands.project(&nodes, &thetas, rings, n).powi(2);
        add(sum, &bands.sum);
    }
    rule::error(square.sqrt(), integral(panel, n, tail..tail + 3).max(0.0).sqrt())
}

fn add(to: &mut [Rgb], more: &[Rgb]) {
    let more = more.as_flattened().as_flattened();
    to.as_flattened_mut().as_flattened_mut().iter_mut().zip(more).for_each(|(a, b)| *a += b);
}

/// The estimated error of a panel's energy.
fn missed(panel: &Panel, n: usize, tail: usize) -> f64 {
    let nodes = rule::nodes(panel.ends[0], panel.ends[1]);
    let (mut energy, mut difference) = (0.0, 0.0);
    for (node, ring) in nodes.iter().zip(panel.rings.chunks_exact(n)) {
        let here: f64 = ring[tail..tail + 3].iter().sum();
        energy += node.weight * here;
        difference += node.difference * here;
    }
    rule::error(difference.abs(), energy.max(0.0))
}
