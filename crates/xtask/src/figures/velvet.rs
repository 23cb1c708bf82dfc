//! Figure 5.8: a velvet-like reflectance, by SHRM at P = 5, by slices, and by Kautz & McCool's (2000)
//! two-dimensional lobe.
//!
//! CUReT's velvet is not at hand; the stand-in is the model at hand of which azimuthal terms (q ≠ 0) hold the
//! most energy among the fabrics, as the table of figure 5.7 shows. `--brdf` takes another.

use super::picture::{Ball, Show, baked, certified, reference};
use super::{Options, light, percent, save, say};
use anyhow::Result;
use steradian_brdf::parse;
use steradian_render::{Row, Sheet};

/// The fabric of the strongest azimuthal dependence.
const VELVET: &str = "lafortune:@felt";
/// Belts of the angle between normal and view, degrees.
const BELTS: [[f64; 2]; 3] = [[0.0, 60.0], [60.0, 80.0], [80.0, 90.0]];

/// Columns: title, technique, parameters.
type Variant = (&'static str, &'static str, &'static [(&'static str, f64)]);

/// The error asked of slices.
const SLICES: f64 = 0.03;

const VARIANTS: [Variant; 5] = [
    ("SHRM, P = 5", "shrm", &[("p", 5.0), ("order", 30.0), ("size", 128.0), ("plain", 1.0), ("centre", 1.0)]),
    ("the same, fitted", "shrm", &[("p", 5.0), ("order", 30.0), ("size", 128.0)]),
    ("slices, 3 % asked", "shrm_slices", &[]),
    ("Kautz-McCool, lobe about r", "lobe_maps", &[("lobes", 1.0), ("axis", 0.0), ("dimensions", 3.0)]),
    ("the same, lobe off r", "lobe_maps", &[("lobes", 1.0), ("axis", 1.0), ("dimensions", 3.0)]),
];

pub fn run(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/probulator_ennis.hdr")?;
    let spec = o.brdfs.first().map_or(VELVET, String::as_str);
    let brdf = parse(spec)?;
    let ball = Ball::seen(o.side.unwrap_or(160));
    let truth = ball.truth(&reference(&lights)?, &*brdf)?;
    let show = Show::of(&truth);
    say(&format!("Figure 5.8: {spec} under {name}, relative RMS error on a ball"));
    say(&format!(
        "{:<28} {:>8} {:>8} {:>8} {:>8} {:>9}   {}",
        "", "all", "to 60°", "60-80°", "80-90°", "bytes", "certificate"
    ));
    let (mut pictures, mut differences) = (vec![show.cell(&truth, vec!["integral".into()])], vec![None]);
    for (title, slug, params) in VARIANTS {
        let tolerance = (slug == "shrm_slices").then_some(SLICES);
        let mut bake = baked(slug, &brdf, &lights, params, tolerance)?;
        let film = ball.shaded(&mut *bake);
        let error = show.errors(&film).relative_rms;
        let belts: String =
            BELTS.iter().map(|b| format!(" {:>8}", percent(show.between(&film, &ball, *b)))).collect();
        let certificate = certified(bake.certificate());
        say(&format!("{title:<28} {:>8}{belts} {:>9}   {certificate}", percent(error), bake.bytes()));
        pictures.push(show.cell(&film, vec![format!("error {}", percent(error))]));
        differences.push(show.difference(&film, 1.0));
    }
    let columns = std::iter::once("integral".into()).chain(VARIANTS.map(|w| w.0.to_string())).collect();
    let sheet = Sheet {
        title: format!("{spec}: azimuthal dependence"),
        subtitle: format!(
            "under {name}; paper: CUReT velvet, the SHRM with P = 5 is accurate, the lobe is not"
        ),
        columns,
        rows: vec![Row { label: Vec::new(), cells: pictures }, Row { label: Vec::new(), cells: differences }],
        text_size: 12.5,
    };
    save(o, "figure-5.8.png", &sheet.draw())
}
