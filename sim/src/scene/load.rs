//! From the text of a scene file to a [`Scene`]: parsing, overrides, checks, and every file that the scene names.

use super::description::{Bed, Description, Initial, Shape, Sky, Terrain};
use super::document::Node;
use super::fault::{Fault, read_text};
use super::report::Report;
use super::{Panorama, Problem, Scene, SceneError, check, layout, schema, series, validate};
use crate::grid::{Grid, GridSpec};
use crate::mesh::{self, TriangleMesh};
use crate::{npy, terrain};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Largest scene file in bytes.
const MAX_BYTES: u64 = 16 << 20;

impl Scene {
    /// Reads a scene file and every file that it names.
    ///
    /// `overrides` are `key=value` texts (`solver.spacing=0.5`, `camera.0.fov=30`) that replace or add keys before
    /// anything is checked; a value is written as in a scene file, texts also without quotes.
    ///
    /// # Errors
    /// [`SceneError`] with everything that is wrong, each with file, line and remedy.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let text = read_text(path, MAX_BYTES).map_err(|e| SceneError {
            problems: vec![Problem {
                file: path.to_path_buf(),
                line: None,
                key: String::new(),
                message: e.reason.clone(),
                remedy: match e.source {
                    Some(_) => "check the name of the scene file".into(),
                    None => "name a scene file (TOML text)".into(),
                },
            }],
        })?;
        Self::from_toml(&text, path, path.parent().unwrap_or(Path::new("")), overrides)
    }

    /// As [`Self::load`], from the text of a scene file. `file_name` is for messages, files are sought in `base_dir`.
    ///
    /// # Errors
    /// See [`Self::load`].
    pub fn from_toml(
        text: &str,
        file_name: &Path,
        base_dir: &Path,
        overrides: &[String],
    ) -> Result<Self, SceneError> {
        let mut report = Report::new(file_name, overrides);
        let mut scene = None;
        if let Some(description) = describe(text, file_name, overrides, &mut report) {
            scene = resolve(description, base_dir, &mut report);
        }
        report.finish_with(scene)
    }

    /// A scene from a description and what its files held, as a recording stores them or a study makes them up.
    ///
    /// Level ground and primitive shapes may be left out (`None`, an empty list): they are made from the description.
    ///
    /// # Errors
    /// [`SceneError`] if the description is impossible or the parts do not belong to it.
    pub fn from_parts(
        description: Description,
        terrain: Option<Grid<f32>>,
        meshes: Vec<TriangleMesh>,
        sky: Option<Panorama>,
        initial_elevation: Option<Grid<f32>>,
    ) -> Result<Self, SceneError> {
        let name = Path::new("scene");
        let mut report = Report::new(name, &[]);
        report.allow_late_events();
        let checked = describe(&description.to_toml(), name, &[], &mut report);
        report.forget_lines();
        if checked.is_none() {
            return report.finish_with(None);
        }
        let scene = assemble(
            description,
            Parts { terrain, meshes, sky },
            |_| initial_elevation,
            &mut report,
        );
        report.finish_with(scene)
    }
}

impl SceneError {
    /// A problem of the value at `key` that only the use of the scene revealed, such as one of a solver: told with the
    /// line of the scene file `file` or with the override that the value came from, as far as they can be found.
    pub fn of_key(file: &Path, overrides: &[String], key: &str, message: &str, remedy: &str) -> Self {
        let mut report = Report::new(file, overrides);
        let root = read_text(file, MAX_BYTES)
            .ok()
            .and_then(|text| Node::parse(&text, file).ok());
        if let Some(mut root) = root {
            for (k, text) in overrides.iter().enumerate() {
                // The scene was loaded with them once; one that fails now only costs its mention.
                let _ = root.apply(text, k);
            }
            report.set_document(root);
        }
        report.at(key, message, remedy);
        report.into_error()
    }
}

