//! Files that were made from another light than the one that is given.

#[path = "planted/bake.rs"]
#[expect(dead_code, reason = "the lights of the planted faults")]
mod bake;

use bake::{bake, lights};
use steradian_base::Task;
use steradian_engines::Curve;
use steradian_light::load::{LoadOptions, Profile, load};
use steradian_sphere::{Layout, SphereImage};
use steradian_verify::laws::Law;
use steradian_verify::{Family, Fault, Input, Kernel, check};

const LEVELS: usize = 7;

/// Photographs: a clear sky, a wood, a street at night, a beach, a studio, a room.
const NAMES: [&str; 6] = [
    "lebombo_1k.hdr",
    "forest_slope_1k.hdr",
    "potsdamer_platz_1k.hdr",
    "spiaggia_di_mondello_1k.hdr",
    "studio_small_03_1k.hdr",
    "st_fagans_interior_1k.hdr",
];

/// Every pair is recognised as different, and no file of an altered light is taken for another's.
#[test]
fn files_of_other_lights_are_recognised() {
    let path = |n: &&str| steradian_testkit::data(&format!("environments/latlong/{n}"));
    let Some(paths) = NAMES.iter().map(path).collect::<Option<Vec<_>>>() else { return };
    let read = |p: &std::path::PathBuf| load(p, &LoadOptions::default()).expect("an image").image;
    let images: Vec<SphereImage> = paths.iter().map(|p| read(p).resample(Layout::LatLong, 128, 64)).collect();
    let kernels: Vec<Kernel> =
        (0..LEVELS).map(|m| Kernel::at(Family::Ggx, Curve::Linear.roughness(m, LEVELS - 1))).collect();
    let faults = |levels: &[SphereImage], light: &SphereImage| {
        let input = Input {
            levels,
            expected: &kernels,
            law: Law::Roughness(Curve::Linear),
            lights: &lights(light),
            read: Profile::own(),
            step: 0.0,
        };
        check(&input, &Task::quiet()).expect("nobody cancels").faults
    };
    let mut missed = Vec::new();
    for (i, image) in images.iter().enumerate() {
        let levels = bake(image, &kernels, 64);
        for (j, other) in images.iter().enumerate().filter(|(j, _)| *j != i) {
            if faults(&levels, other) != [Fault::OtherLight] {
                missed.push((NAMES[i], NAMES[j]));
            }
        }
        // Altered light is searched for its cause, which takes longer: of the first photograph.
        if i > 0 {
            continue;
        }
        let mut clipped = image.clone();
        clipped.planes.iter_mut().flatten().for_each(|v| *v = v.min(1.0));
        for (what, altered) in [("clipped", clipped), ("smaller", image.resample(Layout::LatLong, 32, 16))] {
            let found = faults(&bake(&altered, &kernels, 64), image);
            assert!(!found.contains(&Fault::OtherLight), "{} {what}: {found:?}", NAMES[i]);
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}
