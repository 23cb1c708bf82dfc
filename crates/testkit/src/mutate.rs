//! Damage to files, the same in every run.

/// Makes damaged copies of files from a fixed seed.
pub struct Mutator(u64);

/// What length fields are set to.
const EXTREMES: [u64; 8] = [0, 1, 0x7f, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, u64::MAX >> 1];

impl Mutator {
    /// Starts from `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number below `n`; 0 where there is none.
    pub fn below(&mut self, n: usize) -> usize {
        // Knuth's MMIX generator; its upper bits are good.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n.max(1)
    }

    /// `bytes` with one to four faults: flipped bits, changed bytes and digits, numbers set to extremes,
    /// pieces that are cut, doubled, or come from `other`, an end that is missing.
    pub fn damage(&mut self, bytes: &[u8], other: &[u8]) -> Vec<u8> {
        let mut out = bytes.to_vec();
        for _ in 0..=self.below(4) {
            self.fault(&mut out, other);
        }
        out
    }

    fn fault(&mut self, out: &mut Vec<u8>, other: &[u8]) {
        let at = self.below(out.len());
        let piece = |m: &mut Self, of: usize| {
            let from = m.below(of);
            from..(from + 1 + m.below(64)).min(of)
        };
        match self.below(10) {
            0..=2 => out.get_mut(at).into_iter().for_each(|b| *b ^= 1 << self.below(8)),
            3 => out.get_mut(at).into_iter().for_each(|b| *b = self.below(256) as u8),
            4 => self.extreme(out, at),
            5 => self.digit(out, at),
            6 => out.truncate(at),
            7 => _ = out.drain(piece(self, out.len())),
            8 => {
                let again = out[piece(self, out.len())].to_vec();
                out.splice(at..at, again);
            }
            _ => {
                let theirs = other[piece(self, other.len())].to_vec();
                let end = (at + theirs.len() * self.below(2)).min(out.len());
                out.splice(at..end, theirs);
            }
        }
    }

    /// Two, four or eight bytes of either order.
    fn extreme(&mut self, out: &mut [u8], at: usize) {
        let (n, value) = ([2, 4, 8][self.below(3)], EXTREMES[self.below(EXTREMES.len())]);
        let bytes = if self.below(2) == 0 {
            value.to_le_bytes()[..n].to_vec()
        } else {
            value.to_be_bytes()[8 - n..].to_vec()
        };
        out.iter_mut().skip(at).zip(bytes).for_each(|(b, v)| *b = v);
    }

    /// The next number of a text becomes another.
    fn digit(&mut self, out: &mut Vec<u8>, at: usize) {
        let texts = ["-1", "4294967296", "1e39", "-1e309", "nan", "inf", "0.5", "1e-320", "\"", "{}"];
        if let Some(k) = (at..out.len()).find(|&k| out[k].is_ascii_digit()) {
            let text = texts[self.below(texts.len())];
            out.splice(k..=k, text.bytes());
        }
    }
}
