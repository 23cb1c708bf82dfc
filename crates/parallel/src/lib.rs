//! Loops over all cores, with the names of rayon's parallel iterators and rayon's threads.
//!
//! rayon compiles its splitting and stealing anew for every loop, in every crate that instantiates it: some
//! 7000 lines of LLVM's code each, which was a fifth to a third of the code of most crates. Here a loop is
//! cut into blocks by generic code of a few lines, and what runs the blocks is compiled once ([`run`]).
//! Results come in the order of their items, whatever thread computes them.

mod adaptors;
mod sources;

pub use adaptors::{Enumerate, FlatMapIter, Map, MapInit, Rev, Zip};
pub use sources::{Chunks, ChunksExact, ChunksExactMut, ChunksMut, Items, Range, Slice, SliceMut};

use rayon::prelude::{IndexedParallelIterator, IntoParallelIterator as _, ParallelIterator};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// What loops need in scope.
pub mod prelude {
    pub use crate::sources::{
        IntoParallelIterator, IntoParallelRefIterator, IntoParallelRefMutIterator, ParallelSlice,
        ParallelSliceMut,
    };
}

/// Blocks per thread: enough that threads end together where items cost differently, few enough to cost
/// nothing.
const BLOCKS: usize = 16;

/// Items that a loop goes over, which can be cut in two.
pub trait Source: Send + Sized {
    /// What the loop sees.
    type Item;
    /// The items one after the other.
    type Iter: Iterator<Item = Self::Item>;
    /// How many there are.
    fn len(&self) -> usize;
    /// Are there none?
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The first `at`, and the others.
    fn split(self, at: usize) -> (Self, Self);
    /// One after the other.
    fn iter(self) -> Self::Iter;
}

/// A loop over all cores that waits for what it is to do with its items.
#[must_use = "a loop does nothing until it is told what to do with its items"]
pub struct Par<S> {
    source: S,
    least: usize,
    most: usize,
}

/// Runs `work` for 0 … count − 1 on the threads of the pool in use.
pub fn run(count: usize, work: &(dyn Fn(usize) + Sync)) {
    if count <= 1 || rayon::current_num_threads() == 1 {
        (0..count).for_each(work);
    } else {
        (0..count).into_par_iter().with_max_len(1).for_each(work);
    }
}

impl<S: Source> Par<S> {
    /// Of a source.
    pub fn new(source: S) -> Self {
        Self { source, least: 1, most: usize::MAX }
    }

    fn over<T>(self, of: impl FnOnce(S) -> T) -> Par<T> {
        Par { source: of(self.source), least: self.least, most: self.most }
    }

    /// A thread gets so many items at a time or more.
    pub fn with_min_len(self, least: usize) -> Self {
        Self { least: least.max(1), ..self }
    }

    /// A thread gets so many items at a time or less.
    pub fn with_max_len(self, most: usize) -> Self {
        Self { most: most.max(1), ..self }
    }

    /// Of each item its image.
    pub fn map<R, F: Fn(S::Item) -> R + Send + Sync>(self, f: F) -> Par<Map<S, F>> {
        self.over(|s| Map::new(s, f))
    }

    /// Of each item its image, with something that `init` makes now and then.
    pub fn map_init<W, R, I, F>(self, init: I, f: F) -> Par<MapInit<S, I, F>>
    where
        I: Fn() -> W + Send + Sync,
        F: Fn(&mut W, S::Item) -> R + Send + Sync,
    {
        self.over(|s| MapInit::new(s, init, f))
    }

    /// Of each item many.
    pub fn flat_map_iter<R: IntoIterator, F: Fn(S::Item) -> R + Send + Sync>(
        self,
        f: F,
    ) -> Par<FlatMapIter<S, F>> {
        self.over(|s| FlatMapIter::new(s, f))
    }

    /// Items with their numbers.
    pub fn enumerate(self) -> Par<Enumerate<S>> {
        self.over(|s| Enumerate::new(s))
    }

    /// The last first.
    pub fn rev(self) -> Par<Rev<S>>
    where
        S::Iter: DoubleEndedIterator,
    {
        self.over(Rev::new)
    }

    /// Pairs, as many as the shorter has.
    pub fn zip<B: prelude::IntoParallelIterator>(self, other: B) -> Par<Zip<S, B::Source>> {
        let other = other.into_par_iter();
        let (least, most) = (self.least.max(other.least), self.most.min(other.most));
        Par { source: Zip::new(self.source, other.source), least, most }
    }

