//! The light's factor: its spectrum, its suns apart from the rest, and where it is turned to.

pub mod apart;
pub mod distant;
pub mod exact;
pub mod light_rotation;
pub mod sh_light;
pub mod spectral_error;
pub mod spectrum;
pub mod sun;
pub mod sunlit_spectrum;
