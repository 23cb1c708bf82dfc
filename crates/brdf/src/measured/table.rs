//! A grid of measurements with counts of faulty values in the file.

use super::grid::Grid;
use super::tabulated::{Tabulated, Twin};
use crate::Info;
use crate::math::largest;
use glam::DVec3;

/// Counts of a file's values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    /// Measurements, or cells above the horizon.
    pub all: usize,
    /// Measurements or cells that are missing or cannot be used.
    pub missing: usize,
    /// Numbers that are negative.
    pub negative: usize,
}

/// Measurements on a grid.
#[derive(Debug, Clone)]
pub(super) struct Table {
    pub info: &'static Info,
    /// Notes about the counts, for users.
    pub notes: fn(&Self) -> Vec<String>,
    pub counts: Counts,
    pub grid: Grid,
}

impl Table {
    /// [`Tabulated::held`] undone.
    pub fn of_numbers(info: &'static Info, notes: fn(&Self) -> Vec<String>, numbers: &[f64]) -> Option<Self> {
        let (counts, grid) = numbers.split_first_chunk::<3>()?;
        if !counts.iter().all(|n| (0.0..=1e15).contains(n)) {
            return None;
        }
        let [all, missing, negative] = counts.map(|n| n as usize);
        Some(Self { info, notes, counts: Counts { all, missing, negative }, grid: Grid::of_numbers(grid)? })
    }

    /// The largest number on the grid.
    pub fn brightest(&self) -> f64 {
        self.grid.cells().iter().map(|v| largest(v.map(f64::from))).fold(0.0, f64::max)
    }
}

impl Tabulated for Table {
    fn info(&self) -> &'static Info {
        self.info
    }

    /// The three counts, then the grid.
    fn held(&self) -> Vec<f64> {
        let Counts { all, missing, negative } = self.counts;
        let mut numbers = vec![all as f64, missing as f64, negative as f64];
        numbers.extend(self.grid.numbers());
        numbers
    }

    fn notes(&self) -> Vec<String> {
        (self.notes)(self)
    }

    fn value(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.grid.value(wi, wo)
    }

    fn values(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        self.grid.values(wi, wo, out);
    }

    fn is_isotropic(&self) -> bool {
        self.grid.is_isotropic()
    }

    fn twin(&self) -> Option<Twin> {
        Some(self.grid.twin())
    }
}
