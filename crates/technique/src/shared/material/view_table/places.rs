//! Reflectance whose lobe's widths vary over a surface: Kautz, Sloan & Snyder (2002), section 3, "a
//! higher-dimensional c_i(v, q) table indexed by whichever parameters q are to be spatially varied".
//!
//! Where the widths (or exponents) of all texels lie, in their logarithms, is a point, a line or a box. Nodes
//! lie on it at equal distances, each with a table of its own, and c_i(wo, q) is linear between the two, or
//! bilinear between the four, nodes around q. A texture holds where texels lie among the nodes; under a
//! footprint it is averaged, that is the logarithms of the widths are.

use crate::BakeError;
use crate::shared::surface::texels::TextureLayers;
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use std::sync::Arc;
use steradian_base::{Cancelled, Task};
use steradian_brdf::views::paraboloid::ring;
use steradian_brdf::views::{Projection, Rule};
use steradian_brdf::{Brdf, SharedBrdf, with_widths};
use steradian_parallel::prelude::*;
use steradian_scene::surface::{Texture, Wrap};

/// Name of the plane of widths.
pub const PLANE: &str = "widths";
/// Most nodes along an axis.
pub const MOST_NODES: usize = 65;
/// Most nodes along an axis that are chosen automatically: on a line, and along each side of a box.
const AUTO: [usize; 2] = [17, 9];
/// Target error between nodes, by which their number is chosen.
const BETWEEN: f64 = 0.01;
/// Widths whose logarithms differ by less than this, or from a line by less, count as one point or as a line.
const NEAR: f64 = 1e-3;
/// Angles of view, degrees, at which the error between nodes is measured.
const DEGREES: [f64; 5] = [8.0, 28.0, 48.0, 68.0, 83.0];
/// Number of texels that certificates use.
const LOOKED_AT: usize = 64;

/// The nodes of widths, and where each texel lies among them.
#[derive(Debug, Clone)]
pub struct Places {
    /// Logarithms of the widths of the first node.
    first: [f64; 2],
    /// Steps from node to node along both axes.
    steps: [[f64; 2]; 2],
    /// Nodes along both axes; 1 along one on which nothing varies, the second before the first.
    nodes: [usize; 2],
    /// Positions of the texels along both axes, in nodes: 0 to the number of nodes less one.
    texels: TextureLayers,
}

/// Up to four nodes around a point, and their weights.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Nodes.
    pub nodes: [usize; 4],
    /// Weights, of sum 1.
    pub weights: [f32; 4],
}

