//! Every example runs, and what it gives is right.

#![allow(clippy::print_stdout, reason = "examples say what they found")]

#[path = "../examples/a_picture.rs"]
mod a_picture;
#[path = "../examples/engine_files.rs"]
mod engine_files;
#[path = "../examples/own_reflectance.rs"]
mod own_reflectance;
#[path = "../examples/own_technique.rs"]
mod own_technique;
#[path = "../examples/radiance_at_a_point.rs"]
mod radiance_at_a_point;
#[path = "../examples/shading_batches.rs"]
mod shading_batches;

#[test]
fn a_point_s_radiance_is_within_what_is_certified() {
    let [exact, fast, error] = radiance_at_a_point::run().expect("runs");
    assert!(exact > 0.0 && (fast / exact - 1.0).abs() < 3.0 * error, "{exact} {fast} {error}");
}

#[test]
fn a_picture_is_written_with_its_certificate() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = a_picture::run(folder.path()).expect("runs");
    assert!(error <= 0.6 && folder.path().join("picture.png").is_file());
}

#[test]
fn an_engine_s_files_are_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let names = engine_files::run(folder.path()).expect("runs");
    // Two cubes, and the sun, which their texels do not hold.
    assert_eq!(names.len(), 3, "{names:?}");
    names.iter().for_each(|n| assert!(folder.path().join("bevy").join(n).is_file(), "{n}"));
}

#[test]
fn a_technique_of_one_s_own_stands_beside_the_reference() {
    let [two, three] = own_technique::run().expect("runs");
    assert!(three < two && two < 0.5, "{two} {three}");
}

#[test]
fn a_reflectance_of_one_s_own_is_shaded() {
    let [exact, fast, error] = own_reflectance::run().expect("runs");
    assert!(exact > 0.0 && (fast / exact - 1.0).abs() < (3.0 * error).max(0.05), "{exact} {fast} {error}");
}

#[test]
fn batches_change_as_the_light_turns() {
    let means = shading_batches::run().expect("runs");
    let (low, high) = means.iter().fold((f32::MAX, 0.0f32), |m, v| (m.0.min(*v), m.1.max(*v)));
    assert!(means.len() == 8 && low > 0.0 && high > 1.1 * low, "{means:?}");
}
