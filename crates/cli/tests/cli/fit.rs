//! `steradian convert brdf:SPEC` and `steradian fit`: tables out and in, a kilobyte of lobes, one line per
//! fault.

use super::common::{fails, json, run};
use std::fs;
use steradian_formats::{Limits, Tensor, TensorData, read_tensors, write_tensors};

#[test]
fn a_model_becomes_a_table_and_the_table_lobes() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    fs::create_dir(dir.join("tables")).expect("a folder");
    for (spec, file) in
        [("ggx:alpha=0.3,f0=0.9/0.6/0.3", "tables/a.binary"), ("lambert:albedo=0.5", "tables/b.binary")]
    {
        let o = run(dir, &["convert", &format!("brdf:{spec}"), "-o", file]);
        assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    }
    // The folder holds two: both are fitted, and named after their files.
    let fits = json(dir, &["fit", "tables", "-o", "{}.safetensors", "--json"]);
    let names: Vec<_> = fits["fits"].as_array().expect("a list").iter().map(|f| f["name"].clone()).collect();
    assert_eq!(names, ["a", "b"]);
    let a = &fits["fits"][0];
    assert_eq!((a["bytes"].as_u64(), a["views"].as_array().map(Vec::len)), (Some(552), Some(15)));
    assert!(a["views"][3]["energy"].as_f64().expect("a number") < 0.01);
    // What the fit means has the albedo of the table, and shades.
    let albedo = |spec: &str| {
        let of = json(dir, &["inspect", &format!("brdf:{spec}"), "--json"]);
        of["directional_albedo"][1]["rgb"][0].as_f64().expect("a number")
    };
    let (table, lobes) = (albedo("merl:tables/a.binary"), albedo("lobes:a.safetensors"));
    assert!((lobes / table - 1.0).abs() < 0.01, "{lobes} instead of {table}");
    fs::write(dir.join("p.csv"), "nx,ny,nz,vx,vy,vz\n0,1,0,0.6,0.8,0\n").expect("written");
    let eval = ["eval", "-e", "furnace", "-b", "lobes:a.safetensors", "-p", "p.csv", "-t", "gaussian-lobes"];
    let o = run(dir, &eval);
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
}

/// With a tolerance lobes and views are chosen; one that cannot be met writes the nearest, says so and
/// exits 4.
#[test]
fn a_fit_within_a_tolerance() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let fit = |tolerance: &'static str| {
        ["fit", "ggx:alpha=0.4", "-o", "a.safetensors", "--tolerance", tolerance, "--json"]
    };
    let found = json(dir, &fit("0.5"));
    let one = &found["fits"][0];
    assert!(one["tolerance_met"] == true && one["error"].as_f64().expect("a number") <= 0.5, "{one}");
    let worst = |k: &str| {
        let views = one["views"].as_array().expect("a list").iter();
        views.map(|v| v[k].as_f64().expect("a number")).fold(0.0, f64::max)
    };
    assert!(worst("log") > 0.0 && worst("cube_root") > 0.0 && worst("of_whole").sqrt() <= 0.5);
    fs::remove_file(dir.join("a.safetensors")).expect("written");
    fails(dir, 4, "asked 1.00e-9", &fit("1e-9"));
    assert!(dir.join("a.safetensors").exists());
    let both = [&fit("0.5")[..], &["--lobes", "2"]].concat();
    assert_eq!(run(dir, &both).status.code(), Some(2), "either or");
}

