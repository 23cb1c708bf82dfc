//! One lookup along C for all maps, summed with y_pq(wo'), and the suns that are shaded exactly; `shade.wgsl`
//! has the same functions.

use super::Shrm;
use crate::gpu::{Entry, Uniform, Value};
use crate::shared::light::exact::{self, TurnedSuns};
use crate::shared::maths::harmonics::{self, MAX_TERMS};
use crate::shared::points::batch::{self, Point};
use crate::shared::points::central::central;
use crate::shared::shrm;
use crate::shared::tables::bundle::Bundle;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique};
use steradian_brdf::central::Argument;

pub(super) fn shade(b: &Bake<Shrm>, shown: &TurnedSuns, q: &Points<'_>, out: &mut Radiance<'_>) {
    let (m, turn) = (&b.linked, &shown.turn);
    let mut one = [0.0; MAX_TERMS];
    one[0] = 1.0;
    let of_view = m.of == Argument::View;
    batch::shade(q, out, |p: Point| {
        let c = central(m.centre, turn, q, &p);
        let mut y = [0.0; MAX_TERMS];
        let of = if of_view { p.wo } else { p.n };
        m.harmonics.eval(harmonics::local(c, turn.apply(of)), &mut y);
        let b = m.maps.sum(m.maps.taps(c), &y);
        let a = m.scale.at(p.cos_o);
        let diffuse = |d: &Bundle| d.sum(d.taps(turn.apply(p.n)), &one);
        let d = m.diffuse.as_ref().map_or([0.0; 3], diffuse);
        std::array::from_fn(|k| a[k] * b[k] + d[k])
    });
    shown.add(b.material.brdf.as_ref(), q, out);
}

pub(super) fn gpu(b: &Bake<Shrm>, shown: &TurnedSuns) -> GpuTechnique {
    let m = &b.linked;
    let [first, inverse] = m.scale.range();
    let orders =
        [m.harmonics.p() as f32, m.harmonics.q() as f32, m.centre.number() as f32, m.of.number() as f32];
    let mut tables = vec![m.maps.table("maps"), shrm::scale_table(&m.scale, "scale")];
    tables.extend(m.diffuse.as_ref().map(|d| d.table("diffuse")));
    let own = [shrm::SUM, include_str!("shade.wgsl")];
    let modules = shrm::shader(m.diffuse.is_some(), &own);
    let technique = GpuTechnique {
        slug: Shrm::CARD.slug,
        modules,
        entry: Entry::PLAIN,
        tables,
        uniforms: vec![
            Uniform { name: "orders", value: Value::Vec4(orders) },
            Uniform { name: "range", value: Value::Vec4([first, inverse, 0.0, 0.0]) },
            shown.turn.uniform(),
        ],
        buffers: Vec::new(),
    };
    exact::gpu(technique, &m.suns, b.material.brdf.as_ref())
}
