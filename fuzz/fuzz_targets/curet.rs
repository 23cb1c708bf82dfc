#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use steradian_formats::{decode_curet, decode_curet_directions};
use steradian_fuzz::limits;

// As a table, and as directions.
fuzz_target!(|bytes: &[u8]| {
    let name = Path::new("f.dat");
    if let Ok(table) = decode_curet(name, bytes, &limits()) {
        if let Ok(values) = table.sample(name, 12) {
            assert!(values.iter().all(|v| v.is_finite()));
        }
    }
    if let Ok(rows) = decode_curet_directions(name, bytes, &limits()) {
        assert!(rows.iter().all(|[a, _, b, _]| a.abs().max(b.abs()) < std::f64::consts::FRAC_PI_2));
    }
});
