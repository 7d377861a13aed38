//! Outputs of the commands that write many files: `demo`, `study` and `export`, where they cannot be written, where the
//! disk is full, and after Ctrl-C. The others stand in `stops`.

use crate::support::{Folder, Running, SCENE, Small, wait_for_length, wait_until};
use std::fs::File;
use std::path::Path;
use std::process::Stdio;

/// The command under way, with its standard error in a file.
fn start(folder: &Folder, args: &[&str], told: &str) -> Running {
    let told = File::create(folder.path(told)).unwrap();
    let mut command = folder.command(args);
    Running(command.stdout(Stdio::piped()).stderr(told).spawn().unwrap())
}

fn names(path: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(path).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_file_in_place_of_the_output_folder_is_told_before_the_work() {
    let folder = Folder::new();
    folder.write("taken", "a file");
    for args in [
        &["demo", "--out", "taken"][..],
        &["study", "wave-equation", "-o", "taken"],
    ] {
        folder.run(args).exits(1).error_says(&["taken"]).silent();
    }
    assert_eq!(folder.read("taken"), b"a file");
}

#[test]
fn a_demo_on_a_full_disk_says_so() {
    let folder = Folder::new();
    let path = folder.path("disk");
    let Some(_disk) = Small::mount(&path, "64k") else {
        println!("left out: this user may not mount a file system");
        return;
    };
    let ended = folder.run(["demo", "--out", "disk"]);
    ended
        .exits(1)
        .error_says(&["disk/data", "No space left on device", "--out"])
        .silent();
}

#[test]
fn a_demo_that_is_interrupted_keeps_its_frames() {
    let folder = Folder::new();
    let child = start(&folder, &["demo", "--out", "demo"], "told.txt");
    wait_for_length(&folder.path("demo/valley.mrec"), 400_000);
    child.signal("INT");
    child.end().exits(130).silent();
    let told = String::from_utf8(folder.read("told.txt")).unwrap();
    assert!(told.contains("interrupted; "), "{told}");
    let info = folder.run(["info", "demo/valley.mrec", "--json"]).exits(0).json();
    assert!(
        info["frames"].as_u64().unwrap() >= 1 && info["closed"] == true,
        "{info}"
    );
}

#[test]
fn a_study_that_is_interrupted_writes_what_it_has() {
    let folder = Folder::new();
    let child = start(
        &folder,
        &["study", "stability", "--quick", "-o", "results"],
        "told.txt",
    );
    wait_for_length(&folder.path("told.txt"), 1);
    child.signal("INT");
    child.end().exits(130);
    let told = String::from_utf8(folder.read("told.txt")).unwrap();
    assert!(told.contains("interrupted; "), "{told}");
    assert!(names(&folder.path("results")).contains(&"report.html".to_owned()));
}

#[test]
fn a_study_on_a_full_disk_says_so() {
    let folder = Folder::new();
    let path = folder.path("disk");
    let Some(_disk) = Small::mount(&path, "4k") else {
        println!("left out: this user may not mount a file system");
        return;
    };
    // Interrupted at once, so that it has little to measure and writes.
    let child = start(
        &folder,
        &["study", "stability", "--quick", "-o", "disk"],
        "told.txt",
    );
    wait_for_length(&folder.path("told.txt"), 1);
    child.signal("INT");
    child.end().exits(1).silent();
    let told = String::from_utf8(folder.read("told.txt")).unwrap();
    let error = told
        .lines()
        .find(|line| line.starts_with("error: "))
        .unwrap_or_default();
    assert!(
        error.contains("disk/") && error.contains("No space left on device"),
        "{told}"
    );
}

#[test]
fn an_export_that_is_interrupted_leaves_only_whole_files() {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        SCENE.replace("duration = 0.5", "duration = 100000.0"),
    );
    let child = folder.start(["record", "scene.toml", "-o", "run.mrec", "--quiet"]);
    wait_for_length(&folder.path("run.mrec"), 2_000_000);
    child.signal("INT");
    child.end().exits(130);
    std::fs::create_dir(folder.path("out")).unwrap();
    let args = ["export", "run.mrec", "--format", "obj", "-o", "out/wave.obj"];
    let child = start(&folder, &args, "told.txt");
    wait_until("the first files are there", || {
        names(&folder.path("out")).len() > 3
    });
    child.signal("INT");
    child.end().exits(130).silent();
    let told = String::from_utf8(folder.read("told.txt")).unwrap();
    assert!(told.contains("interrupted; ") && told.contains("whole"), "{told}");
    let left = names(&folder.path("out"));
    assert!(
        !left.is_empty()
            && left
                .iter()
                .all(|name| name.ends_with(".obj") && !name.starts_with('.')),
        "{left:?}"
    );
}
