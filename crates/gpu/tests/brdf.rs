//! Every model's WGSL text, and that of measurements, against its Rust twin, over grids with edge cases.
//!
//! Without an adapter the tests show as ignored; `STERADIAN_REQUIRE_GPU=1` (CI sets it) makes that a failure.

mod common;

use common::{gpu, tabulated};
use glam::{DVec3, Vec3};
use libtest_mimic::{Arguments, Failed, Trial};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::Task;
use steradian_brdf::fit::gaussian::{GaussianFit, Plan, Shape};
use steradian_brdf::model::lobes::Lobes;
use steradian_brdf::{BrdfShader, Files, SharedBrdf, parse_with};
use steradian_gpu::ComputeTechnique;
use steradian_techniques::gpu::{Entry, cells};
use steradian_techniques::{GpuTechnique, PointsBuf};
use steradian_testkit::data;

/// Largest |GPU − CPU| over |CPU|, where the CPU's value is above `floor` of the largest.
const BOUND: f64 = 1e-3;

/// Is it so near the horizon that singles hold no digits: there the lit parts of cylinders are differences of
/// angles (.7 degrees, since the sines of an H100 are off by 5e-7), and G₁ of some fits passes through 0 (a
/// tenth of a degree)?
fn grazing(spec: &str, (wi, wo): (Vec3, Vec3)) -> bool {
    let least = match spec.split(':').next() {
        Some("poulin-fournier") => 0.012,
        Some("sgd") => 2e-3,
        _ => return false,
    };
    [wi.z, wo.z].iter().any(|z| (0.0..least).contains(z))
}

/// Below this part of the largest value, differences are relative to it. Lit parts of cylinders are
/// differences of tabulated integrals, and networks amplify the 6e-8 by which single-precision directions
/// deviate from length 1. CUReT's modes cancel where their sum is clamped at 0; near a node at 0 an
/// interpolated value is as exact as the distance from it.
fn floor(spec: &str) -> f64 {
    match spec.split(':').next() {
        Some("poulin-fournier" | "nbrdf" | "curet") => 1e-2,
        Some("rgl") => 1e-4,
        _ => 1e-6,
    }
}

const SPECS: &[&str] = &[
    "lambert:albedo=0.8/0.5/0.2",
    "oren-nayar:sigma=0.5",
    "oren-nayar:sigma=0.5,albedo=0.5/0.4/0.3,variant=full",
    "oren-nayar:sigma=0.5,variant=fujii",
    "oren-nayar:sigma=1.57,variant=full",
    "minnaert:k=1.7",
    "minnaert:k=0",
    "phong:n=30",
    "phong:n=1000000",
    "phong-map:n=30",
    "phong-map:n=100000000",
    "phong-normalized:s=30",
    "blinn-phong:n=60",
    "blinn-phong:n=1000000",
    "blinn-phong-gl:kd=0.3,ks=0.5,n=40",
    "microfacet:sigma=0.2",
    "microfacet:sigma=0.001",
    "cook-torrance:m=0.2,f0=0.9/0.7/0.3",
    "cook-torrance:m=0.4,g=smith",
    "cook-torrance:m=0.001",
    "cook-torrance:m=0.001,g=smith",
    "ggx:alpha=0.05",
    "ggx:alpha=0.0001",
    "ggx:alpha=0.5,f0=0.04",
    "ggx:ax=0.05,ay=0.4",
    "ggx:ax=0.0001,ay=10",
    "ggx:alpha=0.3,scale=0.5/0.25/2",
    "dielectric:alpha=0.05",
    "dielectric:alpha=0.4,f0=0.9/0.5/0.04,albedo=0.1/0.5/0.9",
    "charlie:alpha=0.25,color=0.9/0.5/0.2",
    "charlie:alpha=1",
    "ward:ax=0.2,ay=0.2,rd=0.2,rs=0.5",
    "ward:ax=0.05,ay=0.3",
    "ward:alpha=0.2,variant=1992",
    "ward:ax=0.1,ay=0.2,variant=duer",
    "ward:ax=0.001,ay=0.001",
    "ashikhmin-shirley:nu=100,nv=100,rs=0.1,rd=0.5",
    "ashikhmin-shirley:nu=10,nv=1000",
    "ashikhmin-shirley:nu=1e6,nv=0",
    "lafortune:cx=-0.9,cy=-0.6,cz=0.8,n=12,kd=0.2",
    "lafortune:cx=-1,cy=-1,cz=1,n=1e4",
    "lafortune:@skin",
    "lafortune:@krylon-blue",
    "lafortune:@clay",
    "lafortune:@felt",
    "banks:n=40",
    "banks-map:n=40",
    "banks:n=1e6",
    "kajiya-kay:s=32",
    "kajiya-kay:s=1e6",
    "poulin-fournier:d=2,n=30",
    "poulin-fournier:d=3,h=0.4,kd=0.5,ks=0.3,n=30",
    "poulin-fournier:d=2.5,h=0.2,kd=0.1,n=3000",
    "poulin-fournier:d=2,n=1.5",
    "sgd:gold-metallic-paint",
    "sgd:blue-acrylic",
    "sgd:chrome",
    "abc:gold-metallic-paint",
    "abc:blue-acrylic",
    "abc:chrome",
];

