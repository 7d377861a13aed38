//! Every kind of mistake in a scene file gives its one message, with the right file, line and key.

mod files;

use meniscus_sim::Scene;
use meniscus_sim::scene::{Problem, SceneError};
use std::fs;
use std::path::Path;

/// A scene in which nothing is wrong; the cases below break one thing each.
const GOOD: &str = r#"name = "Test"
seed = 1
duration = 10.0
[domain]
size = [20.0, 10.0]
[water]
initial = { kind = "disturbance", position = [5.0, 5.0], radius = 1.0, height = 0.1 }
[terrain]
kind = "flat"
height = -2.0
[solver]
kind = "wave-equation"
spacing = 0.5
[boundary]
x_min = "wall"
[light]
sun = { elevation = 40.0, azimuth = 120.0 }
sky = { kind = "daylight" }
[[object]]
name = "ball"
shape = { kind = "sphere", radius = 0.5 }
[[object]]
name = "box"
shape = { kind = "box", size = [1.0, 1.0, 1.0] }
[[camera]]
name = "one"
position = [0.0, 5.0, 20.0]
target = [5.0, 0.0, 5.0]
[[event]]
kind = "drop"
time = 1.0
position = [4.0, 4.0]
radius = 0.5
volume = 0.01
[recording]
rate = 30.0
channels = ["velocity"]
"#;

fn load(text: &str, overrides: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_string()).collect();
    Scene::from_toml(text, Path::new("scene.toml"), Path::new("."), &overrides)
}

fn problems(text: &str, overrides: &[&str]) -> Vec<Problem> {
    load(text, overrides)
        .err()
        .map(|e| e.problems)
        .unwrap_or_default()
}

/// Checks that replacing `from` by `to` gives one problem, whose text begins with `says`.
fn one(from: &str, to: &str, says: &str) {
    assert!(GOOD.contains(from), "the case is out of date: {from}");
    let found = problems(&GOOD.replacen(from, to, 1), &[]);
    let texts: Vec<String> = found.iter().map(ToString::to_string).collect();
    assert_eq!(texts.len(), 1, "{from} -> {to}: {texts:#?}");
    assert!(
        texts[0].starts_with(&format!("scene.toml:{says}")),
        "{to}: {}",
        texts[0]
    );
    assert!(
        !found[0].remedy.is_empty() && texts[0].ends_with(&found[0].remedy),
        "{}",
        texts[0]
    );
}

#[test]
fn the_good_scene_is_good() {
    assert_eq!(problems(GOOD, &[]), []);
}

#[test]
fn syntax() {
    one("seed = 1", "seed = = 1", "2: this is not TOML: ");
    one("[water]", "[water", "6: this is not TOML: ");
    one(
        "seed = 1",
        "name = \"again\"",
        "2: this is not TOML: duplicate key",
    );
    one(
        "duration = 10.0",
        "duration = 10.0\nduration = 5.0",
        "4: this is not TOML: duplicate key",
    );
    one("\"Test\"", "\"Test", "1: this is not TOML: ");
}

#[test]
fn unknown_keys_name_the_nearest() {
    one(
        "seed = 1",
        "sede = 1",
        "2: sede: unknown key `sede`; did you mean `seed`?",
    );
    one(
        "spacing = 0.5",
        "spacing = 0.5\nspacign = 1",
        "14: solver.spacign: unknown key `spacign`; did you mean `spacing`?",
    );
    one(
        "[boundary]",
        "[boundry]",
        "14: boundry: unknown key `boundry`; did you mean `boundary`?",
    );
    one(
        "[[camera]]",
        "[[cameras]]",
        "25: cameras: unknown key `cameras`; did you mean `camera`?",
    );
    one(
        "radius = 0.5 }",
        "radius = 0.5, size = 3 }",
        "21: object.0.shape.size: unknown key `size`; it belongs to kind = \"box\"",
    );
    one(
        "time = 1.0",
        "time = 1.0\nend = 2.0",
        "32: event.0.end: unknown key `end`; it belongs to kind = \"drag\" or \"sweep\" or \"inflow\" or \"rain\"",
    );
    one(
        "rate = 30.0",
        "rate = 30.0\nqqqqq = 1",
        "37: recording.qqqqq: unknown key `qqqqq`; known here: rate, channels, tolerance",
    );
}

