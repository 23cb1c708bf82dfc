//! CUReT: 61 samples of 205 measurements each.
//!
//! Dana, van Ginneken, Nayar & Koenderink 1999, Reflectance and Texture of Real-World Surfaces. Ramamoorthi &
//! Hanrahan 2002, section 5.7.2, interpolate them by order-8 Zernike polynomials; so does this reader, by
//! regularised least squares over Koenderink and van Doorn's 55 modes H_nml (`zernike`):
//!
//! a = argmin Σ_j (f_j − Σ a H(wi_j, wo_j))² + λ Σ d a², d = ((n(n+2) + m(m+2))/(2·8·10))² + 1e-6,
//!
//! λ by leaving out one measurement at a time (all channels share it). 205 measurements stop at 85° or less;
//! nearer to the horizon the fit extrapolates, and where it is negative **f = max(0, Σ a H)**.
//!
//! Files: `rbrdf.dat` with `gbrdf.dat` and `bbrdf.dat` beside it, or any single file as grey (`abrdf.dat`);
//! rows are the sample's number and its measurements. The directions are in a second file, `angles=` (default
//! `angles.dat` beside the first), one row per measurement. The fits that CUReT publishes (`kp8*.dat`) are
//! not read: their order is not documented.

use super::zernike::{self, MODES, ORDER};
use crate::draw::{self, Draw};
use crate::math::{above, spherical};
use crate::registry::Entry;
use crate::spec::Args;
use crate::{Brdf, BrdfShader, Info, Lobe, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::ParamInfo;
use steradian_formats::{Limits, decode_curet, decode_curet_directions};
use steradian_numerics::dense::Cholesky;

/// The page.
pub static INFO: Info = Info {
    name: "curet",
    source: "Dana et al. 1999; modes: Koenderink, van Doorn & Stavridi 1996; Ramamoorthi & Hanrahan 2002, section 5.7.2",
    formula: "f = max(0, Σ a_nml H_nml), 55 modes up to order 8 fitted to the sample's measurements",
    units: "sr⁻¹, as the file has them",
    parameters: &[
        ParamInfo::file(
            "name",
            "path of rbrdf.dat (gbrdf.dat and bbrdf.dat beside it), or of one file as grey",
        )
        .positional(),
        ParamInfo::whole("sample", [0.0, 1e6], 0.0, "number of the sample, the first of its row").required(),
        ParamInfo::file(
            "angles",
            "path of the directions: theta_i phi_i theta_v phi_v per measurement; angles.dat beside the first",
        ),
    ],
    reciprocity: "reciprocal",
    energy: "as measured; beyond 85° as extrapolated",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let Some(path) = a.file("name") else {
        return Err(a.syntax("needs the path of rbrdf.dat, as in curet:rbrdf.dat,sample=42".into()));
    };
    let sample = a.number("sample")?;
    let angles = a.file("angles").unwrap_or_else(|| path.with_file_name("angles.dat"));
    let (spec, name) = (a.spec(), path.display());
    Ok(Arc::new(match a.held() {
        Some(numbers) => Curet::from_numbers(spec, numbers)
            .ok_or_else(|| a.syntax(format!("what is kept of {name} is damaged")))?,
        None => Curet::read(&path, &angles, sample as u32, spec, a)?,
    }))
}

/// More than 61 rows of 205 numbers need.
const MAX_BYTES: u64 = 4 << 20;

/// One pair of directions, local frame.
type Pair = (DVec3, DVec3);

/// A sample of CUReT's, refitted.
#[derive(Debug, Clone)]
pub struct Curet {
    spec: String,
    /// Coefficients of the modes, per channel.
    modes: [[f64; MODES]; 3],
    /// RMS of the fit's residuals, relative to the RMS of the measurements.
    residual: f64,
}

const DRAW: &[(f64, Draw)] = &[(1.0, Draw::Cosine)];

impl Curet {
    /// RMS of the fit's residuals at the measurements, relative to the measurements' own RMS.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    fn read(path: &Path, angles: &Path, sample: u32, spec: String, a: &Args<'_>) -> Result<Self, SpecError> {
        let (limits, what) = (Limits::default(), "a table of CUReT's");
        let fault = |path: &Path, what: String| SpecError::File { file: path.display().to_string(), what };
        let rows = decode_curet_directions(angles, &a.bytes(angles, MAX_BYTES, what)?, &limits)?;
        let directions: Vec<Pair> =
            rows.iter().map(|[i, phi_i, o, phi_o]| (spherical(*i, *phi_i), spherical(*o, *phi_o))).collect();
        let mut channels = Vec::new();
        for path in colours(path) {
            let table = decode_curet(&path, &a.bytes(&path, MAX_BYTES, what)?, &limits)?;
            let values = table.sample(&path, sample)?;
            if values.len() != directions.len() {
                let (n, m) = (values.len(), directions.len());
                let why = format!(
                    "sample {sample} has {n} measurements for {m} directions in {}",
                    angles.display()
                );
                return Err(fault(&path, why));
            }
            channels.push(values.to_vec());
        }
        let fit = fit(&directions, &channels)
            .ok_or_else(|| fault(angles, "too few different directions to fit a reflectance".into()))?;
        let modes = std::array::from_fn(|c| fit.modes[c.min(fit.modes.len() - 1)]);
        Ok(Self { spec, modes, residual: fit.residual })
    }

    /// See [`Brdf::held`]: the modes of the three channels, then the residual.
    fn from_numbers(spec: String, numbers: &[f64]) -> Option<Self> {
        let (&residual, modes) = numbers.split_last()?;
        let (modes, []) = modes.as_chunks::<MODES>() else { return None };
        let modes = modes.try_into().ok()?;
        numbers.iter().all(|v| v.is_finite()).then_some(Self { spec, modes, residual })
    }
}

