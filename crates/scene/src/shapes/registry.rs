//! Shapes by name.

use super::{cuboid, cylinder, icosphere, knot, plane, sphere, teapot, torus};
use crate::Mesh;
use steradian_base::brief;

/// A parameter of a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeParam {
    /// Its key.
    pub name: &'static str,
    /// Its value where none is given.
    pub default: f64,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// What it means.
    pub about: &'static str,
    /// Must it be whole?
    pub whole: bool,
}

/// A built-in shape.
#[derive(Debug)]
pub struct ShapeInfo {
    /// The name in specs.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
    /// Its parameters.
    pub params: &'static [ShapeParam],
    build: fn(&[f64]) -> Result<Mesh, String>,
}

/// Why a spec is no shape. One line that says what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("shape {:?}: {why}", brief(.spec))]
pub struct ShapeError {
    /// What was asked for.
    pub spec: String,
    /// What is wrong with it.
    pub why: String,
}

const fn length(name: &'static str, default: f64, about: &'static str) -> ShapeParam {
    ShapeParam { name, default, range: [1e-6, 1e6], about, whole: false }
}

const fn whole(name: &'static str, default: f64, range: [f64; 2], about: &'static str) -> ShapeParam {
    ShapeParam { name, default, range, about, whole: true }
}

const fn segments(default: f64, about: &'static str) -> ShapeParam {
    whole("segments", default, [1.0, 2048.0], about)
}

/// Every built-in shape.
pub static SHAPES: [ShapeInfo; 8] = [
    ShapeInfo {
        name: "sphere",
        about: "the unit sphere by latitudes and longitudes",
        params: &[segments(128.0, "slices around +Y; half as many stacks")],
        build: |p| Ok(sphere(p[0] as u32)),
    },
    ShapeInfo {
        name: "icosphere",
        about: "the unit sphere by a divided icosahedron: no poles, no texture coordinates",
        params: &[whole("level", 5.0, [0.0, 9.0], "20·4^level triangles")],
        build: |p| Ok(icosphere(p[0] as u32)),
    },
    ShapeInfo {
        name: "torus",
        about: "a ring about +Y",
        params: &[
            length("major", 0.7, "radius of the core circle, metres"),
            length("minor", 0.3, "radius of the tube, metres"),
            segments(128.0, "cells around the axis; half as many around the tube"),
        ],
        build: |p| Ok(torus(p[0], p[1], p[2] as u32)),
    },
    ShapeInfo {
        name: "knot",
        about: "a torus knot about +Y",
        params: &[
            whole("p", 2.0, [1.0, 32.0], "turns about the axis"),
            whole("q", 3.0, [1.0, 32.0], "turns about the core circle"),
            length("major", 0.56, "radius of the core circle, metres"),
            length("minor", 0.28, "radius of the torus that the curve lies on, metres"),
            length("tube", 0.16, "radius of the tube, metres"),
            segments(192.0, "cells along each turn; an eighth of them around the tube"),
        ],
        build: |p| {
            if gcd(p[0] as u32, p[1] as u32) != 1 {
                return Err("p and q must have no common factor".into());
            }
            Ok(knot(p[0] as u32, p[1] as u32, p[2], p[3], p[4], p[5] as u32))
        },
    },
    ShapeInfo {
        name: "teapot",
        about: "the Utah teapot, 32 Bézier patches",
        params: &[
            segments(24.0, "cells along each side of a patch"),
            whole(
                "fit-lid",
                1.0,
                [0.0, 1.0],
                "1 widens the lid to close its gap, 0 leaves the published data",
            ),
        ],
        build: |p| Ok(teapot(p[0] as u32, p[1] != 0.0)),
    },
    ShapeInfo {
        name: "cylinder",
        about: "a closed cylinder about +Y",
        params: &[
            length("radius", 0.6, "metres"),
            length("height", 1.6, "metres"),
            segments(128.0, "cells around"),
        ],
        build: |p| Ok(cylinder(p[0], p[1], p[2] as u32)),
    },
    ShapeInfo {
        name: "box",
        about: "an axis-parallel box",
        params: &[
            length("x", 1.15, "width, metres"),
            length("y", 1.15, "height, metres"),
            length("z", 1.15, "depth, metres"),
            segments(1.0, "cells along each side of a face"),
        ],
        build: |p| Ok(cuboid([p[0], p[1], p[2]], p[3] as u32)),
    },
    ShapeInfo {
        name: "plane",
        about: "a horizontal square that faces +Y",
        params: &[
            length("size", 2.0, "side, metres"),
            ShapeParam { name: "y", default: 0.0, range: [-1e6, 1e6], about: "height, metres", whole: false },
            segments(1.0, "cells along each side"),
        ],
        build: |p| Ok(plane(p[0], p[1], p[2] as u32)),
    },
];

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The shape `name` or `name:key=value,…`, as [`SHAPES`] lists them ("-" and "_" are the same).
pub fn by_name(spec: &str) -> Result<Mesh, ShapeError> {
    build(spec).map_err(|why| ShapeError { spec: spec.into(), why })
}

