//! What the corpus holds.

use crate::{generate_exr, generate_measured};
use steradian_formats::*;

/// Relative path and content.
pub type Entry = (String, Vec<u8>);

/// Every generated file.
pub fn all() -> Vec<Entry> {
    let mut all = Vec::new();
    for (format, entries) in [
        ("hdr", hdr()),
        ("exr", generate_exr::exr()),
        ("pfm", pfm()),
        ("png", png()),
        ("jpg", jpg()),
        ("tga", tga()),
        ("ktx2", ktx2()),
        ("ktx", ktx1()),
        ("dds", dds()),
        ("safetensors", safetensors()),
        ("csv", csv()),
        ("ptm", ptm()),
        ("lp", lp()),
    ] {
        all.extend(entries.into_iter().map(|(name, bytes)| (format!("{format}/{name}"), bytes)));
    }
    all.extend(generate_measured::all());
    all
}

/// `verdict/name` and content.
pub fn entry(name: &str, bytes: impl AsRef<[u8]>) -> Entry {
    (name.into(), bytes.as_ref().to_vec())
}

/// What a writer makes of a file.
pub fn written(extension: &str, write: impl FnOnce(&std::path::Path)) -> Vec<u8> {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join(format!("f.{extension}"));
    write(&path);
    std::fs::read(path).expect("a written file")
}

/// A small picture with runs, literals and a wide range.
pub fn picture(width: usize, height: usize) -> Raster {
    let plane = |s: usize| {
        (0..width * height).map(|i| ((i / 3 * s) % 11) as f32 * 0.25f32.powi(s as i32 - 2)).collect()
    };
    Raster::rgb(width, height, [plane(1), plane(2), plane(3)])
}

fn image(extension: &str, raster: &Raster, options: &WriteOptions) -> Vec<u8> {
    written(extension, |p| {
        write_image(p, raster, options).expect("a written image");
    })
}

fn hdr() -> Vec<Entry> {
    let text = |head: &str, pixels: &[u8]| [b"#?RADIANCE\n", head.as_bytes(), b"\n", pixels].concat();
    let rgbe = "FORMAT=32-bit_rle_rgbe\n\n";
    let pixels: Vec<u8> = (0..6).flat_map(|i| [10 * i, 200, 30, 128 + i]).collect();
    let with = |resolution: &str, pixels: &[u8]| text(&format!("{rgbe}{resolution}"), pixels);
    let mut out = vec![
        entry("valid/new_rle.hdr", image("hdr", &picture(12, 4), &WriteOptions::default())),
        entry("valid/flat.hdr", image("hdr", &picture(3, 2), &WriteOptions::default())),
        entry("valid/old_rle.hdr", with("-Y 1 +X 260", &[9, 9, 9, 130, 1, 1, 1, 3, 1, 1, 1, 1])),
        entry("valid/xyze.hdr", text("FORMAT=32-bit_rle_xyze\n\n-Y 2 +X 3", &pixels)),
        entry(
            "valid/factors.hdr",
            text("EXPOSURE=2\nEXPOSURE=3\nCOLORCORR=1 2 3\n# a comment\n\n-Y 2 +X 3", &pixels),
        ),
        entry("valid/zeros.hdr", text("EXPOSURE=0\nPRIMARIES=0 0 0 0 0 0 0 0\n\n-Y 2 +X 3", &pixels)),
        entry(
            "valid/wide_gamut.hdr",
            text("PRIMARIES=.708 .292 .17 .797 .131 .046 .3127 .329\n\n-Y 2 +X 3", &pixels),
        ),
        entry("invalid/empty.hdr", ""),
        entry("invalid/wrong_magic.hdr", "RADIANCE\n\n-Y 1 +X 1\nabcd"),
        entry("invalid/no_resolution.hdr", text(rgbe, b"")),
        entry("invalid/zero_size.hdr", with("-Y 0 +X 5", b"")),
        entry("invalid/huge.hdr", with("-Y 2147483648 +X 2147483648", b"abcd")),
        entry("invalid/negative.hdr", with("-Y -2 +X 3", &pixels)),
        entry("invalid/truncated.hdr", with("-Y 2 +X 3", &pixels[..23])),
        entry("invalid/repeat_first.hdr", with("-Y 1 +X 2", &[1, 1, 1, 2])),
        entry("invalid/run_too_long.hdr", with("-Y 1 +X 2", &[9, 9, 9, 9, 1, 1, 1, 2])),
        entry(
            "invalid/wrong_line_length.hdr",
            with("-Y 1 +X 8", &[2, 2, 0, 9, 136, 1, 136, 1, 136, 1, 136, 1]),
        ),
        entry(
            "invalid/new_run_too_long.hdr",
            with("-Y 1 +X 8", &[2, 2, 0, 8, 137, 1, 136, 1, 136, 1, 136, 1]),
        ),
        entry("invalid/format.hdr", text("FORMAT=32-bit_rle_foo\n\n-Y 2 +X 3", &pixels)),
        entry("invalid/exposure.hdr", text("EXPOSURE=bright\n\n-Y 2 +X 3", &pixels)),
        entry("invalid/primaries.hdr", text("PRIMARIES=1 1 1 1 1 1 1 1\n\n-Y 2 +X 3", &pixels)),
        entry("fuzzed/repeats.hdr", with("-Y 1 +X 300", &[[9, 9, 9, 9], [1, 1, 1, 255]].concat().repeat(6))),
    ];
    for (i, o) in ["-Y 2 -X 3", "+Y 2 +X 3", "+Y 2 -X 3", "+X 3 -Y 2", "-X 3 -Y 2", "+X 3 +Y 2", "-X 3 +Y 2"]
        .iter()
        .enumerate()
    {
        out.push(entry(&format!("valid/orientation_{}.hdr", i + 2), with(o, &pixels)));
    }
    out
}

