//! Shapes by name.

use super::{cuboid, cylinder, icosphere, knot, plane, sphere, teapot, torus};
use crate::Mesh;
use steradian_base::{ParamError, ParamInfo, ParamValues, Value, brief, split_spec, unknown};

/// A built-in shape.
#[derive(Debug)]
pub struct ShapeInfo {
    /// The name in specs.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
    /// Its parameters.
    pub params: &'static [ParamInfo],
    build: fn(&[f64]) -> Result<Mesh, String>,
}

/// Why a spec is no shape; one line that says what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("shape {:?}: {why}", brief(.spec))]
pub struct ShapeError {
    /// The spec as given.
    pub spec: String,
    /// The fault.
    pub why: String,
}

const fn length(name: &'static str, default: f64, about: &'static str) -> ParamInfo {
    ParamInfo::real(name, [1e-6, 1e6], default, about).unit("metres")
}

const fn whole(name: &'static str, default: f64, range: [f64; 2], about: &'static str) -> ParamInfo {
    ParamInfo::whole(name, range, default, about)
}

const fn segments(default: f64, about: &'static str) -> ParamInfo {
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
            length("major", 0.7, "radius of the core circle"),
            length("minor", 0.3, "radius of the tube"),
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
            length("major", 0.56, "radius of the core circle"),
            length("minor", 0.28, "radius of the torus that the curve lies on"),
            length("tube", 0.16, "radius of the tube"),
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
            ParamInfo::switch("fit-lid", true, "widen the lid to close its gap; off: the published data"),
        ],
        build: |p| Ok(teapot(p[0] as u32, p[1] != 0.0)),
    },
    ShapeInfo {
        name: "cylinder",
        about: "a closed cylinder about +Y",
        params: &[
            length("radius", 0.6, "of the cylinder"),
            length("height", 1.6, "of the cylinder"),
            segments(128.0, "cells around"),
        ],
        build: |p| Ok(cylinder(p[0], p[1], p[2] as u32)),
    },
    ShapeInfo {
        name: "box",
        about: "an axis-parallel box",
        params: &[
            length("x", 1.15, "width"),
            length("y", 1.15, "height"),
            length("z", 1.15, "depth"),
            segments(1.0, "cells along each side of a face"),
        ],
        build: |p| Ok(cuboid([p[0], p[1], p[2]], p[3] as u32)),
    },
    ShapeInfo {
        name: "plane",
        about: "a horizontal square that faces +Y",
        params: &[
            length("size", 2.0, "side"),
            ParamInfo::real("y", [-1e6, 1e6], 0.0, "height").unit("metres"),
            segments(1.0, "cells along each side"),
        ],
        build: |p| Ok(plane(p[0], p[1], p[2] as u32)),
    },
];

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The shape `name` or `name:key=value,…`, as [`SHAPES`] lists them ("-" and "_" are equivalent).
pub fn by_name(spec: &str) -> Result<Mesh, ShapeError> {
    build(spec).map_err(|why| ShapeError { spec: spec.into(), why })
}

fn build(spec: &str) -> Result<Mesh, String> {
    let (name, body) = split_spec(spec);
    let Some(shape) = SHAPES.iter().find(|s| s.name == name) else {
        return Err(unknown("shape", name, &SHAPES.each_ref().map(|s| s.name)));
    };
    let values = ParamValues::parse(body, shape.params);
    let number = |v: &ParamValues, p: &ParamInfo| match v.required(p)? {
        Value::Switch(on) => Ok(f64::from(u8::from(on))),
        _ => v.number(p),
    };
    let numbers =
        values.and_then(|v| shape.params.iter().map(|p| number(&v, p)).collect::<Result<Vec<f64>, _>>());
    (shape.build)(&numbers.map_err(|e: ParamError| format!("{name}: {e}"))?)
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
            ("tea", "there are: sphere"),
            ("torus:radius=1", "there are: major, minor, segments"),
            ("torus:minor", "not key=value"),
            ("torus:minor=-1", "a number in 0.000001 … 1000000"),
            ("sphere:segments=2.5", "a whole number"),
            ("sphere:segments=nan", "a whole number"),
            ("knot:p=2,q=4", "no common factor"),
        ] {
            let message = by_name(spec).unwrap_err().to_string();
            assert!(message.contains(want) && !message.contains('\n'), "{message}");
        }
    }
}
