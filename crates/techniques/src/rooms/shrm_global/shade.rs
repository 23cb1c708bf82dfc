//! One lookup along C, summed with y_pq(wo) (per point, or once per frame); `shade.wgsl` has the same
//! functions.

use super::ShrmGlobal;
use super::bake::Cubes;
use crate::gpu::{Entry, Uniform, Value};
use crate::shared::light::exact::{self, TurnedSuns};
use crate::shared::maths::harmonics::MAX_TERMS;
use crate::shared::maths::vector::dot;
use crate::shared::points::batch::{self, Point};
use crate::shared::points::central::central;
use crate::shared::shrm;
use crate::shared::tables::bundle::Bundle;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use steradian_brdf::central::Argument;

/// The state of a frame.
#[derive(Debug, Clone, Default)]
pub struct Now {
    /// The light.
    pub shown: TurnedSuns,
    /// The far viewer's reflection map.
    pub map: Option<Bundle>,
}

impl Now {
    /// The state for a view.
    pub fn renew(&mut self, c: &Cubes, v: &View) {
        self.shown = TurnedSuns::new(&c.suns, v);
        let wo = self.shown.turn.apply((-v.forward).to_array());
        let weigh = |d: [f32; 3], y: &mut [f32; MAX_TERMS]| {
            c.harmonics.eval(c.seen(d, wo, half(d, wo)), y);
        };
        self.map = c.distant.then(|| c.maps.summed(weigh));
    }
}

/// The normal whose mirror direction of `wo` is `c`.
fn half(c: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let sum: [f32; 3] = std::array::from_fn(|k| c[k] + wo[k]);
    let length = dot(sum, sum).sqrt();
    // At the horizon every normal has it.
    if length > 1e-6 { sum.map(|x| x / length) } else { c }
}

impl Cubes {
    /// Argument of y_pq: the view or the normal, in the light's frame, or where q = 0 alone is needed its
    /// cosine with C.
    #[inline(always)]
    fn seen(&self, c: [f32; 3], wo: [f32; 3], n: [f32; 3]) -> [f32; 3] {
        let of = if self.of == Argument::View { wo } else { n };
        if self.harmonics.q() == 0 { [0.0, 0.0, dot(c, of)] } else { of }
    }
}

pub(super) fn shade(b: &Bake<ShrmGlobal>, now: &Now, q: &Points<'_>, out: &mut Radiance<'_>) {
    let m = &b.linked;
    let mut one = [0.0; MAX_TERMS];
    one[0] = 1.0;
    let turn = &now.shown.turn;
    batch::shade(q, out, |p: Point| {
        let c = central(m.centre, turn, q, &p);
        let b = match &now.map {
            Some(map) => map.sum(map.taps(c), &one),
            None => {
                let mut y = [0.0; MAX_TERMS];
                m.harmonics.eval(m.seen(c, turn.apply(p.wo), turn.apply(p.n)), &mut y);
                m.maps.sum(m.maps.taps(c), &y)
            }
        };
        let a = m.scale.at(p.cos_o);
        let diffuse = |d: &Bundle| d.sum(d.taps(turn.apply(p.n)), &one);
        let d = m.diffuse.as_ref().map_or([0.0; 3], diffuse);
        std::array::from_fn(|k| a[k] * b[k] + d[k])
    });
    now.shown.add(b.material.brdf.as_ref(), q, out);
}

pub(super) fn gpu(b: &Bake<ShrmGlobal>, now: &Now) -> GpuTechnique {
    let m = &b.linked;
    let [first, inverse] = m.scale.range();
    let far = now.map.is_some();
    let orders =
        [m.harmonics.p() as f32, m.harmonics.q() as f32, m.centre.number() as f32, m.of.number() as f32];
    let mut tables =
        vec![now.map.as_ref().unwrap_or(&m.maps).table("maps"), shrm::scale_table(&m.scale, "scale")];
    tables.extend(m.diffuse.as_ref().map(|d| d.table("diffuse")));
    let all = [shrm::SUM, include_str!("all.wgsl")];
    let sum: &[&'static str] = if far { &[include_str!("far.wgsl")] } else { &all };
    let modules = shrm::shader(m.diffuse.is_some(), &[sum, &[include_str!("shade.wgsl")]].concat());
    let technique = GpuTechnique {
        slug: ShrmGlobal::CARD.slug,
        modules,
        entry: Entry::PLAIN,
        tables,
        uniforms: vec![
            Uniform { name: "orders", value: Value::Vec4(orders) },
            Uniform { name: "range", value: Value::Vec4([first, inverse, 0.0, 0.0]) },
            now.shown.turn.uniform(),
        ],
        buffers: Vec::new(),
    };
    exact::gpu(technique, &m.suns, b.material.brdf.as_ref())
}
