//! ESRI ASCII grids.

use super::{Raster, TerrainError, content};
use crate::grid::GridSpec;
use crate::scene::read_text;
use glam::DVec2;
use std::path::Path;

/// Largest file in bytes.
const MAX_BYTES: u64 = 8 << 30;

/// Reads a grid; its first row is the northern one and becomes the smallest Z. Samples without data become `fill`, or
/// are refused. `map_origin` (easting, northing) becomes the world's origin; by default that is the first sample.
pub(super) fn read(
    file: &Path,
    fill: Option<f64>,
    map_origin: Option<DVec2>,
) -> Result<Raster, TerrainError> {
    parse(&read_text(file, MAX_BYTES)?, file, fill, map_origin)
}

#[derive(Default)]
struct Header {
    columns: Option<usize>,
    rows: Option<usize>,
    /// Easting of the lower left corner or sample; whether it is the corner.
    x: Option<(f64, bool)>,
    y: Option<(f64, bool)>,
    dx: Option<f64>,
    dy: Option<f64>,
    nodata: Option<f64>,
}

fn parse(
    text: &str,
    file: &Path,
    fill: Option<f64>,
    map_origin: Option<DVec2>,
) -> Result<Raster, TerrainError> {
    let fault = |line: usize, message: String, remedy: &str| TerrainError::Line {
        file: file.into(),
        line: u32::try_from(line + 1).unwrap_or(u32::MAX),
        message,
        remedy: remedy.into(),
    };
    let mut lines = text
        .lines()
        .enumerate()
        .filter(|(_, l)| !l.trim().is_empty())
        .peekable();
    let mut header = Header::default();
    while let Some(&(at, line)) = lines.peek() {
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else { break };
        if !word.starts_with(|c: char| c.is_ascii_alphabetic()) || word.parse::<f64>().is_ok() {
            break;
        }
        let (Some(value), None) = (words.next(), words.next()) else {
            return Err(fault(
                at,
                format!("`{}` is not a key and its value", clip(line)),
                "write one key and its value a line",
            ));
        };
        set(&mut header, word, value).map_err(|(message, remedy)| fault(at, message, remedy))?;
        lines.next();
    }
    let missing = |key: &str| {
        content(
            file,
            format!("the header has no `{key}`"),
            "add it before the heights",
        )
    };
    let columns = header.columns.ok_or_else(|| missing("ncols"))?;
    let rows = header.rows.ok_or_else(|| missing("nrows"))?;
    let (x, x_is_corner) = header.x.ok_or_else(|| missing("xllcorner"))?;
    let (y, y_is_corner) = header.y.ok_or_else(|| missing("yllcorner"))?;
    let dx = header.dx.ok_or_else(|| missing("cellsize"))?;
    let dy = header.dy.ok_or_else(|| missing("cellsize"))?;
    let count = columns.saturating_mul(rows);
    if count as u64 > GridSpec::MAX_SAMPLES {
        let message = format!(
            "{columns} x {rows} heights are more than the {} allowed",
            GridSpec::MAX_SAMPLES
        );
        return Err(content(file, message, "cut out a part or thin it out"));
    }

    // The text bounds how many heights there can be, whatever the header says.
    let mut values = Vec::with_capacity(count.min(text.len() / 2 + 1));
    let (mut uneven, mut gap) = (None, None);
    let mut gaps = 0_usize;
    let mut last = 0;
    for (at, line) in lines {
        let before = values.len();
        for word in line.split_whitespace() {
            let value = match word.parse::<f64>() {
                Ok(v) if Some(v) == header.nodata => {
                    gap.get_or_insert((at, values.len()));
                    gaps += 1;
                    fill.unwrap_or(0.0)
                }
                Ok(v) if v.is_finite() => v,
                _ => {
                    return Err(fault(
                        at,
                        format!("`{}` is not a height", clip(word)),
                        "write finite numbers",
                    ));
                }
            };
            values.push(value);
        }
        if values.len() - before != columns {
            uneven.get_or_insert((at, values.len() - before));
        }
        last = at;
        if values.len() > count {
            break;
        }
    }
    // Rows may be broken over lines, so uneven lines matter only if the total is wrong.
    if values.len() != count {
        let (at, found) = uneven.unwrap_or((last, values.len()));
        let more = if values.len() > count {
            "more than"
        } else {
            "fewer than"
        };
        let message =
            format!("{more} {columns} x {rows} heights; this line has {found}, a row has {columns}");
        return Err(fault(at, message, "make heights and header agree"));
    }
    if let (Some((at, k)), None) = (gap, fill) {
        let message = format!(
            "{gaps} of {count} samples have no data; the first is column {}, row {} (from 0)",
            k % columns,
            k / columns
        );
        return Err(fault(
            at,
            message,
            "set terrain.nodata_height to the height that they shall have",
        ));
    }
    let west = x + if x_is_corner { 0.5 * dx } else { 0.0 };
    let north = y + if y_is_corner { 0.5 * dy } else { 0.0 } + (rows - 1) as f64 * dy;
    let origin = map_origin.map_or(DVec2::ZERO, |map| DVec2::new(west - map.x, map.y - north));
    Ok(Raster {
        width: columns,
        height: rows,
        values,
        pitch: DVec2::new(dx, dy),
        origin,
    })
}

