//! The `steradian` command: light, reflectance and geometry in; pictures, coefficients and numbers out.
//!
//! It reads the registry of techniques and knows none by name. Data go to standard output, progress and logs
//! to standard error. Exit codes: 0 done, 1 failed, 2 wrong usage, 3 unreadable or invalid input, 4 tolerance
//! missed.

mod commands;
mod context;
mod failure;
mod inputs;
mod names;
mod options;
mod progress;
mod sources;
mod usage;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser};
use context::{Common, Context};
use failure::Failure;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

/// Environment-map lighting of any reflectance.
#[derive(Debug, Parser)]
#[command(name = "steradian", version, propagate_version = true, max_term_width = 100)]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: commands::Command,
}

fn main() -> ExitCode {
    if let Err(e) = steradian_simd::check() {
        return end(&Failure::usage(e));
    }
    let parsed = command().try_get_matches().and_then(|m| Ok((Cli::from_arg_matches(&m)?, sources::of(&m))));
    let (cli, sources) = match parsed {
        Ok(parsed) => parsed,
        Err(e) => {
            // Without arguments the whole help is the answer.
            if e.use_stderr() && e.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
                return end(&Failure::usage(usage::line(&e, &command())));
            }
            // Help and version go to standard output and end well; nothing can be done where that is closed.
            let _ = e.print();
            return ExitCode::from(u8::from(e.use_stderr()) * 2);
        }
    };
    match guarded(cli, sources) {
        Ok(()) => ExitCode::SUCCESS,
        Err(f) => end(&f),
    }
}

/// The command line, whose common options are described once: in `steradian --help`.
fn command() -> clap::Command {
    let mut command = Cli::command();
    let common: Vec<clap::Arg> =
        command.get_arguments().filter(|a| a.is_global_set()).map(|a| a.clone().hide(true)).collect();
    let names: Vec<String> = command.get_subcommands().map(|s| s.get_name().into()).collect();
    for name in names {
        let described = "Options of every command, such as --json, --quiet and --threads: steradian --help";
        command = command.mut_subcommand(name, |s| s.args(common.clone()).after_help(described));
    }
    command
}

/// Bytes of a message beyond which its middle is left out: what was given on the command line, such as a path
/// of 100 kB, is not echoed whole.
const LONGEST: usize = 4000;

/// Says in one line why the command ends.
fn end(f: &Failure) -> ExitCode {
    if !f.message.is_empty() {
        let line = options::dashed(&f.message).replace('\n', " ");
        let characters = line.chars().count();
        let line = if line.len() > LONGEST {
            let (first, last) = (line.chars().take(200), line.chars().skip(characters - 200));
            first.chain(" … ".chars()).chain(last).collect()
        } else {
            line
        };
        let _ = writeln!(std::io::stderr(), "steradian: {line}");
    }
    ExitCode::from(f.code)
}

/// Where the last panic happened, for the one line that a user sees of it.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

fn guarded(cli: Cli, sources: Vec<PathBuf>) -> failure::Outcome {
    std::panic::set_hook(Box::new(|info| {
        // The last one: earlier ones may have been caught, as those of a decoder that a broken file leads
        // astray.
        let mut slot = PANIC.lock().unwrap_or_else(PoisonError::into_inner);
        *slot = Some(info.to_string().replace('\n', " "));
    }));
    let arguments: Vec<String> =
        std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned()).collect();
    catch_unwind(AssertUnwindSafe(|| {
        let mut context = Context::new(cli.common, arguments, sources)?;
        cli.command.run(&mut context)
    }))
    .unwrap_or_else(|_| {
        let what = PANIC.lock().unwrap_or_else(PoisonError::into_inner).take().unwrap_or_default();
        Err(Failure::failed(format!("internal error ({what}); this is a bug, please report it")))
    })
}
