//! The table of techniques, from their Cards.

use std::fmt::Write;
use steradian_base::ParamInfo;
use steradian_session::atlas::COLUMNS;
use steradian_techniques::{Card, locals, registry};

/// Every technique's Card and parameters: those for environments first.
fn all() -> Vec<(&'static Card, &'static [ParamInfo])> {
    let near = locals().iter().map(|t| (t.card(), t.params()));
    registry().iter().map(|t| (t.card(), t.params())).chain(near).collect()
}

/// `docs/techniques.md`. Writes to a `String` cannot fail, hence the ignored results.
pub fn page() -> String {
    let mut out = String::from(
        "# Techniques\n\nEach technique has a chapter, the README in its folder. Local techniques (`--local`) shade directional and point lights beside one of the others (`--technique`), which has environment and disks.\n\n",
    );
    out.push_str(
        "| technique | light | reflectance | parameters (default) | chapter |\n|---|---|---|---|---|\n",
    );
    for (c, params) in all() {
        let default = |p: &ParamInfo| p.default_value().map_or("required".into(), |v| v.to_string());
        let params: Vec<_> = params.iter().map(|p| format!("`{}` ({})", p.name, default(p))).collect();
        let _ = writeln!(
            out,
            "| `{}` {} | {} | {} | {} | [{}](../crates/techniques/src/rooms/{}/README.md) |",
            c.slug,
            c.title,
            c.light,
            c.reflectance,
            if params.is_empty() { "–".into() } else { params.join(", ") },
            c.slug,
            c.slug
        );
    }
    out.push_str("\n## Capabilities\n\nThe columns of figure 11 of Kautz, *Hardware Lighting and Shading: a Survey* (2004).\n\n| technique | local or global |");
    COLUMNS.iter().for_each(|(name, _)| out.push_str(&format!(" {name} |")));
    out.push_str("\n|---|---|");
    COLUMNS.iter().for_each(|_| out.push_str("---|"));
    for (c, _) in all() {
        let _ =
            write!(out, "\n| `{}` | {} |", c.slug, if c.capabilities.global { "global" } else { "local" });
        for (_, has) in COLUMNS {
            out.push_str(if has(&c.capabilities) { " x |" } else { "  |" });
        }
    }
    out.push_str("\n\n## Sources\n\n");
    for (c, _) in all() {
        let _ = writeln!(out, "- `{}`: {}", c.slug, c.citation);
    }
    out.push_str("\n## Exact when\n\n");
    for (c, _) in all() {
        for claim in c.exact_when {
            let _ = writeln!(out, "- `{}`: {} (within {:e})", c.slug, claim.statement, claim.within);
        }
    }
    out
}
