//! Local light from the command line: `--local` beside a technique, and the horizons of height maps.

use super::common::{fails, json, said, well};
use std::fs;
use std::path::Path;
use steradian_formats::{
    Limits, Raster, ReadOptions, WriteOptions, read_image_with, read_ktx2_array, write_image,
};

/// A sphere under an overcast sky and a lamp; radiance of all channels.
fn picture(dir: &Path, local: &[&str]) -> Vec<f32> {
    let file = "picture.pfm";
    let fixed = ["render", "sphere", "-e", "overcast", "--light", "point:position=1/2/3,intensity=30/20/10"];
    let made = ["-t", "sh-irradiance", "-b", "lambert:albedo=0.5", "--size", "40", "--quiet", "-o", file];
    let (code, _, err) = said(dir, &[&fixed[..], &made, local].concat());
    assert_eq!(code, Some(0), "{local:?}: {err}");
    let options = ReadOptions { limits: Limits::default(), ..ReadOptions::default() };
    let raster = read_image_with(&dir.join(file), &options).expect("reads");
    raster.into_rgb().expect("three channels").concat()
}

/// Root mean square of a difference over that of the first.
fn difference(a: &[f32], b: &[f32]) -> f64 {
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| f(f64::from(*a), f64::from(*b))).sum()
    };
    (sum(&|a, b| (a - b) * (a - b)) / sum(&|a, _| a * a)).sqrt()
}

/// A lamp is shaded once, by the reflectance itself or by a technique of its own.
#[test]
fn local_techniques_shade_lamps_beside_a_global_one() {
    let d = tempfile::tempdir().expect("a folder");
    let exact = picture(d.path(), &[]);
    assert_eq!(exact, picture(d.path(), &["--local", "exact"]));
    let of_points = picture(d.path(), &["--local", "vertex-analytic:rate=pixel"]);
    assert!(difference(&exact, &of_points) < 1e-6);
    // The sphere's triangles are flat in what is interpolated between their corners.
    let of_corners = difference(&exact, &picture(d.path(), &["--local", "vertex_analytic"]));
    assert!((1e-5..0.02).contains(&of_corners), "{of_corners}");
    // So is what they see of the lamp; a sphere sees nothing of itself.
    let alone = picture(d.path(), &["--local", "precomputed_visibility:bounces=0,shadow=none"]);
    assert!(difference(&exact, &alone) < 1e-6);
    let linked = difference(&exact, &picture(d.path(), &["--local", "precomputed_visibility:directions=16"]));
    assert!(linked < 0.02, "{linked}");
}

#[test]
fn local_techniques_say_what_they_do_not_take() {
    let d = tempfile::tempdir().expect("a folder");
    let fixed = ["render", "sphere", "-e", "overcast", "--light", "point:position=1/2/3,intensity=3/2/1"];
    for (local, why) in [
        ("nothing", "there are: exact, vertex_analytic"),
        ("banks_table", "takes banks only, not lambert"),
        ("vertex_analytic:rate=often", "rate"),
        ("vertex_analytic:speed=3", "speed"),
    ] {
        let made = ["-t", "sh-irradiance", "-b", "lambert:albedo=0.5", "--local", local, "-o", "x.pfm"];
        fails(d.path(), 2, why, &[&fixed[..], &made].concat());
        assert!(!d.path().join("x.pfm").exists());
    }
    let made = ["-t", "reference", "-b", "lambert", "--local", "vertex_analytic", "-o", "x.pfm"];
    fails(d.path(), 2, "leave it out, name another --technique", &[&fixed[..], &made].concat());
}

