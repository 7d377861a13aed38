//! What goes to which stream, and streams that are closed or full.

use crate::support::{Folder, Running, SCENE};
use std::io::{BufRead as _, BufReader};
use std::process::Stdio;
use std::time::{Duration, Instant};

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
        drop(child.0.stdout.take());
        let ended = child.end();
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
    drop(child.0.stderr.take());
    child.end().exits(0);
    let mut child = folder.start(["record", "nowhere.toml", "-o", "run.mrec"]);
    drop(child.0.stderr.take());
    child.end().exits(2);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_output_is_an_error() {
    let folder = Folder::with_recording();
    let more: [&[&str]; 4] = [
        &["record", "scene.toml", "-o", "again.mrec"],
        &["render", "run.mrec", "--size", "16x9", "-o", "out.png", "--json"],
        &["export", "run.mrec", "--format", "npz", "-o", "out.npz"],
        &["study", "--list"],
    ];
    // Help and version are written by the parser of the command line.
    let results = RESULTS
        .into_iter()
        .filter(|args| args.len() > 1 || args[0] == "renderers");
    for args in results.filter(|args| args[0] != "help").chain(more) {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let mut command = folder.command(args);
        let child = command
            .stdout(Stdio::from(full))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Running(child)
            .end()
            .exits(1)
            .error_says(&["standard output", "No space left"]);
    }
}

/// A run of many hours.
fn endless() -> Folder {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        SCENE.replace("duration = 0.5", "duration = 100000.0"),
    );
    folder
}

#[test]
fn progress_is_plain_lines_where_there_is_no_terminal() {
    let folder = endless();
    let started = Instant::now();
    let mut child = folder.start(["record", "scene.toml", "-o", "run.mrec"]);
    let stderr = BufReader::new(child.0.stderr.take().unwrap());
    for (count, line) in stderr.lines().take(3).enumerate() {
        let line = line.unwrap();
        assert!(
            line.starts_with("recording: ") && line.contains("% (") && line.ends_with(" left"),
            "{line}"
        );
        assert!(
            line.contains(" of 1000001 frames)") && !line.contains('\x1b'),
            "{line}"
        );
        assert!(
            started.elapsed().as_secs() > count as u64,
            "more than a line a second"
        );
    }
}

#[test]
#[cfg(unix)]
fn quiet_shows_no_progress() {
    let folder = endless();
    let child = folder.start(["record", "scene.toml", "-o", "run.mrec", "--quiet"]);
    // Long enough for a line, were there any.
    std::thread::sleep(Duration::from_secs(3));
    child.signal("INT");
    let ended = child.end();
    ended.exits(130);
    assert!(!ended.stderr.contains("recording: "), "{}", ended.transcript());
}
