//! Runs the real `meniscus` binary in a folder of its own and looks at what it says.

use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A square tray of water with one hump, 33 by 33 samples and 6 frames: as small as a run that shows something.
pub const SCENE: &str = r#"name = "Tray"
seed = 1
duration = 0.5

[domain]
size = [2.0, 2.0]

[water]
initial = { kind = "disturbance", position = [1.0, 1.0], radius = 0.2, height = 0.03 }

[terrain]
kind = "flat"
height = -0.25

[solver]
kind = "wave-equation"
spacing = 0.0625

[light]
sun = { elevation = 50.0, azimuth = 130.0 }

[[camera]]
name = "corner"
position = [-1.2, 1.3, 3.4]
target = [1.0, -0.1, 1.0]

[recording]
rate = 10.0
"#;

/// Number of frames that [`SCENE`] gives.
pub const FRAMES: usize = 6;

/// How long a child may take before a test gives up on it: generous, since the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(120);

/// A folder that goes with the test.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    /// A folder with [`SCENE`] as `scene.toml`.
    pub fn with_scene() -> Self {
        let folder = Self::new();
        folder.write("scene.toml", SCENE);
        folder
    }

    /// A folder with [`SCENE`] as `scene.toml` and its recording as `run.mrec`.
    pub fn with_recording() -> Self {
        let folder = Self::with_scene();
        folder.run(["record", "scene.toml", "-o", "run.mrec"]).exits(0);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, contents).unwrap();
        path
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// The command, to be run in this folder.
    pub fn command<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_meniscus"));
        command.args(args).current_dir(self.0.path()).stdin(Stdio::null());
        command
    }

    /// Runs the command in this folder to its end.
    pub fn run<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Ended {
        Ended::of(self.command(args))
    }

    /// Starts the command in this folder with both streams captured.
    pub fn start<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Running {
        let mut command = self.command(args);
        Running(
            command
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap(),
        )
    }

    /// Runs a shell command line in this folder; `meniscus` in it is the binary under test.
    #[cfg(unix)]
    pub fn shell(&self, line: &str) -> Ended {
        let mut command = Command::new("sh");
        let line = line.replace("meniscus", env!("CARGO_BIN_EXE_meniscus"));
        command
            .args(["-c", &line])
            .current_dir(self.0.path())
            .stdin(Stdio::null());
        Ended::of(command)
    }
}

/// A command under way; a test that fails does not leave it behind.
pub struct Running(pub Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail where it has ended, which is as well.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Running {
    /// Sends a signal, such as `INT`.
    #[cfg(unix)]
    pub fn signal(&self, name: &str) {
        let line = format!("kill -s {name} {}", self.0.id());
        assert!(Command::new("sh").args(["-c", &line]).status().unwrap().success());
    }

    /// Whether it has not ended yet.
    pub fn is_running(&mut self) -> bool {
        self.0.try_wait().unwrap().is_none()
    }

    /// Waits for its end.
    #[track_caller]
    pub fn end(mut self) -> Ended {
        // Read while it runs: a pipe that nobody empties would stop it.
        let stdout = self.0.stdout.take().map(read);
        let stderr = self.0.stderr.take().map(read);
        wait_until("the command ends", || !self.is_running());
        let text = |reader: Option<JoinHandle<String>>| {
            reader.map_or_else(String::new, |reader| reader.join().unwrap())
        };
        Ended {
            command: "a command under way".into(),
            code: self.0.wait().unwrap().code(),
            stdout: text(stdout),
            stderr: text(stderr),
        }
    }
}

/// Reads a pipe to its end, on another thread.
fn read(mut pipe: impl Read + Send + 'static) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut text = String::new();
        pipe.read_to_string(&mut text).unwrap();
        text
    })
}

/// A command that came to its end.
pub struct Ended {
    pub command: String,
    /// Exit code; absent if a signal ended it.
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Ended {
    pub fn of(mut command: Command) -> Self {
        let output = command.output().unwrap();
        Self {
            command: format!("{command:?}"),
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Everything that a failed assertion should show.
    pub fn transcript(&self) -> String {
        format!(
            "{}\nexit code: {:?}\nstdout:\n{}\nstderr:\n{}",
            self.command, self.code, self.stdout, self.stderr
        )
    }

    /// Asserts the exit code, and that nothing panicked.
    #[track_caller]
    pub fn exits(&self, code: i32) -> &Self {
        assert_eq!(self.code, Some(code), "{}", self.transcript());
        assert!(!self.stderr.contains("panicked"), "{}", self.transcript());
        self
    }

    /// Asserts that standard error holds every one of `parts` in one error: a line that begins with `error: `, or what
    /// the parser of the command line writes below one.
    #[track_caller]
    pub fn error_says(&self, parts: &[&str]) -> &Self {
        let says = |error: &str| parts.iter().all(|part| error.contains(part));
        let mut errors = self.stderr.lines().filter(|line| line.starts_with("error: "));
        let found = if self.stderr.contains("For more information, try '--help'.") {
            self.stderr.starts_with("error: ") && says(&self.stderr)
        } else {
            errors.any(says)
        };
        assert!(found, "no error with {parts:?}\n{}", self.transcript());
        self
    }

    /// Asserts that nothing was written to standard output.
    #[track_caller]
    pub fn silent(&self) -> &Self {
        assert_eq!(self.stdout, "", "{}", self.transcript());
        self
    }

    /// Standard output as one JSON object.
    #[track_caller]
    pub fn json(&self) -> Value {
        match serde_json::from_str(&self.stdout) {
            Ok(value @ Value::Object(_)) => value,
            other => panic!("not one JSON object: {other:?}\n{}", self.transcript()),
        }
    }
}

/// Waits until `condition` holds.
#[track_caller]
pub fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < PATIENCE, "waited too long until {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Waits until the file is at least this long.
#[track_caller]
pub fn wait_for_length(path: &Path, length: u64) {
    wait_until(&format!("{} has {length} bytes", path.display()), || {
        fs::metadata(path).is_ok_and(|file| file.len() >= length)
    });
}

/// A small file system that is unmounted again.
#[cfg(unix)]
pub struct Small<'a>(&'a Path);

#[cfg(unix)]
impl<'a> Small<'a> {
    /// `None` where this user may not mount.
    pub fn mount(path: &'a Path, size: &str) -> Option<Self> {
        std::fs::create_dir(path).unwrap();
        let options = format!("size={size}");
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &options, "tmpfs"]).arg(path);
        mount
            .output()
            .is_ok_and(|output| output.status.success())
            .then_some(Self(path))
    }
}

#[cfg(unix)]
impl Drop for Small<'_> {
    fn drop(&mut self) {
        let unmounted = Command::new("umount").arg(self.0).status();
        assert!(
            unmounted.is_ok_and(|status| status.success()),
            "{} stays mounted",
            self.0.display()
        );
    }
}

/// CRC-32 as in ZIP and PNG, bit by bit.
pub fn crc32(bytes: &[u8]) -> u32 {
    let shift = |crc: u32| (crc >> 1) ^ (0xedb8_8320 * (crc & 1));
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| shift(crc))
    })
}

/// A `.npy` file of little-endian `f32` values.
pub fn npy(shape: &[usize], values: &[f32]) -> Vec<u8> {
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}");
    // Magic, version and length take 10 bytes; the whole is padded to a multiple of 64 and ends with a line break.
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((padded as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = padded - 1).bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}
