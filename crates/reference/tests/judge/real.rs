//! A photographed sky with an unclipped sun, against sums made elsewhere.

use crate::support::{difference, reference};
use glam::DVec3;
use steradian_formats::{Limits, read_image};
use steradian_reference::Lookup;
use steradian_sphere::{Frame, Layout, SphereImage};

/// Sums over 4 × 4 Gauss points per texel, with the formulas written down anew in NumPy.
const SUMS: [(&str, [[f64; 3]; 3]); 4] = [
    (
        "lambert",
        [
            [1.14852205, 1.2983818, 1.37798724],
            [0.39036911, 0.41627862, 0.53723633],
            [0.82619339, 0.92132841, 1.00091166],
        ],
    ),
    (
        "ggx:alpha=0.04",
        [
            [0.05152868, 0.12644329, 0.29996239],
            [0.43763141, 0.3508582, 0.29505456],
            [0.44697531, 0.35575748, 0.29935155],
        ],
    ),
    (
        "ggx:alpha=0.3",
        [
            [0.27549552, 0.36878024, 0.52897855],
            [0.40703626, 0.37142103, 0.39152513],
            [0.54455829, 0.54859989, 0.55605569],
        ],
    ),
    (
        "ashikhmin-shirley:nu=100,nv=10,rs=0.5,rd=0.3",
        [
            [0.1851648, 0.24252209, 0.33690294],
            [0.19144891, 0.15756329, 0.13879955],
            [0.1573403, 0.13494066, 0.12550392],
        ],
    ),
];

/// Normals and views, before they are normalised; the last two are seen at 85° and 86°.
const POINTS: [[DVec3; 2]; 3] = [
    [DVec3::new(0.3, 0.8, 0.5), DVec3::new(0.1, 0.6, 0.9)],
    [DVec3::new(-0.2, 0.1, -0.9), DVec3::new(0.9, 0.3, -0.25)],
    [DVec3::new(0.6, 0.5, 0.6), DVec3::new(0.3, 0.9, -0.9)],
];

#[test]
fn a_photographed_sky() {
    let Some(path) = steradian_testkit::data("environments/spiaggia_1024x512.exr") else { return };
    let raster = read_image(&path, &Limits::default()).expect("a sound file");
    let (width, height) = (raster.width, raster.height);
    let planes = raster.into_rgb().expect("three channels");
    let sky = reference(SphereImage { layout: Layout::LatLong, width, height, planes }, Lookup::Constant);
    for (spec, sums) in SUMS {
        let brdf = steradian_brdf::parse(spec).expect("a known model");
        for ([n, v], sum) in POINTS.into_iter().zip(sums) {
            let frame = Frame::from_normal(n.normalize());
            let e = sky.radiance(brdf.as_ref(), &frame, v.normalize(), None, 1e-4);
            let off = difference(e.rgb, sum);
            assert!(
                e.error <= 1.0001e-4 && off < 1e-5,
                "{spec} {n}: {e:?}, other sum {sum:?}, off by {off:.1e}"
            );
        }
    }
}
