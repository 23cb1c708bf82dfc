//! Pages that show how good fits are.

use super::Fitted;
use crate::compare::{Answer, Effort, Plan as Comparison};
use crate::{Adjust, Error, Material, Method, Page, Renderer, Scene, Session};
use glam::{DMat3, DVec3};
use std::path::Path;
use steradian_base::{ParamValues, brief};
use steradian_brdf::fit::gaussian::{GaussianFit, GaussianLobe, Objective, Plan, Shape, SliceReport};
use steradian_brdf::{Brdf, SharedBrdf};
use steradian_formats::{write_atomic, write_dir_atomic};
use steradian_light::Lights;
use steradian_render::plot::{Anchor, Drawing, Mark};
use steradian_render::{Cell, Display, Row, Settings, Sheet};

/// Pixels a side of a strip's cell, and of a sphere.
const CELL: usize = 60;
const BALL: usize = 200;
/// Columns of strips at most.
const COLUMNS: usize = 15;
/// The reference's effort on spheres. Of MERL-size tables of gold paint, alum-bronze, black fabric, red
/// phenolic and chrome under the studio and the sky it is 0.01 % or less from a tolerance of 1e-3 without a
/// limit.
const TRUTH: Effort = Effort { tolerance: 1e-2, evaluations: 10_000 };
/// Least angle about the mirror direction that a strip shows, degrees.
const LEAST: f64 = 6.0;
/// Colour of directions below the horizon.
const BELOW: [u8; 3] = [38, 44, 66];

impl Session {
    /// Writes a self-contained page for each fit, `NAME.html` in `folder`: pictures of each view's lobes next
    /// to the reflectance, errors and parameters by view, and spheres under each of `environments` next to
    /// the reference. For several fits `index.html` has a line each (`overview.html` where a material is
    /// called index).
    ///
    /// # Errors
    /// A light or a reflectance that cannot be read, or a folder that cannot be written.
    pub fn fit_pages(
        &mut self,
        done: &[Fitted],
        plan: Plan,
        environments: &[String],
        folder: &Path,
    ) -> Result<(), Error> {
        let mut lights = Vec::new();
        for spec in environments {
            lights.push((brief(spec).into_owned(), self.light(spec, &Adjust::default())?));
        }
        let (mut pages, mut all) = (Vec::new(), Vec::new());
        for f in done {
            self.check()?;
            let brdf = self.brdf(&f.spec)?;
            let (page, balls) = self.fit_page(f, &brdf, plan, &lights)?;
            pages.push((file_of(f), page));
            all.push((f, balls));
        }
        if let [_, _, ..] = done {
            let name = if done.iter().any(|f| f.name == "index") { "overview.html" } else { "index.html" };
            pages.push((name.into(), index(&all)?));
        }
        write_dir_atomic(folder, |at| {
            pages
                .iter()
                .try_for_each(|(name, page)| write_atomic(&at.join(name), |w| w.write_all(page.as_bytes())))
        })?;
        Ok(())
    }

