//! Steradian lights surfaces of any reflectance with environment maps: the facade.
//!
//! Everything here computes or approximates one integral,
//!
//! ```text
//! L_o(x, wo) = ∫ L(wi) · V(x, wi) · f(wi, wo) · ⟨n·wi⟩ dwi        [W sr⁻¹ m⁻²]
//! ```
//!
//! Light ([`light`]), reflectance ([`brdf`]) and geometry ([`scene`]) come in; [`techniques`] turn them into small
//! precomputed data of known error and shade with it; the [`reference`](mod@reference) judges them; [`render`] makes
//! pictures.
//!
//! ```
//! use steradian::sphere::Frame;
//! use steradian::sphere::glam::DVec3;
//! use steradian::{base::Task, brdf, light, reference};
//!
//! // A white furnace: whatever reflects half of the light looks half as bright.
//! let sky = light::sky::by_name("furnace", 32, 16).expect("a known name");
//! let lights = light::Lights::from(light::Environment { image: sky.image });
//! let judge = reference::Judge::new(&lights, reference::Lookup::Constant, &Task::quiet()).expect("finite light");
//! let clay = brdf::parse("lambert:albedo=0.5").expect("a known model");
//! let seen = judge.radiance(&*clay, &Frame::from_normal(DVec3::Y), DVec3::Y, None, 1e-4);
//! assert!((seen.rgb[0] - 0.5).abs() < 1e-3);
//! ```

pub use steradian_base as base;
pub use steradian_brdf as brdf;
pub use steradian_formats as formats;
pub use steradian_light as light;
pub use steradian_prefilter as prefilter;
pub use steradian_reference as reference;
pub use steradian_render as render;
pub use steradian_scene as scene;
pub use steradian_simd as simd;
pub use steradian_sphere as sphere;
pub use steradian_techniques as techniques;
