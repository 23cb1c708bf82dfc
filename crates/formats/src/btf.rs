//! Lists of the pictures of a bidirectional texture function (Dana, van Ginneken, Nayar & Koenderink 1999):
//! comma-separated values with a row for each picture.
//!
//! Columns: `theta_i`, `phi_i` of the direction to the light and `theta_o`, `phi_o` of that to the viewer,
//! degrees from the normal (0 to less than 90) and azimuth from the right of the picture to its top; `file`,
//! the picture, rectified to the plane of the surface, in the list's folder or below. Where there is a column
//! `source`, all rows say the same: `synthetic` for what was computed. Plain data: whether every view has
//! every light is the reader's question.

use crate::csv::{CsvTable, decode_csv_like, write_csv};
use crate::image::read_bytes;
use crate::{FormatError, Limits};
use std::path::Path;

/// A picture of a view under a light.
#[derive(Debug, Clone, PartialEq)]
pub struct BtfPicture {
    /// To the light: degrees from the normal, and azimuth.
    pub light: [f64; 2],
    /// To the viewer.
    pub view: [f64; 2],
    /// The picture's name as it stands in the file; it may hold folders.
    pub file: String,
    /// Mean variance of its numbers, where the list says it.
    pub variance: Option<f64>,
}

/// A list of pictures.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BtfList {
    /// The pictures.
    pub pictures: Vec<BtfPicture>,
    /// Where they come from, where the list says it.
    pub source: Option<String>,
    /// Seed of the random numbers that computed them, where the list says it.
    pub seed: Option<u64>,
}

/// The columns of directions.
const ANGLES: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];

/// Is this table a list of pictures?
pub fn is_btf(table: &CsvTable) -> bool {
    ANGLES.iter().all(|a| table.column(a).is_some())
}

/// Reads the list `path`.
pub fn read_btf(path: &Path, limits: &Limits) -> Result<BtfList, FormatError> {
    decode_btf(path, &read_bytes(path, limits)?, limits)
}

/// Parses a list that lies in memory; `name` is for messages.
pub fn decode_btf(name: &Path, bytes: &[u8], limits: &Limits) -> Result<BtfList, FormatError> {
    list(&decode_csv_like(name, bytes, limits, "theta_i,phi_i,theta_o,phi_o,file")?)
}

fn list(table: &CsvTable) -> Result<BtfList, FormatError> {
    let angles = table.vectors(ANGLES)?;
    let file = table.require("file")?;
    if angles.is_empty() {
        return Err(FormatError::invalid(&table.name, "holds no picture"));
    }
    let one = |name: &str| -> Result<Option<&String>, FormatError> {
        let Some(c) = table.column(name) else { return Ok(None) };
        match table.rows.iter().position(|r| r[c] != table.rows[0][c]) {
            Some(row) => Err(table.fault(row, format!("{name} is not that of the rows before it"))),
            None => Ok(Some(&table.rows[0][c])),
        }
    };
    let source = one("source")?.cloned();
    let seed = match one("seed")? {
        Some(text) => Some(text.trim().parse().map_err(|_| table.fault(0, "seed is not a whole number"))?),
        None => None,
    };
    let variance = match table.column("variance") {
        Some(_) => table.vectors(["variance"])?.into_iter().map(|[v]| Some(v)).collect(),
        None => vec![None; angles.len()],
    };
    let mut pictures = Vec::with_capacity(angles.len());
    for (row, ([theta_i, phi_i, theta_o, phi_o], variance)) in angles.into_iter().zip(variance).enumerate() {
        for (name, what, theta) in [("theta_i", "light", theta_i), ("theta_o", "viewer", theta_o)] {
            if !(0.0..90.0).contains(&theta) {
                let why = format!(
                    "{name} is {theta}: the {what} must be above the surface, 0 to less than 90 degrees from its normal"
                );
                return Err(table.fault(row, why));
            }
        }
        if variance.is_some_and(|v: f64| v < 0.0) {
            return Err(table.fault(row, "variance is negative"));
        }
        let name = table.rows[row][file].trim();
        if name.is_empty() {
            return Err(table.fault(row, "file is empty"));
        }
        pictures.push(BtfPicture {
            light: [theta_i, phi_i],
            view: [theta_o, phi_o],
            file: name.into(),
            variance,
        });
    }
    Ok(BtfList { pictures, source, seed })
}