fn pfm() -> Vec<Entry> {
    let with = |head: &str, values: &[f32], big: bool| {
        let data = values.iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() });
        head.bytes().chain(data).collect::<Vec<u8>>()
    };
    let v = [0.5, 1.0, -2.0, 1e30, 0.0, 3.5];
    vec![
        entry("valid/colour.pfm", image("pfm", &picture(5, 3), &WriteOptions::default())),
        entry("valid/grey_big_endian.pfm", with("Pf\n3 2\n2.5\n", &v, true)),
        entry("valid/not_finite.pfm", with("Pf 2 1 -1 ", &[f32::NAN, f32::INFINITY], false)),
        entry("invalid/empty.pfm", ""),
        entry("invalid/truncated.pfm", with("PF\n1 2\n-1\n", &v[..5], false)),
        entry("invalid/zero_size.pfm", with("PF\n0 2\n-1\n", &[], false)),
        entry("invalid/huge.pfm", with("PF\n2147483648 2147483648\n-1\n", &v, false)),
        entry("invalid/zero_scale.pfm", with("PF\n1 1\n0\n", &v, false)),
        entry("invalid/no_size.pfm", with("PF\nwide 1\n-1\n", &v, false)),
        entry("invalid/wrong_magic.pfm", with("PX\n1 1\n-1\n", &v, false)),
    ]
}

fn png() -> Vec<Entry> {
    let metadata = vec![("steradian.version".to_string(), "0".to_string())];
    let eight = WriteOptions { metadata, ..WriteOptions::default() };
    let sixteen = WriteOptions { png_bits: 16, ..WriteOptions::default() };
    let mut alpha = picture(5, 4);
    alpha.channels.push(Channel { name: "A".into(), data: vec![0.5; 20] });
    let grey = Raster { channels: vec![Channel { name: "Y".into(), data: vec![0.25; 6] }], ..picture(3, 2) };
    let rgb = image("png", &picture(6, 4), &eight);
    let mut huge = rgb.clone();
    huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let mut zero = rgb.clone();
    zero[16..20].copy_from_slice(&[0; 4]);
    vec![
        entry("valid/rgb8.png", &rgb),
        entry("valid/rgb16.png", image("png", &picture(6, 4), &sixteen)),
        entry("valid/rgba8.png", image("png", &alpha, &eight)),
        entry("valid/grey16.png", image("png", &grey, &sixteen)),
        entry("invalid/empty.png", ""),
        entry("invalid/truncated.png", &rgb[..60]),
        entry("invalid/huge.png", huge),
        entry("invalid/zero_size.png", zero),
        entry("invalid/wrong_magic.png", &rgb[1..]),
    ]
}

/// Nothing here encodes JPEG: the valid files (16×8, quality 80) are kept, the others cut from them.
fn jpg() -> Vec<Entry> {
    let rgb = include_bytes!("jpg/valid/rgb.jpg");
    vec![
        entry("valid/rgb.jpg", rgb),
        entry("valid/grey.jpg", include_bytes!("jpg/valid/grey.jpg")),
        entry("invalid/empty.jpg", ""),
        entry("invalid/truncated.jpg", &rgb[..100]),
        entry("invalid/wrong_magic.jpg", &rgb[2..]),
    ]
}

