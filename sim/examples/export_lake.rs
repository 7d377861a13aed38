//! A lake with an island in rain, exported in every format: `cargo run -p meniscus-sim --example export_lake -- DIR`.

#![allow(clippy::print_stderr, reason = "an example tells what it did")]

use meniscus_sim::export::{self, Format, Update};
use meniscus_sim::scene::Scene;
use meniscus_sim::source::LiveSource;
use meniscus_sim::{Channels, solvers};
use std::error::Error;
use std::path::{Path, PathBuf};

const LAKE: &str = r#"
name = "Lake"
seed = 3
domain = { size = [40.0, 30.0] }
terrain = { kind = "flat", height = -2.0 }
solver = { kind = "wave-equation", spacing = 0.25 }

[[object]]
name = "rock"
shape = { kind = "sphere", radius = 3.0 }
position = [25.0, 0.0, 14.0]

[[event]]
kind = "rain"
rate = 20.0
radius = 0.6
volume = "40 l"

[[event]]
kind = "sweep"
start = 0
end = 4
from = [4.0, 8.0]
to = [20.0, 20.0]
radius = 1.0
rate = "40 cm/s"
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    let scene = Scene::from_toml(LAKE, Path::new("lake.toml"), Path::new("."), &[])?;
    for format in Format::ALL {
        let mut frames = LiveSource::new(&scene, solvers::build(&scene)?, Channels::ALL).until(2.0);
        let extension = if format == Format::Vtk {
            "pvd"
        } else {
            format.name()
        };
        let out = folder.join(format!("lake.{extension}"));
        let summary = export::write(format, &scene, &mut frames, &out, &mut |update| {
            matches!(update, Update::Frame { .. })
        })?;
        eprintln!(
            "{}: {} frames, {} files, {} bytes",
            summary.entry.display(),
            summary.frames,
            summary.files,
            summary.bytes
        );
    }
    Ok(())
}
