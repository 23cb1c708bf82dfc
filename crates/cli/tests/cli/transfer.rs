//! `steradian transfer`, and pictures and points of techniques that bake on a mesh.

use super::common::{ends, fails, said, well};
use std::fs;
use steradian_formats::{Limits, read_tensors};
use steradian_transfer::Saved;

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
/// As coarse as is not refined for techniques with data per vertex.
const TORUS: &str = "torus:segments=48";

#[test]
fn points_get_their_columns_and_vertices_a_file() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    fs::write(dir.join("p.csv"), "id,px,py,pz,nx,ny,nz\na,0,1,0,0,2,0\nb,0,0,0,0,1,0\n").expect("written");
    let (code, out, err) = said(dir, &["transfer", "icosphere", "-p", "p.csv", "--bands", "2"]);
    assert_eq!(code, Some(0), "{err}");
    // Inside the solid all is zero, and that is said.
    assert!(err.contains("1 of 2 sites see nothing"), "{err}");
    let rows: Vec<Vec<&str>> = out.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows[0].join(","), "id,px,py,pz,nx,ny,nz,ao,t0,t1,t2,t3,v0,v1,v2,v3");
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().expect("a number");
    assert_eq!((rows[1][0], number(1, 7)), ("a", 1.0));
    assert!((number(1, 8) - 0.886_227).abs() < 1e-6 && (number(1, 9) - 1.023_327).abs() < 1e-5);
    assert!((7..16).all(|c| number(2, c) == 0.0));
    // In the open visibility is 1 in every direction, and a function of the first harmonic.
    let out = well(dir, &["transfer", "icosphere", "-p", "p.csv", "--bands", "2", "--hemisphere"]);
    let rows: Vec<&str> = out.lines().collect();
    assert!(rows[0].ends_with(",h0,h1,h2,h3"));
    let h: Vec<f64> = rows[1].split(',').skip(16).map(|x| x.parse().expect("a number")).collect();
    assert!((h[0] - 3.544_908).abs() < 1e-5 && h[1..].iter().all(|x| x.abs() < 1e-5), "{h:?}");
    let json = well(dir, &["transfer", "torus:segments=16", "--rays", "64", "-o", "t.safetensors", "--json"]);
    assert!(json.contains("\"bands\": 5") && json.contains("mesh_digest"));
    assert!(!dir.join("t.safetensors.part").exists());
    let file = read_tensors(&dir.join("t.safetensors"), &Limits::default()).expect("tensors");
    assert_eq!(file.tensors["t"].shape[1..], [1, 25]);
    let said = well(dir, &["inspect", "t.safetensors"]);
    assert!(said.contains("vertices, 5 bands") && said.contains("direct light"), "{said}");
    let three =
        ["transfer", "torus:segments=16", "--rays", "64", "--bounces", "2", "--albedo", "0.8/0.2/0.1"];
    let three: Vec<&str> = three
        .into_iter()
        .chain(["--matrices", "--hemisphere", "--bands", "2", "-o", "c.safetensors"])
        .collect();
    well(dir, &three);
    let file = read_tensors(&dir.join("c.safetensors"), &Limits::default()).expect("tensors");
    assert_eq!((file.tensors["t"].shape[1], &file.tensors["m"].shape[1..]), (3, &[4, 4][..]));
    assert_eq!(file.tensors["h"].shape[1..], [4]);
}

