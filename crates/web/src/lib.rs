//! A scene and its bakes as a static web page that shades them in the browser.
//!
//! [`files`] makes a page of plain data: for each light and each technique a [`steradian_gpu::scene::Scene`],
//! whose shaders are the ones that a GPU runs here. WebGPU takes them as they are; for WebGL2 naga translates
//! them to GLSL ES 3.00. Neither reads a storage buffer: vertices, indices and data per site lie in textures.
//! Where neither API works, the page shows the pictures that were rendered on the CPU.
//!
//! The page needs no server code and no network. Its data are scripts that a page opened from a disk may load
//! too, gzip in seven bits a character. `docs/web.md` says what is in each file.

mod data;
mod error;
mod manifest;
mod model;
mod packing;
mod shader;
mod tone;

pub use error::WebError;
pub use manifest::{File, files};
pub use model::{Light, Numbers, Page, Reference, Technique, Variant};
pub use shader::{Module, object_module, sky_module};
pub use tone::TONE_MAPPERS;
