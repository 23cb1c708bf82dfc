//! Test-only helpers: where the real data lies, and tests on every instruction set.

mod isa;

pub use isa::on_every_isa;

mod mutate;

pub use mutate::Mutator;

use std::path::PathBuf;

/// The data folder: `STERADIAN_DATA`, else `../shared/data` beside the checkout. `None` where it is missing.
pub fn data_dir() -> Option<PathBuf> {
    let dir = match std::env::var_os("STERADIAN_DATA") {
        Some(d) => PathBuf::from(d),
        // Every crate lies two folders below the checkout; cargo names it at run time.
        None => PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR")?).join("../../../shared/data"),
    };
    dir.is_dir().then_some(dir)
}

/// The file `name` of the data folder. Without the folder the test says so and passes as skipped
/// (`let Some(path) = testkit::data("…") else { return };`); CI sets `STERADIAN_REQUIRE_DATA=1`, which makes
/// a missing file a failure.
pub fn data(name: &str) -> Option<PathBuf> {
    let found = data_dir().map(|d| d.join(name)).filter(|p| p.exists());
    if found.is_none() {
        let required = std::env::var_os("STERADIAN_REQUIRE_DATA").is_some();
        assert!(!required, "test data {name} is missing: set STERADIAN_DATA to the data folder");
        #[expect(clippy::print_stderr, reason = "a skipped test says so")]
        {
            eprintln!("skipped: no test data {name} (set STERADIAN_DATA)");
        }
    }
    found
}

/// Are the long tests asked for (`STERADIAN_FULL=1`)?
pub fn full() -> bool {
    std::env::var_os("STERADIAN_FULL").is_some()
}
