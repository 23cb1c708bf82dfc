//! Shading with data per site for static light, KSS02 section 4: the light's coefficients rotated into each
//! site's frame.

use super::kernel::{LightLanes, MOST};
use super::look::{Corners, Look, ParaboloidGrid};
use super::shorts::{self, SHARE};
use super::vectors::{SIDE, Vectors, Xyz, copy, frame_angles, read};
use super::{SiteFrames, ViewTable};
use crate::{Points, Radiance};
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Single, Vector, prefetch};
use steradian_sphere::sh::{Angle, turn};

/// Most bands of the light kept per site.
pub const MOST_BANDS: usize = 6;

/// The coefficients of site after site, padded with zeros so that whole registers can be read at the end.
#[derive(Debug, Clone, PartialEq)]
enum Rows {
    Single(Vec<f32>),
    /// Signed 16-bit integers, and the factor that scales them.
    Short(Vec<i16>, f32),
}

/// Light in the frame of each site: site after site, then channel, then coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalLight {
    /// Coefficients of a channel.
    count: usize,
    rows: Rows,
}

impl Default for LocalLight {
    fn default() -> Self {
        Self { count: 0, rows: Rows::Single(Vec::new()) }
    }
}

impl LocalLight {
    /// One light in the frames of all sites; `light` has six bands at most, and its coefficients already
    /// include the table's tint.
    pub fn turned(frames: &SiteFrames, light: &LightLanes) -> Self {
        let count = light.coefficients().len();
        let mut data = vec![0.0; 3 * count * frames.len() + MOST];
        let (len, c) = (3 * count, light.coefficients());
        let sites = &mut data[..len * frames.len()];
        sites.par_chunks_mut(len * SIDE).enumerate().for_each(|(k, to)| {
            steradian_simd::run(IntoFrames { frames, first: SIDE * k, c, to });
        });
        Self { count, rows: Rows::Single(data) }
    }

    /// Light of each site by `fill`, which writes its three channels.
    pub fn of(sites: usize, count: usize, fill: impl Fn(usize, &mut [f32]) + Sync) -> Self {
        let mut data = vec![0.0; 3 * count * sites + MOST];
        let all = &mut data[..3 * count * sites];
        all.par_chunks_mut(3 * count).enumerate().for_each(|(k, to)| fill(k, to));
        Self { count, rows: Rows::Single(data) }
    }

    /// Converts to 16-bit integers, off by 2^-16 of the largest value, where the table has such too.
    #[must_use]
    pub fn shortened(self, table: &ViewTable) -> Self {
        match self.rows {
            Rows::Single(data) if table.shorts.is_some() => {
                let (numbers, scale) = shorts::shortened(&data);
                Self { count: self.count, rows: Rows::Short(numbers, scale) }
            }
            rows => Self { rows, ..self },
        }
    }

    /// The numbers, site after site.
    pub fn numbers(&self) -> Vec<f32> {
        let mut all = match &self.rows {
            Rows::Single(v) => v.clone(),
            Rows::Short(v, scale) => v.iter().map(|x| scale * f32::from(*x)).collect(),
        };
        all.truncate(all.len().saturating_sub(MOST));
        all
    }

    fn sites(&self) -> usize {
        let len = match &self.rows {
            Rows::Single(v) => v.len(),
            Rows::Short(v, _) => v.len(),
        };
        len.saturating_sub(MOST) / (3 * self.count).max(1)
    }
}

/// Turns a light into sixteen frames.
struct IntoFrames<'a> {
    frames: &'a SiteFrames,
    first: usize,
    c: &'a [[f32; 3]],
    to: &'a mut [f32],
}

impl Kernel for IntoFrames<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        match self.c.len() {
            9 => self.few::<A, 9>(),
            16 => self.few::<A, 16>(),
            25 => self.few::<A, 25>(),
            36 => self.few::<A, 36>(),
            _ => {}
        }
    }
}

