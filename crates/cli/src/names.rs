//! Names of registries in help texts, so that they are written in one place.

use steradian_brdf::dfg::Layout;
use steradian_engines::{ENGINES, KERNELS, kernels_with};
use steradian_formats::TexelFormat;
use steradian_light::load::PROFILES;
use steradian_prefilter::methods::Method;

/// `a, b or c`.
pub fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).into(),
        [all @ .., last] => format!("{} or {last}", all.join(", ")),
    }
}

/// Formats of texels.
pub fn formats() -> String {
    listed(&TexelFormat::ALL.map(TexelFormat::name))
}

/// Engines.
pub fn engines() -> String {
    listed(&ENGINES.map(|e| e.name))
}

/// Conventions of files.
pub fn profiles() -> String {
    listed(&PROFILES.iter().map(|p| p.name).collect::<Vec<_>>())
}

/// Tables of the split sum, with their channels.
pub fn tables() -> String {
    let one = |l: Layout| format!("{} ({})", l.name(), l.channels().join("; "));
    listed(&Layout::ALL.map(one).each_ref().map(String::as_str))
}

/// Kernels of filtered maps.
pub fn kernels() -> String {
    format!(
        "{}, or brdf:SPEC for any isotropic reflectance as it is seen at normal incidence",
        KERNELS.join(", ")
    )
}

/// What a parameter of kernels is, and of which.
pub fn kernel_parameter(what: &str, name: &str) -> String {
    format!("{what} of {}", listed(&kernels_with(name)))
}

/// Ways to prefilter.
pub fn methods() -> String {
    format!("A way to prefilter by name, for comparison: auto, {}", listed(&Method::ALL.map(Method::name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_end_with_or() {
        assert_eq!(listed(&["a", "b", "c"]), "a, b or c");
        assert_eq!(kernel_parameter("Exponent", "exponent"), "Exponent of phong or blinn-phong");
        assert!(engines().contains("unity") && formats().ends_with("or bc6h-signed"));
    }
}
