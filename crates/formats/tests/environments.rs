//! Every environment of the data folder, against numbers that NumPy (Radiance pictures, decoded by hand) and
//! the OpenEXR library's own Python module gave.

use std::path::Path;
use steradian_formats::{Limits, Raster, read_image};

/// Path, width, height, smallest and largest value, mean of all values, the pixel at (width / 5, height / 3).
type Row = (&'static str, usize, usize, f64, f64, f64, [f64; 3]);

const EXPECTED: &[Row] = &[
    (
        "angular/beach_probe.hdr",
        640,
        640,
        0.0,
        13.90625,
        0.3965600479700212,
        [2.0078125, 2.2265625, 2.2265625],
    ),
    (
        "angular/building_probe.hdr",
        640,
        640,
        0.0,
        15.15625,
        0.662881891116524,
        [0.080810546875, 0.089599609375, 0.073486328125],
    ),
    ("angular/campus_probe.hdr", 640, 640, 0.0, 246.5, 1.8527854087299245, [6.84375, 10.15625, 12.84375]),
    (
        "angular/ennis_probe.hdr",
        1024,
        1024,
        0.0,
        115.75,
        0.48769258979353936,
        [0.100830078125, 0.048095703125, 0.021728515625],
    ),
    (
        "angular/galileo_probe.hdr",
        1000,
        1000,
        0.0,
        1036.0,
        1.6132047399113973,
        [1.45703125, 0.89453125, 0.73828125],
    ),
    (
        "angular/grace_probe.hdr",
        1000,
        1000,
        0.0,
        654.0,
        0.3928663216425578,
        [0.119384765625, 0.016845703125, 0.011962890625],
    ),
    (
        "angular/kitchen_probe.hdr",
        640,
        640,
        0.0,
        234.5,
        1.0558509228788049,
        [0.857421875, 0.431640625, 0.271484375],
    ),
    (
        "angular/rnl_probe.hdr",
        900,
        900,
        0.0,
        182.5,
        0.7087468547051826,
        [0.451171875, 0.595703125, 0.572265625],
    ),
    (
        "latlong/dikhololo_night_1k.hdr",
        1024,
        512,
        0.000152587890625,
        115.25,
        0.06464426518505206,
        [0.14111328125, 0.15966796875, 0.17236328125],
    ),
    (
        "latlong/forest_slope_1k.hdr",
        1024,
        512,
        0.00267791748046875,
        74.75,
        0.7817342974449275,
        [0.744140625, 0.966796875, 0.728515625],
    ),
    (
        "latlong/grace_latlong.exr",
        1024,
        512,
        7.3909759521484375e-06,
        18.375,
        0.015696404614648902,
        [0.001750946044921875, 0.0005164146423339844, 0.00047850608825683594],
    ),
    (
        "latlong/immenstadter_horn_1k.hdr",
        1024,
        512,
        0.000732421875,
        7056.0,
        0.5361772134589652,
        [0.2373046875, 0.3095703125, 0.4990234375],
    ),
    (
        "latlong/lebombo_1k.hdr",
        1024,
        512,
        0.004150390625,
        41.375,
        0.6412398203198487,
        [0.4267578125, 0.3232421875, 0.2275390625],
    ),
    (
        "latlong/lightroom_14b.hdr",
        2048,
        1024,
        0.00215911865234375,
        54.125,
        0.7136137190718728,
        [9.71875, 9.71875, 9.71875],
    ),
    (
        "latlong/museum.exr",
        512,
        256,
        4.863739013671875e-05,
        19.28125,
        0.330511131389206,
        [0.284912109375, 0.1175537109375, 0.045013427734375],
    ),
    (
        "latlong/newport_loft.hdr",
        1600,
        800,
        6.103515625e-05,
        15.28125,
        0.25271578116814297,
        [0.16748046875, 0.08447265625, 0.03173828125],
    ),
    (
        "latlong/potsdamer_platz_1k.hdr",
        1024,
        512,
        0.001232147216796875,
        11.84375,
        0.7167053609349144,
        [1.39453125, 1.44921875, 1.70703125],
    ),
    (
        "latlong/probulator_ennis.hdr",
        256,
        128,
        0.0,
        103.75,
        0.8609945702870997,
        [0.062744140625, 0.033447265625, 0.016357421875],
    ),
    (
        "latlong/probulator_grace.hdr",
        256,
        128,
        0.0,
        3512.0,
        0.4185389563007396,
        [0.02752685546875, 0.01715087890625, 0.01556396484375],
    ),
    (
        "latlong/probulator_pisa.hdr",
        256,
        128,
        0.0,
        3.9453125,
        0.1630694698516879,
        [0.3486328125, 0.1728515625, 0.0673828125],
    ),
    (
        "latlong/probulator_uffizi.hdr",
        256,
        128,
        0.0,
        15.90625,
        1.8636824381367962,
        [0.116943359375, 0.102783203125, 0.110107421875],
    ),
    (
        "latlong/probulator_wells.hdr",
        256,
        128,
        0.0,
        8.28125,
        0.18450758699909406,
        [0.14990234375, 0.06494140625, 0.02490234375],
    ),
    (
        "latlong/rooitou_park_1k.hdr",
        1024,
        512,
        0.00030517578125,
        69376.0,
        0.5028519357147161,
        [0.1123046875, 0.2021484375, 0.4658203125],
    ),
    (
        "latlong/spiaggia_di_mondello_1k.hdr",
        1024,
        512,
        0.007049560546875,
        72960.0,
        0.6890358874031032,
        [0.0634765625, 0.1923828125, 0.4716796875],
    ),
    (
        "latlong/st_fagans_interior_1k.hdr",
        1024,
        512,
        0.00048828125,
        1276.0,
        0.6879008620453533,
        [0.822265625, 0.642578125, 0.232421875],
    ),
    (
        "latlong/studio_small_03_1k.hdr",
        1024,
        512,
        1.4781951904296875e-05,
        3576.0,
        1.887798431966985,
        [0.0408935546875, 0.0428466796875, 0.0601806640625],
    ),
    (
        "lightroom_grey_1024x512.exr",
        1024,
        512,
        0.0021858264226466417,
        54.0,
        0.7116016316261495,
        [0.5595694184303284, 0.5595694184303284, 0.5595694184303284],
    ),
    (
        "orientation/KernerEnvCube.exr",
        256,
        1536,
        0.0028781890869140625,
        1657.0,
        0.18668992030466647,
        [0.151123046875, 0.2496337890625, 0.4365234375],
    ),
    (
        "orientation/OrientationCube.exr",
        512,
        3072,
        0.0,
        0.99658203125,
        0.9454120689625571,
        [0.99072265625, 0.99072265625, 0.99072265625],
    ),
    (
        "orientation/OrientationLatLong.exr",
        1024,
        512,
        0.0,
        0.99560546875,
        0.9164666853290934,
        [0.9599609375, 0.68212890625, 0.697265625],
    ),
    (
        "orientation/StageEnvLatLong.exr",
        1000,
        500,
        0.0,
        4096.0,
        2.9014091775773765,
        [3.7734375, 4.4765625, 5.05859375],
    ),
    (
        "paraboloid/grace-back.hdr",
        512,
        512,
        0.00066375732421875,
        602.0,
        0.35512791700602975,
        [0.02752685546875, 0.01544189453125, 0.01483154296875],
    ),
    (
        "paraboloid/grace-front.hdr",
        512,
        512,
        0.0014190673828125,
        131.5,
        0.5213815427850932,
        [0.03106689453125, 0.01251220703125, 0.01214599609375],
    ),
    (
        "paraboloid/stpeters-back.hdr",
        512,
        512,
        0.002105712890625,
        1116.0,
        0.7335028164476777,
        [221.5, 168.5, 147.5],
    ),
    (
        "paraboloid/stpeters-front.hdr",
        512,
        512,
        0.020263671875,
        3864.0,
        1.202413602732122,
        [0.763671875, 0.474609375, 0.373046875],
    ),
    (
        "paraboloid/uffizi-back.hdr",
        512,
        512,
        0.0,
        15.96875,
        1.793640658267867,
        [0.4033203125, 0.3798828125, 0.4091796875],
    ),
    (
        "paraboloid/uffizi-front.hdr",
        512,
        512,
        0.0,
        15.96875,
        1.739256456869666,
        [0.15869140625, 0.14013671875, 0.14599609375],
    ),
    (
        "spiaggia_1024x512.exr",
        1024,
        512,
        0.00701904296875,
        72704.0,
        0.686397570806245,
        [0.06640625, 0.201171875, 0.478515625],
    ),
];

fn read(path: &Path) -> Raster {
    read_image(path, &Limits::default()).expect("a valid file")
}

#[test]
fn values_agree_with_other_readers() {
    for &(name, width, height, min, max, mean, pixel) in EXPECTED {
        let Some(path) = steradian_testkit::data(&format!("environments/{name}")) else { return };
        let raster = read(&path);
        assert_eq!((raster.width, raster.height, raster.low_range), (width, height, false), "{name}");
        assert_eq!(raster.first_non_finite(), None);
        let planes = raster.into_rgb().expect("colour");
        let values = || planes.iter().flatten().map(|&v| f64::from(v));
        // Minima and maxima are exact: each is one sample of the file.
        assert_eq!(values().fold(f64::INFINITY, f64::min), f64::from(min as f32), "{name}");
        assert_eq!(values().fold(0.0, f64::max), max, "{name}");
        let got = values().sum::<f64>() / (3 * width * height) as f64;
        assert!((got - mean).abs() < 1e-9 * mean, "{name}: mean {got}, expected {mean}");
        let at = height / 3 * width + width / 5;
        assert_eq!(planes.map(|p| f64::from(p[at])), pixel, "{name}");
    }
}

#[test]
fn the_environment_attribute_is_kept() {
    for (name, kind) in [("OrientationLatLong.exr", "latlong"), ("KernerEnvCube.exr", "cube")] {
        let Some(path) = steradian_testkit::data(&format!("environments/orientation/{name}")) else { return };
        let envmap = read(&path).metadata.into_iter().find(|(k, _)| k == "envmap").map(|(_, v)| v);
        assert_eq!(envmap.as_deref(), Some(kind));
    }
}