/// A height map of 8 × 8 texels with a wall across it, and one whose last height is no number.
fn walls(dir: &Path) {
    let heights: Vec<f32> = (0..64).map(|k| if k % 8 == 3 { 1.0 } else { 0.0 }).collect();
    let raster = Raster::rgb(8, 8, [heights.clone(), heights.clone(), heights]);
    write_image(&dir.join("wall.pfm"), &raster, &WriteOptions::default()).expect("written");
    let mut bytes = fs::read(dir.join("wall.pfm")).expect("reads");
    let last = bytes.len() - 4;
    bytes[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(dir.join("broken.pfm"), &bytes).expect("written");
    fs::write(dir.join("cut.pfm"), &bytes[..100]).expect("written");
}

#[test]
fn height_maps_become_horizons() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    walls(dir);
    let horizons = |from: &'static str, form: &'static str, to: &'static str| {
        ["convert", from, "--relief", "0.25", "--horizons", form, "-o", to]
    };
    let (code, _, err) = said(dir, &horizons("wall.pfm", "8", "h.ktx2"));
    assert_eq!(code, Some(0), "{err}");
    let array = read_ktx2_array(&dir.join("h.ktx2"), &Limits::default()).expect("reads");
    assert_eq!((array.width, array.height, array.layers), (8, 8, 2));
    // The wall is a quarter of the width high, two texels; from two texels to its left its top is at 45° to
    // the right (azimuth 0), and nothing is in the way along it (azimuth 2 of 8).
    let level = &array.levels[0];
    let at = |texel: usize, azimuth: usize| level[4 * (azimuth / 4 * 64 + texel) + azimuth % 4];
    assert!((f64::from(at(8 * 4 + 1, 0)) - std::f64::consts::FRAC_PI_4).abs() < 1e-3, "{}", at(33, 0));
    assert!(at(8 * 4 + 1, 2).abs() < 1e-3, "{}", at(33, 2));
    let (code, out, err) = said(dir, &["inspect", "h.ktx2"]);
    assert!(code == Some(0) && out.contains("8 azimuths"), "{out}{err}");
    let (code, _, err) = said(dir, &horizons("wall.pfm", "ellipses", "e.ktx2"));
    assert_eq!(code, Some(0), "{err}");
    let (code, out, err) = said(dir, &["inspect", "e.ktx2"]);
    assert!(code == Some(0) && out.contains("ellipses"), "{out}{err}");

    fails(dir, 3, "broken.pfm", &horizons("broken.pfm", "8", "x.ktx2"));
    fails(dir, 3, "missing.pfm", &horizons("missing.pfm", "8", "x.ktx2"));
    fails(dir, 2, "x.png", &horizons("wall.pfm", "8", "x.png"));
    fails(dir, 3, "cut.pfm", &horizons("cut.pfm", "8", "x.ktx2"));
    assert!(!dir.join("x.ktx2").exists());
}

/// Points on a plane with the normal z and the tangent x, at these texture coordinates.
fn csv(uv: &[[f64; 2]], columns: &str) -> String {
    let mut out = format!("nx,ny,nz,vx,vy,vz,{columns}\n");
    for [u, v] in uv {
        let more: Vec<String> = columns
            .split(',')
            .map(|c| match c {
                "u" => u.to_string(),
                "v" => v.to_string(),
                "tx" => "1".into(),
                _ => "0".into(),
            })
            .collect();
        out += &format!("0,0,1,0,0,1,{}\n", more.join(","));
    }
    out
}

