//! What every command does when all is well.

use crate::support::{FRAMES, Folder, SCENE, wait_until};
use serde_json::{Value, json};

#[test]
fn help_helps() {
    let folder = Folder::new();
    let help = folder.run(["--help"]);
    help.exits(0);
    for command in [
        "demo",
        "record",
        "info",
        "render",
        "view",
        "export",
        "plan",
        "study",
        "check",
        "renderers",
        "solvers",
    ] {
        assert!(
            help.stdout.contains(&format!("\n  {command}")),
            "{}",
            help.transcript()
        );
        let of_command = folder.run(["help", command]);
        of_command.exits(0);
        assert!(
            of_command.stdout.contains("Example"),
            "{}",
            of_command.transcript()
        );
        assert_eq!(of_command.stdout, folder.run([command, "--help"]).exits(0).stdout);
    }
    assert!(help.stdout.contains("Exit codes"));
    // Without any argument it is wrong usage, told by the same help.
    let nothing = folder.run::<&str>([]);
    nothing.exits(2).silent();
    assert!(nothing.stderr.contains("Usage:"), "{}", nothing.transcript());
}

#[test]
fn a_scene_is_recorded_and_described() {
    let folder = Folder::with_scene();
    let recorded = folder
        .run(["record", "scene.toml", "-o", "run.mrec", "--json"])
        .exits(0)
        .json();
    assert_eq!(recorded["frames"], FRAMES);
    assert_eq!(recorded["simulated_seconds"], 0.5);
    assert_eq!(recorded["file_bytes"], folder.read("run.mrec").len());
    assert!(recorded["raw_bytes"].as_u64().unwrap() >= (FRAMES * 4 * 33 * 33) as u64);
    assert!(
        recorded["volume_drift"].as_f64().unwrap().abs() < 1e-6,
        "{recorded}"
    );
    assert!(recorded["wall_seconds"].as_f64().unwrap() > 0.0);

    let info = folder.run(["info", "run.mrec", "--json"]).exits(0).json();
    assert_eq!(info["frames"], FRAMES);
    assert_eq!(info["samples"], json!([33, 33]));
    assert_eq!(info["duration"], 0.5);
    assert_eq!(info["damage"], json!([]));
    assert_eq!(info["closed"], true);
    assert_eq!(info["raw_bytes"], recorded["raw_bytes"]);
    assert_eq!(info["file_bytes"], recorded["file_bytes"]);

    let text = folder.run(["info", "run.mrec"]).exits(0).stdout.clone();
    assert!(text.contains("Tray") && text.contains("33 x 33"), "{text}");
}

#[test]
fn the_duration_can_be_given() {
    let folder = Folder::with_scene();
    for (seconds, frames) in [("0.05", 1), ("0.3", 4), ("1", 11)] {
        let args = [
            "record",
            "scene.toml",
            "-o",
            "run.mrec",
            "--duration",
            seconds,
            "--json",
        ];
        assert_eq!(folder.run(args).exits(0).json()["frames"], frames, "{seconds} s");
    }
}

#[test]
fn recordings_do_not_depend_on_the_number_of_threads() {
    let folder = Folder::with_recording();
    for threads in ["1", "3"] {
        folder
            .run(["record", "scene.toml", "-o", "other.mrec", "--threads", threads])
            .exits(0);
        assert!(
            folder.read("run.mrec") == folder.read("other.mrec"),
            "{threads} threads"
        );
    }
}

#[test]
fn drops_are_not_drift() {
    let folder = Folder::new();
    let drop =
        "[[event]]\nkind = \"drop\"\ntime = 0.1\nposition = [1.0, 1.0]\nradius = 0.2\nvolume = 0.002\n";
    folder.write("scene.toml", format!("{SCENE}\n{drop}"));
    let recorded = folder
        .run(["record", "scene.toml", "-o", "run.mrec", "--json"])
        .exits(0)
        .json();
    let number = |key: &str| recorded[key].as_f64().unwrap();
    assert!((number("volume_added") - 0.002).abs() < 1e-9, "{recorded}");
    // Single precision of the drop's volume and of the surface.
    assert!((number("volume_change") - 0.002).abs() < 2e-8, "{recorded}");
    assert!(number("volume_drift").abs() < 1e-6, "{recorded}");
}

#[test]
fn overrides_reach_the_recording() {
    let folder = Folder::with_scene();
    let args = [
        "record",
        "scene.toml",
        "-o",
        "run.mrec",
        "--set",
        "solver.spacing=0.125",
        "--set",
        "name=\"Coarse\"",
    ];
    folder.run(args).exits(0);
    let info = folder.run(["info", "run.mrec", "--json"]).exits(0).json();
    assert_eq!(info["samples"], json!([17, 17]));
    assert_eq!(info["scene"], "Coarse");
}

