use super::*;
use steradian_formats::{Tensor, TensorData, TensorFile};

/// Coefficients that are linear in position.
fn linear(p: DVec3) -> ShRgb {
    let mut sh = ShRgb::zero(2);
    for (c, values) in sh.c.iter_mut().enumerate() {
        for (i, v) in values.iter_mut().enumerate() {
            *v = 0.3 * i as f64 + p.dot(DVec3::new(1.0 + c as f64, -0.5, 0.1 * i as f64));
        }
    }
    sh
}

const BOUNDS: [DVec3; 2] = [DVec3::new(-1.0, 0.0, 2.0), DVec3::new(2.0, 1.5, 4.0)];

fn field() -> Probes {
    let places = Places::Grid { bounds: BOUNDS, size: UVec3::new(4, 3, 2) };
    let probe = |p: DVec3| Some(Probe { sh: linear(p), image: None });
    Probes { light: places.positions().into_iter().map(probe).collect(), places }
}

fn distance(a: &ShRgb, b: &ShRgb) -> f64 {
    a.c.iter().flatten().zip(b.c.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn inside_the_box(k: usize) -> DVec3 {
    let part = |a: f64| (0.5 + k as f64 * a).fract();
    BOUNDS[0] + DVec3::new(part(0.819), part(0.671), part(0.549)) * (BOUNDS[1] - BOUNDS[0])
}

#[test]
fn a_linear_field_is_reproduced() {
    let field = field();
    for p in (0..200).map(inside_the_box) {
        assert!(distance(&field.at(p).unwrap(), &linear(p)) < 1e-12);
    }
    // Outside it is that of the nearest point of the box.
    let nearest = linear(DVec3::new(2.0, 0.0, 3.0));
    assert!(distance(&field.at(DVec3::new(9.0, -7.0, 3.0)).unwrap(), &nearest) < 1e-12);
}

/// Across borders between cells, and where one probe leaves the nearest eight for another.
#[test]
fn light_has_no_seam() {
    let mut field = field();
    for (k, light) in field.light.iter_mut().enumerate() {
        light.as_mut().unwrap().sh.c[0][0] = ((k * 7) % 11) as f64;
    }
    // x = 0 and y = 0.75 are borders between cells.
    for border in [DVec3::new(0.0, 0.4, 3.1), DVec3::new(0.4, 0.75, 3.1)] {
        for e in [DVec3::X, DVec3::Y] {
            let [a, b] = [-1e-9, 1e-9].map(|s| field.at(border + s * e).unwrap());
            assert!(distance(&a, &b) < 1e-6);
        }
    }
    field.places = Places::Points(field.places.positions());
    let step = 1e-4;
    let mut last: Option<ShRgb> = None;
    for k in 0..30_000 {
        let now = field.at(DVec3::new(-1.0 + f64::from(k) * step, 0.61, 2.7)).unwrap();
        if let Some(last) = &last {
            assert!(distance(last, &now) < 100.0 * step, "{k}");
        }
        last = Some(now);
    }
}

/// The light of an interpolation is a mean of the probes that there are.
#[test]
fn probes_inside_solids_are_left_out() {
    let mut field = field();
    let all = ShRgb { order: 2, c: std::array::from_fn(|_| vec![2.5; 9]) };
    field.light.fill(Some(Probe { sh: all.clone(), image: None }));
    for k in [0, 5, 6, 13, 22] {
        field.light[k] = None;
    }
    for p in (0..50).map(inside_the_box).chain([field.places.position(0)]) {
        let weights = field.weights(p);
        assert!((weights.iter().map(|w| w.1).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(weights.iter().all(|w| field.light[w.0].is_some()));
        assert!(distance(&field.at(p).unwrap(), &all) < 1e-12);
    }
    let points = Probes { places: Places::Points(field.places.positions()), ..field.clone() };
    assert_eq!(points.weights(points.places.position(7)), [(7, 1.0)]);
    assert!(points.weights(points.places.position(5)).iter().all(|w| w.0 != 5));
    field.light.fill(None);
    assert_eq!(field.at(BOUNDS[0]), None);
    assert_eq!(field.at(DVec3::NAN), None);
}

#[test]
fn triangles_tell_the_probes_that_they_need() {
    let mut field = field();
    for k in [5, 6, 17] {
        field.light[k] = None;
    }
    let corner = |k: usize| inside_the_box(k).as_vec3();
    for k in 0..100 {
        let near = |j: usize| corner(k).lerp(corner(k + j), 0.2);
        let triangle = [corner(k), near(1), near(2)];
        let needed = field.around([&triangle]);
        for t in [[0.1, 0.1], [0.7, 0.2], [0.2, 0.7], [0.0, 1.0]] {
            let p = triangle[0] + t[0] * (triangle[1] - triangle[0]) + t[1] * (triangle[2] - triangle[0]);
            assert!(field.weights(p.as_dvec3()).iter().all(|w| needed.contains(&w.0)), "{k}");
        }
    }
    let small = [Vec3::new(0.2, 0.2, 2.2); 3];
    assert!(field.around([&small]).len() <= 8);
}

/// The image's own harmonics are the probe's, of a bare probe and of one with an image.
#[test]
fn environments_have_the_harmonics_of_their_probes() {
    let mut bare = Probe { sh: linear(DVec3::new(0.3, 1.0, -2.0)), image: None };
    bare.sh.c[1][0] += 4.0;
    let mut image = SphereImage::new(Layout::LatLong, 32, 16);
    image.planes[0][133] = 700.0;
    let mut lit = Probe { sh: sh::project(&image, 2), image: Some(image.clone()) };
    for probe in [&bare, &lit] {
        let e = probe.environment();
        assert!(distance(&sh::project(&e.image, 2), &probe.sh) < 2e-6);
    }
    // What is right already stays.
    assert!((lit.environment().image.planes[0][133] - 700.0).abs() < 1e-3);
    lit.sh.c[0][0] *= 1.01;
    assert!(distance(&sh::project(&lit.environment().image, 2), &lit.sh) < 2e-6);
}

#[test]
fn files_come_back_and_their_faults_are_said() {
    let mut field = field();
    field.light[3] = None;
    let file = field.tensors();
    assert_eq!(Probes::read(&file).unwrap(), field);
    let mut images = field.clone();
    let image = SphereImage::from_fn(Layout::LatLong, 8, 4, |d| [d.x as f32, d.y as f32, 2.0]);
    images.light.iter_mut().flatten().for_each(|p| p.image = Some(image.clone()));
    assert_eq!(Probes::read(&images.tensors()).unwrap(), images);
    let points = Probes { places: Places::Points(field.places.positions()), ..field };
    assert_eq!(Probes::read(&points.tensors()).unwrap(), points);
    let fails = |change: &dyn Fn(&mut TensorFile)| {
        let mut file = file.clone();
        change(&mut file);
        Probes::read(&file).unwrap_err().to_string()
    };
    assert!(fails(&|f| drop(f.tensors.remove("sh"))).contains("'sh'"));
    assert!(fails(&|f| f.tensors.get_mut("sh").unwrap().shape = vec![24, 27]).contains("channels"));
    assert!(fails(&|f| f.tensors.get_mut("sh").unwrap().shape = vec![27, 3, 8]).contains("27"));
    assert!(fails(&|f| f.metadata.clear()).contains("holds no probes"));
    let other = |f: &mut TensorFile| drop(f.metadata.insert("steradian.probes.bands".into(), "5".into()));
    assert!(fails(&other).contains("says 5 bands and holds 3"));
    let size = |n: u32| Tensor { shape: vec![3], data: TensorData::U32(vec![n; 3]) };
    assert!(fails(&|f| drop(f.tensors.insert("size".into(), size(u32::MAX)))).contains("beyond number"));
    assert!(fails(&|f| drop(f.tensors.insert("size".into(), size(9)))).contains("729"));
    let turned = |f: &mut TensorFile| {
        f.tensors.insert("bounds".into(), Tensor::f64([2, 3], vec![1.0, 0.0, 0.0, 0.0, 1.0, 1.0]));
    };
    assert!(fails(&turned).contains("end before"));
    let mut bad = file.tensors["sh"].data.to_f64().to_vec();
    bad[30] = f64::NAN;
    assert!(
        fails(&|f| f.tensors.get_mut("sh").unwrap().data = TensorData::F64(bad.clone()))
            .contains("probe 1 holds NaN")
    );
}