/// Bumps hide a low light from the texels before a wall, in `eval` and in pictures, and are seen under other
/// light too.
#[test]
fn bumps_shadow_themselves() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    walls(dir);
    // Two texels to the left of the wall, which is two texels high; and five.
    let centres = [1.5 / 8.0, 6.5 / 8.0].map(|u| [u, 0.5]);
    fs::write(dir.join("points.csv"), csv(&centres, "u,v,tx,ty,tz")).expect("written");
    let radiance = |degrees: f64, local: &str| -> Vec<f64> {
        let (s, c) = degrees.to_radians().sin_cos();
        let light = format!("directional:direction={c}/0/{s},irradiance=1/1/1");
        let fixed = ["eval", "-p", "points.csv", "-b", "lambert", "-t", "sh-irradiance", "-e", "dark.pfm"];
        let (code, out, err) =
            said(dir, &[&fixed[..], &["--light", &light, "--local", local, "--quiet"]].concat());
        assert_eq!(code, Some(0), "{err}");
        let column = |row: &str| row.split(',').nth(11).and_then(|x| x.parse().ok()).expect("red");
        out.lines().skip(1).map(column).collect()
    };
    let black = vec![0.0; 8 * 4];
    write_image(
        &dir.join("dark.pfm"),
        &Raster::rgb(8, 4, [black.clone(), black.clone(), black]),
        &WriteOptions::default(),
    )
    .expect("written");
    for shadow in ["horizon", "ellipse"] {
        let local = format!("bump-horizon:height=wall.pfm,relief=0.25,shadow={shadow}");
        let (low, high) = (radiance(38.0, &local), radiance(52.0, &local));
        assert!(low[0] == 0.0 && high[0] > 0.2, "{shadow}: {low:?} {high:?}");
        assert!((low[1] - 38f64.to_radians().sin() / std::f64::consts::PI).abs() < 1e-5, "{low:?}");
    }
    let none = radiance(38.0, "bump-horizon:height=wall.pfm,relief=0.25,shadow=none");
    assert!(none[0] > 0.1 && (none[0] - none[1]).abs() < 1e-6, "{none:?}");
    // Pictures: the wall's flanks are seen under the sky alone, too.
    let picture = |local: &str| {
        let light = "directional:direction=0.9/0.5/0,irradiance=3/3/3";
        let fixed =
            ["render", "plane", "-e", "overcast", "--light", light, "-b", "lambert", "-t", "sh-irradiance"];
        let made = [
            "--from", "0,3,0.01", "--at", "0,0,0", "--size", "32", "--quiet", "--local", local, "-o", "p.pfm",
        ];
        let (code, _, err) = said(dir, &[&fixed[..], &made].concat());
        assert_eq!(code, Some(0), "{err}");
        let options = ReadOptions { limits: Limits::default(), ..ReadOptions::default() };
        read_image_with(&dir.join("p.pfm"), &options)
            .expect("reads")
            .into_rgb()
            .expect("three channels")
            .concat()
    };
    let [flat, bumpy, hidden] = [
        "exact",
        "bump_horizon:height=wall.pfm,relief=0.25,shadow=none",
        "bump_horizon:height=wall.pfm,relief=0.25",
    ]
    .map(picture);
    let sum = |p: &[f32]| p.iter().map(|x| f64::from(*x)).sum::<f64>();
    assert!(difference(&flat, &bumpy) > 0.02 && sum(&hidden) < 0.995 * sum(&bumpy));
}

