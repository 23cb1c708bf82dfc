//! Bounds that are reported hold on real light: measured against the sum over all texels.

use steradian_base::Task;
use steradian_light::load::{LoadOptions, load};
use steradian_light::{Environment, Lights};
use steradian_prefilter::{Lobe, Sampled, Zonal, deviation, filter_image};
use steradian_sphere::Layout;

const TOLERANCE: f64 = 2e-3;

/// A sun, windows, lamps at night, a studio, an open sky.
const PROBES: [&str; 5] = [
    "rooitou_park_1k.hdr",
    "lebombo_1k.hdr",
    "dikhololo_night_1k.hdr",
    "studio_small_03_1k.hdr",
    "spiaggia_di_mondello_1k.hdr",
];

#[test]
fn no_error_is_above_its_bound() {
    for probe in PROBES {
        let Some(path) = steradian_testkit::data(&format!("environments/latlong/{probe}")) else { return };
        let image = load(&path, &LoadOptions::default()).unwrap().into_environment().image;
        let rows = if steradian_testkit::full() { image.height } else { 128 };
        let image = image.resample(Layout::LatLong, 2 * rows, rows);
        let lights = Lights::from(Environment { image });
        let lobes = [
            Lobe::ggx(0.03),
            Lobe::ggx(0.25),
            Lobe::ggx(1.0),
            Lobe::beckmann(0.05),
            Lobe::charlie(0.25),
            Lobe::phong(1000.0),
            Lobe::blinn_phong(20.0),
            Lobe::lambert(),
            Lobe::gaussian(0.05),
        ];
        for lobe in lobes {
            let kernels: [&dyn Zonal; 1] = [&lobe];
            let light = Sampled::new(&lights, &kernels, TOLERANCE, &Task::quiet()).unwrap();
            let made =
                filter_image(&light, &lobe, (Layout::Cube, 16, 16), TOLERANCE, &Task::quiet()).unwrap();
            let e = deviation(&light, &lobe, &made.image, 100);
            assert!(
                e.rms <= made.predicted,
                "{probe} {lobe:?}: {e:?} above {} {:?}",
                made.predicted,
                made.way
            );
            assert!(made.predicted <= TOLERANCE && e.bias.abs() < 1e-3, "{probe} {lobe:?}: {e:?}");
            assert!(light.has_negative() || made.image.planes.iter().flatten().all(|v| *v >= 0.0));
        }
    }
}
