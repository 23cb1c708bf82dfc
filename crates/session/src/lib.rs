//! Common functions of all front ends: inputs by name, bakes, the choice of a technique, pictures,
//! comparisons and reports.
//!
//! A [`Session`] holds the state that requests share. Requests are plain data, results are plain data with a
//! certificate, and errors are of one type ([`Error`]) that says whose fault they are. Where the request
//! gives a tolerance, the result is an [`Outcome`], which the caller must resolve: it says whether the
//! tolerance was met.
//!
//! ```
//! use steradian_session::{Scene, Session};
//! # fn main() -> Result<(), steradian_session::Error> {
//! let mut session = Session::new();
//! let mut scene = Scene::of("sphere", Some("ggx:alpha=0.3"), "sky:elevation=30", &mut session)?;
//! (scene.settings.width, scene.settings.height) = (32, 32);
//! scene.tolerance = Some(0.5);
//! let picture = session.render(&scene)?.met()?;
//! println!("{}: {:.1} %", picture.materials[0].method.slug(), 100.0 * picture.error());
//! # Ok(())
//! # }
//! ```

pub mod atlas;
pub mod bake;
pub mod btf;
mod choice;
mod choose;
pub mod columns;
pub mod compare;
pub mod comparison;
pub mod convert;
pub mod demo;
mod destinations;
mod effort;
mod error;
pub mod eval;
pub mod fit;
#[cfg(any(feature = "gpu", feature = "web"))]
mod gpu_scene;
mod inputs;
pub mod inspect;
pub mod irradiance;
#[cfg(feature = "gpu")]
pub mod live;
mod local;
mod material;
mod notice;
mod outputs;
mod page;
mod paths;
mod picture;
mod picture_error;
mod polynomial;
pub mod prefilter;
pub mod prefiltered;
pub mod probes;
mod relief;
mod renderer;
mod report;
mod sample;
mod saved;
mod scene;
mod session;
mod table;
mod tabulate;
pub mod transfer;
pub mod web;

pub use choice::{Choice, Trial, Verdict};
pub use choose::Chosen;
pub use destinations::{Destinations, LIGHT_KEY, check_replaced, light_mark};
pub use error::{Error, Kind};
pub use inputs::{
    Adjust, DEFAULT_SKY, Method, coefficients, cosine, expand_lights, is_shape, is_sky, probe_of,
};
pub use local::{BakedLocal, Local, LocalRequest};
pub use material::{Material, Prepared};
pub use notice::Notice;
pub use outputs::{
    ANIMATION, FRAME_RATE, IMAGES, check_format, check_output, file_name, has_extension, is_animation,
    size_in_words,
};
pub use page::Page;
pub use paths::Paths;
pub use picture::{Picture, auto_exposure};
pub use picture_error::PictureError;
pub use polynomial::{POLYNOMIALS, PolynomialFacts, PolynomialKind, PolynomialPart};
pub use relief::{HORIZONS, HorizonFacts, HorizonForm, MAX_AZIMUTHS};
pub use renderer::Renderer;
pub use saved::light_as_baked;
pub use scene::{
    CameraRequest, FOV, GroundRequest, Model, Scene, SceneOverrides, SceneRequest, SurfaceRequest,
    is_scene_file, make_tangents,
};
pub use session::{Backend, GpuPath, Session, Shadows};
pub use steradian_base::{Missed, Outcome};
pub use steradian_relight::polynomial::Basis;
pub use table::{LookupTable, check_table};
pub use tabulate::MEASUREMENTS;
