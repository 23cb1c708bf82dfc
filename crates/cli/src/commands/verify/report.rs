//! What was found, in words and as JSON.

use super::fit::{Kernel, UNEXPLAINED};
use super::laws::{self, Consumer, Law};
use super::level::{Checked, Coefficients, Error};
use super::orient::Turn;
use glam::DMat3;
use serde_json::{Value, json};
use std::f64::consts::PI;
use steradian_brdf::dfg;
use steradian_light::load::{PROFILES, Profile};

/// Factors that have a name.
const FACTORS: [(f64, &str); 8] = [
    (PI, "pi: irradiance E where E/pi is expected, or 1/pi missing"),
    (1.0 / PI, "1/pi: divided by pi once too often"),
    (2.0 * PI, "2 pi"),
    (0.5 / PI, "1/(2 pi)"),
    (4.0 * PI, "4 pi"),
    (0.25 / PI, "1/(4 pi)"),
    (0.04, "0.04: F0 of a dielectric baked in"),
    (179.0, "179 lm/W: luminance for radiance"),
];

/// A factor in words; `None` where it is 1 within a part in a hundred.
fn factor(s: f64) -> Option<String> {
    if (s - 1.0).abs() < 0.01 { None } else { Some(named(s).unwrap_or_else(|| format!("{s:.4}"))) }
}

/// The name of a factor.
fn named(s: f64) -> Option<String> {
    let near = |a: f64, b: f64, t: f64| (a / b - 1.0).abs() < t;
    if let Some((_, name)) = FACTORS.iter().find(|(f, _)| near(s, *f, 0.01)) {
        return Some((*name).into());
    }
    let ev = if s > 0.0 { s.log2() } else { f64::NAN };
    if ev.is_finite() && (ev - ev.round()).abs() < 0.01 {
        return Some(format!("{s:.4}: an exposure of {:+.0} EV", ev.round()));
    }
    None
}

/// What the file as a whole is like.
pub struct Summary {
    /// One sentence each; none where all is as expected.
    pub faults: Vec<String>,
    /// The law that the levels follow best, and how far they are from it.
    pub law: Option<(&'static str, f64)>,
}

impl Summary {
    /// `read` is the convention that the light was read by.
    pub fn new(consumer: &Consumer, levels: &[Checked], sh: Option<&Coefficients>, read: &Profile) -> Self {
        let mut faults = Vec::new();
        turned(levels, read, &mut faults);
        let law = law(consumer, levels, &mut faults);
        scaled(levels, &mut faults);
        clamped(levels, &mut faults);
        if let Some(sh) = sh {
            if let Some(f) = factor(sh.scale) {
                faults.push(format!("irradiance coefficients: factor {f}"));
            } else if sh.fitted_rms > 0.02 {
                faults.push(format!("irradiance coefficients: {:.1} % off", 100.0 * sh.fitted_rms));
            }
        }
        for (m, l) in levels.iter().enumerate() {
            if let Some((limit, texels)) = l.clipped {
                faults.push(format!(
                    "level {m}: {texels} texels are clipped at {limit}, the largest value of the format"
                ));
            }
        }
        let off: Vec<String> = levels
            .iter()
            .enumerate()
            .filter(|(_, l)| l.fitted.rms > 0.02 && l.clipped.is_none() && !l.found.turn.interpolates())
            .map(|(m, l)| format!("{m} ({:.1} %)", 100.0 * l.fitted.rms))
            .collect();
        if !off.is_empty() {
            faults.push(format!("noise, bias or damage that no kernel explains: level {}", off.join(", ")));
        }
        Self { faults, law }
    }

