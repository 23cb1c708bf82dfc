//! Reports of fits: as JSON, and as a table.

use super::{Fitted, Summary};
use serde_json::{Value, json};
use steradian_brdf::fit::gaussian::{MAX_LOBES, MAX_VIEWS, SliceReport};

impl Fitted {
    /// Report as JSON; `tolerance` is that of the request.
    pub fn document(&self, tolerance: Option<f64>) -> Value {
        let view = |r: &SliceReport| {
            json!({
                "degrees": r.theta.to_degrees(), "azimuth": r.phi.to_degrees(), "energy": r.energy, "norm": r.norm(), "of_whole": r.of_whole,
                "log": r.log, "cube_root": r.cube_root,
                "albedo": r.albedo, "below_horizon": r.leak, "converged": r.converged,
            })
        };
        json!({
            "name": self.name,
            "output": self.output.file_name().map(|n| n.to_string_lossy()),
            "bytes": self.fit.bytes(),
            "lobes": self.fit.lobes(),
            "tolerance": tolerance,
            "error": self.reached,
            "tolerance_met": self.reached.zip(tolerance).map(|(e, t)| e <= t),
            "seconds": self.seconds,
            "diffuse": self.fit.diffuse,
            "views": self.fit.report.iter().map(view).collect::<Vec<_>>(),
        })
    }

    /// States by how much the fit misses a tolerance; `None` where it meets it.
    pub fn missed(&self, asked: f64) -> Option<String> {
        let e = self.reached.filter(|e| *e > asked)?;
        let most =
            format!("no fit of {MAX_LOBES} lobes and {MAX_VIEWS} views is nearer; the nearest is written");
        Some(format!("{}: the error is {e:.2e}, asked {asked:.2e}: {most}", self.name))
    }
}

/// A line for each fit, below a heading.
pub fn table(done: &[Fitted]) -> String {
    let width = done.iter().map(|f| f.name.len()).max().unwrap_or(0).max(8);
    let mut out = format!(
        "{:width$}  {:>7}  {:>6}  {:>7}  {:>12}  {:>16}  {:>7}  {:>9}  {:>11}\n",
        "material",
        "lobes",
        "bytes",
        "seconds",
        "mean to 60°",
        "worst view",
        "log",
        "cube root",
        "unconverged"
    );
    for f in done {
        let Summary { mean, worst, degrees, unconverged } = f.summary();
        let worst = format!("{:.2} % at {degrees:.0}°", 100.0 * worst);
        out += &format!(
            "{:width$}  {:>7}  {:>6}  {:>7.3}  {:>10.3} %  {worst:>16}  {:>5.2} %  {:>7.2} %  {unconverged:>11}\n",
            f.name,
            lobes(f),
            f.fit.bytes(),
            f.seconds,
            100.0 * mean,
            100.0 * over_views(f, |r| r.log),
            100.0 * over_views(f, |r| r.cube_root),
        );
    }
    out + "lobes: views (by elevation, and azimuth where reflectance is anisotropic) x lobes of each. Errors of the specular part: squared, relative to its square at the view; log and cube root: norms \
           for ln(1 + f cos) and the cube root of f cos, relative, in the mean over views\n"
}

/// Elevations, azimuths where reflectance is anisotropic, lobes.
fn lobes(f: &Fitted) -> String {
    let (n, m, k) = (f.fit.elevations(), f.fit.azimuths, f.fit.lobes());
    if f.fit.is_isotropic() { format!("{n} x {k}") } else { format!("{n} x {m} x {k}") }
}

/// The mean of a figure over the views.
fn over_views(f: &Fitted, of: impl Fn(&SliceReport) -> f64) -> f64 {
    f.fit.report.iter().map(of).sum::<f64>() / f.fit.report.len().max(1) as f64
}
