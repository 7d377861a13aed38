//! Wrong input of every command: the message says what, where and what would be right, and the exit code is 2.

use crate::support::{Folder, SCENE, crc32, npy};

/// The commands that read a scene, each with what it needs besides.
const SCENE_COMMANDS: [&[&str]; 4] = [
    &["check"],
    &["plan"],
    &["record", "-o", "out.mrec"],
    &["render", "--size", "16x9", "-o", "out.png"],
];

/// The commands that read a recording, each with what it needs besides.
const RECORDING_COMMANDS: [&[&str]; 4] = [
    &["info"],
    &["render", "--size", "16x9", "-o", "out.png"],
    &["view"],
    &["export", "--format", "npz", "-o", "out.npz"],
];

/// The command with `input` as its first argument.
fn with_input<'a>(command: &[&'a str], input: &'a str) -> Vec<&'a str> {
    let mut args = command.to_vec();
    args.insert(1, input);
    args
}

/// Every command that reads a scene refuses `input` with exit code 2 and one line that holds all of `parts`, and
/// leaves nothing behind.
#[track_caller]
fn every_scene_command_refuses(folder: &Folder, input: &str, parts: &[&str]) {
    for command in SCENE_COMMANDS {
        refuses(folder, &with_input(command, input), parts);
    }
}

#[track_caller]
fn every_recording_command_refuses(folder: &Folder, input: &str, parts: &[&str]) {
    for command in RECORDING_COMMANDS {
        refuses(folder, &with_input(command, input), parts);
    }
}

#[track_caller]
fn refuses(folder: &Folder, args: &[&str], parts: &[&str]) {
    folder.run(args).exits(2).error_says(parts).silent();
    for output in ["out.mrec", "out.png", "out.gif", "out.npz"] {
        assert!(!folder.path(output).exists(), "{args:?} left {output} behind");
    }
}

/// A folder with a scene that differs from [`SCENE`] in one place.
fn altered(old: &str, new: &str) -> Folder {
    assert!(SCENE.contains(old), "{old}");
    let folder = Folder::new();
    folder.write("scene.toml", SCENE.replace(old, new));
    folder
}

#[test]
fn missing_files_are_named() {
    let folder = Folder::new();
    every_scene_command_refuses(&folder, "nowhere.toml", &["nowhere.toml", "no such file"]);
    every_recording_command_refuses(&folder, "nowhere.mrec", &["nowhere.mrec", "No such file"]);
}

#[test]
fn directories_are_not_files() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("dir.toml")).unwrap();
    std::fs::create_dir(folder.path("dir.mrec")).unwrap();
    every_scene_command_refuses(&folder, "dir.toml", &["dir.toml", "directory"]);
    every_recording_command_refuses(&folder, "dir.mrec", &["dir.mrec", "directory"]);
}

#[test]
fn empty_files_are_refused() {
    let folder = Folder::new();
    folder.write("empty.toml", "");
    folder.write("empty.mrec", "");
    every_scene_command_refuses(&folder, "empty.toml", &["empty.toml"]);
    every_recording_command_refuses(&folder, "empty.mrec", &["empty.mrec", "empty"]);
}

#[test]
fn text_is_not_a_recording_and_a_recording_is_not_a_scene() {
    let folder = Folder::with_recording();
    folder.write("notes.mrec", "Dear diary, the waves were high today.\n");
    every_recording_command_refuses(&folder, "notes.mrec", &["notes.mrec", "not a recording"]);
    std::fs::copy(folder.path("run.mrec"), folder.path("run.toml")).unwrap();
    every_scene_command_refuses(&folder, "run.toml", &["run.toml"]);
}

#[test]
fn recordings_of_a_newer_version_are_refused() {
    let folder = Folder::with_recording();
    let mut bytes = folder.read("run.mrec");
    // Magic, version, flags and their checksum, docs/recording-format.md.
    assert_eq!(bytes[8..12], 2_u32.to_le_bytes());
    bytes[8..12].copy_from_slice(&99_u32.to_le_bytes());
    let crc = crc32(&bytes[..16]);
    bytes[16..20].copy_from_slice(&crc.to_le_bytes());
    folder.write("newer.mrec", bytes);
    every_recording_command_refuses(&folder, "newer.mrec", &["newer.mrec", "99", "newer"]);
}

#[test]
fn a_recording_without_a_whole_header_is_refused() {
    let folder = Folder::with_recording();
    let bytes = folder.read("run.mrec");
    folder.write("cut.mrec", &bytes[..40]);
    every_recording_command_refuses(&folder, "cut.mrec", &["cut.mrec", "header"]);
}

