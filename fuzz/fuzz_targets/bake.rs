#![no_main]

use glam::Vec3;
use libfuzzer_sys::fuzz_target;
use std::path::Path;
use steradian_formats::decode_tensors;
use steradian_fuzz::limits;
use steradian_techniques::{PointsBuf, Radiance, registry};

// The first byte says which technique the file is of; what loads shades a point.
fuzz_target!(|bytes: &[u8]| {
    let Some((first, bytes)) = bytes.split_first() else { return };
    let technique = registry()[usize::from(*first) % registry().len()];
    let Ok(file) = decode_tensors(Path::new("f.safetensors"), bytes, &limits()) else { return };
    if let Ok(bake) = technique.load(&file) {
        let mut points = PointsBuf::default();
        points.push(Vec3::Y, Vec3::X, Vec3::new(0.6, 0.8, 0.0), Vec3::ZERO);
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
        bake.shade(&points.as_points(), &mut Radiance::of(&mut rgb));
    }
});