#[test]
fn a_damaged_frame_is_a_warning() {
    let folder = Folder::with_recording();
    let mut bytes = folder.read("run.mrec");
    // The frames make up the end of the file; this is in one of the last, before the index.
    let middle = bytes.len() * 3 / 4;
    bytes[middle] ^= 0xff;
    folder.write("hurt.mrec", &bytes);
    let info = folder.run(["info", "hurt.mrec", "--json"]);
    let found = info.exits(0).json();
    assert_eq!(
        found["damage"].as_array().unwrap().len(),
        1,
        "{}",
        info.transcript()
    );
    assert!(
        info.stderr.starts_with("warning: hurt.mrec: "),
        "{}",
        info.transcript()
    );
}

#[test]
fn a_plan_lists_nothing_that_the_scene_does_not_need() {
    let folder = Folder::new();
    // Caustics come from the sun: without one there are none.
    folder.write(
        "scene.toml",
        SCENE.replace("sun = { elevation = 50.0, azimuth = 130.0 }", ""),
    );
    let plan = folder.run(["plan", "scene.toml", "--json"]).exits(0).json();
    let items = |list: &str| plan[list].as_array().unwrap().clone();
    let mentions = |item: &Value, word: &str| item["name"].as_str().unwrap().to_lowercase().contains(word);
    for word in ["object", "bod", "droplet", "caustic", "foam"] {
        assert!(
            !items("runs").iter().any(|item| mentions(item, word)),
            "{word} in {plan:#}"
        );
    }
    for word in ["object", "droplet", "caustic"] {
        assert!(
            items("left_out").iter().any(|item| mentions(item, word)),
            "{word} not in {plan:#}"
        );
    }
    for item in items("left_out") {
        assert_eq!(item["bytes"], 0, "{item}");
        assert!(!item["reason"].as_str().unwrap().is_empty(), "{item}");
    }
    let bytes = |item: &Value| item["bytes"].as_u64().unwrap();
    assert_eq!(
        items("runs").iter().map(bytes).sum::<u64>(),
        plan["total_bytes"].as_u64().unwrap()
    );
    let elevation = items("runs")
        .into_iter()
        .find(|item| item["name"] == "elevation")
        .unwrap();
    assert_eq!(bytes(&elevation), 4 * 33 * 33);
}

#[test]
fn a_plan_lists_what_the_scene_does_need() {
    let folder = Folder::new();
    let object = "[[object]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius = 0.2 }\nposition = [1.0, 0.1, 1.0]\n";
    folder.write("scene.toml", format!("{SCENE}\n{object}"));
    let plan = folder.run(["plan", "scene.toml", "--json"]).exits(0).json();
    let runs = plan["runs"].as_array().unwrap();
    assert!(runs.iter().any(|item| item["name"] == "caustics"), "{plan:#}");
    let objects = runs
        .iter()
        .filter(|item| item["name"].as_str().unwrap().contains("object"));
    assert!(objects.clone().count() > 0, "{plan:#}");
    assert!(
        objects.clone().any(|item| item["bytes"].as_u64().unwrap() > 0),
        "{plan:#}"
    );
    let text = folder.run(["plan", "scene.toml"]).exits(0).stdout.clone();
    assert!(text.contains("left out") && text.contains("total"), "{text}");
}

#[test]
fn a_plan_counts_particles() {
    let folder = Folder::new();
    // 20 by 10 by 5 particles.
    folder.write(
        "scene.toml",
        "name = \"tank\"\ndomain = { size = [0.8, 0.4] }\nterrain = { kind = \"flat\", height = -0.2 }\n\
         solver = { kind = \"sph\", spacing = 0.02, particle = 0.04 }\n\
         recording = { channels = [\"particles\", \"droplets\"] }\n",
    );
    let plan = folder.run(["plan", "scene.toml", "--json"]).exits(0).json();
    let runs = plan["runs"].as_array().unwrap();
    let bytes = |name: &str| runs.iter().find(|i| i["name"] == name).unwrap()["bytes"].as_u64();
    assert_eq!(
        (bytes("particles"), bytes("droplets")),
        (Some(1000 * 28), Some(0)),
        "{plan:#}"
    );
}

