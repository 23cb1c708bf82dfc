#![no_main]

use libfuzzer_sys::fuzz_target;
use steradian_fuzz::reflectance;

fuzz_target!(|bytes: &[u8]| {
    reflectance("nbrdf", &[("a.bin", bytes), ("a_names.txt", b"one\ntwo\n")], ",two");
});
