//! What loops make of their items on the way.

use crate::Source;
use std::sync::Arc;

/// Of each item its image.
pub struct Map<S, F> {
    source: S,
    f: Arc<F>,
}

impl<S, F> Map<S, F> {
    pub(crate) fn new(source: S, f: F) -> Self {
        Self { source, f: Arc::new(f) }
    }
}

/// Images one after the other.
pub struct MapIter<I, F> {
    items: I,
    f: Arc<F>,
}

impl<R, I: Iterator, F: Fn(I::Item) -> R> Iterator for MapIter<I, F> {
    type Item = R;

    #[inline]
    fn next(&mut self) -> Option<R> {
        self.items.next().map(&*self.f)
    }

    #[inline]
    fn size_hint(&self) -> (usize, Option<usize>) {
        self.items.size_hint()
    }

    #[inline]
    fn fold<B, G: FnMut(B, R) -> B>(self, start: B, mut g: G) -> B {
        let f = &*self.f;
        self.items.fold(start, |acc, x| g(acc, f(x)))
    }
}

impl<S: Source, R, F: Fn(S::Item) -> R + Send + Sync> Source for Map<S, F> {
    type Item = R;
    type Iter = MapIter<S::Iter, F>;

    fn len(&self) -> usize {
        self.source.len()
    }

    fn split(self, at: usize) -> (Self, Self) {
        let (a, b) = self.source.split(at);
        (Self { source: a, f: self.f.clone() }, Self { source: b, f: self.f })
    }

    fn iter(self) -> Self::Iter {
        MapIter { items: self.source.iter(), f: self.f }
    }
}

/// Of each item its image, with something that is made once a block.
pub struct MapInit<S, I, F> {
    source: S,
    with: Arc<(I, F)>,
}

impl<S, I, F> MapInit<S, I, F> {
    pub(crate) fn new(source: S, init: I, f: F) -> Self {
        Self { source, with: Arc::new((init, f)) }
    }
}

/// Images one after the other, with what was made for them.
pub struct MapInitIter<T, W, I, F> {
    items: T,
    made: W,
    with: Arc<(I, F)>,
}

impl<T: Iterator, W, R, I, F: Fn(&mut W, T::Item) -> R> Iterator for MapInitIter<T, W, I, F> {
    type Item = R;

    #[inline]
    fn next(&mut self) -> Option<R> {
        self.items.next().map(|x| self.with.1(&mut self.made, x))
    }

    #[inline]
    fn size_hint(&self) -> (usize, Option<usize>) {
        self.items.size_hint()
    }
}

impl<S: Source, W, R, I, F> Source for MapInit<S, I, F>
where
    I: Fn() -> W + Send + Sync,
    F: Fn(&mut W, S::Item) -> R + Send + Sync,
{
    type Item = R;
    type Iter = MapInitIter<S::Iter, W, I, F>;

    fn len(&self) -> usize {
        self.source.len()
    }

    fn split(self, at: usize) -> (Self, Self) {
        let (a, b) = self.source.split(at);
        (Self { source: a, with: self.with.clone() }, Self { source: b, with: self.with })
    }

    fn iter(self) -> Self::Iter {
        MapInitIter { items: self.source.iter(), made: self.with.0(), with: self.with }
    }
}

/// Of each item many.
pub struct FlatMapIter<S, F> {
    source: S,
    f: Arc<F>,
}

impl<S, F> FlatMapIter<S, F> {
    pub(crate) fn new(source: S, f: F) -> Self {
        Self { source, f: Arc::new(f) }
    }
}

/// The many one after the other.
pub struct FlatIter<I, R: IntoIterator, F> {
    items: I,
    now: Option<R::IntoIter>,
    f: Arc<F>,
}

impl<I: Iterator, R: IntoIterator, F: Fn(I::Item) -> R> Iterator for FlatIter<I, R, F> {
    type Item = R::Item;

    fn next(&mut self) -> Option<R::Item> {
        loop {
            if let Some(x) = self.now.as_mut().and_then(Iterator::next) {
                return Some(x);
            }
            self.now = Some((self.f)(self.items.next()?).into_iter());
        }
    }
}

impl<S: Source, R: IntoIterator, F: Fn(S::Item) -> R + Send + Sync> Source for FlatMapIter<S, F> {
    type Item = R::Item;
    type Iter = FlatIter<S::Iter, R, F>;

    fn len(&self) -> usize {
        self.source.len()
    }

    fn split(self, at: usize) -> (Self, Self) {
        let (a, b) = self.source.split(at);
        (Self { source: a, f: self.f.clone() }, Self { source: b, f: self.f })
    }

    fn iter(self) -> Self::Iter {
        FlatIter { items: self.source.iter(), now: None, f: self.f }
    }
}

/// Items with their numbers.
pub struct Enumerate<S> {
    source: S,
    first: usize,
}

impl<S> Enumerate<S> {
    pub(crate) fn new(source: S) -> Self {
        Self { source, first: 0 }
    }
}

impl<S: Source> Source for Enumerate<S> {
    type Item = (usize, S::Item);
    type Iter = std::iter::Zip<std::ops::RangeFrom<usize>, S::Iter>;

    fn len(&self) -> usize {
        self.source.len()
    }

    fn split(self, at: usize) -> (Self, Self) {
        let (a, b) = self.source.split(at);
        (Self { source: a, first: self.first }, Self { source: b, first: self.first + at })
    }

    fn iter(self) -> Self::Iter {
        (self.first..).zip(self.source.iter())
    }
}

/// The last first.
pub struct Rev<S>(S);

impl<S> Rev<S> {
    pub(crate) fn new(source: S) -> Self {
        Self(source)
    }
}

impl<S: Source<Iter: DoubleEndedIterator>> Source for Rev<S> {
    type Item = S::Item;
    type Iter = std::iter::Rev<S::Iter>;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn split(self, at: usize) -> (Self, Self) {
        let n = self.0.len();
        let (a, b) = self.0.split(n - at);
        (Self(b), Self(a))
    }

    fn iter(self) -> Self::Iter {
        self.0.iter().rev()
    }
}

/// Pairs.
pub struct Zip<A, B> {
    a: A,
    b: B,
}

impl<A: Source, B: Source> Zip<A, B> {
    pub(crate) fn new(a: A, b: B) -> Self {
        let n = a.len().min(b.len());
        Self { a: a.split(n).0, b: b.split(n).0 }
    }
}

impl<A: Source, B: Source> Source for Zip<A, B> {
    type Item = (A::Item, B::Item);
    type Iter = std::iter::Zip<A::Iter, B::Iter>;

    fn len(&self) -> usize {
        self.a.len()
    }

    fn split(self, at: usize) -> (Self, Self) {
        let ((a, c), (b, d)) = (self.a.split(at), self.b.split(at));
        (Self { a, b }, Self { a: c, b: d })
    }

    fn iter(self) -> Self::Iter {
        self.a.iter().zip(self.b.iter())
    }
}