#[test]
fn what_cannot_be_is_said_in_one_line() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let obj = |name: &str, faces: &str| fs::write(dir.join(name), format!("{OBJ}{faces}")).expect("written");
    obj("flat.obj", "f 1 1 1\n");
    fs::write(dir.join("zero.obj"), format!("{OBJ}vn 0 0 0\nf 1//1 2//2 3//1\n")).expect("written");
    fs::write(dir.join("zero.csv"), "px,py,pz,nx,ny,nz\n0,1,0,0,0,0\n").expect("written");
    fs::write(dir.join("nan.csv"), "px,py,pz,nx,ny,nz\n0,1,nan,0,1,0\n").expect("written");
    let to = ["-o", "x.safetensors"];
    let with = |head: &[&'static str]| [head, &to].concat();
    ends(dir, 3, "flat.obj", &with(&["transfer", "flat.obj"]));
    ends(dir, 3, "normals are zero", &with(&["transfer", "zero.obj"]));
    ends(dir, 3, "line 2", &["transfer", "sphere", "-p", "zero.csv"]);
    ends(dir, 3, "line 2", &["transfer", "sphere", "-p", "nan.csv"]);
    ends(dir, 3, "triangles have none", &with(&["transfer", "sphere", "--atlas", "4x4"]));
    ends(dir, 2, "1 to 15", &with(&["transfer", "sphere", "--bands", "99"]));
    ends(dir, 2, "--albedo", &with(&["transfer", "sphere", "--bounces", "2"]));
    ends(dir, 2, "--help", &["transfer", "sphere"]);
    assert!(!dir.join("x.safetensors").exists());
}

/// A picture with shadows is darker than one without, where the mesh blocks light; points read the mesh too.
#[test]
fn techniques_with_sites_bake_on_the_scenes_mesh() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let mean = |technique: &str| -> f64 {
        let arguments = [
            "render",
            "torus:segments=32",
            "-e",
            "furnace",
            "-b",
            "lambert:albedo=0.5",
            "--technique",
            technique,
        ];
        let size = ["--size", "48x48", "--background", "none", "-o", "x.pfm", "--json"];
        well(dir, &[&arguments[..], &size].concat());
        let bytes = fs::read(dir.join("x.pfm")).expect("a picture");
        let floats = bytes[bytes.len() - 48 * 48 * 12..].as_chunks::<4>().0;
        floats.iter().map(|b| f64::from(f32::from_le_bytes(*b))).sum::<f64>() / floats.len() as f64
    };
    let (open, shadowed, occluded) = (mean("sh_irradiance"), mean("prt_diffuse"), mean("ambient"));
    assert!(shadowed < 0.995 * open && shadowed > 0.7 * open, "{open} {shadowed}");
    // Under a constant light both hold the same.
    assert!((shadowed - occluded).abs() < 0.01 * open, "{shadowed} {occluded}");
    fs::write(dir.join("p.csv"), "px,py,pz,nx,ny,nz,vx,vy,vz\n0,2,0,0,1,0,0,1,0\n").expect("written");
    let eval =
        ["eval", "-e", "furnace", "-b", "lambert:albedo=0.5", "-p", "p.csv", "--technique", "prt_diffuse"];
    let out = well(dir, &[&eval[..], &["--mesh", "sphere"]].concat());
    let r: f64 =
        out.lines().nth(1).and_then(|l| l.split(',').nth(9)).and_then(|x| x.parse().ok()).expect("radiance");
    assert!((r - 0.5).abs() < 1e-4, "{out}");
}

/// Transfer to other normals than the mesh's is baked where a normal map needs it, and nowhere else.
#[test]
fn a_normal_map_asks_for_transfer_to_its_normals() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    // Slopes of a quarter, encoded as colours.
    let slopes =
        |k: usize| [0.5 + 0.125 * (k as f32 * 0.7).sin(), 0.5 + 0.125 * (k as f32 * 1.9).cos(), 0.98];
    let texels = (0..256).flat_map(slopes).flat_map(f32::to_le_bytes);
    fs::write(dir.join("n.pfm"), [&b"PF\n16 16\n-1\n"[..], &texels.collect::<Vec<_>>()].concat())
        .expect("written");
    let picture = |more: &[&'static str]| {
        let torus = ["render", TORUS, "-e", "overcast", "-b", "lambert:albedo=0.5"];
        let size = ["-t", "prt-diffuse", "--size", "32x32", "--background", "none", "-o", "x.pfm"];
        let coarse = ["--param", "bands=3", "--param", "precision=0.1"];
        well(dir, &[&torus[..], &size, &coarse, more].concat());
        fs::read(dir.join("x.pfm")).expect("a picture")
    };
    let (map, on, off) = (["--normal-map", "n.pfm"], ["--param", "normals=on"], ["--param", "normals=off"]);
    let bumps = picture(&map);
    assert_eq!(bumps, picture(&[map, on].concat()));
    assert_ne!(bumps, picture(&[map, off].concat()));
    assert_eq!(picture(&[]), picture(&off));
}

