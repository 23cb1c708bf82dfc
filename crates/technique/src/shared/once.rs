//! Data that only some pictures need, made on first use.

use std::sync::OnceLock;

/// The value of `cell`, made by `make` where it is missing. Safe within a parallel loop in which several
/// threads call it at once: `make` runs on threads of its own, so that it never waits for a thread that waits
/// here, and a thread that waits here does not pick up another piece of the loop, which could call it again.
pub fn get<R: Send + Sync>(cell: &OnceLock<R>, make: impl FnOnce() -> R + Send) -> &R {
    cell.get_or_init(|| {
        let alone = || match rayon::ThreadPoolBuilder::new().build() {
            Ok(pool) => pool.install(make),
            Err(_) => make(),
        };
        match std::thread::scope(|s| s.spawn(alone).join()) {
            Ok(made) => made,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_parallel::prelude::*;

    #[test]
    fn a_parallel_loop_may_ask_for_what_a_parallel_loop_makes() {
        let cell = OnceLock::new();
        let make = || (0..100_000u64).into_par_iter().map(|x| x % 7).sum::<u64>();
        let all: Vec<u64> = (0..64usize).into_par_iter().map(|_| *get(&cell, make)).collect();
        assert!(all.iter().all(|s| *s == make()));
    }
}
