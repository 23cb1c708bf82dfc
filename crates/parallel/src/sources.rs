//! What loops go over: ranges, vectors, slices and chunks of slices.

use crate::{Par, Source};
use std::ops::RangeInclusive;

/// What can be gone over.
pub trait IntoParallelIterator {
    /// Its items.
    type Source: Source<Item = Self::Item>;
    /// What a loop sees.
    type Item;
    /// A loop over the items.
    fn into_par_iter(self) -> Par<Self::Source>;
}

impl<S: Source> IntoParallelIterator for Par<S> {
    type Source = S;
    type Item = S::Item;

    fn into_par_iter(self) -> Par<S> {
        self
    }
}

/// What can be gone over by reference.
pub trait IntoParallelRefIterator {
    /// The type of items.
    type Item;
    /// A loop over references to the items.
    fn par_iter(&self) -> Par<Slice<'_, Self::Item>>;
}

/// What can be gone over and changed.
pub trait IntoParallelRefMutIterator {
    /// The type of items.
    type Item;
    /// A loop over the items, which may change them.
    fn par_iter_mut(&mut self) -> Par<SliceMut<'_, Self::Item>>;
}

/// A range of integers.
pub struct Range<T>(std::ops::Range<T>);

macro_rules! ranges {
    ($($t:ty),*) => {$(
        impl Source for Range<$t> {
            type Item = $t;
            type Iter = std::ops::Range<$t>;

            fn len(&self) -> usize {
                self.0.end.saturating_sub(self.0.start) as usize
            }

            fn split(self, at: usize) -> (Self, Self) {
                let middle = self.0.start + at as $t;
                (Self(self.0.start..middle), Self(middle..self.0.end))
            }

            fn iter(self) -> Self::Iter {
                self.0
            }
        }

        impl IntoParallelIterator for std::ops::Range<$t> {
            type Source = Range<$t>;
            type Item = $t;

            fn into_par_iter(self) -> Par<Range<$t>> {
                Par::new(Range(self))
            }
        }

        impl IntoParallelIterator for RangeInclusive<$t> {
            type Source = Range<$t>;
            type Item = $t;

            fn into_par_iter(self) -> Par<Range<$t>> {
                let (a, b) = self.into_inner();
                Par::new(Range(a..b + 1))
            }
        }
    )*};
}

ranges!(usize, u32, u64);

/// Items that are given away.
pub struct Items<T>(Vec<T>);

impl<T: Send> Source for Items<T> {
    type Item = T;
    type Iter = std::vec::IntoIter<T>;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn split(mut self, at: usize) -> (Self, Self) {
        let mut first: Vec<T> = Vec::with_capacity(at);
        first.extend(self.0.drain(..at));
        (Self(first), self)
    }

    fn iter(self) -> Self::Iter {
        self.0.into_iter()
    }
}

impl<T: Send> IntoParallelIterator for Vec<T> {
    type Source = Items<T>;
    type Item = T;

    fn into_par_iter(self) -> Par<Items<T>> {
        Par::new(Items(self))
    }
}

impl<T: Send, const N: usize> IntoParallelIterator for [T; N] {
    type Source = Items<T>;
    type Item = T;

    fn into_par_iter(self) -> Par<Items<T>> {
        Vec::from(self).into_par_iter()
    }
}

/// References to items.
pub struct Slice<'a, T>(&'a [T]);

impl<'a, T: Sync> Source for Slice<'a, T> {
    type Item = &'a T;
    type Iter = std::slice::Iter<'a, T>;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn split(self, at: usize) -> (Self, Self) {
        let (a, b) = self.0.split_at(at);
        (Self(a), Self(b))
    }

    fn iter(self) -> Self::Iter {
        self.0.iter()
    }
}

/// References to items that may be changed.
pub struct SliceMut<'a, T>(&'a mut [T]);

impl<'a, T: Send> Source for SliceMut<'a, T> {
    type Item = &'a mut T;
    type Iter = std::slice::IterMut<'a, T>;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn split(self, at: usize) -> (Self, Self) {
        let (a, b) = self.0.split_at_mut(at);
        (Self(a), Self(b))
    }

    fn iter(self) -> Self::Iter {
        self.0.iter_mut()
    }
}