impl IntoFrames<'_> {
    #[inline(always)]
    fn few<A: Arch, const N: usize>(self) {
        let view = |v: &'_ [Vec<f32>; 3]| read::<A>([&v[0], &v[1], &v[2]], self.first, self.frames.len());
        let angles = frame_angles::<A>(&view(&self.frames.n), &view(&self.frames.t));
        let minus = A::F32::splat(-1.0);
        let mut lane = 0;
        while lane < SIDE {
            // The inverse: −α, β, −γ.
            let (mut cos, mut sin) = ([A::F32::splat(0.0); 3], [A::F32::splat(0.0); 3]);
            for k in 0..3 {
                cos[k] = A::F32::load(&angles[4 - 2 * k][lane..]);
                sin[k] = A::F32::load(&angles[5 - 2 * k][lane..]).mul(minus);
            }
            let all = [Angle::new(cos[0], sin[0]), Angle::new(cos[1], sin[1]), Angle::new(cos[2], sin[2])];
            for c in 0..3 {
                let mut f = [A::F32::splat(0.0); N];
                for i in 0..N {
                    f[i] = A::F32::splat(self.c[i][c]);
                }
                turn(&all, &mut f);
                let mut column = [0.0; SIDE];
                for (i, f) in f.iter().enumerate() {
                    f.store(&mut column);
                    for k in 0..A::F32::LANES {
                        if let Some(to) = self.to.get_mut((lane + k) * 3 * N + c * N + i) {
                            *to = column[k];
                        }
                    }
                }
            }
            lane += A::F32::LANES;
        }
    }
}

/// Radiance of points under the light of the sites around them, interpolated: at a vertex one lookup and
/// three scalar products, without a rotation. Each site is seen at the point's own angle: the view is carried
/// along by the least rotation that takes the point's normal to the site's, and so is the mirror direction.
/// Points without sites, or that face away, get 0.
pub fn shade_local(
    table: &ViewTable,
    frames: &SiteFrames,
    light: &LocalLight,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let known = q.site.index.iter().all(|s| s.len() == q.len())
        && q.site.weight.iter().all(|w| w.len() == q.len())
        && light.count == table.bands * table.bands
        && light.sites() == frames.len()
        && !frames.is_empty();
    if known {
        let count = light.count;
        match (&light.rows, &table.shorts) {
            (Rows::Single(light), _) => {
                let texels = &table.data[..];
                steradian_simd::run(Local { table, texels, light, scale: 1.0, frames, count, q, out });
            }
            (Rows::Short(light, scale), Some(shorts)) => {
                let (texels, scale) = (&shorts.data[..], SHARE * shorts.scale * scale);
                steradian_simd::run(Local { table, texels, light, scale, frames, count, q, out });
            }
            (Rows::Short(..), None) => out.rgb.iter_mut().for_each(|p| p.fill(0.0)),
        }
    } else {
        out.rgb.iter_mut().for_each(|p| p.fill(0.0));
    }
}

struct Local<'a, 'b, 'c, N> {
    table: &'a ViewTable,
    /// The table's numbers, the light's, and the factor of their products' sums.
    texels: &'a [N],
    light: &'a [N],
    scale: f32,
    frames: &'a SiteFrames,
    count: usize,
    q: &'a Points<'b>,
    out: &'a mut Radiance<'c>,
}

/// The kind of number of table and light: C coefficients of light for each channel, in rows of P numbers in
/// the table, of so many channels there.
trait Numbers: Copy {
    /// Calls [`Local::add`] with the numbers of coefficients that there are, which whole registers of this
    /// kind make rows of.
    fn add<A: Arch>(all: &mut Local<'_, '_, '_, Self>, b: &Corner, next: &Corner, parts: &mut Parts<A::F32>);
    /// Computes the texels' weights in the form that [`Numbers::sums`] takes, once for sixteen points.
    fn weigh<A: Arch>(to: &mut Corner);
    /// The sums of point `i` over coefficients, still in lanes, of a table of `size` texels a row; `light`
    /// begins with its site's.
    fn sums<A: Arch, const C: usize, const P: usize, const CHANNELS: usize>(
        texels: &[Self],
        size: usize,
        b: &Corner,
        i: usize,
        light: &[Self],
    ) -> [A::F32; 3];
}

impl Numbers for f32 {
    #[inline(always)]
    fn add<A: Arch>(all: &mut Local<'_, '_, '_, f32>, b: &Corner, next: &Corner, parts: &mut Parts<A::F32>) {
        match (all.count, all.table.channels) {
            (9, 1) => all.add::<A, 9, 16, 1>(b, next, parts),
            (9, _) => all.add::<A, 9, 16, 3>(b, next, parts),
            (16, 1) => all.add::<A, 16, 16, 1>(b, next, parts),
            (16, _) => all.add::<A, 16, 16, 3>(b, next, parts),
            (25, 1) => all.add::<A, 25, 32, 1>(b, next, parts),
            (25, _) => all.add::<A, 25, 32, 3>(b, next, parts),
            (36, 1) => all.add::<A, 36, 48, 1>(b, next, parts),
            (36, _) => all.add::<A, 36, 48, 3>(b, next, parts),
            _ => {}
        }
    }

