//! Published techniques, one module each, behind the interface of `steradian-technique`, all of which is here
//! too.
//!
//! [`registry`] lists those for all light without their types ([`AnyTechnique`], [`AnyBake`]), [`locals`]
//! those for directional and point lights ([`AnyLocal`]); commands and windows know no technique by name.

mod bibliography;
mod registry;
pub mod rooms;
mod saved;
#[cfg(test)]
mod trial;

pub use bibliography::{bibtex, cards};
pub use registry::{find, find_local, locals, registry};
pub use saved::{BakedMesh, DIGEST, IN_FOLDER, Made, SavedBake, SavedError, SavedLocal, not_finite, seal};
pub use steradian_technique::*;
