//! Runs that stop early: full disks, places that cannot be written, refused steps, Ctrl-C and sudden death.

use crate::support::{Folder, Running, SCENE, Small, wait_for_length, wait_until};
use std::path::Path;
use std::process::Stdio;

/// A run that goes on for hours unless it is stopped, in frames of a few milliseconds.
fn endless() -> Folder {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        SCENE.replace("duration = 0.5", "duration = 100000.0"),
    );
    folder
}

/// Frames of a recording, all of which must be readable.
#[track_caller]
fn whole_frames(folder: &Folder, name: &str) -> u64 {
    let info = folder.run(["info", name, "--json"]).exits(0).json();
    let frames = info["frames"].as_u64().unwrap();
    let exported = folder.run(["export", name, "--format", "npz", "-o", "all.npz"]);
    exported.exits(0);
    frames
}

#[test]
fn ctrl_c_finishes_the_frame_and_closes_the_recording() {
    let folder = endless();
    let child = folder.start(["record", "scene.toml", "-o", "run.mrec", "--json"]);
    wait_for_length(&folder.path("run.mrec"), 100_000);
    child.signal("INT");
    let ended = child.end();
    ended.exits(130).silent();
    assert!(ended.stderr.contains("interrupted; "), "{}", ended.transcript());
    assert!(
        ended.stderr.contains("of 1000001 frames are in run.mrec"),
        "{}",
        ended.transcript()
    );
    assert!(whole_frames(&folder, "run.mrec") > 10);
    // Closed in order: no damage, no missing index.
    let info = folder.run(["info", "run.mrec", "--json"]).exits(0).json();
    assert_eq!(info["damage"], serde_json::json!([]));
    assert_eq!(info["closed"], true);
}

#[test]
fn sudden_death_loses_at_most_the_frame_in_flight() {
    let folder = endless();
    for round in 0..6_u64 {
        // Else the length of the file of the round before would be waited for.
        let _ = std::fs::remove_file(folder.path("run.mrec"));
        // To a file, since a pipe that nobody empties would stop the run.
        let told = std::fs::File::create(folder.path("told.txt")).unwrap();
        let mut command = folder.command(["record", "scene.toml", "-o", "run.mrec", "-vvv"]);
        let child = Running(command.stdout(Stdio::null()).stderr(told).spawn().unwrap());
        wait_for_length(&folder.path("run.mrec"), 100_000 + 20_000 * round);
        std::thread::sleep(std::time::Duration::from_micros(700 * round * round));
        child.signal("KILL");
        assert_eq!(child.end().code, None);
        // Each frame is told when it has been handed over; the last line may be cut.
        let told = String::from_utf8(folder.read("told.txt")).unwrap();
        let handed_over = told.matches(" handed to the recording\n").count() as u64;
        let info = folder.run(["info", "run.mrec", "--json"]).exits(0).json();
        assert_eq!(info["closed"], false);
        let found = whole_frames(&folder, "run.mrec");
        assert!(
            handed_over > 10 && found + 1 >= handed_over,
            "{found} frames of {handed_over} handed over"
        );
    }
}

#[test]
fn a_second_ctrl_c_exits_at_once() {
    let folder = Folder::new();
    // The frame after the first takes 110 000 sub-steps of a million samples, so that it cannot be finished.
    folder.write(
        "scene.toml",
        SCENE
            .replace("rate = 10.0", "rate = 0.01")
            .replace("duration = 0.5", "duration = 200.0")
            .replace("spacing = 0.0625", "spacing = 0.002"),
    );
    let mut child = folder.start(["record", "scene.toml", "-o", "run.mrec"]);
    // The header takes a few kilobytes, the first frame more than one megabyte.
    wait_for_length(&folder.path("run.mrec"), 1_000_000);
    child.signal("INT");
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert!(child.is_running(), "the first Ctrl-C waits for the frame");
    child.signal("INT");
    let ended = child.end();
    ended.exits(130);
    assert!(
        ended.stderr.contains("press Ctrl-C again"),
        "{}",
        ended.transcript()
    );
}

#[test]
fn ctrl_c_while_drawing_keeps_the_finished_pictures() {
    let folder = Folder::with_recording();
    let args = [
        "render", "run.mrec", "--frames", "0..6", "--size", "640x360", "--spp", "64", "-o", "wave.png",
    ];
    let child = folder.start(args);
    wait_until("the first picture is there", || {
        image_opens(&folder.path("wave_000000.png"))
    });
    child.signal("INT");
    let ended = child.end();
    ended.exits(130).silent();
    assert!(ended.stderr.contains("interrupted; "), "{}", ended.transcript());
    for index in 0..6 {
        let path = folder.path(&format!("wave_{index:06}.png"));
        assert!(
            !path.exists() || image_opens(&path),
            "{} is not whole",
            path.display()
        );
    }
}