    #[inline(always)]
    fn weigh<A: Arch>(_: &mut Corner) {}

    #[inline(always)]
    fn sums<A: Arch, const C: usize, const P: usize, const CHANNELS: usize>(
        texels: &[f32],
        size: usize,
        b: &Corner,
        i: usize,
        light: &[f32],
    ) -> [A::F32; 3] {
        // P numbers are read from the beginning of each channel; storage goes on that far behind the last
        // channel of the last site.
        let light = &light[..2 * C + P];
        let mut sum = [A::F32::splat(0.0); 3];
        for c in 0..CHANNELS {
            let from = b.look.texel[i] as usize * CHANNELS * P + c * P;
            let view = Corners::<A::F32, P>::at(texels, [size, CHANNELS * P], &b.look, i, from);
            let mut j = 0;
            // Numbers of the view beyond its coefficients are zero.
            while j < P {
                let f = view.load(j);
                if CHANNELS == 1 {
                    sum[0] = f.fma(A::F32::load(&light[j..]), sum[0]);
                    sum[1] = f.fma(A::F32::load(&light[C + j..]), sum[1]);
                    sum[2] = f.fma(A::F32::load(&light[2 * C + j..]), sum[2]);
                } else {
                    sum[c] = f.fma(A::F32::load(&light[c * C + j..]), sum[c]);
                }
                j += A::F32::LANES;
            }
        }
        sum
    }
}

impl Numbers for i16 {
    #[inline(always)]
    fn add<A: Arch>(all: &mut Local<'_, '_, '_, i16>, b: &Corner, next: &Corner, parts: &mut Parts<A::F32>) {
        match (all.count, all.table.channels) {
            (9, 1) => all.add::<A, 9, 32, 1>(b, next, parts),
            (9, _) => all.add::<A, 9, 32, 3>(b, next, parts),
            (16, 1) => all.add::<A, 16, 32, 1>(b, next, parts),
            (16, _) => all.add::<A, 16, 32, 3>(b, next, parts),
            (25, 1) => all.add::<A, 25, 32, 1>(b, next, parts),
            (25, _) => all.add::<A, 25, 32, 3>(b, next, parts),
            (36, 1) => all.add::<A, 36, 64, 1>(b, next, parts),
            (36, _) => all.add::<A, 36, 64, 3>(b, next, parts),
            _ => {}
        }
    }

    #[inline(always)]
    fn weigh<A: Arch>(to: &mut Corner) {
        to.shares = shorts::shares::<A>(&to.look);
    }

    #[inline(always)]
    fn sums<A: Arch, const C: usize, const P: usize, const CHANNELS: usize>(
        texels: &[i16],
        size: usize,
        b: &Corner,
        i: usize,
        light: &[i16],
    ) -> [A::F32; 3] {
        shorts::sums::<A, C, P, CHANNELS>(texels, [b.look.texel[i] as usize, size], &b.shares, i, light)
    }
}

/// One corner of the triangles of sixteen points, ready to be added.
struct Corner {
    /// The first of the points.
    first: usize,
    site: [u32; SIDE],
    /// 0 where the point faces away, or has no such site.
    weight: [f32; SIDE],
    look: Look,
    /// The weights of texels as whole numbers.
    shares: [[i16; SIDE]; 4],
    /// Sites whose light is prefetched: where the corners' sites are consecutive, those sixteen further on.
    asked: [u32; SIDE],
    /// Are the sites consecutive?
    row: bool,
}

impl<N: Numbers> Kernel for Local<'_, '_, '_, N> {
    type Output = ();