fn tga() -> Vec<Entry> {
    let with = |kind: u8, bits: u8, size: [u16; 2], pixels: &[u8]| {
        let mut b = vec![0u8; 18];
        (b[2], b[16], b[17]) = (kind, bits, 32);
        b[12..14].copy_from_slice(&size[0].to_le_bytes());
        b[14..16].copy_from_slice(&size[1].to_le_bytes());
        b.extend_from_slice(pixels);
        b
    };
    vec![
        entry("valid/plain24.tga", with(2, 24, [2, 2], &[7; 12])),
        entry("valid/runs32.tga", with(10, 32, [3, 2], &[131, 1, 2, 3, 4, 1, 5, 6, 7, 8, 9, 10, 11, 12])),
        entry("valid/grey.tga", with(3, 8, [2, 1], &[7, 9])),
        entry("invalid/empty.tga", ""),
        entry("invalid/truncated.tga", with(2, 24, [2, 2], &[7; 11])),
        entry("invalid/runs_truncated.tga", with(10, 24, [2, 2], &[131, 1, 2])),
        entry("invalid/zero_size.tga", with(2, 24, [0, 2], &[])),
        entry("invalid/huge.tga", with(2, 24, [65535, 65535], &[7; 12])),
        entry("invalid/colour_mapped.tga", with(1, 8, [2, 2], &[7; 4])),
    ]
}

fn ktx2() -> Vec<Entry> {
    let make = |size: usize, faces: usize, levels: usize, half: bool| {
        let mut t = TextureLevels { width: size, height: size, faces, ..TextureLevels::default() };
        for level in 0..levels {
            t.levels.push((0..t.level_len(level)).map(|i| i as f32 / 8.0).collect());
        }
        t.metadata.push(("steradian.version".into(), "0".into()));
        written("ktx2", |p| {
            write_ktx2(p, &t, half).expect("a written texture");
        })
    };
    let good = make(3, 1, 2, false);
    let blocks = |format: TexelFormat, compression: Supercompression| {
        written("ktx2", |p| {
            write_ktx2_as(p, &odd_cube(), format, compression).expect("a written texture");
        })
    };
    let patched = |at: usize, v: u32| {
        let mut b = good.clone();
        b[at..at + 4].copy_from_slice(&v.to_le_bytes());
        b
    };
    vec![
        entry("valid/image32.ktx2", &good),
        entry("valid/cube16.ktx2", make(4, 6, 3, true)),
        entry("valid/bc6h.ktx2", blocks(TexelFormat::Bc6h, Supercompression::None)),
        entry("valid/bc6h_signed_zstd.ktx2", blocks(TexelFormat::Bc6hSigned, Supercompression::Zstd)),
        entry("invalid/empty.ktx2", ""),
        entry("invalid/wrong_magic.ktx2", &good[1..]),
        entry("invalid/truncated.ktx2", &good[..good.len() - 1]),
        entry("invalid/format.ktx2", patched(12, 37)),
        entry("invalid/huge.ktx2", patched(20, 1 << 31)),
        entry("invalid/zero_size.ktx2", patched(20, 0)),
        entry("invalid/faces.ktx2", patched(36, 5)),
        entry("invalid/levels.ktx2", patched(40, 200)),
        entry("invalid/supercompressed.ktx2", patched(44, 2)),
        entry("invalid/level_offset.ktx2", patched(84, u32::MAX)),
        entry("invalid/key_values.ktx2", patched(60, u32::MAX)),
    ]
}

