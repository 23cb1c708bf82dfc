//! Tables, tensors, polynomial texture maps and lists of lights.

use crate::{Bomb, harmless, refused};

/// One after another, so that only one lies in memory.
pub fn bombs() -> Vec<fn() -> Bomb> {
    vec![
        csv_columns,
        csv_rows,
        csv_line,
        tensors_header,
        tensors_many,
        ptm_claims,
        ptm_texels,
        lp_lines,
        lp_empty,
    ]
}

fn csv_columns() -> Bomb {
    let names: Vec<String> = (0..200_000).map(|i| format!("c{i}")).collect();
    harmless("columns.csv", names.join(",").into_bytes())
}

/// Rows of two bytes, of which each becomes a hundred.
fn csv_rows() -> Bomb {
    refused("rows.csv", ["x\n", &"1\n".repeat(4_000_000)].concat().into_bytes(), "`max-memory`")
}

fn csv_line() -> Bomb {
    harmless("line.csv", ["x\n\"", &"a\"\"".repeat(2_000_000), "\"\n"].concat().into_bytes())
}

fn header(text: &str) -> Vec<u8> {
    [&(text.len() as u64).to_le_bytes(), text.as_bytes()].concat()
}

fn tensors_header() -> Bomb {
    refused(
        "header.safetensors",
        header(&format!("{{}}{}", " ".repeat(5 << 20))),
        "its header is longer than 4 MiB",
    )
}

/// As many empty tensors as a header holds.
fn tensors_many() -> Bomb {
    let one = |i| format!(r#""{i}":{{"dtype":"F32","shape":[0],"data_offsets":[0,0]}}"#);
    let all: Vec<String> = (0..60_000).map(one).collect();
    harmless("many.safetensors", header(&format!("{{{}}}", all.join(","))))
}

/// 2^31 texels in a file of a hundred bytes.
fn ptm_claims() -> Bomb {
    let head = "PTM_1.2\nPTM_FORMAT_RGB\n65536\n32768\n1 1 1 1 1 1\n0 0 0 0 0 0\n";
    refused("claims.ptm", head.as_bytes().to_vec(), "`max-memory`")
}

/// Bytes of which each becomes four.
fn ptm_texels() -> Bomb {
    let head = "PTM_1.2\nPTM_FORMAT_RGB\n1000\n1000\n1 1 1 1 1 1\n0 0 0 0 0 0\n";
    refused("texels.ptm", [head.as_bytes(), &vec![1; 18_000_000]].concat(), "`max-memory`")
}

/// Lines of eight bytes, of which each becomes a light.
fn lp_lines() -> Bomb {
    refused("lines.lp", ["2000000\n", &"a 0 0 1\n".repeat(2_000_000)].concat().into_bytes(), "`max-memory`")
}

fn lp_empty() -> Bomb {
    refused("empty.lp", ["1", &"\n".repeat(20_000_000)].concat().into_bytes(), "claims 1 lights")
}
