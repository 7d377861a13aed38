//! Tests of every format by reading it back.

use super::*;
use crate::scene::description::Description;
use glam::{Quat, UVec2, Vec2, Vec3};
use std::fs;
use std::io::Read;

const SIZE: [usize; 2] = [7, 5];

fn spec() -> GridSpec {
    GridSpec::new(
        Vec2::new(-3.0, 10.0),
        0.5,
        UVec2::new(SIZE[0] as u32, SIZE[1] as u32),
    )
    .unwrap()
}

/// A scene with a beach: the ground rises through elevation 0 between columns 3 and 4.
fn scene() -> Scene {
    let text = "name = \"test\"\n[solver]\nkind = \"procedural\"\nspacing = 0.5";
    let description: Description = toml::from_str(text).unwrap();
    Scene {
        description,
        grid: spec(),
        terrain: Some(Grid::from_fn(spec(), |i, _| i as f32 - 3.5)),
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    }
}

/// Frames 3, 4, … with values that tell frame, sample and channel apart.
struct Numbers {
    next: u64,
    end: u64,
    channels: Channels,
}

fn number(frame: u64, i: usize, j: usize) -> f32 {
    0.01 * frame as f32 + 0.001 * i as f32 - 0.002 * j as f32
}

impl FrameSource for Numbers {
    fn read_into(&mut self, out: &mut Frame) -> Result<Progress, SourceError> {
        if self.next == self.end {
            return Ok(Progress::End);
        }
        let n = self.next;
        self.next += 1;
        out.prepare(spec(), self.channels);
        out.index = n;
        out.time = n as f64 / 30.0;
        let vectors = |scale: f32| Grid::from_fn(spec(), move |i, j| scale * Vec2::new(number(n, i, j), 1.0));
        out.elevation = Grid::from_fn(spec(), |i, j| number(n, i, j));
        if out.depth.is_some() {
            out.depth = Some(Grid::filled(spec(), 2.5));
        }
        if out.velocity.is_some() {
            out.velocity = Some(vectors(2.0));
        }
        if out.displacement.is_some() {
            out.displacement = Some(vectors(0.1));
        }
        if out.foam.is_some() {
            out.foam = Some(Grid::filled(spec(), 0.25));
        }
        for (list, count) in [(&mut out.droplets, n), (&mut out.particles, 2 * n)] {
            if let Some(list) = list {
                for k in 0..count {
                    list.position.push(Vec3::new(k as f32, 1.0, n as f32));
                    list.velocity.push(Vec3::Y);
                    list.radius.push(0.01 * (k + 1) as f32);
                }
            }
        }
        if let Some(bodies) = &mut out.bodies {
            bodies.push(crate::BodyPose {
                position: Vec3::new(n as f32, 2.0, 3.0),
                rotation: Quat::from_xyzw(0.0, 1.0, 0.0, 0.0),
                velocity: Vec3::new(8.0, 9.0, 10.0),
                angular_velocity: Vec3::new(11.0, 12.0, 13.0),
            });
        }
        Ok(Progress::Frame(None))
    }
}

fn numbers(channels: Channels) -> Numbers {
    Numbers {
        next: 3,
        end: 6,
        channels,
    }
}

fn export(format: Format, channels: Channels, out: &Path) -> Result<Summary, ExportError> {
    write(format, &scene(), &mut numbers(channels), out, &mut |_| true)
}

/// Names of what lies in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Shape text and data of an array of an archive.
fn array(archive: &Path, name: &str) -> (String, Vec<u8>) {
    let mut zip = zip::ZipArchive::new(fs::File::open(archive).unwrap()).unwrap();
    let mut bytes = Vec::new();
    zip.by_name(&format!("{name}.npy"))
        .unwrap()
        .read_to_end(&mut bytes)
        .unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!((10 + length) % 64, 0);
    let header = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
    assert!(header.ends_with('\n') && header.contains("'fortran_order': False"));
    let shape = header
        .split("'shape': ")
        .nth(1)
        .unwrap()
        .split(", }")
        .next()
        .unwrap();
    let kind = header.split('\'').nth(3).unwrap();
    (format!("{kind} {shape}"), bytes[10 + length..].to_vec())
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect()
}

