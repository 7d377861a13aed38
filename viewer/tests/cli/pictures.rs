//! What `meniscus render` draws, and where it puts it.

use crate::support::{Folder, SCENE};
use serde_json::Value;

const SMALL: [&str; 4] = ["--size", "48x27", "--spp", "1"];

/// Renders with [`SMALL`] and the given arguments, and returns what `--json` told.
#[track_caller]
fn render(folder: &Folder, args: &[&str]) -> Value {
    let mut all = vec!["render"];
    all.extend(args);
    all.extend(SMALL);
    all.push("--json");
    folder.run(all).exits(0).json()
}

#[test]
fn a_live_run_and_its_recording_give_the_same_picture() {
    let folder = Folder::with_recording();
    for (at, name) in [("0", "start"), ("0.3", "middle")] {
        for extension in ["png", "exr"] {
            let (live, recorded) = (
                format!("live-{name}.{extension}"),
                format!("recorded-{name}.{extension}"),
            );
            render(&folder, &["scene.toml", "--at", at, "-o", &live]);
            render(&folder, &["run.mrec", "--at", at, "-o", &recorded]);
            assert!(
                folder.read(&live) == folder.read(&recorded),
                "{live} and {recorded} differ"
            );
        }
    }
    assert!(
        folder.read("live-start.png") != folder.read("live-middle.png"),
        "time changes nothing"
    );
}

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let folder = Folder::with_recording();
    render(&folder, &["run.mrec", "-o", "one.exr", "--threads", "1"]);
    render(&folder, &["run.mrec", "-o", "three.exr", "--threads", "3"]);
    assert!(folder.read("one.exr") == folder.read("three.exr"));
}

#[test]
fn without_a_choice_a_still_shows_the_end_of_the_run() {
    let folder = Folder::with_recording();
    for input in ["run.mrec", "scene.toml"] {
        let drawn = render(&folder, &[input, "-o", "end.png"]);
        assert_eq!(drawn["pictures"].as_array().unwrap().len(), 1);
        assert_eq!(drawn["pictures"][0]["frame"], 5, "{input}");
        assert_eq!(drawn["pictures"][0]["time"], 0.5, "{input}");
        assert_eq!(drawn["pictures"][0]["file"], "end.png");
    }
}

#[test]
fn the_frame_nearest_in_time_is_drawn() {
    let folder = Folder::with_recording();
    for input in ["run.mrec", "scene.toml"] {
        for (at, frame) in [("0", 0), ("0.14", 1), ("0.16", 2), ("0.5", 5), ("0.54", 5)] {
            let drawn = render(&folder, &[input, "--at", at, "-o", "out.png"]);
            assert_eq!(drawn["pictures"][0]["frame"], frame, "{input} at {at}");
        }
    }
}

#[test]
fn a_live_run_goes_on_past_its_duration() {
    let folder = Folder::with_scene();
    let drawn = render(&folder, &["scene.toml", "--at", "0.8", "-o", "out.png"]);
    assert_eq!(drawn["pictures"][0]["frame"], 8);
}

#[test]
fn a_range_of_frames_gives_numbered_stills() {
    let folder = Folder::with_recording();
    let drawn = render(&folder, &["run.mrec", "--frames", "2..=3", "-o", "wave.png"]);
    let files: Vec<_> = drawn["pictures"]
        .as_array()
        .unwrap()
        .iter()
        .map(|drawn| &drawn["file"])
        .collect();
    assert_eq!(files, ["wave_000002.png", "wave_000003.png"]);
    assert!(!folder.path("wave.png").exists());
    render(&folder, &["run.mrec", "--at", "0.2", "-o", "single.png"]);
    assert!(folder.read("single.png") == folder.read("wave_000002.png"));
}

#[test]
fn a_gif_holds_every_frame() {
    let folder = Folder::with_recording();
    render(&folder, &["run.mrec", "-o", "wave.gif"]);
    let gif = image::codecs::gif::GifDecoder::new(std::io::Cursor::new(folder.read("wave.gif"))).unwrap();
    assert_eq!(image::AnimationDecoder::into_frames(gif).count(), 6);
}

#[test]
fn an_apng_holds_every_frame() {
    let folder = Folder::with_recording();
    render(&folder, &["run.mrec", "-o", "wave.apng"]);
    let file = std::io::Cursor::new(folder.read("wave.apng"));
    let decoder = image::codecs::png::PngDecoder::new(file).unwrap();
    assert!(decoder.is_apng().unwrap());
    let frames = image::AnimationDecoder::into_frames(decoder.apng().unwrap());
    assert_eq!(frames.filter(Result::is_ok).count(), 6);
}