/// `path` itself, or with its g and b siblings where its name begins with r.
fn colours(path: &Path) -> Vec<PathBuf> {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    match name.strip_prefix('r') {
        Some(rest) => ["r", "g", "b"].map(|c| path.with_file_name(format!("{c}{rest}"))).into(),
        None => vec![path.to_owned()],
    }
}

struct Fitted {
    modes: Vec<[f64; MODES]>,
    residual: f64,
}

/// The regularised fit with the λ whose left-out measurements are met best.
fn fit(directions: &[Pair], channels: &[Vec<f64>]) -> Option<Fitted> {
    let rows: Vec<[f64; MODES]> = directions.iter().map(|(i, o)| zernike::values(*i, *o)).collect();
    let entry = |i: usize, j: usize| rows.iter().map(|r| r[i] * r[j]).sum::<f64>();
    let gram: Vec<Vec<f64>> = (0..MODES).map(|i| (0..MODES).map(|j| entry(i, j)).collect()).collect();
    let size = (0..MODES).map(|i| gram[i][i]).sum::<f64>() / MODES as f64;
    let ladder = (0..=12).map(|k| size * 10f64.powf(1.0 - 0.5 * f64::from(k)));
    let tried = ladder.filter_map(|lambda| attempt(&rows, &gram, channels, lambda));
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let square: f64 = channels.iter().flatten().map(|f| f * f).sum();
    Some(Fitted { modes: best.1, residual: (best.2 / square).sqrt() })
}

