//! Threads that work on the newest of what they are asked for.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long work that is worth having for itself is protected from newer requests.
const PATIENCE: Duration = Duration::from_secs(1);

/// A place for one request: a newer one takes the place of one that nobody has begun, and stops the one that
/// is being worked on.
pub struct Desk<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

struct State<T> {
    wanted: Option<T>,
    cancel: Arc<AtomicBool>,
    busy: bool,
    closed: bool,
    /// Until when newer requests let the work under way go on.
    protected: Option<Instant>,
}

impl<T> Desk<T> {
    /// An empty place.
    pub fn new() -> Self {
        let state =
            State { wanted: None, cancel: Arc::default(), busy: false, closed: false, protected: None };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks for `t` in place of everything before.
    pub fn ask(&self, t: T) {
        let mut s = self.state();
        if s.protected.is_none_or(|until| Instant::now() >= until) {
            s.cancel.store(true, Ordering::Relaxed);
        }
        s.wanted = Some(t);
        self.changed.notify_all();
    }

    /// Asks for `t` once the work under way is done.
    pub fn ask_next(&self, t: T) {
        self.state().wanted = Some(t);
        self.changed.notify_all();
    }

    /// Newer requests no longer let the work under way go on; stops it where one waits.
    pub fn release(&self) {
        let mut s = self.state();
        s.protected = None;
        if s.wanted.is_some() {
            s.cancel.store(true, Ordering::Relaxed);
        }
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

    /// [`Desk::next`] whose beginning is worth having for itself, as a preview is: newer requests stop it
    /// only after [`Desk::release`], or a second.
    pub fn next_protected(&self) -> Option<(T, Arc<AtomicBool>)> {
        let next = self.next();
        self.state().protected = Some(Instant::now() + PATIENCE);
        next
    }

    /// Waits for a request; its flag becomes true when it is no longer wanted. `None` when the place is
    /// closed.
    pub fn next(&self) -> Option<(T, Arc<AtomicBool>)> {
        let mut s = self.state();
        (s.busy, s.protected) = (false, None);
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

    #[test]
    fn what_begins_protected_is_not_stopped_before_it_is_released() {
        let desk = Desk::new();
        desk.ask(1);
        let (_, stopped) = desk.next_protected().expect("open");
        desk.ask(2);
        assert!(!stopped.load(Ordering::Relaxed));
        desk.release();
        assert!(stopped.load(Ordering::Relaxed));
        let (second, stopped) = desk.next_protected().expect("open");
        desk.release();
        assert!(second == 2 && !stopped.load(Ordering::Relaxed));
        desk.ask(3);
        assert!(stopped.load(Ordering::Relaxed));
    }
}