#[test]
fn exposure_changes_stills_and_not_radiance() {
    let folder = Folder::with_recording();
    for (exposure, name) in [("0", "plain"), ("-2", "dark")] {
        for extension in ["png", "exr"] {
            let out = format!("{name}.{extension}");
            render(&folder, &["run.mrec", "--exposure", exposure, "-o", &out]);
        }
    }
    assert!(folder.read("plain.png") != folder.read("dark.png"));
    assert!(folder.read("plain.exr") == folder.read("dark.exr"));
}

#[test]
fn the_camera_is_the_one_asked_for() {
    let folder = Folder::with_recording();
    render(&folder, &["run.mrec", "-o", "default.png"]);
    render(&folder, &["run.mrec", "--camera", "corner", "-o", "corner.png"]);
    render(&folder, &["run.mrec", "--camera", "auto", "-o", "auto.png"]);
    assert!(folder.read("default.png") == folder.read("corner.png"));
    assert!(folder.read("default.png") != folder.read("auto.png"));
}

#[test]
fn a_damaged_frame_is_left_out_of_a_sequence_and_refused_alone() {
    let folder = Folder::with_recording();
    let mut bytes = folder.read("run.mrec");
    let middle = bytes.len() * 3 / 4;
    bytes[middle] ^= 0xff;
    folder.write("hurt.mrec", &bytes);
    let drawn = render(&folder, &["hurt.mrec", "--frames", "..", "-o", "wave.png"]);
    let skipped = drawn["skipped"].as_array().unwrap();
    assert_eq!(
        (drawn["pictures"].as_array().unwrap().len(), skipped.len()),
        (5, 1),
        "{drawn}"
    );
    let hurt = skipped[0].to_string();
    let alone = folder.run(["render", "hurt.mrec", "--frames", &hurt, "-o", "alone.png"]);
    alone
        .exits(2)
        .error_says(&["hurt.mrec", "frame", &hurt, "damaged"])
        .silent();
}

