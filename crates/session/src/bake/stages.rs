//! Time of each stage of a bake, recorded in addition to the caller's own progress reports.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use steradian_base::Progress;

/// Stages in the order in which they first began, with their seconds.
type Times = Vec<(String, f64)>;

/// Records stages and passes them on.
pub struct Stages {
    start: Instant,
    next: Option<Arc<dyn Progress>>,
    state: Mutex<(Times, Option<(String, Instant)>)>,
}

impl Stages {
    /// No stage yet.
    pub fn new(next: Option<Arc<dyn Progress>>) -> Self {
        Self { start: Instant::now(), next, state: Mutex::default() }
    }

    /// Ends the running stage and begins `next`.
    fn turn(&self, next: Option<&str>) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((name, start)) = state.1.take() {
            let seconds = start.elapsed().as_secs_f64();
            match state.0.iter_mut().find(|(n, _)| *n == name) {
                Some((_, sum)) => *sum += seconds,
                None => state.0.push((name, seconds)),
            }
        }
        state.1 = next.map(|n| (n.to_string(), Instant::now()));
    }

    /// The seconds since this was made, and the stages that they were spent in; the last is what no stage
    /// names.
    pub fn finish(&self) -> (f64, Times) {
        self.turn(None);
        let all = self.start.elapsed().as_secs_f64();
        let mut times = self.state.lock().unwrap_or_else(PoisonError::into_inner).0.clone();
        let named: f64 = times.iter().map(|t| t.1).sum();
        times.push(("other".into(), (all - named).max(0.0)));
        (all, times)
    }
}

impl Progress for Stages {
    fn begin(&self, label: &str, total: u64) {
        self.turn(Some(label));
        if let Some(b) = &self.next {
            b.begin(label, total);
        }
    }

    fn advance(&self, steps: u64) {
        if let Some(b) = &self.next {
            b.advance(steps);
        }
    }

    fn end(&self) {
        self.turn(None);
        if let Some(b) = &self.next {
            b.end();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_of_one_name_add_up_in_the_order_of_their_beginnings() {
        let s = Stages::new(None);
        for label in ["light", "prefilter", "light"] {
            s.begin(label, 0);
            s.advance(1);
            s.end();
        }
        s.begin("certificate", 0);
        let (all, stages) = s.finish();
        let names: Vec<&str> = stages.iter().map(|t| t.0.as_str()).collect();
        assert_eq!(names, ["light", "prefilter", "certificate", "other"]);
        assert!((stages.iter().map(|t| t.1).sum::<f64>() - all).abs() < 1e-9);
    }
}