impl Description {
    /// Reads and checks the text of a scene file without reading the files that it names. `file_name` is for messages.
    ///
    /// # Errors
    /// [`SceneError`] with everything that is wrong.
    pub fn from_toml(text: &str, file_name: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let mut report = Report::new(file_name, overrides);
        let description = describe(text, file_name, overrides, &mut report);
        report.finish_with(description)
    }

    /// As [`Self::from_toml`], from the text in a recording, which may be that of a scene shortened for a trial.
    pub(crate) fn of_recording(text: &str, name: &Path) -> Result<Self, SceneError> {
        let mut report = Report::new(name, &[]);
        report.allow_late_events();
        let description = describe(text, name, &[], &mut report);
        report.finish_with(description)
    }

    /// The canonical text of the description; reading it gives the same description again. File names that are not
    /// Unicode, which no scene file can hold, lose their odd bytes.
    pub fn to_toml(&self) -> String {
        // Tables with text keys, finite lists, numbers, texts: all of these have a TOML form, so this cannot fail.
        toml::to_string(self).unwrap_or_else(|e| format!("# this scene has no TOML form: {e}\n"))
    }
}

/// Parses and checks; `None` if there is nothing to go on with.
fn describe(text: &str, file_name: &Path, overrides: &[String], report: &mut Report) -> Option<Description> {
    let mut root = match Node::parse(text, file_name) {
        Ok(root) => root,
        Err(problem) => {
            report.add(problem);
            return None;
        }
    };
    for (k, text) in overrides.iter().enumerate() {
        if let Err((key, message, remedy)) = root.apply(text, k) {
            report.add(Problem {
                file: file_name.to_path_buf(),
                line: None,
                key,
                message,
                remedy,
            });
        }
    }
    report.set_document(root.clone());
    let table = check::scene(&root, schema::SCENE, report);
    if report.is_full() {
        return None;
    }
    match table.try_into::<Description>() {
        Ok(description) => {
            validate::description(&description, report);
            Some(description)
        }
        // The schema lets nothing pass that a description cannot hold; a test holds the two against each other.
        Err(e) => {
            report.at(
                "",
                format!("the scene cannot be read: {}", e.message()),
                "check the types of its values",
            );
            None
        }
    }
}

/// What a description's files hold.
#[derive(Default)]
struct Parts {
    terrain: Option<Grid<f32>>,
    meshes: Vec<TriangleMesh>,
    sky: Option<Panorama>,
}

/// Adds what is wrong with a file: at the key that names it if it cannot be read, else in the file itself.
fn blame(report: &mut Report, key: &str, path: &Path, fault: &dyn Fault) {
    if fault.read_error().is_some() {
        return report.unusable(key, fault.what(), fault.remedy());
    }
    report.mark_unusable(key);
    report.add(Problem {
        file: fault.file().unwrap_or(path).to_path_buf(),
        line: fault.line(),
        key: key.to_string(),
        message: fault.what(),
        remedy: fault.remedy(),
    });
}

