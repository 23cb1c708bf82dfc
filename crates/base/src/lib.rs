//! What every layer of Steradian needs and nothing else: [`Task`] (progress, cancellation, tolerance),
//! [`Certificate`] (an error and how it is known), [`Outcome`] (an output that an accuracy was asked of),
//! [`Provenance`], and parameter descriptions.

mod brief;
mod certificate;
mod files;
mod outcome;
mod params;
mod provenance;
mod task;
mod unknown;

pub use brief::brief;
pub use certificate::{Certificate, Elevation, Evidence, Spread};
pub use files::open_file;
pub use outcome::{Missed, Outcome};
pub use params::{Field, Kind, ParamError, ParamInfo, ParamValues, Params, Preset, Value, split_spec};
pub use provenance::{Hash, Input, Provenance, without_folders};
pub use task::{Cancelled, Progress, Task};
pub use unknown::{nearest, nearest_few, unknown};
