//! Tables and tensors.

use crate::{Bomb, harmless, refused};

/// One after another, so that only one lies in memory.
pub fn bombs() -> Vec<fn() -> Bomb> {
    vec![csv_columns, csv_rows, csv_line, tensors_header, tensors_many]
}

fn csv_columns() -> Bomb {
    let names: Vec<String> = (0..200_000).map(|i| format!("c{i}")).collect();
    harmless("columns.csv", names.join(",").into_bytes())
}

/// Rows of two bytes, of which each becomes a hundred.
fn csv_rows() -> Bomb {
    refused("rows.csv", ["x\n", &"1\n".repeat(4_000_000)].concat().into_bytes(), "--max-memory")
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
