//! The path tracer as a user meets it: `render`, `eval` and `compare`.

use super::common::{done, run};
use std::fs;

/// A floor beside a wall under even light: what the wall hides has a closed form, and light from it makes
/// more.
#[test]
fn points_see_shadows_and_light_from_each_other() {
    let d = tempfile::tempdir().expect("a folder");
    // A floor and a wall that meet along z.
    fs::write(
        d.path().join("corner.obj"),
        "v 0 0 -9\nv 0 0 9\nv 9 0 9\nv 9 0 -9\nv 0 9 -9\nv 0 9 9\nf 1 2 3\nf 1 3 4\nf 1 5 6\nf 1 6 2\n",
    )
    .expect("written");
    fs::write(
        d.path().join("points.csv"),
        "px,py,pz,nx,ny,nz,vx,vy,vz\n0.5,0,0,0,1,0,0.6,0.8,0\n0.05,0,0,0,1,0,0,1,0\n",
    )
    .expect("written");
    let rows = |bounces: &str| -> Vec<[f64; 2]> {
        let light =
            ["eval", "-e", "furnace", "-b", "lambert:albedo=0.5", "-t", "path", "--mesh", "corner.obj"];
        let rest = ["--points", "points.csv", "--noise", "0.004", "--bounces", bounces];
        let o = done(d.path(), &[&light[..], &rest[..]].concat());
        let text = String::from_utf8(o.stdout).expect("text");
        let mut lines = text.lines();
        let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
        let at = |name: &str| head.iter().position(|h| *h == name).expect("a column");
        let cell =
            |row: &str, k: usize| row.split(',').nth(k).expect("a cell").parse::<f64>().expect("a number");
        lines.map(|row| [cell(row, at("r")), cell(row, at("err"))]).collect()
    };
    let (one, two) = (rows("1"), rows("2"));
    for (k, x) in [0.5f64, 0.05].into_iter().enumerate() {
        // The wall of height h hides (1 − x/√(x² + h²))/2 of the floor's cosine-weighted hemisphere (crossed
        // strings).
        let seen = 1.0 - 0.5 * (1.0 - x / x.hypot(9.0));
        let [got, err] = one[k];
        assert!(err <= 0.004 && (got / (0.5 * seen) - 1.0).abs() < 0.02, "{x}: {got} {}", 0.5 * seen);
        assert!(two[k][0] > 1.1 * got && two[k][0] < 0.5, "{:?} {:?}", two[k], one[k]);
    }
}

#[test]
fn pictures_have_a_variance_and_comparisons_a_noise() {
    let d = tempfile::tempdir().expect("a folder");
    let render =
        ["render", "teapot", "-b", "lambert:albedo=0.5", "-t", "path", "--size", "24x24", "--noise", "0.05"];
    done(d.path(), &[&render[..], &["--variance", "v.exr", "-o", "p.exr"]].concat());
    assert!(d.path().join("v.exr").is_file() && d.path().join("p.exr").is_file());
    let compare =
        ["compare", "sphere", "--path", "-b", "lambert:albedo=0.5", "-t", "sh-irradiance", "--json"];
    let o =
        done(d.path(), &[&compare[..], &["--size", "24x24", "--noise", "0.03", "-e", "overcast"]].concat());
    let text = String::from_utf8(o.stdout).expect("text");
    assert!(text.contains("\"path\"") && text.contains("sh_irradiance"), "{text}");
}

#[test]
fn what_paths_need_is_said() {
    let d = tempfile::tempdir().expect("a folder");
    fs::write(d.path().join("points.csv"), "nx,ny,nz,vx,vy,vz\n0,1,0,0,1,0\n").expect("written");
    let eval = ["eval", "-e", "furnace", "-b", "lambert", "-t", "path", "--points", "points.csv"];
    let cases: [(&[&str], &str); 4] = [
        (&eval, "--mesh"),
        (&[&eval[..], &["--mesh", "sphere"]].concat(), "px,py,pz"),
        (&["render", "sphere", "--bounces", "2", "-o", "x.png"], "--bounces"),
        (&["render", "sphere", "--variance", "v.exr", "-o", "x.png"], "--variance"),
    ];
    for (arguments, word) in cases {
        let o = run(d.path(), arguments);
        let text = String::from_utf8_lossy(&o.stderr).into_owned();
        assert_eq!(o.status.code(), Some(2), "{arguments:?}: {text}");
        assert!(text.contains(word) && text.lines().count() == 1, "{text}");
    }
}
