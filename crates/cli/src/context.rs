//! What every command gets: options that all share, the task, and the ways out.

use crate::failure::{Failure, Outcome};
use crate::progress::Bars;
use crate::textures;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use steradian_base::{Input, Provenance, Task};
use steradian_formats::{Limits, Raster, WriteOptions, WriteReport, write_atomic, write_image};
use steradian_techniques::direct::Suns;

/// Options of every command.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Options of every command")]
pub struct Common {
    /// Say nothing but errors on standard error
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Print one JSON document on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// Threads [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Memory that may be allocated, such as 512M or 8G
    #[arg(long, global = true, value_name = "SIZE", default_value = "8G", value_parser = parse_size)]
    pub max_memory: u64,
    /// What to do with finite negative radiance in inputs
    #[arg(long, global = true, value_enum, default_value_t = Negative::Keep)]
    pub negative: Negative,
    /// Where to compute
    #[arg(long, global = true, value_enum, default_value_t = Backend::Auto)]
    pub backend: Backend,
    /// How a GPU shades pictures
    #[arg(long, global = true, value_enum, value_name = "PATH", default_value_t = GpuPath::Auto)]
    pub gpu_path: GpuPath,
}

/// Finite negative texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Negative {
    /// They are data.
    Keep,
    /// They become 0; the energy is reported.
    Zero,
}

/// Where to compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// A GPU where the build has the feature `gpu` and there is one, else the CPU
    Auto,
    /// The CPU
    Cpu,
    /// A GPU: render and compare (needs the feature `gpu`)
    Gpu,
    /// Both, side by side: compare (needs the feature `gpu`)
    Both,
}

/// How a GPU shades pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum GpuPath {
    /// What is faster on the adapter: compute on software adapters and data-centre accelerators, else raster
    Auto,
    /// In the fragment shader, multisampled
    Raster,
    /// In compute shaders, from a visibility buffer
    Compute,
}

fn parse_size(text: &str) -> Result<u64, String> {
    let bad = || format!("'{text}' is not a size such as 512M or 8G");
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let factor = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" | "B" => 1u64,
        "K" | "KB" | "KIB" => 1 << 10,
        "M" | "MB" | "MIB" => 1 << 20,
        "G" | "GB" | "GIB" => 1 << 30,
        "T" | "TB" | "TIB" => 1 << 40,
        _ => return Err(bad()),
    };
    let n: f64 = digits.parse().map_err(|_| bad())?;
    if n.is_finite() && n > 0.0 { Ok((n * factor as f64) as u64) } else { Err(bad()) }
}

/// What every command gets.
pub struct Context {
    /// The shared options.
    pub common: Common,
    /// Progress, cancellation and limits.
    pub task: Task,
    /// What becomes of disks and directional lights under a technique: folded into its data, unless a command's options
    /// say otherwise.
    pub suns: Suns,
    provenance: Provenance,
    notes: Vec<(String, String)>,
}

/// Extensions of image files that are written.
pub const IMAGES: [&str; 5] = ["exr", "hdr", "pic", "pfm", "png"];

/// Refuses an output whose extension is none of `known`: asked before the work, so that it is not done in vain.
pub fn check_output(path: &Path, known: &[&str]) -> Outcome {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    if extension.as_deref().is_some_and(|e| known.contains(&e)) {
        return Ok(());
    }
    let there_are: Vec<String> = known.iter().map(|k| format!(".{k}")).collect();
    let what = match extension {
        Some(e) => format!("cannot write '.{e}' files"),
        None => "the name has no extension to tell the format".into(),
    };
    Err(Failure::usage(format!("{}: {what}; use one of {}", path.display(), there_are.join(" "))))
}

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

