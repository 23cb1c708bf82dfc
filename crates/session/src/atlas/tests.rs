use super::*;
use steradian_techniques::cards;

/// The printed rows have a letter for each column, and belong to techniques that there are.
#[test]
fn printed_rows_fit_the_columns() {
    let slugs: Vec<&str> = cards().map(|c| c.slug).collect();
    let printed: Vec<(&str, &str)> = slugs.iter().filter_map(|s| Some((*s, published(s)?))).collect();
    assert_eq!(printed.len(), 25);
    for (slug, row) in printed {
        assert_eq!(row.chars().count(), COLUMNS.len(), "{slug}");
    }
}

/// A small atlas: claims hold, the report matches the data, and the page shows every technique.
#[test]
fn a_few_techniques_are_seen_to_keep_their_claims() {
    let only = ["sh_irradiance", "vertex_analytic"].map(String::from).to_vec();
    let plan = Plan { size: [48, 36], noise: 0.1, only, shape: SHAPE };
    let mut session = Session::new();
    let atlas = session.atlas(&plan, &[Renderer::Cpu]).expect("an atlas");
    assert_eq!(atlas.broken(), Vec::<[String; 3]>::new());
    let stages: Vec<(Stage, &str)> = atlas.chapters.iter().map(|c| (c.stage, c.brdf.as_str())).collect();
    assert_eq!(stages, [(Stage::Open, MATTE), (Stage::Local, GLOSSY)]);
    // The advice on diffuse surfaces was tried; advice that compares techniques left out was not.
    let holds: Vec<Option<bool>> = atlas.advice.iter().map(|a| a.holds).collect();
    assert!(holds[0].is_some() && holds[1..].iter().all(Option::is_none), "{holds:?}");
    let (page, csv) = (atlas.html().expect("a page"), atlas.csv());
    for slug in plan.only {
        assert!(page.contains(&slug) && csv.contains(&slug), "{slug}");
    }
    assert_eq!(csv.lines().count(), 1 + atlas.chapters.iter().map(|c| c.entries.len()).sum::<usize>());
}

/// Shadows and reflections of the mesh and of bumps bring pictures nearer to paths.
#[test]
fn surfaces_are_seen_to_shadow_and_to_reflect() {
    let all = ["precomputed_visibility", "bump_horizon", "polynomial_texture_map", "btf_pca"];
    let slugs = &all[..if steradian_testkit::full() { all.len() } else { 1 }];
    let only = slugs.iter().map(|s| s.to_string()).collect();
    // Sites are its vertices: 1/7 of the usual number.
    let plan = Plan { size: [24, 18], noise: 0.2, only, shape: "knot:segments=72" };
    let atlas = Session::new().atlas(&plan, &[Renderer::Cpu]).expect("an atlas");
    assert_eq!(atlas.rows.len(), slugs.len());
    let named = |name: &str| COLUMNS.iter().position(|c| c.0 == name).expect("a column");
    for row in &atlas.rows {
        for name in ["self-shadowing", "inter-reflections"] {
            let tried = &row.tried[named(name)];
            let holds = tried.claimed && matches!(tried.outcome, Outcome::Holds(_));
            assert!(holds, "{}: {name}: {tried:?}", row.card.slug);
        }
    }
}

/// Claims of techniques for directional and point lights about bumps, and light and objects that change, hold
/// at points, compared with the reflectance itself; so does a reflectance that varies, where it is known.
#[test]
fn local_techniques_are_seen_to_keep_their_claims() {
    let mut measured = 0;
    for t in locals() {
        let card = t.card();
        let of_reflectance = trials::reflectances(card).len();
        let found = near::columns(*t, &[], None, &steradian_base::Task::quiet()).expect("tried");
        for ((name, claims), outcome) in COLUMNS.iter().skip(of_reflectance).zip(&found) {
            let text = format!("{}: {name}: {outcome:?}", card.slug);
            measured += usize::from(text.contains("% off"));
            // Pictures, which are not made here, tell of shadows, reflections and data per texel.
            let pictured = text.contains("no data per texel") || text.contains("around a point");
            assert!(
                !claims(&card.capabilities) || pictured || matches!(outcome, Outcome::Holds(_)),
                "{text}"
            );
        }
    }
    assert!(measured > 25, "{measured}");
}

/// Choices that make a technique shadow by itself are found.
#[test]
fn shadows_by_a_parameter_are_found() {
    let of = |slug| shadowing(steradian_techniques::find(slug).expect("a technique"));
    assert!(of("split_sum").is_none());
    assert_eq!(of("prt_diffuse"), Some(ParamValues::default()));
    let lobes = of("gaussian_lobes").expect("a choice");
    assert_eq!(lobes.0.len(), 1);
}

/// A technique that claims all isotropic or all anisotropic reflectance takes every one of the list that is
/// lit from above alone.
#[test]
fn claims_of_all_reflectance_hold() {
    for card in cards() {
        let found = trials::reflectances(card);
        let claims = [(3, card.capabilities.all_isotropic), (4, card.capabilities.all_anisotropic)];
        for (column, _) in claims.into_iter().filter(|c| c.1) {
            assert!(matches!(found[column], Outcome::Holds(_)), "{}: {:?}", card.slug, found[column]);
        }
    }
}
