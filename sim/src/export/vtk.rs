//! VTK XML structured grids, one a frame, and the ParaView collection that gives them their times.

use super::mesh_files::stem;
use super::npz::body_numbers;
use super::staged::{Staged, io_error};
use super::surface::{is_wet, point};
use super::{ExportError, Sink, Summary};
use crate::frame::{Droplets, Frame};
use crate::grid::Grid;
use glam::{Vec2, Vec3};
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// `vtkDataSetAttributes::HIDDENCELL`.
const HIDDEN_CELL: u8 = 32;

const BYTE_ORDER: &str = if cfg!(target_endian = "little") {
    "LittleEndian"
} else {
    "BigEndian"
};

/// One array of a file: attributes and bytes.
struct Array {
    kind: &'static str,
    name: &'static str,
    components: usize,
    bytes: Vec<u8>,
}

impl Array {
    fn new<T: bytemuck::NoUninit>(
        kind: &'static str,
        name: &'static str,
        components: usize,
        values: &[T],
    ) -> Self {
        Self {
            kind,
            name,
            components,
            bytes: bytemuck::cast_slice(values).to_vec(),
        }
    }
}

/// An XML file whose arrays follow it as raw bytes.
#[derive(Default)]
struct Document {
    body: String,
    appended: Vec<Array>,
    offset: usize,
}

impl Document {
    fn line(&mut self, line: &str) {
        self.body.push_str(line);
        self.body.push('\n');
    }

    /// The element of an array, whose bytes are kept for the end of the file.
    fn array(&mut self, array: Array) {
        let Array {
            kind,
            name,
            components,
            ..
        } = &array;
        let line = format!(
            r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="appended" offset="{}"/>"#,
            self.offset
        );
        self.line(&line);
        self.offset += size_of::<u64>() + array.bytes.len();
        self.appended.push(array);
    }

    fn write(&self, kind: &str, out: &mut impl Write) -> io::Result<()> {
        writeln!(
            out,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"{BYTE_ORDER}\" header_type=\"UInt64\">"
        )?;
        out.write_all(self.body.as_bytes())?;
        out.write_all(b"<AppendedData encoding=\"raw\">\n_")?;
        for array in &self.appended {
            out.write_all(&(array.bytes.len() as u64).to_ne_bytes())?;
            out.write_all(&array.bytes)?;
        }
        out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }
}

/// A collection being made.
pub(super) struct Vtk {
    out: PathBuf,
    stem: String,
    folder: PathBuf,
    entries: String,
    /// File of the ground, once it is written.
    ground: Option<String>,
    summary: Summary,
}

impl Vtk {
    pub(super) fn create(out: &Path) -> Result<Self, ExportError> {
        let stem = stem(out, "pvd")?.to_owned();
        let folder = out.with_file_name(&stem);
        // With `OUT` given bare, the folder would be in the place of the file.
        let out = out.with_file_name(format!("{stem}.pvd"));
        if out.is_dir() {
            return Err(ExportError::Destination {
                path: out,
                message: "this is a folder",
                remedy: "name a file",
            });
        }
        if let Err(error) = fs::create_dir(&folder)
            && error.kind() != io::ErrorKind::AlreadyExists
        {
            return Err(io_error(&folder, error));
        }
        Ok(Self {
            out,
            stem,
            folder,
            entries: String::new(),
            ground: None,
            summary: Summary::default(),
        })
    }

    /// Writes a file of the collection and adds it at `time`.
    fn write(&mut self, name: &str, kind: &str, document: &Document) -> Result<(), ExportError> {
        let mut file = Staged::create(&self.folder.join(name))?;
        file.write(|out| document.write(kind, out))?;
        self.summary.bytes += file.commit()?;
        self.summary.files += 1;
        Ok(())
    }

    fn list(&mut self, time: f64, part: u32, name: &str) {
        let file = escape(&format!("{}/{name}", self.stem));
        // Writing to a string cannot fail.
        let _ = writeln!(
            self.entries,
            r#"<DataSet timestep="{time}" group="" part="{part}" file="{file}"/>"#
        );
    }
}

