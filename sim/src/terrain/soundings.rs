//! Scattered soundings, interpolated to a grid by natural neighbours (Sibson 1981).

use super::{Raster, TerrainError, content};
use crate::grid::GridSpec;
use crate::scene::description::Coordinates;
use crate::scene::read_text;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use spade::{
    DelaunayTriangulation, FloatTriangulation, HasPosition, HierarchyHintGenerator, NaturalNeighbor, Point2,
    Triangulation,
};
use std::path::Path;

/// Largest file in bytes.
const MAX_BYTES: u64 = 4 << 30;

/// Reads `x y z` lines and interpolates them to square spacing over their bounding box.
pub(super) fn read(
    file: &Path,
    coordinates: Coordinates,
    spacing: f32,
    map_origin: Option<DVec2>,
) -> Result<Raster, TerrainError> {
    let mut soundings = parse(&read_text(file, MAX_BYTES)?, file, coordinates)?;
    place(&mut soundings, coordinates, map_origin);
    merge_duplicates(&mut soundings);
    interpolate(&soundings, f64::from(spacing)).map_err(|(message, remedy)| content(file, message, remedy))
}

/// One sounding a line, numbers parted by blanks, commas or semicolons. `#` begins a comment; a first line that holds
/// no number is a heading.
fn parse(text: &str, file: &Path, coordinates: Coordinates) -> Result<Vec<DVec3>, TerrainError> {
    let mut soundings = Vec::new();
    let mut heading_allowed = true;
    for (at, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("");
        let mut words = line
            .split(|c: char| c.is_whitespace() || c == ',' || c == ';')
            .filter(|w| !w.is_empty());
        let numbers: [Option<&str>; 4] = std::array::from_fn(|_| words.next());
        let [Some(first), ..] = numbers else { continue };
        if std::mem::take(&mut heading_allowed) && first.parse::<f64>().is_err() {
            continue;
        }
        let fault = |message: String, remedy: &str| TerrainError::Line {
            file: file.into(),
            line: u32::try_from(at + 1).unwrap_or(u32::MAX),
            message,
            remedy: remedy.into(),
        };
        let [Some(x), Some(y), Some(z), None] = numbers else {
            let shown: String = line.trim().chars().take(40).collect();
            return Err(fault(
                format!("`{shown}` is not three numbers"),
                "write x, y and z on each line",
            ));
        };
        let number = |word: &str| {
            let value = word.parse::<f64>().ok().filter(|v| v.abs() <= 1e12);
            value.ok_or_else(|| {
                let shown: String = word.chars().take(40).collect();
                fault(
                    format!("`{shown}` is not a number that a place or depth can have"),
                    "write finite numbers",
                )
            })
        };
        let sounding = DVec3::new(number(x)?, number(y)?, number(z)?);
        let is_place = sounding.x.abs() <= 360.0 && sounding.y.abs() <= 89.0;
        if coordinates == Coordinates::LongitudeLatitude && !is_place {
            let message = format!(
                "{}, {} is no longitude and latitude in degrees",
                sounding.x, sounding.y
            );
            return Err(fault(
                message,
                "write longitudes of -360 to 360 and latitudes of -89 to 89, in this order",
            ));
        }
        soundings.push(sounding);
    }
    Ok(soundings)
}

/// World X, Z and height of each sounding.
fn place(soundings: &mut [DVec3], coordinates: Coordinates, map_origin: Option<DVec2>) {
    match coordinates {
        Coordinates::Metres => {
            let origin = map_origin.unwrap_or(DVec2::ZERO).extend(0.0);
            for s in soundings {
                *s -= origin;
            }
        }
        Coordinates::LongitudeLatitude => {
            let Some(first) = soundings.first().copied() else {
                return;
            };
            // Longitudes within half a turn of the first, so that the date line is no edge.
            for s in soundings.iter_mut() {
                s.x = first.x + (s.x - first.x + 540.0).rem_euclid(360.0) - 180.0;
            }
            let (low, high) = bounds(soundings);
            let centre = map_origin.unwrap_or(0.5 * (low + high));
            let metres = metres_per_degree(centre.y);
            for s in soundings {
                let east = (s.x - centre.x + 540.0).rem_euclid(360.0) - 180.0;
                *s = DVec3::new(east * metres.x, -(s.y - centre.y) * metres.y, s.z);
            }
        }
    }
}

