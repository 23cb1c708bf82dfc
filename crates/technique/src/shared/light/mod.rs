//! The light's factor: its spectrum, the suns that are shaded exactly, and its rotation.

pub mod distant;
pub mod exact;
pub mod light_rotation;
pub mod sh_light;
pub mod spectrum;
pub mod sun;
pub mod sunlit_spectrum;