    fn fit_page(
        &self,
        f: &Fitted,
        brdf: &SharedBrdf,
        plan: Plan,
        lights: &[(String, Lights)],
    ) -> Result<(String, Vec<Ball>), Error> {
        let fit = &f.fit;
        let shape = match (fit.is_isotropic(), plan.shape) {
            (false, _) => "turned",
            (_, Shape::Stretched) => "stretched",
            (_, Shape::Round) => "round",
        };
        let kept = match plan.objective {
            Objective::Energy => "least squares with each view's albedo kept",
            Objective::Published => "plain least squares",
        };
        let about = format!(
            "{}: {} {shape} Gaussian lobes at each of {} elevations{} of the view, {kept}. {} bytes; fitted in {:.2} s.",
            brdf.spec(),
            fit.lobes(),
            fit.elevations(),
            if fit.is_isotropic() { String::new() } else { format!(" and {} azimuths", fit.azimuths) },
            fit.bytes(),
            f.seconds
        );
        let mut page = Page::new(&f.name, &about);
        page.heading("The reflectance and its fit, by view");
        let (picture, degrees) = strips(&**brdf, fit);
        page.figure(
            &picture,
            &format!(
                "f cos, the cube root over the view's peak, {degrees:.0} degrees about the mirror direction; up is towards the normal, blue \
                 is below the horizon"
            ),
        )?;
        page.heading("Error by view");
        page.drawing(&curves(&fit.report));
        page.heading("Spheres under light, beside the reference");
        let mut balls = Vec::new();
        for (name, light) in lights {
            balls.extend(self.balls(brdf, plan, name, light, &mut page)?);
        }
        let head = [
            "light",
            "relative RMS error",
            "the reference's own",
            "FLIP",
            "baked in s",
            "shaded in s",
            "bytes with the light",
        ]
        .map(String::from);
        page.table(&head, balls.iter().map(|b| b.row.clone()));
        page.heading("Parameters");
        let text = |v: f64| format!("{v:.3}");
        let diffuse = fit.diffuse.map(text).join(" ");
        let mut head: Vec<String> =
            ["view", "lobe", "mean", "width", "length", "weight r g b", "error", "below horizon"]
                .map(String::from)
                .into();
        if !fit.is_isotropic() {
            head.splice(3..3, ["aside".into()]);
            head.splice(6..6, ["turn".into()]);
        }
        page.table(&head, parameters(fit));
        page.paragraph(&format!(
            "Diffuse albedo {diffuse}. Angles in degrees; a mean is the angle from the mirror direction away from the normal, width is across \
             and length along the plane of incidence (where reflectance is anisotropic, aside is the mean's angle out of that plane, and turn \
             that from the plane to the length); a weight is what the lobe reflects of constant light. The error of a \
             view is that of its specular part, squared; beside it, how much of the lobes lies below the horizon."
        ));
        Ok((page.finish(), balls))
    }

    /// A sphere by the reference and by the fit under a light, with the difference; the numbers as a row.
    fn balls(
        &self,
        brdf: &SharedBrdf,
        plan: Plan,
        name: &str,
        light: &Lights,
        page: &mut Page,
    ) -> Result<Option<Ball>, Error> {
        let mut params: ParamValues =
            [("lobes", plan.lobes), ("views", plan.views), ("azimuths", plan.azimuths)]
                .map(|(name, value)| (name, value as f64))
                .into_iter()
                .collect();
        let objective = if plan.objective == Objective::Published { "published" } else { "energy" };
        params.0.insert("objective".into(), objective.into());
        let shape = if plan.shape == Shape::Stretched { "stretched" } else { "round" };
        params.0.insert("shape".into(), shape.into());
        let material = Material { params, ..Material::new(brdf.clone()) };
        let mut scene = Scene::new(steradian_scene::shapes::sphere(96), vec![material], light.clone());
        scene.settings = Settings::new(BALL, BALL);
        let camera = scene.camera_or_framed()?;
        let case = self.subject(&scene, camera)?;
        let (truth, own) = self.true_picture_by(&case, TRUTH)?;
        page.figure(truth.picture(), &format!("{name}: the reference"))?;
        let plan =
            Comparison { reference_tolerance: TRUTH.tolerance, paths: false, ev: 0.0, certificates: false };
        let mut answers = Vec::new();
        let method = Method::find("gaussian_lobes")?;
        self.answers(&case, &method, &[Renderer::Cpu], &plan, &truth, &mut answers)?;
        let mut ball = None;
        for r in answers.iter().filter_map(Answer::rendering) {
            let Some((e, flip)) = &r.errors else { continue };
            page.figure(&r.picture, &format!("{name}: the fit"))?;
            if let Some(difference) = &r.difference {
                page.figure(difference, "difference (FLIP)")?;
            }
            let row = vec![
                name.to_owned(),
                format!("{:.2} %", 100.0 * e.relative_rms),
                format!("{:.3} %", 100.0 * own),
                format!("{flip:.4}"),
                format!("{:.2}", r.bake_seconds),
                format!("{:.3}", r.shade_seconds),
                r.bytes.to_string(),
            ];
            ball = Some(Ball { row, picture: r.picture.clone() });
        }
        page.line_break();
        Ok(ball)
    }
}