#[test]
fn missing_keys_and_kinds() {
    one(
        "name = \"Test\"\n",
        "",
        "1: name: `name` is missing; add it: write a text",
    );
    one(
        "spacing = 0.5\n",
        "",
        "11: solver.spacing: `spacing` is missing; add it: write a length",
    );
    one(
        "radius = 0.5\nvolume",
        "volume",
        "29: event.0.radius: `radius` is missing",
    );
    one(
        "kind = \"wave-equation\"\n",
        "",
        "11: solver.kind: `kind` is missing; add kind = one of \"wave-equation\"",
    );
    one(
        "\"wave-equation\"",
        "\"wave-eqation\"",
        "12: solver.kind: \"wave-eqation\" is not known here; did you mean \"wave-equation\"?",
    );
    one(
        "\"wave-equation\"",
        "7",
        "12: solver.kind: expected a text, found a number",
    );
    one(
        "kind = \"drop\"",
        "kind = \"meteor\"",
        "30: event.0.kind: \"meteor\" is not known here; known: \"drop\"",
    );
    let no_solver = GOOD.replace("[solver]\nkind = \"wave-equation\"\nspacing = 0.5\n", "");
    let found = problems(&no_solver, &[]);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].key, "solver");
}

#[test]
fn wrong_types() {
    one(
        "spacing = 0.5",
        "spacing = true",
        "13: solver.spacing: expected a length, found true or false; write a length as",
    );
    one(
        "spacing = 0.5",
        "spacing = [1]",
        "13: solver.spacing: expected a length, found a list",
    );
    one(
        "spacing = 0.5",
        "spacing = 2020-01-01",
        "13: solver.spacing: expected a length, found a date",
    );
    one(
        "\"Test\"",
        "5",
        "1: name: expected a text, found a number; write it in quotes: \"5\"",
    );
    one("\"Test\"", "\"  \"", "1: name: the text is empty");
    one("seed = 1", "seed = 1.5", "2: seed: 1.5 is not a whole number");
    one("seed = 1", "seed = -1", "2: seed: -1 is not a whole number");
    one(
        "size = [20.0, 10.0]",
        "size = 20.0",
        "5: domain.size: expected a list of 2 numbers, found a number",
    );
    one(
        "size = [20.0, 10.0]",
        "size = [20.0]",
        "5: domain.size: 1 values where 2 are needed; write 2 numbers in m",
    );
    one(
        "size = [20.0, 10.0]",
        "size = [20.0, \"x\"]",
        "5: domain.size.1: \"x\" is not a length",
    );
    one(
        "x_min = \"wall\"",
        "x_min = 3",
        "15: boundary.x_min: expected a text, found a number",
    );
    one(
        "x_min = \"wall\"",
        "x_min = \"glass\"",
        "15: boundary.x_min: \"glass\" is not known here; known: \"wall\", \"open\"",
    );
    one(
        "[[camera]]",
        "[camera]",
        "25: camera: expected a list of tables, found a table; write [[camera]] with double",
    );
    one(
        "[boundary]",
        "[[boundary]]",
        "14: boundary: expected a table, found a list; write [boundary] with single",
    );
    one(
        "{ kind = \"daylight\" }",
        "\"daylight\"",
        "18: light.sky: expected a table, found a text; write { kind = \"daylight\" }",
    );
    one(
        "[\"velocity\"]",
        "\"velocity\"",
        "37: recording.channels: expected a list of channel names",
    );
    one(
        "[\"velocity\"]",
        "[\"velocty\"]",
        "37: recording.channels.0: \"velocty\" is not known here; did you mean \"velocity\"?",
    );
    one(
        "[\"velocity\"]",
        "[\"velocity\", \"velocity\"]",
        "37: recording.channels.1: channel \"velocity\" is named twice",
    );
    one(
        "[\"velocity\"]",
        "[3]",
        "37: recording.channels.0: expected the name of a channel, found a number",
    );
}

#[test]
fn units() {
    one(
        "spacing = 0.5",
        "spacing = \"2 kg\"",
        "13: solver.spacing: `kg` is a unit of mass, not of length; write a length",
    );
    one(
        "spacing = 0.5",
        "spacing = \"0.5\"",
        "13: solver.spacing: the text \"0.5\" has no unit; write 0.5 without quotes",
    );
    one(
        "spacing = 0.5",
        "spacing = \"half\"",
        "13: solver.spacing: \"half\" is not a length",
    );
    one(
        "time = 1.0",
        "time = \"1 m\"",
        "31: event.0.time: `m` is a unit of length, not of time",
    );
    one(
        "volume = 0.01",
        "volume = \"1 litre\"",
        "34: event.0.volume: `litre` is not a known unit",
    );
    one(
        "rate = 30.0",
        "rate = \"30 s\"",
        "36: recording.rate: `s` is a unit of time, not of rate",
    );
    let scene = load(&GOOD.replace("spacing = 0.5", "spacing = \"50 cm\""), &[]).unwrap();
    assert_eq!(scene, load(GOOD, &[]).unwrap());
}

