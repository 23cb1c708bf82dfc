//! The integers as tensors, so that a saved bake holds them and not the images.

use super::packed::{Code, Field, layout};
use super::{CosineLobes, MOST, Widths};
use crate::gpu::wrap_word;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use steradian_formats::{Tensor, TensorData};
use steradian_scene::surface::{Patch, Wrap};

/// Names of the tensors: number of lobes, columns, rows, wrap modes in u and v, bytes of ρ, C and n, and
/// whether channels have lobes of their own, a bit each; least number and span of each; words of each texel.
const NAMES: [&str; 3] = ["lobes.layout", "lobes.ranges", "lobes.codes"];
/// Most texels a side.
const LARGEST: usize = 1 << 16;

impl CosineLobes {
    /// Writes the lobes.
    pub fn save(&self, to: &mut TensorFile) {
        let ((width, height), [u, v]) = (self.patch.size(), self.patch.wrap().map(wrap_word));
        let own = (0..MOST).filter(|k| self.own[*k]).fold(0, |bits, k| bits | 1 << k);
        let w = self.widths;
        let words = [w.rho, w.c, w.n].map(|b| b as u32);
        let layout = [&[self.count as u32, width as u32, height as u32, u, v][..], &words, &[own]].concat();
        let mut words = |name: &str, shape: Vec<usize>, v: Vec<u32>| {
            to.tensors.insert(name.into(), Tensor { shape, data: TensorData::U32(v) });
        };
        words(NAMES[0], vec![layout.len()], layout);
        let codes = self.codes.as_chunks::<4>().0.iter().map(|w| u32::from_le_bytes(*w)).collect();
        words(NAMES[2], vec![self.patch.texels(), self.stride / 4], codes);
        let ranges = self.fields.iter().flat_map(|f| [f.low, f.span]).collect();
        put_f32(to, NAMES[1].into(), vec![self.fields.len(), 2], ranges);
    }

    /// The lobes that [`CosineLobes::save`] wrote; `None` where the file has none.
    pub fn load(from: &TensorFile) -> Result<Option<Self>, PartError> {
        if !from.tensors.contains_key(NAMES[0]) {
            return Ok(None);
        }
        let unexpected = |k: usize| PartError::Unexpected(NAMES[k].into());
        let words = |k: usize| match from.tensors.get(NAMES[k]).map(|t| (&t.shape, &t.data)) {
            Some((shape, TensorData::U32(v))) => Ok((shape, v)),
            Some(_) => Err(unexpected(k)),
            None => Err(PartError::Missing(NAMES[k].into())),
        };
        let numbers = words(0)?.1.iter().map(|x| *x as usize).collect::<Vec<_>>();
        let [count, width, height, u, v, rho, c, n, bits] = numbers[..] else {
            return Err(unexpected(0));
        };
        let wrap = |w: usize| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].get(w).copied();
        let wrap = wrap(u).zip(wrap(v)).ok_or_else(|| unexpected(0))?;
        let sound = count <= MOST && width.max(height) <= LARGEST && bits < 1 << MOST;
        let whole = [rho, c, n].iter().all(|b| (1..=3).contains(b));
        let patch = Patch::new(width, height, wrap.into()).filter(|_| sound && whole);
        let patch = patch.ok_or_else(|| unexpected(0))?;
        let (widths, own) = (Widths { rho, c, n }, std::array::from_fn(|k| bits >> k & 1 == 1));
        let (mut fields, stride) = layout(count, &own, widths);
        let (shape, ranges) = get_f32(from, NAMES[1], 2)?;
        if shape != [fields.len(), 2] {
            return Err(unexpected(1));
        }
        for (f, range) in fields.iter_mut().zip(ranges.as_chunks::<2>().0) {
            [f.low, f.span] = *range;
            if !is_sound(f) {
                return Err(unexpected(1));
            }
        }
        let (shape, codes) = words(2)?;
        if *shape != [patch.texels(), stride / 4] || codes.len() != patch.texels() * (stride / 4) {
            return Err(unexpected(2));
        }
        let codes = codes.iter().flat_map(|w| w.to_le_bytes()).collect();
        Ok(Some(Self { count, widths, patch, own, fields, stride, codes }))
    }
}

/// Are all numbers that the field can hold such as shading takes?
fn is_sound(f: &Field) -> bool {
    let most = match f.code {
        Code::Exponential => f.low * f.span.exp(),
        _ => f.low + f.span,
    };
    let least = match f.code {
        Code::Square => f.low >= 0.0,
        Code::Linear => true,
        Code::Exponential => f.low > 0.0,
    };
    least && f.span >= 0.0 && f.low.is_finite() && most.is_finite()
}