/// Matrices go to the file as they are made: a limit that they exceed changes nothing of it.
#[test]
fn matrices_beyond_the_memory_are_the_same() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let made = |more: &[&'static str]| {
        let line = ["transfer", "torus:segments=12", "--rays", "64", "--bands", "8", "--matrices"];
        well(dir, &[&line[..], &["-o", "m.safetensors"], more].concat());
        read_tensors(&dir.join("m.safetensors"), &Limits::default()).expect("tensors").tensors
    };
    for bits in ["32", "16", "8"] {
        let whole = made(&["--bits", bits]);
        let bytes = whole["m"].data.bytes();
        assert!(bytes > 350_000, "{bytes} bytes");
        assert!(made(&["--bits", bits, "--max-memory", "512K"]) == whole);
    }
    assert!(!dir.join("m.safetensors.part").exists());
}

#[test]
fn engines_get_vertices_with_transfer_and_its_shader() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let ring = ["transfer", "torus:segments=12", "--rays", "64"];
    let with = |more: &[&'static str]| -> Vec<&'static str> { ring.iter().chain(more).copied().collect() };
    well(dir, &with(&["--bits", "8", "-o", "t.glb", "--wgsl", "t.wgsl"]));
    let (bytes, text) = (fs::read(dir.join("t.glb")).expect("read"), fs::read_to_string(dir.join("t.wgsl")));
    assert!(bytes.starts_with(b"glTF") && text.expect("read").contains("fn transfer_radiance("));
    assert!(well(dir, &["inspect", "t.glb"]).contains("a vector a vertex: 5 bands of 8 bits, direct light"));
    // The same mesh again, for a picture.
    well(
        dir,
        &[
            "render",
            "t.glb",
            "-b",
            "lambert:albedo=0.5",
            "-t",
            "diffuse-map",
            "--size",
            "16x16",
            "-o",
            "x.png",
        ],
    );
    well(dir, &with(&["--bits", "16", "-o", "h.safetensors"]));
    well(dir, &with(&["-o", "f.safetensors"]));
    let size = |name: &str| fs::metadata(dir.join(name)).expect("there").len() as f64;
    assert!(size("h.safetensors") < 0.6 * size("f.safetensors"));
    assert!(well(dir, &["inspect", "h.safetensors"]).contains("5 bands"));
    // Bytes with scales: each value within half a step of that of its coefficient.
    well(dir, &with(&["--bits", "8", "--matrices", "-o", "b.safetensors"]));
    well(dir, &with(&["--matrices", "-o", "m.safetensors"]));
    let read = |name: &str| read_tensors(&dir.join(name), &Limits::default()).expect("tensors");
    let (bytes, floats) = (read("b.safetensors"), read("m.safetensors"));
    let (saved, whole) = (Saved::read(&bytes).expect("transfer"), Saved::read(&floats).expect("transfer"));
    let steps = bytes.tensors["t.scale"].data.to_f32();
    assert_eq!(steps.len(), 25);
    for (k, (a, b)) in saved.transfer.t.iter().zip(&whole.transfer.t).enumerate() {
        assert!((a - b).abs() <= 0.5001 * steps[k % 25], "{k}: {a} {b}");
    }
    let (a, b) = (bytes.tensors["m"].data.to_f32(), floats.tensors["m"].data.to_f32());
    assert!(a.iter().zip(b.iter()).all(|(a, b)| (a / 127.0 - b).abs() < 0.501 / 127.0));
    assert!(size("b.safetensors") < 0.27 * size("m.safetensors"));
    let line = [
        "render",
        "torus:segments=12",
        "-b",
        "lambert",
        "-t",
        "prt-diffuse",
        "--size",
        "16x16",
        "-o",
        "x.png",
    ];
    well(dir, &[&line[..], &["--transfer", "b.safetensors"]].concat());
    // Without its scale a tensor of bytes is none.
    let mut damaged = bytes;
    damaged.tensors.remove("t.scale");
    assert!(Saved::read(&damaged).is_err_and(|e| e.to_string().contains("t.scale")));
    ends(dir, 2, "vectors of its vertices", &with(&["--matrices", "-o", "x.glb"]));
}