#[test]
fn data_per_texel_say_what_they_lack() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    walls(dir);
    fs::write(dir.join("bare.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
        .expect("written");
    let light =
        ["-e", "overcast", "--light", "directional:direction=0/0/1,irradiance=1/1/1", "-t", "sh-irradiance"];
    let render = |mesh: &'static str, local: &'static str| {
        [&["render", mesh, "-b", "lambert", "--local", local, "-o", "x.pfm"][..], &light].concat()
    };
    fails(dir, 3, "broken.pfm", &render("plane", "bump_horizon:height=broken.pfm"));
    fails(dir, 3, "missing.pfm", &render("plane", "bump_blinn_phong:height=missing.pfm"));
    fails(
        dir,
        3,
        "bare.obj: has no texture coordinates",
        &render("bare.obj", "bump_horizon:height=wall.pfm"),
    );
    fails(dir, 2, "relief", &render("plane", "bump_horizon:height=wall.pfm,relief=99"));
    fails(dir, 3, "broken.pfm", &render("plane", "lafortune_svbrdf:n_1=broken.pfm"));
    fails(dir, 3, "cut.pfm", &render("plane", "lafortune_svbrdf:rho_1=cut.pfm"));
    fails(
        dir,
        2,
        "takes ward, ggx, blinn-phong-gl and lafortune, not lambert",
        &render("plane", "shift_variant"),
    );
    // The wall's ground is 0 high: no width.
    for (spec, file) in [
        ("widths=broken.pfm", "broken.pfm"),
        ("tangent=none.pfm", "none.pfm"),
        ("widths=wall.pfm", "wall.pfm: texel (0, 0) has 0: widths takes 0.0001 to 100000000"),
    ] {
        let local = format!("shift_variant:{spec}");
        let made = ["render", "plane", "-b", "ward:ax=0.2,ay=0.4", "--local", &local, "-o", "x.pfm"];
        fails(dir, 3, file, &[&made[..], &light].concat());
    }
    for (columns, lacks) in [("tx,ty,tz", "no u"), ("u,v", "no tx"), ("u,tx,ty,tz", "'v'")] {
        fs::write(dir.join("p.csv"), csv(&[[0.5; 2]], columns)).expect("written");
        let local = "bump_horizon:height=wall.pfm";
        let made = ["eval", "-p", "p.csv", "-b", "lambert", "--local", local, "-o", "x.csv"];
        fails(dir, 3, lacks, &[&made[..], &light].concat());
    }
    let scene = |height: &str| {
        format!(
            "[[mesh]]\nshape = \"plane\"\nmaterial = \"a\"\n[material.a]\nbrdf = \"lambert\"\nlocal = \
             \"bump_horizon:height={height}\"\n[[light.directional]]\ndirection = [0, 1, 0]\nirradiance = [1, 1, 1]\n"
        )
    };
    fs::create_dir(dir.join("scene")).expect("a folder");
    for (height, why) in [("../wall.pfm", "../wall.pfm"), ("none.pfm", "none.pfm")] {
        fs::write(dir.join("scene/s.toml"), scene(height)).expect("written");
        fails(dir, 3, why, &["render", "scene/s.toml", "-t", "sh-irradiance", "-o", "x.pfm"]);
    }
    assert!(!dir.join("x.pfm").exists() && !dir.join("x.csv").exists());
}

/// In a scene file the textures of a material go to both its techniques: the same bits as with the files in
/// their parameters; what no technique reads is refused at its line.
#[test]
fn scene_files_name_textures_once() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let numbers = |file: &str, f: &dyn Fn(usize) -> f32| {
        let plane: Vec<f32> = (0..64).map(f).collect();
        let raster = Raster::rgb(8, 8, [plane.clone(), plane.clone(), plane]);
        write_image(&dir.join(file), &raster, &WriteOptions::default()).expect("written");
    };
    numbers("n.pfm", &|k| 4.0 + (k % 8) as f32);
    numbers("rho.pfm", &|k| 0.1 + 0.01 * (k / 8) as f32);
    numbers("angles.pfm", &|k| 0.1 * (k % 8) as f32);
    numbers("bumps.pfm", &|k| ((k % 8) as f32 * 0.8).sin().abs());
    let render = |name: &str, material: &str| {
        let text = format!(
            "[[mesh]]\nshape = \"plane:size=2\"\nmaterial = \"a\"\n[camera]\nfrom = [0, 2, 1]\n[material.a]\n{material}\n\
             [light]\nenvironment = \"overcast\"\n[[light.point]]\nposition = [0.5, 1, 0]\nintensity = [9, 9, 9]\n\
             [output]\nwidth = 16\nheight = 16\n"
        );
        fs::write(dir.join(name), text).expect("written");
        let output = format!("{name}.pfm");
        let (code, _, err) = said(dir, &["render", name, "--quiet", "-o", &output]);
        assert_eq!(code, Some(0), "{err}");
        fs::read(dir.join(output)).expect("a picture")
    };
    let lobes = "brdf = \"lambert:albedo=0.2\"\ntechnique = \"lafortune_env\"\n";
    let once = render(
        "once.toml",
        &format!(
            "{lobes}local = \"lafortune_svbrdf\"\ntextures = {{ rho_1 = \"rho.pfm\", n_1 = \"n.pfm\" }}"
        ),
    );
    let twice = render(
        "twice.toml",
        &format!(
            "{lobes}local = \"lafortune_svbrdf:rho_1=rho.pfm,n_1=n.pfm\"\nparams = {{ rho_1 = \"rho.pfm\", n_1 = \"n.pfm\" }}"
        ),
    );
    assert!(once == twice);
    let without = render("without.toml", &format!("{lobes}local = \"lafortune_svbrdf\""));
    assert!(once != without);
    let ward = "brdf = \"ward:ax=0.2,ay=0.5\"\n";
    let named = render(
        "named.toml",
        &format!(
            "{ward}local = \"shift_variant\"\ntextures = {{ tangent = \"angles.pfm\", height = \"bumps.pfm\" }}"
        ),
    );
    let inline = render(
        "inline.toml",
        &format!("{ward}local = \"shift_variant:tangent=angles.pfm,height=bumps.pfm\""),
    );
    assert!(named == inline);
    for (name, textures, why) in [
        ("unread.toml", "tangent = \"angles.pfm\"", "no technique of it reads a texture 'tangent'"),
        ("outside.toml", "n_1 = \"../n.pfm\"", "key 'textures.n_1'"),
        ("missing.toml", "n_1 = \"none.pfm\"", "none.pfm"),
    ] {
        let text = format!(
            "[[mesh]]\nshape = \"plane\"\nmaterial = \"a\"\n[material.a]\n{lobes}textures = {{ {textures} }}\n\
             [light]\nenvironment = \"overcast\"\n"
        );
        fs::write(dir.join(name), text).expect("written");
        fails(dir, 3, why, &["render", name, "-o", "x.pfm"]);
    }
}