/// Reads the files.
fn resolve(description: Description, base_dir: &Path, report: &mut Report) -> Option<Scene> {
    let mut parts = Parts::default();
    if let Some(ground) = &description.terrain
        && report.usable(&["terrain"])
    {
        match terrain::load(ground, base_dir) {
            Ok(grid) => parts.terrain = grid,
            // A crop beyond the picture is a fault of the scene file.
            Err(e @ terrain::TerrainError::Crop { .. }) => {
                report.unusable("terrain.crop", e.what(), e.remedy())
            }
            Err(e) => blame(report, "terrain.file", base_dir, &e),
        }
    }
    let mut models: HashMap<(PathBuf, u32), TriangleMesh> = HashMap::new();
    for (k, object) in description.objects.iter().enumerate() {
        let Shape::Model { file, scale } = &object.shape else {
            parts.meshes.push(TriangleMesh::default());
            continue;
        };
        let key = format!("object.{k}.shape.file");
        let path = base_dir.join(file);
        let known = models.get(&(path.clone(), scale.to_bits())).cloned();
        let mesh = match known {
            Some(mesh) => mesh,
            None if !report.usable(&[&format!("object.{k}.shape")]) => TriangleMesh::default(),
            None => match mesh::load_gltf(&path, *scale) {
                Ok(mesh) => {
                    models.insert((path, scale.to_bits()), mesh.clone());
                    mesh
                }
                Err(e) => {
                    blame(report, &key, &path, &e);
                    TriangleMesh::default()
                }
            },
        };
        parts.meshes.push(mesh);
    }
    if let Sky::Picture { file, layout, .. } = &description.light.sky
        && report.usable(&["light.sky"])
    {
        let path = base_dir.join(file);
        match Panorama::load(&path, *layout) {
            Ok(sky) => parts.sky = Some(sky),
            Err(e) => blame(report, "light.sky.file", &path, &e),
        }
    }
    let mut description = description;
    series::read(&mut description, base_dir, report);
    let array = match &description.water.initial {
        Initial::Array { file } if report.usable(&["water.initial"]) => {
            read_heights("water.initial.file", &base_dir.join(file), report)
        }
        _ => None,
    };
    let mut uplifts = Vec::new();
    for (k, bed) in description.beds.iter().enumerate() {
        if let Bed::Array { file, .. } = bed
            && report.usable(&[&format!("bed.{k}")])
        {
            uplifts.extend(read_heights(
                &format!("bed.{k}.file"),
                &base_dir.join(file),
                report,
            ));
        }
    }
    let scene = assemble(
        description,
        parts,
        |spec| array.map(|a| stretch(&a, *spec)),
        report,
    )?;
    let uplifts = uplifts.iter().map(|a| stretch(a, scene.grid)).collect();
    Some(Scene { uplifts, ..scene })
}

/// An array of heights of shape `(nz, nx)` that `key` names, checked.
fn read_heights(key: &str, path: &Path, report: &mut Report) -> Option<npy::Array> {
    let array = match npy::read(path) {
        Ok(array) => array,
        Err(e) => {
            blame(report, key, path, &e);
            return None;
        }
    };
    let mut refuse = |message: String, remedy: &str| {
        report.mark_unusable(key);
        let (file, key) = (path.to_path_buf(), key.to_string());
        report.add(Problem {
            file,
            line: None,
            key,
            message,
            remedy: remedy.into(),
        });
        None
    };
    let &[rows, columns] = array.shape.as_slice() else {
        let message = format!("the array has shape {:?}; heights need two axes", array.shape);
        return refuse(message, "save an array of shape (nz, nx)");
    };
    if rows == 0 || columns == 0 {
        return refuse(
            format!("the array has shape {:?} and so no element", array.shape),
            "save heights",
        );
    }
    if let Some(k) = array.values.iter().position(|v| !(v.abs() <= 1e9)) {
        let message = format!(
            "the height at [{}, {}] is {} m",
            k / columns,
            k % columns,
            array.values[k]
        );
        return refuse(message, "give every element a finite height in metres");
    }
    Some(array)
}

/// Bilinear in double precision, first and last samples on first and last elements.
fn stretch(array: &npy::Array, spec: GridSpec) -> Grid<f32> {
    let (rows, columns) = (array.shape[0], array.shape[1]);
    let cell = |k: usize, samples: usize, elements: usize| {
        let at = k as f64 * (elements - 1) as f64 / (samples.max(2) - 1) as f64;
        let low = (at.floor() as usize).min(elements.saturating_sub(2));
        (low, (low + 1).min(elements - 1), at - low as f64)
    };
    Grid::from_fn(spec, |i, j| {
        let (i0, i1, x) = cell(i, spec.width(), columns);
        let (j0, j1, z) = cell(j, spec.height(), rows);
        let at = |j: usize, i: usize| array.values[j * columns + i];
        let low = at(j0, i0) * (1.0 - x) + at(j0, i1) * x;
        let high = at(j1, i0) * (1.0 - x) + at(j1, i1) * x;
        (low * (1.0 - z) + high * z) as f32
    })
}