impl Sink for Vtk {
    fn frame(&mut self, frame: &Frame, ground: Option<&Grid<f32>>) -> Result<(), ExportError> {
        let name = format!("{}_{:06}.vts", self.stem, frame.index);
        self.write(&name, "StructuredGrid", &surface_document(frame, ground))?;
        self.list(frame.time, 0, &name);
        if let Some(ground) = ground {
            let name = match &self.ground {
                Some(name) => name.clone(),
                None => {
                    let name = format!("{}_ground.vts", self.stem);
                    self.write(&name, "StructuredGrid", &ground_document(ground))?;
                    self.ground.insert(name).clone()
                }
            };
            self.list(frame.time, 1, &name);
        }
        for (part, what, list) in [
            (2, "droplets", &frame.droplets),
            (3, "particles", &frame.particles),
        ] {
            if let Some(list) = list {
                let name = format!("{}_{:06}_{what}.vtp", self.stem, frame.index);
                self.write(&name, "PolyData", &spheres_document(list))?;
                self.list(frame.time, part, &name);
            }
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<Summary, ExportError> {
        let mut file = Staged::create(&self.out)?;
        file.write(|out| {
            writeln!(
                out,
                "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"{BYTE_ORDER}\">\n<Collection>"
            )?;
            out.write_all(self.entries.as_bytes())?;
            out.write_all(b"</Collection>\n</VTKFile>\n")
        })?;
        self.summary.bytes += file.commit()?;
        self.summary.files += 1;
        self.summary.entry.clone_from(&self.out);
        Ok(self.summary.clone())
    }
}

impl Drop for Vtk {
    /// A failed export may have written nothing; only an empty folder can be removed like this.
    fn drop(&mut self) {
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Vectors on the plane as vectors in space.
fn in_space(values: &[Vec2]) -> Vec<Vec3> {
    values.iter().map(|v| Vec3::new(v.x, 0.0, v.y)).collect()
}

/// Opens a structured grid over `w` by `h` points.
fn open_grid(document: &mut Document, w: usize, h: usize, fields: &str) {
    let extent = format!("0 {} 0 {} 0 0", w - 1, h - 1);
    document.line(&format!("<StructuredGrid WholeExtent=\"{extent}\">"));
    document.body.push_str(fields);
    document.line(&format!("<Piece Extent=\"{extent}\">"));
}

/// Closes a structured grid with its points.
fn close_grid(document: &mut Document, points: &[Vec3]) {
    document.line("<Points>");
    document.array(Array::new("Float32", "Points", 3, points));
    document.line("</Points>\n</Piece>\n</StructuredGrid>");
}

fn surface_document(frame: &Frame, ground: Option<&Grid<f32>>) -> Document {
    let (w, h) = (frame.spec().width(), frame.spec().height());
    let mut fields = format!(
        "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{}</DataArray>\n",
        frame.time
    );
    if let Some(bodies) = frame.bodies.as_ref().filter(|b| !b.is_empty()) {
        let numbers: Vec<String> = bodies
            .iter()
            .flat_map(body_numbers)
            .map(|v| v.to_string())
            .collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            fields,
            "<DataArray type=\"Float32\" Name=\"bodies\" NumberOfComponents=\"13\" NumberOfTuples=\"{}\" format=\"ascii\">{}</DataArray>",
            bodies.len(),
            numbers.join(" ")
        );
    }
    fields.push_str("</FieldData>\n");

    let mut document = Document::default();
    open_grid(&mut document, w, h, &fields);
    document.line(r#"<PointData Scalars="elevation">"#);
    document.array(Array::new("Float32", "elevation", 1, frame.elevation.as_slice()));
    for (name, channel) in [
        ("ground", ground),
        ("depth", frame.depth.as_ref()),
        ("foam", frame.foam.as_ref()),
    ] {
        if let Some(grid) = channel {
            document.array(Array::new("Float32", name, 1, grid.as_slice()));
        }
    }
    for (name, channel) in [
        ("velocity", &frame.velocity),
        ("displacement", &frame.displacement),
    ] {
        if let Some(grid) = channel {
            document.array(Array::new("Float32", name, 3, &in_space(grid.as_slice())));
        }
    }
    document.line("</PointData>");
    let hidden: Vec<u8> = (1..h)
        .flat_map(|j| (1..w).map(move |i| (i, j)))
        .map(|(i, j)| {
            let k = j * w + i;
            let wet = [k, k - 1, k - w, k - w - 1]
                .into_iter()
                .any(|k| is_wet(frame, ground, k));
            if wet { 0 } else { HIDDEN_CELL }
        })
        .collect();
    if hidden.contains(&HIDDEN_CELL) {
        document.line("<CellData>");
        document.array(Array::new("UInt8", "vtkGhostType", 1, &hidden));
        document.line("</CellData>");
    }
    let points: Vec<Vec3> = (0..h)
        .flat_map(|j| (0..w).map(move |i| point(frame, i, j)))
        .collect();
    close_grid(&mut document, &points);
    document
}

fn ground_document(ground: &Grid<f32>) -> Document {
    let spec = ground.spec();
    let mut document = Document::default();
    open_grid(&mut document, spec.width(), spec.height(), "");
    document.line(r#"<PointData Scalars="ground">"#);
    document.array(Array::new("Float32", "ground", 1, ground.as_slice()));
    document.line("</PointData>");
    let points: Vec<Vec3> = (0..spec.height())
        .flat_map(|j| (0..spec.width()).map(move |i| (i, j)))
        .map(|(i, j)| {
            let p = spec.position(i, j);
            Vec3::new(p.x, ground[(i, j)], p.y)
        })
        .collect();
    close_grid(&mut document, &points);
    document
}

fn spheres_document(list: &Droplets) -> Document {
    let n = list.len();
    let mut document = Document::default();
    document.line(&format!(
        "<PolyData>\n<Piece NumberOfPoints=\"{n}\" NumberOfVerts=\"{n}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">"
    ));
    document.line(r#"<PointData Scalars="radius">"#);
    document.array(Array::new("Float32", "radius", 1, &list.radius));
    document.array(Array::new("Float32", "velocity", 3, &list.velocity));
    document.line("</PointData>\n<Points>");
    document.array(Array::new("Float32", "Points", 3, &list.position));
    document.line("</Points>\n<Verts>");
    let numbers: Vec<i64> = (0..n as i64).collect();
    let ends: Vec<i64> = (1..=n as i64).collect();
    document.array(Array::new("Int64", "connectivity", 1, &numbers));
    document.array(Array::new("Int64", "offsets", 1, &ends));
    document.line("</Verts>\n</Piece>\n</PolyData>");
    document
}

/// Text as the value of an XML attribute.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
