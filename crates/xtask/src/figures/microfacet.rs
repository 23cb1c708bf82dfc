//! Figure 5.6: the simplified microfacet model (5.34), σ = .2, at rising P; and section 5.7.1's other two
//! reflectances, Lafortune skin at P = 4 and Kajiya–Kay s = 32 at P = 8.

use super::picture::{Ball, Show, bake, certified, reference};
use super::{Options, light, percent, save, say};
use anyhow::Result;
use steradian_base::Task;
use steradian_brdf::central::{Centre, Lpq};
use steradian_brdf::parse;
use steradian_light::Lights;
use steradian_reference::Reference;
use steradian_render::{Row, Sheet};

/// The paper's F and S.
const F: usize = 30;
const S: f64 = 128.0;
/// The highest P shown.
const P: usize = 4;
/// Two views: (θ_o, φ_o) about the mirror direction, degrees. The paper does not say which its own are.
const VIEWS: [[f64; 2]; 2] = [[50.0, 90.0], [110.0, 210.0]];

pub fn run(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/probulator_grace.hdr")?;
    let reference = reference(&lights)?;
    let spec = o.brdfs.first().map_or("microfacet:sigma=0.2", String::as_str);
    microfacet(o, spec, &name, &lights, &reference)?;
    others(o, &name, &lights, &reference)
}

/// The paper's own way: plain projection, maps of S rows.
fn paper(p: usize) -> [(&'static str, f64); 5] {
    [("p", p as f64), ("order", F as f64), ("size", S), ("plain", 1.0), ("centre", 1.0)]
}

fn microfacet(o: &Options, spec: &str, name: &str, lights: &Lights, reference: &Reference) -> Result<()> {
    let side = o.side.unwrap_or(S as usize);
    let brdf = parse(spec)?;
    let lpq = Lpq::project(&*brdf, Centre::Reflection, F, P, &Task::quiet())?;
    say(&format!("Figure 5.6: {spec}, F = {F}, S = {S}, under {name}"));
    say("  P   energy held   epsilon   sqrt   view 1   view 2   all views        paper");
    let balls = VIEWS.map(|[theta, phi]| Ball::map(side, theta.to_radians(), phi.to_radians()));
    let truths = [balls[0].truth(reference, &*brdf)?, balls[1].truth(reference, &*brdf)?];
    let shows = truths.each_ref().map(Show::of);
    let mut rows: Vec<Row> = VIEWS.iter().flat_map(|v| [view_row(*v), Row::default()]).collect();
    for (v, show) in shows.iter().enumerate() {
        rows[2 * v].cells.push(show.cell(&truths[v], vec!["integral".into()]));
        rows[2 * v + 1].cells.push(None);
    }
    for p in 0..=P {
        let mut bake = bake("shrm", &brdf, lights, &paper(p))?;
        let held = lpq.share(F, p);
        let mut errors = [0.0; 2];
        for (v, (ball, show)) in balls.iter().zip(&shows).enumerate() {
            let film = ball.shaded(&mut *bake);
            errors[v] = show.errors(&film).relative_rms;
            let caption = vec![format!("{} held", percent(held)), format!("error {}", percent(errors[v]))];
            rows[2 * v].cells.push(show.cell(&film, caption));
            rows[2 * v + 1].cells.push(show.difference(&film, 1.0));
        }
        let note = if p == 2 { "epsilon < .03" } else { "" };
        say(&format!(
            "  {p}   {:>11}   {:>7.4}   {:>4.0} %   {:>6}   {:>6}   {:<18} {note}",
            percent(held),
            1.0 - held,
            100.0 * (1.0 - held).max(0.0).sqrt(),
            percent(errors[0]),
            percent(errors[1]),
            certified(bake.certificate())
        ));
    }
    let columns = std::iter::once("integral".into()).chain((0..=P).map(|p| format!("P = {p}"))).collect();
    let sheet = Sheet {
        title: format!("{spec}, F = {F}, S = {S}"),
        subtitle: format!("two views under {name}; energy held, relative RMS error"),
        columns,
        rows,
        text_size: 12.5,
    };
    save(o, "figure-5.6.png", &sheet.draw())
}

fn view_row([theta, phi]: [f64; 2]) -> Row {
    Row { label: vec![format!("{theta}°, {phi}°"), "view about r".into()], cells: Vec::new() }
}

/// A reflectance of section 5.7.1: spec, centre, P, and the technique's number of the centre.
const OTHERS: [(&str, Centre, usize, f64); 2] =
    [("lafortune:@skin", Centre::Reflection, 4, 1.0), ("kajiya-kay:s=32", Centre::Tangent, 8, 3.0)];

fn others(o: &Options, name: &str, lights: &Lights, reference: &Reference) -> Result<()> {
    let side = o.side.unwrap_or(S as usize);
    let ball = Ball::seen(side);
    let mut rows = Vec::new();
    say("");
    say("Section 5.7.1, F = 30     P   energy held   epsilon   error on a ball   all views        paper");
    for (spec, centre, p, word) in OTHERS {
        let brdf = parse(spec)?;
        let lpq = Lpq::project(&*brdf, centre, F, p, &Task::quiet())?;
        let mut params = paper(p);
        params[4].1 = word;
        let mut bake = bake("shrm", &brdf, lights, &params)?;
        let truth = ball.truth(reference, &*brdf)?;
        let show = Show::of(&truth);
        let film = ball.shaded(&mut *bake);
        let (held, error) = (lpq.share(F, p), show.errors(&film).relative_rms);
        say(&format!(
            "{spec:<25} {p}   {:>11}   {:>7.4}   {:>15}   {:<18} epsilon < .03",
            percent(held),
            1.0 - held,
            percent(error),
            certified(bake.certificate())
        ));
        rows.push(Row {
            label: vec![spec.into(), format!("P = {p}")],
            cells: vec![
                show.cell(&truth, vec!["integral".into()]),
                show.cell(
                    &film,
                    vec![format!("{} held", percent(held)), format!("error {}", percent(error))],
                ),
                show.difference(&film, 1.0),
            ],
        });
    }
    let sheet = Sheet {
        title: "Lafortune skin and Kajiya-Kay".into(),
        subtitle: format!("F = {F}, S = {S}, under {name}"),
        columns: vec!["integral".into(), "SHRM".into(), "difference".into()],
        rows,
        text_size: 12.5,
    };
    save(o, "figure-5.6-others.png", &sheet.draw())
}
