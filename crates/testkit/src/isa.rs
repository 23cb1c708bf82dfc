//! A test on every instruction set that the machine has.

use std::process::Command;
use steradian_simd::Isa;

/// Runs a test once for each instruction set that the machine has. `STERADIAN_ISA` is read once in a process,
/// so each gets a process of its own, this test's binary with this test alone. Call it with a closure that is
/// written in the test itself: the closure's type tells the test's name. Where `STERADIAN_ISA` is set
/// already, and where there is but one instruction set, the test runs here.
///
/// # Panics
/// If the test fails on any of them.
pub fn on_every_isa<F: FnOnce()>(test: F) {
    let every: Vec<Isa> = Isa::available().collect();
    if every.len() == 1 || std::env::var_os("STERADIAN_ISA").is_some_and(|set| !set.is_empty()) {
        return test();
    }
    // CRATE::MODULE::TEST::{{closure}}
    let path = std::any::type_name::<F>().trim_end_matches("::{{closure}}");
    let name = path.split_once("::").map_or(path, |(_, name)| name);
    for isa in every {
        alone(name, isa).unwrap_or_else(|e| panic!("on {}: {e}", isa.name()));
    }
}

/// Runs a test of this binary by itself on an instruction set.
fn alone(name: &str, isa: Isa) -> Result<(), String> {
    let binary = std::env::current_exe().expect("a test's binary has a path");
    let run = Command::new(binary).args([name, "--exact"]).env("STERADIAN_ISA", isa.name()).output();
    let run = run.expect("a test's binary starts");
    let said = [run.stdout, run.stderr].map(|s| String::from_utf8_lossy(&s).into_owned()).concat();
    // A name that no test has passes, too, with no test run.
    if run.status.success() && said.contains("1 passed") { Ok(()) } else { Err(said) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instruction_set_is_run() {
        on_every_isa(|| {
            let set = std::env::var("STERADIAN_ISA");
            assert!(
                set.is_ok_and(|set| set == steradian_simd::isa().name()) || Isa::available().count() == 1
            );
        });
    }

    #[test]
    fn what_does_not_run_fails() {
        assert!(alone("no::such::test", Isa::Portable).is_err());
    }
}