#[test]
fn a_check_sums_up_without_running() {
    let folder = Folder::with_scene();
    let report = folder.run(["check", "scene.toml", "--json"]).exits(0).json();
    assert_eq!(report["ok"], true);
    assert_eq!(report["scene"]["samples"], json!([33, 33]));
    assert_eq!(report["scene"]["frames"], FRAMES);
    // Courant limit of the five-point scheme: spacing / (speed √2), speed √(9.81 · 0.25).
    let limit = 0.0625 / ((9.81_f64 * 0.25).sqrt() * 2.0_f64.sqrt());
    let step = report["scene"]["largest_stable_step"].as_f64().unwrap();
    assert!((step / limit - 1.0).abs() < 0.02, "{step} instead of {limit}");
}

#[test]
fn a_check_lists_problems_as_json_too() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE.replace("spacing = 0.0625", "spacing = -1.0"));
    let ended = folder.run(["check", "scene.toml", "--json"]);
    let report = ended.exits(2).json();
    assert_eq!(report["ok"], false);
    assert_eq!(report["scene"], Value::Null);
    assert_eq!(report["problems"][0]["line"], 17);
    assert_eq!(report["problems"][0]["key"], "solver.spacing");
    ended.error_says(&["scene.toml:17:", "solver.spacing"]);
}

#[test]
fn solvers_and_renderers_are_listed() {
    let folder = Folder::new();
    for (command, name) in [
        ("solvers", "wave-equation"),
        ("renderers", "whitted"),
        ("renderers", "path"),
        ("renderers", "photon"),
        ("renderers", "horizon"),
    ] {
        let listed = folder.run([command, "--json"]).exits(0).json();
        let entries = listed[command].as_array().unwrap();
        let entry = entries.iter().find(|entry| entry["name"] == name).unwrap();
        assert_eq!(entry["available"], true);
        assert!(folder.run([command]).exits(0).stdout.contains(name));
    }
}

#[test]
fn every_export_format_writes_something() {
    let folder = Folder::with_recording();
    for format in ["npz", "vtk", "obj", "ply", "glb"] {
        std::fs::create_dir(folder.path(format)).unwrap();
        let out = format!("{format}/run.{format}");
        let args = [
            "export", "run.mrec", "--format", format, "--frames", "1..3", "-o", &out, "--json",
        ];
        let exported = folder.run(args).exits(0).json();
        assert_eq!(exported["frames"], 2, "{format}");
        assert_eq!(exported["damaged_frames"], 0, "{format}");
        let entry = exported["entry"].as_str().unwrap();
        assert!(!folder.read(entry).is_empty(), "{entry}");
    }
}

/// Whoever shortens a scene for a trial need not take its later events out: neither to run it nor to record it.
#[test]
fn a_scene_is_recorded_shorter_than_its_events_last() {
    let folder = Folder::new();
    let drop = "[[event]]\nkind = \"drop\"\ntime = 0.4\nposition = [1.0, 1.0]\nradius = 0.2\nvolume = 1e-4\n";
    folder.write("scene.toml", format!("{SCENE}\n{drop}"));
    let record = ["record", "scene.toml", "--duration", "0.2", "-o", "run.mrec"];
    folder.run(record).exits(0);
    let info = folder.run(["info", "run.mrec", "--json"]).exits(0).json();
    assert_eq!(info["frames"], 3);
    // In a scene file it is a mistake.
    folder.write(
        "short.toml",
        format!("{}\n{drop}", SCENE.replace("duration = 0.5", "duration = 0.2")),
    );
    folder
        .run(["check", "short.toml"])
        .exits(2)
        .error_says(&["short.toml:", "event.0.time", "duration"]);
}

#[cfg(target_os = "linux")] // elsewhere there is always a display
#[test]
fn without_a_display_or_without_the_feature_the_window_says_what_else_there_is() {
    use crate::support::Ended;
    let folder = Folder::with_recording();
    for input in ["run.mrec", "scene.toml"] {
        let mut command = folder.command(["view", input]);
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        let ended = Ended::of(command);
        ended
            .exits(1)
            .error_says(&["window", "meniscus render", "meniscus export"])
            .silent();
    }
}

#[test]
fn studies_are_listed() {
    let folder = Folder::new();
    let listed = folder.run(["study", "--list"]);
    assert!(
        listed.exits(0).stdout.contains("wave-equation"),
        "{}",
        listed.transcript()
    );
}

#[test]
fn a_recording_can_be_read_while_it_grows() {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        SCENE.replace("duration = 0.5", "duration = 100000.0"),
    );
    let _child = folder.start(["record", "scene.toml", "-o", "run.mrec", "--quiet"]);
    wait_until("frames are there", || {
        std::fs::metadata(folder.path("run.mrec")).is_ok_and(|file| file.len() > 50_000)
    });
    let info = folder.run(["info", "run.mrec", "--json"]);
    assert!(info.exits(0).json()["frames"].as_u64().unwrap() > 1);
}
