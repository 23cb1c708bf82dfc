#![no_main]

use libfuzzer_sys::fuzz_target;
use steradian_formats::decode_mesh;
use steradian_fuzz::limits;

fuzz_target!(|bytes: &[u8]| {
    let _ = decode_mesh("f.gltf", bytes, &limits());
});
