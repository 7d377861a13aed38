//! Files that a scene names, and what overrides say of them.

use super::*;

#[test]
fn overrides_replace_values_and_are_named_in_their_errors() {
    let scene = load(
        GOOD,
        &[
            "solver.spacing=25 cm",
            "camera.0.fov=30",
            "name=Other",
            "event.0.time = 2",
        ],
    )
    .unwrap();
    assert_eq!(scene.grid.size.to_array(), [81, 41]);
    assert_eq!(
        (scene.description.cameras[0].fov, scene.description.name.as_str()),
        (30.0, "Other")
    );
    for (text, says) in [
        (
            "solver.spacing=-1",
            "scene.toml: solver.spacing: -1 m is out of range (from `--set solver.spacing=-1`); write a length",
        ),
        (
            "solver.spaicng=1",
            "scene.toml: solver.spaicng: unknown key `spaicng` (from `--set solver.spaicng=1`); did you mean",
        ),
        (
            "solver.spacing=2 kg",
            "scene.toml: solver.spacing: `kg` is a unit of mass, not of length (from `--set",
        ),
        (
            "camera.4.fov=3",
            "scene.toml: camera.4.fov: there is no element 4: the list has 1 (from `--set camera.4.fov=3`)",
        ),
        ("solver", "scene.toml: `--set solver` has no `=`; write key=value"),
        (
            "solver.kind=magic",
            "scene.toml: solver.kind: \"magic\" is not known here (from `--set solver.kind=magic`)",
        ),
    ] {
        let found = problems(GOOD, &[text]);
        assert_eq!(found.len(), 1, "{found:#?}");
        assert!(found[0].to_string().starts_with(says), "{}", found[0]);
    }
    // A trial run may end before the events.
    assert_eq!(problems(GOOD, &["duration=0.5"]), []);
    // An override can mend what is wrong in the file.
    assert_eq!(
        problems(
            &GOOD.replace("spacing = 0.5", "spacing = 0"),
            &["solver.spacing=1"]
        ),
        []
    );
}

#[test]
fn a_million_mistakes_are_not_a_million_messages() {
    let text: String = (0..100_000).map(|k| format!("key{k} = 1\n")).collect();
    let found = problems(&(text + GOOD), &[]);
    assert_eq!(found.len(), 101);
    assert_eq!(found[100].message, "and 99900 more problems");
}

#[test]
fn hostile_lists_are_bounded() {
    let bad_turns: String = (0..40_000)
        .map(|k| format!("[[object]]\nname = \"{k}\"\nshape = {{ kind = \"sphere\", radius = -1 }}\nrotation = {{ axis = 1 }}\n"))
        .collect();
    assert_eq!(problems(&(GOOD.to_string() + &bad_turns), &[]).len(), 101);
    let spheres: String = (0..40_000)
        .map(|k| format!("[[object]]\nname = \"{k}\"\nshape = {{ kind = \"sphere\", radius = 1 }}\n"))
        .collect();
    let found = problems(&(GOOD.to_string() + &spheres), &[]);
    assert_eq!(found.len(), 1);
    assert_eq!(
        (found[0].key.as_str(), found[0].message.as_str()),
        ("object", "there are 40002 objects")
    );
}

