//! A vessel that is tilted by hand, and which tools there are for what.

use crate::support::{BASIN, Driven, Folder, GLASS, TRAY, pointer, scene};
use meniscus::app::model::session::RecordingState;
use meniscus::app::model::touch::Tool;
use meniscus_sim::Frame;
use meniscus_sim::events::Action;
use meniscus_sim::glam::Vec3;
use meniscus_sim::recording::Reader;

/// How far the water stands higher towards +X, metres.
fn slope(frame: &Frame) -> f32 {
    let spec = frame.spec();
    let (nx, nz) = (spec.size.x as usize, spec.size.y as usize);
    let half = |from: usize| {
        let columns = (0..nz).flat_map(move |j| (from..from + nx / 2).map(move |i| (i, j)));
        let heights = columns.map(|(i, j)| frame.elevation.as_slice()[spec.index(i, j)]);
        heights.sum::<f32>() / (nz * (nx / 2)) as f32
    };
    half(nx - nx / 2) - half(0)
}

#[test]
fn a_vessel_is_tilted_by_hand_and_the_water_follows() {
    let folder = Folder::new();
    let mut driven = Driven::opened(&folder.write("glass.toml", GLASS));
    let path = folder.path("run.mrec");
    let session = driven.player.session.as_mut().unwrap();
    session.record(Some(path.clone()));
    session.touch.tool = Tool::Tilt;
    session.camera.target = Vec3::new(0.2, 0.0, 0.2);
    let camera = session.camera;
    driven.until("recording", |p| {
        (p.session.as_ref()?.recording != RecordingState::Off).then_some(())
    });
    assert!(slope(&driven.moment().frame).abs() < 0.01);
    // From the camera's side +X is to the right.
    let at = |x, pressed, down, now| pointer(&camera, x, pressed, down, now);
    driven.player.touch(&at(0.5, true, true, 1.0));
    for k in 1..=15 {
        let now = 1.0 + 0.1 * f64::from(k);
        driven.player.touch(&at(0.5 + 0.01 * k as f32, false, true, now));
        driven.player.session.as_mut().unwrap().step(false);
        driven.until("a frame", |p| {
            (p.session.as_ref()?.moment.as_ref()?.frame.index >= k as u64).then_some(())
        });
    }
    let session = driven.player.session.as_ref().unwrap();
    let degrees = session.touch.tilted().unwrap();
    assert!((5.0..75.1).contains(&degrees), "{degrees}");
    let leaning = slope(&driven.moment().frame);
    assert!(leaning > 0.02, "{leaning} m");
    driven.player.touch(&at(0.65, false, false, 3.0));
    assert_eq!(driven.player.session.as_ref().unwrap().touch.tilted(), None);
    let session = driven.player.session.as_mut().unwrap();
    session.step(false);
    driven.until("a frame", |p| {
        (p.session.as_ref()?.moment.as_ref()?.frame.index >= 16).then_some(())
    });
    driven.player.session.as_mut().unwrap().record(None);
    driven.until("the recording", |p| p.session.as_ref()?.recorded.clone());
    assert!(!driven.messages().contains("cannot"), "{}", driven.messages());
    // What was done is in the recording: a tilt a frame, and upright at last.
    let mut reader = Reader::open(&path).unwrap();
    let acted: Vec<Action> = (0..reader.len())
        .flat_map(|k| reader.acted(k).unwrap())
        .map(|(_, action)| action)
        .collect();
    assert_eq!(acted.len(), 16, "{acted:?}");
    let gravities: Vec<Vec3> = acted
        .iter()
        .map(|action| match action {
            Action::Tilt { gravity } => *gravity,
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(
        gravities[..15].windows(2).all(|pair| pair[0].x < pair[1].x),
        "{gravities:?}"
    );
    assert_eq!(gravities[15], Vec3::new(0.0, -9.81, 0.0));
}

#[test]
fn tools_are_offered_where_there_is_something_for_them_to_do() {
    let idle = |text: &str| -> Vec<Tool> {
        let scene = scene(text);
        let tools = Tool::ALL.iter().map(|(tool, ..)| *tool);
        tools.filter(|tool| tool.idle(&scene).is_some()).collect()
    };
    assert_eq!(idle(TRAY), [Tool::Drag, Tool::Tilt]);
    assert_eq!(idle(BASIN), [Tool::Tilt]);
    assert_eq!(idle(GLASS), []);
}