/// Puts a program called `ffmpeg` on the path that keeps its last argument's file as the bytes that it is given.
#[cfg(unix)]
fn with_ffmpeg(folder: &Folder, script: &str, args: &[&str]) -> crate::support::Ended {
    use std::os::unix::fs::PermissionsExt as _;
    std::fs::create_dir_all(folder.path("bin")).unwrap();
    let ffmpeg = folder.write(
        "bin/ffmpeg",
        format!("#!/bin/sh\nfor out; do :; done\n{script}\n"),
    );
    std::fs::set_permissions(ffmpeg, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = folder.command(args);
    let path = std::env::var("PATH").unwrap();
    command.env("PATH", format!("{}:{path}", folder.path("bin").display()));
    crate::support::Ended::of(command)
}

#[test]
#[cfg(unix)]
fn an_mp4_gets_every_picture_through_ffmpeg() {
    let folder = Folder::with_recording();
    let args = [
        "render", "run.mrec", "--size", "48x28", "--spp", "1", "-o", "wave.mp4",
    ];
    with_ffmpeg(&folder, "cat > \"$out\"", &args).exits(0);
    assert_eq!(folder.read("wave.mp4").len(), 6 * 48 * 28 * 3);
}

#[test]
#[cfg(unix)]
fn a_failing_ffmpeg_is_quoted() {
    let folder = Folder::with_recording();
    let args = [
        "render", "run.mrec", "--size", "48x28", "--spp", "1", "-o", "wave.mp4",
    ];
    let ended = with_ffmpeg(
        &folder,
        "cat > /dev/null; echo 'no such codec' >&2; exit 3",
        &args,
    );
    ended.exits(1).error_says(&["ffmpeg", "no such codec"]).silent();
    let ended = with_ffmpeg(&folder, "echo 'no such codec' >&2; exit 3", &args);
    ended.exits(1).error_says(&["ffmpeg"]).silent();
}

#[test]
fn a_missing_ffmpeg_is_named() {
    let folder = Folder::with_recording();
    let mut command = folder.command(["render", "run.mrec", "--size", "48x28", "-o", "wave.mp4"]);
    command.env("PATH", folder.path("nothing"));
    let ended = crate::support::Ended::of(command);
    ended
        .exits(1)
        .error_says(&["wave.mp4", "ffmpeg", "PATH", ".gif"])
        .silent();
    assert!(!folder.path("wave.mp4").exists());
}

#[test]
fn a_scene_without_cameras_is_drawn_too() {
    let folder = Folder::new();
    let (before, after) = SCENE.split_once("[[camera]]").unwrap();
    let (_, after) = after.split_once("[recording]").unwrap();
    folder.write("scene.toml", format!("{before}[recording]{after}"));
    render(&folder, &["scene.toml", "--at", "0", "-o", "out.png"]);
}

#[test]
fn a_picture_with_noise_is_drawn_until_it_is_quiet() {
    let folder = Folder::with_recording();
    let drawn = |noise: &str| {
        render(
            &folder,
            &[
                "run.mrec",
                "--renderer",
                "path",
                "--noise",
                noise,
                "--time-limit",
                "30",
                "-o",
                "quiet.png",
            ],
        )
    };
    let (coarse, fine) = (drawn("0.2"), drawn("0.05"));
    let of = |value: &Value| {
        (
            value["noise"].as_f64().unwrap(),
            value["samples"].as_u64().unwrap(),
        )
    };
    assert!(of(&coarse).0 <= 0.2 && of(&fine).0 <= 0.05, "{coarse} {fine}");
    assert!(of(&fine).1 > of(&coarse).1);
    assert!(!folder.read("quiet.png").is_empty());
}

#[test]
fn a_renderer_without_noise_refuses_to_draw_until_it_is_quiet() {
    let folder = Folder::with_recording();
    for option in ["--noise", "--time-limit", "--passes"] {
        folder
            .run(["render", "run.mrec", option, "1", "-o", "out.png"])
            .exits(2)
            .error_says(&["--renderer path"]);
    }
}

/// Drawn at once, in two goes, and in as many goes as there are passes: the same file, but for nothing.
#[test]
fn a_picture_that_is_drawn_on_is_that_of_one_run() {
    for renderer in ["path", "photon"] {
        let folder = Folder::with_recording();
        let passes = |passes: &str, out: &str| {
            let args = [
                "run.mrec",
                "--renderer",
                renderer,
                "--passes",
                passes,
                "--resume",
                "-o",
                out,
            ];
            render(&folder, &args)
        };
        let whole = passes("5", "whole.exr");
        assert_eq!(whole["samples"], 5, "{whole}");
        passes("2", "parts.exr");
        assert!(folder.read("whole.exr") != folder.read("parts.exr"));
        let resumed = passes("5", "parts.exr");
        assert_eq!(resumed["samples"], 5, "{resumed}");
        assert!(
            resumed["rays"].as_u64() < whole["rays"].as_u64(),
            "{resumed} {whole}"
        );
        assert!(folder.read("whole.exr") == folder.read("parts.exr"), "{renderer}");
        // Nothing is left to do, and nothing changes.
        let again = passes("3", "parts.exr");
        assert_eq!(again["samples"], 5, "{again}");
        assert!(folder.read("whole.exr") == folder.read("parts.exr"), "{renderer}");
        let refused = |args: &[&str], parts: &[&str]| {
            let mut all = vec![
                "render",
                "run.mrec",
                "--passes",
                "6",
                "--resume",
                "-o",
                "whole.exr",
            ];
            all.extend(SMALL);
            all.extend(args);
            folder.run(all).exits(2).error_says(parts);
        };
        let other = if renderer == "path" { "photon" } else { "path" };
        let not = format!("{renderer}, not {other}");
        refused(&["--renderer", other], &["whole.exr", &not]);
        refused(&["--renderer", renderer, "--at", "0"], &["another scene, frame"]);
    }
}

#[test]
fn an_exr_holds_what_rays_met_where_that_is_asked_for() {
    let folder = Folder::with_recording();
    let out = |name: &str, more: &[&str]| {
        let mut args = vec!["run.mrec", "--at", "0", "-o", name];
        args.extend(more);
        render(&folder, &args);
        folder.read(name).len()
    };
    let plain = out("plain.exr", &[]);
    let more = out("more.exr", &["--auxiliary"]);
    assert!(more > 2 * plain, "{plain} {more}");
    let header = String::from_utf8_lossy(&folder.read("more.exr")[..4096]).into_owned();
    for channel in [
        "water.mask",
        "hit.distance",
        "normal.Y",
        "fresnel",
        "refracted.X",
        "reflected.length",
    ] {
        assert!(header.contains(channel), "{channel}");
    }
    out("path.exr", &["--auxiliary", "--renderer", "path"]);
    assert!(folder.read("path.exr").len() > 2 * plain);
}
