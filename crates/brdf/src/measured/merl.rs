//! MERL's tables of isotropic reflectance, and tables made of any other.
//!
//! Matusik, Pfister, Brand & McMillan 2003, A Data-Driven Reflectance Model; coordinates of Rusinkiewicz 1998, A New Change
//! of Variables for Efficient BRDF Representation: the angle θ_h of the half vector, and the light's direction about it
//! (θ_d, φ_d). A file holds 90 × 90 × 180 cells per channel, at
//!
//! i_h + ½ = 90 √(θ_h/(π/2)), i_d + ½ = 90 θ_d/(π/2), i_φ + ½ = 180 φ_d/π,
//!
//! φ_d modulo π because f is reciprocal, in units of 1/1500, 1.15/1500 and 1.66/1500 sr⁻¹ for red, green and blue. Between
//! the centres of cells f is trilinear in these coordinates; beyond the outermost centres it is constant (φ_d wraps).
//!
//! A cell with a negative value in any channel was not measured: it is missing, not black. It takes the value of the
//! nearest cell at smaller θ_d with the same θ_h and φ_d (light and view both away from the horizon); where there is none,
//! of the nearest at greater θ_d; where the whole row is missing, of the same cell of the row with the next smaller θ_h.
//! Cells whose centre has light or view below the horizon mean nothing and are filled alike, for the interpolation.

use super::shape::Shape;
use crate::draw;
use crate::math::{above, half, largest, polar_angle};
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Brdf, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use steradian_base::{Cancelled, ParamInfo, Task};
use steradian_formats::{Limits, MERL_BYTES, MERL_CELLS, MERL_DIMENSIONS, MerlTable, decode_merl};
use steradian_parallel::prelude::*;

/// The page.
pub static INFO: Info = Info {
    name: "merl",
    source: "Matusik, Pfister, Brand & McMillan 2003; coordinates: Rusinkiewicz 1998",
    formula: "f trilinear between 90 × 90 × 180 measured cells in √θ_h, θ_d and φ_d; missing cells take the nearest at smaller θ_d",
    units: "sr⁻¹",
    parameters: &[ParamInfo::file("file", "path of a .binary file").positional()],
    reciprocity: "reciprocal",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// sr⁻¹ per unit of the file.
const UNITS: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
const HALF: usize = MERL_DIMENSIONS[0];
const DIFF: usize = MERL_DIMENSIONS[1];
const TURN: usize = MERL_DIMENSIONS[2];

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let Some(path) = a.file("file") else {
        return Err(a.syntax("needs the path of a table, as in merl:gold-metallic-paint.binary".into()));
    };
    if let Some(numbers) = a.held() {
        let kept = Merl::from_numbers(a.spec(), numbers);
        return kept
            .map(|m| Arc::new(m) as SharedBrdf)
            .ok_or_else(|| a.syntax(format!("what is kept of {} is damaged", path.display())));
    }
    let bytes = a.bytes(&path, MERL_BYTES, "a MERL table")?;
    let table = decode_merl(&path, &bytes, &Limits::default())?;
    let merl = Merl::new(a.spec(), &table);
    Ok(Arc::new(merl.ok_or_else(|| SpecError::File {
        file: path.display().to_string(),
        what: "every cell above the horizon is negative: nothing was measured".into(),
    })?))
}

/// A table.
#[derive(Debug, Clone)]
pub struct Merl {
    spec: String,
    /// sr⁻¹, φ_d fastest, then θ_d; no cell is missing any more.
    cells: Vec<[f32; 3]>,
    /// Cells above the horizon, and how many of them were missing.
    counted: [usize; 2],
    shape: Shape,
}

/// The directions at the centre of a cell, half vector in the plane of x and z: light, view.
fn centre(h: usize, d: usize, p: usize) -> (DVec3, DVec3) {
    let at = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let (sh, ch) = (at(h, HALF).powi(2) * FRAC_PI_2).sin_cos();
    let (sd, cd) = (at(d, DIFF) * FRAC_PI_2).sin_cos();
    let (sp, cp) = (at(p, TURN) * PI).sin_cos();
    let half = DVec3::new(sh, 0.0, ch);
    let across = DVec3::new(ch, 0.0, -sh) * (sd * cp) + DVec3::Y * (sd * sp);
    (half * cd + across, half * cd - across)
}