#[test]
fn files_that_cannot_be_used() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::write(at("empty"), "").unwrap();
    fs::write(at("text.txt"), "name = 'x'\n").unwrap();
    fs::create_dir(at("folder")).unwrap();
    fs::write(
        at("short.asc"),
        "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2\n3\n",
    )
    .unwrap();
    fs::write(at("bad.xyz"), "0 0 -3\n10 0 -3\n0 10 deep\n").unwrap();
    let write_npy = |name: &str, shape: &[usize], values: &[f32]| {
        meniscus_sim::npy::write(&mut fs::File::create(at(name)).unwrap(), shape, values).unwrap();
    };
    write_npy("nan.npy", &[2, 2], &[0.0, 0.1, f32::NAN, 0.0]);
    write_npy("line.npy", &[4], &[0.0; 4]);
    write_npy("none.npy", &[0, 4], &[]);
    let colour = image::RgbImage::new(4, 4);
    colour
        .save_with_format(at("colour.png"), image::ImageFormat::Png)
        .unwrap();
    let grey = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::new(30, 20);
    grey.save_with_format(at("grey.png"), image::ImageFormat::Png)
        .unwrap();
    let mut cut = fs::read(at("grey.png")).unwrap();
    cut.truncate(60);
    fs::write(at("cut.png"), cut).unwrap();

    let case = |table: &str, value: &str, says: &str| {
        let (from, to) = match table {
            "terrain" => ("kind = \"flat\"\nheight = -2.0", value.to_string()),
            "sky" => (
                "{ kind = \"daylight\" }",
                format!("{{ kind = \"picture\", file = \"{value}\" }}"),
            ),
            "model" => (
                "{ kind = \"sphere\", radius = 0.5 }",
                format!("{{ kind = \"model\", file = \"{value}\" }}"),
            ),
            _ => (
                "{ kind = \"disturbance\", position = [5.0, 5.0], radius = 1.0, height = 0.1 }",
                format!("{{ kind = \"array\", file = \"{value}\" }}"),
            ),
        };
        let text = GOOD.replace(from, &to);
        let error = Scene::from_toml(&text, Path::new("scene.toml"), dir.path(), &[]).unwrap_err();
        assert_eq!(error.problems.len(), 1, "{error}");
        let shown = error
            .to_string()
            .replace(&format!("{}/", dir.path().display()), "");
        assert!(
            shown.starts_with(says) && !error.problems[0].remedy.is_empty(),
            "{shown}"
        );
    };
    // What cannot be read is a fault of the line that names it.
    case(
        "array",
        "gone.npy",
        "scene.toml:7: water.initial.file: cannot read gone.npy: there is no such file; check the name",
    );
    case(
        "array",
        "folder",
        "scene.toml:7: water.initial.file: cannot read folder: it is a directory",
    );
    case("array", "", "scene.toml:7: water.initial.file: the text is empty");
    case(
        "sky",
        "gone.exr",
        "scene.toml:18: light.sky.file: cannot read gone.exr: there is no such file",
    );
    case(
        "model",
        "gone.glb",
        "scene.toml:21: object.0.shape.file: cannot read gone.glb: there is no such file",
    );
    let terrain =
        |kind: &str, file: &str, more: &str| format!("kind = \"{kind}\"\nfile = \"{file}\"\n{more}");
    case(
        "terrain",
        &terrain("ascii-grid", "gone.asc", ""),
        "scene.toml:10: terrain.file: cannot read gone.asc",
    );
    // What is wrong inside a file is told with the file's own line.
    case(
        "terrain",
        &terrain("ascii-grid", "short.asc", ""),
        "short.asc:7: terrain.file: fewer than 2 x 2 heights",
    );
    case(
        "terrain",
        &terrain("ascii-grid", "empty", ""),
        "empty: terrain.file: the header has no `ncols`",
    );
    case(
        "terrain",
        &terrain("soundings", "bad.xyz", "spacing = 1"),
        "bad.xyz:3: terrain.file: `deep` is not a number",
    );
    case(
        "terrain",
        &terrain("soundings", "empty", "spacing = 1"),
        "empty: terrain.file: 0 soundings at different places",
    );
    case(
        "terrain",
        &terrain("image", "text.txt", "pixel_size = [1, 1]"),
        "text.txt: terrain.file: this PNG cannot be read",
    );
    case(
        "terrain",
        &terrain("image", "cut.png", "pixel_size = [1, 1]"),
        "cut.png: terrain.file: this PNG cannot be read",
    );
    case(
        "terrain",
        &terrain("image", "colour.png", "pixel_size = [1, 1]"),
        "colour.png: terrain.file: the picture is Rgb8, not grey",
    );
    case(
        "terrain",
        &terrain("image", "grey.png", "pixel_size = [1, 1]\ncrop = [25, 0, 10, 10]"),
        "scene.toml:12: terrain.crop: the part [25, 0, 10, 10] is not in the picture of 30 x 20 pixels",
    );
    case(
        "terrain",
        &terrain("image", "grey.png", "pixel_size = [1, 1]\ncrop = [0, 0, 1, 10]"),
        "scene.toml:12: terrain.crop: a part of 1 x 10 pixels is too small",
    );
    // The good scene's domain of 20 m x 10 m has no place on a terrain of 14.5 m x 9.5 m.
    case(
        "terrain",
        &terrain("image", "grey.png", "pixel_size = [0.5, 0.5]\noffset = -3"),
        "scene.toml:4: domain: the domain covers X 0 to 20",
    );
    case(
        "terrain",
        &terrain("npy", "nan.npy", "pixel_size = [1, 1]"),
        "nan.npy: terrain.file: the height in column 0, row 1",
    );
    case(
        "terrain",
        &terrain("npy", "line.npy", "pixel_size = [1, 1]"),
        "line.npy: terrain.file: the array has shape [4]",
    );
    case(
        "array",
        "nan.npy",
        "nan.npy: water.initial.file: the height at [1, 0] is NaN m",
    );
    case(
        "array",
        "line.npy",
        "line.npy: water.initial.file: the array has shape [4]",
    );
    case(
        "array",
        "none.npy",
        "none.npy: water.initial.file: the array has shape [0, 4] and so no element",
    );
    case(
        "array",
        "text.txt",
        "text.txt: water.initial.file: this is not a .npy array",
    );
    case(
        "sky",
        "text.txt",
        "text.txt: light.sky.file: this picture cannot be read",
    );
    case(
        "model",
        "text.txt",
        "text.txt: object.0.shape.file: this is not a valid glTF file",
    );
    case(
        "model",
        "empty",
        "empty: object.0.shape.file: this is not a valid glTF file",
    );

    // The scene file itself.
    let scene = |name: &str| Scene::load(&at(name), &[]).unwrap_err().to_string();
    assert!(scene("gone.toml").contains("gone.toml: there is no such file; check the name"));
    assert!(scene("folder").contains("folder: it is a directory; name a scene file"));
    assert!(scene("grey.png").contains("it is not a text file: byte 0 (line 1)"));
    assert!(scene("empty").contains("empty:1: name: `name` is missing"));
    assert!(scene("text.txt").contains("text.txt:1: solver: `solver` is missing"));
}
