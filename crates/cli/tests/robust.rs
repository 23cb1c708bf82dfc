//! Light without bound, long specs, instruction sets that there are not: one line, and never NaN with exit 0.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn command(dir: &Path, arguments: &[&str]) -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_steradian"));
    c.current_dir(dir).args(arguments);
    c
}

/// Exits with `code` and says one short line that contains `want`.
fn ends(o: &Output, code: i32, want: &str) {
    let e = String::from_utf8_lossy(&o.stderr).into_owned();
    let start: String = e.chars().take(600).collect();
    assert_eq!(o.status.code(), Some(code), "{start}");
    assert_eq!(e.trim_end().lines().count(), 1, "{start}");
    assert!(e.contains(want), "{start}");
    assert!(e.len() < 2000, "{} bytes", e.len());
    assert!(o.stdout.is_empty());
}

/// A lat-long image of 8 × 4 texels of `a` and `b` in turn.
fn chequered(dir: &Path, name: &str, a: f32, b: f32) {
    let mut bytes = b"PF\n8 4\n-1.0\n".to_vec();
    for k in 0..32 {
        let v = if (k + k / 8) % 2 == 0 { a } else { b };
        (0..3).for_each(|_| bytes.extend(v.to_le_bytes()));
    }
    fs::write(dir.join(name), bytes).expect("written");
}

fn folder() -> tempfile::TempDir {
    let d = tempfile::tempdir().expect("a folder");
    fs::write(d.path().join("p.csv"), "nx,ny,nz,vx,vy,vz,x,y,z\n0,1,0,0,1,0,0,1,0\n1,0,0,1,1,0,1,0,0\n")
        .expect("written");
    chequered(d.path(), "strong.pfm", 1e38, -1e38);
    chequered(d.path(), "bound.pfm", 9e29, -9e29);
    chequered(d.path(), "fine.pfm", 1e25, 1e20);
    d
}

#[test]
fn light_beyond_the_bound_is_refused_wherever_it_is_read() {
    let d = folder();
    for arguments in [
        &["eval", "-e", "strong.pfm", "-b", "lambert", "-p", "p.csv"][..],
        &["eval", "-e", "strong.pfm", "-b", "lambert", "-p", "p.csv", "-t", "diffuse_map"],
        &["bake", "strong.pfm", "-b", "ggx:alpha=0.3", "-t", "lobe_maps", "-o", "b.safetensors"],
        &["irradiance", "strong.pfm"],
        &["prefilter", "strong.pfm", "--kernel", "lambert", "--size", "4", "-o", "o.ktx2"],
        &["render", "sphere", "--environment", "strong.pfm", "--brdf", "lambert", "-o", "o.exr"],
        &["compare", "sphere", "--environment", "strong.pfm", "--brdf", "lambert", "-o", "o.png"],
        &["convert", "strong.pfm", "-o", "o.exr"],
        &["sample", "strong.pfm", "-d", "p.csv"],
    ] {
        let o = command(d.path(), arguments).output().unwrap();
        ends(&o, 3, "strong.pfm: pixel (");
        assert!(!d.path().join("o.exr").exists());
    }
    // Exposure makes too much of what a file may hold.
    let arguments = ["eval", "-e", "fine.pfm", "-b", "lambert", "-p", "p.csv", "--light-exposure", "60"];
    ends(&command(d.path(), &arguments).output().unwrap(), 3, "fine.pfm: the environment's texel (");
}

/// As strong as may be, and of both signs: every technique gives finite radiance.
#[test]
fn light_at_the_bound_stays_finite() {
    let d = folder();
    for (technique, brdf) in [
        ("diffuse_map", "lambert"),
        ("phong_diffuse_maps", "phong:n=1e8"),
        ("split_sum", "ggx:alpha=0.0001"),
        ("lobe_maps", "ggx:alpha=0.3"),
        ("lafortune_env", "lafortune:cx=-1,cy=-1,cz=1,n=20"),
        ("banks_env", "banks:n=20"),
        ("shrm", "ggx:alpha=0.5"),
    ] {
        let arguments = ["-q", "eval", "-e", "bound.pfm", "-b", brdf, "-p", "p.csv", "-t", technique];
        let o = command(d.path(), &arguments).output().unwrap();
        assert_eq!(o.status.code(), Some(0), "{technique}: {}", String::from_utf8_lossy(&o.stderr));
        let text = String::from_utf8(o.stdout).unwrap();
        for line in text.lines().skip(1) {
            let finite = line.split(',').all(|f| f.parse::<f64>().is_ok_and(f64::is_finite));
            assert!(finite, "{technique}: {line}");
        }
    }
}