#[test]
fn an_array_with_nan_is_refused_with_its_place() {
    let folder = altered(
        r#"initial = { kind = "disturbance", position = [1.0, 1.0], radius = 0.2, height = 0.03 }"#,
        r#"initial = { kind = "array", file = "start.npy" }"#,
    );
    let mut values = vec![0.0; 33 * 33];
    folder.write("start.npy", npy(&[33, 33], &values));
    folder.run(["check", "scene.toml"]).exits(0);
    values[33 * 5 + 7] = f32::NAN;
    folder.write("start.npy", npy(&[33, 33], &values));
    every_scene_command_refuses(&folder, "scene.toml", &["start.npy", "NaN"]);
}

#[test]
fn terrain_with_nan_is_refused() {
    let folder = altered(
        "kind = \"flat\"\nheight = -0.25",
        "kind = \"npy\"\nfile = \"bed.npy\"\npixel_size = [0.5, 0.5]",
    );
    let mut values = vec![-0.25; 25];
    folder.write("bed.npy", npy(&[5, 5], &values));
    folder.run(["check", "scene.toml"]).exits(0);
    values[12] = f32::NAN;
    folder.write("bed.npy", npy(&[5, 5], &values));
    every_scene_command_refuses(&folder, "scene.toml", &["bed.npy", "NaN"]);
}

#[test]
fn a_damaged_array_is_refused() {
    let folder = altered(
        r#"initial = { kind = "disturbance", position = [1.0, 1.0], radius = 0.2, height = 0.03 }"#,
        r#"initial = { kind = "array", file = "start.npy" }"#,
    );
    every_scene_command_refuses(&folder, "scene.toml", &["start.npy"]);
    folder.write("start.npy", "no array");
    every_scene_command_refuses(&folder, "scene.toml", &["start.npy"]);
    folder.write("start.npy", &npy(&[33, 33], &[0.0; 33 * 33])[..400]);
    every_scene_command_refuses(&folder, "scene.toml", &["start.npy"]);
}

#[test]
fn a_grid_without_samples_is_refused_with_its_line() {
    every_scene_command_refuses(
        &altered("size = [2.0, 2.0]", "size = [0.0, 2.0]"),
        "scene.toml",
        &["scene.toml:6:", "domain.size"],
    );
    every_scene_command_refuses(
        &altered("spacing = 0.0625", "spacing = 0.0"),
        "scene.toml",
        &["scene.toml:17:", "solver.spacing"],
    );
}

#[test]
fn a_grid_of_too_many_samples_is_refused() {
    every_scene_command_refuses(
        &altered("spacing = 0.0625", "spacing = 0.00001"),
        "scene.toml",
        &["spacing"],
    );
}

#[test]
#[cfg(target_os = "linux")]
fn an_image_too_large_for_memory_is_refused_with_both_figures() {
    let folder = Folder::with_recording();
    let ended =
        folder.shell("ulimit -v 2000000; meniscus render run.mrec --size 16384x16384 --threads 2 -o out.png");
    ended
        .exits(2)
        .error_says(&["16384x16384", "3.75 GiB", "of memory can be had", "--size"])
        .silent();
}

#[test]
fn a_gif_that_no_viewer_can_show_is_refused() {
    let folder = Folder::with_recording();
    refuses(
        &folder,
        &["render", "run.mrec", "--speed", "100", "-o", "out.gif"],
        &["out.gif", "1000 frames a second", "--speed"],
    );
}

/// A grid that is allowed, but for which this process may not have the memory.
#[test]
#[cfg(target_os = "linux")]
fn a_grid_too_large_for_memory_is_refused_with_both_figures() {
    let folder = altered("spacing = 0.0625", "spacing = 0.00015");
    for command in SCENE_COMMANDS {
        let args = with_input(command, "scene.toml").join(" ");
        // 13 334² samples: three arrays take 2.0 GiB. Two threads, since each takes address space for its stack.
        let ended = folder.shell(&format!("ulimit -v 2000000; meniscus {args} --threads 2"));
        ended
            .exits(2)
            .error_says(&[
                "13334 x 13334 samples",
                "GiB",
                "of memory can be had",
                "solver.spacing",
            ])
            .silent();
    }
}

#[test]
fn a_step_above_the_stability_limit_is_refused() {
    every_scene_command_refuses(
        &altered("spacing = 0.0625", "spacing = 0.0625\nstep = 0.09"),
        "scene.toml",
        &["scene.toml:18: solver.step:", "0.09", "limit of 2.82", "implicit"],
    );
}

