//! The air: what it holds at each height, and how much of it lies along a path.
//!
//! Bruneton & Neyret 2008, "Precomputed atmospheric scattering", with the constants of Bruneton 2017 (a new
//! implementation, with ozone). Columns of air, aerosol and ozone are tabulated instead of transmittances:
//! they do not depend on wavelength.

use super::spectrum::{BINS, Spectrum, ozone_cross_section, solar, wavelength};

/// Radius of the ground, metres (Bruneton & Neyret 2008).
pub(super) const GROUND: f64 = 6_360_000.0;
/// Radius of the top of the air, metres. At 100 km the air has exp(−12.5) = 4e-6 of its density on the
/// ground; Bruneton ends at 60 km, with 6e-4.
pub(super) const TOP: f64 = 6_460_000.0;
/// Angular radius of the sun, radians (0.2666°).
pub(super) const SUN_RADIUS: f64 = 0.004_653;

/// Height over which air becomes thinner by the factor e, metres (Bruneton & Neyret 2008).
const RAYLEIGH_HEIGHT: f64 = 8000.0;
/// Height over which aerosol becomes thinner by the factor e, metres (Bruneton & Neyret 2008).
const AEROSOL_HEIGHT: f64 = 1200.0;
/// Aerosol single-scattering albedo (Bruneton 2017).
const AEROSOL_ALBEDO: f64 = 0.9;
/// Asymmetry of the aerosol's phase function (Bruneton & Neyret 2008).
const ASYMMETRY: f64 = 0.76;
/// 300 Dobson units over a tent of half-width 15 km, m⁻³.
const OZONE_DENSITY: f64 = 300.0 * 2.687e20 / 15_000.0;

/// Amounts of air, aerosol and ozone: relative densities, or their integrals along a path (m).
pub(super) type Amounts = [f64; 3];

/// Spectral coefficients at relative density 1, m⁻¹.
pub(super) struct Air {
    pub(super) rayleigh: Spectrum,
    pub(super) aerosol: Spectrum,
    /// Extinction of air, aerosol and ozone.
    extinction: [Spectrum; 3],
    /// Solar irradiance above the air, W m⁻² nm⁻¹.
    pub(super) solar: Spectrum,
    columns: Columns,
}

impl Air {
    /// Turbidity T gives the aerosol: optical depth β λ^−1.3 (λ in µm) with β = 0.04608 T − 0.04586
    /// (Preetham, Shirley & Smits 1999, "A practical analytic model for daylight", appendix 1).
    pub(super) fn new(turbidity: f64) -> Self {
        let beta = (0.04608 * turbidity - 0.04586).max(0.0);
        let micron = |k: usize| wavelength(k) / 1000.0;
        let rayleigh: Spectrum = std::array::from_fn(|k| 1.24062e-6 * micron(k).powi(-4));
        let aerosol: Spectrum = std::array::from_fn(|k| beta * micron(k).powf(-1.3) / AEROSOL_HEIGHT);
        let ozone = ozone_cross_section().map(|s| s * OZONE_DENSITY);
        Self {
            rayleigh,
            aerosol: aerosol.map(|a| a * AEROSOL_ALBEDO),
            extinction: [rayleigh, aerosol, ozone],
            solar: solar(),
            columns: Columns::new(),
        }
    }

    /// Optical depth per bin of an amount.
    pub(super) fn optical_depth(&self, a: Amounts) -> Spectrum {
        let [r, m, o] = &self.extinction;
        std::array::from_fn(|k| a[0] * r[k] + a[1] * m[k] + a[2] * o[k])
    }

