//! Small scenes and recordings, and waiting for threads.

use meniscus::app::model::camera::Camera;
use meniscus::app::model::drawing::Drawn;
use meniscus::app::model::player::Player;
use meniscus::app::model::recent::Recent;
use meniscus::app::model::renderers::Choices;
use meniscus::app::model::touch::Pointer;
use meniscus::app::model::{Moment, nobody};
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::recording::Writer;
use meniscus_sim::source::LiveSource;
use meniscus_sim::{Channels, Frame, FrameSource as _, Progress, Scene, solvers};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a thread may take: generous, since the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(120);

/// The pointer over the middle row of a small picture, `x` of its width from the left.
pub(crate) fn pointer(camera: &Camera, x: f32, pressed: bool, down: bool, now: f64) -> Pointer {
    let (eye, direction) = camera.ray(Vec2::new(x, 0.5), UVec2::new(48, 32)).unwrap();
    Pointer {
        eye,
        direction,
        pressed,
        down,
        now,
    }
}

/// A square tray of water with a hump, a drop at 0.2 s and two cameras.
pub(crate) const TRAY: &str = r#"name = "Tray"
seed = 1
duration = 1.0

[domain]
size = [2.0, 2.0]

[water]
initial = { kind = "disturbance", position = [0.8, 1.1], radius = 0.25, height = 0.06 }

[terrain]
kind = "flat"
height = -0.25

[ground]
albedo = [0.62, 0.60, 0.55]
shore_albedo = [0.20, 0.22, 0.25]
checker = 0.25

[solver]
kind = "wave-equation"
spacing = 0.0625

[light]
sun = { elevation = 50.0, azimuth = 130.0 }

[[camera]]
name = "corner"
position = [-0.45, 1.0, 2.45]
target = [1.0, -0.12, 0.95]
fov = 48.0

[[camera]]
name = "above"
position = [1.0, 2.6, 1.2]
target = [1.0, 0.0, 1.0]
fov = 55.0

[[event]]
kind = "drop"
time = 0.2
position = [0.5, 1.4]
radius = 0.2
volume = 0.0003

[recording]
rate = 20.0
"#;

/// Shallow water with a crate that floats.
pub(crate) const BASIN: &str = r#"name = "Basin"
seed = 3
duration = 2.0

[domain]
size = [4.0, 4.0]

[terrain]
kind = "flat"
height = -0.8

[solver]
kind = "shallow-water"
spacing = 0.2

[[object]]
name = "crate"
shape = { kind = "box", size = [0.8, 0.5, 0.8] }
position = [2.0, 0.2, 2.0]
density = 400.0
motion = { kind = "free" }

[recording]
rate = 20.0
"#;

/// Water as particles in a square vessel, with a crate that floats; gravity turns once by itself.
pub(crate) const GLASS: &str = r#"name = "Glass"
seed = 5
duration = 2.0

[domain]
size = [0.4, 0.4]

[terrain]
kind = "flat"
height = -0.2

[solver]
kind = "sph"
spacing = 0.04
tilt = [
    { time = 1.5, gravity = [0.0, -9.81, 0.0] },
    { time = 1.7, gravity = [0.0, -9.5, 2.45] },
]

[[object]]
name = "crate"
shape = { kind = "box", size = [0.1, 0.08, 0.1] }
position = [0.2, 0.02, 0.2]
density = 400.0
motion = { kind = "free" }

[[camera]]
name = "table"
position = [0.2, 0.35, 0.9]
target = [0.2, 0.0, 0.2]
fov = 45.0

[recording]
rate = 50.0
"#;

/// A folder that goes with the test.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// A recording of all frames of a scene.
    pub(crate) fn record(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        let scene = scene(text);
        let mut source = run(&scene).until(scene.description.duration);
        let mut writer = Writer::create(&path, &scene, source.channels()).unwrap();
        let mut frame = Frame::new(scene.grid);
        while let Progress::Frame(report) = source.read_into(&mut frame).unwrap() {
            writer.push(&frame, report).unwrap();
        }
        writer.finish().unwrap();
        path
    }
}

pub(crate) fn scene(text: &str) -> Scene {
    Scene::from_toml(text, Path::new("scene.toml"), Path::new("."), &[]).unwrap()
}

/// A run with everything that renderers can use.
pub(crate) fn run(scene: &Scene) -> LiveSource {
    let solver = solvers::build(scene).unwrap();
    let wanted = Channels::DISPLACEMENT | Channels::FOAM | Channels::DROPLETS | Channels::BODIES;
    let wanted = if scene.description.objects.is_empty() {
        wanted - Channels::BODIES
    } else {
        wanted
    };
    LiveSource::new(scene, solver, wanted)
}

/// Waits until `done` gives something.
pub(crate) fn wait<T>(what: &str, mut done: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(value) = done() {
            return value;
        }
        assert!(start.elapsed() < PATIENCE, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A player that draws on the processor.
pub(crate) fn player() -> Player {
    Player::new(Choices::with_adapter(None), Recent::default(), nobody()).unwrap()
}

/// A player driven by a clock of the test's own.
pub(crate) struct Driven {
    pub(crate) player: Player,
    pub(crate) now: f64,
}

impl Driven {
    pub(crate) fn new(player: Player) -> Self {
        Self { player, now: 0.0 }
    }

    /// With a file open, paused at its first frame.
    pub(crate) fn opened(path: &Path) -> Self {
        let mut driven = Self::new(player());
        driven.player.open(path, Vec::new());
        driven.until("the first frame", |player| {
            let session = player.session.as_mut()?;
            session.clock.playing = false;
            session.moment.clone()
        });
        driven
    }

    /// Lets time pass, a hundredth of a second an update, from the first picture on.
    pub(crate) fn pass(&mut self, seconds: f64) {
        self.until("the first picture", |player| (!player.waits()).then_some(()));
        let end = self.now + seconds;
        while self.now < end {
            self.now += 0.01;
            self.player.update(self.now, UVec2::new(48, 32));
        }
    }

    /// Updates without letting time pass until `done` gives something.
    pub(crate) fn until<T>(&mut self, what: &str, mut done: impl FnMut(&mut Player) -> Option<T>) -> T {
        let now = self.now;
        let player = &mut self.player;
        wait(what, || {
            player.update(now, UVec2::new(48, 32));
            done(player)
        })
    }

    /// The picture of what is set now.
    pub(crate) fn picture(&mut self) -> Arc<Drawn> {
        let before = self.player.drawn.clone();
        self.pass(0.02);
        self.until("a picture", |player| {
            let now = player.drawn.clone()?;
            let new = before.as_ref().is_none_or(|before| !Arc::ptr_eq(before, &now));
            new.then_some(now)
        })
    }

    pub(crate) fn moment(&self) -> Arc<Moment> {
        let session = self.player.session.as_ref().unwrap();
        Arc::clone(session.moment.as_ref().unwrap())
    }

    /// All messages, a line each.
    pub(crate) fn messages(&self) -> String {
        let list = self.player.messages.list().iter();
        list.map(|message| message.text.clone() + "\n").collect()
    }
}