    /// All in one line.
    pub fn line(&self) -> String {
        if self.faults.is_empty() { "no fault has a name".into() } else { self.faults.join("; ") }
    }
}

/// Numbers of levels as text.
fn listed(levels: &[usize], all: usize) -> String {
    if levels.len() == all {
        return if all == 1 { String::new() } else { "every level: ".into() };
    }
    let text: Vec<String> = levels.iter().map(usize::to_string).collect();
    format!("level {}: ", text.join(", "))
}

/// Where a turn is what comes of another way to read a lat-long light: the options that read it so.
fn convention(turn: &Turn, read: &Profile) -> String {
    let Turn::Axes(g) = turn else { return String::new() };
    // World w of another tool is our direction p w, and found at w = pᵀ d.
    let same = |p: &&Profile| (p.latlong().transpose() * read.latlong() - *g).abs_diff_eq(DMat3::ZERO, 1e-9);
    let names: Vec<&str> = PROFILES.iter().filter(same).map(|p| p.name).collect();
    match names.len() {
        0 => String::new(),
        _ => format!(" (as of a lat-long light that is read with --light-profile {})", names.join(", ")),
    }
}

fn turned(levels: &[Checked], read: &Profile, faults: &mut Vec<String>) {
    let mut named: Vec<(String, Vec<usize>)> = Vec::new();
    for (m, l) in levels.iter().enumerate().filter(|(_, l)| !l.found.turn.is_identity()) {
        let again = " (undone by interpolation: add this angle to --rotate to measure past it)";
        let name = l.found.turn.name() + if l.found.turn.interpolates() { again } else { "" };
        let name = name + &convention(&l.found.turn, read);
        match named.iter_mut().find(|(n, _)| *n == name) {
            Some((_, at)) => at.push(m),
            None => named.push((name, vec![m])),
        }
    }
    for (name, at) in named {
        faults.push(format!("{}{name}", listed(&at, levels.len())));
    }
}

fn law(consumer: &Consumer, levels: &[Checked], faults: &mut Vec<String>) -> Option<(&'static str, f64)> {
    let last = levels.len() - 1;
    let explained = |m: usize| levels[m].fit.residual < UNEXPLAINED;
    let wrong: Vec<usize> =
        (0..levels.len()).filter(|&m| explained(m) && !levels[m].kernel_is_right()).collect();
    let rough = |m: usize| levels[m].fit.kernel.roughness().filter(|_| m > 0 && explained(m));
    let fitted: Vec<(usize, f64)> = (0..levels.len()).filter_map(|m| Some((m, rough(m)?))).collect();
    let found = if matches!(consumer.law, Law::Roughness(_)) { laws::closest(&fitted, last) } else { None };
    let follows = found.is_some_and(|(_, e)| e < 0.03) && fitted.len() > 1;
    if wrong.is_empty() {
        return found;
    }
    let same_family = wrong.iter().all(|&m| levels[m].fit.kernel.family == levels[m].expected.family);
    if same_family
        && follows
        && let Some((name, _)) = found
    {
        faults.push(format!("levels follow another curve: {name}"));
        return found;
    }
    let mut named: Vec<(String, Vec<usize>)> = Vec::new();
    for &m in &wrong {
        let l = &levels[m];
        let name = format!("{} instead of {}", l.fit.kernel.family.name(), l.expected.family.name());
        let name = if l.fit.kernel.family == l.expected.family { "another width".into() } else { name };
        match named.iter_mut().find(|(n, _)| *n == name) {
            Some((_, at)) => at.push(m),
            None => named.push((name, vec![m])),
        }
    }
    for (name, at) in named {
        let widths: Vec<String> = at.iter().map(|&m| width(levels[m].fit.kernel)).collect();
        faults.push(format!("{}{name} ({})", listed(&at, levels.len()), widths.join(", ")));
    }
    found
}

/// A kernel's width in words.
fn width(k: Kernel) -> String {
    match k.roughness() {
        Some(r) => format!("r {r:.3}"),
        None if k.width > 0.0 => format!("n {:.1}", k.width),
        None => k.family.name().into(),
    }
}

fn scaled(levels: &[Checked], faults: &mut Vec<String>) {
    // Beside clipped texels a factor is not known well.
    let whole = |l: &Checked| l.clipped.is_none() || levels.iter().all(|l| l.clipped.is_some());
    let known: Vec<(usize, &Checked)> =
        levels.iter().enumerate().filter(|(_, l)| l.fit.residual < 0.1 && whole(l)).collect();
    if let Some(f0) = reflectance(&known) {
        let [r, g, b] = f0;
        faults.push(format!(
            "the reflectance of a surface of F0 = {r:.3}/{g:.3}/{b:.3} at normal incidence is baked in"
        ));
        return;
    }
    let mut texts: Vec<(String, Vec<usize>)> = Vec::new();
    let mut other: Vec<(usize, f64)> = Vec::new();
    for (m, l) in known {
        let coloured = l.fit.scale.iter().any(|s| (s / l.fit.gain() - 1.0).abs() > 0.02);
        let text = if coloured {
            let [r, g, b] = l.fit.scale;
            Some(format!("a coloured factor {r:.3}/{g:.3}/{b:.3}: a surface's colour baked in"))
        } else {
            let gain = l.fit.gain();
            if factor(gain).is_some() && named(gain).is_none() {
                other.push((m, gain));
            }
            factor(gain).and_then(|_| named(gain)).map(|f| format!("factor {f}"))
        };
        let Some(text) = text else { continue };
        match texts.iter_mut().find(|(n, _)| *n == text) {
            Some((_, at)) => at.push(m),
            None => texts.push((text, vec![m])),
        }
    }
    if !other.is_empty() {
        let (at, gains): (Vec<usize>, Vec<String>) =
            other.iter().map(|(m, gain)| (*m, format!("{gain:.4}"))).unzip();
        let alike = gains.iter().all(|g| *g == gains[0]);
        let text =
            if alike { format!("factor {}", gains[0]) } else { format!("factors {}", gains.join(", ")) };
        texts.push((text, at));
    }
    for (text, at) in texts {
        faults.push(format!("{}{text}", listed(&at, levels.len())));
    }
}

/// F0 such that each level is scaled by the split sum's F0 A + B at normal incidence.
fn reflectance(levels: &[(usize, &Checked)]) -> Option<[f64; 3]> {
    let rows: Vec<([f64; 3], f64, f64)> = levels
        .iter()
        .filter_map(|(_, l)| {
            let alpha = l.fit.kernel.roughness()?.powi(2);
            let d = if alpha < 1e-3 {
                dfg::Dfg { scale: 1.0, bias: 0.0 }
            } else {
                dfg::ggx(1.0, alpha.max(1e-4))
            };
            Some((l.fit.scale, d.scale, d.bias))
        })
        .collect();
    if rows.len() < 3 {
        return None;
    }
    let f0: [f64; 3] = std::array::from_fn(|c| {
        let (mut sa, mut aa) = (0.0, 0.0);
        for (s, a, b) in &rows {
            sa += (s[c] - b) * a;
            aa += a * a;
        }
        sa / aa
    });
    let fits = rows.iter().all(|(s, a, b)| (0..3).all(|c| (s[c] / (f0[c] * a + b) - 1.0).abs() < 0.015));
    // Where all levels have one factor it is not the reflectance, which falls with roughness.
    let range = rows.iter().fold((f64::INFINITY, 0.0f64), |(lo, hi), r| (lo.min(r.0[0]), hi.max(r.0[0])));
    (fits && range.1 / range.0 > 1.03 && f0.iter().all(|f| (0.0..=1.02).contains(f))).then_some(f0)
}

fn clamped(levels: &[Checked], faults: &mut Vec<String>) {
    let at: Vec<usize> = (0..levels.len()).filter(|&m| levels[m].is_clamped()).collect();
    if at.is_empty() {
        return;
    }
    let mut held: Vec<f64> = at.iter().map(|&m| levels[m].fit.held).collect();
    held.sort_by(f64::total_cmp);
    let mut radiance: Vec<f64> = at.iter().filter_map(|&m| levels[m].clamped_at).collect();
    radiance.sort_by(f64::total_cmp);
    let c = radiance
        .get(radiance.len() / 2)
        .map(|c| format!(", as if clipped at about {c:.3}"))
        .unwrap_or_default();
    faults.push(format!(
        "{}the sun is clamped: {:.1} % of the brightest light is there{c}",
        listed(&at, levels.len()),
        100.0 * held[held.len() / 2]
    ));
}

fn error_json(e: &Error) -> Value {
    json!({"rms": e.rms, "bias": e.bias, "worst": e.worst})
}

fn kernel_json(k: Kernel) -> Value {
    let exponent = (k.family.name() == "phong").then_some(k.width);
    json!({
        "kernel": k.family.name(),
        "perceptual_roughness": k.roughness(),
        "alpha": k.roughness().map(|r| r * r),
        "exponent": exponent,
    })
}

fn level_json(m: usize, l: &Checked) -> Value {
    json!({
        "level": m,
        "width": l.image.width,
        "height": l.image.height,
        "layout": l.image.layout.name(),
        "expected": kernel_json(l.expected),
        "found": kernel_json(l.fit.kernel),
        "kernel_as_expected": l.kernel_is_right(),
        "residual": l.fit.residual,
        "expected_residual": l.expected_fit.residual,
        "orientation": l.found.turn.json(),
        "orientation_certain": l.found.certain,
        "orientation_residual": {"as_found": l.found.residual, "as_it_is": l.found.straight},
        "scale": l.fit.gain(),
        "scale_rgb": l.fit.scale,
        "scale_name": factor(l.fit.gain()),
        "brightest_light_held": l.fit.held,
        "clamped_at": l.clamped_at,
        "clipped": l.clipped.map(|(limit, texels)| json!({"at": limit, "texels": texels})),
        "error": error_json(&l.nominal),
        "error_as_found": error_json(&l.fitted),
    })
}

/// The report as JSON.
pub fn json(
    file: Option<String>,
    consumer: &Consumer,
    levels: &[Checked],
    sh: Option<&Coefficients>,
    summary: &Summary,
    worst: f64,
    tolerance: Option<f64>,
) -> Value {
    json!({
        "file": file,
        "profile": consumer.name,
        "levels": levels.iter().enumerate().map(|(m, l)| level_json(m, l)).collect::<Vec<_>>(),
        "irradiance_coefficients": sh.map(|s| json!({
            "scale": s.scale, "scale_name": factor(s.scale), "rms": s.rms, "rms_as_found": s.fitted_rms,
        })),
        "law": summary.law.map(|(name, distance)| json!({"name": name, "distance": distance})),
        "faults": summary.faults,
        "error": worst,
        "tolerance": tolerance,
        "within_tolerance": tolerance.map(|t| worst <= t),
    })
}

/// The report in words.
pub fn text(consumer: &Consumer, levels: &[Checked], sh: Option<&Coefficients>, summary: &Summary) -> String {
    let mut out = format!(
        "profile {}; per level: what it holds (what is expected), orientation, factor, relative RMS error against\n\
         what is expected (bias, worst texel), and against what it holds\n",
        consumer.name
    );
    for (m, l) in levels.iter().enumerate() {
        let (found, wanted) = (l.fit.kernel, l.expected);
        let kernel =
            format!("{} {} ({} {})", found.family.name(), width(found), wanted.family.name(), width(wanted));
        let turn = if l.found.certain { l.found.turn.name() } else { "any orientation".into() };
        let (n, f) = (l.nominal, l.fitted);
        out.push_str(&format!(
            "{m:2}  {:>4} x {:<4} {kernel:<36} {turn}, x {:.4}  {:.2e} ({:+.1e}, {:.1e})  {:.2e}\n",
            l.image.width,
            l.image.height,
            l.fit.gain(),
            n.rms,
            n.bias,
            n.worst,
            f.rms
        ));
    }
    if let Some(sh) = sh {
        out.push_str(&format!("irradiance coefficients: x {:.4}, {:.2e} off\n", sh.scale, sh.rms));
    }
    if let Some((name, distance)) = summary.law {
        out.push_str(&format!("curve: {name}, within {distance:.3}\n"));
    }
    if summary.faults.is_empty() {
        out.push_str("as expected\n");
    }
    summary.faults.iter().for_each(|f| out.push_str(&format!("fault: {f}\n")));
    out
}