/// A sphere of a fit under a light.
struct Ball {
    /// The light's name, the relative RMS error, and further facts of the row.
    row: Vec<String>,
    picture: Display,
}

fn file_of(f: &Fitted) -> String {
    format!("{}.html", f.name)
}

/// The page of all fits.
fn index(all: &[(&Fitted, Vec<Ball>)]) -> Result<String, Error> {
    let mut page = Page::new(
        "Fits by Gaussian lobes",
        "Errors: squared, relative to the squared specular part of the view; under a light, the relative RMS error of a sphere beside \
         the reference.",
    );
    let mut head: Vec<String> =
        ["material", "bytes", "seconds", "mean to 60°", "worst view", "unconverged"].map(String::from).into();
    head.extend(all.iter().take(1).flat_map(|a| &a.1).map(|b| format!("under {}", b.row[0])));
    let row = |(f, balls): &(&Fitted, Vec<Ball>)| {
        let s = f.summary();
        let mut cells = vec![
            f.name.clone(),
            f.fit.bytes().to_string(),
            format!("{:.2}", f.seconds),
            format!("{:.2} %", 100.0 * s.mean),
            format!("{:.2} % at {:.0}°", 100.0 * s.worst, s.degrees),
            s.unconverged.to_string(),
        ];
        cells.extend(balls.iter().map(|b| b.row[1].clone()));
        (file_of(f), cells)
    };
    page.links(&head, all.iter().map(row));
    page.heading("Spheres by the fits");
    for (f, balls) in all {
        for b in balls.iter().take(1) {
            page.figure(&b.picture, &format!("{}, {}", f.name, b.row[0]))?;
        }
    }
    Ok(page.finish())
}

/// Data, fit and difference of up to [`COLUMNS`] views as rows of pictures; and the degrees about the mirror
/// direction that they show.
fn strips(brdf: &dyn Brdf, fit: &GaussianFit) -> (Display, f64) {
    let views = fit.elevations();
    let columns = views.min(COLUMNS);
    let view = |k: usize| if columns > 1 { k * (views - 1) / (columns - 1) } else { 0 };
    let extent = extent(fit);
    let mut rows: Vec<Row> = Vec::new();
    // Anisotropic reflectance by a quarter of its azimuths.
    let quarter = fit.azimuths.div_ceil(4);
    let azimuths = if fit.is_isotropic() { vec![0] } else { vec![0, quarter / 2, quarter - 1] };
    for j in azimuths {
        let mut cells: [Vec<Option<Cell>>; 3] = Default::default();
        for k in 0..columns {
            let pictures = self::cells(brdf, fit, [fit.theta(view(k)), fit.phi(j)], extent);
            for (row, picture) in cells.iter_mut().zip(pictures) {
                row.push(Some(Cell { picture, caption: Vec::new() }));
            }
        }
        let azimuth = |label: &str| match fit.is_isotropic() {
            true => vec![label.into()],
            false => vec![label.into(), format!("azimuth {:.0}°", fit.phi(j).to_degrees())],
        };
        let labels = ["data", "fit", "difference"];
        rows.extend(labels.iter().zip(cells).map(|(l, cells)| Row { label: azimuth(l), cells }));
    }
    let sheet = Sheet {
        columns: (0..columns).map(|k| format!("{:.0}°", fit.theta(view(k)).to_degrees())).collect(),
        rows,
        text_size: 12.0,
        ..Sheet::default()
    };
    (sheet.draw(), extent.to_degrees())
}