#[test]
fn npz_holds_every_array_of_the_contract() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run.npz");
    let summary = export(Format::Npz, Channels::ALL, &out).unwrap();
    assert_eq!((summary.frames, summary.files, &summary.entry), (3, 1, &out));
    assert_eq!(summary.bytes, fs::metadata(&out).unwrap().len());
    assert_eq!(names(folder.path()), ["run.npz"]);

    let shape = |name: &str| array(&out, name).0;
    assert_eq!(shape("time"), "<f8 (3,)");
    assert_eq!(shape("frame"), "<u8 (3,)");
    assert_eq!(shape("x"), "<f8 (7,)");
    assert_eq!(shape("z"), "<f8 (5,)");
    assert_eq!(shape("ground"), "<f4 (5, 7)");
    assert_eq!(shape("elevation"), "<f4 (3, 5, 7)");
    assert_eq!(shape("depth"), "<f4 (3, 5, 7)");
    assert_eq!(shape("velocity"), "<f4 (3, 5, 7, 2)");
    assert_eq!(shape("displacement"), "<f4 (3, 5, 7, 2)");
    assert_eq!(shape("foam"), "<f4 (3, 5, 7)");
    assert_eq!(shape("bodies"), "<f4 (3, 1, 13)");
    assert_eq!(shape("droplets_offset"), "<u8 (4,)");
    assert_eq!(shape("droplets_position"), "<f4 (12, 3)");
    assert_eq!(shape("droplets_radius"), "<f4 (12,)");
    assert_eq!(shape("particles_offset"), "<u8 (4,)");
    assert_eq!(shape("particles_velocity"), "<f4 (24, 3)");

    let elevation = floats(&array(&out, "elevation").1);
    for (f, frame) in (3..6).enumerate() {
        for j in 0..5 {
            for i in 0..7 {
                assert_eq!(elevation[(f * 5 + j) * 7 + i], number(frame, i, j));
            }
        }
    }
    let velocity = floats(&array(&out, "velocity").1);
    assert_eq!(velocity[2 * (7 * 5 + 7 + 2)], 2.0 * number(4, 2, 1));
    let bodies = floats(&array(&out, "bodies").1);
    assert_eq!(
        bodies[13..26],
        [
            4.0, 2.0, 3.0, 0.0, 1.0, 0.0, 0.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0
        ]
    );
    let z: Vec<f64> = array(&out, "z")
        .1
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
        .collect();
    assert_eq!(z, [10.0, 10.5, 11.0, 11.5, 12.0]);
    for (name, expected) in [
        ("droplets_offset", [0, 3, 7, 12]),
        ("particles_offset", [0, 6, 14, 24]),
    ] {
        let offsets: Vec<u64> = array(&out, name)
            .1
            .chunks_exact(8)
            .map(|b| u64::from_le_bytes(b.try_into().unwrap()))
            .collect();
        assert_eq!(offsets, expected);
    }
}

#[test]
fn npz_leaves_out_channels_that_are_not_there_and_says_where_no_bed_is() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run.npz");
    let mut deep = scene();
    deep.terrain = None;
    write(
        Format::Npz,
        &deep,
        &mut numbers(Channels::NONE),
        &out,
        &mut |_| true,
    )
    .unwrap();
    assert!(
        floats(&array(&out, "ground").1)
            .iter()
            .all(|&g| g == f32::NEG_INFINITY)
    );
    // A scene without objects asked for their poses: an empty list a frame, not no frames.
    let none = folder.path().join("none.npz");
    struct NoBodies(Numbers);
    impl FrameSource for NoBodies {
        fn read_into(&mut self, out: &mut Frame) -> Result<Progress, SourceError> {
            let progress = self.0.read_into(out);
            out.bodies = Some(Vec::new());
            progress
        }
    }
    write(
        Format::Npz,
        &deep,
        &mut NoBodies(numbers(Channels::NONE)),
        &none,
        &mut |_| true,
    )
    .unwrap();
    assert_eq!(array(&none, "bodies").0, "<f4 (3, 0, 13)");
    let mut zip = zip::ZipArchive::new(fs::File::open(&out).unwrap()).unwrap();
    let names: Vec<String> = (0..zip.len())
        .map(|n| zip.by_index(n).unwrap().name().unwrap().into_owned())
        .collect();
    assert_eq!(
        names,
        [
            "x.npy",
            "z.npy",
            "ground.npy",
            "time.npy",
            "frame.npy",
            "elevation.npy"
        ]
    );
}

