//! Cost of a point on a GPU, in instructions counted in the shader: the paper has 54 without visibility, and
//! 107, 140 and 181 with 2, 3 and 4 bands of it.

use super::tests::{on_mesh, seen_by};
use crate::shared::trials::lights;
use crate::{Geometry, Material};
use naga::{Block, Expression, Function, Module, Statement};
use std::ops::AddAssign;
use std::sync::Arc;
use steradian_brdf::parse;

/// Number of lobes.
const K: u32 = 3;

/// Texels loaded, numbers loaded from buffers, and operations (of vectors as of numbers: one each).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Cost {
    texels: u32,
    numbers: u32,
    operations: u32,
}

impl AddAssign for Cost {
    fn add_assign(&mut self, o: Self) {
        self.texels += o.texels;
        self.numbers += o.numbers;
        self.operations += o.operations;
    }
}

impl Cost {
    fn times(self, n: u32) -> Self {
        Self { texels: n * self.texels, numbers: n * self.numbers, operations: n * self.operations }
    }

    /// The dearer of two branches.
    fn max(self, o: Self) -> Self {
        if self.texels + self.numbers + self.operations < o.texels + o.numbers + o.operations {
            o
        } else {
            self
        }
    }

    /// Cost of one evaluation of an expression.
    fn of(e: &Expression, f: &Function, module: &Module) -> Self {
        let mut out = Self::default();
        match e {
            Expression::ImageLoad { .. } | Expression::ImageSample { .. } => out.texels = 1,
            Expression::Load { pointer } => {
                let mut at = *pointer;
                while let Expression::Access { base, .. } | Expression::AccessIndex { base, .. } =
                    &f.expressions[at]
                {
                    at = *base;
                }
                if let Expression::GlobalVariable(g) = f.expressions[at]
                    && matches!(module.global_variables[g].space, naga::AddressSpace::Storage { .. })
                {
                    out.numbers = 1;
                }
            }
            Expression::Unary { .. }
            | Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Relational { .. }
            | Expression::Math { .. }
            | Expression::As { .. } => out.operations = 1,
            _ => {}
        }
        out
    }
}

/// Cost of a function in which the outermost loops run `turns(name)` times and those within once.
fn cost(f: &Function, module: &Module, turns: &dyn Fn(&str) -> u32) -> Cost {
    block(&f.body, f, module, turns, turns(f.name.as_deref().unwrap_or_default()))
}

fn block(b: &Block, f: &Function, module: &Module, turns: &dyn Fn(&str) -> u32, outer: u32) -> Cost {
    let mut sum = Cost::default();
    let inner = |b: &Block| block(b, f, module, turns, outer);
    for s in b {
        match s {
            Statement::Emit(range) => {
                range.clone().for_each(|e| sum += Cost::of(&f.expressions[e], f, module));
            }
            Statement::Block(b) => sum += inner(b),
            Statement::If { accept, reject, .. } => sum += inner(accept).max(inner(reject)),
            Statement::Switch { cases, .. } => {
                sum += cases.iter().map(|c| inner(&c.body)).fold(Cost::default(), Cost::max);
            }
            Statement::Loop { body, continuing, .. } => {
                let once = |b: &Block| block(b, f, module, turns, 1);
                let mut turn = once(body);
                turn += once(continuing);
                sum += turn.times(outer);
            }
            Statement::Call { function, .. } => sum += cost(&module.functions[*function], module, turns),
            _ => {}
        }
    }
    sum
}

/// Cost of a point whose lobes are round, with a diffuse part.
fn of_bands(visibility: &str, bands: usize) -> Cost {
    let g = Geometry::new(Arc::new(steradian_scene::shapes::icosphere(0)), crate::Sites::Vertices);
    let material = Material::new(parse("sgd:gold-metallic-paint").expect("a spec"));
    let mut params = seen_by(visibility, bands);
    params.0.insert("shape".into(), "round".into());
    let b = on_mesh(&lights::furnace(), &material, Some(&g), &params);
    let technique = b.gpu();
    let text = crate::gpu::module(&technique);
    let module =
        naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
    let name = if visibility == "none" { "shade" } else { "shade_site" };
    let entry = module.functions.iter().find(|f| f.1.name.as_deref() == Some(name)).expect("its function").1;
    let coefficients = if visibility == "ambient" { 1 } else { bands * bands };
    cost(entry, &module, &|name| match name {
        "lobes" => K,
        "blocked_at" => coefficients as u32,
        _ => 1,
    })
}

#[test]
fn what_a_point_costs_is_counted() {
    println!("texels, numbers from buffers, operations");
    let all = [("none", 4), ("ambient", 4), ("published", 2), ("published", 3), ("published", 4)];
    let costs = all.map(|(visibility, bands)| {
        let cost = of_bands(visibility, bands);
        println!("{visibility} {bands}: {} {} {}", cost.texels, cost.numbers, cost.operations);
        cost
    });
    // Two texels of each of two tables of views and four of each of two levels, K times; four of irradiance.
    assert!(costs.iter().all(|c| c.texels == K * (2 + 2 + 8) + 4), "{costs:?}");
    // Three corners with the diffuse part's 25 numbers and the 1, 4, 9 or 16 of visibility.
    let numbers = [0, 1, 4, 9, 16].map(|n| if n == 0 { 0 } else { 3 * (25 + n) });
    assert_eq!(costs.map(|c| c.numbers), numbers);
    assert!(costs.is_sorted_by_key(|c| c.operations), "{costs:?}");
}