/// Extent of the pictures about the mirror direction: 2.5 times the length of the longest lobe that has a
/// tenth of a view's weight, away from grazing views.
fn extent(fit: &GaussianFit) -> f64 {
    let mut longest = 0.0f64;
    let near = |(k, _): &(usize, &Vec<GaussianLobe>)| *k == 0 || fit.theta(k / fit.azimuths) < 1.35;
    for (_, lobes) in fit.views.iter().enumerate().filter(near) {
        let weight = |l: &GaussianLobe| l.weight.iter().sum::<f64>();
        let all: f64 = lobes.iter().map(weight).sum();
        for l in lobes.iter().filter(|l| weight(l) > 0.1 * all) {
            longest = longest.max(l.along() + 0.4 * l.angle.hypot(l.aside));
        }
    }
    (2.5 * longest).clamp(LEAST.to_radians(), std::f64::consts::FRAC_PI_2)
}

/// f·cos about the mirror direction of a view: the reflectance's, the fit's, and their difference.
fn cells(brdf: &dyn Brdf, fit: &GaussianFit, [theta, phi]: [f64; 2], extent: f64) -> [Display; 3] {
    let ((s, c), turn) = (theta.sin_cos(), DMat3::from_rotation_z(phi));
    let [wo, r, away, aside] =
        [DVec3::new(s, 0.0, c), DVec3::new(-s, 0.0, c), DVec3::new(-c, 0.0, -s), DVec3::Y].map(|d| turn * d);
    let mut values: [Vec<[f64; 3]>; 3] = Default::default();
    let mut below = Vec::new();
    for k in 0..CELL * CELL {
        let at = |k: usize| extent * ((2 * k + 1) as f64 / CELL as f64 - 1.0);
        let (x, y) = (at(k % CELL), at(k / CELL));
        let angle = x.hypot(y);
        let (sine, cosine) = angle.sin_cos();
        let d = r * cosine + (aside * x + away * y) * (sine / angle.max(1e-9));
        let data = if d.z > 0.0 { brdf.f_cos(d, wo) } else { [0.0; 3] };
        let fitted = fit.f_cos(d, wo);
        values[0].push(data);
        values[1].push(fitted);
        values[2].push(std::array::from_fn(|c| (fitted[c] - data[c]).abs()));
        below.push(d.z <= 0.0);
    }
    let peak = values[0].iter().flatten().copied().fold(f64::MIN_POSITIVE, f64::max);
    values.map(|all| {
        let mut out = Display::filled(CELL, CELL, [0; 3]);
        for (k, v) in all.iter().enumerate() {
            for c in 0..3 {
                let shown = 255.0 * (v[c] / peak).clamp(0.0, 1.0).cbrt();
                out.rgb[3 * k + c] = (shown as u8).max(if below[k] { BELOW[c] } else { 0 });
            }
        }
        out
    })
}

const PANEL: (f64, f64) = (520.0, 240.0);
const CORNER: (f64, f64) = (64.0, 18.0);
const INK: [u8; 3] = [60, 62, 66];
const FAINT: [u8; 3] = [222, 224, 228];
/// Legends and colours of the chart's lines.
const LINES: [(&str, [u8; 3]); 3] = [
    ("of the whole, squared", [190, 215, 195]),
    ("of the specular part, squared", [68, 119, 170]),
    ("of the specular part, plain", [238, 102, 119]),
];
/// Lower end of the axis, per cent, and its number of decades.
const BOTTOM: f64 = 0.01;
const DECADES: f64 = 4.0;

