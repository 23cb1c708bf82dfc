#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use steradian_formats::decode_cornell;
use steradian_fuzz::limits;

fuzz_target!(|bytes: &[u8]| {
    let _ = decode_cornell(Path::new("f.brdf"), bytes, &limits());
});