macro_rules! references {
    ($([$($generic:tt)*] $t:ty),*) => {$(
        impl<'a, T: Sync, $($generic)*> IntoParallelIterator for &'a $t {
            type Source = Slice<'a, T>;
            type Item = &'a T;

            fn into_par_iter(self) -> Par<Slice<'a, T>> {
                Par::new(Slice(self))
            }
        }

        impl<'a, T: Send, $($generic)*> IntoParallelIterator for &'a mut $t {
            type Source = SliceMut<'a, T>;
            type Item = &'a mut T;

            fn into_par_iter(self) -> Par<SliceMut<'a, T>> {
                Par::new(SliceMut(self))
            }
        }
    )*};
}

references!([] [T], [] Vec<T>, [const N: usize] [T; N]);

impl<T: Sync> IntoParallelRefIterator for [T] {
    type Item = T;

    fn par_iter(&self) -> Par<Slice<'_, T>> {
        Par::new(Slice(self))
    }
}

impl<T: Send> IntoParallelRefMutIterator for [T] {
    type Item = T;

    fn par_iter_mut(&mut self) -> Par<SliceMut<'_, T>> {
        Par::new(SliceMut(self))
    }
}

macro_rules! chunks {
    ($(#[$doc:meta])* $name:ident, $iter:ident, $method:ident, $split:ident, $bound:ident, $count:expr, $($mutable:tt)?) => {
        $(#[$doc])*
        pub struct $name<'a, T> {
            items: &'a $($mutable)? [T],
            size: usize,
        }

        impl<'a, T: $bound> Source for $name<'a, T> {
            type Item = &'a $($mutable)? [T];
            type Iter = std::slice::$iter<'a, T>;

            fn len(&self) -> usize {
                let count: fn(usize, usize) -> usize = $count;
                count(self.items.len(), self.size)
            }

            fn split(self, at: usize) -> (Self, Self) {
                let size = self.size;
                let (a, b) = self.items.$split((at * size).min(self.items.len()));
                (Self { items: a, size }, Self { items: b, size })
            }

            fn iter(self) -> Self::Iter {
                self.items.$method(self.size)
            }
        }
    };
}

chunks!(
    /// Chunks; the last may be shorter.
    Chunks, Chunks, chunks, split_at, Sync, |n, size| n.div_ceil(size),
);
chunks!(
    /// Chunks of one size; what is left is left out.
    ChunksExact, ChunksExact, chunks_exact, split_at, Sync, |n, size| n / size,
);
chunks!(
    /// Chunks that may be changed; the last may be shorter.
    ChunksMut, ChunksMut, chunks_mut, split_at_mut, Send, |n, size| n.div_ceil(size), mut
);
chunks!(
    /// Chunks of one size that may be changed; what is left is left out.
    ChunksExactMut, ChunksExactMut, chunks_exact_mut, split_at_mut, Send, |n, size| n / size, mut
);

/// Chunks of slices.
pub trait ParallelSlice<T> {
    /// Chunks; the last may be shorter.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks(&self, size: usize) -> Par<Chunks<'_, T>>;

    /// Chunks of one size; what is left is left out.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks_exact(&self, size: usize) -> Par<ChunksExact<'_, T>>;
}

impl<T: Sync> ParallelSlice<T> for [T] {
    fn par_chunks(&self, size: usize) -> Par<Chunks<'_, T>> {
        assert!(size > 0, "chunks hold something");
        Par::new(Chunks { items: self, size })
    }

    fn par_chunks_exact(&self, size: usize) -> Par<ChunksExact<'_, T>> {
        assert!(size > 0, "chunks hold something");
        Par::new(ChunksExact { items: self, size })
    }
}

/// Chunks of slices that may be changed.
pub trait ParallelSliceMut<T> {
    /// Chunks; the last may be shorter.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks_mut(&mut self, size: usize) -> Par<ChunksMut<'_, T>>;

    /// Chunks of one size; what is left is left out.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks_exact_mut(&mut self, size: usize) -> Par<ChunksExactMut<'_, T>>;
}

impl<T: Send> ParallelSliceMut<T> for [T] {
    fn par_chunks_mut(&mut self, size: usize) -> Par<ChunksMut<'_, T>> {
        assert!(size > 0, "chunks hold something");
        Par::new(ChunksMut { items: self, size })
    }

    fn par_chunks_exact_mut(&mut self, size: usize) -> Par<ChunksExactMut<'_, T>> {
        assert!(size > 0, "chunks hold something");
        Par::new(ChunksExactMut { items: self, size })
    }
}
