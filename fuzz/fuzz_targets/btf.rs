#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use steradian_formats::decode_btf;
use steradian_fuzz::limits;

fuzz_target!(|bytes: &[u8]| {
    let _ = decode_btf(Path::new("f.csv"), bytes, &limits());
});