/// The table that `brdf` would have been measured as; cells below the horizon are −1. The reflectance must be isotropic.
pub fn tabulate(brdf: &dyn Brdf, task: &Task) -> Result<MerlTable, Cancelled> {
    task.begin("tabulating", HALF as u64);
    let slices: Vec<Vec<[f64; 3]>> = (0..HALF)
        .into_par_iter()
        .map(|h| {
            if task.is_cancelled() {
                return Vec::new();
            }
            let cell = |i: usize| {
                let (wi, wo) = centre(h, i / TURN, i % TURN);
                if !above(wi, wo) {
                    return [-1.0; 3];
                }
                let f = brdf.eval(wi, wo);
                std::array::from_fn(|c| if f[c].is_finite() { f[c] / UNITS[c] } else { -1.0 })
            };
            let slice = (0..DIFF * TURN).map(cell).collect();
            task.advance(1);
            slice
        })
        .collect();
    task.end();
    task.check()?;
    let channel = |c: usize| slices.iter().flatten().map(|v| v[c]).collect();
    Ok(MerlTable { channels: [channel(0), channel(1), channel(2)] })
}

impl Merl {
    /// The reflectance of a table; `None` where nothing in it was measured. `spec` is what it says of itself.
    pub fn new(spec: String, table: &MerlTable) -> Option<Self> {
        let [r, g, b] = &table.channels;
        let fits = [r, g, b].iter().all(|c| c.len() == MERL_CELLS);
        let value = |i: usize| [r[i] * UNITS[0], g[i] * UNITS[1], b[i] * UNITS[2]];
        let mut cells: Vec<Option<[f32; 3]>> = Vec::with_capacity(if fits { MERL_CELLS } else { 0 });
        let (mut seen, mut missing) = (0, 0);
        for i in 0..if fits { MERL_CELLS } else { 0 } {
            let (wi, wo) = centre(i / (DIFF * TURN), i / TURN % DIFF, i % TURN);
            let v = value(i).map(|v| v as f32);
            let measured = v.iter().all(|v| v.is_finite() && *v >= 0.0);
            if above(wi, wo) {
                seen += 1;
                missing += usize::from(!measured);
            }
            cells.push((measured && above(wi, wo)).then_some(v));
        }
        let cells = filled(cells)?;
        Some(Self::of(spec, cells, [seen, missing]))
    }

    fn of(spec: String, cells: Vec<[f32; 3]>, counted: [usize; 2]) -> Self {
        let empty = Shape::measure(&|_, _| [0.0; 3]);
        let mut merl = Self { spec, cells, counted, shape: empty };
        merl.shape = Shape::measure(&|wi, wo| merl.eval(wi, wo));
        merl
    }

    /// See [`Brdf::held`]: the two counts, then the cells.
    fn from_numbers(spec: String, numbers: &[f64]) -> Option<Self> {
        let (counted, cells) = numbers.split_first_chunk::<2>()?;
        let (cells, []) = cells.as_chunks::<3>() else { return None };
        let valid = cells.len() == MERL_CELLS && numbers.iter().all(|v| v.is_finite() && *v >= 0.0);
        let cells = || cells.iter().map(|v| v.map(|v| v as f32)).collect();
        valid.then(|| Self::of(spec, cells(), counted.map(|n| n as usize)))
    }

    /// Cells above the horizon, and how many of them were missing.
    pub fn missing(&self) -> [usize; 2] {
        self.counted
    }
}

