//! The best product A_k p(ψ) of a view's factor and one profile.

use super::Rings;

/// Steps of the power iteration; 30 and 120 give the same five digits.
const STEPS: usize = 60;

/// Size of profiles like these rows: their integral where all rows have a positive one, else their norm;
/// never negative, 0 for a zero profile.
pub(super) fn size<'a>(rings: &'a Rings, rows: &[&[f64]]) -> impl Fn(&[f64]) -> f64 + 'a {
    let positive = |row: &&[f64]| {
        let absolute: Vec<f64> = row.iter().map(|v| v.abs()).collect();
        rings.integral(row) >= 0.2 * rings.integral(&absolute)
    };
    let integral = rows.iter().all(positive);
    move |row| if integral { rings.integral(row) } else { rings.dot(row, row).sqrt() }
}

/// `row` of size 1.
pub(super) fn divided(row: &[f64], size: f64) -> Vec<f64> {
    row.iter().map(|v| if size != 0.0 { v / size } else { 0.0 }).collect()
}

/// Minimises Σ_k w_k ∫ (row_k − A_k p)² by power iteration: given A, p = Σ w A row/Σ w A²; given p, A = ⟨row,
/// p⟩/⟨p, p⟩.
pub(super) fn fit(rings: &Rings, rows: &[&[f64]], weights: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let len = rings.angles().len();
    // The strongest row is never orthogonal to the answer.
    let strength = |k: &usize| weights[*k] * rings.dot(rows[*k], rows[*k]);
    let strongest = (0..rows.len()).max_by(|a, b| strength(a).total_cmp(&strength(b)));
    let mut p = strongest.map_or_else(|| vec![0.0; len], |k| rows[k].to_vec());
    let mut factor = vec![0.0; rows.len()];
    for _ in 0..STEPS {
        let square = rings.dot(&p, &p);
        if square <= 0.0 {
            break;
        }
        factor = rows.iter().map(|r| rings.dot(r, &p) / square).collect();
        let sum: f64 = factor.iter().zip(weights).map(|(a, w)| w * a * a).sum();
        if sum <= 0.0 {
            break;
        }
        p.fill(0.0);
        for ((row, a), w) in rows.iter().zip(&factor).zip(weights) {
            p.iter_mut().zip(*row).for_each(|(p, v)| *p += w * a / sum * v);
        }
    }
    (factor, p)
}