/// Positions, normals and triangles of a mesh file that was read back.
type Mesh = (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<[u32; 3]>);

type ReadMesh = fn(&Path) -> Mesh;

fn read_obj(path: &Path) -> Mesh {
    let text = fs::read_to_string(path).unwrap();
    let mut mesh = Mesh::default();
    for line in text.lines() {
        let mut words = line.split(' ');
        let head = words.next().unwrap();
        let words: Vec<&str> = words.collect();
        let vector = || [0, 1, 2].map(|n| words[n].parse::<f32>().unwrap());
        match head {
            "v" => mesh.0.push(vector()),
            "vn" => mesh.1.push(vector()),
            "f" => mesh
                .2
                .push([0, 1, 2].map(|n| words[n].split("//").next().unwrap().parse::<u32>().unwrap() - 1)),
            _ => {}
        }
    }
    mesh
}

fn read_ply(path: &Path) -> Mesh {
    let bytes = fs::read(path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |element: &str| -> usize {
        let line = header
            .lines()
            .find(|l| l.starts_with(&format!("element {element}")))
            .unwrap();
        line.rsplit(' ').next().unwrap().parse().unwrap()
    };
    let (vertices, faces) = (count("vertex"), count("face"));
    assert_eq!(bytes.len(), end + 24 * vertices + 13 * faces);
    let mut mesh = Mesh::default();
    for v in floats(&bytes[end..end + 24 * vertices]).chunks_exact(6) {
        mesh.0.push([v[0], v[1], v[2]]);
        mesh.1.push([v[3], v[4], v[5]]);
    }
    for f in bytes[end + 24 * vertices..].chunks_exact(13) {
        assert_eq!(f[0], 3);
        mesh.2
            .push([1, 5, 9].map(|at| u32::from_le_bytes(f[at..at + 4].try_into().unwrap())));
    }
    mesh
}

fn read_glb(path: &Path) -> Mesh {
    // Import validates the document.
    let (document, buffers, _) = gltf::import(path).unwrap();
    let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|b| Some(&buffers[b.index()]));
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    (
        reader.read_positions().unwrap().collect(),
        reader.read_normals().unwrap().collect(),
        indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    )
}

#[test]
fn meshes_are_the_wet_surface_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let readers: [(Format, ReadMesh); 3] = [
        (Format::Obj, read_obj),
        (Format::Ply, read_ply),
        (Format::Glb, read_glb),
    ];
    for (format, read) in readers {
        let name = format.name();
        let summary = export(
            format,
            Channels::DISPLACEMENT,
            &folder.path().join(format!("sea.{name}")),
        )
        .unwrap();
        assert_eq!((summary.frames, summary.files), (3, 3));
        assert_eq!(
            summary.entry.file_name().unwrap().to_str().unwrap(),
            format!("sea_000003.{name}")
        );
        let (positions, normals, triangles) = read(&folder.path().join(format!("sea_000004.{name}")));
        // Columns 0 to 3 are wet; the triangles between columns 3 and 4 have wet corners, those beyond have none.
        assert_eq!(positions.len(), 5 * 5, "{name}");
        assert_eq!(triangles.len(), 4 * 4 * 2, "{name}");
        assert_eq!(normals.len(), positions.len());
        let expected = |i: usize, j: usize| {
            let p = spec().position(i, j) + 0.1 * Vec2::new(number(4, i, j), 1.0);
            Vec3::new(p.x, number(4, i, j), p.y)
        };
        for j in 0..5 {
            for i in 0..5 {
                let here = expected(i, j);
                assert!(
                    positions.iter().any(|&p| (Vec3::from(p) - here).length() < 1e-6),
                    "{name} {i} {j}"
                );
            }
        }
        for normal in normals {
            // The plane 0.002 x − 0.004 z a metre.
            let slope = Vec3::new(-0.002, 1.0, 0.004).normalize();
            assert!((Vec3::from(normal) - slope).length() < 1e-4, "{name} {normal:?}");
        }
        for [a, b, c] in triangles {
            let p = |k: u32| Vec3::from(positions[k as usize]);
            let up = (p(b) - p(a)).cross(p(c) - p(a));
            assert!(up.y > 0.0, "{name}: a triangle is seen from below");
        }
    }
}