/// Files of the data folder.
const MEASURED: &[&str] = &[
    "npf:merl_reduced/npf.bin,chrome",
    "npf:merl_reduced/npf.bin,white-fabric",
    "nbrdf:merl_reduced/merl_nbrdf_f32le.bin,chrome",
    "nbrdf:merl_reduced/merl_nbrdf_f32le.bin,pink-felt",
    "nbrdf:merl_reduced/rgl-isotropic_nbrdf_f32le.bin,paper_white_rgb",
    "rgl:rgl/cc_ibiza_sunset_rgb.bsdf",
    "rgl:rgl/cc_iris_purple_gem_rgb.bsdf",
    "rgl:rgl/cg_sunflower_rgb.bsdf",
    "rgl:rgl/colodur_napoli_4f_rgb.bsdf",
    "rgl:rgl/paper_white_rgb.bsdf",
    "rgl:rgl/vch_golden_yellow_rgb.bsdf",
    "brdflab:analytic_fits/brdflab_xml/MERL-aluminium.xml,Ngan-CookTorrance",
    "brdflab:analytic_fits/brdflab_xml/MERL-orange-paint.xml,Ngan-Ward",
    "brdflab:analytic_fits/brdflab_xml/Cornell-Skin-mahesh-Indian.xml",
];

/// The reflectance of a file of the data folder; `None` without the folder.
fn measured(spec: &str) -> Option<SharedBrdf> {
    let (reader, rest) = spec.split_once(':')?;
    let (file, rest) = rest.split_once(',').map_or((rest, String::new()), |(f, r)| (f, format!(",{r}")));
    let path = data(&format!("brdfs/{file}"))?;
    Some(parse_with(&format!("{reader}:{}{rest}", path.display()), Files::Any).expect("valid"))
}

/// Tables in the coordinates of the readers: their spec, and the kept contents of their file.
const GRIDS: &[(&str, &[f64])] = &[
    ("csv:half.csv", &[0.0, 20.0, 1.0, 15.0, 12.0]),
    ("csv:anisotropic.csv", &[0.0, 9.0, 8.0, 7.0, 6.0]),
    ("merl-aniso:a.binary", &[1.0, 6.0, 7.0, 12.0, 5.0]),
    ("utia:a.bin", &[76.0, 6.0, 48.0, 6.0, 48.0]),
    // A single cell.
    ("csv:one.csv", &[0.0, 1.0, 1.0, 1.0, 1.0]),
];

/// Numbers that rise and fall between neighbours, 0.1 to 1.
fn table(spec: &str, head: &[f64]) -> SharedBrdf {
    let mut numbers = vec![0.0; 3];
    numbers.extend(head);
    let cells = head[1..].iter().product::<f64>() as usize;
    let value = |i: usize| 0.55 + 0.45 * (i as f64 * 2.399).sin();
    numbers.extend((0..3 * cells).map(|i| f64::from(value(i) as f32)));
    parse_with(spec, Files::Held(&numbers)).expect("held")
}

/// CUReT's modes and a residual, as kept of a file: even ones that pass through 0 and are cut there.
fn modes() -> SharedBrdf {
    let mut numbers: Vec<f64> =
        (0..3 * 55).map(|i| 0.3 * (f64::from(i) * 2.399).sin() / f64::from(1 + i % 55)).collect();
    (0..3).for_each(|c| numbers[55 * c] = 1.0 + 0.2 * c as f64);
    numbers.push(0.01);
    parse_with("curet:a.dat,sample=1", Files::Held(&numbers)).expect("held")
}

