//! Numbers per site in the order that sums over them read: sites in groups, in a group number after number,
//! each of all its sites. A register holds one number of several sites, so that no sum is over lanes.

use crate::Part;
use crate::gpu::Numbers;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use half::f16;
use half::slice::HalfFloatSliceExt;
use steradian_formats::{Tensor, TensorData};
use steradian_parallel::prelude::*;

/// Number of sites whose values are interleaved.
pub const GROUP: usize = 16;

/// An equal number of values for every site, in single or half precision, interleaved over groups of sites.
#[derive(Debug, Clone, PartialEq)]
pub struct Grouped {
    stride: usize,
    sites: usize,
    /// The last group is filled up with zeros.
    store: Store,
}

#[derive(Debug, Clone, PartialEq)]
enum Store {
    Single(Vec<f32>),
    Half(Vec<f16>),
}

/// The numbers of some groups.
#[derive(Debug, Clone, Copy)]
pub enum Groups<'a> {
    /// In single precision.
    Single(&'a [f32]),
    /// In half precision, as their bits.
    Half(&'a [u16]),
}

impl Default for Grouped {
    fn default() -> Self {
        Self { stride: 0, sites: 0, store: Store::Single(Vec::new()) }
    }
}

impl Grouped {
    /// `stride` numbers for each of `sites` sites, which `write` gives.
    pub fn new(
        stride: usize,
        sites: usize,
        halves: bool,
        write: impl Fn(usize, &mut dyn FnMut(usize, f32)) + Sync,
    ) -> Self {
        let group = |k: usize| {
            let mut out = vec![0.0; stride * GROUP];
            for (lane, s) in (k * GROUP..sites).take(GROUP).enumerate() {
                write(s, &mut |e, x| out[e * GROUP + lane] = x);
            }
            out
        };
        let groups = (0..sites.div_ceil(GROUP)).into_par_iter();
        let store = if halves {
            Store::Half(groups.flat_map_iter(|k| group(k).into_iter().map(f16::from_f32)).collect())
        } else {
            Store::Single(groups.flat_map_iter(group).collect())
        };
        Self { stride, sites, store }
    }

    /// Groups `stride` numbers of each site, given site after site.
    pub fn from_sites(stride: usize, data: &[f32], halves: bool) -> Self {
        let sites = data.len() / stride.max(1);
        let of = |s: usize| data[s * stride..][..stride].iter().enumerate();
        Self::new(stride, sites, halves, |s, put| of(s).for_each(|(e, x)| put(e, *x)))
    }

    /// Values of each site.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Number of sites.
    pub fn len(&self) -> usize {
        self.sites
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.sites == 0
    }

    /// Are the numbers 16-bit floats?
    pub fn is_half(&self) -> bool {
        matches!(self.store, Store::Half(_))
    }

    /// The groups from `first` on.
    pub fn groups(&self, first: usize) -> Groups<'_> {
        let start = first * self.stride * GROUP;
        match &self.store {
            Store::Single(v) => Groups::Single(&v[start..]),
            Store::Half(v) => Groups::Half(v[start..].reinterpret_cast()),
        }
    }

    /// All numbers, site after site.
    pub fn by_site(&self) -> Numbers {
        let sites = (0..self.sites).map(|s| s / GROUP * self.stride * GROUP + s % GROUP);
        let places = sites.flat_map(|first| (0..self.stride).map(move |e| first + e * GROUP));
        match &self.store {
            Store::Single(v) => Numbers::F32(places.map(|at| v[at]).collect()),
            Store::Half(v) => Numbers::F16(places.map(|at| v[at]).collect()),
        }
    }

    /// Adds the tensor `name`: sites by numbers.
    pub fn save_as(&self, to: &mut TensorFile, name: String) {
        let shape = vec![self.sites, self.stride];
        match self.by_site() {
            Numbers::F16(v) => {
                to.tensors.insert(name, Tensor { shape, data: TensorData::F16(v) });
            }
            Numbers::F32(v) => put_f32(to, name, shape, v),
            Numbers::Unorm8 { .. } => {}
        }
    }

    /// Reads the tensor `name`.
    pub fn load_as(from: &TensorFile, name: &str) -> Result<Self, PartError> {
        let (shape, data) = get_f32(from, name, 2)?;
        let halves = from.tensors.get(name).is_some_and(|t| matches!(t.data, TensorData::F16(_)));
        if shape[1] == 0 && shape[0] > 0 {
            return Err(PartError::Unexpected(name.into()));
        }
        Ok(Self::from_sites(shape[1], &data, halves))
    }

    /// Bytes of the numbers of all sites.
    pub fn bytes(&self) -> usize {
        self.sites * self.stride * if self.is_half() { 2 } else { 4 }
    }
}

impl Part for Grouped {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.save_as(to, format!("{prefix}.sites"));
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        Self::load_as(from, &format!("{prefix}.sites"))
    }

    fn bytes(&self) -> usize {
        self.bytes()
    }
}
