//! The maps of all nodes.

use super::ShrmSlices;
use super::choose::{Node, Scaled};
use super::material::{CANDIDATES, Leaning, Params, TOLERANCE};
use crate::shared::bundle::Bundle;
use crate::shared::harmonics::MAX_TERMS;
use crate::shared::kernels::{centre_of, word};
use crate::shared::meter::Meter;
use crate::shared::shrm::{bundle, columns, grid};
use crate::shared::spectrum::Spectrum;
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use crate::{BakeError, Part, Technique};
use std::collections::BTreeMap;
use steradian_base::{Certificate, Task};
use steradian_brdf::central::Centre;
use steradian_prefilter::shrm::{Plan, Term};

/// What shading reads.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    /// About the tangent, or near the mirror direction?
    pub centre: Centre,
    /// Places of the nodes among the candidates, ascending from 0 to the last one.
    pub places: Vec<u32>,
    /// Each node's maps: +q (and −q) for q = 0, 1, …
    pub maps: Vec<Bundle>,
    /// γ and the scale at every candidate.
    pub curve: Vec<[f32; 4]>,
    /// The node before each interval between candidates.
    pub before: Vec<u32>,
    halves: bool,
}

/// The node before each interval between candidates.
fn before(places: &[u32]) -> Vec<u32> {
    let node = |i: u32| (places.partition_point(|p| *p <= i) - 1).min(places.len() - 2) as u32;
    (0..CANDIDATES as u32 - 1).map(node).collect()
}

/// Joins light and slices; the certificate is computed from both.
pub fn link(
    light: &Spectrum,
    material: &Leaning,
    p: &Params,
    task: &Task,
) -> Result<(Stack, Certificate), BakeError> {
    let slug = ShrmSlices::CARD.slug;
    let s = &material.0.0;
    let meter = Meter::new(light);
    let scaled = Scaled::new(s, &meter);
    let tolerance = task.tolerance().unwrap_or(TOLERANCE);
    let nodes = scaled.choose(tolerance, p, p.budget(task));
    let need = 2 * nodes.iter().map(Node::bytes).sum::<usize>() as u64;
    if need > task.max_memory() {
        return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
    }
    let mut maps = all_maps(slug, light, &scaled, &nodes, task)?;
    if p.halves {
        maps.iter_mut().for_each(Bundle::halve);
    }
    let curve = |(i, a): (usize, &[f64; 3])| [s.slices[i].gamma, a[0], a[1], a[2]].map(|x| x as f32);
    let places: Vec<u32> = nodes.iter().map(|n| n.candidate as u32).collect();
    let stack = Stack {
        centre: s.centre,
        before: before(&places),
        places,
        maps,
        curve: scaled.scale.iter().enumerate().map(curve).collect(),
        halves: p.halves,
    };
    Ok((stack, scaled.certify(&nodes)))
}

/// Nodes of one size share a plan.
fn all_maps(
    slug: &'static str,
    light: &Spectrum,
    scaled: &Scaled<'_>,
    nodes: &[Node],
    task: &Task,
) -> Result<Vec<Bundle>, BakeError> {
    let mut sizes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    nodes.iter().enumerate().for_each(|(i, n)| sizes.entry(n.size).or_default().push(i));
    let mut made: BTreeMap<usize, Bundle> = BTreeMap::new();
    for (size, members) in sizes {
        let most = |of: &dyn Fn(&Node) -> usize| members.iter().map(|&i| of(&nodes[i])).max().unwrap_or(0);
        let order = most(&|n| n.f).min(light.sh.order);
        let plan = Plan::new(order, most(&|n| n.q), grid(size));
        let light = columns(light, order);
        for i in members {
            let n = &nodes[i];
            let rows: Vec<[Vec<f64>; 3]> = (0..=n.q)
                .map(|q| {
                    std::array::from_fn(|c| {
                        let mut k = scaled.kappa(n.candidate, q, c);
                        k.truncate(n.f + 1);
                        k
                    })
                })
                .collect();
            let rows = rows.iter().enumerate();
            let terms: Vec<_> = rows.map(|(q, k)| Term { q, k: [&k[0][..], &k[1], &k[2]] }).collect();
            made.insert(i, bundle(slug, &plan.maps(&light, &terms, task)?)?);
        }
    }
    Ok(made.into_values().collect())
}

impl Part for Stack {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, format!("{prefix}.centre"), vec![1], vec![word(self.centre)]);
        let places = self.places.iter().map(|p| f64::from(*p)).collect();
        put_f64(to, format!("{prefix}.nodes"), vec![self.places.len()], places);
        put_f32(to, format!("{prefix}.curve"), vec![self.curve.len(), 4], self.curve.concat());
        for (i, m) in self.maps.iter().enumerate() {
            m.save(to, format!("{prefix}.slice{i:02}"), self.halves);
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let bad = |name: &str| PartError::Unexpected(format!("{prefix}.{name}"));
        let (_, head) = get_f64(from, &format!("{prefix}.centre"), 1)?;
        let centre = head.first().and_then(|w| centre_of(*w)).ok_or_else(|| bad("centre"))?;
        let (_, nodes) = get_f64(from, &format!("{prefix}.nodes"), 1)?;
        let places: Vec<u32> = nodes.iter().map(|p| *p as u32).collect();
        let whole = places.is_sorted_by(|a, b| a < b) && places.first() == Some(&0);
        if !whole || places.last() != Some(&(CANDIDATES as u32 - 1)) {
            return Err(bad("nodes"));
        }
        let (shape, curve) = get_f32(from, &format!("{prefix}.curve"), 2)?;
        if shape != [CANDIDATES, 4] {
            return Err(bad("curve"));
        }
        let name = |i: usize| format!("{prefix}.slice{i:02}");
        let maps = (0..places.len()).map(|i| Bundle::load(from, &name(i))).collect::<Result<Vec<_>, _>>()?;
        if maps.iter().any(|m| !m.is_globe() || m.terms() % 2 == 0 || m.terms() > MAX_TERMS) {
            return Err(bad("slice"));
        }
        let halves = Bundle::is_half(from, &name(0));
        let curve = curve.as_chunks::<4>().0.to_vec();
        Ok(Self { centre, before: before(&places), places, maps, curve, halves })
    }

    fn bytes(&self) -> usize {
        self.maps.iter().map(Bundle::bytes).sum::<usize>() + 16 * self.curve.len() + 8 * self.before.len()
    }
}
