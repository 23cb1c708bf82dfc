//! Figure 4 of Green, Kautz & Durand 2007, *Efficient Reflectance and Visibility Approximations for
//! Environment Map Rendering*: the error of K = 3 Gaussians at N = 15 elevations, here over all materials of
//! the published descriptions of MERL's measurements (tabulated factors, neural networks, shifted-gamma
//! fits), the worst ones named; of round Gaussians, the paper's, and stretched ones.
//!
//! Errors are those of the specular part, as in the paper, squared ("energy") and plain ("norm"), relative to
//! it at each elevation; and the squared error relative to the whole of f·cos, diffuse part included.

use super::{Options, percent, say};
use anyhow::Result;
use std::time::Instant;
use steradian_base::Task;
use steradian_brdf::fit::gaussian::{GaussianFit, Objective, Plan, Shape, SliceReport};
use steradian_brdf::measured::expand;
use steradian_brdf::{Files, parse_with};
use steradian_parallel::prelude::*;

/// The paper's five are not named; these have its range of glosses.
const FIVE: [&str; 5] =
    ["green-metallic-paint", "blue-acrylic", "gold-metallic-paint", "nickel", "red-metallic-paint"];
/// The paper: "peak percent L² error of 18 % at severely grazing angles, and average error below 5 % for
/// normal views".
const PEAK: f64 = 0.18;
const NORMAL: f64 = 0.05;
/// Views up to here count as normal ones, degrees; those beyond the second as grazing past what the paper
/// shows.
const DEGREES: [f64; 2] = [60.5, 84.0];

struct Entry {
    name: String,
    report: Vec<SliceReport>,
    seconds: f64,
}

/// The descriptions, each of 100 materials; or what `--brdf` says.
pub fn sets(o: &Options) -> Result<Vec<(String, Vec<String>)>> {
    if !o.brdfs.is_empty() {
        let mut specs = Vec::new();
        for spec in &o.brdfs {
            specs.extend(expand(spec, Files::Any)?);
        }
        return Ok(vec![("given".into(), specs)]);
    }
    let mut out = vec![("shifted-gamma fits (sgd)".to_owned(), expand("sgd:*", Files::Any)?)];
    match steradian_testkit::data("brdfs/merl_reduced") {
        Some(folder) => {
            let folder = folder.display();
            let of = |spec: String| expand(&spec, Files::Any);
            out.push(("tabulated factors (npf)".into(), of(format!("npf:{folder}/npf.bin,*"))?));
            out.push(("networks (nbrdf)".into(), of(format!("nbrdf:{folder}/merl_nbrdf_f32le.bin,*"))?));
        }
        None => say("without the data folder (STERADIAN_DATA): shifted-gamma fits only"),
    }
    Ok(out)
}

pub fn run(o: &Options) -> Result<()> {
    for (name, specs) in sets(o)? {
        let all = [Shape::Round, Shape::Stretched]
            .into_iter()
            .flat_map(|shape| [Objective::Published, Objective::Energy].map(|o| (shape, o)));
        for (shape, objective) in all {
            let plan = Plan { objective, shape, ..Plan::default() };
            let start = Instant::now();
            let all = fitted(&specs, plan)?;
            let what = if objective == Objective::Published { "eq. 8" } else { "with the albedo kept" };
            let kind = if shape == Shape::Round { "round" } else { "stretched" };
            say(&format!(
                "{name}: {} materials, K = 3, N = 15, {kind} lobes, {what}, {:.1} s",
                all.len(),
                start.elapsed().as_secs_f64()
            ));
            summary(&all);
            say("");
        }
    }
    Ok(())
}

fn fitted(specs: &[String], plan: Plan) -> Result<Vec<Entry>> {
    let task = Task::quiet();
    let one = |spec: &String| -> Result<Entry> {
        let brdf = parse_with(spec, Files::Any)?;
        let start = Instant::now();
        let fit = GaussianFit::new(&*brdf, plan, &task)?;
        let name = spec.rsplit([',', ':']).next().unwrap_or(spec).to_owned();
        Ok(Entry { name, report: fit.report, seconds: start.elapsed().as_secs_f64() })
    };
    let all: Vec<Result<Entry>> = specs.par_iter().with_max_len(1).map(one).collect();
    all.into_iter().collect()
}