/// A plate of two triangles under a ball: radiance between its vertices is near that of paths.
#[test]
fn coarse_ground_has_its_contact_shadow() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let plate = "v -2 -1 -2\nv 2 -1 -2\nv 2 -1 2\nv -2 -1 2\nvn 0 1 0\n";
    fs::write(dir.join("plate.obj"), format!("{plate}f 1//1 3//1 2//1\nf 1//1 4//1 3//1\n"))
        .expect("written");
    let scene = "[camera]\nfrom = [0, 2, 4]\nfov = 40\n[[mesh]]\nfile = \"plate.obj\"\nmaterial = \"m\"\n\
                 [[mesh]]\nshape = \"icosphere\"\nmaterial = \"m\"\n[material.m]\nbrdf = \"lambert:albedo=0.5\"\n\
                 [light]\nenvironment = \"overcast\"\n";
    fs::write(dir.join("s.toml"), scene).expect("written");
    let line =
        ["compare", "s.toml", "--path", "--bounces", "1", "--noise", "0.03", "--size", "24x18", "--json"];
    // Rays of the usual precision take as long as all else.
    let coarse = ["--param", "precision=0.05"];
    // Wavelets divide the plate finer, which takes three times as long; together both would take that mesh.
    let techniques = ["prt-diffuse", "haar-transport"];
    for technique in techniques.into_iter().take(if steradian_testkit::full() { 2 } else { 1 }) {
        let line = [&line[..], &coarse, &["-t", technique]].concat();
        let out: serde_json::Value = serde_json::from_str(&well(dir, &line)).expect("JSON");
        let error = out["comparisons"][0]["techniques"][1]["relative_rms"].as_f64().expect("a number");
        assert!(error < 0.04, "{technique}: {error}");
    }
}

/// At points too; a comparison takes that of vertices.
#[test]
fn points_and_comparisons_take_transfer_of_a_file() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let rows = "px,py,pz,nx,ny,nz,vx,vy,vz\n0.9,0.24,0,0.6,0.8,0,0,1,0\n0.45,0.1,0,-1,0.1,0,-1,1,1\n";
    fs::write(dir.join("p.csv"), rows).expect("written");
    fs::write(dir.join("q.csv"), rows.replace("0.45", "0.44")).expect("written");
    let transfer = ["transfer", TORUS, "--tolerance", "0.1", "--bands", "4", "--quiet"];
    well(dir, &[&transfer[..], &["-p", "p.csv", "-o", "p.safetensors"]].concat());
    well(dir, &[&transfer[..], &["-o", "t.safetensors"]].concat());
    let eval = |technique: &'static str, points: &'static str, file: &'static [&'static str]| {
        let fixed =
            ["eval", "-e", "overcast", "-b", "lambert", "--mesh", TORUS, "-t", technique, "-p", points];
        let params = ["--param", "bands=4", "--param", "precision=0.02"];
        [&fixed[..], &params, file].concat()
    };
    let own = well(dir, &eval("prt_diffuse", "p.csv", &[]));
    assert_eq!(own, well(dir, &eval("prt_diffuse", "p.csv", &["--transfer", "p.safetensors"])));
    let file = &["--transfer", "p.safetensors"];
    fails(dir, 3, "holds transfer of points", &eval("prt_diffuse", "q.csv", file));
    fails(
        dir,
        3,
        "holds transfer of vertices",
        &eval("prt_diffuse", "p.csv", &["--transfer", "t.safetensors"]),
    );
    fails(dir, 2, "takes no transfer of a file", &eval("haar_transport", "p.csv", file));
    let compare = |more: &[&'static str]| {
        let line = ["compare", TORUS, "-e", "overcast", "-b", "lambert", "--size", "24x24", "--json"];
        [&line[..], &["--transfer", "t.safetensors"], more].concat()
    };
    let text = well(dir, &compare(&["-t", "prt_diffuse", "--param", "bands=4", "-t", "sh_irradiance"]));
    let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let rows = found["comparisons"][0]["techniques"].as_array().expect("rows");
    assert!(rows.iter().all(|r| r["relative_rms"].is_number() || r["technique"] == "reference"), "{text}");
    fails(dir, 2, "--transfer: belongs to a mesh", &compare(&["-t", "sh_irradiance"]));
}

