//! `docs/command-line.md` says what the commands do: every command, every option, every JSON key.

use crate::support::{Folder, SCENE};
use clap::CommandFactory as _;
use serde_json::Value;
use std::collections::BTreeSet;

const PAGE: &str = include_str!("../../../docs/command-line.md");

#[test]
fn every_command_and_option_is_described() {
    let command = meniscus::cli::Cli::command();
    let described = |name: &str| PAGE.contains(&format!("`{name} ")) || PAGE.contains(&format!("{name}`"));
    for command in command.get_subcommands() {
        assert!(described(command.get_name()), "{}", command.get_name());
        // The row of the command in the table of commands.
        let start = format!("`{} ", command.get_name());
        let row = PAGE
            .lines()
            .find(|line| line.starts_with('|') && line.contains(&start))
            .unwrap();
        for option in command.get_arguments().filter_map(|argument| argument.get_long()) {
            let short = command
                .get_arguments()
                .find(|argument| argument.get_long() == Some(option));
            let short = short
                .and_then(clap::Arg::get_short)
                .map(|short| format!(" -{short} "));
            let found =
                row.contains(&format!("--{option}")) || short.is_some_and(|short| row.contains(&short));
            assert!(found || option == "help", "--{option} of {}", command.get_name());
        }
    }
    for option in command.get_arguments().filter_map(|argument| argument.get_long()) {
        assert!(
            PAGE.contains(&format!("`--{option}")) || option == "help",
            "--{option}"
        );
    }
}

/// The keys that the page lists under the heading for `command`.
fn documented(command: &str) -> BTreeSet<String> {
    let (_, section) = PAGE.split_once(&format!("\n### `{command}`\n")).unwrap();
    let section = section.split("\n### ").next().unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let keys = rows.flat_map(|row| row.split('|').nth(1).unwrap().split(','));
    keys.map(|key| key.trim().trim_matches('`').to_owned()).collect()
}

/// The keys of what was printed, as the page writes them.
fn keys(value: &Value, prefix: &str, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                keys(
                    value,
                    &if prefix.is_empty() {
                        key.clone()
                    } else {
                        format!("{prefix}.{key}")
                    },
                    found,
                );
            }
        }
        Value::Array(list) if list.iter().any(Value::is_object) => {
            list.iter()
                .for_each(|value| keys(value, &format!("{prefix}[]"), found));
        }
        // An empty list says nothing about what would be in it.
        Value::Array(list) if list.is_empty() => {}
        _ => {
            found.insert(prefix.to_owned());
        }
    }
}

/// The page lists exactly the keys that these command lines print between them; of lists that are always empty, the
/// keys in `unseen`.
#[track_caller]
fn prints_what_is_documented(folder: &Folder, command: &str, lines: &[&[&str]], unseen: &[&str]) {
    let mut found: BTreeSet<String> = unseen.iter().map(|key| (*key).to_owned()).collect();
    for args in lines {
        keys(&folder.run(*args).json(), "", &mut found);
    }
    assert_eq!(found, documented(command), "{command}");
}

#[test]
fn json_output_has_the_documented_keys_and_no_others() {
    let folder = Folder::new();
    let drop =
        "[[event]]\nkind = \"drop\"\ntime = 0.1\nposition = [1.0, 1.0]\nradius = 0.2\nvolume = 0.002\n";
    folder.write("scene.toml", format!("{SCENE}channels = [\"depth\"]\n{drop}"));
    folder.write("bad.toml", SCENE.replace("spacing = 0.0625", "spacing = -1.0"));
    let record: &[&str] = &["record", "scene.toml", "-o", "run.mrec", "--json"];
    prints_what_is_documented(&folder, "record --json", &[record], &[]);

    let mut bytes = folder.read("run.mrec");
    let middle = bytes.len() * 3 / 4;
    bytes[middle] ^= 0xff;
    folder.write("hurt.mrec", &bytes);
    let (whole, hurt): (&[&str], &[&str]) =
        (&["info", "run.mrec", "--json"], &["info", "hurt.mrec", "--json"]);
    prints_what_is_documented(&folder, "info --json", &[whole, hurt], &[]);

    let render: &[&str] = &[
        "render",
        "hurt.mrec",
        "--frames",
        "..",
        "--size",
        "16x9",
        "-o",
        "out.png",
        "--json",
    ];
    prints_what_is_documented(&folder, "render --json", &[render], &[]);
    let export: &[&str] = &[
        "export",
        "hurt.mrec",
        "--format",
        "npz",
        "-o",
        "out.npz",
        "--json",
    ];
    prints_what_is_documented(&folder, "export --json", &[export], &[]);
    prints_what_is_documented(&folder, "plan --json", &[&["plan", "scene.toml", "--json"]], &[]);
    let (good, bad): (&[&str], &[&str]) = (
        &["check", "scene.toml", "--json"],
        &["check", "bad.toml", "--json"],
    );
    prints_what_is_documented(&folder, "check --json", &[good, bad], &[]);
    // Only a build with the feature `gpu`, on a machine with an adapter, lists any.
    let adapter = [
        "adapters[].name",
        "adapters[].kind",
        "adapters[].backend",
        "adapters[].driver",
    ];
    prints_what_is_documented(&folder, "renderers --json", &[&["renderers", "--json"]], &adapter);
    prints_what_is_documented(&folder, "solvers --json", &[&["solvers", "--json"]], &[]);
    prints_what_is_documented(
        &folder,
        "study --list --json",
        &[&["study", "--list", "--json"]],
        &[],
    );
}