impl Context {
    /// Sets threads, progress and Ctrl-C up.
    pub fn new(common: Common, arguments: Vec<String>) -> Result<Self, Failure> {
        if common.backend == Backend::Cpu && common.gpu_path != GpuPath::Auto {
            let why = "--gpu-path says how a GPU shades: leave it out with --backend cpu";
            return Err(Failure::usage(why));
        }
        let gpu_asked =
            matches!(common.backend, Backend::Gpu | Backend::Both) || common.gpu_path != GpuPath::Auto;
        if cfg!(not(feature = "gpu")) && gpu_asked {
            let why = "this build has no GPU back end: build with --features gpu, or use --backend cpu";
            return Err(Failure::failed(why));
        }
        if let Some(n) = common.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n)).build_global();
            pool.map_err(|e| Failure::failed(format!("cannot start {n} threads: {e}")))?;
        }
        let cancel = Arc::new(AtomicBool::new(false));
        let flag = cancel.clone();
        // Where no handler can be installed, Ctrl-C ends the process at once, which leaves no partial file either.
        let _ = ctrlc::set_handler(move || {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(1);
            }
            flag.store(true, Ordering::SeqCst);
        });
        let mut task = Task::quiet().with_cancel(cancel).with_max_memory(common.max_memory);
        if !common.quiet && io::stderr().is_terminal() {
            task = task.with_progress(Arc::new(Bars::new()));
        }
        Ok(Self { common, task, suns: Suns::Fold, provenance: Provenance::new(arguments), notes: Vec::new() })
    }

    /// Limits for readers.
    pub fn limits(&self) -> Limits {
        Limits { max_memory: self.common.max_memory, ..Limits::default() }
    }

    /// One line on standard error, unless `--quiet`.
    pub fn say(&self, line: impl std::fmt::Display) {
        if !self.common.quiet {
            // Nobody is left to be told when standard error is gone.
            let _ = writeln!(io::stderr(), "{line}");
        }
    }

    /// One warning on standard error, unless `--quiet`.
    pub fn warn(&self, line: impl std::fmt::Display) {
        self.say(format_args!("warning: {line}"));
    }

    /// Data on standard output.
    pub fn print(&self, text: &str) -> Outcome {
        let mut out = io::stdout().lock();
        let result = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        result.map_err(|e| match e.kind() {
            io::ErrorKind::BrokenPipe => Failure::broken_pipe(),
            _ => Failure::failed(format!("standard output: cannot write: {e}")),
        })
    }

    /// A JSON document on standard output, with its provenance under `provenance`.
    pub fn print_json(&self, document: Value) -> Outcome {
        self.print(&self.json_text(document))
    }

    /// A JSON document with its provenance, as text.
    pub fn json_text(&self, mut document: Value) -> String {
        if let Value::Object(map) = &mut document {
            map.insert("provenance".into(), self.provenance_json());
        }
        // Values made of plain data always serialise.
        let mut text = serde_json::to_string_pretty(&document).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Text to a file, or to standard output for `None` and `-`.
    pub fn write_text(&self, path: Option<&Path>, text: &str) -> Outcome {
        match path {
            Some(p) if p != Path::new("-") => Ok(write_atomic(p, |w| w.write_all(text.as_bytes()))?),
            _ => self.print(text),
        }
    }

    /// An image to a file, with provenance; what it could not hold is warned about.
    pub fn write_image(&self, path: &Path, raster: &Raster, options: WriteOptions) -> Outcome {
        self.write_image_counted(path, raster, options).map(|_| ())
    }

    /// [`Context::write_image`], and what the file could not hold.
    pub fn write_image_counted(
        &self,
        path: &Path,
        raster: &Raster,
        options: WriteOptions,
    ) -> Result<WriteReport, Failure> {
        self.task.check()?;
        check_output(path, &IMAGES)?;
        let mut options = options;
        options.metadata.extend(self.provenance_pairs());
        let report = write_image(path, raster, &options)?;
        textures::say_lost(path, report, self);
        Ok(report)
    }

    /// Notes an input file for the provenance; what is no file is ignored.
    pub fn note_input(&mut self, path: &Path) {
        if let Ok(input) = Input::of_file(path)
            && !self.provenance.inputs.contains(&input)
        {
            self.provenance.inputs.push(input);
        }
    }

    /// Notes the reached error for the provenance.
    pub fn note_error(&mut self, error: impl Into<String>) {
        self.provenance.error = Some(error.into());
    }

    /// Provenance as pairs, for formats that are not written through [`Context::write_image`].
    pub fn provenance_pairs(&self) -> Vec<(String, String)> {
        let mut pairs = self.provenance.pairs();
        pairs.extend(self.notes.iter().cloned());
        pairs
    }

    /// Notes what files written from now on say of their content.
    pub fn note(&mut self, pair: (String, String)) {
        self.notes.push(pair);
    }

    fn provenance_json(&self) -> Value {
        let p = &self.provenance;
        let inputs: Vec<Value> =
            p.inputs.iter().map(|i| json!({"name": i.name, "sha256": i.sha256})).collect();
        json!({"version": p.version, "arguments": p.arguments, "inputs": inputs, "error": p.error})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_size("512M"), Ok(512 << 20));
        assert_eq!(parse_size("1.5G"), Ok(3 << 29));
        assert_eq!(parse_size("1000"), Ok(1000));
        for bad in ["", "G", "-1G", "1X", "nanG", "0"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }
}
