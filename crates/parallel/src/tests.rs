use super::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Pools of one thread and of more give the same.
fn on_threads(f: impl Fn() + Send + Sync) {
    for n in [1, 2, 5] {
        rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads").install(&f);
    }
}

#[test]
fn results_come_in_order() {
    on_threads(|| {
        for n in [0, 1, 2, 7, 1000] {
            let squares: Vec<usize> = (0..n).into_par_iter().map(|k| k * k).collect();
            assert_eq!(squares, (0..n).map(|k| k * k).collect::<Vec<_>>());
            let last_first: Vec<usize> = squares.par_iter().rev().with_min_len(3).map(|s| *s).collect();
            assert!(last_first.iter().rev().eq(&squares));
            let numbers: Vec<(usize, usize)> =
                squares.par_iter().enumerate().with_max_len(1).map(|(k, s)| (k, *s)).collect();
            assert!(numbers.iter().enumerate().all(|(k, f)| *f == (k, k * k)) && numbers.len() == n);
            let owned: Vec<String> = squares.iter().map(|s| s.to_string()).collect();
            let lengths: Vec<usize> = owned.clone().into_par_iter().map(|s| s.len()).collect();
            assert!(lengths.iter().zip(&owned).all(|(l, s)| *l == s.len()) && lengths.len() == n);
            let many: Vec<usize> = (0..n).into_par_iter().flat_map_iter(|k| [k; 2]).collect();
            assert_eq!(many, (0..2 * n).map(|k| k / 2).collect::<Vec<_>>());
            let (a, b): (Vec<usize>, Vec<usize>) = (0..n).into_par_iter().map(|k| (k, 2 * k)).unzip();
            assert!(a.iter().zip(&b).all(|(a, b)| 2 * a == *b) && a.len() == n);
            assert_eq!(squares.par_iter().copied_sum(), squares.iter().sum::<usize>());
            assert_eq!((0..n).into_par_iter().max(), n.checked_sub(1));
        }
        assert_eq!((2..=4u32).into_par_iter().map(u64::from).collect::<Vec<_>>(), [2, 3, 4]);
    });
}

/// For the test above: sums of references.
trait CopiedSum {
    fn copied_sum(self) -> usize;
}

impl CopiedSum for super::Par<super::Slice<'_, usize>> {
    fn copied_sum(self) -> usize {
        self.map(|x| *x).sum()
    }
}

#[test]
fn chunks_are_all_of_a_slice_once() {
    on_threads(|| {
        for (n, size) in [(0, 3), (1, 3), (9, 3), (10, 3), (1000, 7)] {
            let (mut x, weights) = (vec![0; n], vec![2; n]);
            x.par_chunks_mut(size).zip(weights.par_chunks(size)).enumerate().for_each(|(k, (x, w))| {
                assert!(x.len() == w.len());
                x.iter_mut().zip(w).for_each(|(x, w)| *x += w * (k + 1));
            });
            assert!(x.iter().enumerate().all(|(i, x)| *x == 2 * (i / size + 1)));
            x.par_chunks_exact_mut(size).for_each(|x| x.fill(0));
            assert_eq!(x.iter().filter(|x| **x == 0).count(), n / size * size);
            assert_eq!(x.par_chunks_exact(size).map(|x| x.len()).collect::<Vec<_>>(), vec![size; n / size]);
            x.par_iter_mut().zip(&weights).for_each(|(x, w)| *x = *w);
            assert_eq!(x, weights);
        }
    });
}

#[test]
fn the_first_failure_ends_a_loop() {
    on_threads(|| {
        let begun = AtomicUsize::new(0);
        let tried = |k: usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            if k == 10 { Err(k) } else { Ok(k) }
        };
        let all: Result<Vec<usize>, usize> = (0..100_000usize).into_par_iter().map(tried).collect();
        assert_eq!(all, Err(10));
        assert!(begun.load(Ordering::Relaxed) < 100_000);
        assert_eq!((0..1000usize).into_par_iter().try_for_each(|k| tried(k).map(|_| ())), Err(10));
        assert_eq!(
            (0..10usize).into_par_iter().map(tried).collect::<Result<Vec<_>, _>>(),
            Ok((0..10).collect::<Vec<_>>())
        );
        assert_eq!(
            (0..9usize).into_par_iter().map(|k| (k < 8).then_some(k)).collect::<Option<Vec<_>>>(),
            None
        );
    });
}

#[test]
fn what_is_made_is_used_for_many_items() {
    let made = AtomicUsize::new(0);
    let init = || {
        made.fetch_add(1, Ordering::Relaxed);
        Vec::new()
    };
    let counts: Vec<usize> = (0..10_000usize)
        .into_par_iter()
        .map_init(init, |seen: &mut Vec<usize>, k| {
            seen.push(k);
            k
        })
        .collect();
    assert!(counts.iter().enumerate().all(|(i, k)| i == *k));
    (0..10_000usize).into_par_iter().for_each_init(init, |seen, k| seen.push(k));
    assert!(made.load(Ordering::Relaxed) < 5000);
}
