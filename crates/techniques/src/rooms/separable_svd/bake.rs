//! The choice of coordinates and of the number of terms; the tables.

use super::coordinates::{Coordinates, Form};
use super::samples::Samples;
use crate::shared::tables::grid::GridStack;
use crate::{BakeError, Material};
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::Symmetry;
use steradian_numerics::low_rank::Factors;

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 0.01;
/// Most terms where the tolerance decides: two layers of four a texel.
const MAX_TERMS: usize = 8;
/// Default number of nodes a side.
const SIDE: usize = 64;
/// Nodes a side for the comparison of coordinates: matrices have side⁴ entries at most, 65,536 in place of
/// 16.8 million.
const TRIAL: usize = 16;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Choice of x and y.
        pub parametrisation: usize = ParamInfo::choice("parametrisation", &["auto", "hd", "vl", "hv"], "what x and y are: half vector and difference vector, view and light, or half vector and view; auto: what takes the fewest terms").numbered(0.0),
        /// Method of the decomposition.
        pub method: usize = ParamInfo::choice("method", &["svd", "nd"], "how the tables are found: singular value decomposition, or normalised decomposition, one term of means").numbered(0.0),
        /// Number of terms; where `None`, as many as the tolerance needs.
        pub terms: Option<usize> = ParamInfo::whole("terms", [1.0, 32.0], 0.0, "terms of the sum; auto: what the tolerance needs, 1 to 8").auto(0.0),
        /// Entries a side; 64 where `None`.
        pub resolution: Option<usize> = ParamInfo::whole("resolution", [8.0, 96.0], 0.0, "entries of each table a side, fewer where symmetry allows; auto: 64").auto(0.0),
    }
}

impl Params {
    fn mean(&self) -> bool {
        self.method == 1
    }
}

/// The tables.
#[derive(Debug, Clone, PartialEq)]
pub struct Tables {
    pub coordinates: Coordinates,
    /// g_k, four terms a layer.
    pub left: GridStack,
    /// h_k: a colour a layer, or four terms a layer, red, green and blue in turn, or of one where there is a
    /// tint.
    pub right: GridStack,
    /// Has a layer four terms of one of three colours?
    pub fours: bool,
    /// Number of terms.
    pub terms: usize,
    /// Colour that h is multiplied with where its terms are single numbers.
    pub tint: Option<[f32; 3]>,
    /// Relative RMS error of f · ⟨n·wi⟩ at the entries.
    pub residual: f64,
    /// σ₁/σ₀ of the singular value decomposition.
    pub ratio: Option<f64>,
}

impl Tables {
    fn new(samples: &Samples, f: &Factors, ratio: Option<f64>) -> Self {
        let coordinates = samples.coordinates;
        // A reflectance of 0 has no terms.
        let terms = f.left.len();
        let layers = terms.div_ceil(4).max(1);
        let at = |v: &[Vec<f64>], k: usize, node: usize| v.get(k).map_or(0.0, |v| v[node] as f32);
        let four =
            |v: &[Vec<f64>], layer: usize, node: usize| std::array::from_fn(|k| at(v, 4 * layer + k, node));
        let (x, y) = (coordinates.x, coordinates.y);
        let left = GridStack::new(x.width, x.height, layers, |i, j, k| four(&f.left, k, j * x.width + i));
        let grey = f.right.len() == 1;
        // The arrangement that reads fewer layers.
        let fours = !grey && 3 * layers < terms;
        let right = if grey {
            GridStack::new(y.width, y.height, layers, |i, j, k| four(&f.right[0], k, j * y.width + i))
        } else if fours {
            GridStack::new(y.width, y.height, 3 * layers, |i, j, k| {
                four(&f.right[k % 3], k / 3, j * y.width + i)
            })
        } else {
            GridStack::new(y.width, y.height, terms.max(1), |i, j, k| {
                let [r, g, b] = [0, 1, 2].map(|c| at(&f.right[c], k, j * y.width + i));
                [r, g, b, 0.0]
            })
        };
        let tint = grey.then(|| samples.tint.map(|t| t as f32));
        Self { coordinates, left, right, fours, terms, tint, residual: f.residual.sqrt(), ratio }
    }

    pub(super) fn bytes(&self) -> usize {
        self.left.bytes() + self.right.bytes()
    }
}

/// The forms among which a parameter chooses.
fn forms(choice: usize, isotropic: bool) -> Vec<Form> {
    let half = if isotropic { Form::IsotropicHalfDifference } else { Form::HalfDifference };
    match choice {
        1 => vec![half],
        2 => vec![Form::ViewLight],
        3 => vec![Form::HalfView],
        _ => vec![Form::ViewLight, half, Form::HalfView],
    }
}

/// Bytes of the matrices of these coordinates: entries with their weights, three colours, and twice the
/// solvers' work space.
fn memory(c: &Coordinates) -> u64 {
    48 * (c.x.len() * c.y.len()) as u64
}

pub(super) fn bake(m: &Material, p: &Params, task: &Task) -> Result<Tables, BakeError> {
    let symmetry = Symmetry::of(&*m.brdf);
    let tolerance = 0.5 * task.tolerance().unwrap_or(TOLERANCE);
    let range = p.terms.map_or([1, MAX_TERMS], |n| [n, n]);
    let decompose = |form, side, task: &Task| {
        let coordinates = Coordinates::new(form, symmetry, side);
        let (need, allowed) = (memory(&coordinates), task.max_memory());
        if need > allowed {
            return Err(BakeError::Memory { slug: "separable_svd", need, allowed });
        }
        let samples = Samples::new(&*m.brdf, coordinates, task)?;
        let (factors, ratio) = if p.mean() {
            (samples.normalised(), None)
        } else {
            samples.decompose(range, tolerance, task)?
        };
        Ok(Tables::new(&samples, &factors, ratio))
    };
    let mut forms = forms(p.parametrisation, symmetry.isotropic);
    if forms.len() > 1 {
        let tried: Vec<(Form, Tables)> =
            forms.iter().map(|f| Ok((*f, decompose(*f, TRIAL, task)?))).collect::<Result<_, BakeError>>()?;
        let met = |t: &Tables| t.residual <= tolerance;
        let better = |a: &&(Form, Tables), b: &&(Form, Tables)| {
            let [a, b] = [&a.1, &b.1];
            let order = met(b).cmp(&met(a));
            order.then(if met(a) { a.terms.cmp(&b.terms) } else { std::cmp::Ordering::Equal }).then(
                // Rounding decides between none.
                if met(a) { std::cmp::Ordering::Equal } else { a.residual.total_cmp(&b.residual) },
            )
        };
        forms = tried.iter().min_by(better).map(|t| t.0).into_iter().collect();
    }
    decompose(forms[0], p.resolution.unwrap_or(SIDE), task)
}
