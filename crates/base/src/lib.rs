//! What every layer of Steradian needs and nothing else: [`Task`] (progress, cancellation, tolerance),
//! [`Certificate`] (an error and how it is known), [`Provenance`], and parameter descriptions.

mod certificate;
mod params;
mod provenance;
mod task;

pub use certificate::{Certificate, Known, Spread};
pub use params::{ParamError, ParamInfo, ParamValues, Params};
pub use provenance::{Input, Provenance};
pub use task::{Cancelled, Progress, Task};