/// Highlights so narrow that their error would take hours to measure are refused before the work.
#[test]
fn what_would_take_hours_is_refused() {
    let d = folder();
    for (technique, brdf) in [
        ("banks_env", "banks:n=1e8"),
        ("banks_env", "banks-map:n=1e6"),
        ("shrm", "kajiya-kay:s=1e6"),
        ("shrm_slices", "kajiya-kay:s=1e8"),
        ("shrm_global", "kajiya-kay:s=1e8"),
    ] {
        let arguments = ["-q", "bake", "sky", "-b", brdf, "-t", technique, "-o", "o.safetensors"];
        let o = command(d.path(), &arguments).output().unwrap();
        ends(&o, 2, "use a smaller exponent");
        assert!(!d.path().join("o.safetensors").exists());
    }
}

#[test]
fn what_is_long_is_not_echoed_whole() {
    let d = folder();
    let long = "x".repeat(100_000);
    let digits = "9".repeat(100_000);
    let eval = |brdf: &str, light: &str| {
        command(d.path(), &["eval", "-e", light, "-b", brdf, "-p", "p.csv"]).output().unwrap()
    };
    for spec in [
        long.clone(),
        format!("ggx:{long}"),
        format!("ggx:{long}=1"),
        format!("ggx:alpha={long}"),
        format!("lafortune:@{long}"),
    ] {
        ends(&eval(&spec, "furnace"), 2, "xxx… (10000");
    }
    ends(&eval("lambert", &format!("sky:elevation={long}")), 2, "xxx… (10000");
    ends(&eval("lambert", &format!("sky:{long}=1")), 2, "xxx… (10000");
    ends(&eval("lambert", &long), 2, "xxx");
    let render = |shape: &str| command(d.path(), &["render", shape, "-o", "o.png"]).output().unwrap();
    ends(&render(&format!("sphere:{long}=1")), 2, "xxx");
    ends(&render(&format!("sphere:radius={long}")), 2, "xxx");
    let technique = ["eval", "-e", "furnace", "-b", "lambert", "-p", "p.csv", "-t", &long];
    ends(&command(d.path(), &technique).output().unwrap(), 2, "xxx… (10000");
    let rotate = ["eval", "-e", "furnace", "-b", "lambert", "-p", "p.csv", "--rotate", &digits];
    ends(&command(d.path(), &rotate).output().unwrap(), 2, "999");
}

#[test]
fn instruction_sets_that_cannot_be_used_are_wrong_usage() {
    let d = folder();
    let arguments = ["eval", "-e", "furnace", "-b", "lambert", "-p", "p.csv", "-o", "o.csv"];
    let with = |set: &str| command(d.path(), &arguments).env("STERADIAN_ISA", set).output().unwrap();
    ends(&with("neon2"), 2, "STERADIAN_ISA=\"neon2\": no such instruction set; this machine has portable");
    assert!(!d.path().join("o.csv").exists(), "no work was done");
    for set in ["avx2", "avx512"] {
        if !steradian_simd::Isa::available().any(|isa| isa.name() == set) {
            ends(&with(set), 2, "this machine lacks it; it has portable");
        }
    }
    for set in steradian_simd::Isa::available().map(steradian_simd::Isa::name).chain([""]) {
        assert_eq!(with(set).status.code(), Some(0), "{set}");
    }
}

/// The README's second command, light of order 0, on every instruction set.
#[test]
fn a_furnace_is_baked_on_every_instruction_set() {
    let d = folder();
    for set in steradian_simd::Isa::available() {
        let arguments =
            ["-q", "bake", "furnace", "-b", "ggx:alpha=0.25", "-t", "shrm", "-o", "b.safetensors"];
        let o = command(d.path(), &arguments).env("STERADIAN_ISA", set.name()).output().unwrap();
        assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    }
}