/// Sum of squares of the left-out residuals r/(1 − h), the coefficients, and the sum of squares of r.
fn attempt(
    rows: &[[f64; MODES]],
    gram: &[Vec<f64>],
    channels: &[Vec<f64>],
    lambda: f64,
) -> Option<(f64, Vec<[f64; MODES]>, f64)> {
    let mut matrix = gram.to_vec();
    for (i, mode) in zernike::modes().iter().enumerate() {
        let rough = (mode.n * (mode.n + 2) + mode.m * (mode.m + 2)) as f64;
        matrix[i][i] += lambda * ((rough / (2 * ORDER * (ORDER + 2)) as f64).powi(2) + 1e-6);
    }
    let factor = Cholesky::new(&matrix)?;
    let leverage: Vec<f64> = rows.iter().map(|r| dot(r, &factor.solve(r.to_vec()))).collect();
    let (mut left_out, mut square, mut modes) = (0.0, 0.0, Vec::new());
    for values in channels {
        let mut b = vec![0.0; MODES];
        for (r, f) in rows.iter().zip(values) {
            b.iter_mut().zip(r).for_each(|(b, h)| *b += h * f);
        }
        let a = factor.solve(b);
        for ((r, f), h) in rows.iter().zip(values).zip(&leverage) {
            let residual = f - dot(r, &a);
            square += residual * residual;
            left_out += (residual / (1.0 - h).max(1e-6)).powi(2);
        }
        modes.push(std::array::from_fn(|i| a[i]));
    }
    left_out.is_finite().then_some((left_out, modes, square))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Brdf for Curet {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn held(&self) -> Option<Vec<f64>> {
        Some(self.modes.iter().flatten().copied().chain([self.residual]).collect())
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let h = zernike::values(wi, wo);
        self.modes.each_ref().map(|a| dot(a, &h).max(0.0))
    }

    fn lobes(&self, _: DVec3) -> Vec<Lobe> {
        Vec::new()
    }

    /// Cells of the shader: coefficients of the modes times their factors.
    fn shader(&self) -> Option<BrdfShader> {
        let cell = |(k, m): (usize, &zernike::Mode)| self.modes.each_ref().map(|a| (a[k] * m.factor) as f32);
        let cells = zernike::modes().iter().enumerate().map(cell).collect();
        let text = include_str!("curet.wgsl");
        Some(BrdfShader::new(text, self.peak(), self.domain(), []).with_cells(Arc::new(cells)))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(DRAW, wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(DRAW, wi, wo)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Files;
    use crate::math::spherical;
    use crate::{parse, parse_with};
    use std::fmt::Write as _;

    /// 205 pairs of directions up to 80°, as (θ_i, φ_i, θ_v, φ_v).
    fn angles() -> Vec<[f64; 4]> {
        let u = |i: usize, step: f64| (0.5 + step * i as f64).fract();
        let theta = |u: f64| (1.0 - 0.826 * u).acos();
        let row = |i: usize| {
            let azimuth = std::f64::consts::PI * u(i, 0.551_1);
            [theta(u(i, 0.819_172_5)), 0.4, theta(u(i, 0.671_043_6)), 0.4 + azimuth]
        };
        (0..205).map(row).collect()
    }

    /// A folder with tables of `truth` in two samples, degrees or radians.
    fn folder(name: &str, degrees: bool, truth: &dyn Brdf) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("steradian-curet-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for the test");
        let mut table = "# theta_i phi_i theta_v phi_v\n".to_owned();
        let mut rows = ["7", "12"].map(|id| [id; 3].map(str::to_owned));
        for (i, a) in angles().into_iter().enumerate() {
            let shown = if degrees { a.map(f64::to_degrees) } else { a };
            writeln!(table, "{} {} {} {} {}", i + 1, shown[0], shown[1], shown[2], shown[3]).expect("text");
            let f = truth.eval(spherical(a[0], a[1]), spherical(a[2], a[3]));
            for (row, factor) in rows.iter_mut().zip([1.0, 2.0]) {
                (0..3).for_each(|c| write!(row[c], " {:.9}", factor * f[c]).expect("text"));
            }
        }
        std::fs::write(folder.join("angles.dat"), table).expect("written");
        for (c, name) in ["rbrdf.dat", "gbrdf.dat", "bbrdf.dat"].iter().enumerate() {
            std::fs::write(folder.join(name), format!("{}\n{}\n", rows[0][c], rows[1][c])).expect("written");
        }
        folder
    }

    #[test]
    fn smooth_reflectance_comes_back() {
        let truth = parse("oren-nayar:sigma=0.3,albedo=0.8/0.5/0.2,variant=fujii").expect("spec");
        for degrees in [false, true] {
            let folder = folder(&format!("smooth{degrees}"), degrees, &*truth);
            let path = folder.join("rbrdf.dat");
            let spec = format!("curet:{},sample=12", path.display());
            let b = parse_with(&spec, Files::Any).expect("read");
            assert!(b.is_isotropic() && b.spec().contains("sample=12"));
            for (a, o) in [(0.2, 0.5), (0.9, 0.1), (1.1, 1.0), (0.0, 0.7)] {
                let (wi, wo) = (spherical(a, 2.0), spherical(o, 0.6));
                let (got, want) = (b.eval(wi, wo), truth.eval(wi, wo).map(|f| 2.0 * f));
                for c in 0..3 {
                    assert!((got[c] / want[c] - 1.0).abs() < 0.03, "{a} {o}: {got:?} {want:?}");
                }
                assert_eq!(got, b.eval(wo, wi));
            }
            std::fs::remove_dir_all(folder).expect("removed");
            let kept = b.held().expect("numbers");
            let again = parse_with(&spec, Files::Held(&kept)).expect("without the files");
            let (wi, wo) = (spherical(0.3, 1.0), spherical(0.8, 2.0));
            assert_eq!((again.eval(wi, wo), again.spec()), (b.eval(wi, wo), b.spec()));
            assert!(parse_with(&spec, Files::Held(&kept[1..])).is_err());
            assert!(parse(&spec).expect_err("data").to_string().contains("is not opened"));
        }
    }

    #[test]
    fn noise_is_not_followed() {
        let truth = parse("lambert:albedo=0.5").expect("spec");
        let directions: Vec<Pair> =
            angles().iter().map(|a| (spherical(a[0], a[1]), spherical(a[2], a[3]))).collect();
        let noisy = directions
            .iter()
            .zip(0..)
            .map(|((i, o), k)| truth.eval(*i, *o)[0] * (1.0 + 0.1 * (f64::from(k) * 2.399).sin()));
        let fitted = fit(&directions, &[noisy.collect()]).expect("fits");
        let worst = [(0.3, 0.4), (1.0, 1.2), (0.0, 1.3)].map(|(a, o)| {
            let h = zernike::values(spherical(a, 0.0), spherical(o, 1.0));
            (dot(&fitted.modes[0], &h) * 2.0 * std::f64::consts::PI - 1.0).abs()
        });
        assert!(worst.iter().all(|w| *w < 0.05), "{worst:?}");
        assert!((0.04..0.08).contains(&fitted.residual), "{}", fitted.residual);
    }

    #[test]
    fn faults_name_file_and_fault() {
        let folder = folder("faults", false, &*parse("lambert").expect("spec"));
        let at = |name: &str| folder.join(name).display().to_string();
        let message = |spec: String| {
            let e = parse_with(&spec, Files::Any).expect_err(&spec).to_string();
            assert!(!e.contains('\n'), "{e}");
            e
        };
        let red = at("rbrdf.dat");
        assert!(message("curet:sample=3".into()).contains("needs the path"));
        assert!(message(format!("curet:{red}")).contains("needs 'sample='"));
        assert!(message(format!("curet:{red},sample=1.5")).contains("whole number"));
        assert!(message(format!("curet:{red},sample=9")).contains("no sample 9; its rows begin with 7, 12"));
        assert!(message(format!("curet:{},sample=7", at("rnone.dat"))).contains("rnone.dat: "));
        std::fs::write(at("angles2.dat"), "0.1 0 0.2 0\n0.1 0 x 0\n").expect("written");
        let angles = |n: u8| format!("curet:{red},sample=7,angles={}", at(&format!("angles{n}.dat")));
        assert!(message(angles(2)).contains("line 2: 'x' is not a finite number"));
        std::fs::write(at("angles3.dat"), "0.1 0 0.2 0\n").expect("written");
        assert!(message(angles(3)).contains("205 measurements for 1 directions"));
        std::fs::write(at("angles4.dat"), "0.1 0 0.2\n").expect("written");
        assert!(message(angles(4)).contains("theta_i phi_i theta_v phi_v"));
        std::fs::remove_file(at("bbrdf.dat")).expect("removed");
        assert!(message(format!("curet:{red},sample=7")).contains("bbrdf.dat"));
        std::fs::remove_dir_all(folder).expect("removed");
    }

    /// Runs on CUReT's own tables where the user names their folder.
    #[test]
    #[ignore = "set STERADIAN_CURET to a folder with rbrdf.dat, gbrdf.dat, bbrdf.dat and angles.dat"]
    fn the_real_tables() {
        let folder = std::env::var("STERADIAN_CURET").expect("STERADIAN_CURET names a folder");
        let path = Path::new(&folder).join("rbrdf.dat");
        let angles = path.with_file_name("angles.dat");
        for sample in 1..=61 {
            let args = Args::new(&INFO, "", Files::Any).expect("nothing in it");
            let fitted = Curet::read(&path, &angles, sample, String::new(), &args).expect("readable");
            assert!(fitted.residual() < 0.5, "sample {sample}: {}", fitted.residual());
        }
    }
}
