#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use steradian_formats::{decode_ktx2, decode_ktx2_array};
use steradian_fuzz::limits;

fuzz_target!(|bytes: &[u8]| {
    let _ = decode_ktx2(Path::new("f.ktx2"), bytes, &limits());
    let _ = decode_ktx2_array(Path::new("f.ktx2"), bytes, &limits());
});
