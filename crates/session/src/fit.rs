//! Reflectances as Gaussian lobes, one or many.

mod report;
mod words;

pub use words::table;

use crate::{Error, Session};
use std::path::{Path, PathBuf};
use std::time::Instant;
use steradian_brdf::fit::gaussian::{GaussianFit, Plan};
use steradian_brdf::measured::expand;
use steradian_brdf::model::lobes::to_tensors;
use steradian_brdf::{Files, SharedBrdf};
use steradian_formats::write_tensors;
use steradian_parallel::prelude::*;

/// Extensions of files of measurements, and the specs that read them.
const MEASURED: [(&str, &str); 4] =
    [("binary", "merl"), ("bsdf", "rgl"), ("brdf", "cornell"), ("astm", "astm")];
/// Number of reflectances in memory at a time: a table of MERL's has 17 MiB.
const AT_ONCE: usize = 8;

/// One reflectance, fitted.
pub struct Fitted {
    /// Spec of the reflectance.
    pub spec: String,
    /// Its name: that of the file or of the material.
    pub name: String,
    /// File that holds the lobes.
    pub output: PathBuf,
    /// The lobes, with their errors.
    pub fit: GaussianFit,
    /// Seconds of one processor.
    pub seconds: f64,
    /// With a tolerance, the error that the tolerance bounds ([`GaussianFit::worst`]).
    pub reached: Option<f64>,
}

/// Views up to here are "normal views", degrees.
const NORMAL: f64 = 60.5;

/// Errors of a fit: squared, relative to the squared specular part of the view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Mean over the views up to 60°.
    pub mean: f64,
    /// Error of the worst view.
    pub worst: f64,
    /// Angle of the view, degrees.
    pub degrees: f64,
    /// Views whose fit did not converge.
    pub unconverged: usize,
}

impl Fitted {
    /// The fit's errors in short.
    pub fn summary(&self) -> Summary {
        let all = &self.fit.report;
        let normal: Vec<f64> =
            all.iter().filter(|r| r.theta.to_degrees() < NORMAL).map(|r| r.energy).collect();
        let worst = all.iter().max_by(|a, b| a.energy.total_cmp(&b.energy));
        let (worst, degrees) = worst.map_or((0.0, 0.0), |w| (w.energy, w.theta.to_degrees()));
        let mean = normal.iter().sum::<f64>() / normal.len().max(1) as f64;
        Summary { mean, worst, degrees, unconverged: all.iter().filter(|r| !r.converged).count() }
    }
}

/// The specs that an input expands to, sorted where they come from a folder: the files of measurements in a
/// folder, those of a pattern with `*` in the file's name, a file, every material of a table (`npf:FILE,*`,
/// `sgd:*`), or a spec.
pub fn expand_brdfs(input: &str) -> Result<Vec<String>, Error> {
    let path = Path::new(input);
    let pattern = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let files = if path.is_dir() {
        crate::inputs::files_of(path, |name| spec_of(Path::new(name)).is_some())?
    } else if spec_of(path).is_some() && pattern.contains('*') && !input.contains(':') {
        let above = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        crate::inputs::files_of(above, |name| crate::inputs::matches(&pattern, name))?
    } else if spec_of(path).is_some() && !input.contains(':') {
        vec![path.to_owned()]
    } else {
        return Ok(expand(input, Files::Any)?);
    };
    if files.is_empty() {
        return Err(Error::input(format!("{input}: holds no .binary, .bsdf, .brdf or .astm files")));
    }
    let spec = |file: &PathBuf| {
        let why = || Error::input(format!("{}: is none of .binary, .bsdf, .brdf, .astm", file.display()));
        spec_of(file).map(|model| format!("{model}:{}", file.display())).ok_or_else(why)
    };
    files.iter().map(spec).collect()
}

/// Name of the spec that reads a file with this extension.
fn spec_of(path: &Path) -> Option<&'static str> {
    let extension = path.extension()?.to_string_lossy().to_lowercase();
    MEASURED.iter().find(|m| m.0 == extension).map(|m| m.1)
}

/// The spec of a file of measurements whose extension tells the model.
pub(crate) fn measurements(path: &Path) -> Option<String> {
    spec_of(path).map(|model| format!("{model}:{}", path.display()))
}

/// Name of the material of a spec: that of its file, or of the material within a file.
pub fn brdf_name(spec: &str) -> String {
    let last = spec.rsplit([',', ':', '/', '\\']).next().unwrap_or(spec).trim_start_matches('@');
    let stem = MEASURED.iter().find_map(|m| last.strip_suffix(&format!(".{}", m.0))).unwrap_or(last);
    stem.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect()
}

impl Session {
    /// Fits every spec and writes its lobes to the corresponding output; with a tolerance, with as few lobes
    /// and views as it needs ([`GaussianFit::within`]), or where none suffice the nearest fit, whose
    /// [`Fitted::reached`] gives its error.
    pub fn fit(
        &mut self,
        jobs: Vec<(String, PathBuf)>,
        plan: Plan,
        tolerance: Option<f64>,
    ) -> Result<Vec<Fitted>, Error> {
        let mut done = Vec::with_capacity(jobs.len());
        let quiet = self.task.clone().without_progress();
        self.task.begin("fitting", jobs.len() as u64);
        for some in jobs.chunks(AT_ONCE) {
            let mut loaded: Vec<SharedBrdf> = Vec::new();
            for (spec, _) in some {
                loaded.push(self.brdf(spec)?);
            }
            self.check()?;
            let task = &self.task;
            let fits: Vec<_> = (0..loaded.len())
                .into_par_iter()
                .with_max_len(1)
                .map(|i| {
                    let start = Instant::now();
                    let fit = match tolerance {
                        Some(t) => {
                            GaussianFit::within(&*loaded[i], plan, t, &quiet).map(|(f, e)| (f, Some(e)))
                        }
                        None => GaussianFit::new(&*loaded[i], plan, &quiet).map(|f| (f, None)),
                    };
                    task.advance(1);
                    (fit, start.elapsed().as_secs_f64())
                })
                .collect();
            for ((spec, output), (fit, seconds)) in some.iter().zip(fits) {
                let (fit, reached) = fit?;
                self.begin_output();
                let worst = fit.report.iter().map(|r| r.energy).fold(0.0, f64::max);
                self.note_error(format!("worst view {worst:.2e} of the specular part's energy"));
                let metadata = self.provenance_pairs().into_iter().collect();
                self.spares(output)?;
                write_tensors(output, &to_tensors(&fit, metadata))?;
                let (spec, output) = (spec.clone(), output.clone());
                done.push(Fitted { name: brdf_name(&spec), spec, output, fit, seconds, reached });
            }
        }
        self.task.end();
        Ok(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_specs() {
        for (spec, name) in [
            ("merl:a/gold.binary", "gold"),
            ("npf:a/npf.bin,@chrome", "chrome"),
            ("ggx:alpha=0.1", "alpha-0.1"),
            ("rgl:x.bsdf", "x"),
            ("lambert", "lambert"),
        ] {
            assert_eq!(brdf_name(spec), name);
        }
        assert_eq!(expand_brdfs("sgd:*").expect("known").len(), 100);
        assert_eq!(expand_brdfs("ggx:alpha=0.1").expect("a spec"), ["ggx:alpha=0.1"]);
        assert_eq!(expand_brdfs("gold.binary").expect("a file"), ["merl:gold.binary"]);
    }
}
