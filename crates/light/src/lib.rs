//! Light: environments (images on the sphere with optional analytic suns), analytic skies, point,
//! directional and disk lights.

pub mod adjust;
mod cell;
mod environment;
mod lamps;
mod lights;
pub mod load;
mod probes;
pub mod sky;
pub mod stats;
pub mod suns;

pub use cell::CellLight;
pub use environment::Environment;
pub use lamps::Lamp;
pub use lights::{DirectionalLight, DiskLight, LARGEST, Lights, PointLight, Unsound};
pub use load::{LightError, LoadOptions, Loaded};
pub use probes::{MAX_BANDS, NoProbes, Places, Probe, Probes};