#[test]
fn a_frame_without_water_is_an_empty_mesh_that_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut dry = scene();
    dry.terrain = Some(Grid::filled(spec(), 100.0));
    for format in [Format::Obj, Format::Ply, Format::Glb] {
        let out = folder.path().join(format!("dry.{}", format.name()));
        write(format, &dry, &mut numbers(Channels::NONE), &out, &mut |_| true).unwrap();
    }
    assert_eq!(read_ply(&folder.path().join("dry_000003.ply")).0.len(), 0);
    let (document, _, _) = gltf::import(folder.path().join("dry_000003.glb")).unwrap();
    assert_eq!(document.meshes().count(), 0);
}

/// Bytes of an appended array of a VTK file.
fn vtk_array(file: &[u8], name: &str) -> Vec<u8> {
    let start = file
        .windows(29)
        .position(|w| w == b"<AppendedData encoding=\"raw\">")
        .unwrap()
        + 31;
    let text = String::from_utf8_lossy(&file[..start]);
    let element = text
        .lines()
        .find(|l| l.contains(&format!("Name=\"{name}\"")))
        .unwrap();
    let offset: usize = element
        .split("offset=\"")
        .nth(1)
        .unwrap()
        .split('"')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    let at = start + offset;
    let length = u64::from_le_bytes(file[at..at + 8].try_into().unwrap()) as usize;
    file[at + 8..at + 8 + length].to_vec()
}

#[test]
fn vtk_collections_name_their_frames_and_hold_their_arrays() {
    let folder = tempfile::tempdir().unwrap();
    let summary = export(Format::Vtk, Channels::ALL, &folder.path().join("run.pvd")).unwrap();
    assert_eq!((summary.frames, summary.files), (3, 11));
    assert_eq!(names(folder.path()), ["run", "run.pvd"]);
    let collection = fs::read_to_string(folder.path().join("run.pvd")).unwrap();
    for file in names(&folder.path().join("run")) {
        assert!(collection.contains(&format!("file=\"run/{file}\"")), "{file}");
    }
    assert_eq!(collection.matches("timestep=\"0.1\"").count(), 4);

    let file = fs::read(folder.path().join("run/run_000004.vts")).unwrap();
    let elevation = floats(&vtk_array(&file, "elevation"));
    assert_eq!(elevation.len(), 35);
    assert_eq!(elevation[2 * 7 + 3], number(4, 3, 2));
    let points = floats(&vtk_array(&file, "Points"));
    assert_eq!(points[3 * (2 * 7 + 3) + 1], number(4, 3, 2));
    assert_eq!(floats(&vtk_array(&file, "velocity")).len(), 3 * 35);
    let hidden = vtk_array(&file, "vtkGhostType");
    assert_eq!(hidden[..6], [0, 0, 0, 0, HIDDEN, HIDDEN]);
    let droplets = fs::read(folder.path().join("run/run_000005_droplets.vtp")).unwrap();
    assert_eq!(floats(&vtk_array(&droplets, "radius")).len(), 5);
    let particles = fs::read(folder.path().join("run/run_000005_particles.vtp")).unwrap();
    assert_eq!(floats(&vtk_array(&particles, "radius")).len(), 10);
    // The file's size is what its arrays say: nothing is cut off.
    assert!(file.ends_with(b"</AppendedData>\n</VTKFile>\n"));
}

const HIDDEN: u8 = 32;

/// A source that fails after one frame.
struct Failing {
    good: Numbers,
    error: fn() -> SourceError,
    errors: u32,
}

impl FrameSource for Failing {
    fn read_into(&mut self, out: &mut Frame) -> Result<Progress, SourceError> {
        if self.good.next == 4 && self.errors > 0 {
            self.errors -= 1;
            return Err((self.error)());
        }
        self.good.read_into(out)
    }
}