#[test]
fn impossible_values() {
    one(
        "spacing = 0.5",
        "spacing = 0.0",
        "13: solver.spacing: 0 m is out of range; write a length, 1e-6 to 1e9 m",
    );
    one(
        "spacing = 0.5",
        "spacing = -1",
        "13: solver.spacing: -1 m is out of range",
    );
    one(
        "spacing = 0.5",
        "spacing = nan",
        "13: solver.spacing: NaN is not a finite number",
    );
    one(
        "spacing = 0.5",
        "spacing = inf",
        "13: solver.spacing: inf is not a finite number",
    );
    one(
        "spacing = 0.5",
        "spacing = 1e300",
        "13: solver.spacing: 1e300 m is out of range",
    );
    one(
        "spacing = 0.5",
        "spacing = 1e-300",
        "13: solver.spacing: 1e-300 m is out of range",
    );
    one(
        "duration = 10.0",
        "duration = 0",
        "3: duration: 0 s is out of range",
    );
    one(
        "size = [20.0, 10.0]",
        "size = [20.0, -10.0]",
        "5: domain.size.1: -10 m is out of range",
    );
    one(
        "rate = 30.0",
        "rate = 0",
        "36: recording.rate: 0 1/s is out of range",
    );
    one(
        "elevation = 40.0",
        "elevation = 95.0",
        "17: light.sun.elevation: 95 deg is out of range; write an angle, -90 to 90 deg",
    );
    one(
        "height = 0.1 }",
        "height = 0.1 }\nindex = 0.9",
        "8: water.index: 0.9 is out of range; write a number, 1 to 4",
    );
    one(
        "size = [1.0, 1.0, 1.0]",
        "size = [1.0, 0.0, 1.0]",
        "24: object.1.shape.size.1: 0 m is out of range",
    );
    one(
        "radius = 0.5 }",
        "radius = 0.5 }\ncolor = [1.5, 0, 0]",
        "22: object.0.color.0: 1.5 is out of range; write a number, 0 to 1",
    );
    one(
        "radius = 0.5 }",
        "radius = 0.5 }\nrotation = [0, 0, 0, 0.5]",
        "22: object.0.rotation: the quaternion has length 0.5000, not 1",
    );
    one(
        "radius = 0.5 }",
        "radius = 0.5 }\nrotation = { axis = [0, 0, 0], angle = 5 }",
        "22: object.0.rotation.axis: the axis has no direction",
    );
    one(
        "radius = 0.5 }",
        "radius = 0.5 }\nrotation = { axis = [0, 1, 0] }",
        "22: object.0.rotation.angle: `angle` is missing",
    );
}

#[test]
fn grids() {
    one(
        "spacing = 0.5",
        "spacing = 50.0",
        "13: solver.spacing: 20 m x 10 m at a spacing of 50 m has 1 x 1 samples; at least 2",
    );
    one(
        "spacing = 0.5",
        "spacing = 1e-4",
        "13: solver.spacing: 20 m x 10 m at a spacing of 0.0001 m has 200001 x 100001 samples, 80.0 GB a channel; \
         a grid holds at most 268435456 (1.1 GB a channel); use a spacing of at least ",
    );
    one(
        "[domain]\nsize = [20.0, 10.0]\n",
        "",
        "1: domain.size: the size of the domain is not given",
    );
    one(
        "[domain]",
        "[domain]\norigin = [1e7, 0.0]",
        "5: domain.origin: at 10000020 m from the origin",
    );
}

#[test]
fn the_remedy_for_a_large_grid_helps() {
    let text = GOOD.replace("spacing = 0.5", "spacing = 1e-4");
    let remedy = &problems(&text, &[])[0].remedy;
    let spacing = remedy.split(' ').find_map(|w| w.parse::<f64>().ok()).unwrap();
    assert_eq!(
        problems(
            &GOOD.replace("spacing = 0.5", &format!("spacing = {spacing}")),
            &[]
        ),
        []
    );
}