/// Errors by view, per cent on a logarithmic scale.
fn curves(report: &[SliceReport]) -> Drawing {
    let mut page = Drawing::new((CORNER.0 + PANEL.0 + 80.0) as usize, (CORNER.1 + PANEL.1 + 78.0) as usize);
    let x = |degrees: f64| CORNER.0 + PANEL.0 * degrees / 90.0;
    let y = |percent: f64| {
        let place = (percent.max(BOTTOM) / BOTTOM).log10() / DECADES;
        CORNER.1 + PANEL.1 * (1.0 - place.clamp(0.0, 1.0))
    };
    let text = |at, text: String, anchor| Mark::Text { at, text, size: 12.0, colour: INK, anchor };
    let mut marks = Vec::new();
    for k in 0..=DECADES as i32 {
        let percent = BOTTOM * 10f64.powi(k);
        let points = vec![(x(0.0), y(percent)), (x(90.0), y(percent))];
        marks.push(Mark::Line { points, colour: FAINT, width: 1.0 });
        marks.push(text((CORNER.0 - 8.0, y(percent) - 4.0), format!("{percent} %"), Anchor::End));
    }
    for k in 0..=6 {
        let degrees = 15.0 * f64::from(k);
        let points = vec![(x(degrees), CORNER.1), (x(degrees), CORNER.1 + PANEL.1)];
        marks.push(Mark::Line { points, colour: FAINT, width: 1.0 });
        marks.push(text((x(degrees), CORNER.1 + PANEL.1 + 9.0), format!("{degrees}°"), Anchor::Middle));
    }
    for (k, (name, colour)) in LINES.into_iter().enumerate() {
        let value = |r: &SliceReport| 100.0 * [r.of_whole, r.energy, r.norm()][k];
        // With several azimuths the mean over them.
        let mean = |rows: &[SliceReport]| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
        let elevations = report.chunk_by(|a, b| a.theta == b.theta);
        let points: Vec<(f64, f64)> =
            elevations.map(|rows| (x(rows[0].theta.to_degrees()), y(mean(rows)))).collect();
        marks.extend(points.iter().map(|at| Mark::Dot { at: *at, colour, radius: 2.5 }));
        // The first may lie below the second.
        marks.push(Mark::Line { points, colour, width: if k == 0 { 6.0 } else { 2.0 } });
        let at = (CORNER.0 + [0.0, 160.0, 370.0][k], CORNER.1 + PANEL.1 + 46.0);
        marks.push(Mark::Line { points: vec![at, (at.0 + 18.0, at.1)], colour, width: 2.5 });
        marks.push(text((at.0 + 24.0, at.1 - 5.0), name.into(), Anchor::Start));
    }
    page.marks = marks;
    page
}

/// A row for each lobe.
fn parameters(fit: &GaussianFit) -> impl Iterator<Item = Vec<String>> {
    fit.views.iter().enumerate().flat_map(move |(k, lobes)| {
        lobes.iter().enumerate().map(move |(i, l)| {
            let degrees = |a: f64| format!("{:.2}", a.to_degrees());
            let theta = fit.theta(k / fit.azimuths).to_degrees();
            let view = match (i, fit.is_isotropic()) {
                (0, true) => format!("{theta:.1}°"),
                (0, false) => format!("{theta:.1}°, {:.1}°", fit.phi(k % fit.azimuths).to_degrees()),
                _ => String::new(),
            };
            let report = fit.report.get(k).filter(|_| i == 0);
            let error = report.map_or_else(String::new, |r| {
                let converged = if r.converged { "" } else { ", not converged" };
                format!("{:.2} %{converged}", 100.0 * r.energy)
            });
            let below = report.map_or_else(String::new, |r| format!("{:.1} %", 100.0 * r.leak));
            let weight = l.weight.map(|w| format!("{w:.4}")).join(" ");
            let mut row = vec![
                view,
                (i + 1).to_string(),
                degrees(l.angle),
                degrees(l.sigma),
                degrees(l.along()),
                weight,
                error,
                below,
            ];
            if !fit.is_isotropic() {
                row.splice(3..3, [degrees(l.aside)]);
                row.splice(6..6, [degrees(l.turn)]);
            }
            row
        })
    })
}
