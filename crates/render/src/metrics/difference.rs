//! Pictures of where two pictures differ.

use crate::film::Display;

/// The colour map magma (van der Walt & Smith 2015, matplotlib) at nine evenly spaced values, sRGB.
const MAGMA: [[f32; 3]; 9] = [
    [0.0, 0.0, 4.0],
    [28.0, 16.0, 68.0],
    [79.0, 18.0, 123.0],
    [129.0, 37.0, 129.0],
    [181.0, 54.0, 122.0],
    [229.0, 80.0, 100.0],
    [251.0, 135.0, 97.0],
    [254.0, 194.0, 135.0],
    [252.0, 253.0, 191.0],
];

/// A map of differences 0 … 1, for example [`crate::metrics::Flip::map`], as a picture: black through purple
/// and orange to pale yellow. `map` should have `width·height` values; missing ones are black.
pub fn difference_picture(map: &[f32], width: usize, height: usize) -> Display {
    let mut picture = Display::filled(width, height, [0, 0, 4]);
    for (pixel, &d) in picture.rgb.as_chunks_mut::<3>().0.iter_mut().zip(map) {
        *pixel = magma(d);
    }
    picture
}

fn magma(d: f32) -> [u8; 3] {
    // NaN becomes black.
    let x = if d > 0.0 { d.min(1.0) } else { 0.0 } * (MAGMA.len() - 1) as f32;
    let i = (x as usize).min(MAGMA.len() - 2);
    let t = x - i as f32;
    std::array::from_fn(|k| (MAGMA[i][k] + t * (MAGMA[i + 1][k] - MAGMA[i][k])).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_are_the_published_colours() {
        assert_eq!(magma(0.0), [0, 0, 4]);
        assert_eq!(magma(0.5), [181, 54, 122]);
        assert_eq!(magma(1.0), [252, 253, 191]);
        assert_eq!(magma(7.0), magma(1.0));
        assert_eq!(magma(f32::NAN), [0, 0, 4]);
    }
}