/// Numbers by texel: a picture's halves have their own lobes and widths, as plain models of these numbers
/// have.
#[test]
fn reflectances_differ_from_texel_to_texel() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let halves = |file: &str, [left, right]: [[f32; 3]; 2]| {
        let plane = |c: usize| (0..64).map(|k| if k % 8 < 4 { left[c] } else { right[c] }).collect();
        let raster = Raster::rgb(8, 8, [plane(0), plane(1), plane(2)]);
        write_image(&dir.join(file), &raster, &WriteOptions::default()).expect("written");
    };
    halves("rho.pfm", [[0.5, 0.5, 0.5], [0.2, 0.4, 0.6]]);
    halves("n.pfm", [[4.0; 3], [20.0; 3]]);
    halves("widths.pfm", [[0.2, 0.5, 0.0], [0.5, 0.2, 0.0]]);
    let black = vec![0.0; 8 * 4];
    let dark = Raster::rgb(8, 4, [black.clone(), black.clone(), black]);
    write_image(&dir.join("dark.pfm"), &dark, &WriteOptions::default()).expect("written");
    fs::write(dir.join("points.csv"), csv(&[[0.3125, 0.5], [0.8125, 0.5]], "u,v,tx,ty,tz")).expect("written");
    let radiance = |brdf: &str, local: &str| -> Vec<f64> {
        let light = "directional:direction=0.2/0.5/0.8,irradiance=1/1/1";
        let fixed =
            ["eval", "-p", "points.csv", "-e", "dark.pfm", "--light", light, "--quiet", "-t", "sh_brdf"];
        let (code, out, err) = said(dir, &[&fixed[..], &["-b", brdf, "--local", local]].concat());
        assert_eq!(code, Some(0), "{brdf} {local}: {err}");
        let green = |row: &str| row.split(',').nth(12).and_then(|x| x.parse().ok()).expect("green");
        out.lines().skip(1).map(green).collect()
    };
    let lobe = |n: f64, ks: f64| format!("lafortune:cx=-1,cy=-1,cz=1,n={n},ks={ks},kd=0.3");
    for (textured, plain) in [
        (
            radiance("lambert:albedo=0.3", "lafortune_svbrdf:rho_1=rho.pfm,n_1=n.pfm"),
            [lobe(4.0, 0.5), lobe(20.0, 0.4)],
        ),
        (
            radiance("ward:ax=0.3,ay=0.3,rs=0.5,rd=0.2", "shift_variant:widths=widths.pfm"),
            ["ward:ax=0.2,ay=0.5,rs=0.5,rd=0.2".into(), "ward:ax=0.5,ay=0.2,rs=0.5,rd=0.2".into()],
        ),
    ] {
        for (k, spec) in plain.iter().enumerate() {
            let want = radiance(spec, "exact")[k];
            assert!((textured[k] - want).abs() < 1e-5 * want, "{spec}: {} {want}", textured[k]);
        }
        assert!((textured[0] - textured[1]).abs() > 1e-3, "{textured:?}");
    }
}

