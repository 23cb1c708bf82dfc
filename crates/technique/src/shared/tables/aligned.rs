//! Numbers that begin where a cache line does: a register of AVX-512 is as wide as one, and a load across two
//! takes twice the time of a load of one.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line.
const LINE: usize = 64;

/// Numbers whose first lies at the beginning of a cache line.
#[derive(Debug)]
pub struct Aligned<T> {
    all: Vec<T>,
    start: usize,
    len: usize,
}

impl<T: Copy + Default> Aligned<T> {
    /// `len` zeros.
    pub fn zeros(len: usize) -> Self {
        let spare = LINE / size_of::<T>();
        let all = vec![T::default(); len + spare];
        let start = all.as_ptr().align_offset(LINE).min(spare);
        Self { all, start, len }
    }
}

impl<T: Copy + Default> From<&[T]> for Aligned<T> {
    fn from(v: &[T]) -> Self {
        let mut out = Self::zeros(v.len());
        out.copy_from_slice(v);
        out
    }
}

impl<T: Copy + Default> FromIterator<T> for Aligned<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Self::from(&items.into_iter().collect::<Vec<T>>()[..])
    }
}

impl<T> Default for Aligned<T> {
    fn default() -> Self {
        Self { all: Vec::new(), start: 0, len: 0 }
    }
}

impl<T> Deref for Aligned<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.all[self.start..self.start + self.len]
    }
}

impl<T> DerefMut for Aligned<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.all[self.start..self.start + self.len]
    }
}

/// A copy begins at a line too, which copied numbers alone would not.
impl<T: Copy + Default> Clone for Aligned<T> {
    fn clone(&self) -> Self {
        Self::from(&**self)
    }
}

impl<T: PartialEq> PartialEq for Aligned<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_begin_at_a_line() {
        let a: Aligned<u16> = (0..1000).collect();
        let b = a.clone();
        assert!((a.as_ptr() as usize).is_multiple_of(LINE) && (b.as_ptr() as usize).is_multiple_of(LINE));
        assert_eq!((a.len(), a[999], &a), (1000, 999, &b));
        assert!(Aligned::<f32>::default().is_empty());
    }
}
