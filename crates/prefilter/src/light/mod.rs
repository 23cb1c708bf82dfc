//! Distant light prepared for filtering: its spectrum, its hierarchy, a list of small bright lights, and
//! which of these are suns that are better shaded apart from it.

mod apart;
pub(crate) mod cell;
mod matching_pursuit;
pub(crate) mod polar;
pub(crate) mod sampled;
pub(crate) mod small_light;
pub mod source;
mod sun;
mod sunlit_spectrum;
mod tree;

pub use apart::Apart;
pub use cell::Cell;
pub use matching_pursuit::MatchingPursuit;
pub use sampled::Sampled;
pub use small_light::SmallLight;
pub use source::Source;
pub use sun::Sun;
pub use sunlit_spectrum::SunlitSpectrum;
pub use tree::Tree;