/// The same images drive what shades environments and what shades lamps, and pictures of both are held
/// against a reference that has them too; where it has none, or images cannot be placed, it says so.
#[test]
fn the_same_images_drive_environments_and_lamps() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let halves = |file: &str, [left, right]: [[f32; 3]; 2]| {
        let plane = |c: usize| (0..64).map(|k| if k % 8 < 4 { left[c] } else { right[c] }).collect();
        let raster = Raster::rgb(8, 8, [plane(0), plane(1), plane(2)]);
        write_image(&dir.join(file), &raster, &WriteOptions::default()).expect("written");
    };
    halves("rho.pfm", [[0.5, 0.5, 0.5], [0.2, 0.4, 0.6]]);
    halves("n.pfm", [[4.0; 3], [20.0; 3]]);
    fs::write(dir.join("points.csv"), csv(&[[0.3125, 0.5], [0.8125, 0.5]], "u,v,tx,ty,tz")).expect("written");
    let radiance = |brdf: &str, params: &[&str]| -> Vec<f64> {
        let fixed =
            ["eval", "-p", "points.csv", "-e", "studio", "--quiet", "-t", "lafortune_env", "-b", brdf];
        let (code, out, err) = said(dir, &[&fixed[..], params].concat());
        assert_eq!(code, Some(0), "{brdf} {params:?}: {err}");
        let green = |row: &str| row.split(',').nth(12).and_then(|x| x.parse().ok()).expect("green");
        out.lines().skip(1).map(green).collect()
    };
    let images = ["--param", "rho_1=rho.pfm", "--param", "n_1=n.pfm"];
    let base = "lafortune:cx=-1,cy=-1,cz=1,n=1,ks=0,kd=0.3";
    let textured = radiance(base, &images);
    for (k, (n, ks)) in [(4.0, 0.5), (20.0, 0.4)].into_iter().enumerate() {
        let want = radiance(&format!("lafortune:cx=-1,cy=-1,cz=1,n={n},ks={ks},kd=0.3"), &[])[k];
        assert!((textured[k] - want).abs() < 1e-4 * want, "{n}: {} {want}", textured[k]);
    }
    let made = ["compare", "sphere", "-e", "overcast", "-b", base, "-t", "lafortune_env", "--size", "24"];
    let lamp = ["--light", "point:position=2/2/2,intensity=30/30/30"];
    let local = ["--local", "lafortune_svbrdf:rho_1=rho.pfm,n_1=n.pfm"];
    let v = json(
        dir,
        &[&made[..], &images, &lamp, &local, &["-o", "both.png", "--table", "both.csv", "--json"]].concat(),
    );
    let table = fs::read_to_string(dir.join("both.csv")).expect("a table");
    assert!(
        table.starts_with("environment,brdf,technique,local,")
            && table.contains("\"lafortune_env\",\"lafortune_svbrdf"),
        "{table}"
    );
    let error = v["comparisons"][0]["techniques"][1]["relative_rms"].as_f64().expect("a number");
    assert!(error < 0.025, "{error}");
    // The error in the picture is known where both kinds of light read the same images.
    let render = [
        "render",
        "sphere",
        "-e",
        "overcast",
        "-b",
        "lambert:albedo=0.3",
        "-t",
        "lafortune_env",
        "--size",
        "24",
    ];
    let picture = |local: &[&str]| {
        json(dir, &[&render[..], &images, &lamp, local, &["-o", "one.png", "--json"]].concat())["materials"]
            [0]
        .clone()
    };
    let [same, other] = [picture(&local), picture(&["--local", "lafortune_svbrdf:rho_1=rho.pfm"])];
    let error = same["picture_error"].as_f64().expect("a number");
    assert!(error > 0.0 && error < 0.1, "{error}");
    assert!(other["picture_error"].is_null(), "{other}");
    fails(dir, 2, "paths know one reflectance", &[&made[..], &images, &["--path", "-o", "x.png"]].concat());
    fs::write(dir.join("bare.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
        .expect("written");
    let bare = ["compare", "bare.obj", "-e", "overcast", "-b", base, "-t", "lafortune_env", "-o", "x.png"];
    fails(dir, 2, "has no texture coordinates", &[&bare[..], &images].concat());
    let apart = ["compare", "sphere", "-b", "lafortune:@skin", "-t", "lafortune_env", "-t", "sh_brdf"];
    let other = ["--param", "n_1=n.pfm", "--param", "widths=n.pfm", "-o", "x.png"];
    fails(dir, 2, "compare them apart", &[&apart[..], &other].concat());
    assert!(!dir.join("x.png").exists());
}

/// A ground has none of the mesh's textures, and who asks for both hears it.
#[test]
fn a_ground_is_shaded_without_the_textures_of_the_mesh() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    walls(dir);
    let light = ["--light", "directional:direction=0.2/0.8/0.3,irradiance=1/1/1", "-e", "overcast"];
    let made = ["render", "sphere", "-b", "lambert", "--ground=lambert", "--size", "24", "-o", "p.pfm"];
    let local = ["-t", "sh-irradiance", "--local", "bump_horizon:height=wall.pfm"];
    let (code, out, err) = said(dir, &[&made[..], &light, &local].concat());
    assert_eq!(code, Some(0), "{err}");
    let said = format!("{out}{err}");
    assert!(said.contains("ground: not by bump_horizon (its files belong to the mesh)"), "{said}");
}