/// Lengths of a degree of longitude and of latitude at a latitude on the WGS 84 ellipsoid.
fn metres_per_degree(latitude: f64) -> DVec2 {
    const EQUATORIAL_RADIUS: f64 = 6_378_137.0;
    const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;
    let (sin, cos) = latitude.to_radians().sin_cos();
    let w2 = 1.0 - ECCENTRICITY_SQUARED * sin * sin;
    let across = EQUATORIAL_RADIUS / w2.sqrt() * cos;
    let along = EQUATORIAL_RADIUS * (1.0 - ECCENTRICITY_SQUARED) / (w2 * w2.sqrt());
    DVec2::new(across, along) * 1.0_f64.to_radians()
}

fn bounds(soundings: &[DVec3]) -> (DVec2, DVec2) {
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    soundings.iter().fold(start, |(low, high), s| {
        (low.min(s.truncate()), high.max(s.truncate()))
    })
}

/// Sorts the soundings and replaces those at one place by their mean.
fn merge_duplicates(soundings: &mut Vec<DVec3>) {
    soundings.sort_by(|a, b| {
        a.x.total_cmp(&b.x)
            .then(a.y.total_cmp(&b.y))
            .then(a.z.total_cmp(&b.z))
    });
    let mut merged: Vec<DVec3> = Vec::with_capacity(soundings.len());
    for group in soundings.chunk_by(|a, b| a.truncate() == b.truncate()) {
        let mean = group.iter().map(|s| s.z).sum::<f64>() / group.len() as f64;
        merged.push(group[0].truncate().extend(mean));
    }
    *soundings = merged;
}