    /// Software-pipelined: while sixteen points are shaded, the texels of the next sixteen are found and
    /// their light is prefetched, as a core has only few loads outstanding by itself. (The code is
    /// specialised by number of coefficients inside the loop, per sixteen points: a specialised loop for each
    /// number was a quarter of the code of all techniques.)
    #[inline(always)]
    fn run<A: Arch>(mut self) {
        let none = || Corner {
            first: 0,
            site: [0; SIDE],
            weight: [0.0; SIDE],
            look: Look::NONE,
            shares: [[0; SIDE]; 4],
            asked: [0; SIDE],
            row: false,
        };
        let (mut both, mut now, mut next) = ([none(), none()], 0, (0, 0));
        let mut parts = [[A::F32::splat(0.0); SIDE]; 3];
        let grid = ParaboloidGrid::<A::F32>::new(self.table);
        let (mut more, mut first) = (true, true);
        while more {
            more = self.find::<A>(&grid, &mut next, &mut both[1 - now]);
            if !first {
                N::add::<A>(&mut self, &both[now], &both[1 - now], &mut parts);
            }
            (now, first) = (1 - now, false);
        }
    }
}

/// The result of [`Local::look_from`] for a row of points.
enum RowLookup {
    /// Some points have weight, and their views have texels.
    Found,
    /// All points face away from their viewers, or have no weight.
    Nothing,
    /// The points' normals differ from the sites': their views have to be rotated to the sites' frames first.
    OtherNormals,
}

/// Distance, in points, at which normals and views are prefetched: they come from more streams at once than a
/// core's own prefetcher follows.
const AHEAD: usize = 6 * SIDE;

/// Sums of sixteen points by channel, each still in lanes.
type Parts<V> = [[V; SIDE]; 3];

