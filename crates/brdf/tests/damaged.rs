//! Files of measured materials and of fits with faults from a fixed seed: refused in one line that names the
//! file, or read as a reflectance whose values are finite.

use glam::DVec3;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use steradian_brdf::{Files, SpecError, parse_with};
use steradian_formats::{Tensor, TensorFile};
use steradian_testkit::{Mutator, full};

/// A folder that goes with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("steradian-damaged-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("writable");
        Self(path)
    }

    /// The path of a list of two names.
    fn names(&self) -> String {
        let path = self.0.join("names.txt");
        std::fs::write(&path, "one\ntwo\n").expect("writable");
        path.display().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn floats(n: usize, value: impl Fn(usize) -> f32) -> Vec<u8> {
    (0..n).flat_map(|i| value(i).to_le_bytes()).collect()
}

/// Damages the file `whole` and reads it by `model`:path`rest`, `rounds` times. Some copies have to be read
/// and some refused.
fn damaged(whole: &[u8], path: &Path, model: &str, rest: &str, rounds: usize) {
    let spec = format!("{model}:{}{rest}", path.display());
    std::fs::write(path, whole).expect("writable");
    parse_with(&spec, Files::Any).expect("the whole file is valid");
    let mut damage = Mutator::new(7);
    let rounds = if full() { 50 * rounds } else { rounds };
    let read = (0..rounds).filter(|_| {
        std::fs::write(path, damage.damage(whole, b"-1e39,nan,0")).expect("writable");
        ends_well(&spec, path)
    });
    let read = read.count();
    assert!((1..rounds).contains(&read), "{read} of {rounds} read");
}

fn ends_well(spec: &str, path: &Path) -> bool {
    let brdf = match parse_with(spec, Files::Any) {
        Ok(brdf) => brdf,
        Err(e) => {
            let text = e.to_string();
            assert!(!text.contains('\n') && text.contains(&*path.display().to_string()), "{text}");
            assert!(!matches!(e, SpecError::Syntax { .. }), "the spec is not at fault: {text}");
            return false;
        }
    };
    for (i, o) in [(0.1, 0.2), (0.7, -0.7), (1.5, 1.2), (0.3, -1.56)] {
        let at = |t: f64| DVec3::new(t.sin(), 0.0, t.cos());
        let f = brdf.eval(at(i), at(o));
        assert!(f.iter().all(|v| v.is_finite()), "{spec}: {f:?}");
    }
    true
}

#[test]
fn networks() {
    let folder = Folder::new("networks");
    // Two materials; weights of both signs, small as trained ones are.
    let whole = floats(2 * 675, |i| (i as f32 * 0.7).sin() * 0.3);
    let rest = format!(",two,names={}", folder.names());
    damaged(&whole, &folder.0.join("networks.bin"), "nbrdf", &rest, 3000);
}

#[test]
fn tabulated_factors() {
    let folder = Folder::new("factors");
    let whole = floats(3 * 256 * 512, |i| 1.0 / (1.0 + (i % 1536) as f32));
    let rest = format!(",two,names={}", folder.names());
    damaged(&whole, &folder.0.join("npf.bin"), "npf", &rest, 1000);
}

#[test]
fn fits_of_lobes() {
    let folder = Folder::new("lobes");
    let numbers =
        (0..15 * 3).flat_map(|i| [0.01 * (i % 3) as f32, 0.1 + 0.1 * (i % 3) as f32, 0.2, 0.1, 0.1]);
    let tensors = BTreeMap::from([
        ("lobes".to_owned(), Tensor::f32([15, 3, 5], numbers.collect())),
        ("diffuse".to_owned(), Tensor::f32([3], vec![0.1, 0.2, 0.3])),
    ]);
    let mut whole = Vec::new();
    TensorFile { tensors, metadata: BTreeMap::new() }.encode(&mut whole).expect("into memory");
    damaged(&whole, &folder.0.join("fit.safetensors"), "lobes", "", 5000);
}

/// A file of the RGL database: three elevations of the view, smooth numbers.
fn bsdf() -> Vec<u8> {
    let fields: [(&str, &[u64]); 8] = [
        ("phi_i", &[1]),
        ("theta_i", &[3]),
        ("sigma", &[4, 8]),
        ("ndf", &[4, 8]),
        ("vndf", &[1, 3, 4, 4]),
        ("luminance", &[1, 3, 4, 4]),
        ("rgb", &[1, 3, 3, 4, 4]),
        ("jacobian", &[1]),
    ];
    let head: usize = fields.iter().map(|(name, shape)| 2 + name.len() + 2 + 1 + 8 + 8 * shape.len()).sum();
    let mut out = [&b"tensor_file\0"[..], &[1, 0], &(fields.len() as u32).to_le_bytes()].concat();
    let mut at = (out.len() + head) as u64;
    let mut data = Vec::new();
    for (name, shape) in fields {
        out.extend((name.len() as u16).to_le_bytes());
        out.extend(name.as_bytes());
        out.extend((shape.len() as u16).to_le_bytes());
        // 32-bit floats.
        out.push(10);
        out.extend(at.to_le_bytes());
        shape.iter().for_each(|d| out.extend(d.to_le_bytes()));
        let n = shape.iter().product::<u64>() as usize;
        let values = floats(n, |i| match name {
            "phi_i" => 0.0,
            "theta_i" => 0.7 * i as f32,
            "jacobian" => 1.0,
            _ => 0.6 + 0.3 * (i as f32 * 0.9).sin(),
        });
        at += values.len() as u64;
        data.extend(values);
    }
    out.extend(data);
    out
}

#[test]
fn measurements_of_the_rgl_database() {
    let folder = Folder::new("rgl");
    damaged(&bsdf(), &folder.0.join("small.bsdf"), "rgl", "", 3000);
}

/// Rows of angles and values that make a small isotropic material.
fn rows(separator: &str, values: &str) -> String {
    let row = |i: usize| {
        let (a, b) = (0.2 * (i % 6) as f64, 0.25 * (i / 6) as f64);
        format!("{a:.3}{separator}0{separator}{b:.3}{separator}{:.2}{separator}{values}\n", 0.5 * i as f64)
    };
    (0..30).map(row).collect()
}

#[test]
fn spectra_of_cornell() {
    let folder = Folder::new("cornell");
    let whole = format!("# three\n3\n450 550 650\n{}", rows(" ", "0.1 0.2 0.3"));
    damaged(whole.as_bytes(), &folder.0.join("a.brdf"), "cornell", "", 150);
}

#[test]
fn tables_of_astm() {
    let folder = Folder::new("astm");
    let rows = rows(",", "0.1,0.2,0.3");
    let whole = format!("ID a\nNUM_POINTS 30\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\n{rows}");
    damaged(whole.as_bytes(), &folder.0.join("a.astm"), "astm", "", 150);
}

#[test]
fn texts_of_alta() {
    let folder = Folder::new("alta");
    let rows = rows(" ", "0.3");
    let whole = format!("#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN\n{rows}");
    damaged(whole.as_bytes(), &folder.0.join("a.alta"), "alta", "", 150);
}

#[test]
fn scattered_measurements() {
    let folder = Folder::new("csv");
    let whole = format!("theta_i,phi_i,theta_o,phi_o,r,g,b\n{}", rows(",", "0.1,0.2,0.3"));
    damaged(whole.as_bytes(), &folder.0.join("a.csv"), "csv", "", 150);
}

#[test]
fn sums_of_brdflab() {
    let folder = Folder::new("brdflab");
    let lobe = |model: &str, p: &str| {
        let scale = "<ScalingFactors channel0=\"0.1\" channel1=\"0.2\" channel2=\"0.3\"/>";
        format!("{scale}<Lobe><Model>{model}</Model><Parameters {p}/></Lobe>")
    };
    let lobes = [
        lobe("Lambertian", ""),
        lobe("Ward", "ax=\"0.2\""),
        lobe("LafortuneIso", "Cxy=\"-0.6\" Cz=\"0.5\" Exponent=\"14\""),
        lobe("CookTorrance", "m=\"0.3\" F0=\"0.5\""),
    ];
    let head = "<!DOCTYPE BRDF><BRDF><Material><Name>A</Name><Type>Analytic</Type><Parameters>";
    let whole = format!("{head}{}</Parameters></Material></BRDF>", lobes.concat());
    damaged(whole.as_bytes(), &folder.0.join("a.xml"), "brdflab", "", 1500);
}

#[test]
fn anisotropic_tables_of_merl() {
    let folder = Folder::new("aniso");
    let mut head = [0i32; 16];
    head[..4].copy_from_slice(&[3, 3, 6, 4]);
    head[10] = 3;
    let mut whole: Vec<u8> = head.iter().flat_map(|v| v.to_le_bytes()).collect();
    whole.extend(floats(3 * 216, |i| 0.6 + 0.3 * (i as f32 * 0.9).sin()));
    damaged(&whole, &folder.0.join("a.binary"), "merl-aniso", "", 1000);
}

#[test]
fn tables_of_utia() {
    let folder = Folder::new("utia");
    let whole: Vec<u8> = (0..3 * 288 * 288).flat_map(|i| (0.1 + (i % 7) as f64).to_le_bytes()).collect();
    damaged(&whole, &folder.0.join("a.bin"), "utia", "", 100);
}

#[test]
fn tables_and_directions_of_curet() {
    let folder = Folder::new("curet");
    let (table, angles) = (folder.0.join("abrdf.dat"), folder.0.join("angles.dat"));
    let row = |i: usize| {
        format!("{} {:.3} 0.5 {:.3} {:.2}\n", i + 1, 0.2 * (i % 7) as f64, 0.13 * (i / 7) as f64, i)
    };
    let directions: String = (0..70).map(row).collect();
    let values: String = (0..70).map(|i| format!(" 0.{}", 1 + i % 9)).collect();
    let values = format!("# two samples\n7{values}\n12{values}\n");
    std::fs::write(&angles, &directions).expect("writable");
    damaged(values.as_bytes(), &table, "curet", ",sample=12", 1500);
    // The table is whole, and the file of directions damaged.
    std::fs::write(&table, &values).expect("writable");
    let (spec, mut damage) = (format!("curet:{},sample=12", table.display()), Mutator::new(8));
    let rounds = if full() { 75_000 } else { 1500 };
    let read = (0..rounds).filter(|_| {
        std::fs::write(&angles, damage.damage(directions.as_bytes(), b"-1e39,nan,0")).expect("writable");
        ends_well(&spec, &angles)
    });
    let read = read.count();
    assert!((1..rounds).contains(&read), "{read} of {rounds} read");
}
