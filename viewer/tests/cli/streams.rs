//! What goes to which stream, and streams that are closed or full.

use crate::support::{Ended, Folder, SCENE, end};
use std::process::Stdio;

/// Commands that print a result, quick ones.
const RESULTS: [&[&str]; 9] = [
    &["help"],
    &["help", "record"],
    &["--version"],
    &["info", "run.mrec"],
    &["info", "run.mrec", "--json"],
    &["plan", "scene.toml"],
    &["check", "scene.toml", "--json"],
    &["renderers"],
    &["solvers", "--json"],
];

#[test]
fn results_go_to_standard_output_alone() {
    let folder = Folder::with_recording();
    for args in RESULTS {
        let ended = folder.run(args);
        ended.exits(0);
        assert!(!ended.stdout.is_empty(), "{}", ended.transcript());
        assert_eq!(ended.stderr, "", "{}", ended.transcript());
    }
}

#[test]
fn a_closed_standard_output_ends_quietly() {
    let folder = Folder::with_recording();
    let recorded: &[&str] = &["record", "scene.toml", "-o", "again.mrec"];
    for args in RESULTS.into_iter().chain([recorded]) {
        let mut child = folder.start(args);
        drop(child.stdout.take());
        let ended = end(child);
        ended.exits(0);
        assert_eq!(ended.stderr, "", "{args:?}: {}", ended.transcript());
    }
    // What could not be told was done all the same.
    assert_eq!(folder.read("again.mrec"), folder.read("run.mrec"));
}

#[test]
fn a_closed_standard_error_does_not_stop_the_work() {
    let folder = Folder::with_scene();
    let mut child = folder.start(["record", "scene.toml", "-o", "run.mrec", "-vv"]);
    drop(child.stderr.take());
    end(child).exits(0);
    let mut child = folder.start(["record", "nowhere.toml", "-o", "run.mrec"]);
    drop(child.stderr.take());
    end(child).exits(2);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_output_is_an_error() {
    let folder = Folder::with_recording();
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let mut command = folder.command(["info", "run.mrec"]);
    let output = command.stdout(Stdio::from(full)).stderr(Stdio::piped()).spawn().unwrap();
    end(output).exits(1).error_says(&["standard output", "No space left"]);
}

#[test]
fn progress_is_plain_lines_where_there_is_no_terminal() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE.replace("duration = 0.5", "duration = 2000.0"));
    let long = |extra: &[&str]| -> Ended {
        let mut args = vec!["record", "scene.toml", "-o", "run.mrec"];
        args.extend(extra);
        let started = std::time::Instant::now();
        let ended = folder.run(args);
        ended.exits(0);
        let lines = ended.stderr.lines().count() as u64;
        assert!(lines <= started.elapsed().as_secs() + 1, "more than a line a second\n{}", ended.transcript());
        assert!(!ended.stderr.contains(['\r', '\x1b']), "{}", ended.transcript());
        ended
    };
    for line in long(&[]).stderr.lines() {
        assert!(line.starts_with("recording: ") && line.contains("% (") && line.ends_with(" left"), "{line}");
    }
    assert_eq!(long(&["--quiet"]).stderr, "");
}
