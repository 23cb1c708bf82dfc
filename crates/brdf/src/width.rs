//! Parameters that determine the width of a reflectance's lobe, and the reflectance with other values of
//! them.

use crate::{Brdf, SharedBrdf, SpecError, parse};
use steradian_base::split_spec;

/// Names of a model's parameters along tangent and bitangent, of which the first pair that a model has
/// applies; models of round lobes have one name.
const NAMES: [[&str; 2]; 7] =
    [["ax", "ay"], ["nu", "nv"], ["alpha"; 2], ["n"; 2], ["s"; 2], ["m"; 2], ["sigma"; 2]];

/// Names of the parameters of a reflectance's model that are the width or the exponent of its lobe, along
/// tangent and bitangent: the same name twice where the lobe is round. `None` for models without one, as
/// measurements.
pub fn width_names(brdf: &dyn Brdf) -> Option<[&'static str; 2]> {
    let has = |name: &str| brdf.info().parameters.iter().any(|p| p.name == name);
    NAMES.into_iter().find(|names| names.iter().all(|n| has(n)))
}

/// The reflectance with other numbers for those of [`width_names`]; the second is not read where both names
/// are one. Refused are models without such numbers, and numbers that the model does not take.
pub fn with_widths(brdf: &dyn Brdf, widths: [f64; 2]) -> Result<SharedBrdf, SpecError> {
    let model = brdf.info().name;
    let none = || SpecError::Syntax { model, what: "has no width and no exponent to vary".into() };
    let names = width_names(brdf).ok_or_else(none)?;
    let spec = brdf.spec();
    let (name, body) = split_spec(&spec);
    let own = |item: &&str| {
        let key = item.split('=').next().unwrap_or_default().trim();
        // Where there are two widths, `alpha` sets both.
        names.contains(&key) || (key == "alpha" && names[0] != names[1])
    };
    let mut items: Vec<String> =
        body.split(',').filter(|i| !i.is_empty() && !own(i)).map(String::from).collect();
    let count = if names[0] == names[1] { 1 } else { 2 };
    items.extend(names.iter().zip(widths).take(count).map(|(n, w)| format!("{n}={w}")));
    parse(&format!("{name}:{}", items.join(",")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_exchanged_and_nothing_else() {
        for (before, widths, after) in [
            ("ggx:alpha=0.2,f0=0.9/0.5/0.2", [0.1, 0.3], "ggx:ax=0.1,ay=0.3,f0=0.9/0.5/0.2"),
            ("ggx:ax=0.1,ay=0.4,f0=0.5,scale=0.5", [0.3; 2], "ggx:alpha=0.3,f0=0.5,scale=0.5"),
            (
                "ashikhmin-shirley:nu=4,nv=4,rs=0.2,rd=0.3",
                [9.0, 80.0],
                "ashikhmin-shirley:nu=9,nv=80,rs=0.2,rd=0.3",
            ),
            ("ward:ax=0.1,ay=0.2,variant=duer", [0.2, 0.1], "ward:ax=0.2,ay=0.1,variant=duer"),
            ("phong:n=3,scale=2", [7.0, 1.0], "phong:n=7,scale=2"),
            ("cook-torrance:m=0.1,g=smith", [0.4, 0.4], "cook-torrance:m=0.4,g=smith"),
            ("phong-normalized:s=3", [7.5, 7.5], "phong-normalized:s=7.5"),
        ] {
            let (a, b) = (parse(before).expect(before), parse(after).expect(after));
            assert_eq!(with_widths(&*a, widths).expect(before).spec(), b.spec());
        }
    }

    #[test]
    fn what_has_no_width_says_so() {
        let why =
            |spec: &str, w: f64| with_widths(&*parse(spec).expect(spec), [w; 2]).expect_err(spec).to_string();
        assert_eq!(why("lambert", 1.0), "BRDF lambert: has no width and no exponent to vary");
        assert!(why("ggx:alpha=0.1", 20.0).contains("ax"), "{}", why("ggx:alpha=0.1", 20.0));
    }
}
