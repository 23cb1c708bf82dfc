//! Why a command ends, with its exit code: 1 failed, 2 wrong usage, 3 unreadable or invalid input, 4
//! tolerance missed.

use std::fmt::Display;
use steradian_base::{Cancelled, ParamError};
use steradian_brdf::SpecError;
use steradian_engines::EngineError;
use steradian_formats::FormatError;
use steradian_light::LightError;
use steradian_light::sky::SkyError;
use steradian_session::{Error, Kind, Missed};
use steradian_techniques::{BakeError, SavedError};

/// A message of one line and an exit code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    /// The exit code.
    pub code: u8,
    /// One line; empty where nothing is to be said (a reader that went away).
    pub message: String,
}

/// What a command returns.
pub type Outcome = Result<(), Failure>;

impl Failure {
    /// Exit 1.
    pub fn failed(message: impl Display) -> Self {
        Self { code: 1, message: message.to_string() }
    }

    /// Exit 2.
    pub fn usage(message: impl Display) -> Self {
        Self { code: 2, message: message.to_string() }
    }

    /// Exit 3.
    pub fn input(message: impl Display) -> Self {
        Self { code: 3, message: message.to_string() }
    }

    /// Exit 4.
    pub fn missed(message: impl Display) -> Self {
        Self { code: 4, message: message.to_string() }
    }

    /// The reader of standard output went away: the end, quietly.
    pub fn broken_pipe() -> Self {
        Self { code: 0, message: String::new() }
    }
}

impl From<Error> for Failure {
    fn from(e: Error) -> Self {
        let code = match e.kind() {
            Kind::Failed => 1,
            Kind::Usage => 2,
            Kind::Input => 3,
            Kind::Missed => 4,
        };
        Self { code, message: e.to_string() }
    }
}

/// What libraries below the session return, by way of its error.
macro_rules! by_way_of_the_session {
    ($($error:ty),*) => {$(
        impl From<$error> for Failure {
            fn from(e: $error) -> Self {
                Error::from(e).into()
            }
        }
    )*};
}

by_way_of_the_session!(
    FormatError,
    LightError,
    SkyError,
    BakeError,
    SavedError,
    SpecError,
    ParamError,
    EngineError,
    Missed,
    Cancelled
);