    /// What `consume` makes of each block, in order.
    fn blocks<R: Send>(self, consume: impl Fn(S::Iter) -> R + Sync) -> Vec<R> {
        let n = self.source.len();
        let count = (n / self.least).min(BLOCKS * rayon::current_num_threads());
        let count = count.max(n.div_ceil(self.most)).clamp(1, n.max(1));
        let (mut rest, mut places) = (self.source, Vec::with_capacity(count));
        for k in 0..count - 1 {
            let (block, others) = rest.split((k + 1) * n / count - k * n / count);
            places.push(Mutex::new((Some(block), None)));
            rest = others;
        }
        places.push(Mutex::new((Some(rest), None)));
        run(count, &|k| {
            let block = places[k].lock().unwrap_or_else(PoisonError::into_inner).0.take();
            let result = block.map(|block| consume(block.iter()));
            places[k].lock().unwrap_or_else(PoisonError::into_inner).1 = result;
        });
        // Not collected by an iterator, which would bring the machinery of collecting in place to every loop.
        let mut results = Vec::with_capacity(count);
        for place in places {
            if let Some(result) = place.into_inner().unwrap_or_else(PoisonError::into_inner).1 {
                results.push(result);
            }
        }
        results
    }

    /// Does something with each item.
    pub fn for_each(self, f: impl Fn(S::Item) + Sync) {
        self.blocks(|items| items.for_each(&f));
    }

    /// Does something with each item, and with something that `init` makes now and then.
    pub fn for_each_init<W>(self, init: impl Fn() -> W + Sync, f: impl Fn(&mut W, S::Item) + Sync) {
        self.blocks(|items| {
            let mut with = init();
            items.for_each(|x| f(&mut with, x));
        });
    }

    /// Does something with each item, until that fails; the first failure by order.
    pub fn try_for_each<E: Send>(self, f: impl Fn(S::Item) -> Result<(), E> + Sync) -> Result<(), E> {
        let failed = AtomicBool::new(false);
        let done = self.blocks(|items| until_failed(items.map(&f), &failed, |()| {}));
        done.into_iter().collect()
    }

    /// All, in order.
    pub fn collect<C: FromItems<S::Item>>(self) -> C
    where
        S::Item: Send,
    {
        C::from_items(self)
    }

    /// The sum of exact numbers; those of floating point depend on where blocks end, and are better collected
    /// first.
    pub fn sum<T: Send + std::iter::Sum<S::Item> + std::iter::Sum<T>>(self) -> T {
        self.blocks(|items| items.sum::<T>()).into_iter().sum()
    }

    /// The largest.
    pub fn max(self) -> Option<S::Item>
    where
        S::Item: Ord + Send,
    {
        self.blocks(Iterator::max).into_iter().flatten().max()
    }

    /// Both parts of all pairs.
    pub fn unzip<A: Send, B: Send>(self) -> (Vec<A>, Vec<B>)
    where
        S: Source<Item = (A, B)>,
    {
        joined(self.blocks(|items| items.collect::<Vec<_>>())).into_iter().unzip()
    }
}

/// Takes items while none has failed, here or elsewhere.
fn until_failed<T, E>(
    mut items: impl Iterator<Item = Result<T, E>>,
    failed: &AtomicBool,
    mut take: impl FnMut(T),
) -> Result<(), E> {
    while !failed.load(Ordering::Relaxed) {
        match items.next() {
            None => break,
            Some(Ok(x)) => take(x),
            Some(Err(e)) => {
                failed.store(true, Ordering::Relaxed);
                return Err(e);
            }
        }
    }
    Ok(())
}

fn joined<T>(mut blocks: Vec<Vec<T>>) -> Vec<T> {
    if blocks.len() == 1 {
        return blocks.pop().unwrap_or_default();
    }
    let mut out = Vec::with_capacity(blocks.iter().map(Vec::len).sum());
    blocks.iter_mut().for_each(|block| out.append(block));
    out
}

/// What items can be collected into.
pub trait FromItems<T>: Sized {
    /// Of a loop's items.
    fn from_items<S: Source<Item = T>>(items: Par<S>) -> Self;
}

impl<T: Send> FromItems<T> for Vec<T> {
    fn from_items<S: Source<Item = T>>(items: Par<S>) -> Self {
        joined(items.blocks(|items| items.collect()))
    }
}

impl<T: Send, E: Send> FromItems<Result<T, E>> for Result<Vec<T>, E> {
    fn from_items<S: Source<Item = Result<T, E>>>(items: Par<S>) -> Self {
        let failed = AtomicBool::new(false);
        let blocks = items.blocks(|items| {
            let mut out = Vec::with_capacity(items.size_hint().0);
            until_failed(items, &failed, |x| out.push(x)).map(|()| out)
        });
        blocks.into_iter().collect::<Result<Vec<_>, E>>().map(joined)
    }
}

impl<T: Send> FromItems<Option<T>> for Option<Vec<T>> {
    fn from_items<S: Source<Item = Option<T>>>(items: Par<S>) -> Self {
        items.blocks(|items| items.collect::<Option<Vec<T>>>()).into_iter().collect::<Option<_>>().map(joined)
    }
}

#[cfg(test)]
mod tests;