/// Writes a list, each number with the fewest digits that give it back.
pub fn write_btf(path: &Path, list: &BtfList) -> Result<(), FormatError> {
    let refuse = |why: String| FormatError::Unwritable { path: path.into(), why };
    if list.pictures.is_empty() {
        return Err(refuse("there is no picture".into()));
    }
    let mut header: Vec<String> = ANGLES.iter().map(|a| a.to_string()).collect();
    header.push("file".into());
    let varied = list.pictures.iter().any(|p| p.variance.is_some());
    let more = [("source", list.source.is_some()), ("seed", list.seed.is_some()), ("variance", varied)];
    header.extend(more.iter().filter(|m| m.1).map(|m| m.0.to_string()));
    let mut table = CsvTable { header, ..CsvTable::default() };
    for (k, p) in list.pictures.iter().enumerate() {
        let [ti, pi, to, po] = [p.light[0], p.light[1], p.view[0], p.view[1]];
        let above = |t: f64| (0.0..90.0).contains(&t);
        if !(above(ti) && above(to) && pi.is_finite() && po.is_finite()) {
            return Err(refuse(format!("picture {k}: a direction is not above the surface")));
        }
        if p.file.trim() != p.file || p.file.is_empty() || p.file.contains(char::is_control) {
            return Err(refuse(format!(
                "picture {k}: its name is empty, begins or ends with a space, or is of several lines"
            )));
        }
        let mut row = [ti, pi, to, po].map(|x| x.to_string()).to_vec();
        row.push(p.file.clone());
        row.extend(list.source.clone());
        row.extend(list.seed.map(|s| s.to_string()));
        row.extend(varied.then(|| p.variance.unwrap_or(0.0).to_string()));
        table.rows.push(row);
    }
    write_csv(path, &table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    fn read(text: impl AsRef<[u8]>) -> Result<BtfList, FormatError> {
        decode_btf(Path::new("a.csv"), text.as_ref(), &Limits::default())
    }

    const GOOD: &str = "theta_i,phi_i,theta_o,phi_o,file\n0,0,15,60,a b.exr\n75,345,0,0,\"p/c,d.png\"\n";

    #[test]
    fn columns_are_found_by_name() {
        let list = read(GOOD).expect("valid");
        assert_eq!((list.source.as_deref(), list.seed), (None, None));
        let p = &list.pictures;
        assert_eq!((p[0].light, p[0].view, p[0].file.as_str()), ([0.0; 2], [15.0, 60.0], "a b.exr"));
        assert_eq!((p[1].light, p[1].file.as_str(), p[1].variance), ([75.0, 345.0], "p/c,d.png", None));
        let more =
            "file,source,phi_o,theta_o,theta_i,phi_i,variance,seed,note\na,synthetic,1,2,3,4,1e-3,7,x\n";
        let list = read(more).expect("valid");
        assert_eq!((list.source.as_deref(), list.seed), (Some("synthetic"), Some(7)));
        assert_eq!((list.pictures[0].view, list.pictures[0].variance), ([2.0, 1.0], Some(1e-3)));
    }

    #[test]
    fn faults_name_their_line() {
        let why = |text: &str| read(text).expect_err(text).to_string();
        assert!(why("theta_i,phi_i,theta_o,phi_o\n0,0,0,0\n").contains("there is no column 'file'"));
        assert!(why("theta_i,phi_i,phi_o,file\n0,0,0,a\n").contains("there is no column 'theta_o'"));
        assert_eq!(why("theta_i,phi_i,theta_o,phi_o,file\n"), "a.csv: holds no picture");
        assert!(why("\n").ends_with("such as theta_i,phi_i,theta_o,phi_o,file"), "{}", why("\n"));
        assert!(why("0,0,15,60,1\n").ends_with("such as theta_i,phi_i,theta_o,phi_o,file"));
        let row = |r: &str| why(&format!("{GOOD}{r}\n"));
        assert!(row("95,0,0,0,x").starts_with("a.csv: line 4: theta_i is 95: the light must be above"));
        assert!(row("0,0,90,0,x").contains("line 4: theta_o is 90: the viewer must be above"));
        assert!(row("0,0,-1,0,x").contains("theta_o is -1"));
        assert!(row("NaN,0,0,0,x").contains("line 4: theta_i is not finite"));
        assert!(row("0,east,0,0,x").contains("line 4: phi_i is 'east', not a number"));
        assert!(row("0,0,0,0,").contains("line 4: file is empty"));
        let head = "theta_i,phi_i,theta_o,phi_o,file,source\n0,0,0,0,a,synthetic\n";
        assert!(why(&format!("{head}0,0,9,0,b,measured\n")).contains("line 3: source is not"));
        let head = "theta_i,phi_i,theta_o,phi_o,file,seed,variance\n";
        assert!(why(&format!("{head}0,0,0,0,a,x,0\n")).contains("seed"));
        assert!(why(&format!("{head}0,0,0,0,a,1,-1\n")).contains("variance is negative"));
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.csv");
        let picture = |t: f64, file: &str, variance| BtfPicture {
            light: [t, 1.0 / 3.0],
            view: [0.1, -7.0],
            file: file.into(),
            variance,
        };
        let mut list = BtfList {
            pictures: vec![picture(0.0, "a,b.exr", Some(0.25)), picture(89.9, "ü/c.png", Some(0.0))],
            source: Some("synthetic".into()),
            seed: Some(u64::MAX),
        };
        write_btf(&path, &list).expect("written");
        assert_eq!(read_btf(&path, &Limits::default()).expect("valid"), list);
        list = BtfList { pictures: vec![picture(3.0, "x", None)], ..BtfList::default() };
        write_btf(&path, &list).expect("written");
        assert_eq!(read_btf(&path, &Limits::default()).expect("valid"), list);
        for bad in [picture(90.0, "x", None), picture(f64::NAN, "x", None), picture(0.0, " x", None)] {
            let list = BtfList { pictures: vec![bad], ..BtfList::default() };
            assert_eq!(write_btf(&path, &list).expect_err("refused").exit_code(), 1);
        }
        assert!(write_btf(&path, &BtfList::default()).is_err());
    }

    #[test]
    fn damaged_lists_are_read_or_refused_in_one_line() {
        let mut damage = Mutator::new(5);
        let mut valid = 0;
        for _ in 0..20_000 {
            match read(damage.damage(GOOD.as_bytes(), GOOD.as_bytes())) {
                Ok(list) => {
                    valid += 1;
                    assert!(
                        list.pictures.iter().all(|p| (0.0..90.0).contains(&p.light[0]) && !p.file.is_empty())
                    );
                }
                Err(e) => assert_eq!(e.to_string().lines().count(), 1, "{e}"),
            }
        }
        assert!(valid > 100, "{valid} of the copies are valid");
    }
}