    /// Transmittance from radius r to the sun, whose zenith angle there has cosine μ; 0 in the earth's
    /// shadow, with the penumbra of the sun's disk.
    pub(super) fn sunlight(&self, r: f64, mu: f64) -> Spectrum {
        let edge = -(1.0 - (GROUND / r).powi(2)).max(0.0).sqrt();
        let t = (0.5 + 0.5 * (mu - edge) / (SUN_RADIUS * GROUND / r)).clamp(0.0, 1.0);
        let visible = t * t * (3.0 - 2.0 * t);
        if visible == 0.0 {
            return [0.0; BINS];
        }
        self.optical_depth(self.columns.look_up(r, mu.max(edge))).map(|tau| visible * (-tau).exp())
    }
}

/// Rayleigh's phase function, sr⁻¹.
pub(super) fn rayleigh_phase(nu: f64) -> f64 {
    3.0 / (16.0 * std::f64::consts::PI) * (1.0 + nu * nu)
}

/// Cornette & Shanks 1992's phase function of the aerosol, sr⁻¹.
pub(super) fn aerosol_phase(nu: f64) -> f64 {
    let g2 = ASYMMETRY * ASYMMETRY;
    let k = 3.0 / (8.0 * std::f64::consts::PI) * (1.0 - g2) / (2.0 + g2);
    k * (1.0 + nu * nu) / (1.0 + g2 - 2.0 * ASYMMETRY * nu).powf(1.5)
}

/// Relative densities at radius r.
pub(super) fn density(r: f64) -> Amounts {
    let h = (r - GROUND).max(0.0);
    let ozone = (1.0 - (h - 25_000.0).abs() / 15_000.0).max(0.0);
    [(-h / RAYLEIGH_HEIGHT).exp(), (-h / AEROSOL_HEIGHT).exp(), ozone]
}

/// Distance from radius r along cosine μ to the top of the air.
pub(super) fn to_top(r: f64, mu: f64) -> f64 {
    (-r * mu + (r * r * (mu * mu - 1.0) + TOP * TOP).max(0.0).sqrt()).max(0.0)
}

/// Distance to the ground, if the path meets it.
pub(super) fn to_ground(r: f64, mu: f64) -> Option<f64> {
    let disc = r * r * (mu * mu - 1.0) + GROUND * GROUND;
    (mu < 0.0 && disc >= 0.0).then(|| (-r * mu - disc.sqrt()).max(0.0))
}

/// Amounts from radius r along μ over a length, with steps that grow as the square.
fn along(r: f64, mu: f64, length: f64) -> Amounts {
    // Transmittances are 1e-4 off those of 8192 steps at most (300 rays, turbidity 3).
    const PATH_STEPS: usize = 128;
    let mut sum = [0.0; 3];
    for i in 0..PATH_STEPS {
        let t = (i as f64 + 0.5) / PATH_STEPS as f64;
        let (s, ds) = (length * t * t, length * 2.0 * t / PATH_STEPS as f64);
        let d = density((r * r + s * s + 2.0 * r * mu * s).sqrt());
        sum.iter_mut().zip(d).for_each(|(a, d)| *a += d * ds);
    }
    sum
}

/// Amounts from radius r along μ to the top; the path must miss the ground.
fn column(r: f64, mu: f64) -> Amounts {
    if mu >= 0.0 {
        return along(r, mu, to_top(r, mu));
    }
    // From the lowest point outwards both ways.
    let lowest = (r * (1.0 - mu * mu).max(0.0).sqrt()).max(GROUND);
    let (a, b) = (along(lowest, 0.0, -r * mu), along(lowest, 0.0, to_top(lowest, 0.0)));
    std::array::from_fn(|k| a[k] + b[k])
}

/// Nodes of the table of columns over radius and cosine, 216 KiB: transmittances between them are 6e-4 off
/// (RMS of 300 rays, turbidity 3) and 0.012 at most, just above the horizon; with half as many each way 2e-3
/// and 0.02, with twice as many 2e-4 and 0.005.
const RADII: usize = 48;
const COSINES: usize = 192;

/// Columns over (r, μ), in the coordinates of Bruneton 2017: distance to the horizon, and distance to the top
/// between its extremes.
struct Columns {
    table: Vec<Amounts>,
}

