//! The geometry's factor: the part of the light that each site does not see (section 3.3 of the paper).
//!
//! A site keeps its blocked directions, as coefficients of spherical harmonics over world axes: those of the
//! open hemisphere about its normal less those of its visibility v. They are zero, to the bit, where nothing
//! stands in the way, and stay so between sites, however normals turn there. With o_l the coefficients of the
//! open hemisphere, ½, ¾, 0, −7/16, … as a series in P_l(n·d), the visibility in direction d is
//!
//! > **V(d) = 1 − Σ A_l b_lm y_lm(d) / Σ A_l o_l P_l(n·d)**, cut to 0 … 1
//!
//! the ratio of the site's visibility to an open site's in the same few bands. A_l = 1 gives V at the mean of
//! a lobe (eq. 7); A_l the zonal coefficients of the lobe's Gaussian give the mean of V over the lobe's part
//! above the horizon. One band is the fraction of the hemisphere that nothing blocks, v_00 √4π/2π (the
//! "ambient visibility" of figure 7). Below the horizon, where V is not defined, it is read at the horizon
//! above; the denominator is ½ there and more elsewhere.

use super::GaussianLobes;
use super::params::Params;
use crate::shared::geometry::transport::{self, PerSite};
use crate::shared::points::batch::{Lanes, WIDTH};
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Geometry, Part, Points, Technique};
use steradian_base::Task;
use steradian_sphere::sh;
use steradian_transfer::Settings;

/// Most bands.
pub(super) const MOST: usize = 4;
/// Bands of the transfer of the diffuse part: those of `prt_diffuse`.
pub(super) const DIFFUSE: usize = 5;

/// Occlusion of the sites.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Blocked {
    /// Coefficients of 1 − V over the hemisphere, bands² a site.
    pub visibility: PerSite,
    /// Coefficients of blocked irradiance, ∫ (1 − V) (n·w)₊ y_lm dw, [`DIFFUSE`]² a site.
    pub irradiance: PerSite,
    /// Normals.
    pub normals: PerSite,
}

impl Blocked {
    pub(super) fn new(g: Option<&Geometry>, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let Some(g) = g.filter(|_| p.is_shadowed()) else { return Ok(Self::default()) };
        let slug = GaussianLobes::CARD.slug;
        let settings = Settings { bands: DIFFUSE, tolerance: p.precision, ..Settings::default() };
        let t = transport::bake(slug, g, [0.0; 3], settings, task)?;
        let sites = transport::sites(slug, g)?;
        let bands = p.bands();
        let (cosine, plain) = (sh::zonal::cosine(DIFFUSE - 1), sh::zonal::phong(bands - 1, 0.0));
        let (n, wide) = (DIFFUSE * DIFFUSE, t.wide * t.wide);
        let per = |stride| PerSite { stride, data: Vec::with_capacity(stride * sites.len()) };
        let mut out = Self { visibility: per(bands * bands), irradiance: per(n), normals: per(3) };
        let mut y = vec![0.0; n];
        for (k, site) in sites.iter().enumerate() {
            let normal = site.n.as_dvec3().normalize_or_zero();
            sh::eval(DIFFUSE - 1, normal, &mut y);
            // Where nothing is blocked, transfer is the closed form of the open hemisphere, rounded as here:
            // the difference is exactly 0.
            let less = |open: &[f64], seen: &[f32], i: usize| match site.is_absent() {
                true => 0.0,
                false => (open[i.isqrt()] * y[i]) as f32 - seen[i],
            };
            let (v, t) = (&t.v[k * wide..], &t.t[k * n..]);
            out.visibility.data.extend((0..bands * bands).map(|i| less(&plain, v, i)));
            out.irradiance.data.extend((0..n).map(|i| less(&cosine, t, i)));
            out.normals.data.extend(normal.as_vec3().to_array());
        }
        Ok(out)
    }

    /// The bands of visibility; 0 where none is kept.
    pub(super) fn bands(&self) -> usize {
        self.visibility.stride.isqrt().min(MOST)
    }
}

impl Part for Blocked {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        if self.visibility.stride > 0 {
            self.visibility.save(to, &format!("{prefix}.blocked"));
            self.irradiance.save(to, &format!("{prefix}.blocked_irradiance"));
            self.normals.save(to, &format!("{prefix}.normals"));
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.blocked");
        if !from.tensors.contains_key(&format!("{name}.sites")) {
            return Ok(Self::default());
        }
        let visibility = PerSite::load(from, &name)?;
        let sites = visibility.data.len() / visibility.stride.max(1);
        let of = |name: String, stride: usize| {
            let part = PerSite::load(from, &name)?;
            let fits = part.stride == stride && part.data.len() == stride * sites;
            if fits { Ok(part) } else { Err(PartError::Unexpected(name)) }
        };
        if ![1, 4, 9, 16].contains(&visibility.stride) {
            return Err(PartError::Unexpected(name));
        }
        Ok(Self {
            visibility,
            irradiance: of(format!("{prefix}.blocked_irradiance"), DIFFUSE * DIFFUSE)?,
            normals: of(format!("{prefix}.normals"), 3)?,
        })
    }

