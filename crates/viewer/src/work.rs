//! Threads that work on the newest of what they are asked for.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// A place for one request: a newer one takes the place of one that nobody has begun, and stops the one that is being
/// worked on.
pub struct Desk<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

struct State<T> {
    wanted: Option<T>,
    cancel: Arc<AtomicBool>,
    busy: bool,
    closed: bool,
}

impl<T> Desk<T> {
    /// An empty place.
    pub fn new() -> Self {
        let state = State { wanted: None, cancel: Arc::default(), busy: false, closed: false };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks for `t` in place of everything before.
    pub fn ask(&self, t: T) {
        let mut s = self.state();
        s.cancel.store(true, Ordering::Relaxed);
        s.wanted = Some(t);
        self.changed.notify_all();
    }

    /// Asks for `t` once the work under way is done.
    pub fn ask_next(&self, t: T) {
        self.state().wanted = Some(t);
        self.changed.notify_all();
    }

    /// Stops what is being worked on and drops what is waiting.
    pub fn cancel(&self) {
        let mut s = self.state();
        s.cancel.store(true, Ordering::Relaxed);
        s.wanted = None;
    }

    /// Is anything waiting or being worked on?
    pub fn is_busy(&self) -> bool {
        let s = self.state();
        s.busy || s.wanted.is_some()
    }

    /// Ends the worker.
    pub fn close(&self) {
        let mut s = self.state();
        s.closed = true;
        s.cancel.store(true, Ordering::Relaxed);
        self.changed.notify_all();
    }

    /// Waits for a request; its flag becomes true when it is no longer wanted. `None` when the place is closed.
    pub fn next(&self) -> Option<(T, Arc<AtomicBool>)> {
        let mut s = self.state();
        s.busy = false;
        loop {
            if s.closed {
                return None;
            }
            if let Some(t) = s.wanted.take() {
                s.cancel = Arc::default();
                s.busy = true;
                return Some((t, s.cancel.clone()));
            }
            s = self.changed.wait(s).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_request_is_worked_on_and_stops_the_one_before() {
        let desk = Desk::new();
        desk.ask(1);
        desk.ask(2);
        let (first, stopped) = desk.next().expect("open");
        assert_eq!((first, stopped.load(Ordering::Relaxed), desk.is_busy()), (2, false, true));
        desk.ask_next(3);
        assert!(!stopped.load(Ordering::Relaxed));
        desk.ask(4);
        assert!(stopped.load(Ordering::Relaxed));
        assert_eq!(desk.next().map(|n| n.0), Some(4));
        desk.close();
        assert!(desk.next().is_none());
    }
}