/// Makes what needs no file, checks that the parts belong to the description, and puts them together.
fn assemble(
    description: Description,
    parts: Parts,
    initial_elevation: impl FnOnce(&GridSpec) -> Option<Grid<f32>>,
    report: &mut Report,
) -> Option<Scene> {
    let Parts {
        terrain,
        mut meshes,
        sky,
    } = parts;
    let ground = terrain.as_ref().map(|t| *t.spec());
    let usable = |report: &Report, key: &str| report.usable(&[key]);
    if let Some(t) = &terrain
        && let Some((i, j, value)) = t.find_non_finite()
    {
        report.at(
            "terrain",
            format!("the ground at sample ({i}, {j}) is {value}"),
            "give every sample a finite height",
        );
    }
    let needs_ground = !matches!(description.terrain, None | Some(Terrain::Flat { .. }));
    if needs_ground && terrain.is_none() && usable(report, "terrain") {
        report.unusable(
            "terrain",
            "the ground's heights are missing",
            "give them with the description",
        );
    }
    let grid = layout::grid(&description, ground.as_ref(), report);
    let initial_elevation = grid.as_ref().and_then(initial_elevation);
    if let Some(spec) = &grid {
        validate::places(&description, spec, report);
    }

    if meshes.is_empty() {
        meshes = vec![TriangleMesh::default(); description.objects.len()];
    }
    if meshes.len() != description.objects.len() {
        let message = format!(
            "{} meshes for {} objects",
            meshes.len(),
            description.objects.len()
        );
        report.at("object", message, "give one mesh for each object");
    }
    for (k, (mesh, object)) in meshes.iter_mut().zip(&description.objects).enumerate() {
        let key = format!("object.{k}.shape");
        if mesh.triangles.is_empty() && usable(report, &key) {
            match object.shape {
                Shape::Sphere { radius } => *mesh = TriangleMesh::sphere(radius),
                Shape::Box { size } => *mesh = TriangleMesh::cuboid(size),
                Shape::Cylinder { radius, height } => *mesh = TriangleMesh::cylinder(radius, height),
                Shape::Model { .. } => {}
            }
        }
        if let Some(color) = object.color {
            mesh.base_color = color;
            mesh.materials.clear();
            mesh.material_of.clear();
        }
        if usable(report, &key)
            && let Err(e) = mesh.validate()
        {
            report.unusable(&key, e.to_string(), "give a whole mesh");
        }
    }
    let wants_sky = matches!(description.light.sky, Sky::Picture { .. });
    match &sky {
        Some(sky) if !sky.is_valid() => {
            report.at(
                "light.sky",
                "the sky picture is damaged",
                "give it whole, with finite radiance of 0 or more",
            );
        }
        None if wants_sky && usable(report, "light.sky") => {
            report.at(
                "light.sky",
                "the sky picture is missing",
                "give it with the description",
            );
        }
        _ => {}
    }
    let wants_elevation = matches!(description.water.initial, Initial::Array { .. });
    match (&initial_elevation, &grid) {
        (Some(e), Some(spec)) if e.spec() != spec => {
            report.at(
                "water.initial",
                "the initial elevation is not on the solver's grid",
                "give it on that grid",
            );
        }
        (Some(e), _) => {
            if let Some((i, j, value)) = e.find_non_finite() {
                let message = format!("the initial elevation at sample ({i}, {j}) is {value}");
                report.at("water.initial", message, "give every sample a finite elevation");
            }
        }
        (None, Some(_)) if wants_elevation && usable(report, "water.initial") => {
            report.at(
                "water.initial",
                "the initial elevation is missing",
                "give it with the description",
            );
        }
        _ => {}
    }
    let grid = grid?;
    let terrain = match (terrain, &description.terrain) {
        (None, Some(Terrain::Flat { height })) => Some(terrain::flat(*height, &grid)),
        (terrain, _) => terrain,
    };
    validate::series_are_there(&description, report);
    validate::ground(&description, terrain.as_ref(), initial_elevation.as_ref(), report);
    Some(Scene {
        description,
        grid,
        terrain,
        meshes,
        sky,
        initial_elevation,
        uplifts: Vec::new(),
    })
}