/// Every missing cell filled by the rule above; `None` where there is nothing to fill from.
fn filled(mut cells: Vec<Option<[f32; 3]>>) -> Option<Vec<[f32; 3]>> {
    let mut before = vec![None; TURN];
    for row in cells.chunks_exact_mut(DIFF * TURN) {
        for p in 0..TURN {
            let at = |d: usize| d * TURN + p;
            let mut last = None;
            for d in 0..DIFF {
                last = row[at(d)].or(last);
                row[at(d)] = last;
            }
            let mut next = None;
            for d in (0..DIFF).rev() {
                next = row[at(d)].or(next);
                row[at(d)] = next;
            }
            if row[at(0)].is_none() {
                (0..DIFF).for_each(|d| row[at(d)] = before[p]);
            }
            before[p] = row[at(0)].or(before[p]);
        }
    }
    // Rows before the first that was measured take from it.
    let first: Vec<Option<[f32; 3]>> =
        (0..TURN).map(|p| cells.iter().skip(p).step_by(TURN).copied().flatten().next()).collect();
    let any = first.iter().copied().flatten().next()?;
    let fill = |(i, v): (usize, Option<[f32; 3]>)| v.or(first[i % TURN]).unwrap_or(any);
    Some(cells.into_iter().enumerate().map(fill).collect())
}

/// The two nodes about `x` among `n` and the share of the second, nodes at half-integers.
fn between(x: f64, n: usize) -> (usize, usize, f64) {
    let t = (x - 0.5).clamp(0.0, (n - 1) as f64);
    let i = (t as usize).min(n - 2);
    (i, i + 1, t - i as f64)
}

/// (θ_h, θ_d, φ_d) of two directions above the horizon, φ_d in [0, π).
pub(super) fn angles(wi: DVec3, wo: DVec3) -> [f64; 3] {
    let h = half(wi, wo);
    let s = h.x.hypot(h.y);
    let (cp, sp) = if s > 0.0 { (h.x / s, h.y / s) } else { (1.0, 0.0) };
    let (x, y) = (DVec3::new(h.z * cp, h.z * sp, -s).dot(wi), wi.y * cp - wi.x * sp);
    let turn = y.atan2(x);
    let turn = if turn < 0.0 { turn + PI } else { turn };
    [polar_angle(h), x.hypot(y).atan2(h.dot(wi)), if turn >= PI { 0.0 } else { turn }]
}

impl Brdf for Merl {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn held(&self) -> Option<Vec<f64>> {
        let counted = self.counted.iter().map(|n| *n as f64);
        Some(counted.chain(self.cells.iter().flatten().map(|v| f64::from(*v))).collect())
    }

    fn notes(&self) -> Vec<String> {
        let [seen, missing] = self.counted;
        let brightest = self.cells.iter().map(|v| largest(v.map(f64::from))).fold(0.0, f64::max);
        let share = 100.0 * missing as f64 / seen.max(1) as f64;
        vec![
            format!(
                "{missing} of {seen} cells above the horizon are negative ({share:.1} %): missing, filled from smaller θ_d"
            ),
            format!("the brightest cell is {brightest:.4} sr⁻¹"),
        ]
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let [theta_h, theta_d, phi_d] = angles(wi, wo);
        let (h0, h1, th) = between(HALF as f64 * (theta_h / FRAC_PI_2).sqrt(), HALF);
        let (d0, d1, td) = between(DIFF as f64 * theta_d / FRAC_PI_2, DIFF);
        let p = TURN as f64 * phi_d / PI - 0.5;
        let p0 = p.floor();
        let tp = p - p0;
        let wrap = |p: f64| p.rem_euclid(TURN as f64) as usize % TURN;
        let (p0, p1) = (wrap(p0), wrap(p0 + 1.0));
        let mut sum = [0.0; 3];
        for (h, wh) in [(h0, 1.0 - th), (h1, th)] {
            for (d, wd) in [(d0, 1.0 - td), (d1, td)] {
                for (p, wp) in [(p0, 1.0 - tp), (p1, tp)] {
                    let v = self.cells[(h * DIFF + d) * TURN + p];
                    let w = wh * wd * wp;
                    (0..3).for_each(|c| sum[c] += w * f64::from(v[c]));
                }
            }
        }
        sum
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        self.shape.lobes(self, wo)
    }

    fn peak(&self) -> Peak {
        self.shape.peak()
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.shape.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.shape.draw(), wi, wo)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::check_measured;
    use crate::math::spherical;
    use crate::{Files, parse, parse_with};
    use steradian_formats::write_merl;