impl Places {
    /// Chooses nodes for a plane of widths of `brdf`, red along the tangent and green along the bitangent,
    /// and places its texels among them: `nodes` along an axis, or as many as bring the error between nodes
    /// to 1 %, at most 17 on a line and 9 along each side of a box.
    pub fn new(
        slug: &'static str,
        brdf: &dyn Brdf,
        plane: &Texture,
        nodes: Option<usize>,
        task: &Task,
    ) -> Result<Self, BakeError> {
        let refused = |e: steradian_brdf::SpecError| BakeError::Material { slug, why: e.to_string() };
        let round = steradian_brdf::width_names(brdf).is_none_or(|[a, b]| a == b);
        let (width, height, texels) = plane.levels().next().unwrap_or((1, 1, &[[1.0; 3]]));
        let logarithms: Vec<[f64; 2]> = texels
            .iter()
            .map(|t| [t[0], if round { t[0] } else { t[1] }].map(|x| f64::from(x).max(1e-30).ln()))
            .collect();
        let mut out = Self::around(&logarithms);
        // The widths of all nodes are ones that the model takes if those of the corners are.
        for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            with_widths(brdf, out.widths(corner)).map_err(refused)?;
        }
        out.divide(brdf, nodes, task)?;
        let places: Vec<[f64; 2]> = logarithms.iter().map(|q| out.place(*q)).collect();
        let planes = [0, 1].map(|k| places.iter().map(|p| p[k] as f32).collect::<Vec<f32>>());
        let [x, y] = planes;
        let zero = vec![0.0; x.len()];
        let texture = Texture::new(width, height, &[x, y, zero]).map(|t| Arc::new(t.with_wrap(plane.wrap())));
        out.texels = TextureLayers::new(texture.into_iter().collect());
        Ok(out)
    }

    /// The line or the box around widths, with a node at each end.
    fn around(all: &[[f64; 2]]) -> Self {
        let least = [0, 1].map(|k| all.iter().map(|q| q[k]).fold(f64::INFINITY, f64::min));
        let most = [0, 1].map(|k| all.iter().map(|q| q[k]).fold(f64::NEG_INFINITY, f64::max));
        let far = |from: [f64; 2]| {
            let distance = |q: &&[f64; 2]| (q[0] - from[0]).hypot(q[1] - from[1]);
            all.iter().max_by(|a, b| distance(a).total_cmp(&distance(b))).copied().unwrap_or(from)
        };
        let texels = TextureLayers::new(Vec::new());
        // The ends of a line are the texels farthest apart.
        let a = far(least);
        let b = far(a);
        let d = [b[0] - a[0], b[1] - a[1]];
        let length = d[0].hypot(d[1]);
        if length <= NEAR {
            return Self { first: a, steps: [[0.0; 2]; 2], nodes: [1, 1], texels };
        }
        let off = |q: &[f64; 2]| ((q[0] - a[0]) * d[1] - (q[1] - a[1]) * d[0]).abs() / length;
        if all.iter().all(|q| off(q) <= NEAR) {
            return Self { first: a, steps: [d, [0.0; 2]], nodes: [2, 1], texels };
        }
        let steps = [[most[0] - least[0], 0.0], [0.0, most[1] - least[1]]];
        Self { first: least, steps, nodes: [2, 2], texels }
    }

    /// Divides each axis into `asked` nodes, or into as many as the error between them requires.
    fn divide(&mut self, brdf: &dyn Brdf, asked: Option<usize>, task: &Task) -> Result<(), Cancelled> {
        let most = if self.nodes[1] > 1 { AUTO[1] } else { AUTO[0] };
        for axis in 0..2 {
            if self.nodes[axis] == 1 {
                continue;
            }
            let count = match asked {
                Some(n) => n.clamp(2, MOST_NODES),
                None => {
                    let mut one = Self { nodes: [1, 1], ..self.clone() };
                    // Errors fall like the square of the distance, once that is small.
                    let mut count = 3;
                    loop {
                        one.nodes[axis] = count;
                        one.steps[axis] = self.steps[axis].map(|s| s / (count - 1) as f64);
                        let error = one.between(brdf, task)?;
                        if error <= BETWEEN || count == most {
                            break count;
                        }
                        let next = 1.0 + (count - 1) as f64 * (error / BETWEEN).sqrt();
                        count = (next.ceil() as usize).clamp(count + 1, most);
                    }
                }
            };
            self.steps[axis] = self.steps[axis].map(|s| s / (count - 1) as f64);
            self.nodes[axis] = count;
        }
        Ok(())
    }

    /// Relative RMS error of the coefficients half-way between nodes, over views at some angles.
    pub fn between(&self, brdf: &dyn Brdf, task: &Task) -> Result<f64, Cancelled> {
        const ORDER: usize = 4;
        let rule = Rule::new(ORDER);
        let cells: Vec<[usize; 2]> = {
            let count = self.nodes.map(|n| (n - 1).max(1));
            (0..count[0] * count[1]).map(|k| [k % count[0], k / count[0]]).collect()
        };
        if self.nodes == [1, 1] {
            return Ok(0.0);
        }
        let at = |cell: &[usize; 2]| {
            task.check()?;
            let of = |offset: [f64; 2]| {
                let place = [0, 1].map(|k| (cell[k] as f64 + offset[k]).min((self.nodes[k] - 1) as f64));
                with_widths(brdf, self.widths(place)).ok()
            };
            let there = |o: &[f64; 2]| (0..2).all(|k| o[k] == 0.0 || self.nodes[k] > 1);
            let corners: Vec<SharedBrdf> = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
                .into_iter()
                .filter(there)
                .filter_map(of)
                .collect();
            let Some(middle) = of([0.5, 0.5]) else { return Ok([0.0; 2]) };
            let mut sums = [0.0; 2];
            for degrees in DEGREES {
                let theta = f64::to_radians(degrees);
                // Views round the circle, if any of them are anisotropic.
                let views =
                    corners.iter().map(|c| ring(&**c, theta)).max_by_key(Vec::len).unwrap_or_default();
                for wo in &views {
                    let of = |f: &SharedBrdf| rule.project(&**f, *wo);
                    let near: Vec<Projection> = corners.iter().map(of).collect();
                    let exact = of(&middle);
                    let weight = theta.sin() / views.len() as f64;
                    for c in 0..3 {
                        for (k, e) in exact.c[c].iter().enumerate() {
                            let mean = near.iter().map(|p| p.c[c][k]).sum::<f64>() / near.len() as f64;
                            sums[0] += weight * (mean - e).powi(2);
                            sums[1] += weight * e * e;
                        }
                    }
                }
            }
            Ok(sums)
        };
        let all: Result<Vec<[f64; 2]>, Cancelled> = cells.par_iter().map(at).collect();
        // Relative to the energy of its own cell: narrow lobes have larger coefficients.
        let worst = |s: &[f64; 2]| if s[1] > 0.0 { (s[0] / s[1]).sqrt() } else { 0.0 };
        Ok(all?.iter().map(worst).fold(0.0, f64::max))
    }

    /// The widths at a place, in single precision as the plane has them: logarithms are not exact.
    fn widths(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let at = |k: usize| (self.first[k] + x * self.steps[0][k] + y * self.steps[1][k]).exp();
        [0, 1].map(|k| f64::from(at(k) as f32))
    }

    /// The place of the logarithms of widths.
    fn place(&self, q: [f64; 2]) -> [f64; 2] {
        let d = [q[0] - self.first[0], q[1] - self.first[1]];
        [0, 1].map(|k| {
            let s = self.steps[k];
            let square = s[0] * s[0] + s[1] * s[1];
            if square > 0.0 {
                ((d[0] * s[0] + d[1] * s[1]) / square).clamp(0.0, (self.nodes[k] - 1) as f64)
            } else {
                0.0
            }
        })
    }

    /// Nodes along both axes.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// The reflectance of each node, the first axis fastest.
    pub fn reflectances(&self, slug: &'static str, brdf: &dyn Brdf) -> Result<Vec<SharedBrdf>, BakeError> {
        let at = |k: usize| {
            let place = [k % self.nodes[0], k / self.nodes[0]].map(|x| x as f64);
            with_widths(brdf, self.widths(place))
                .map_err(|e| BakeError::Material { slug, why: e.to_string() })
        };
        (0..self.nodes[0] * self.nodes[1]).map(at).collect()
    }

    /// Texture coordinates of some texels' centres, spread over the texture, and the reflectance there.
    pub fn looked_at(&self, brdf: &dyn Brdf) -> Vec<([f32; 2], SharedBrdf)> {
        let (width, height) = self.texels.size();
        let at = |k: usize| {
            let u = |by: f64, n: usize| (((k as f64 * by + 0.5).fract() * n as f64).floor() + 0.5) / n as f64;
            let uv = [u(0.754_877_666, width), u(0.569_840_291, height)].map(|x| x as f32);
            let [x, y, _] = self.texels.sample(0, uv, 0.0).map(f64::from);
            Some((uv, with_widths(brdf, self.widths([x, y])).ok()?))
        };
        (0..LOOKED_AT).filter_map(at).collect()
    }

    /// The nodes around a point at these texture coordinates, its texture averaged over a square of side
    /// `footprint`.
    #[inline]
    pub fn at(&self, uv: [f32; 2], footprint: f32) -> Place {
        let [x, y, _] = self.texels.sample(0, uv, footprint);
        let axis = |x: f32, n: usize| {
            let cell = (x.max(0.0) as usize).min(n.saturating_sub(2));
            (cell, (x - cell as f32).clamp(0.0, 1.0))
        };
        let ((i, u), (j, v)) = (axis(x, self.nodes[0]), axis(y, self.nodes[1]));
        let n = self.nodes[0];
        let (right, down) = ((i + 1).min(n - 1), (j + 1).min(self.nodes[1] - 1));
        Place {
            nodes: [j * n + i, j * n + right, down * n + i, down * n + right],
            weights: [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v],
        }
    }

    /// Number of nodes between which a point interpolates: 1, 2 or 4. (Where only one axis has nodes, it is
    /// the first.)
    #[inline]
    pub fn around_each(&self) -> usize {
        self.nodes.iter().map(|n| (*n).min(2)).product()
    }

    /// The places as a table for a GPU.
    pub fn table(&self) -> crate::gpu::Table {
        self.texels.table("places")
    }

    /// Bytes of the places.
    pub fn bytes(&self) -> usize {
        self.texels.bytes()
    }

    /// Writes them under names that begin with `prefix`.
    pub fn save(&self, to: &mut TensorFile, prefix: &str) {
        let (width, height) = self.texels.size();
        let word = |w: Wrap| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].iter().position(|o| *o == w);
        let wrap = self.texels.wrap().map(|w| word(w).unwrap_or_default() as f64);
        let numbers =
            [&self.first[..], self.steps.as_flattened(), &self.nodes.map(|n| n as f64), &wrap].concat();
        put_f64(to, format!("{prefix}.nodes"), vec![numbers.len()], numbers);
        let texel = |k: usize| {
            let (u, v) = ((k % width) as f32 + 0.5, (k / width) as f32 + 0.5);
            let [x, y, _] = self.texels.sample(0, [u / width as f32, v / height as f32], 0.0);
            [x, y]
        };
        let all = (0..width * height).flat_map(texel).collect();
        put_f32(to, format!("{prefix}.places"), vec![height, width, 2], all);
    }

    /// Reads nodes that [`Places::save`] wrote; `None` where the file has none.
    pub fn load(from: &TensorFile, prefix: &str) -> Result<Option<Self>, PartError> {
        let name = format!("{prefix}.nodes");
        if !from.tensors.contains_key(&name) {
            return Ok(None);
        }
        let bad = |name: &str| PartError::Unexpected(name.into());
        let (_, v) = get_f64(from, &name, 1)?;
        let [a, b, c, d, e, f, x, y, u, w] = v[..] else { return Err(bad(&name)) };
        let whole = |x: f64, most: usize| Some(x as usize).filter(|n| *n as f64 == x && *n <= most);
        let wrap = |x: f64| whole(x, 2).map(|k| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][k]);
        let count = |x: f64| whole(x, MOST_NODES).filter(|n| *n >= 1);
        let (Some(nx), Some(ny), Some(u), Some(w)) = (count(x), count(y), wrap(u), wrap(w)) else {
            return Err(bad(&name));
        };
        let name = format!("{prefix}.places");
        let (shape, all) = get_f32(from, &name, 3)?;
        let plane = |k: usize| all.iter().skip(k).step_by(2).copied().collect::<Vec<f32>>();
        let texture = Texture::new(shape[1], shape[0], &[plane(0), plane(1), vec![0.0; all.len() / 2]]);
        let texture = texture.filter(|_| shape[2] == 2 && all.iter().all(|x| x.is_finite()));
        let texture = Arc::new(texture.ok_or_else(|| bad(&name))?.with_wrap([u, w]));
        let texels = TextureLayers::new(vec![texture]);
        Ok(Some(Self { first: [a, b], steps: [[c, d], [e, f]], nodes: [nx, ny], texels }))
    }
}