fn ktx1() -> Vec<Entry> {
    let make = |format: TexelFormat| {
        let mut t = odd_cube();
        t.metadata.push(("sh".into(), "1 2 3\n".into()));
        written("ktx", |p| {
            write_ktx1(p, &t, format).expect("a written texture");
        })
    };
    let good = make(TexelFormat::R11g11b10);
    let patched = |at: usize, v: u32| {
        let mut b = good.clone();
        b[at..at + 4].copy_from_slice(&v.to_le_bytes());
        b
    };
    vec![
        entry("valid/packed.ktx", &good),
        entry("valid/packed_type_of_the_specification.ktx", patched(16, 0x8c3b)),
        entry("valid/packed_old_cmgen.ktx", patched(24, 0x8c3a)),
        entry("valid/bc6h.ktx", make(TexelFormat::Bc6h)),
        entry("invalid/empty.ktx", ""),
        entry("invalid/wrong_magic.ktx", &good[1..]),
        entry("invalid/truncated.ktx", &good[..good.len() - 1]),
        entry("invalid/big_endian.ktx", patched(12, 0x0102_0304)),
        entry("invalid/format.ktx", patched(16, 0x1401)),
        entry("invalid/huge.ktx", patched(36, 1 << 31)),
        entry("invalid/zero_size.ktx", patched(36, 0)),
        entry("invalid/array.ktx", patched(48, 3)),
        entry("invalid/faces.ktx", patched(52, 5)),
        entry("invalid/levels.ktx", patched(56, 200)),
        entry("invalid/key_values.ktx", patched(64, u32::MAX)),
        entry("invalid/key_value_bytes.ktx", patched(60, u32::MAX)),
    ]
}

/// A cube whose sides are no multiples of four.
fn odd_cube() -> TextureLevels {
    let mut t = TextureLevels { width: 5, height: 5, faces: 6, ..TextureLevels::default() };
    for level in 0..3 {
        t.levels.push((0..t.level_len(level)).map(|i| 0.25 + ((i * 7) % 23) as f32 / 8.0).collect());
    }
    t
}

fn dds() -> Vec<Entry> {
    let make = |format: TexelFormat| {
        written("dds", |p| {
            write_dds(p, &odd_cube(), format).expect("a written texture");
        })
    };
    let good = make(TexelFormat::Bc6h);
    let patched = |at: usize, v: u32| {
        let mut b = good.clone();
        b[at..at + 4].copy_from_slice(&v.to_le_bytes());
        b
    };
    vec![
        entry("valid/bc6h.dds", &good),
        entry("valid/bc6h_signed.dds", make(TexelFormat::Bc6hSigned)),
        entry("valid/rgb9e5.dds", make(TexelFormat::Rgb9e5)),
        entry("invalid/empty.dds", ""),
        entry("invalid/wrong_magic.dds", &good[1..]),
        entry("invalid/truncated.dds", &good[..good.len() - 1]),
        entry("invalid/no_dx10.dds", patched(84, 0x3154_5844)),
        entry("invalid/format.dds", patched(128, 98)),
        entry("invalid/huge.dds", patched(16, 1 << 31)),
        entry("invalid/zero_size.dds", patched(12, 0)),
        entry("invalid/levels.dds", patched(28, 200)),
        entry("invalid/volume.dds", patched(132, 4)),
        entry("invalid/array.dds", patched(140, 3)),
    ]
}