/// Transfer that a file holds is shaded, to the bit as rays of the same tolerance are, and what is not of
/// this mesh, or less than a technique needs, is refused.
#[test]
fn transfer_of_a_file_takes_the_place_of_rays() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let transfer = ["transfer", TORUS, "--tolerance", "0.1", "--bands", "4", "--quiet"];
    well(dir, &[&transfer[..], &["-o", "t.safetensors"]].concat());
    well(dir, &[&transfer[..], &["--matrices", "-o", "m.safetensors"]].concat());
    let render = |technique: &str, more: &[&str]| {
        let fixed =
            ["render", TORUS, "-e", "overcast", "-b", "lambert", "--size", "24", "--quiet", "-t", technique];
        let params = ["--param", "bands=4", "--param", "precision=0.1", "-o", "x.pfm"];
        well(dir, &[&fixed[..], &params, more].concat());
        fs::read(dir.join("x.pfm")).expect("a picture")
    };
    for (technique, file) in [("prt_diffuse", "t.safetensors"), ("prt_glossy", "m.safetensors")] {
        assert!(render(technique, &[]) == render(technique, &["--transfer", file]), "{technique}");
    }
    // Matrices take other rays than vectors alone.
    render("prt_diffuse", &["--transfer", "m.safetensors"]);
    let bake =
        ["bake", "overcast", "-b", "lambert", "-t", "prt_diffuse", "--param", "bands=3", "--mesh", TORUS];
    well(dir, &[&bake[..], &["--transfer", "t.safetensors", "-o", "b.safetensors"]].concat());
    well(dir, &["render", TORUS, "--bake", "b.safetensors", "--size", "24", "-o", "b.pfm"]);
    let made = |mesh: &'static str, technique: &'static str, bands: &'static str| {
        let made = [
            "render",
            mesh,
            "-e",
            "overcast",
            "-b",
            "lambert",
            "-o",
            "no.png",
            "--transfer",
            "t.safetensors",
        ];
        [&made[..], &["-t", technique, "--param", bands]].concat()
    };
    fails(dir, 3, "transfer of another mesh: its digest is", &made("knot", "prt_diffuse", "bands=4"));
    fails(dir, 3, "transfer of 4 bands, where 5 are asked for", &made(TORUS, "prt_diffuse", "bands=5"));
    fails(dir, 3, "4 bands of visibility, of 7 that are needed", &made(TORUS, "prt_glossy", "bands=4"));
    fails(
        dir,
        3,
        "has 1 scattering events",
        &[&made(TORUS, "prt_diffuse", "bands=4")[..], &["--param", "bounces=2"]].concat(),
    );
    let bare = ["render", TORUS, "-t", "prt_diffuse", "-o", "no.png", "--transfer", "b.safetensors"];
    fails(dir, 3, "b.safetensors: holds no transfer", &bare);
    // Techniques that take none say which do.
    let none = "takes no transfer of a file with these parameters: leave it out, or choose";
    fails(dir, 2, none, &made(TORUS, "sh_brdf", "bands=4"));
    fails(dir, 2, none, &made(TORUS, "haar_transport", "bands=4"));
    assert!(!dir.join("no.png").exists());
}
