//! What the player writes: pictures, clips, and the names of recordings.

use super::super::clip::{self, Seen};
use super::super::session::Session;
use super::Player;
use meniscus_sim::glam::UVec2;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Player {
    /// Saves the picture that is shown, under a name that is free in `folder`.
    pub fn screenshot(&mut self, folder: &Path) {
        let (Some(session), Some(drawn)) = (&self.session, &self.drawn) else {
            self.messages.warn("there is no picture yet");
            return;
        };
        let stem = session.stem();
        let path = free_name(folder, &format!("{stem}_{:.3}s", drawn.left.time), "png");
        if drawn.is_here() {
            self.save(&path);
        } else {
            // It is on the device alone: the next one comes here.
            self.shot = Some(path);
            self.last = None;
        }
    }

    pub(super) fn save(&mut self, path: &Path) {
        let Some(drawn) = &self.drawn else { return };
        match drawn.save(path) {
            Ok(()) => self.messages.note(format!("saved {}", path.display())),
            Err(error) => self.messages.error(error),
        }
    }

    /// Begins to write a clip of the recording, as it is seen now.
    pub fn write_clip(&mut self, folder: &Path) {
        let Some(session) = &self.session else { return };
        let stem = session.stem();
        let out = free_name(
            folder,
            &stem,
            clip::KINDS[self.clip.kind.min(clip::KINDS.len() - 1)].0,
        );
        let seen = Seen {
            recording: session.path.clone(),
            renderer: self.renderer.clone(),
            turned: self.turned.get(&self.renderer).cloned().unwrap_or_default(),
            view: session.camera.view(UVec2::ONE, 1),
            exposure: session.exposure,
            speed: session.clock.speed(),
        };
        let done = Arc::clone(&self.clipped);
        match clip::write(&self.clip, seen, &out, done, Arc::clone(&self.wake)) {
            Ok(()) => self.clipping = Some(out),
            Err(error) => self.messages.error(error),
        }
    }

    /// The clip that is being written.
    pub fn clipping(&self) -> Option<&Path> {
        self.clipping.as_deref()
    }
}

/// A free name in `folder` for a recording of what runs.
pub fn recording_name(session: &Session, folder: &Path) -> PathBuf {
    free_name(folder, &session.stem(), "mrec")
}

/// `stem.extension` in `folder`, or `stem-2.extension` and so on if that is taken.
pub fn free_name(folder: &Path, stem: &str, extension: &str) -> PathBuf {
    let name = |k: u32| {
        let number = if k == 1 { String::new() } else { format!("-{k}") };
        folder.join(format!("{stem}{number}.{extension}"))
    };
    (1..)
        .map(name)
        .find(|path| !path.exists())
        .unwrap_or_else(|| name(1))
}