fn safetensors() -> Vec<Entry> {
    let mut file = TensorFile::default();
    file.tensors.insert("a".into(), Tensor::f32([2, 3], vec![0.5; 6]));
    file.tensors.insert("b".into(), Tensor::f64([1], vec![-1.0]));
    file.metadata.insert("steradian.version".into(), "0".into());
    let mut good = Vec::new();
    file.encode(&mut good).expect("memory");
    let with =
        |header: &str, data: &[u8]| [&(header.len() as u64).to_le_bytes(), header.as_bytes(), data].concat();
    let f32_at = |shape: &str, range: &str| {
        format!(r#"{{"a":{{"dtype":"F32","shape":{shape},"data_offsets":{range}}}}}"#)
    };
    vec![
        entry("valid/two.safetensors", &good),
        entry("valid/none.safetensors", with("{}", &[])),
        entry("invalid/empty.safetensors", ""),
        entry("invalid/truncated.safetensors", &good[..good.len() - 1]),
        entry("invalid/header_too_long.safetensors", u64::MAX.to_le_bytes()),
        entry("invalid/not_json.safetensors", with("{]", &[])),
        entry("invalid/shape.safetensors", with(&f32_at("[2]", "[0,4]"), &[0; 4])),
        entry("invalid/huge_shape.safetensors", with(&f32_at("[4294967296,4294967296]", "[0,4]"), &[0; 4])),
        entry("invalid/range.safetensors", with(&f32_at("[1]", "[4,0]"), &[0; 4])),
        entry("invalid/dtype.safetensors", with(&f32_at("[1]", "[0,4]").replace("F32", "I32"), &[0; 4])),
    ]
}

fn csv() -> Vec<Entry> {
    vec![
        entry("valid/points.csv", "x,y,z\n0,0,1\n1e-3,-2,.5\n"),
        entry("valid/quoted.csv", "id,\"x\",y,z,note\r\n1,0,0,1,\"a, \"\"b\"\"\nc\"\r\n\r\n2,1,2,3,"),
        entry("valid/no_rows.csv", "x,y,z\n"),
        entry("invalid/empty.csv", ""),
        entry("invalid/no_header.csv", "0,0,1\n"),
        entry("invalid/missing_column.csv", "x,y\n0,0\n"),
        entry("invalid/short_row.csv", "x,y,z\n0,0\n"),
        entry("invalid/not_a_number.csv", "x,y,z\n0,0,up\n"),
        entry("invalid/not_finite.csv", "x,y,z\n0,0,inf\n"),
        entry("invalid/open_quote.csv", "x,y,z\n0,0,\"1\n"),
        entry("invalid/not_text.csv", b"x,y,z\n0,0,\xff\n"),
    ]
}

fn ptm() -> Vec<Entry> {
    let file = |head: &str, texels: &[u8]| [head.as_bytes(), texels].concat();
    let (head, texels) =
        ("PTM_1.2\nPTM_FORMAT_LRGB\n2\n1\n2 1 0.5 0.25 0.125 16\n10 0 0 128 255 0\n", [7; 18]);
    let with = |from: &str, to: &str| file(&head.replacen(from, to, 1), &texels);
    let polynomials =
        |n: usize| vec![[0.5, -0.5, 0.25, 1.0, 0.0, n as f32], [0.75, 0.0, 0.25, -1.0, 1.0, 2.0]];
    let map = |texels: PtmTexels| {
        let ptm = Ptm { width: 1, height: 2, texels };
        written("ptm", |p| {
            write_ptm(p, &ptm).expect("a written map");
        })
    };
    vec![
        entry("valid/by_hand.ptm", with("", "")),
        entry("valid/two_lines.ptm", with("2\n1\n2 1", "2 1\r\n2 1")),
        entry(
            "valid/lrgb.ptm",
            map(PtmTexels::Lrgb { luminance: polynomials(1), color: vec![[1, 2, 3], [4, 5, 6]] }),
        ),
        entry("valid/rgb.ptm", map(PtmTexels::Rgb([1, 2, 3].map(polynomials)))),
        entry("invalid/empty.ptm", ""),
        entry("invalid/wrong_magic.ptm", with("PTM_1.2", "PTN_1.2")),
        entry("invalid/version.ptm", with("PTM_1.2", "PTM_1.1")),
        entry("invalid/jpeg.ptm", with("FORMAT_", "FORMAT_JPEG_")),
        entry("invalid/luminance.ptm", with("LRGB", "LUM")),
        entry("invalid/zero_size.ptm", with("\n2\n", "\n0\n")),
        entry("invalid/huge.ptm", with("\n2\n1\n", "\n65536\n32768\n")),
        entry("invalid/zero_scale.ptm", with("0.25", "0")),
        entry("invalid/not_finite.ptm", with("0.25", "nan")),
        entry("invalid/overflow.ptm", with("128", "1e300")),
        entry("invalid/not_a_number.ptm", with("128", "many")),
        entry("invalid/truncated.ptm", file(head, &texels[1..])),
        entry("invalid/trailing.ptm", [&with("", "")[..], &[0]].concat()),
    ]
}

fn lp() -> Vec<Entry> {
    vec![
        entry("valid/two.lp", "2\nimages/a.jpg 0.5 -0.25 0.75\nb.jpg 0 0 1\n"),
        entry("valid/spaces.lp", "2\r\na 01.jpg 0.5 -0.25 0.75\r\n\r\nb.jpg\t0 0 1e0"),
        entry("invalid/empty.lp", ""),
        entry("invalid/no_count.lp", "a.jpg 0 0 1\n"),
        entry("invalid/count.lp", "3\na.jpg 0 0 1\nb.jpg 0 0 1\n"),
        entry("invalid/huge_count.lp", "18446744073709551615\na.jpg 0 0 1\n"),
        entry("invalid/no_light.lp", "0\n"),
        entry("invalid/no_name.lp", "1\n0 0 1\n"),
        entry("invalid/not_a_number.lp", "1\na.jpg 0 0 up\n"),
        entry("invalid/not_finite.lp", "1\na.jpg 0 0 inf\n"),
        entry("invalid/zero.lp", "1\na.jpg 0 0 0\n"),
        entry("invalid/not_text.lp", b"1\n\xff 0 0 1\n"),
    ]
}
