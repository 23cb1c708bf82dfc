//! Why there is no transfer.

use glam::Vec3;
use steradian_base::Cancelled;

/// Why there is no transfer.
#[derive(Debug, thiserror::Error)]
pub enum TransferError {
    /// The mesh has no triangle that a ray could meet.
    #[error("the mesh has no triangles")]
    NoTriangles,
    /// A site is no point of a surface.
    #[error("site {site}: its position {p} is not finite or its normal {n} is not of length 1")]
    Site {
        /// Index of the site.
        site: usize,
        /// Position.
        p: Vec3,
        /// Its normal.
        n: Vec3,
    },
    /// A setting is out of range.
    #[error("{0}")]
    Setting(String),
    /// It would take more memory than is allowed.
    #[error("{what} takes {needed} bytes, more than the {allowed} that are allowed: {advice}")]
    Memory {
        /// The data.
        what: &'static str,
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        allowed: u64,
        /// Advice to the user.
        advice: &'static str,
    },
    /// The file of finished parts cannot be used.
    #[error("{path}: {why}")]
    Store {
        /// The file.
        path: String,
        /// Why.
        why: String,
    },
    /// The caller stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
