//! Work that is limited to a number of processor seconds, so that on a busy machine it takes longer but has
//! the same result.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;
use steradian_base::Task;

/// Interval at which the time is checked.
const TICK: Duration = Duration::from_millis(5);

/// Processor seconds that this process has taken, all threads together.
#[cfg(unix)]
pub(crate) fn processor_seconds() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// Seconds since the first call: there is no portable clock of the processors.
#[cfg(not(unix))]
pub(crate) fn processor_seconds() -> f64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}

/// Runs `work` under a task that is stopped once the process has used so many processor `seconds`, or when
/// `task` is; returns its result and the seconds used.
pub(crate) fn within<T>(task: &Task, seconds: f64, work: impl FnOnce(&Task) -> T) -> (T, f64) {
    let start = processor_seconds();
    let stop = Arc::new(AtomicBool::new(false));
    let (done, over) = channel::<()>();
    let flag = stop.clone();
    let watch = move || {
        while let Err(RecvTimeoutError::Timeout) = over.recv_timeout(TICK) {
            if task.is_cancelled() || processor_seconds() - start >= seconds {
                flag.store(true, Ordering::Relaxed);
                return;
            }
        }
    };
    let out = std::thread::scope(|s| {
        s.spawn(watch);
        let out = work(&task.clone().with_cancel(stop));
        drop(done);
        out
    });
    (out, processor_seconds() - start)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    /// Takes processor time until it is stopped, or for `limit` of the wall's.
    fn work(task: &Task, limit: Duration) -> bool {
        let start = Instant::now();
        while start.elapsed() < limit {
            if task.is_cancelled() {
                return true;
            }
        }
        false
    }

    #[test]
    fn work_is_stopped_by_processor_time_and_sleep_is_not() {
        let long = Duration::from_secs(60);
        let (stopped, seconds) = within(&Task::quiet(), 0.05, |t| work(t, long));
        assert!(stopped && seconds >= 0.05, "{seconds}");
        let idle = within(&Task::quiet(), 1e9, |t| {
            std::thread::sleep(Duration::from_millis(20));
            t.is_cancelled()
        });
        assert!(!idle.0);
    }

    #[test]
    fn whoever_stops_the_task_stops_the_work() {
        let task = Task::quiet().with_deadline(Instant::now());
        assert!(within(&task, 1e9, |t| work(t, Duration::from_secs(60))).0);
    }
}
