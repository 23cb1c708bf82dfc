#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use steradian_formats::decode_nbrdf;
use steradian_fuzz::limits;

fuzz_target!(|bytes: &[u8]| {
    for row in 0..2 {
        if let Ok(numbers) = decode_nbrdf(Path::new("f.bin"), bytes, row, &limits()) {
            assert!(numbers.iter().all(|v| v.is_finite()));
        }
    }
});