impl<N: Numbers> Local<'_, '_, '_, N> {
    /// The next corner, from corner `next` of points on, that adds anything. (Loops over whole blocks without
    /// branches or closures, which compilers make vectors of: with them a third of the time went here.)
    #[inline(always)]
    fn find<A: Arch>(
        &mut self,
        grid: &ParaboloidGrid<A::F32>,
        next: &mut (usize, usize),
        to: &mut Corner,
    ) -> bool {
        let (q, len) = (self.q, self.q.len());
        let last = (self.frames.len() - 1) as u32;
        while next.0 < len {
            let (first, corner) = *next;
            *next = if corner == 2 { (first + SIDE, 0) } else { (first, corner + 1) };
            if corner == 0 {
                for k in 0..3 {
                    prefetch(q.n[k], first + AHEAD);
                    prefetch(q.wo[k], first + AHEAD);
                    let out = &mut self.out.rgb[k][first..len];
                    // (A fill of unknown length would be compiled to a call.)
                    match out.first_chunk_mut::<SIDE>() {
                        Some(out) => *out = [0.0; SIDE],
                        None => out.fill(0.0),
                    }
                }
                let (u, v) = (numbers::<A>(q.site.weight[0], first), numbers::<A>(q.site.weight[1], first));
                for i in 0..SIDE {
                    to.weight[i] = 1.0 - u[i] - v[i];
                }
            } else {
                to.weight = numbers::<A>(q.site.weight[corner - 1], first);
            }
            if !any(&to.weight) {
                continue;
            }
            if let Some(from) = self.at_sites(first, corner) {
                match self.look_from::<A>(grid, [first, from], to) {
                    RowLookup::Found => return true,
                    RowLookup::Nothing => continue,
                    RowLookup::OtherNormals => {}
                }
            }
            let mut spare = [0; SIDE];
            let index = whole(q.site.index[corner], first, &mut spare);
            let (n, wo) = (read::<A>(q.n, first, len), read::<A>(q.wo, first, len));
            for i in 0..SIDE {
                let facing = n[0][i] * wo[0][i] + n[1][i] * wo[1][i] + n[2][i] * wo[2][i];
                // Sites beyond the end have no light.
                let there = if index[i] <= last { to.weight[i] } else { 0.0 };
                to.weight[i] = if facing > 0.0 { there } else { 0.0 };
                to.site[i] = index[i].min(last);
            }
            if len - first < SIDE {
                to.weight[len - first..].fill(0.0);
            }
            if any(&to.weight) {
                to.first = first;
                self.look::<A>(&n, &wo, to);
                return true;
            }
        }
        false
    }

    /// The first of sixteen sites in a row, where a corner of sixteen points from the first has such, as the
    /// vertices of a mesh have that are shaded in order.
    #[inline(always)]
    fn at_sites(&self, first: usize, corner: usize) -> Option<usize> {
        let index: &[u32; SIDE] = self.q.site.index[corner].get(first..)?.first_chunk()?;
        let (from, mut off) = (index[0], 0);
        for i in 0..SIDE {
            off |= index[i] ^ from.wrapping_add(i as u32);
        }
        (off == 0 && from as usize + SIDE <= self.frames.len()).then_some(from as usize)
    }

    /// What [`Local::find`] finds where points have the normals of sites in a row: everything in registers,
    /// from the memory that it lies in. (With copies whole numbers took 4 % longer, all data in the cache.)
    #[inline(always)]
    fn look_from<A: Arch>(
        &self,
        grid: &ParaboloidGrid<A::F32>,
        [first, from]: [usize; 2],
        to: &mut Corner,
    ) -> RowLookup {
        let (q, all) = (self.q, self.frames);
        for k in 0..3 {
            prefetch(&all.n[k], from + AHEAD);
            prefetch(&all.t[k], from + AHEAD);
        }
        let (mut other, mut up) = ([0.0; SIDE], [0.0; SIDE]);
        let mut lane = 0;
        while lane < SIDE {
            let n = Xyz::<A::F32>::at(q.n, first + lane);
            let own = Xyz::at([&all.n[0], &all.n[1], &all.n[2]], from + lane);
            let off = n.minus(own);
            off.dot(off).store(&mut other[lane..]);
            let t = Xyz::at([&all.t[0], &all.t[1], &all.t[2]], from + lane);
            to.look.texels(grid, lane, [own, t, own.cross(t)], Xyz::at(q.wo, first + lane), &mut up);
            lane += A::F32::LANES;
        }
        if any(&other) {
            return RowLookup::OtherNormals;
        }
        to.look.weigh(self.table, &up);
        let mut lane = 0;
        while lane < SIDE {
            let weight = A::F32::load(&to.weight[lane..]);
            A::F32::load(&up[lane..]).if_positive(weight, A::F32::splat(0.0)).store(&mut to.weight[lane..]);
            lane += A::F32::LANES;
        }
        let ahead = (self.frames.len() - SIDE).min(from + SIDE) as u32;
        to.site = std::array::from_fn(|i| from as u32 + i as u32);
        to.asked = std::array::from_fn(|i| ahead + i as u32);
        (to.first, to.row) = (first, true);
        if !any(&to.weight) {
            return RowLookup::Nothing;
        }
        N::weigh::<A>(to);
        RowLookup::Found
    }

    /// Finds the texels of the points' views, carried to their sites.
    #[inline(always)]
    fn look<A: Arch>(&self, n: &Vectors, wo: &Vectors, to: &mut Corner) {
        let (mut own, mut t) = ([[0.0; SIDE]; 3], [[0.0; SIDE]; 3]);
        let (from, mut off) = (to.site[0], 0);
        for i in 0..SIDE {
            off |= to.site[i] ^ from.wrapping_add(i as u32);
        }
        let (ahead, last) = (if off == 0 { SIDE as u32 } else { 0 }, (self.frames.len() - 1) as u32);
        for i in 0..SIDE {
            to.asked[i] = (to.site[i] + ahead).min(last);
        }
        to.row = off == 0;
        if to.row {
            let from = from as usize;
            for k in 0..3 {
                prefetch(&self.frames.n[k], from + AHEAD);
                prefetch(&self.frames.t[k], from + AHEAD);
                copy::<A>(&self.frames.n[k][from..from + SIDE], &mut own[k]);
                copy::<A>(&self.frames.t[k][from..from + SIDE], &mut t[k]);
            }
        } else {
            for i in 0..SIDE {
                for k in 0..3 {
                    own[k][i] = self.frames.n[k][to.site[i] as usize];
                    t[k][i] = self.frames.t[k][to.site[i] as usize];
                }
            }
        }
        // Where the normals are those of the sites, as at vertices, no view needs to be turned.
        let mut other = 0;
        for k in 0..3 {
            for i in 0..SIDE {
                other |= n[k][i].to_bits() ^ own[k][i].to_bits();
            }
        }
        if other == 0 {
            to.look.set_in_frames::<A>(self.table, &own, &t, wo);
        } else {
            to.look.set_in_frames::<A>(self.table, &own, &t, &carried::<A>(n, &own, wo));
        }
        N::weigh::<A>(to);
    }

    /// Prefetches the light of one point of a corner. (Texels lie in a cache already: prefetching them as
    /// well took a tenth longer.)
    #[inline(always)]
    fn ask<const C: usize, const P: usize>(&self, b: &Corner, i: usize) {
        let (line, from) = (64 / size_of::<N>(), b.asked[i] as usize * 3 * C);
        let light = &self.light[from..from + 2 * C + P];
        for k in 0..(3 * C).div_ceil(line) {
            prefetch(light, k * line);
        }
        // (Of sites in a row the next begins within a line of the last of these.)
        if !b.row {
            prefetch(light, 3 * C - 1);
        }
    }

    /// Adds the radiance of one corner of each of sixteen points. The next corner's memory is prefetched
    /// point by point in between: all prefetches at once would stall the core.
    #[inline(always)]
    fn add<A: Arch, const C: usize, const P: usize, const CHANNELS: usize>(
        &mut self,
        b: &Corner,
        next: &Corner,
        parts: &mut Parts<A::F32>,
    ) {
        let (lanes, scale) = (A::F32::LANES, self.scale);
        for i in 0..SIDE {
            self.ask::<C, P>(next, i);
            let light = &self.light[b.site[i] as usize * 3 * C..];
            let sum = N::sums::<A, C, P, CHANNELS>(self.texels, self.table.size, b, i, light);
            for k in 0..3 {
                parts[k][i] = sum[k];
            }
        }
        for k in 0..3 {
            let mut sums = [0.0f32; SIDE];
            let mut lane = 0;
            while lane < SIDE {
                A::F32::lane_sums(&mut parts[k][lane..lane + lanes]).store(&mut sums[lane..]);
                lane += lanes;
            }
            let out = &mut self.out.rgb[k][b.first..];
            match out.first_chunk_mut::<SIDE>() {
                Some(out) => add_weighed(out, &b.weight, &sums, scale),
                None => add_weighed(out, &b.weight, &sums, scale),
            }
        }
    }
}

