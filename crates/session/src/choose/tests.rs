use super::*;
use crate::Shadows;
use std::sync::Mutex;
use steradian_render::Settings;
use steradian_scene::surface::Planes;

/// A sphere of a reflectance under a small sky.
fn scene(session: &mut Session, spec: &str) -> Scene {
    let mesh = session.mesh("sphere").expect("a shape");
    let material = Material::new(session.brdf(spec).expect("a spec"));
    let lights = session.light("studio", &crate::Adjust::default()).expect("a sky");
    Scene { settings: Settings::new(24, 24), ..Scene::new(mesh, vec![material], lights) }
}

#[test]
fn the_choice_says_what_was_tried_and_takes_the_least_error() {
    let mut session = Session::new();
    let scene = scene(&mut session, "lambert:albedo=0.6");
    let (picture, _) = session.render(&scene).expect("a picture").even_if_missed();
    let p = &picture.materials[0];
    let choice = p.choice.as_ref().expect("the session chose");
    let taken: Vec<&Trial> = choice.trials.iter().filter(|t| t.verdict == Verdict::Taken).collect();
    assert_eq!(taken.len(), 1, "{choice}");
    assert_eq!(taken[0].technique, p.method.slug());
    let apparent = p.picture_error.map(|e| e.apparent());
    assert!(taken[0].error == apparent && apparent.is_some(), "{choice}");
    let least = choice.trials.iter().filter_map(|t| t.error).fold(f64::INFINITY, f64::min);
    assert_eq!(apparent, Some(least), "{choice}");
    // The chosen technique is certified, whether or not the techniques that were tried are.
    let certificate = p.certificate.as_ref().expect("a technique");
    assert!(certificate.error < 0.1 && certificate.known == Evidence::Measured, "{certificate:?}");
    let spent: f64 = choice.trials.iter().map(|t| t.seconds).sum();
    assert!(spent <= choice.seconds && p.sample_seconds <= choice.seconds, "{choice:?}");
    assert!(choice.to_string().contains(&format!("of: {}", choice.trials[0].technique)), "{choice}");
}

#[test]
fn what_the_sample_cannot_measure_is_said() {
    let told = Arc::new(Mutex::new(Vec::new()));
    let heard = told.clone();
    let mut session = Session::new().with_listener(move |n| {
        heard.lock().expect("nobody panics").push(n.to_string());
    });
    let mut scene = scene(&mut session, "lambert:albedo=0.6");
    scene.materials[0].method = Some(Method::find("ambient").expect("a technique"));
    let (picture, _) = session.render(&scene).expect("a picture").even_if_missed();
    assert!(picture.materials[0].picture_error.is_none() && picture.materials[0].choice.is_none());
    assert_eq!(picture.materials[0].picture_unmeasured, Some("its sample knows no shadows"));
    let told = told.lock().expect("nobody panics").join("\n");
    assert!(told.contains("in this picture not measured (its sample knows no shadows)"), "{told}");
}

/// A picture whose error was measured. The time limit counts processor seconds of the whole process, and
/// other tests run at the same time.
fn measured(session: &mut Session, scene: &Scene) -> (f64, crate::Picture) {
    let once = |_| {
        let (picture, _) = session.render(scene).expect("a picture").even_if_missed();
        Some((picture.materials[0].picture_error?.relative_rms, picture))
    };
    (0..20).find_map(once).expect("it is measured")
}

#[test]
fn shadows_of_lights_beside_the_data_are_no_error_of_the_technique() {
    let mut session = Session::new();
    let mut scene = scene(&mut session, "lambert:albedo=0.6");
    session.suns = steradian_techniques::direct::Suns::Exact;
    // The knot shadows itself.
    scene.mesh = session.mesh("knot").expect("a shape");
    scene.lights.directionals = crate::atlas::three_lights().directionals;
    scene.materials[0].method = Some(Method::find("diffuse_map").expect("a technique"));
    let mut of = |shadows: Shadows| {
        session.shadows = shadows;
        let (error, picture) = measured(&mut session, &scene);
        (error, picture.film)
    };
    let (open, bright) = of(Shadows::Off);
    let (shadowed, dark) = of(Shadows::Ray);
    assert!(bright != dark && open > 0.0 && open < 0.01, "{open}");
    // The samples may differ in size, where one was stopped early.
    assert!(shadowed > 0.5 * open && shadowed < 2.0 * open, "{open} {shadowed}");
    // So may it be where all light is shadowed.
    let (all, darker) = of(Shadows::Lobe);
    assert!(darker != dark && all > 0.5 * open && all < 2.0 * open, "{open} {all}");
}