#[test]
fn ctrl_c_keeps_the_passes_of_an_exr_and_they_can_be_drawn_on() {
    let folder = Folder::with_recording();
    let args = |passes: &'static str, out: &'static str| {
        [
            "render",
            "run.mrec",
            "--renderer",
            "path",
            "--size",
            "64x36",
            "--spp",
            "1",
            "--passes",
            passes,
            "--resume",
            "-o",
            out,
        ]
    };
    // A first picture to draw on, so that the next run has something to keep however soon it is stopped.
    folder.run(args("2", "stopped.exr")).exits(0);
    let child = folder.start(args("1000000", "stopped.exr"));
    std::thread::sleep(std::time::Duration::from_millis(400));
    child.signal("INT");
    let ended = child.end();
    ended.exits(130).silent();
    assert!(
        ended.stderr.contains("--resume draws on"),
        "{}",
        ended.transcript()
    );
    let drawn = folder.run(args("1", "stopped.exr")).exits(0).stdout.clone();
    assert!(drawn.contains("samples a pixel"), "{drawn}");
}

fn image_opens(path: &Path) -> bool {
    std::fs::read(path).is_ok_and(|bytes| bytes.ends_with(b"IEND\xae\x42\x60\x82"))
}

#[test]
fn a_full_device_is_told() {
    let folder = Folder::with_recording();
    if !Path::new("/dev/full").exists() {
        println!("left out: this system has no /dev/full");
        return;
    }
    for args in [
        &["record", "scene.toml", "-o", "/dev/full"][..],
        &["export", "run.mrec", "--format", "npz", "-o", "/dev/full"],
    ] {
        folder
            .run(args)
            .exits(1)
            .error_says(&["/dev/full", "No space left on device"])
            .silent();
    }
}

#[test]
fn a_disk_that_fills_up_keeps_what_was_finished() {
    let folder = endless();
    folder.write("short.toml", SCENE);
    folder.run(["record", "short.toml", "-o", "short.mrec"]).exits(0);
    let path = folder.path("disk");
    let Some(_disk) = Small::mount(&path, "256k") else {
        println!("left out: this user may not mount a file system");
        return;
    };
    let ended = folder.run(["record", "scene.toml", "-o", "disk/run.mrec"]);
    ended
        .exits(1)
        .error_says(&["disk/run.mrec", "No space left on device"])
        .silent();
    assert!(whole_frames(&folder, "disk/run.mrec") > 10);

    // The disk is full now. Nothing else fits, and nothing half is left.
    for name in ["wave.png", "wave.exr", "wave.gif"] {
        let out = format!("disk/{name}");
        let ended = folder.run([
            "render",
            "short.mrec",
            "--size",
            "640x360",
            "--spp",
            "1",
            "-o",
            &out,
        ]);
        ended
            .exits(1)
            .error_says(&[name, "No space left on device"])
            .silent();
    }
    for format in ["npz", "vtk", "obj", "ply", "glb"] {
        let out = format!("disk/out.{format}");
        let ended = folder.run(["export", "short.mrec", "--format", format, "-o", &out]);
        ended
            .exits(1)
            .error_says(&["disk/out", "No space left on device"])
            .silent();
    }
    let left: Vec<_> = std::fs::read_dir(&path)
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(left, ["run.mrec"]);
}

#[test]
fn places_that_cannot_be_written_are_told_before_the_work() {
    let folder = endless();
    folder.write("short.toml", SCENE);
    folder.run(["record", "short.toml", "-o", "short.mrec"]).exits(0);
    for args in [
        // An endless run: that it ends at all shows that nothing was simulated first.
        &["record", "scene.toml", "-o", "nowhere/run.mrec"][..],
        &["render", "scene.toml", "-o", "nowhere/out.png"],
        &["render", "scene.toml", "-o", "nowhere/out.gif"],
        &["export", "short.mrec", "--format", "npz", "-o", "nowhere/out.npz"],
        &["export", "short.mrec", "--format", "vtk", "-o", "nowhere/out.vtk"],
    ] {
        folder
            .run(args)
            .exits(1)
            .error_says(&["nowhere", "No such file"])
            .silent();
    }
}

#[test]
fn a_step_that_fails_keeps_the_frames_before() {
    let folder = Folder::new();
    // Frames a day apart take more sub-steps than any solver takes at once.
    let scene = SCENE
        .replace("rate = 10.0", "rate = 0.00001")
        .replace("duration = 0.5", "duration = 200000.0");
    folder.write("scene.toml", scene);
    let parts = [
        "frame 1 at t = 27 h 47 min",
        "step of 100000 s",
        "sub-steps",
        "coarser spacing",
    ];
    let recorded = folder.run(["record", "scene.toml", "-o", "run.mrec"]);
    recorded
        .exits(1)
        .error_says(&parts)
        .error_says(&["1 frame kept in run.mrec"])
        .silent();
    assert_eq!(whole_frames(&folder, "run.mrec"), 1);
    let drawn = folder.run(["render", "scene.toml", "-o", "out.png"]);
    drawn.exits(1).error_says(&parts).silent();
    assert!(!folder.path("out.png").exists());
}

#[test]
fn an_event_that_cannot_act_keeps_the_frames_before() {
    let folder = Folder::new();
    let flood =
        "[[event]]\nkind = \"drop\"\ntime = 0.25\nposition = [1.0, 1.0]\nradius = 0.01\nvolume = 1e9\n";
    folder.write("scene.toml", format!("{SCENE}\n{flood}"));
    let recorded = folder.run(["record", "scene.toml", "-o", "run.mrec"]);
    recorded
        .exits(1)
        .error_says(&["frame 3", "3 frames kept in run.mrec", "`drop`", "volume"])
        .silent();
    assert_eq!(whole_frames(&folder, "run.mrec"), 3);
}
