//! A window onto scenes: techniques, lights and materials under the mouse.
//!
//! [`Wish`] says what is to be seen, in words that the command line knows too. A [`Baker`] makes a
//! [`steradian_session::live::Live`] of it, baking only what changed; a [`Painter`] draws that on a GPU and
//! develops it for the display. The window runs both in threads of their own and never waits for them;
//! [`shoot`] runs them without a window.

mod app;
mod bake;
mod controls;
mod orbit;
mod paint;
mod reference;
mod shot;
mod wish;
mod work;

pub use app::run;
pub use bake::Baker;
pub use orbit::Orbit;
pub use paint::{DisplayMode, Frame, Painter, View};
pub use shot::{Shot, shoot};
pub use wish::Wish;

/// Why a window does not open, or closes.
#[derive(Debug)]
pub enum Error {
    /// What a scene is made of, or the GPU.
    Session(steradian_session::Error),
    /// The window system.
    Window(String),
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Session(e) => e.fmt(f),
            Self::Window(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for Error {}

impl From<steradian_session::Error> for Error {
    fn from(e: steradian_session::Error) -> Self {
        Self::Session(e)
    }
}

impl From<steradian_gpu::GpuError> for Error {
    fn from(e: steradian_gpu::GpuError) -> Self {
        Self::Session(e.into())
    }
}
