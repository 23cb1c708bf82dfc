//! Data per texel of a surface: textures of one size, looked up at texture coordinates on the CPU and as one
//! table of a GPU.

use crate::gpu::{Format, Level, Shape, Table, wrap_word};
use std::sync::Arc;
use steradian_scene::surface::{Patch, Texture, Wrap};

/// Textures of one size with their levels: three numbers a texel each.
#[derive(Debug, Clone)]
pub struct TextureLayers(Vec<Arc<Texture>>);

impl TextureLayers {
    /// Textures that are brought to the size of the largest of each side; none at all where there are none.
    pub fn new(textures: Vec<Arc<Texture>>) -> Self {
        let (width, height) =
            textures.iter().fold((1, 1), |(w, h), t| (w.max(t.size().0), h.max(t.size().1)));
        let wrap = textures.iter().find(|t| t.size() != (1, 1)).map_or([Wrap::Repeat; 2], |t| t.wrap());
        let sized = |t: Arc<Texture>| {
            if t.size() == (width, height) && t.wrap() == wrap {
                return t;
            }
            let texel = |k: usize| {
                let (u, v) = ((k % width) as f32 + 0.5, (k / width) as f32 + 0.5);
                t.sample(u / width as f32, v / height as f32, 0.0)
            };
            let all: Vec<[f32; 3]> = (0..width * height).map(texel).collect();
            let planes = [0, 1, 2].map(|c| all.iter().map(|x| x[c]).collect());
            Texture::new(width, height, &planes).map_or(t, |t| Arc::new(t.with_wrap(wrap)))
        };
        Self(textures.into_iter().map(sized).collect())
    }

    /// Textures from planes of `width` · `height` numbers, rows from the top, three planes a texture; missing
    /// planes of the last texture are 0.
    pub fn of_planes(width: usize, height: usize, planes: &[Vec<f32>]) -> Self {
        let zero = vec![0.0; width * height];
        let texture = |three: &[Vec<f32>]| {
            let plane = |k: usize| three.get(k).unwrap_or(&zero).clone();
            Texture::new(width, height, &[plane(0), plane(1), plane(2)]).map(Arc::new)
        };
        Self(planes.chunks(3).filter_map(texture).collect())
    }

    /// Texture `k` averaged over a square of side `footprint` at `uv`.
    #[inline]
    pub fn sample(&self, k: usize, [u, v]: [f32; 2], footprint: f32) -> [f32; 3] {
        self.0[k].sample(u, v, footprint)
    }

    /// Texels a row and rows.
    pub fn size(&self) -> (usize, usize) {
        self.0.first().map_or((1, 1), |t| t.size())
    }

    /// Wrap modes in u and v.
    pub fn wrap(&self) -> [Wrap; 2] {
        self.0.first().map_or([Wrap::Repeat; 2], |t| t.wrap())
    }

    /// Of each texture the texels of all levels, one after the other.
    pub fn layers(&self) -> impl Iterator<Item = Vec<[f32; 3]>> {
        self.0.iter().map(|t| t.levels().flat_map(|l| l.2.iter().copied()).collect())
    }

    /// How texels of all levels lie one after the other.
    pub fn patch(&self) -> Patch {
        let (width, height) = self.size();
        Patch::new(width, height, self.wrap()).unwrap_or_else(|| unreachable!("textures have texels"))
    }

    /// Bytes on a GPU, which has four numbers for three.
    pub fn bytes(&self) -> usize {
        let texels = |t: &Arc<Texture>| t.levels().map(|l| l.2.len()).sum::<usize>();
        16 * self.0.iter().map(texels).sum::<usize>()
    }

    /// As a GPU table: `fetch_NAME(uv, footprint, k)` is texture k, its w 0.
    pub fn table(&self, name: &'static str) -> Table {
        let (width, rows) = self.size();
        let [u, v] = self.wrap().map(wrap_word);
        let levels = self.0.first().map_or(1, |t| t.levels().count());
        let mut height = 0;
        let mut bytes = Vec::with_capacity(self.bytes());
        let mut put = |texel: [f32; 3]| {
            for x in texel {
                bytes.extend_from_slice(&x.to_le_bytes());
            }
            bytes.extend_from_slice(&[0; 4]);
        };
        for t in &self.0 {
            height = 0;
            for (columns, _, texels) in t.levels() {
                for row in texels.chunks_exact(columns) {
                    row.iter().for_each(|t| put(*t));
                    (columns..width).for_each(|_| put([0.0; 3]));
                    height += 1;
                }
            }
        }
        if self.0.is_empty() {
            put([0.0; 3]);
            height = 1;
        }
        Table {
            name,
            shape: Shape::Texture { levels: levels as u32, rows: rows as u32, wrap: u | v << 2 },
            format: Format::Rgba32Float,
            level: Level { width, height, layers: self.0.len().max(1), bytes },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_of_several_sizes_become_one_table() {
        let ramp = |w: usize, h: usize| {
            let p: Vec<f32> = (0..w * h).map(|k| (k % w) as f32).collect();
            Arc::new(Texture::new(w, h, &[p.clone(), p.clone(), p]).expect("texels"))
        };
        let t =
            TextureLayers::new(vec![ramp(8, 4), Arc::new(Texture::constant([1.0, 2.0, 3.0])), ramp(4, 4)]);
        assert_eq!(t.size(), (8, 4));
        assert_eq!(t.sample(1, [0.3, 0.9], 0.1), [1.0, 2.0, 3.0]);
        // Texel centres of the narrower texture lie a quarter of its texel from those of the wider one.
        assert_eq!(t.sample(2, [2.5 / 8.0, 0.5], 0.0)[0], 0.75);
        let table = t.table("local_test");
        // 4, 2, 1 and 1 rows.
        assert_eq!((table.level.width, table.level.height, table.level.layers), (8, 8, 3));
        assert_eq!(table.level.bytes.len(), 16 * 8 * 8 * 3);
        let none = TextureLayers::new(Vec::new()).table("local_none");
        assert_eq!(none.level.bytes.len(), 16);
    }

    #[test]
    fn planes_fill_textures_by_threes() {
        let planes: Vec<Vec<f32>> = (0..4).map(|k| vec![k as f32; 4]).collect();
        let t = TextureLayers::of_planes(2, 2, &planes);
        assert_eq!(
            (t.sample(0, [0.1, 0.2], 0.0), t.sample(1, [0.1, 0.2], 0.5)),
            ([0.0, 1.0, 2.0], [3.0, 0.0, 0.0])
        );
        assert_eq!(t.bytes(), 2 * 16 * 5);
    }
}