/// The normals of a local technique are all light's, whether a lamp shines or none; its error is told as its
/// own; and a reflectance that has a direction finds none on a mesh without tangents and texture coordinates.
#[test]
fn bumps_errors_and_directions_are_those_of_the_local_technique() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    walls(dir);
    let fixed =
        ["render", "sphere", "-e", "overcast", "-b", "lambert", "-t", "sh-irradiance", "--size", "24"];
    let bumpy = ["--local", "bump_horizon:height=wall.pfm"];
    well(dir, &[&fixed[..], &["-o", "plain.pfm"]].concat());
    well(dir, &[&fixed[..], &bumpy, &["-o", "bumpy.pfm"]].concat());
    assert!(
        fs::read(dir.join("plain.pfm")).expect("a picture")
            != fs::read(dir.join("bumpy.pfm")).expect("a picture")
    );
    let lamp = ["--light", "directional:direction=0.2/0.8/0.3,irradiance=1/1/1", "-o", "lit.pfm"];
    let (code, _, err) = said(dir, &[&fixed[..], &bumpy, &lamp].concat());
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains("; bump_horizon, of directional and point lights: "), "{err}");
    fs::write(dir.join("bare.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
        .expect("written");
    let brushed = ["render", "bare.obj", "-b", "banks:n=30", "-t", "sh-brdf", "--local", "banks_table"];
    fails(
        dir,
        3,
        "neither tangents nor texture coordinates",
        &[&brushed[..], &lamp[..3], &["x.png"]].concat(),
    );
}