/// An anisotropic file of the RGL database, smooth, whose azimuths span a half or a quarter of the circle, as
/// kept of it.
fn anisotropic(spec: &str) -> SharedBrdf {
    let span = if spec.contains("half") { 1.0 } else { 0.5 };
    let phis = [0.0, 0.3, 1.0].map(|t| PI * (t * span - 1.0));
    let wave = |n: usize, from: f64, rate: f64| -> Vec<f64> {
        (0..n).map(|i| from + 0.4 * (i as f64 * rate).sin()).map(|v| f64::from(v as f32)).collect()
    };
    let arrays: [(&[usize], Vec<f64>); 8] = [
        (&[3], phis.map(|v| f64::from(v as f32)).to_vec()),
        (&[4], vec![0.0, 0.4, 1.0, 1.5]),
        (&[5, 6], wave(30, 0.7, 0.3)),
        (&[7, 5], wave(35, 0.9, 0.4)),
        (&[3, 4, 6, 5], wave(360, 1.0, 0.7)),
        (&[3, 4, 4, 4], wave(192, 1.0, 0.6)),
        (&[3, 4, 3, 4, 5], wave(720, 0.6, 0.9)),
        (&[1], vec![1.0]),
    ];
    let mut numbers = Vec::new();
    for (shape, values) in arrays {
        numbers.push(shape.len() as f64);
        numbers.extend(shape.iter().map(|d| *d as f64));
        numbers.extend(values);
    }
    parse_with("rgl:a.bsdf", Files::Held(&numbers)).expect("held")
}

fn direction(theta: f64, phi: f64) -> Vec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()).as_vec3()
}

/// Pairs of wi and wo: at the pole, at grazing, behind; on the mirror direction, near it at all scales, far
/// from it.
fn pairs() -> Vec<(Vec3, Vec3)> {
    let mut out = Vec::new();
    for theta in [0.0, 0.01, 0.3, 0.9, 1.3, 1.5, 1.56, 1.57, 1.6] {
        for phi in [0.0, 0.7, 1.571, 3.9] {
            let wo = direction(theta, phi);
            let r = Vec3::new(-wo.x, -wo.y, wo.z);
            for step in [0.0f32, 1e-4, 1e-3, 0.01, 0.1, 0.5] {
                for (a, b) in [(1.0, 0.0), (-0.6, 0.8), (0.0, -1.0)] {
                    let across = Vec3::new(a, b, 0.3 * a) * step;
                    out.push(((r + across).normalize(), wo));
                }
            }
            for t in [0.0, 0.4, 1.1, 1.5, 1.569, 1.58, 2.5] {
                for p in [0.0, 1.0, 2.2, 3.2, 5.0] {
                    out.push((direction(t, p), wo));
                }
            }
            out.push((-wo, wo));
        }
    }
    out
}

/// A reflectance's fit by Gaussian lobes; of an anisotropic one a coarse one.
fn fitted(spec: &str) -> SharedBrdf {
    let shape = if spec == "sgd:chrome" { Shape::Round } else { Shape::Stretched };
    let formula = steradian_brdf::parse(spec).expect("a spec");
    let plan = match formula.is_isotropic() {
        true => Plan { shape, ..Plan::default() },
        false => Plan { lobes: 2, views: 4, azimuths: 6, ..Plan::default() },
    };
    let fit = GaussianFit::new(&*formula, plan, &Task::quiet()).expect("not cancelled");
    Arc::new(Lobes::new("lobes:fit".into(), fit))
}

/// A technique that evaluates the text at wi = t, wo = wo.
fn technique(shader: &BrdfShader) -> GpuTechnique {
    let numbers = shader.cells();
    let cell = match numbers {
        Some(_) => "fn brdf_cell(i: u32) -> vec3<f32> {\n    return fetch_cells(i).rgb;\n}\n",
        None => "",
    };
    let wgsl = format!(
        "{}{cell}\
         fn shade(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {{\n    \
         return brdf_value(t, wo);\n}}\n",
        shader.closed()
    );
    GpuTechnique {
        slug: "brdf",
        modules: vec![wgsl.into()],
        entry: Entry::PLAIN,
        tables: numbers.map(|n| cells("cells", n)).into_iter().collect(),
        uniforms: Vec::new(),
        buffers: Vec::new(),
    }
}