    fn bytes(&self) -> usize {
        self.visibility.bytes() + self.irradiance.bytes()
    }
}

/// Coefficients of 1 − V at the points of a block, interpolated; those of bands that are not stored are 0.
/// Points off the mesh, and absent sites, see everything.
#[inline(always)]
pub(super) fn at<const BANDS: usize>(
    blocked: &PerSite,
    q: &Points<'_>,
    points: &[usize; WIDTH],
) -> [Lanes; MOST * MOST] {
    let mut out = [[0.0; WIDTH]; MOST * MOST];
    if BANDS == 0 || q.site.index.iter().any(|s| s.is_empty()) || q.site.weight.iter().any(|s| s.is_empty()) {
        return out;
    }
    for (lane, i) in points.iter().enumerate() {
        let mut b = [0.0; MOST * MOST];
        let [u, v] = q.site.weight.map(|w| w[*i]);
        for (index, w) in q.site.index.iter().zip([1.0 - u - v, u, v]) {
            if let Some(site) = blocked.at(index[*i]).and_then(|s| s.get(..BANDS * BANDS)) {
                (0..BANDS * BANDS).for_each(|k| b[k] += w * site[k]);
            }
        }
        (0..BANDS * BANDS).for_each(|k| out[k][lane] = b[k]);
    }
    out
}

/// Σ A_l b_lm y_lm(d) of the coefficients `b`; `zonal` holds A_1, A_2 and A_3.
#[inline(always)]
fn sum<const BANDS: usize>(b: &[f32; MOST * MOST], zonal: [f32; 4], [x, y, z]: [f32; 3]) -> f32 {
    let mut sum = 0.282_094_8 * b[0];
    if BANDS > 1 {
        sum += zonal[0] * 0.488_602_5 * (b[1] * y + b[2] * z + b[3] * x);
    }
    if BANDS > 2 {
        let cross = 1.092_548_4 * (b[4] * x * y + b[5] * y * z + b[7] * x * z);
        let square = 0.315_391_57 * b[6] * (3.0 * z * z - 1.0) + 0.546_274_2 * b[8] * (x * x - y * y);
        sum += zonal[1] * (cross + square);
    }
    if BANDS > 3 {
        let third = 0.590_043_6 * (b[9] * y * (3.0 * x * x - y * y) + b[15] * x * (x * x - 3.0 * y * y));
        let second = 2.890_611_4 * b[10] * x * y * z + 1.445_305_7 * b[14] * z * (x * x - y * y);
        let first = 0.457_045_8 * (b[11] * y + b[13] * x) * (5.0 * z * z - 1.0);
        sum += zonal[2] * (third + second + first + 0.373_176_34 * b[12] * z * (5.0 * z * z - 3.0));
    }
    sum
}

/// Σ A_l o_l P_l(c) of an open site, c = n·d.
#[inline(always)]
fn open<const BANDS: usize>(zonal: [f32; 4], c: f32) -> f32 {
    let mut sum = 0.5;
    if BANDS > 1 {
        sum += zonal[0] * 0.75 * c;
    }
    if BANDS > 3 {
        sum -= zonal[2] * 0.21875 * c * (5.0 * c * c - 3.0);
    }
    sum
}

/// V in direction `d`, not cut yet.
#[inline(always)]
pub(super) fn ratio<const BANDS: usize>(
    b: &[f32; MOST * MOST],
    n: [f32; 3],
    zonal: [f32; 4],
    d: [f32; 3],
) -> f32 {
    if BANDS == 0 {
        return 1.0;
    }
    if BANDS == 1 {
        return 1.0 - 2.0 * sum::<BANDS>(b, zonal, d);
    }
    let c = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
    // Directions below the horizon take the value at the horizon; means of directions near the normal are
    // shorter than 1.
    let below = c.min(0.0);
    let d: [f32; 3] = std::array::from_fn(|k| d[k] - below * n[k]);
    let scale = 1.0 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).max(1e-12).sqrt();
    1.0 - sum::<BANDS>(b, zonal, d.map(|x| scale * x)) / open::<BANDS>(zonal, scale * c.max(0.0))
}