    fn table(spec: &str) -> MerlTable {
        tabulate(&*parse(spec).expect(spec), &Task::quiet()).expect("not cancelled")
    }

    /// Away from grazing angles a table gives back what it was made of; chrome's peak bends between cells.
    #[test]
    fn a_formula_tabulated_and_read_back() {
        for (spec, tolerance) in [
            ("ggx:alpha=0.3,f0=0.9/0.5/0.1", 4e-3),
            ("lambert:albedo=0.8/0.5/0.2", 1e-6),
            ("abc:chrome", 0.12),
        ] {
            let brdf = parse(spec).expect(spec);
            let merl = Merl::new("merl:a".into(), &table(spec)).expect("measured");
            for i in 0..400 {
                let u = |g: f64| (0.5 + g * f64::from(i)).fract();
                let wi = spherical(1.2 * u(0.819_172_5), std::f64::consts::TAU * u(0.671_043_6));
                let wo = spherical(1.2 * u(0.549_700_5), std::f64::consts::TAU * u(0.450_477_3));
                let (a, b) = (brdf.eval(wi, wo), merl.eval(wi, wo));
                for c in 0..3 {
                    assert!((a[c] - b[c]).abs() <= tolerance * a[c], "{spec} {wi} {wo}: {a:?} {b:?}");
                }
            }
            assert_eq!(merl.missing()[1], 0);
        }
    }

    #[test]
    fn centres_of_cells_hold_the_measurement_and_reciprocity_is_exact() {
        let table = table("sgd:gold-metallic-paint");
        let merl = Merl::new("merl:a".into(), &table).expect("measured");
        for (h, d, p) in [(0, 0, 0), (3, 7, 179), (40, 20, 90), (10, 60, 33)] {
            let (wi, wo) = centre(h, d, p);
            let i = (h * DIFF + d) * TURN + p;
            for (v, w) in [(wi, wo), (wo, wi)] {
                let f = merl.eval(v, w);
                for c in 0..3 {
                    let want = table.channels[c][i] * UNITS[c];
                    assert!((f[c] - want).abs() < 1e-5 * want, "{h} {d} {p}: {} {want}", f[c]);
                }
            }
        }
    }

    #[test]
    fn missing_cells_are_filled_and_counted() {
        let mut table = table("lambert:albedo=0.5");
        let at = |h: usize, d: usize, p: usize| (h * DIFF + d) * TURN + p;
        for d in 10..20 {
            table.channels[1][at(5, d, 7)] = -0.1;
        }
        let merl = Merl::new("merl:a".into(), &table).expect("measured");
        assert_eq!(merl.missing()[1], 10);
        let (wi, wo) = centre(5, 15, 7);
        assert!((merl.eval(wi, wo)[1] - 0.5 / PI).abs() < 1e-6);
        assert!(merl.notes()[0].starts_with("10 of "));
        table.channels.iter_mut().flatten().for_each(|v| *v = -1.0);
        assert!(Merl::new("merl:a".into(), &table).is_none());
    }

    #[test]
    fn a_file_is_a_whole_reflectance() {
        let folder = std::env::temp_dir().join(format!("steradian-merl-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("m.binary");
        for spec in ["abc:chrome", "sgd:blue-acrylic", "lambert:albedo=0.5"] {
            write_merl(&path, &table(spec)).expect("written");
            let spec = format!("merl:{}", path.display());
            let brdf = parse_with(&spec, Files::Any).expect("valid");
            check_measured(&*brdf);
            let held = brdf.held().expect("numbers");
            let again = parse_with(&brdf.spec(), Files::Held(&held)).expect("held");
            let (wi, wo) = (spherical(0.4, 1.0), spherical(0.5, 4.0));
            assert_eq!(brdf.eval(wi, wo), again.eval(wi, wo));
            assert!(parse_with(&brdf.spec(), Files::Held(&held[..100])).is_err());
        }
        std::fs::write(&path, [0; 100]).expect("written");
        let e = parse_with(&format!("merl:{}", path.display()), Files::Any).expect_err("short").to_string();
        assert!(e.contains("m.binary: its dimensions are 0 x 0 x 0"), "{e}");
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