fn set(header: &mut Header, key: &str, text: &str) -> Result<(), (String, &'static str)> {
    let finite = || {
        let value = text.parse::<f64>().ok().filter(|v| v.is_finite());
        value.ok_or_else(|| {
            (
                format!("{key} `{}` is not a number", clip(text)),
                "write a finite number",
            )
        })
    };
    let count = || {
        let value = text.parse::<usize>().ok().filter(|&n| n > 0 && n <= 1 << 28);
        value.ok_or_else(|| {
            (
                format!("{key} `{}` is not a count of samples", clip(text)),
                "write a whole number above 0",
            )
        })
    };
    let length = || match finite()? {
        v if (1e-6..=1e9).contains(&v) => Ok(v),
        v => Err((
            format!("{key} is {v} m, which is no distance between samples"),
            "write a length above 0 in metres",
        )),
    };
    match key.to_ascii_lowercase().as_str() {
        "ncols" => header.columns = Some(count()?),
        "nrows" => header.rows = Some(count()?),
        "xllcorner" => header.x = Some((finite()?, true)),
        "xllcenter" | "xllcentre" => header.x = Some((finite()?, false)),
        "yllcorner" => header.y = Some((finite()?, true)),
        "yllcenter" | "yllcentre" => header.y = Some((finite()?, false)),
        "cellsize" => (header.dx, header.dy) = (Some(length()?), Some(length()?)),
        "dx" => header.dx = Some(length()?),
        "dy" => header.dy = Some(length()?),
        // `nan` stands for itself: heights that are not numbers are refused anyway.
        "nodata_value" | "nodata" => header.nodata = text.parse().ok(),
        _ => {
            let remedy = "known: ncols, nrows, xllcorner, xllcenter, yllcorner, yllcenter, cellsize, dx, dy, nodata_value";
            return Err((format!("unknown key `{}`", clip(key)), remedy));
        }
    }
    Ok(())
}

