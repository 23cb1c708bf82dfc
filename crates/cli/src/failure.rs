//! Why a command ends, with its exit code: 1 failed, 2 wrong usage, 3 unreadable or invalid input, 4 tolerance
//! missed.

use std::fmt::Display;
use steradian_base::{Cancelled, ParamError};
use steradian_brdf::SpecError;
use steradian_engines::EngineError;
use steradian_formats::FormatError;
use steradian_light::load::LightError;
use steradian_reference::JudgeError;
use steradian_render::SceneError;
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

impl From<FormatError> for Failure {
    fn from(e: FormatError) -> Self {
        Self { code: e.exit_code(), message: e.to_string() }
    }
}

impl From<LightError> for Failure {
    fn from(e: LightError) -> Self {
        Self { code: e.exit_code(), message: e.to_string() }
    }
}

impl From<BakeError> for Failure {
    fn from(e: BakeError) -> Self {
        Self { code: e.exit_code(), message: e.to_string() }
    }
}

impl From<EngineError> for Failure {
    fn from(e: EngineError) -> Self {
        match e {
            EngineError::Request(why) => Self::usage(why),
            EngineError::Format(e) => e.into(),
            EngineError::Failed(_) | EngineError::Cancelled(_) => Self::failed(e),
        }
    }
}

impl From<SavedError> for Failure {
    fn from(e: SavedError) -> Self {
        let code = match &e {
            SavedError::Format(e) => e.exit_code(),
            SavedError::Invalid { .. } => 3,
            SavedError::Bake { source, .. } => source.exit_code(),
        };
        Self { code, message: e.to_string() }
    }
}

impl From<SpecError> for Failure {
    fn from(e: SpecError) -> Self {
        let code = if matches!(e, SpecError::File { .. }) { 3 } else { 2 };
        Self { code, message: e.to_string() }
    }
}

impl From<JudgeError> for Failure {
    fn from(e: JudgeError) -> Self {
        let code = if matches!(e, JudgeError::Cancelled(_)) { 1 } else { 3 };
        Self { code, message: e.to_string() }
    }
}

impl From<SceneError> for Failure {
    fn from(e: SceneError) -> Self {
        Self::input(e)
    }
}

impl From<ParamError> for Failure {
    fn from(e: ParamError) -> Self {
        Self::usage(e)
    }
}

impl From<Cancelled> for Failure {
    fn from(e: Cancelled) -> Self {
        Self::failed(e)
    }
}