/// Adds scaled and weighted sums. Where the weight is 0 the value stays, even if the site's data are NaN.
#[inline(always)]
fn add_weighed(out: &mut [f32], weight: &[f32; SIDE], sums: &[f32; SIDE], scale: f32) {
    for (i, out) in out.iter_mut().enumerate() {
        let more = *out + scale * (weight[i] * sums[i]);
        *out = if weight[i] == 0.0 { *out } else { more };
    }
}

/// Is a number not zero?
#[inline(always)]
fn any(weights: &[f32; SIDE]) -> bool {
    let mut bits = 0;
    for i in 0..SIDE {
        bits |= weights[i].to_bits();
    }
    // The sign does not count.
    bits << 1 != 0
}

/// Values of sixteen points from the first; the last point fills `spare` up.
#[inline(always)]
fn whole<'a, T: Copy + Default>(v: &'a [T], first: usize, spare: &'a mut [T; SIDE]) -> &'a [T; SIDE] {
    if let Some(all) = v[first..].first_chunk() {
        return all;
    }
    for i in 0..SIDE {
        spare[i] = v.get((first + i).min(v.len().saturating_sub(1))).copied().unwrap_or_default();
    }
    spare
}

/// Values of sixteen points from the first, copied; the last point is repeated beyond the end.
#[inline(always)]
fn numbers<A: Arch>(v: &[f32], first: usize) -> [f32; SIDE] {
    let (mut spare, mut out) = ([0.0; SIDE], [0.0; SIDE]);
    copy::<A>(whole(v, first, &mut spare), &mut out);
    out
}

/// `v` turned by the least rotation that takes unit `a` to unit `b`: v − (a + b)·v/(1 + a·b) (a + b) + 2(a·v)
/// b.
#[inline(always)]
fn carried<A: Arch>(a: &Vectors, b: &Vectors, v: &Vectors) -> Vectors {
    let mut out: Vectors = [[0.0; SIDE]; 3];
    let (zero, one) = (A::F32::splat(0.0), A::F32::splat(1.0));
    let mut lane = 0;
    while lane < SIDE {
        let [a, b, v] = [Xyz::<A::F32>::load(a, lane), Xyz::load(b, lane), Xyz::load(v, lane)];
        let av = a.dot(v);
        let size = one.add(a.dot(b));
        let size = size.sub(A::F32::splat(1e-6)).if_positive(size, A::F32::splat(1e-6));
        let s = av.add(b.dot(v)).div(size);
        v.plus(zero.sub(s), a).plus(av.add(av).sub(s), b).store(&mut out, lane);
        lane += A::F32::LANES;
    }
    out
}