fn clip(text: &str) -> String {
    text.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: &str = "\
ncols 3
nrows 2
xllcorner 1000
yllcorner 5000
cellsize 10
NODATA_value -9999
1 2 3
4 5 6
";

    fn read(text: &str) -> Result<Raster, TerrainError> {
        parse(text, Path::new("g.asc"), None, None)
    }

    #[test]
    fn the_northern_row_is_the_smallest_z() {
        let raster = read(GRID).unwrap();
        assert_eq!(
            (raster.width, raster.height, raster.pitch),
            (3, 2, DVec2::splat(10.0))
        );
        // First in the file, first in Z.
        assert_eq!(raster.values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(raster.origin, DVec2::ZERO);
    }

    #[test]
    fn corners_and_centres_differ_by_half_a_cell() {
        // The sample of height 1 is centred at easting 1005, northing 5015.
        let map = Some(DVec2::new(1005.0, 5015.0));
        assert_eq!(
            parse(GRID, Path::new("g"), None, map).unwrap().origin,
            DVec2::ZERO
        );
        let south_west = Some(DVec2::new(1000.0, 5000.0));
        assert_eq!(
            parse(GRID, Path::new("g"), None, south_west).unwrap().origin,
            DVec2::new(5.0, -15.0)
        );
        let centred = GRID.replace("corner", "CENTER");
        assert_eq!(
            parse(&centred, Path::new("g"), None, south_west).unwrap().origin,
            DVec2::new(0.0, -10.0)
        );
    }

    #[test]
    fn rows_may_be_broken_and_cells_may_be_oblong() {
        let text = GRID
            .replace("1 2 3\n4", "1 2\n3 4")
            .replace("cellsize 10", "dx 10\ndy 20");
        let raster = read(&text).unwrap();
        assert_eq!((raster.values.len(), raster.pitch), (6, DVec2::new(10.0, 20.0)));
        // Windows line ends and numbers with exponents.
        assert_eq!(
            read(&GRID.replace('\n', "\r\n").replace(" 2 ", " 2e0 "))
                .unwrap()
                .values[1],
            2.0
        );
    }

    #[test]
    fn samples_without_data_are_refused_or_filled() {
        let text = GRID
            .replace("5", "-9999")
            .replace("yllcorner -9999000", "yllcorner 5000");
        let error = read(&text).err().unwrap().to_string();
        assert!(
            error.starts_with("g.asc:8: 1 of 6 samples have no data; the first is column 1, row 1"),
            "{error}"
        );
        let filled = parse(&text, Path::new("g"), Some(-20.0), None).unwrap();
        assert_eq!(filled.values, [1.0, 2.0, 3.0, 4.0, -20.0, 6.0]);
    }

    #[test]
    fn each_fault_names_its_line() {
        for (from, to, says) in [
            (
                "4 5 6\n",
                "4 5\n",
                "g.asc:8: fewer than 3 x 2 heights; this line has 2, a row has 3",
            ),
            (
                "4 5 6\n",
                "4 5 6 7\n",
                "g.asc:8: more than 3 x 2 heights; this line has 4",
            ),
            ("4 5 6\n", "", "g.asc:7: fewer than 3 x 2"),
            ("2 3\n", "x 3\n", "g.asc:7: `x` is not a height"),
            ("2 3\n", "1,5 3\n", "g.asc:7: `1,5` is not a height"),
            ("2 3\n", "nan 3\n", "g.asc:7: `nan` is not a height"),
            ("cellsize 10", "cellsize 0", "g.asc:5: cellsize is 0 m"),
            (
                "cellsize 10",
                "cellsize",
                "g.asc:5: `cellsize` is not a key and its value",
            ),
            ("cellsize 10\n", "", "g.asc: the header has no `cellsize`"),
            ("ncols 3", "ncols -3", "g.asc:1: ncols `-3` is not a count"),
            (
                "ncols 3",
                "ncols 99999999999",
                "g.asc:1: ncols `99999999999` is not a count",
            ),
            ("nrows 2", "rows 2", "g.asc:2: unknown key `rows`"),
        ] {
            let error = read(&GRID.replace(from, to)).err().unwrap().to_string();
            assert!(error.starts_with(says) && error.contains("; "), "{error}");
        }
        assert!(
            read("")
                .err()
                .unwrap()
                .to_string()
                .contains("the header has no `ncols`")
        );
        let huge = "ncols 100000\nnrows 100000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1\n";
        assert!(
            read(huge)
                .err()
                .unwrap()
                .to_string()
                .contains("100000 x 100000 heights are more than")
        );
    }
}
