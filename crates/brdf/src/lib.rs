//! Reflectance: models, measurements and fits behind one trait.

mod brdf;

pub use brdf::{Brdf, Domain, Info, Lobe, Sample, SharedBrdf};