/// Against the reflectance of each point. A sample's pixels hold many squares, and averages over them
/// would be off by tens of per cent.
#[test]
fn the_error_of_pictures_with_data_per_texel_is_measured() {
    let mut session = Session::new();
    let mut scene = scene(&mut session, "lambert");
    scene.materials[0].method = Some(Method::find("lafortune_env").expect("a technique"));
    let squares = |bright: f32, dark: f32| {
        let plane: Vec<f32> =
            (0..512 * 512).map(|k| if (k / 4 + k / 2048) % 2 == 0 { bright } else { dark }).collect();
        Arc::new(
            steradian_render::Texture::new(512, 512, &[plane.clone(), plane.clone(), plane]).expect("texels"),
        )
    };
    let mut error = |planes: Planes| {
        scene.materials[0].planes = planes;
        let (error, picture) = measured(&mut session, &scene);
        (error, picture.materials[0].certificate.as_ref().expect("a technique").error)
    };
    let matte = Planes::default().with("rho_d", squares(0.9, 0.1));
    let (measured, certified) = error(matte.clone());
    assert!(measured < 0.01 && certified < 0.01, "{measured} {certified}");
    let (measured, certified) = error(matte.with("rho_1", squares(0.0, 0.5)).with("n_1", squares(4.0, 20.0)));
    assert!(measured > 0.0 && measured < certified, "{measured} {certified}");
}

/// A warning about silhouettes appears where grazing views have far larger errors than all views.
#[test]
fn large_errors_of_grazing_views_are_said() {
    let of = |all: f64, at: f64| {
        let mut c = Certificate::new(all, Evidence::Measured);
        c.elevations = vec![
            steradian_base::Elevation::measured([0.0, 0.5], all),
            steradian_base::Elevation::measured([85f64.to_radians(), 1.57], at),
        ];
        grazing(&c)
    };
    assert_eq!(of(0.14, 0.7), Some(0.7));
    assert_eq!((of(0.01, 0.05), of(0.6, 0.7)), (None, None));
}

/// With a map of roughness only techniques that take it are baked, once one of them is good; the others
/// are named.
#[test]
fn techniques_that_leave_out_what_the_material_gives_are_not_baked() {
    let mut session = Session::new();
    let mut scene = scene(&mut session, "ggx:alpha=0.4,f0=0.9");
    let plane: Vec<f32> = (0..64).map(|k| 0.05 + 0.02 * (k % 5) as f32).collect();
    let rough = steradian_render::Texture::new(8, 8, &[plane.clone(), plane.clone(), plane]);
    scene.materials[0].maps.alpha2 = rough.map(Arc::new);
    let p = session.render(&scene).expect("renders").even_if_missed().0.materials.remove(0);
    let choice = p.choice.as_ref().expect("a choice");
    let leaves_out = |t: &&Trial| t.verdict == Verdict::LeavesOut;
    assert_eq!((p.method.slug(), p.left_out()), ("split_sum", Vec::<&str>::new()), "{choice}");
    assert!(choice.trials.iter().filter(leaves_out).count() > 3, "{choice}");
    assert!(choice.trials.iter().filter(leaves_out).all(|t| t.seconds == 0.0), "{choice}");
    assert!(choice.to_string().contains("leave out parts of the material: "), "{choice}");
}

/// Techniques that others refine are not tried after these, where no tolerance asks for small data.
#[test]
fn refined_techniques_come_after_what_refines_them() {
    let material = Material::new(steradian_brdf::parse("ggx:alpha=0.3").expect("a spec"));
    let order: Vec<&str> = candidates(&material, false).iter().map(|t| t.card().slug).collect();
    let place = |slug: &str| order.iter().position(|s| *s == slug).expect(slug);
    let slices = Trial { error: Some(0.2), ..Trial::new("shrm_slices") };
    for slug in ["shrm", "shrm_global"] {
        let t = steradian_techniques::find(slug).expect("a technique");
        assert!(place("shrm_slices") < place(slug), "{order:?}");
        let tried = |before: &Trial| is_refined(t, &Trial::new(slug), std::slice::from_ref(before));
        assert!(tried(&slices) && !tried(&Trial::new("shrm_slices")));
        assert!(!tried(&Trial { left_out: vec!["the roughness map"], ..slices.clone() }));
    }
    // One lobe of a filtered chain after several of the same chain.
    for spec in ["ggx:alpha=0.3", "ggx:ax=0.1,ay=0.4"] {
        let material = Material::new(steradian_brdf::parse(spec).expect("a spec"));
        let order: Vec<&str> = candidates(&material, false).iter().map(|t| t.card().slug).collect();
        let place = |slug: &str| order.iter().position(|s| *s == slug).expect(slug);
        assert!(place("gaussian_lobes") < place("split_sum"), "{order:?}");
    }
    let named = steradian_techniques::registry().iter().filter_map(|t| t.refined_by());
    assert!(named.into_iter().all(|slug| steradian_techniques::find(slug).is_some()));
}

/// Mirrors stand for what is as sharp as a mirror, and not for every width of the same model.
#[test]
fn specimens_stand_for_reflectance_of_their_model_and_sharpness() {
    let brdf = |spec: &str| steradian_brdf::parse(spec).expect(spec);
    let slugs = |spec: &str| -> Vec<&str> {
        candidates(&Material::new(brdf(spec)), false).iter().map(|t| t.card().slug).collect()
    };
    assert_eq!(slugs("ggx:alpha=0.004")[0], "mirror_map");
    let rough = slugs("ggx:alpha=0.3");
    assert!(rough[0] != "mirror_map" && rough.contains(&"mirror_map"), "{rough:?}");
    // A factor before a reflectance leaves its model as it is.
    assert!(same_model(&*brdf("ggx:alpha=0.3,scale=0.5"), &*brdf("ggx:alpha=0.1")));
    assert!(!same_model(&*brdf("sgd:chrome-steel"), &*brdf("abc:black-obsidian")));
}
