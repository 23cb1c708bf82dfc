//! What every command gets: options that all share, the task, and the ways out.

use crate::failure::{Failure, Outcome};
use crate::options;
use crate::progress::Bars;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::io::{self, IsTerminal, Read, Write};
use std::ops::{Deref, DerefMut};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use steradian_base::Task;
use steradian_formats::{CsvTable, decode_csv, read_csv, write_atomic};
use steradian_light::load;
use steradian_session::{self as session, Session};

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
    /// Memory that reading a file and making data (a bake, transfer, filtered maps, shadow maps) may each
    /// take at most, such as 512M or 8G; a picture's own pixels and the program itself come on top
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

/// What every command gets: the session, and the ways out.
pub struct Context {
    /// The shared options.
    pub common: Common,
    session: Session,
    /// On a terminal.
    bars: Option<Arc<Bars>>,
}

impl Deref for Context {
    type Target = Session;

    fn deref(&self) -> &Session {
        &self.session
    }
}

impl DerefMut for Context {
    fn deref_mut(&mut self) -> &mut Session {
        &mut self.session
    }
}

/// One line on standard error, which no bar is drawn over.
fn say(bars: Option<&Bars>, line: impl std::fmt::Display) {
    let line = line.to_string();
    let line = options::dashed(&line);
    // Nobody is left to be told when standard error is gone.
    beside(bars, || {
        let _ = writeln!(io::stderr(), "{line}");
    });
}

/// Does what writes lines, with the bar, where one is shown, out of their way.
fn beside<R>(bars: Option<&Bars>, write: impl FnOnce() -> R) -> R {
    match bars {
        Some(bars) => bars.beside(write),
        None => write(),
    }
}

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

impl Context {
    /// Sets threads, progress and Ctrl-C up. No output will replace one of `sources`.
    pub fn new(common: Common, arguments: Vec<String>, sources: Vec<PathBuf>) -> Result<Self, Failure> {
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
        // Where no handler can be installed, Ctrl-C ends the process at once, which leaves no partial file
        // either.
        let _ = ctrlc::set_handler(move || {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(1);
            }
            flag.store(true, Ordering::SeqCst);
        });
        let mut task = Task::quiet().with_cancel(cancel).with_max_memory(common.max_memory);
        let bars = (!common.quiet && io::stderr().is_terminal()).then(|| Arc::new(Bars::new()));
        if let Some(bars) = &bars {
            task = task.with_progress(bars.clone());
        }
        let (quiet, shown) = (common.quiet, bars.clone());
        let mut session =
            Session::new().with_task(task).with_arguments(arguments).with_kept_inputs(sources).with_listener(
                move |notice| {
                    if !quiet {
                        let kind = if notice.is_warning() { "warning: " } else { "" };
                        say(shown.as_deref(), format_args!("{kind}{notice}"));
                    }
                },
            );
        session.negative = match common.negative {
            Negative::Keep => load::Negative::Keep,
            Negative::Zero => load::Negative::Zero,
        };
        session.backend = match common.backend {
            Backend::Auto => session::Backend::Auto,
            Backend::Cpu => session::Backend::Cpu,
            Backend::Gpu | Backend::Both => session::Backend::Gpu,
        };
        session.gpu_path = match common.gpu_path {
            GpuPath::Auto => session::GpuPath::Auto,
            GpuPath::Raster => session::GpuPath::Raster,
            GpuPath::Compute => session::GpuPath::Compute,
        };
        Ok(Self { common, session, bars })
    }

    /// The bar over several outputs, where bars are shown.
    pub fn bars(&self) -> Option<&Bars> {
        self.bars.as_deref()
    }

    /// One line on standard error, unless `--quiet`.
    pub fn say(&self, line: impl std::fmt::Display) {
        if !self.common.quiet {
            say(self.bars(), line);
        }
    }

    /// One warning on standard error, unless `--quiet`.
    pub fn warn(&self, line: impl std::fmt::Display) {
        self.say(format_args!("warning: {line}"));
    }

    /// Data on standard output.
    pub fn print(&self, text: &str) -> Outcome {
        let result = beside(self.bars(), || {
            let mut out = io::stdout().lock();
            out.write_all(text.as_bytes()).and_then(|()| out.flush())
        });
        result.map_err(|e| match e.kind() {
            io::ErrorKind::BrokenPipe => Failure::broken_pipe(),
            _ => Failure::failed(format!("standard output: cannot write: {e}")),
        })
    }

    /// A library's words on standard output.
    pub fn print_words(&self, text: &str) -> Outcome {
        self.print(&options::dashed(text))
    }

    /// A JSON document on standard output, with its provenance under `provenance`.
    pub fn print_json(&self, document: Value) -> Outcome {
        self.print(&self.json_text(document))
    }

    /// What was done: with `--json` the document, else lines on standard error.
    pub fn report<L>(&self, document: impl FnOnce() -> Value, lines: impl FnOnce() -> L) -> Outcome
    where
        L: IntoIterator<Item: std::fmt::Display>,
    {
        if self.common.json {
            return self.print_json(document());
        }
        lines().into_iter().for_each(|line| self.say(line));
        Ok(())
    }

    /// A JSON document with its provenance, as text.
    pub fn json_text(&self, mut document: Value) -> String {
        options::dashed_document(&mut document);
        if let Value::Object(map) = &mut document {
            map.insert("provenance".into(), self.provenance_json());
        }
        // Values made of plain data always serialise.
        let mut text = serde_json::to_string_pretty(&document).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Reads the table `path`, an input; `-` is standard input.
    pub fn read_table(&mut self, path: &Path) -> Result<CsvTable, Failure> {
        let limits = self.limits();
        if path != Path::new("-") {
            let table = read_csv(path, &limits)?;
            self.note_input(path);
            return Ok(table);
        }
        let mut bytes = Vec::new();
        let name = Path::new("standard input");
        let read = io::stdin().take(limits.max_memory.saturating_add(1)).read_to_end(&mut bytes);
        read.map_err(|e| Failure::input(format!("standard input: {e}")))?;
        limits.memory(name, bytes.len() as u128, bytes.len() as u64)?;
        Ok(decode_csv(name, &bytes, &limits)?)
    }

    /// Text to a file, or to standard output for `None` and `-`.
    pub fn write_text(&self, path: Option<&Path>, text: &str) -> Outcome {
        match path {
            Some(p) if p != Path::new("-") => {
                self.check()?;
                self.spares(p)?;
                Ok(write_atomic(p, |w| w.write_all(text.as_bytes()))?)
            }
            _ => self.print(text),
        }
    }

    /// A library's words, as [`Self::write_text`] writes text.
    pub fn write_words(&self, path: Option<&Path>, text: &str) -> Outcome {
        self.write_text(path, &options::dashed(text))
    }

    fn provenance_json(&self) -> Value {
        let p = self.provenance();
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
