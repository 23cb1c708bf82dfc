//! Figure 5.9: highlights near grazing (above) and Kajiya–Kay (below), by SHRM and by Cabral, Olano & Nemec's
//! (1999) twelve prefiltered views.
//!
//! For Kajiya–Kay twelve maps over the tangent are blended as the paper does it: the exact radiance of the
//! three views of the icosahedron around each view, weighted by the barycentric coordinates on the sphere. A
//! warp along the mirror direction, which the technique `reflection_space_ibr` adds, has no meaning there.

use super::picture::{Ball, Show, bake, certified, reference};
use super::{Options, light, percent, save, say};
use anyhow::Result;
use glam::{DMat3, DVec3};
use steradian_brdf::{SharedBrdf, parse};
use steradian_light::Lights;
use steradian_prefilter::shrm::explicit::icosahedron;
use steradian_reference::Reference;
use steradian_render::{Film, Row, Sheet};

/// Dielectric of moderate width: next to all of its energy is near grazing.
const GRAZING: &str = "ggx:alpha=0.2,f0=0.02";
const STRANDS: &str = "kajiya-kay:s=32";

pub fn run(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/probulator_uffizi.hdr")?;
    let reference = reference(&lights)?;
    let spec = o.brdfs.first().map_or(GRAZING, String::as_str);
    say(&format!("Figure 5.9: under {name}, relative RMS error on a ball"));
    let mut rows = Vec::new();
    let above = parse(spec)?;
    let cabral = Variant { title: "Cabral", slug: "reflection_space_ibr", params: &[] };
    rows.extend(pair(o, spec, &above, &lights, &reference, 5.0, Some(&cabral))?);
    let below = parse(STRANDS)?;
    rows.extend(pair(o, STRANDS, &below, &lights, &reference, 8.0, None)?);
    let sheet = Sheet {
        title: "Sharp near grazing, and anisotropic".into(),
        subtitle: format!("under {name}; paper: the SHRM is accurate, twelve blended views are not"),
        columns: ["integral", "SHRM", "slices", "twelve views"].map(String::from).to_vec(),
        rows,
        text_size: 12.5,
    };
    save(o, "figure-5.9.png", &sheet.draw())
}

/// A technique and its parameters.
struct Variant {
    title: &'static str,
    slug: &'static str,
    params: &'static [(&'static str, f64)],
}

/// Pictures and differences of one reflectance.
fn pair(
    o: &Options,
    spec: &str,
    brdf: &SharedBrdf,
    lights: &Lights,
    reference: &Reference,
    p: f64,
    cabral: Option<&Variant>,
) -> Result<[Row; 2]> {
    let ball = Ball::seen(o.side.unwrap_or(160));
    let truth = ball.truth(reference, &**brdf)?;
    let show = Show::of(&truth);
    say(&format!("-- {spec}"));
    say(&format!("{:<28} {:>8} {:>8} {:>8} {:>9}   certificate", "", "all", "to 60°", "60-90°", "bytes"));
    let mut films: Vec<(String, Film, Option<usize>, String)> = Vec::new();
    for (title, slug, params) in [
        (format!("SHRM, P = {p}"), "shrm", vec![("p", p), ("order", 30.0), ("size", 128.0)]),
        ("slices, 3 % asked".into(), "shrm_slices", Vec::new()),
    ] {
        let tolerance = (slug == "shrm_slices").then_some(0.03);
        match super::picture::baked(slug, brdf, lights, &params, tolerance) {
            Ok(mut b) => {
                let film = ball.shaded(&mut *b);
                films.push((title, film, Some(b.bytes()), certified(b.certificate())));
            }
            Err(e) => say(&format!("{slug}: {e}")),
        }
    }
    match cabral {
        Some(variant) => {
            let mut b = bake(variant.slug, brdf, lights, variant.params)?;
            let film = ball.shaded(&mut *b);
            films.push((variant.title.into(), film, Some(b.bytes()), certified(b.certificate())));
        }
        None => {
            films.push(("twelve views, blended".into(), blended(&ball, reference, brdf)?, None, "-".into()))
        }
    }
    let label = vec![spec.to_string()];
    let mut rows = [Row { label, cells: Vec::new() }, Row { label: Vec::new(), cells: vec![None] }];
    rows[0].cells.push(show.cell(&truth, Vec::new()));
    for (title, film, bytes, certificate) in &films {
        let error = percent(show.errors(film).relative_rms);
        let (near, far) = (show.between(film, &ball, [0.0, 60.0]), show.between(film, &ball, [60.0, 90.0]));
        let bytes = bytes.map_or_else(|| "-".into(), |b| b.to_string());
        say(&format!(
            "{title:<28} {error:>8} {:>8} {:>8} {bytes:>9}   {certificate}",
            percent(near),
            percent(far)
        ));
        rows[0].cells.push(show.cell(film, vec![title.clone(), format!("error {error}")]));
        rows[1].cells.push(show.difference(film, 1.0));
    }
    Ok(rows)
}

/// Σ w_i B_i over the three of twelve views about each view.
fn blended(ball: &Ball, reference: &Reference, brdf: &SharedBrdf) -> Result<Film> {
    let weights = around(DVec3::Z);
    let mut sum: Option<Film> = None;
    for (view, w) in weights {
        let film = ball.strands_seen(view).truth(reference, &**brdf)?;
        let total = sum.get_or_insert_with(|| {
            let mut black = film.clone();
            black.rgb.iter_mut().for_each(|p| p.fill(0.0));
            black
        });
        for c in 0..3 {
            total.rgb[c].iter_mut().zip(&film.rgb[c]).for_each(|(t, f)| *t += w as f32 * f);
        }
    }
    Ok(sum.unwrap_or_default())
}

/// The corners of the icosahedron's face through which `d` passes, with barycentric weights that sum to 1.
fn around(d: DVec3) -> [(DVec3, f64); 3] {
    let mut corners = icosahedron();
    corners.sort_by(|a, b| b.dot(d).total_cmp(&a.dot(d)));
    let [a, b, c] = [corners[0], corners[1], corners[2]];
    // Neighbouring corners are never in one plane with the centre.
    let w = DMat3::from_cols(a, b, c).inverse() * d;
    let sum = w.element_sum();
    [(a, w.x / sum), (b, w.y / sum), (c, w.z / sum)]
}
