//! `prefilter --method`, as a user meets it.

use super::common::{run, stderr};

#[test]
fn every_method_makes_a_map_and_says_its_error() {
    let d = tempfile::tempdir().expect("a folder");
    let small = ["convert", "studio", "--to", "latlong", "--size", "64x32", "-o", "light.exr"];
    let o = run(d.path(), &small);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    for (method, bound) in [
        ("brute", 1e-6),
        ("truncated-angular", 2e-3),
        ("hierarchical", 2e-3),
        ("lat_long_angular", 2e-3),
        ("frequency", 2e-3),
        ("dual-paraboloid", 0.1),
        ("per-face", 0.3),
        ("box-mip", 0.5),
        ("auto", 2e-3),
    ] {
        let o = run(
            d.path(),
            &[
                "prefilter",
                "light.exr",
                "--kernel",
                "phong",
                "--exponent",
                "40",
                "--size",
                "8",
                "--json",
                "--method",
                method,
                "-o",
                "map.ktx2",
            ],
        );
        assert_eq!(o.status.code(), Some(0), "{method}: {}", stderr(&o));
        let report: serde_json::Value = serde_json::from_slice(&o.stdout).expect("one document");
        let level = &report["levels"][0];
        if method != "auto" {
            assert_eq!(level["way"], method.replace('_', "-"));
            assert!(level["predicted_error"].is_null() && level["cost"]["taps"].is_u64(), "{level}");
        }
        let rms = level["measured_error"]["rms"].as_f64().expect("a number");
        assert!(rms < bound, "{method}: {rms}");
    }
}

#[test]
fn unknown_methods_and_unmeasured_errors_are_refused() {
    let d = tempfile::tempdir().expect("a folder");
    let base = ["prefilter", "furnace", "--kernel", "lambert", "--size", "4", "-o", "map.ktx2", "--method"];
    for (end, want) in [(&["boxmip"][..], "box-mip"), (&["box-mip", "--check", "0"], "--check 1")] {
        let o = run(d.path(), &[&base[..], end].concat());
        assert_eq!(o.status.code(), Some(2), "{}", stderr(&o));
        assert!(stderr(&o).contains(want), "{}", stderr(&o));
        assert!(!d.path().join("map.ktx2").exists());
    }
}
