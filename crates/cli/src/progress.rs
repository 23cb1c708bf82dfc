//! Bars on a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Mutex;
use steradian_base::Progress;

/// One bar at a time on standard error; over a batch one bar for all of it.
pub struct Bars {
    target: fn() -> ProgressDrawTarget,
    shown: Mutex<Current>,
}

#[derive(Default)]
struct Current {
    bar: Option<ProgressBar>,
    /// What is being made of a batch.
    batch: Option<String>,
}

impl Bars {
    /// No bar yet.
    pub fn new() -> Self {
        Self { target: || ProgressDrawTarget::stderr_with_hz(8), shown: Mutex::default() }
    }

    /// One bar over `outputs` outputs.
    pub fn begin_batch(&self, outputs: u64) {
        self.begin("", outputs);
        self.with(|shown| shown.batch = Some(String::new()));
    }

    /// The next output of the batch begins.
    pub fn next_of_batch(&self, name: &str, done: u64) {
        self.with(|shown| {
            shown.batch = Some(name.into());
            if let Some(bar) = &shown.bar {
                bar.set_message(name.to_string());
                bar.set_position(done);
            }
        });
    }

    /// The batch ends: its bar stays, full.
    pub fn end_batch(&self) {
        self.with(|shown| {
            shown.batch = None;
            if let Some(bar) = shown.bar.take() {
                bar.set_message("");
                bar.finish();
            }
        });
    }

    /// Does what writes lines, with the bar out of their way.
    pub fn beside<R>(&self, write: impl FnOnce() -> R) -> R {
        let mut bar = None;
        self.with(|shown| bar.clone_from(&shown.bar));
        match bar {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }

    fn with(&self, f: impl FnOnce(&mut Current)) {
        // A worker that panicked while drawing leaves nothing that matters half done.
        f(&mut self.shown.lock().unwrap_or_else(std::sync::PoisonError::into_inner));
    }
}

impl Progress for Bars {
    fn begin(&self, label: &str, total: u64) {
        self.with(|shown| {
            if let (Some(name), Some(bar)) = (&shown.batch, &shown.bar) {
                // A stage of an output.
                bar.set_message(format!("{name}: {label}"));
                return;
            }
            let bar = ProgressBar::with_draw_target((total > 0).then_some(total), (self.target)());
            if let Ok(style) = ProgressStyle::with_template("{msg:>12} {wide_bar} {pos}/{len} {eta}") {
                bar.set_style(style);
            }
            bar.set_message(label.to_string());
            if let Some(old) = shown.bar.replace(bar) {
                old.finish_and_clear();
            }
        });
    }

    fn advance(&self, steps: u64) {
        self.with(|shown| {
            if let (None, Some(bar)) = (&shown.batch, &shown.bar) {
                // A stage may turn out longer than was thought: a bar never passes its end.
                let most = bar.length().unwrap_or(u64::MAX);
                bar.set_position((bar.position() + steps).min(most));
            }
        });
    }

    fn end(&self) {
        self.with(|shown| {
            if shown.batch.is_none()
                && let Some(bar) = shown.bar.take()
            {
                bar.finish_and_clear();
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stages of an output neither start bars of their own nor end the batch's.
    #[test]
    fn a_batch_has_one_bar() {
        let bars = Bars { target: ProgressDrawTarget::hidden, ..Bars::new() };
        bars.begin_batch(3);
        let state = || {
            let mut out = None;
            bars.with(|s| out = s.bar.as_ref().map(|b| (b.length(), b.position(), b.message())));
            out
        };
        for (k, name) in ["a", "b", "c"].into_iter().enumerate() {
            bars.next_of_batch(name, k as u64);
            bars.begin("filter", 100);
            bars.advance(60);
            assert_eq!(state(), Some((Some(3), k as u64, format!("{name}: filter"))));
            bars.end();
        }
        let mut bar = None;
        bars.with(|s| bar.clone_from(&s.bar));
        assert_eq!(bars.beside(|| 7), 7);
        bars.end_batch();
        assert_eq!(bar.map(|b| (b.position(), b.is_finished())), Some((3, true)));
        assert_eq!(state(), None);
        assert_eq!(bars.beside(|| 7), 7);
        bars.begin("render", 10);
        bars.advance(50);
        assert_eq!(state(), Some((Some(10), 10, "render".into())));
        bars.end();
    }
}
