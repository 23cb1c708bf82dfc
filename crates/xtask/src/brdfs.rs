//! The table of reflectance models, from what they say of themselves.

use std::fmt::Write;
use steradian_brdf::models;

/// `docs/brdfs.md`. Writes to a `String` cannot fail, hence the ignored results.
pub fn page() -> String {
    let mut out = String::from(
        "# Reflectance models\n\nA spec string is `name:key=value,…`; values are scalars or `r/g/b` triples. \
         `steradian inspect brdf:SPEC` prints the same and draws polar plots.\n",
    );
    for m in models() {
        let _ = write!(
            out,
            "\n## `{}`\n\n{}\n\n    {}\n\nUnits: {}. Reciprocity: {}. Energy: {}.\n\n",
            m.name, m.source, m.formula, m.units, m.reciprocity, m.energy
        );
        for p in m.parameters {
            let _ = writeln!(out, "- `{}`: {p}", p.label());
        }
    }
    out
}
