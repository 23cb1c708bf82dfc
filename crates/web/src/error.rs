//! What may go wrong with a page.

/// Why a page cannot be written; one line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WebError {
    /// Something is larger than browsers allow.
    #[error("a page for browsers cannot hold {0}")]
    TooLarge(String),
    /// A technique that the page cannot run.
    #[error("{0}")]
    Technique(String),
    /// A tone mapper without shader text.
    #[error("the tone mapper '{0}' has no shader text")]
    ToneMapper(String),
    /// A shader that could not be translated: a defect of Steradian.
    #[error("the shader of {what} cannot be translated: {why}")]
    Shader {
        /// Whose shader.
        what: String,
        /// The translator's complaint.
        why: String,
    },
}