/// A vertex of the triangulation.
struct Vertex {
    position: Point2<f64>,
    height: f64,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

// The hierarchy finds a place from the place alone. Generators that remember the last query would make the result
// depend, in its last bits, on the order of queries and so on the number of threads.
type Mesh = DelaunayTriangulation<Vertex, (), (), (), HierarchyHintGenerator<f64>>;

fn interpolate(soundings: &[DVec3], spacing: f64) -> Result<Raster, (String, &'static str)> {
    let (low, high) = bounds(soundings);
    let extent = high - low;
    if soundings.len() < 3 {
        return Err((
            format!("{} soundings at different places", soundings.len()),
            "at least 3 are needed",
        ));
    }
    // A little is allowed for rounding, so that an extent of ten spacings has eleven samples.
    let count = (extent / spacing * (1.0 + 1e-9)).floor() + 1.0;
    if count.min_element() < 2.0 {
        let message = format!(
            "the soundings span {} m x {} m, less than one spacing of {spacing} m",
            extent.x, extent.y
        );
        return Err((message, "use a finer terrain.spacing"));
    }
    if count.x * count.y > GridSpec::MAX_SAMPLES as f64 {
        let message = format!(
            "{:.0} x {:.0} samples are more than a grid may have",
            count.x, count.y
        );
        return Err((message, "use a coarser terrain.spacing"));
    }
    // About the centre and of the size of 1, so that the interpolation's areas neither cancel nor overflow; a power of
    // two changes no digit.
    let centre = 0.5 * (low + high);
    let unit = (-extent.max_element().log2().ceil()).exp2();
    let point = |p: DVec2| spade::mitigate_underflow(Point2::from(((p - centre) * unit).to_array()));
    let vertices = soundings
        .iter()
        .map(|s| Vertex {
            position: point(s.truncate()),
            height: s.z,
        })
        .collect();
    let mesh = Mesh::bulk_load(vertices)
        .map_err(|e| (format!("cannot be triangulated: {e}"), "check the places"))?;
    if mesh.all_vertices_on_line() {
        return Err(("all soundings lie on one line".into(), "add some beside it"));
    }
    let (width, height) = (count.x as usize, count.y as usize);
    let mut values = vec![0.0; width * height];
    values.par_chunks_mut(width).enumerate().for_each(|(j, row)| {
        let natural = mesh.natural_neighbor();
        let mut weights = Vec::new();
        for (i, value) in row.iter_mut().enumerate() {
            *value = height_at(
                &mesh,
                &natural,
                &mut weights,
                point(low + spacing * DVec2::new(i as f64, j as f64)),
            );
        }
    });
    Ok(Raster {
        width,
        height,
        values,
        pitch: DVec2::splat(spacing),
        origin: low,
    })
}

type Weights = Vec<(spade::handles::FixedVertexHandle, f64)>;

/// Height at a point: by natural neighbours; outside the hull of the soundings, that of the nearest one.
fn height_at(
    mesh: &Mesh,
    natural: &NaturalNeighbor<'_, Mesh>,
    weights: &mut Weights,
    at: Point2<f64>,
) -> f64 {
    natural.get_weights(at, weights);
    if weights.is_empty() {
        return mesh.nearest_neighbor(at).map_or(0.0, |v| v.data().height);
    }
    // Sibson's weights are positive and have the point as their centroid. Along the hull, where the cells are thin,
    // rounding may break that; the triangle's own three weights are exact there.
    let (mut x, mut y, mut lowest) = (-at.x, -at.y, 0.0_f64);
    for &(vertex, weight) in weights.iter() {
        let p = mesh.vertex(vertex).position();
        x += weight * p.x;
        y += weight * p.y;
        lowest = lowest.min(weight);
    }
    let sound = x.abs().max(y.abs()) <= 1e-10 && lowest >= -1e-10;
    if !sound {
        mesh.barycentric().get_weights(at, weights);
    }
    weights
        .iter()
        .map(|&(vertex, weight)| weight * mesh.vertex(vertex).data().height)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    fn scattered(count: usize, f: impl Fn(f64, f64) -> f64) -> Vec<DVec3> {
        let mut rng = Rng::new(3, 0);
        let mut list: Vec<_> = (0..count)
            .map(|_| {
                let (x, z) = (1000.0 * rng.uniform() - 200.0, 400.0 * rng.uniform() + 5000.0);
                DVec3::new(x, z, f(x, z))
            })
            .collect();
        merge_duplicates(&mut list);
        list
    }

    /// Largest error against `f` at samples inside the hull, which is taken as a margin within the box.
    fn error(raster: &Raster, margin: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
        let end = raster.pitch * DVec2::new((raster.width - 1) as f64, (raster.height - 1) as f64);
        let mut worst = 0.0_f64;
        for k in 0..raster.values.len() {
            let p = raster.pitch * DVec2::new((k % raster.width) as f64, (k / raster.width) as f64);
            if p.cmpge(DVec2::splat(margin)).all() && p.cmple(end - margin).all() {
                let q = raster.origin + p;
                worst = worst.max((raster.values[k] - f(q.x, q.y)).abs());
            }
        }
        worst
    }

    #[test]
    fn linear_heights_are_exact_to_rounding() {
        let plane = |x: f64, z: f64| 3.0 + 0.25 * x - 0.125 * z;
        let raster = interpolate(&scattered(800, plane), 7.0).unwrap();
        // Heights are of the size of 600 m and pass through weights of relative error 1e-10 at most.
        let worst = error(&raster, 40.0, plane);
        assert!(worst < 600.0 * 1e-9, "{worst}");
        // A lattice is the other extreme: every four neighbours lie on a circle.
        let lattice: Vec<_> = (0..20 * 15)
            .map(|k| DVec3::new(f64::from(k % 20) * 10.0, f64::from(k / 20) * 10.0, 0.0))
            .map(|p| p.truncate().extend(plane(p.x, p.y)))
            .collect();
        let raster = interpolate(&lattice, 2.5).unwrap();
        assert_eq!((raster.width, raster.height), (77, 57));
        assert!(error(&raster, 0.0, plane) < 1e-9);
    }

    #[test]
    fn smooth_heights_converge() {
        let f = |x: f64, z: f64| (x / 90.0).sin() + (z / 70.0).cos();
        let at = |n| error(&interpolate(&scattered(n, f), 11.0).unwrap(), 60.0, f);
        let (coarse, fine) = (at(1000), at(16_000));
        // Sixteen times the soundings are a quarter of their distance; second order would be a sixteenth.
        assert!(fine < coarse / 6.0, "{coarse} {fine}");
    }

    #[test]
    fn soundings_are_met_and_the_nearest_one_holds_outside_their_hull() {
        let triangle = [
            DVec3::new(0.0, 0.0, 1.0),
            DVec3::new(8.0, 0.0, 2.0),
            DVec3::new(0.0, 8.0, 5.0),
        ];
        let raster = interpolate(&triangle, 1.0).unwrap();
        let at = |i: usize, j: usize| raster.values[j * raster.width + i];
        assert_eq!((at(0, 0), at(8, 0), at(0, 8)), (1.0, 2.0, 5.0));
        assert!((at(4, 4) - 3.5).abs() < 1e-12 && (at(2, 2) - 2.25).abs() < 1e-12);
        assert_eq!((at(8, 4), at(3, 8)), (2.0, 5.0));
    }

    #[test]
    fn duplicates_are_averaged_whatever_their_order() {
        let mut list = vec![
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(0.0, 0.0, 1.0),
            DVec3::new(1.0, 2.0, 5.0),
        ];
        let mut other = list.clone();
        other.reverse();
        merge_duplicates(&mut list);
        merge_duplicates(&mut other);
        assert_eq!(list, [DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 2.0, 4.0)]);
        assert_eq!(list, other);
    }

