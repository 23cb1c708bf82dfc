#![no_main]

use libfuzzer_sys::fuzz_target;
use steradian_fuzz::reflectance;

// The table, and after a byte of 0 the directions.
fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |b| *b == 0);
    let (table, angles) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    reflectance("curet", &[("abrdf.dat", table), ("angles.dat", angles)], ",sample=12");
});