fn build(spec: &str) -> Result<Mesh, String> {
    let (name, rest) = spec.split_once(':').unwrap_or((spec, ""));
    let Some(shape) = SHAPES.iter().find(|s| s.name == name.trim()) else {
        let names: Vec<&str> = SHAPES.iter().map(|s| s.name).collect();
        return Err(format!("unknown; the shapes are {}", names.join(", ")));
    };
    let mut values: Vec<f64> = shape.params.iter().map(|p| p.default).collect();
    for pair in rest.split(',').map(str::trim).filter(|p| !p.is_empty()) {
        let (key, value) =
            pair.split_once('=').ok_or_else(|| format!("{:?} is not key=value", brief(pair)))?;
        let key = key.trim().replace('_', "-");
        let Some(i) = shape.params.iter().position(|p| p.name == key) else {
            let names: Vec<&str> = shape.params.iter().map(|p| p.name).collect();
            return Err(format!("no parameter {:?}; {name} has {}", brief(&key), names.join(", ")));
        };
        values[i] = check(&shape.params[i], value.trim())?;
    }
    (shape.build)(&values)
}

fn check(p: &ShapeParam, text: &str) -> Result<f64, String> {
    let [lo, hi] = p.range;
    let value: Option<f64> = text.parse().ok().filter(|v| (lo..=hi).contains(v));
    match value {
        Some(v) if !p.whole || v.fract() == 0.0 => Ok(v),
        _ => {
            let kind = if p.whole { "a whole number" } else { "a number" };
            Err(format!("{} must be {kind} from {lo} to {hi}, not {:?}", p.name, brief(text)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::check_shape;
    use super::*;

    #[test]
    fn every_shape_is_whole_with_its_defaults_and_with_the_fewest_segments() {
        for shape in &SHAPES {
            let m = by_name(shape.name).unwrap();
            check_shape(&m, !matches!(shape.name, "plane" | "teapot"));
            if shape.name != "plane" {
                let reach = m.positions.iter().map(|p| p.length()).fold(0.0, f32::max);
                assert!(reach <= 1.0 + 1e-6, "{} reaches {reach}", shape.name);
            }
            if shape.params.iter().any(|p| p.name == "segments") {
                assert!(!by_name(&format!("{}:segments=1", shape.name)).unwrap().triangles.is_empty());
            }
        }
    }

    #[test]
    fn specs_are_checked_in_one_line() {
        assert_eq!(by_name("torus:minor=0.1, segments=8").unwrap().bounds().unwrap().1.y, 0.1);
        for (spec, want) in [
            ("tea", "the shapes are sphere"),
            ("torus:radius=1", "torus has major, minor, segments"),
            ("torus:minor", "not key=value"),
            ("torus:minor=-1", "from 0.000001"),
            ("sphere:segments=2.5", "a whole number"),
            ("sphere:segments=nan", "a whole number"),
            ("knot:p=2,q=4", "no common factor"),
        ] {
            let message = by_name(spec).unwrap_err().to_string();
            assert!(message.contains(want) && !message.contains('\n'), "{message}");
        }
    }
}