/// The page of a fit holds all that it shows; where it cannot go is said before anything is fitted.
#[test]
fn a_page_tells_how_good_a_fit_is() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let fit = ["fit", "ggx:alpha=0.4", "--lobes", "2", "--views", "5", "-o", "a.safetensors", "--report"];
    fs::write(dir.join("taken"), "").expect("written");
    fails(dir, 1, "exists and is not a folder", &[&fit[..], &["taken"]].concat());
    assert!(!dir.join("a.safetensors").exists());
    let both = ["fit", "lambert", "ggx:alpha=0.4", "--lobes", "2", "--views", "5", "-o", "{}.safetensors"];
    let o = run(dir, &[&both[..], &["--report", "pages", "--environment", "furnace"]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    let page = fs::read_to_string(dir.join("pages/alpha-0.4.html")).expect("a page");
    assert_eq!(page.matches("data:image/png;base64,").count(), 4);
    assert!(page.contains("<svg") && page.contains("furnace: the fit") && !page.contains("http-equiv"));
    assert!(!page.replace("http://www.w3.org/2000/svg", "").contains("http://"));
    let index = fs::read_to_string(dir.join("pages/index.html")).expect("a page of all");
    for name in ["lambert", "alpha-0.4"] {
        let link = format!("<a href=\"{name}.html\">{name}</a>");
        assert!(index.contains(&link) && dir.join(format!("pages/{name}.html")).exists(), "{name}");
    }
    assert!(index.contains("<th>under furnace</th>") && index.matches("data:image/png;base64,").count() == 2);
    let o = run(dir, &["fit", "lambert", "-o", "b.safetensors", "--environment", "sky"]);
    assert_eq!(o.status.code(), Some(2), "a light without a page");
}

/// Visibility asks for a mesh, and points on it see what they see; a bake of one mesh is not shaded on
/// another.
#[test]
fn lobes_are_shadowed_where_that_is_asked_for() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    fs::write(dir.join("p.csv"), "nx,ny,nz,vx,vy,vz,px,py,pz\n-1,0,0,-1,0.3,0,0.4,0,0\n").expect("written");
    let brdf = "ggx:alpha=0.3,f0=0.9";
    let eval = ["eval", "-e", "furnace", "-b", brdf, "-p", "p.csv", "-t", "gaussian-lobes"];
    let red = |arguments: &[&str]| -> f64 {
        let o = run(dir, arguments);
        let text = String::from_utf8_lossy(&o.stdout).into_owned();
        let row = text.lines().nth(1).unwrap_or_else(|| panic!("{}", String::from_utf8_lossy(&o.stderr)));
        row.split(',').nth(9).expect("ten columns").parse().expect("a number")
    };
    let asked = [&eval[..], &["--param", "visibility=published"]].concat();
    fails(dir, 2, "gaussian_lobes bakes on a mesh: give --mesh", &asked);
    let (open, seen) = (red(&eval), red(&[&asked[..], &["--mesh", "torus"]].concat()));
    assert!(seen > 0.0 && seen < 0.9 * open, "{seen} of {open}");
    let bake = ["bake", "furnace", "-t", "gaussian-lobes", "-b", brdf, "--mesh", "sphere"];
    let o = run(dir, &[&bake[..], &["--param", "visibility=ambient", "-o", "b.safetensors"]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    let render = ["render", "sphere", "--bake", "b.safetensors", "--size", "16x16", "-o", "a.png"];
    let o = run(dir, &render);
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    fails(dir, 3, "baked on another mesh", &[&["render", "knot"], &render[2..]].concat());
}

/// Files of round lobes, which hold five numbers a lobe, mean what they meant.
#[test]
fn round_lobes_of_five_numbers_load() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let fit = ["fit", "ggx:alpha=0.3", "--shape", "round", "-o", "six.safetensors"];
    let o = run(dir, &fit);
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    let mut file = read_tensors(&dir.join("six.safetensors"), &Limits::default()).expect("reads");
    let lobes = &file.tensors["lobes"];
    let (shape, numbers) = (lobes.shape.clone(), lobes.data.to_f64().into_owned());
    assert!(numbers.chunks_exact(6).all(|l| l[5] == 0.0));
    let mut put = |each: usize, name: &str| {
        let some = numbers.chunks_exact(6).flat_map(|l| l[..each].to_vec()).collect();
        let tensor = Tensor { shape: vec![shape[0], shape[1], each], data: TensorData::F64(some) };
        file.tensors.insert("lobes".into(), tensor);
        write_tensors(&dir.join(name), &file).expect("written");
    };
    put(5, "five.safetensors");
    put(4, "four.safetensors");
    let albedo =
        |spec: &str| json(dir, &["inspect", &format!("brdf:{spec}"), "--json"])["directional_albedo"].clone();
    assert_eq!(albedo("lobes:five.safetensors"), albedo("lobes:six.safetensors"));
    fails(dir, 3, "not [N, K, 6]", &["inspect", "brdf:lobes:four.safetensors"]);
}

#[test]
fn faults_are_one_line() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    fs::write(dir.join("cut.binary"), [90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0, 1]).expect("written");
    fs::write(dir.join("text.bsdf"), "hello").expect("written");
    fs::write(dir.join("bad.safetensors"), "hello").expect("written");
    fs::create_dir(dir.join("empty")).expect("a folder");
    let out = ["-o", "x.safetensors"];
    fails(dir, 3, "cut.binary: has 13 bytes instead of 34992012", &["fit", "cut.binary", out[0], out[1]]);
    fails(dir, 3, "text.bsdf: does not begin with tensor_file", &["fit", "text.bsdf", out[0], out[1]]);
    fails(dir, 3, "missing.binary: no such file", &["fit", "missing.binary", out[0], out[1]]);
    fails(dir, 3, "empty: holds no .binary, .bsdf, .brdf or .astm files", &["fit", "empty", out[0], out[1]]);
    fails(dir, 3, "bad.safetensors", &["inspect", "brdf:lobes:bad.safetensors"]);
    fails(dir, 2, "need a {}", &["fit", "ggx:alpha=0.1", "lambert", out[0], out[1]]);
    fails(dir, 2, "use one of .binary", &["convert", "brdf:lambert", "-o", "x.exr"]);
    fails(dir, 2, "anisotropic", &["convert", "brdf:ggx:ax=0.1,ay=0.2", "-o", "x.binary"]);
    assert!(!dir.join("x.safetensors").exists() && !dir.join("x.binary").exists());
}

/// Anisotropic reflectance has views by azimuth too, and its fit shades.
#[test]
fn a_brushed_metal_becomes_lobes() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let sizes = ["--lobes", "1", "--views", "4", "--azimuths", "6", "-o", "w.safetensors", "--json"];
    let found = json(dir, &[&["fit", "ward:ax=0.2,ay=0.5"], &sizes[..]].concat());
    let views = found["fits"][0]["views"].as_array().expect("a list");
    assert_eq!(views.len(), 24);
    let number = |v: &serde_json::Value, key: &str| v[key].as_f64().expect("a number");
    assert!((number(&views[7], "azimuth") - 90.0).abs() < 1e-9, "{}", views[7]);
    assert!((number(&views[11], "azimuth") - 330.0).abs() < 1e-9, "{}", views[11]);
    assert!(views.iter().all(|v| number(v, "energy") < if number(v, "degrees") < 60.0 { 0.1 } else { 0.6 }));
    fs::write(dir.join("p.csv"), "nx,ny,nz,vx,vy,vz\n0,1,0,0.6,0.8,0\n").expect("written");
    let eval = ["eval", "-e", "furnace", "-b", "lobes:w.safetensors", "-p", "p.csv", "-t", "gaussian-lobes"];
    let o = run(dir, &eval);
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
}
