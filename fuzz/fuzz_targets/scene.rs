#![no_main]

use libfuzzer_sys::fuzz_target;
use steradian_brdf::Files;
use steradian_render::SceneFile;

fuzz_target!(|text: &str| {
    if let Err(e) = SceneFile::parse("f.toml", text, Files::None) {
        assert!(!e.to_string().is_empty());
    }
});
