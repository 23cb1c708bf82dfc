//! A long computation's link to whoever asked for it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Receives progress; implementations must be cheap and thread-safe, they are called from worker threads.
pub trait Progress: Send + Sync {
    /// A stage called `label` starts and will take `total` steps (0: unknown).
    fn begin(&self, label: &str, total: u64);
    /// `steps` more steps of the current stage are done.
    fn advance(&self, steps: u64);
    /// The current stage is over.
    fn end(&self);
}

/// The caller asked to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Cancelled;

/// Progress, cancellation, tolerance and memory limit of one request. Cheap to clone.
#[derive(Clone)]
pub struct Task {
    progress: Option<Arc<dyn Progress>>,
    cancel: Arc<AtomicBool>,
    deadline: Option<Instant>,
    tolerance: Option<f64>,
    max_memory: u64,
}

/// Memory that a task may allocate where nothing else is said: 8 GiB.
const DEFAULT_MAX_MEMORY: u64 = 8 << 30;

impl Default for Task {
    fn default() -> Self {
        Self {
            progress: None,
            cancel: Arc::default(),
            deadline: None,
            tolerance: None,
            max_memory: DEFAULT_MAX_MEMORY,
        }
    }
}

impl Task {
    /// A task without progress that nobody cancels.
    pub fn quiet() -> Self {
        Self::default()
    }

    /// The same task reporting to `progress`.
    pub fn with_progress(mut self, progress: Arc<dyn Progress>) -> Self {
        self.progress = Some(progress);
        self
    }

    /// The same task, stopped when `flag` becomes true.
    pub fn with_cancel(mut self, flag: Arc<AtomicBool>) -> Self {
        self.cancel = flag;
        self
    }

    /// Who receives its progress.
    pub fn progress(&self) -> Option<Arc<dyn Progress>> {
        self.progress.clone()
    }

    /// The same task reporting to nobody.
    pub fn without_progress(mut self) -> Self {
        self.progress = None;
        self
    }

    /// The same task, stopped at `deadline` as if its caller had asked.
    pub fn with_deadline(mut self, deadline: Instant) -> Self {
        self.deadline = Some(deadline);
        self
    }

    /// The same task with a requested relative RMS error of outgoing radiance.
    pub fn with_tolerance(mut self, tolerance: Option<f64>) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// The same task allowed `bytes` of memory.
    pub fn with_max_memory(mut self, bytes: u64) -> Self {
        self.max_memory = bytes;
        self
    }

    /// The requested tolerance, where the user gave one.
    pub fn tolerance(&self) -> Option<f64> {
        self.tolerance
    }

    /// Bytes that this task may allocate at most.
    pub fn max_memory(&self) -> u64 {
        self.max_memory
    }

    /// Has the caller asked to stop, or has the deadline passed?
    pub fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed) || self.deadline.is_some_and(|d| Instant::now() >= d)
    }

    /// `Err(Cancelled)` once the caller has asked to stop; call it once per block of work.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// Starts a stage of `total` steps.
    pub fn begin(&self, label: &str, total: u64) {
        if let Some(p) = &self.progress {
            p.begin(label, total);
        }
    }

    /// Reports `steps` more steps of the current stage.
    pub fn advance(&self, steps: u64) {
        if let Some(p) = &self.progress {
            p.advance(steps);
        }
    }

    /// Ends the current stage.
    pub fn end(&self) {
        if let Some(p) = &self.progress {
            p.end();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cancelled_task_says_so_to_every_clone() {
        let flag = Arc::new(AtomicBool::new(false));
        let task = Task::quiet().with_cancel(flag.clone());
        let other = task.clone();
        assert_eq!(other.check(), Ok(()));
        flag.store(true, Ordering::Relaxed);
        assert_eq!(other.check(), Err(Cancelled));
    }

    #[test]
    fn a_deadline_stops_one_task_and_not_its_origin() {
        let task = Task::quiet();
        let limited = task.clone().with_deadline(Instant::now());
        assert_eq!((limited.check(), task.check()), (Err(Cancelled), Ok(())));
    }
}
