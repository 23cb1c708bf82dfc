//! Corners of points, sorted by the group of their sites. The data that the sites of a group share are some
//! kilobytes; without the sorting, each corner fetched them from the second level of the cache or further.

use crate::Points;

/// Most groups.
pub const MOST_GROUPS: usize = 2048;
/// Number of points whose corners are sorted together.
pub const SORTED: usize = 4096;

/// Corners of points in the order of their groups.
pub struct Sorted {
    /// Where each group ends in `order`.
    pub ends: [u16; MOST_GROUPS],
    /// 3 · point + corner.
    pub order: [u16; 3 * SORTED],
    groups: [u16; 3 * SORTED],
    found: [u16; 3 * SORTED],
    facing: [bool; SORTED],
}

impl Sorted {
    /// No points yet.
    #[inline(always)]
    pub fn empty() -> Self {
        Self {
            ends: [0; MOST_GROUPS],
            order: [0; 3 * SORTED],
            groups: [0; 3 * SORTED],
            found: [0; 3 * SORTED],
            facing: [false; SORTED],
        }
    }

    /// Sorts those corners of some points that contribute (weight not 0, point faces the viewer) by their
    /// sites' groups, of which there are `groups`; returns their number. `group` is `None` for sites beyond
    /// the end.
    #[inline(always)]
    pub fn sort(&mut self, groups: usize, group: impl Fn(u32) -> Option<usize>, q: &Share<'_>) -> usize {
        let groups = groups.min(MOST_GROUPS);
        self.ends[..groups].fill(0);
        let facing = &mut self.facing[..q.len];
        for i in 0..q.len {
            // False for NaN too.
            facing[i] = q.mirror(i).0 > 0.0;
        }
        let mut len = 0;
        for corner in 0..3 {
            if corner > 0 && q.weight[corner - 1].iter().all(|w| *w == 0.0) {
                continue;
            }
            for i in 0..q.len {
                if !facing[i] || q.weight(i, corner) == 0.0 {
                    continue;
                }
                match group(q.index[corner][i]) {
                    Some(group) if group < groups => {
                        self.ends[group] += 1;
                        self.found[len] = (3 * i + corner) as u16;
                        self.groups[len] = group as u16;
                        len += 1;
                    }
                    _ => {}
                }
            }
        }
        // First place of each group, and after the loop below the place behind its last one.
        let mut begin = 0;
        for end in &mut self.ends[..groups] {
            begin += std::mem::replace(end, begin);
        }
        for (group, found) in self.groups[..len].iter().zip(&self.found[..len]) {
            let at = &mut self.ends[usize::from(*group)];
            self.order[usize::from(*at)] = *found;
            *at += 1;
        }
        groups
    }
}

/// Some of the points, so that loops over them need no checks.
pub struct Share<'a> {
    n: [&'a [f32]; 3],
    /// Directions to the viewer.
    pub wo: [&'a [f32]; 3],
    /// Sites of the corners.
    pub index: [&'a [u32]; 3],
    weight: [&'a [f32]; 2],
    len: usize,
}

impl<'a> Share<'a> {
    /// `len` points from `first` on.
    #[inline(always)]
    pub fn of(q: &Points<'a>, first: usize, len: usize) -> Self {
        let (end, v, w) = (first + len, [q.n, q.wo], q.site);
        Self {
            n: [&v[0][0][first..end], &v[0][1][first..end], &v[0][2][first..end]],
            wo: [&v[1][0][first..end], &v[1][1][first..end], &v[1][2][first..end]],
            index: [&w.index[0][first..end], &w.index[1][first..end], &w.index[2][first..end]],
            weight: [&w.weight[0][first..end], &w.weight[1][first..end]],
            len,
        }
    }

    /// n·wo, and the mirror direction of the viewer.
    #[inline(always)]
    pub fn mirror(&self, i: usize) -> (f32, [f32; 3]) {
        let (n, v) = (&self.n, &self.wo);
        let d = n[0][i] * v[0][i] + n[1][i] * v[1][i] + n[2][i] * v[2][i];
        (d, [2.0 * d * n[0][i] - v[0][i], 2.0 * d * n[1][i] - v[1][i], 2.0 * d * n[2][i] - v[2][i]])
    }

    /// The weight of a corner of point `i`.
    #[inline(always)]
    pub fn weight(&self, i: usize, corner: usize) -> f32 {
        let (u, v) = (self.weight[0][i], self.weight[1][i]);
        match corner {
            0 => 1.0 - u - v,
            1 => u,
            _ => v,
        }
    }
}