/// What only the solver finds wrong is told with file and line of its key, as everything else is.
#[test]
fn problems_of_every_solver_are_told_with_their_line() {
    let still = SCENE
        .replace(
            r#"initial = { kind = "disturbance", position = [1.0, 1.0], radius = 0.2, height = 0.03 }"#,
            r#"initial = { kind = "still" }"#,
        )
        .replace(
            "kind = \"wave-equation\"\nspacing = 0.0625",
            "kind = \"procedural\"\nspacing = 0.0625",
        );
    let waves = |first: &str, second: &str| {
        let list = format!(
            "\n\n[[solver.wave]]\namplitude = 0.05\nwavelength = {first}\n\n\
             [[solver.wave]]\namplitude = {second}\nwavelength = 1.0\nsteepness = 1.0\n"
        );
        still.replace("spacing = 0.0625", &format!("spacing = 0.0625{list}"))
    };
    let shallow = SCENE.replace("\"wave-equation\"", "\"shallow-water\"");
    let bodiless = shallow.replace("[terrain]\nkind = \"flat\"\nheight = -0.25\n", "");
    for (name, scene, parts) in [
        (
            "a wave too short for the grid",
            waves("0.1", "0.01"),
            &["scene.toml:21: solver.wave.0.wavelength:", "0.1"][..],
        ),
        (
            "waves that fold over",
            waves("2.0", "0.2"),
            &["solver.wave:", "steepness"],
        ),
        (
            "waves that start from something",
            SCENE.replace("\"wave-equation\"", "\"procedural\""),
            &["scene.toml:9: water.initial:", "procedural"],
        ),
        (
            "shallow water without ground",
            bodiless,
            &["scene.toml:13: solver.kind:", "ground"],
        ),
    ] {
        let folder = Folder::new();
        folder.write("scene.toml", scene);
        println!("{name}");
        every_scene_command_refuses(&folder, "scene.toml", &[&["scene.toml:"], parts].concat());
    }
}

/// A value that came from the command line has no line; its override is named instead.
#[test]
fn problems_of_a_solver_name_the_override_that_made_them() {
    let folder = Folder::with_scene();
    for command in SCENE_COMMANDS {
        let mut args = with_input(command, "scene.toml");
        args.extend(["--set", "solver.step=0.09"]);
        refuses(
            &folder,
            &args,
            &[
                "scene.toml: solver.step:",
                "limit of 2.82",
                "`--set solver.step=0.09`",
            ],
        );
    }
}

#[test]
fn unknown_keys_are_told_with_their_line() {
    every_scene_command_refuses(
        &altered("spacing = 0.0625", "spacing = 0.0625\nspeeed = 2.0"),
        "scene.toml",
        &["scene.toml:18:", "speeed"],
    );
}

#[test]
fn all_problems_are_told_one_a_line() {
    let scene = SCENE
        .replace("spacing = 0.0625", "spacing = -1.0")
        .replace("rate = 10.0", "rate = 0.0\ncolour = 1")
        .replace("elevation = 50.0", "elevation = 500.0");
    let folder = Folder::new();
    folder.write("scene.toml", scene);
    for command in SCENE_COMMANDS {
        let ended = folder.run(with_input(command, "scene.toml"));
        ended
            .exits(2)
            .error_says(&["scene.toml:17:", "solver.spacing", "-1"])
            .error_says(&["scene.toml:20:", "light.sun.elevation", "500"])
            .error_says(&["scene.toml:28:", "recording.rate"])
            .error_says(&["scene.toml:29:", "colour"])
            .silent();
        assert!(
            ended
                .stderr
                .lines()
                .all(|line| line.starts_with("error: scene.toml:")),
            "{}",
            ended.transcript()
        );
    }
}

#[test]
fn bad_overrides_are_told() {
    let folder = Folder::with_scene();
    for (set, parts) in [
        ("solver.spacing", ["--set", "solver.spacing"]),
        ("solver.spacing=wide", ["--set", "solver.spacing"]),
        ("solver.speeed=1", ["--set", "speeed"]),
        ("=1", ["--set", "=1"]),
    ] {
        for command in SCENE_COMMANDS {
            let mut args = with_input(command, "scene.toml");
            args.extend(["--set", set]);
            refuses(&folder, &args, &parts);
        }
    }
}

#[test]
fn overrides_do_not_apply_to_recordings() {
    let folder = Folder::with_recording();
    for command in [&["render", "-o", "out.png"][..], &["view"]] {
        let mut args = with_input(command, "run.mrec");
        args.extend(["--set", "water.level=1"]);
        refuses(&folder, &args, &["--set", "run.mrec", "record it again"]);
    }
    // Nor without any file.
    refuses(
        &folder,
        &["view", "--set", "water.level=1"],
        &["--set", "scene file"],
    );
}

