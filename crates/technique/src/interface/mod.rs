//! The interface that every technique has: its Card, its inputs and factors, batches of points, errors.

mod card;
mod erased;
mod error;
mod given;
mod inputs;
mod part;
mod points;
mod technique;
mod vary;

pub use card::{Capabilities, Card, Check, Claim, Needs};
pub use erased::{AnyBake, AnyTechnique, Erased};
pub use error::BakeError;
pub use inputs::{Geometry, Material, Sites, View};
pub use part::Part;
pub use points::{Points, PointsBuf, Radiance, SitesAt};
pub use technique::{Bake, Parts, Technique};
pub use vary::{PointChart, PointLobe, Varies};