fn step_error() -> SourceError {
    SourceError::Step(crate::StepError::InvalidStep { dt: -1.0 })
}

fn damage() -> SourceError {
    SourceError::Recording(RecordingError::DamagedFrame {
        path: "run.mrec".into(),
        frame: 4,
        offset: 1000,
        reason: "its checksum differs".into(),
    })
}

#[test]
fn a_failed_export_leaves_no_half_file() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("run.npz"), "before").unwrap();
    let out = folder.path().join("run.npz");
    let mut source = Failing {
        good: numbers(Channels::ALL),
        error: step_error,
        errors: 1,
    };
    let error = write(Format::Npz, &scene(), &mut source, &out, &mut |_| true).unwrap_err();
    assert!(error.to_string().starts_with("after 1 frames"), "{error}");
    assert_eq!(names(folder.path()), ["run.npz"]);
    assert_eq!(fs::read_to_string(&out).unwrap(), "before");

    // Interrupted after the first frame: its mesh is whole, and nothing else is there.
    let error = write(
        Format::Ply,
        &scene(),
        &mut numbers(Channels::NONE),
        &out.with_extension("ply"),
        &mut |_| false,
    );
    assert!(matches!(error, Err(ExportError::Interrupted { done: 1 })));
    assert_eq!(names(folder.path()), ["run.npz", "run_000003.ply"]);
}

#[test]
fn damaged_frames_are_left_out_where_the_caller_agrees() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run.npz");
    let source = |errors| Failing {
        good: numbers(Channels::NONE),
        error: damage,
        errors,
    };
    let summary = write(Format::Npz, &scene(), &mut source(1), &out, &mut |_| true).unwrap();
    assert_eq!((summary.frames, summary.damaged), (3, 1));
    let refuse = &mut |update: Update<'_>| !matches!(update, Update::Damaged { .. });
    assert!(matches!(
        write(Format::Npz, &scene(), &mut source(1), &out, refuse),
        Err(ExportError::Source { done: 1, .. })
    ));
    // An error that comes again and again is not a damaged frame.
    assert!(write(Format::Npz, &scene(), &mut source(u32::MAX), &out, &mut |_| true).is_err());
}

#[test]
fn impossible_destinations_are_refused_by_name_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL {
        let missing = folder.path().join("missing/run.out");
        let message = export(format, Channels::NONE, &missing).unwrap_err().to_string();
        assert!(
            message.contains("missing") && message.contains("create the folder"),
            "{message}"
        );
    }
    for format in [Format::Npz, Format::Obj, Format::Ply, Format::Glb] {
        let message = export(format, Channels::NONE, folder.path())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("folder") && message.contains("name a file"),
            "{message}"
        );
    }
    assert!(names(folder.path()).is_empty());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_and_the_device_stays() {
    let message = export(Format::Npz, Channels::ALL, Path::new("/dev/full"))
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("/dev/full") && message.contains("free some space"),
        "{message}"
    );
    assert!(fs::metadata("/dev/full").is_ok_and(|data| !data.is_file()));
}

#[test]
fn frames_that_change_their_shape_and_empty_sources_are_refused() {
    struct Changing(Numbers);
    impl FrameSource for Changing {
        fn read_into(&mut self, out: &mut Frame) -> Result<Progress, SourceError> {
            if self.0.next == 5 {
                self.0.channels = Channels::FOAM;
            }
            self.0.read_into(out)
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run.npz");
    let error = write(
        Format::Npz,
        &scene(),
        &mut Changing(numbers(Channels::NONE)),
        &out,
        &mut |_| true,
    )
    .unwrap_err();
    assert!(
        error.to_string().contains("frame 5") && error.to_string().contains("foam"),
        "{error}"
    );
    let mut nothing = numbers(Channels::NONE);
    nothing.end = 3;
    let error = write(Format::Npz, &scene(), &mut nothing, &out, &mut |_| true).unwrap_err();
    assert!(matches!(error, ExportError::Empty));
    assert!(names(folder.path()).is_empty());
}