impl Columns {
    fn new() -> Self {
        use steradian_parallel::prelude::*;
        let h = (TOP * TOP - GROUND * GROUND).sqrt();
        let table = (0..RADII * COSINES)
            .into_par_iter()
            .map(|k| {
                let rho = h * (k / COSINES) as f64 / (RADII - 1) as f64;
                let r = rho.hypot(GROUND);
                let (low, high) = (TOP - r, rho + h);
                let d = low + (high - low) * (k % COSINES) as f64 / (COSINES - 1) as f64;
                let mu = if d > 0.0 { (h * h - rho * rho - d * d) / (2.0 * r * d) } else { 1.0 };
                column(r, mu.clamp(-1.0, 1.0))
            })
            .collect();
        Self { table }
    }

    fn look_up(&self, r: f64, mu: f64) -> Amounts {
        let h = (TOP * TOP - GROUND * GROUND).sqrt();
        let rho = (r * r - GROUND * GROUND).max(0.0).sqrt();
        let (low, high) = (TOP - r, rho + h);
        let x = (to_top(r, mu) - low) / (high - low) * (COSINES - 1) as f64;
        let (j, u) = cell(rho / h * (RADII - 1) as f64, RADII);
        let (i, v) = cell(x, COSINES);
        let at = |j: usize, i: usize| self.table[j * COSINES + i];
        let (a, b, c, d) = (at(j, i), at(j, i + 1), at(j + 1, i), at(j + 1, i + 1));
        std::array::from_fn(|k| (1.0 - u) * ((1.0 - v) * a[k] + v * b[k]) + u * ((1.0 - v) * c[k] + v * d[k]))
    }
}

/// Cell and fraction of a coordinate in a table of `n` nodes.
pub(super) fn cell(x: f64, n: usize) -> (usize, f64) {
    let x = x.clamp(0.0, (n - 1) as f64);
    let i = (x as usize).min(n - 2);
    (i, x - i as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertical_columns_are_the_scale_heights() {
        let c = column(GROUND, 1.0);
        for (a, e) in c.iter().zip([RAYLEIGH_HEIGHT, AEROSOL_HEIGHT, 15_000.0]) {
            assert!((a / e - 1.0).abs() < 2e-3, "{a} {e}");
        }
        // Sea-level Rayleigh optical depth at 550 nm is about 0.098 (Bodhaine et al. 1999).
        let tau = 1.24062e-6 * 0.55_f64.powi(-4) * c[0];
        assert!((tau - 0.098).abs() < 0.012, "{tau}");
    }

    #[test]
    fn the_table_is_the_integral() {
        let columns = Columns::new();
        for (h, mu) in
            [(0.0, 0.0), (2.0, 0.01), (500.0, 0.3), (3000.0, -0.02), (20_000.0, -0.07), (50_000.0, 0.9)]
        {
            let (a, b) = (columns.look_up(GROUND + h, mu), column(GROUND + h, mu));
            for k in 0..2 {
                assert!((a[k] - b[k]).abs() < 0.03 * b[k] + 1.0, "{h} {mu}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn phase_functions_integrate_to_one() {
        for phase in [rayleigh_phase, aerosol_phase] {
            let n = 20_000;
            let sum: f64 = (0..n).map(|i| phase(-1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n))).sum();
            assert!((sum * 4.0 * std::f64::consts::PI / f64::from(n) - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn low_suns_are_red_and_set_suns_dark() {
        let air = Air::new(3.0);
        let t = air.sunlight(GROUND + 2.0, 0.02);
        assert!(t[1] < 0.02 * t[BINS - 1]);
        assert_eq!(air.sunlight(GROUND + 2.0, -0.05), [0.0; BINS]);
        let noon = air.sunlight(GROUND, 1.0);
        assert!(noon[8] > 0.6 && noon[8] < 0.9, "{}", noon[8]);
    }
}