fn compare(spec: &str, brdf: &SharedBrdf) -> Result<(), Failed> {
    let gpu = gpu()?;
    let shader = brdf.shader().ok_or("no WGSL text")?;
    let pairs = pairs();
    let mut points = PointsBuf::default();
    pairs.iter().for_each(|(wi, wo)| points.push(Vec3::Z, *wi, *wo, Vec3::ZERO));
    let twin = ComputeTechnique::new(gpu, &technique(&shader))?.shade(gpu, &points)?;
    let own: Vec<[f64; 3]> = pairs.iter().map(|(wi, wo)| brdf.f_cos(wi.as_dvec3(), wo.as_dvec3())).collect();
    let top = own.iter().flatten().fold(0.0f64, |a, x| a.max(*x));
    if !(top > 0.0 && top.is_finite()) {
        return Err(format!("the CPU's values end at {top}: nothing was compared").into());
    }
    let mut worst = (0.0, String::new());
    for (i, f) in own.iter().enumerate() {
        if grazing(spec, pairs[i]) {
            continue;
        }
        for c in 0..3 {
            let got = f64::from(twin[c][i]);
            let off = (got - f[c]).abs() / f[c].abs().max(floor(spec) * top);
            if off > worst.0 || off.is_nan() {
                let (wi, wo) = pairs[i];
                worst = (off, format!("wi {wi}, wo {wo}, channel {c}: CPU {:e}, GPU {got:e}", f[c]));
            }
        }
    }
    if worst.0 <= BOUND { Ok(()) } else { Err(format!("{:.1e} apart: {}", worst.0, worst.1).into()) }
}

/// Every model has a text, and every text is among the specs.
fn every_model_has_a_text() -> Result<(), Failed> {
    for info in steradian_brdf::models() {
        let tested = SPECS.iter().any(|s| s.split(':').next() == Some(info.name));
        if !tested {
            return Err(format!("{} is not tested", info.name).into());
        }
    }
    Ok(())
}

/// The texts validate without an adapter.
fn texts_validate(brdf: &SharedBrdf) -> Result<(), Failed> {
    let source = steradian_techniques::gpu::module(&technique(&brdf.shader().ok_or("no WGSL text")?));
    let module = naga::front::wgsl::parse_str(&source).map_err(|e| e.emit_to_string(&source))?;
    let flags = naga::valid::ValidationFlags::all();
    naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
        .validate(&module)
        .map_err(|e| e.emit_to_string(&source))?;
    Ok(())
}

fn main() {
    common::with_unoptimised_shaders();
    let arguments = Arguments::from_args();
    let required = std::env::var_os("STERADIAN_REQUIRE_GPU").is_some();
    let ignored = gpu().is_err() && !required;
    let mut trials = vec![Trial::test("every_model_has_a_text", every_model_has_a_text)];
    for spec in SPECS {
        trials.push(Trial::test(format!("valid::{spec}"), move || {
            texts_validate(&steradian_brdf::parse(spec)?)
        }));
        let compared = move || compare(spec, &steradian_brdf::parse(spec)?);
        trials.push(Trial::test(*spec, compared).with_ignored_flag(ignored));
    }
    let mut both = |spec: &'static str, of: fn(&str) -> Option<SharedBrdf>| {
        let each = |run: fn(&str, &SharedBrdf) -> Result<(), Failed>| {
            move || of(spec).map_or(Ok(()), |brdf| run(spec, &brdf))
        };
        trials.push(Trial::test(format!("valid::{spec}"), each(|_, brdf| texts_validate(brdf))));
        trials.push(Trial::test(spec, each(compare)).with_ignored_flag(ignored));
    };
    MEASURED.iter().for_each(|spec| both(spec, measured));
    GRIDS.iter().for_each(|(spec, _)| {
        both(spec, |spec| GRIDS.iter().find(|g| g.0 == spec).map(|g| table(g.0, g.1)));
    });
    both("curet:a.dat", |_| Some(modes()));
    for spec in ["rgl:half", "rgl:quarter"] {
        both(spec, |spec| Some(anisotropic(spec)));
    }
    for spec in ["sgd:chrome", "sgd:blue-acrylic", "sgd:gold-metallic-paint", "ward:ax=0.1,ay=0.4"] {
        let compared = move || compare("lobes", &fitted(spec));
        trials.push(Trial::test(format!("lobes::{spec}"), compared).with_ignored_flag(ignored));
    }
    for spec in ["abc:chrome", "sgd:gold-metallic-paint", "oren-nayar:sigma=0.5"] {
        let compared = move || compare(spec, &tabulated(spec));
        trials.push(Trial::test(format!("merl::{spec}"), compared).with_ignored_flag(ignored));
    }
    libtest_mimic::run(&arguments, trials).exit();
}
