//! `--method`: a way to prefilter by name, in place of the engine's own choice.

use crate::context::Context;
use crate::failure::Failure;
use serde_json::{Value, json};
use steradian_prefilter::map::Way;
use steradian_prefilter::methods::{Cost, Made, Method, Shape};
use steradian_prefilter::{FilteredImage, Sampled, Zonal};

/// What the option says.
#[derive(Debug, Clone, Copy, Default)]
pub struct Choice(pub Option<Method>);

/// The option's value.
pub fn choice(text: &str) -> Result<Choice, String> {
    let name = text.to_ascii_lowercase().replace('_', "-");
    if name == "auto" {
        return Ok(Choice(None));
    }
    let names: Vec<&str> = ["auto"].into_iter().chain(Method::ALL.map(Method::name)).collect();
    let found = Method::from_name(&name).map(|m| Choice(Some(m)));
    found.ok_or_else(|| steradian_base::unknown("method", text, &names))
}

impl Choice {
    /// Named ways have no bound of their error: it must be measured.
    pub fn verify(self, check: u16) -> Result<(), Failure> {
        match self.0 {
            Some(m) if check == 0 => Err(Failure::usage(format!(
                "--method {}: its error has no bound; give --check 1 or more",
                m.name()
            ))),
            _ => Ok(()),
        }
    }
}

/// A way and what it took.
pub struct Work {
    method: Method,
    cost: Cost,
}

/// The map that a way makes, and what it took. Its error is unknown until measured.
pub fn filter(
    method: Method,
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    tolerance: f64,
    context: &Context,
) -> Result<(FilteredImage, Work), Failure> {
    let Made { image, cost } = method.filter(light, kernel, shape, tolerance, &context.task)?;
    let energy_out = image.integral();
    let k0 = kernel.coefficients(0)[0];
    let energy_in = light.flux().map(|f| f * k0);
    let filtered = FilteredImage {
        image,
        way: Way::Area,
        predicted: f64::INFINITY,
        clipped: 0.0,
        energy_in,
        energy_out,
    };
    Ok((filtered, Work { method, cost }))
}

impl Work {
    /// The way's name.
    pub fn name(&self) -> &'static str {
        self.method.name()
    }

    /// What the report of a level says in place of the engine's way.
    pub fn report(&self, row: &mut Value) {
        let card = self.method.card();
        row["way"] = json!(card.name);
        row["order"] = Value::Null;
        row["source"] = json!(card.source);
        row["equation"] = json!(card.equation);
        row["exact_when"] = json!(card.exact_when);
        row["cost"] = json!({"kernel_evaluations": self.cost.kernel, "taps": self.cost.taps});
    }
}