/// Sorted values with their materials, ascending.
fn sorted(all: &[Entry], of: impl Fn(&Entry) -> f64) -> Vec<(f64, &str)> {
    let mut v: Vec<(f64, &str)> = all.iter().map(|e| (of(e), e.name.as_str())).collect();
    v.sort_by(|a, b| a.0.total_cmp(&b.0));
    v
}

fn summary(all: &[Entry]) {
    let Some(views) = all.first().map(|e| e.report.len()) else { return };
    say(&format!(
        "{:>6}  {:>27}  {:>27}  {:>18}  worst of the energy",
        "angle", "energy: median, 90th, worst", "norm: median, 90th, worst", "of whole: med, 90th"
    ));
    for i in 0..views {
        let at = |v: &[(f64, &str)], share: f64| v[((share * v.len() as f64) as usize).min(v.len() - 1)].0;
        let energy = sorted(all, |e| e.report[i].energy);
        let norm = sorted(all, |e| e.report[i].norm());
        let whole = sorted(all, |e| e.report[i].of_whole);
        let three = |v: &[(f64, &str)]| [at(v, 0.5), at(v, 0.9), at(v, 1.0)].map(percent).join(" ");
        let last = energy.len() - 1;
        let worst: Vec<&str> = (0..3.min(energy.len())).map(|k| energy[last - k].1).collect();
        say(&format!(
            "{:>5.1}°  {:>27}  {:>27}  {:>18}  {}",
            all[0].report[i].theta.to_degrees(),
            three(&energy),
            three(&norm),
            [at(&whole, 0.5), at(&whole, 0.9)].map(percent).join(" "),
            worst.join(", ")
        ));
    }
    let mean = |e: &Entry| {
        let normal: Vec<f64> = views_to(e, DEGREES[0]).map(|r| r.energy).collect();
        normal.iter().sum::<f64>() / normal.len() as f64
    };
    let peak = |e: &Entry, degrees: f64| views_to(e, degrees).map(|r| r.energy).fold(0.0, f64::max);
    let whole = |e: &Entry| views_to(e, 90.0).map(|r| r.of_whole).fold(0.0, f64::max);
    let count = |f: &dyn Fn(&Entry) -> bool| all.iter().filter(|e| f(e)).count();
    say(&format!(
        "mean to 60° at most {}: {} materials; peak at most {} to 84°: {}, to 89°: {}; both, to 84°: {}; peak of the whole at most {} to 89°: {}",
        percent(NORMAL),
        count(&|e| mean(e) <= NORMAL),
        percent(PEAK),
        count(&|e| peak(e, DEGREES[1]) <= PEAK),
        count(&|e| peak(e, 90.0) <= PEAK),
        count(&|e| mean(e) <= NORMAL && peak(e, DEGREES[1]) <= PEAK),
        percent(PEAK),
        count(&|e| whole(e) <= PEAK),
    ));
    let worst = sorted(all, |e| peak(e, DEGREES[1]));
    let named: Vec<String> =
        worst.iter().rev().take(8).map(|(e, n)| format!("{n} {}", percent(*e))).collect();
    say(&format!("worst peaks to 84°: {}", named.join(", ")));
    for name in FIVE {
        if let Some(e) = all.iter().find(|e| e.name == name) {
            let line: Vec<String> = e.report.iter().map(|r| format!("{:.1}", 100.0 * r.energy)).collect();
            say(&format!("{name:<22} energy, % by angle: {}", line.join(" ")));
        }
    }
    let seconds = sorted(all, |e| e.seconds);
    let failed: usize = all.iter().flat_map(|e| &e.report).filter(|r| !r.converged).count();
    say(&format!(
        "a material took {:.3} s in the median, {:.3} s at most ({}); views that did not converge: {failed} of {}",
        seconds[seconds.len() / 2].0,
        seconds[seconds.len() - 1].0,
        seconds[seconds.len() - 1].1,
        all.len() * views
    ));
}

fn views_to(e: &Entry, degrees: f64) -> impl Iterator<Item = &SliceReport> {
    e.report.iter().filter(move |r| r.theta.to_degrees() <= degrees)
}
