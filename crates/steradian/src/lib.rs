//! Steradian lights surfaces of any reflectance with environment maps: the facade.
//!
//! Everything here computes or approximates one integral,
//!
//! ```text
//! L_o(x, wo) = ∫ L(wi) · V(x, wi) · f(wi, wo) · ⟨n·wi⟩ dwi        [W sr⁻¹ m⁻²]
//! ```
//!
//! Light ([`light`]), reflectance ([`brdf`]) and geometry ([`scene`]) come in; [`techniques`] turn them into
//! small precomputed data of known error and shade with it; the [`reference`](mod@reference) says what is
//! true; [`render`] makes pictures.
//!
//! A [`session`] puts them together: from names to a picture and a certificate.
//!
//! ```
//! use steradian::session::{Scene, Session};
//! # fn main() -> Result<(), steradian::session::Error> {
//! let mut session = Session::new();
//! let mut scene = Scene::of("teapot", Some("lambert:albedo=0.5"), "sky:elevation=40", &mut session)?;
//! (scene.settings.width, scene.settings.height) = (64, 48);
//! scene.tolerance = Some(0.2);
//! let picture = session.render(&scene)?.met()?; // a missed tolerance is an error here
//! let material = &picture.materials[0];
//! println!("{}: certified {:.2} %", material.method.slug(), 100.0 * picture.error());
//! let file = std::env::temp_dir().join("steradian-teapot.png");
//! session.write_film(&file, picture.film, picture.develop)?;
//! # Ok(())
//! # }
//! ```
//!
//! | module | what it holds |
//! |---|---|
//! | [`session`] | inputs by name, scenes, bakes, pictures, comparisons, radiance at points; one type of errors |
//! | [`light`] | environments, skies, suns, point, directional and disk lights |
//! | [`brdf`] | reflectance: models, measurements, fits |
//! | [`scene`] | geometry: meshes, visibility, cameras; textures and normal maps |
//! | [`technique`] | what a technique is, and what several share: all that one of your own needs |
//! | [`techniques`] | the published techniques, their list, and saved bakes |
//! | [`reference`](mod@reference) | the integral with an error estimate, and a path tracer |
//! | [`render`] | films, tone mapping, metrics of images, scene files, the CPU renderer |
//! | `gpu` | the GPU renderer: with the feature `gpu`, by which sessions render there too |
//! | `web` | scenes as pages for browsers: with the feature `web`, by which sessions write them |
//! | [`prefilter`] | environments filtered by kernels |
//! | [`engines`] | files of filtered light as engines expect them |
//! | [`verify`] | what a filtered file of any tool holds |
//! | [`transfer`] | what geometry does to light: occlusion, visibility, transfer vectors and matrices |
//! | [`relight`] | surfaces photographed under many lights, and height fields |
//! | [`formats`] | files as plain data |
//! | [`sphere`] | functions on the sphere: layouts, quadrature, spherical harmonics, wavelets; `glam` |
//! | [`numerics`] | linear algebra: eigenvectors, low rank, least squares |
//! | [`parallel`] | loops over all cores |
//! | [`simd`] | loops over registers, for the instruction set that the machine has |
//! | [`base`] | tasks, certificates, outcomes, provenance, descriptions of parameters |
//!
//! `examples/` shows single radiances, engines' files, techniques and reflectances of one's own, and batches.

pub use steradian_base as base;
pub use steradian_brdf as brdf;
pub use steradian_engines as engines;
pub use steradian_formats as formats;
#[cfg(feature = "gpu")]
pub use steradian_gpu as gpu;
pub use steradian_light as light;
pub use steradian_numerics as numerics;
pub use steradian_parallel as parallel;
pub use steradian_prefilter as prefilter;
pub use steradian_reference as reference;
pub use steradian_relight as relight;
pub use steradian_render as render;
pub use steradian_scene as scene;
pub use steradian_session as session;
pub use steradian_simd as simd;
pub use steradian_sphere as sphere;
pub use steradian_technique as technique;
pub use steradian_techniques as techniques;
pub use steradian_transfer as transfer;
pub use steradian_verify as verify;
#[cfg(feature = "web")]
pub use steradian_web as web;
