//! Figure 5.7: how much of a reflectance's energy F = 30 and P = 0 … 5 hold.
//!
//! The paper's bars are of the 61 CUReT samples, whose measurements are not public any more in one place;
//! ours of every measured or fitted material that can be read here: the fits to the MERL set (SGD, ABC), the
//! published Lafortune lobes, measured files of the data folder where this build reads them, and whatever
//! `--brdf` names.

use super::chart::{self, Bar};
use super::{Options, percent, save, say};
use anyhow::Result;
use std::time::Instant;
use steradian_base::Task;
use steradian_brdf::central::{Centre, Lpq};
use steradian_brdf::{Files, SharedBrdf, SpecError, parse, parse_with};
use steradian_parallel::prelude::*;
use steradian_testkit::data_dir;

/// The paper's F.
const F: usize = 30;
/// The paper's highest P.
const P: usize = 5;
/// What the paper counts.
const ENOUGH: f64 = 0.9;

/// One material's captured energy by P.
struct Row {
    spec: String,
    share: Vec<f64>,
    /// What q ≠ 0 holds of the energy.
    azimuth: f64,
}

/// Names of the published sets of a model: the error about one that does not exist lists them.
fn sets(model: &str, prefix: &str) -> Vec<String> {
    match parse(&format!("{model}:{prefix}?")) {
        Err(SpecError::UnknownSet { available, .. }) => {
            // A short name of one of them is none more.
            let alias = |n: &&str| **n != *"skin";
            available.into_iter().filter(alias).map(|n| format!("{model}:{prefix}{n}")).collect()
        }
        _ => Vec::new(),
    }
}

/// Everything at hand, by family.
fn families(o: &Options) -> Vec<(&'static str, Vec<String>)> {
    let mut out = vec![
        ("Lafortune lobes, published sets", sets("lafortune", "@")),
        ("SGD fits to MERL materials", sets("sgd", "")),
        ("ABC fits to MERL materials", sets("abc", "")),
    ];
    let measured: Vec<String> = files();
    if !measured.is_empty() {
        out.push(("measured files", measured));
    }
    if !o.brdfs.is_empty() {
        out.push(("given", o.brdfs.clone()));
    }
    out
}

/// Specs of the measured files in the data folder.
fn files() -> Vec<String> {
    let Some(folder) = data_dir().map(|d| d.join("brdfs")) else { return Vec::new() };
    let mut out = Vec::new();
    for (model, sub, extension) in [
        ("rgl", "rgl", "bsdf"),
        ("merl", "merl", "binary"),
        ("cornell", "cornell", "brdf"),
        ("alta", "retro", "dat"),
        ("brdflab", "analytic_fits/brdflab_xml", "xml"),
    ] {
        let Ok(entries) = std::fs::read_dir(folder.join(sub)) else { continue };
        let mut paths: Vec<_> = entries.flatten().map(|e| e.path()).collect();
        paths.retain(|p| p.extension().is_some_and(|e| e == extension));
        paths.sort();
        out.extend(paths.iter().map(|p| format!("{model}:{}", p.display())));
    }
    out.extend(curet(&folder.join("curet/rbrdf.dat")));
    out
}

/// CUReT's 61 samples, where they are at hand.
fn curet(path: &std::path::Path) -> Vec<String> {
    let sample = |i: u32| format!("curet:{},sample={i}", path.display());
    if path.is_file() { (1..=61).map(sample).collect() } else { Vec::new() }
}

/// The reflectance of a spec, whose file may be anywhere.
fn open(spec: &str) -> Result<SharedBrdf> {
    Ok(parse_with(spec, Files::Any)?)
}

fn row(spec: &str) -> Result<Row> {
    let brdf = open(spec)?;
    let lpq = Lpq::project(&*brdf, Centre::Reflection, F, P, &Task::quiet())?;
    let share = (0..=P).map(|p| share(&lpq, p)).collect();
    let energy: f64 = lpq.energy.iter().sum();
    let zonal: f64 =
        (0..=P).map(|p| lpq.row(p, 0).iter().flat_map(|r| r.iter()).map(|x| x * x).sum::<f64>()).sum();
    let all: f64 = lpq.captured(F, P).iter().sum();
    Ok(Row { spec: short(spec), share, azimuth: if energy > 0.0 { (all - zonal) / energy } else { 0.0 } })
}

/// Of all channels together, as the paper has one.
fn share(lpq: &Lpq, p: usize) -> f64 {
    let (captured, energy): (f64, f64) = (lpq.captured(F, p).iter().sum(), lpq.energy.iter().sum());
    if energy > 0.0 { captured / energy } else { 1.0 }
}

/// A spec without folders.
fn short(spec: &str) -> String {
    match (spec.split_once(':'), spec.rsplit_once('/')) {
        (Some((model, _)), Some((_, file))) => format!("{model}:{file}"),
        _ => spec.into(),
    }
}

pub fn run(o: &Options) -> Result<()> {
    say(&format!(
        "Figure 5.7: share of the energy that F = {F} and P = 0 … {P} hold, about the mirror direction"
    ));
    say(&head());
    let start = Instant::now();
    let mut bars = Vec::new();
    let mut counts = Vec::new();
    for (family, specs) in families(o) {
        let mut rows: Vec<Row> = specs.par_iter().map(|s| row(s)).collect::<Result<_>>()?;
        rows.sort_by(|a, b| a.share[P].total_cmp(&b.share[P]));
        say(&format!("-- {family}"));
        for r in &rows {
            say(&line(r));
            bars.push(Bar { label: r.spec.clone(), values: r.share.clone() });
        }
        let good = |p: usize, least: f64| rows.iter().filter(|r| r.share[p] > least).count();
        counts.push((family, rows.len(), good(P, ENOUGH), good(3, 0.95), good(2, ENOUGH)));
    }
    say("");
    say(
        "                                    materials   > 90 % at P = 5   > 95 % at P = 3   > 90 % at P = 2",
    );
    let total = counts.iter().fold((0, 0, 0, 0), |t, c| (t.0 + c.1, t.1 + c.2, t.2 + c.3, t.3 + c.4));
    for (name, n, five, three, two) in
        counts.iter().copied().chain([("all", total.0, total.1, total.2, total.3)])
    {
        say(&format!("{name:<34}  {n:>9}   {five:>15}   {three:>15}   {two:>15}"));
    }
    say(
        "paper, CUReT                               61                56            \"most\"                 -",
    );
    say(&format!("{:.1} s of wall time", start.elapsed().as_secs_f64()));
    let title = format!("Energy of BRDFs in harmonics: F = {F}, P = 0 to {P}");
    let subtitle =
        format!("{} of {} materials above 90 % at P = 5 (paper: 56 of 61 CUReT samples)", total.1, total.0);
    save(o, "figure-5.7.png", &chart::draw(&title, &subtitle, &bars))
}

fn head() -> String {
    let orders: String = (0..=P).map(|p| format!("{:>9}", format!("P = {p}"))).collect();
    format!("{:<40}{orders}{:>10}", "material", "q /= 0")
}

fn line(r: &Row) -> String {
    let shares: String = r.share.iter().map(|s| format!("{:>9}", percent(*s))).collect();
    format!("{:<40}{shares}{:>10}", r.spec, percent(r.azimuth))
}
