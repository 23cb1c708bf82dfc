//! Small files of measured reflectance.

use crate::generate::{Entry, entry};

/// Every one, with the folder of its format.
pub fn all() -> Vec<Entry> {
    [bsdf(), cornell(), astm(), alta(), brdflab(), anisotropic()].concat()
}

fn bsdf() -> Vec<Entry> {
    let floats: Vec<u8> = [1.5f32, -2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let file = |name: &str, kind: u8, count: u64, offset: u64| -> Vec<u8> {
        let mut out = [&b"tensor_file\0"[..], &[1, 0], &1u32.to_le_bytes()].concat();
        out.extend((name.len() as u16).to_le_bytes());
        out.extend(name.as_bytes());
        out.extend(1u16.to_le_bytes());
        out.push(kind);
        out.extend(offset.to_le_bytes());
        out.extend(count.to_le_bytes());
        [out, floats.clone()].concat()
    };
    vec![
        entry("bsdf/valid/two.bsdf", file("ndf", 10, 2, 42)),
        entry("bsdf/invalid/empty.bsdf", ""),
        entry("bsdf/invalid/cut.bsdf", &file("ndf", 10, 2, 42)[..45]),
        entry("bsdf/invalid/type.bsdf", file("ndf", 77, 2, 42)),
        entry("bsdf/invalid/huge.bsdf", file("ndf", 10, u64::MAX, 42)),
        entry("bsdf/invalid/offset.bsdf", file("ndf", 10, 2, u64::MAX)),
    ]
}

fn cornell() -> Vec<Entry> {
    vec![
        entry("cornell/valid/two.brdf", "# c\n2\n400 700\n.1 0 .2 .3 1 2\n.4 0\r\n.5 .6 3 4"),
        entry("cornell/invalid/empty.brdf", ""),
        entry("cornell/invalid/count.brdf", "1e18\n400\n"),
        entry("cornell/invalid/cut.brdf", "1 400 0 0 0"),
        entry("cornell/invalid/nan.brdf", "1 400 0 0 0 0 nan"),
        entry("cornell/invalid/not_text.brdf", b"1 400 \xff"),
    ]
}

fn astm() -> Vec<Entry> {
    let file =
        |n: &str, rows: &str| format!("ID a\nNUM_POINTS {n}\nVARS theta_i,theta_s,phi_s,R,G,B\n{rows}");
    vec![
        entry("astm/valid/one.astm", file("1", ".1,.2,.3,1,2,3\n")),
        entry("astm/invalid/empty.astm", ""),
        entry("astm/invalid/cut.astm", file("2", ".1,.2,.3,1,2,3\n")),
        entry("astm/invalid/huge.astm", file("18446744073709551615", "")),
        entry("astm/invalid/narrow.astm", file("1", ".1,.2,.3,1,2\n")),
        entry("astm/invalid/nan.astm", file("1", ".1,.2,.3,1,2,nan\n")),
        entry("astm/invalid/no_vars.astm", "NUM_POINTS 1\n"),
    ]
}

fn alta() -> Vec<Entry> {
    let file =
        |dim: &str, rows: &str| format!("#DIM {dim}\n#PARAM_IN COS_TH\n#PARAM_OUT INV_STERADIAN\n{rows}");
    vec![
        entry("alta/valid/two.alta", file("1 1", "1 .5\n.5 .25\n")),
        entry("alta/invalid/empty.alta", ""),
        entry("alta/invalid/dim.alta", file("1", "1 .5\n")),
        entry("alta/invalid/huge.alta", file("1 18446744073709551615", "1 .5\n")),
        entry("alta/invalid/wide.alta", file("1 1", "1 .5 .5 .5 .5\n")),
        entry("alta/invalid/nan.alta", file("1 1", "1 nan\n")),
        entry("alta/invalid/no_head.alta", "1 .5\n"),
    ]
}

fn brdflab() -> Vec<Entry> {
    let file = |lobe: &str| {
        let head = "<BRDF><Material><Name>a</Name><Type>Analytic</Type><Parameters>";
        format!("<!DOCTYPE BRDF>\n{head}{lobe}</Parameters></Material></BRDF>")
    };
    let ward = "<Lobe><Model>Ward</Model><Parameters ax=\"0.1\"/></Lobe>";
    vec![
        entry("brdflab/valid/ward.xml", file(ward)),
        entry("brdflab/invalid/empty.xml", ""),
        entry("brdflab/invalid/cut.xml", &file(ward)[..60]),
        entry("brdflab/invalid/no_lobe.xml", file("")),
        entry("brdflab/invalid/nan.xml", file(&ward.replace("0.1", "nan"))),
        entry("brdflab/invalid/no_model.xml", file(&ward.replace("Model", "M"))),
        entry("brdflab/invalid/entities.xml", "<!DOCTYPE BRDF [<!ENTITY a \"&b;\">]><BRDF>&a;</BRDF>"),
        entry("brdflab/invalid/deep.xml", "<a>".repeat(1000)),
    ]
}

fn anisotropic() -> Vec<Entry> {
    let file = |head: [i32; 4], numbers: usize| -> Vec<u8> {
        let mut all = [0; 16];
        all[..4].copy_from_slice(&head);
        all[10] = 3;
        let numbers = (0..numbers).flat_map(|i| (i as f32).to_le_bytes());
        all.iter().flat_map(|v| v.to_le_bytes()).chain(numbers).collect()
    };
    vec![
        entry("merl_anisotropic/valid/small.binary", file([2, 2, 6, 4], 288)),
        entry("merl_anisotropic/invalid/empty.binary", ""),
        entry("merl_anisotropic/invalid/head.binary", &file([2, 2, 6, 4], 0)[..63]),
        entry("merl_anisotropic/invalid/cut.binary", file([2, 2, 6, 4], 287)),
        entry("merl_anisotropic/invalid/negative.binary", file([-2, -2, 6, 4], 288)),
        entry("merl_anisotropic/invalid/huge.binary", file([i32::MAX; 4], 3)),
        entry("merl_anisotropic/invalid/unequal.binary", file([2, 3, 4, 5], 360)),
    ]
}