#[test]
fn things_that_do_not_go_together() {
    one(
        "x_min = \"wall\"",
        "x_min = \"periodic\"",
        "15: boundary.x_min: this edge is periodic, but x_max is not",
    );
    one(
        "target = [5.0, 0.0, 5.0]",
        "target = [0.0, 5.0, 20.0]",
        "28: camera.0.target: position and target are the same",
    );
    one(
        "name = \"box\"",
        "name = \"ball\"",
        "23: object.1.name: \"ball\" is already the name of object 0",
    );
    one(
        "[[event]]",
        "[[camera]]\nname = \"one\"\nposition = [1, 1, 1]\ntarget = [0, 0, 0]\n[[event]]",
        "30: camera.1.name: \"one\" is already",
    );
    one(
        "time = 1.0",
        "time = 11.0",
        "31: event.0.time: 11 s is after the scene's duration of 10 s",
    );
    one(
        "time = 1.0",
        "time = -1.0",
        "31: event.0.time: -1 s is out of range",
    );
    one(
        "position = [4.0, 4.0]",
        "position = [40.0, 4.0]",
        "32: event.0.position: this lies outside the domain (X 0 to 20, Z 0 to 10)",
    );
    one(
        "position = [5.0, 5.0], radius",
        "position = [5.0, 15.0], radius",
        "7: water.initial.position: this lies outside the domain",
    );
    one(
        "sun = { elevation = 40.0, azimuth = 120.0 }\n",
        "",
        "17: light.sky.kind: daylight depends on the position of the sun",
    );
    one(
        "elevation = 40.0",
        "elevation = -4.0",
        "17: light.sun.elevation: the daylight model has no sun 4 deg below",
    );
    one(
        "height = -2.0",
        "height = 2.0",
        "8: terrain: the ground, 2 m at its lowest, is nowhere below the water at 0 m",
    );
    one(
        "duration = 10.0",
        "duration = 1e6",
        "36: recording.rate: 1000000 s at 30 frames a second are 30000000 frames",
    );
    one(
        "initial = { kind = \"disturbance\", position = [5.0, 5.0], radius = 1.0, height = 0.1 }",
        "initial = { kind = \"dam\", min = [5.0, 0.0], max = [5.0, 10.0], level = 1.0 }",
        "7: water.initial.max: the reservoir from [5, 0] to [5, 10] has no area",
    );
    let rain =
        "[[event]]\nkind = \"rain\"\nrate = 5\nradius = 0.1\nvolume = 1e-5\nstart = 3\nend = 2\n[recording]";
    one(
        "[recording]",
        rain,
        "41: event.1.end: the end at 2 s is not after the start at 3 s",
    );
    let path = |points: &str| format!("radius = 0.5 }}\nmotion = {{ kind = \"path\", points = [{points}] }}");
    one(
        "radius = 0.5 }",
        &path(""),
        "22: object.0.motion.points: the path has no way point",
    );
    one(
        "radius = 0.5 }",
        &path("{ time = 2, position = [0, 0, 0] }, { time = 2, position = [1, 0, 0] }"),
        "22: object.0.motion.points.1.time: way point 1 at 2 s does not come after the one at 2 s",
    );
    one(
        "[terrain]\nkind = \"flat\"\nheight = -2.0\n[solver]\nkind = \"wave-equation\"",
        "[solver]\nkind = \"shallow-water\"",
        "9: solver.kind: shallow water needs a ground",
    );
    let folding = "kind = \"procedural\"\nwave = [{ amplitude = 1, wavelength = 5, steepness = 0.9 }]";
    one(
        "kind = \"wave-equation\"",
        folding,
        "13: solver.wave: the waves fold over: steepness times 2 pi amplitude",
    );
}

#[test]
fn all_problems_are_told_at_once_and_in_order() {
    let text = GOOD
        .replace("seed = 1", "sede = 1")
        .replace("spacing = 0.5", "spacing = \"2 kg\"")
        .replace("x_min = \"wall\"", "x_min = \"periodic\"")
        .replace("kind = \"drop\"", "kind = \"meteor\"")
        .replace("name = \"box\"", "name = \"ball\"")
        .replace(
            "kind = \"daylight\"",
            "kind = \"picture\", file = \"nowhere.exr\"",
        )
        .replace("rate = 30.0", "rate = 30.0\ntolerance = -1");
    let found = problems(&text, &["camera.0.fov=500", "camera.7.fov=5"]);
    let keys: Vec<&str> = found.iter().map(|p| p.key.as_str()).collect();
    assert_eq!(
        keys,
        [
            "sede",
            "solver.spacing",
            "boundary.x_min",
            "light.sky.file",
            "object.1.name",
            "event.0.kind",
            "recording.tolerance",
            "camera.7.fov",
            "camera.0.fov"
        ],
        "{found:#?}"
    );
    assert!(
        found
            .windows(2)
            .all(|w| w[0].line.unwrap_or(u32::MAX) <= w[1].line.unwrap_or(u32::MAX))
    );
}