    #[test]
    fn degenerate_soundings_are_refused() {
        let message = |list: &[DVec3], spacing| interpolate(list, spacing).err().unwrap().0;
        let line: Vec<_> = (0..5)
            .map(|k| DVec3::new(f64::from(k), f64::from(k), 1.0))
            .collect();
        assert_eq!(message(&line, 1.0), "all soundings lie on one line");
        assert_eq!(message(&line[..2], 1.0), "2 soundings at different places");
        assert!(message(&line, 10.0).contains("less than one spacing of 10 m"));
        assert!(message(&line, 1e-6).contains("more than a grid may have"));
        assert!(message(&[], 1.0).contains("0 soundings"));
    }

    #[test]
    fn lines_are_read_and_faults_name_theirs() {
        let read = |text: &str, c| parse(text, Path::new("s.xyz"), c);
        let text = "x;y;z\n# a comment\n1 2 3\n\n4,5,-6e0 # deep\n";
        let list = read(text, Coordinates::Metres).unwrap();
        assert_eq!(list, [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, -6.0)]);
        for (text, says) in [
            ("1 2 3\n4 5\n", "s.xyz:2: `4 5` is not three numbers"),
            ("1 2 3\n4 5 6 7\n", "s.xyz:2: `4 5 6 7` is not three numbers"),
            ("1 2 3\n4 b 6\n", "s.xyz:2: `b` is not a number"),
            ("1 2 3\n4 inf 6\n", "s.xyz:2: `inf` is not a number"),
            ("1 2 3\nx y z\n", "s.xyz:2: `x` is not a number"),
        ] {
            let error = read(text, Coordinates::Metres).unwrap_err().to_string();
            assert!(error.starts_with(says), "{error}");
        }
        let error = read("48.0 236.0 -5\n", Coordinates::LongitudeLatitude)
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with("s.xyz:1: 48, 236 is no longitude and latitude"),
            "{error}"
        );
    }

    #[test]
    fn longitude_and_latitude_become_metres_about_their_centre() {
        // The series that geodesy tables give, good to a centimetre.
        for degrees in [0.0_f64, 48.0, -60.0] {
            let p = degrees.to_radians();
            let along = 111_132.954 - 559.822 * (2.0 * p).cos() + 1.175 * (4.0 * p).cos();
            let across = 111_412.877 * p.cos() - 93.505 * (3.0 * p).cos() + 0.118 * (5.0 * p).cos();
            let metres = metres_per_degree(degrees);
            assert!(
                (metres - DVec2::new(across, along)).abs().max_element() < 0.1,
                "{metres} {across} {along}"
            );
        }
        // Across the date line.
        let mut list = vec![DVec3::new(179.5, 10.0, 1.0), DVec3::new(-179.5, 11.0, 2.0)];
        place(&mut list, Coordinates::LongitudeLatitude, None);
        let metres = metres_per_degree(10.5);
        assert!(
            (list[0].truncate() - DVec2::new(-0.5, 0.5) * metres).length() < 1e-6,
            "{list:?}"
        );
        assert!(
            (list[1].truncate() - DVec2::new(0.5, -0.5) * metres).length() < 1e-6,
            "north is -Z"
        );
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let list = scattered(500, |x, z| (x * 0.01).sin() * z);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| interpolate(&list, 5.0).unwrap().values)
        };
        let bits = |v: Vec<f64>| v.into_iter().map(f64::to_bits).collect::<Vec<_>>();
        assert_eq!(bits(run(1)), bits(run(3)));
    }
}
