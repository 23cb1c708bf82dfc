#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use steradian_formats::decode_utia;
use steradian_fuzz::limits;

fuzz_target!(|bytes: &[u8]| {
    let _ = decode_utia(Path::new("f.bin"), bytes, &limits());
});
