//! Links between bumps: the texel that each texel sees along each of some fixed directions.

use crate::BakeError;
use crate::gpu::{Buffer, Uniform, Value};
use crate::local::Place;
use crate::shared::surface::bumps;
use crate::shared::surface::texels::TextureLayers;
use glam::Vec3;
use std::f64::consts::TAU;
use steradian_base::Task;
use steradian_relight::height::{HeightField, Scattering};
use steradian_sphere::sampling::{Pcg32, R2};

/// Most links: 128 MiB, the largest buffer that every GPU can bind.
const MAX_LINKS: usize = 1 << 25;
/// Numbers a direction in buffers of a GPU, before the links.
pub(super) const ROW: usize = 6;

/// A direction that all texels have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Direction in the frame of the bump; cosine-distributed, so that all have the same weight: w (n·d) =
    /// π/N.
    pub d: [f32; 3],
    /// The direction that light takes before it takes this one, at the texel that this one meets.
    pub before: usize,
    /// Offset within the square of a point's footprint, −½ … ½, at which the texel lies whose link is
    /// followed.
    pub offset: [f32; 2],
}

/// Directions and links between bumps.
pub struct Scatter {
    pub directions: Vec<Direction>,
    pub links: Scattering,
    pub bounces: usize,
    /// Texels a row and rows.
    pub size: [usize; 2],
}

/// `count` directions.
pub(super) fn directions(count: usize) -> Vec<Direction> {
    // A path of two reflections uses one of as many pairs of directions as there are directions; their order
    // is shuffled, so that the pairs used represent all pairs.
    let mut order: Vec<usize> = (0..count).collect();
    let mut random = Pcg32::new(19, 5);
    for k in (1..count).rev() {
        order.swap(k, random.next_u32() as usize % (k + 1));
    }
    let lattice = R2::default();
    let one = |(k, before): (usize, usize)| {
        // Vogel's spiral: equal areas of the disk below the hemisphere.
        let r2 = (k as f64 + 0.5) / count as f64;
        let (sin, cos) = (k as f64 * TAU * 0.381_966_011_250_105).sin_cos();
        let r = r2.sqrt();
        let at = lattice.point(k as u32) - 0.5;
        Direction {
            d: [r * cos, r * sin, (1.0 - r2).sqrt()].map(|x| x as f32),
            before,
            offset: [at.x as f32, at.y as f32],
        }
    };
    order.into_iter().enumerate().map(one).collect()
}

/// The centre of a texel.
#[inline(always)]
pub(super) fn centre(texel: usize, [w, h]: [usize; 2]) -> Place {
    let uv = [((texel % w) as f32 + 0.5) / w as f32, ((texel / w) as f32 + 0.5) / h as f32];
    Place { uv, footprint: 0.0 }
}

/// The normal at a place.
#[inline(always)]
pub(super) fn normal(normals: &TextureLayers, at: Place) -> [f32; 3] {
    bumps::unit(normals.sample(0, at.uv, at.footprint)).0
}

/// Tangent, bitangent and normal.
#[inline(always)]
pub(super) fn frame(n: [f32; 3]) -> [[f32; 3]; 3] {
    let [t, b] = bumps::frame(n);
    [t, b, n]
}

#[inline(always)]
pub(super) fn out_of([t, b, n]: [[f32; 3]; 3], d: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|k| t[k] * d[0] + b[k] * d[1] + n[k] * d[2])
}

impl Scatter {
    /// The links of a field's texels; none where no texel sees another.
    pub fn new(
        field: &HeightField,
        normals: &TextureLayers,
        [bounces, count]: [usize; 2],
        task: &Task,
    ) -> Result<Option<Self>, BakeError> {
        let size = [field.width(), field.height()];
        let texels = size[0] * size[1];
        if texels * count > MAX_LINKS {
            let why = format!(
                "{} x {} heights and {count} directions are {} MiB of links: 128 at most; take fewer directions or a smaller height map",
                size[0],
                size[1],
                (4 * texels * count) >> 20
            );
            return Err(BakeError::Material { slug: "bump_horizon", why });
        }
        let directions = directions(count);
        let frames: Vec<_> = (0..texels).map(|k| frame(normal(normals, centre(k, size)))).collect();
        let along = |texel: usize, k: usize| Vec3::from_array(out_of(frames[texel], directions[k].d));
        let go_on = || task.check().is_ok();
        let Some(links) = Scattering::new(field, count, &along, &go_on) else {
            task.check()?;
            return Ok(None);
        };
        Ok((links.met() > 0.0).then_some(Self { directions, links, bounces, size }))
    }

    /// The texel that a point sees along direction `k`: that of the link of a texel in the square of the
    /// point's footprint, one texel wide at least. All directions together interpolate between texels and
    /// average over footprints.
    #[inline(always)]
    pub(super) fn meets(&self, at: Place, k: usize) -> Option<usize> {
        let o = self.directions[k].offset;
        let column = |axis: usize| {
            let n = self.size[axis] as f32;
            let u = at.uv[axis] + o[axis] * at.footprint.max(1.0 / n);
            (((u - u.floor()) * n) as usize).min(self.size[axis] - 1)
        };
        let [i, j] = [column(0), column(1)];
        self.links.link(j * self.size[0] + i, k)
    }

    /// Bytes on a GPU.
    pub fn bytes(&self) -> usize {
        self.links.bytes() + 4 * ROW * self.directions.len()
    }

    /// Directions, then links (−1 for none).
    pub fn buffer(&self) -> Buffer {
        let row = |d: &Direction| {
            let ([x, y, z], [u, v]) = (d.d, d.offset);
            [x, y, z, d.before as f32, u, v]
        };
        let mut data: Vec<f32> = self.directions.iter().flat_map(row).collect();
        data.extend(self.links.links().iter().map(|l| if *l == Scattering::NONE { -1.0 } else { *l as f32 }));
        Buffer::new("local_links", 1, data)
    }

    pub fn uniform(&self) -> Uniform {
        let [w, h] = self.size.map(|n| n as f32);
        let value = Value::Vec4([self.bounces as f32, self.directions.len() as f32, w, h]);
        Uniform { name: "local_scatter", value }
    }
}