#[test]
fn wrong_arguments_of_render_are_told() {
    let folder = Folder::with_recording();
    let cases: &[(&[&str], &[&str])] = &[
        (&["--size", "big"], &["--size", "1280x720"]),
        (&["--size", "0x10"], &["--size", "from 1 to 16384"]),
        (&["--size", "99999x10"], &["--size", "from 1 to 16384"]),
        (&["--spp", "0"], &["--spp"]),
        (&["--speed", "0"], &["--speed"]),
        (&["--exposure", "nan"], &["--exposure", "finite"]),
        (&["--at", "-1"], &["--at", "from 0 on"]),
        (&["--at", "100"], &["--at 100", "ends at 0.5 s"]),
        (&["--at", "0", "--frames", "0"], &["--at", "--frames"]),
        (&["--frames", "4..2"], &["4..2"]),
        (&["--frames", "0..99"], &["--frames", "frames 0 to 5 are there"]),
        (&["--frames", "6"], &["--frames", "frames 0 to 5 are there"]),
        (&["--camera", "nobody"], &["nobody", "corner"]),
        (&["--renderer", "crayon"], &["crayon", "whitted"]),
        (&["--passes", "0", "--renderer", "path"], &["--passes"]),
        (
            &["--resume", "--renderer", "path"],
            &["--resume", "--passes, --noise or --time-limit"],
        ),
        (
            &["--resume", "--passes", "2", "--renderer", "path"],
            &["--resume", ".exr"],
        ),
        (&["--auxiliary"], &["--auxiliary", ".exr"]),
        (&["--threads", "0"], &["--threads"]),
    ];
    for (extra, parts) in cases {
        let mut args = vec!["render", "run.mrec", "-o", "out.png"];
        args.extend(*extra);
        refuses(&folder, &args, parts);
    }
    refuses(&folder, &["render", "run.mrec"], &["--out"]);
    refuses(
        &folder,
        &["render", "run.mrec", "-o", "out.jpg"],
        &["out.jpg", ".png, .exr, .gif, .apng or .mp4"],
    );
    refuses(
        &folder,
        &["render", "run.mrec", "-o", "out.mp4", "--size", "15x9"],
        &["out.mp4", "15 x 9", "even"],
    );
}

#[test]
fn wrong_arguments_of_the_other_commands_are_told() {
    let folder = Folder::with_recording();
    let cases: &[(&[&str], &[&str])] = &[
        (&["record", "scene.toml"], &["--out"]),
        (
            &["record", "scene.toml", "-o", "out.mrec", "--duration", "-2"],
            &["--duration", "from 0 on"],
        ),
        (
            &["record", "scene.toml", "-o", "out.mrec", "--duration", "soon"],
            &["--duration"],
        ),
        (
            &["plan", "scene.toml", "--renderer", "crayon"],
            &["crayon", "whitted"],
        ),
        (&["plan", "scene.toml", "--size", "1"], &["--size"]),
        (
            &["export", "run.mrec", "--format", "xls", "-o", "out.npz"],
            &["xls", "npz"],
        ),
        (&["export", "run.mrec", "--format", "npz"], &["--out"]),
        (
            &[
                "export", "run.mrec", "--format", "npz", "--frames", "9", "-o", "out.npz",
            ],
            &["--frames", "frames 0 to 5 are there"],
        ),
        (
            &["study", "no-such-study", "-o", "studies"],
            &["no-such-study", "wave-equation"],
        ),
        (&["study", "wave-equation"], &["--out"]),
        (&["splash"], &["splash"]),
    ];
    for (args, parts) in cases {
        refuses(&folder, args, parts);
    }
}

#[test]
fn outputs_that_name_a_directory_are_refused() {
    let folder = Folder::with_recording();
    for name in ["taken.png", "taken.npz", "taken.pvd"] {
        std::fs::create_dir(folder.path(name)).unwrap();
    }
    for (args, name) in [
        (&["record", "scene.toml", "-o", "taken.png"][..], "taken.png"),
        (&["render", "run.mrec", "-o", "taken.png"], "taken.png"),
        (
            &["export", "run.mrec", "--format", "npz", "-o", "taken"],
            "taken.npz",
        ),
        (
            &["export", "run.mrec", "--format", "vtk", "-o", "taken"],
            "taken.pvd",
        ),
    ] {
        folder
            .run(args)
            .exits(2)
            .error_says(&[name, "is a directory"])
            .silent();
    }
}

#[test]
fn an_input_is_never_overwritten() {
    let folder = Folder::with_recording();
    // The name of a recording is the user's choice.
    std::fs::rename(folder.path("run.mrec"), folder.path("run.npz")).unwrap();
    let before = (folder.read("scene.toml"), folder.read("run.npz"));
    for args in [
        &["record", "scene.toml", "-o", "./scene.toml"][..],
        &["export", "run.npz", "--format", "npz", "-o", "./run.npz"],
    ] {
        folder
            .run(args)
            .exits(2)
            .error_says(&["would be overwritten"])
            .silent();
    }
    assert!(before == (folder.read("scene.toml"), folder.read("run.npz")));
}
