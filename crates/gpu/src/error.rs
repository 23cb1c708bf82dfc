//! Errors of the GPU; each is one line that says what to do.

/// An error of the GPU.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// No Vulkan, Metal or DX12 adapter.
    #[error(
        "no GPU adapter: {0}; install a Vulkan driver (Debian: mesa-vulkan-drivers) or use `backend` cpu"
    )]
    NoAdapter(String),
    /// The adapter gives no device, or lacks a required feature.
    #[error("the GPU cannot be used: {0}; try `backend` cpu")]
    Device(String),
    /// A technique's data or a picture exceeds the GPU's memory or limits.
    #[error(
        "the GPU is out of memory or beyond its limits: {0}; use smaller tables, a smaller picture, or `backend` cpu"
    )]
    Memory(String),
    /// A scene that contradicts itself.
    #[error("the scene cannot be drawn: {0}")]
    Scene(String),
    /// The device went away.
    #[error("the GPU was lost: {0}; start again, or use `backend` cpu")]
    Lost(String),
    /// A shader or call that the GPU refused: a defect of Steradian.
    #[error("the GPU refused '{what}': {why}")]
    Refused {
        /// The object that was being made.
        what: String,
        /// First line of the GPU's complaint.
        why: String,
    },
}

#[cfg(feature = "device")]
impl GpuError {
    /// wgpu's error while making `what`.
    pub(crate) fn of(what: &str, e: wgpu::Error) -> Self {
        let line = |s: &str| s.lines().map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join(" ");
        match e {
            wgpu::Error::OutOfMemory { .. } => Self::Memory(what.into()),
            wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
                Self::Refused { what: what.into(), why: line(&description) }
            }
        }
    }
}

#[cfg(all(test, feature = "device"))]
mod tests {
    use super::*;

    /// Each error is one line that tells what to do.
    #[test]
    fn errors_are_one_line_and_say_what_to_do() {
        let of = |e| GpuError::of("picture", e);
        let memory = of(wgpu::Error::OutOfMemory { source: "full".into() });
        assert_eq!(memory, GpuError::Memory("picture".into()));
        let description = "first line\n\n  second line\n".to_owned();
        let refused = of(wgpu::Error::Validation { source: "no".into(), description });
        let all = [
            (GpuError::NoAdapter("none found".into()), "mesa-vulkan-drivers"),
            (GpuError::Device("it lacks compute shaders".into()), "`backend` cpu"),
            (memory, "smaller"),
            (GpuError::Lost("given back".into()), "start again"),
            (refused, "first line second line"),
        ];
        for (e, what) in all {
            let line = e.to_string();
            assert!(line.contains(what) && !line.contains('\n'), "{line}");
        }
    }
}
