//! Memory that workers leave for the next.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// Buffers that nobody uses at the moment.
#[derive(Default)]
pub(super) struct Pool<B: Default>(Mutex<Vec<B>>);

/// A buffer on loan.
pub(super) struct Lent<'a, B: Default> {
    pool: &'a Pool<B>,
    buffer: B,
}

impl<B: Default> Pool<B> {
    /// One that was used before, or a new one.
    pub(super) fn lend(&self) -> Lent<'_, B> {
        let buffer = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
        Lent { pool: self, buffer }
    }
}

impl<B: Default> Deref for Lent<'_, B> {
    type Target = B;
    fn deref(&self) -> &B {
        &self.buffer
    }
}

impl<B: Default> DerefMut for Lent<'_, B> {
    fn deref_mut(&mut self) -> &mut B {
        &mut self.buffer
    }
}

impl<B: Default> Drop for Lent<'_, B> {
    fn drop(&mut self) {
        let buffer = std::mem::take(&mut self.buffer);
        self.pool.0.lock().unwrap_or_else(PoisonError::into_inner).push(buffer);
    }
}
