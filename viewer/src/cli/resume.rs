//! Pictures that can be drawn on: what an EXR keeps of its passes, to the last bit.

use super::failure::Failure;
use super::picture::Extras;
use super::progressive::Passes;
use meniscus_render_cpu::output::{self, ExrFile};
use meniscus_sim::glam::DVec3;
use meniscus_sim::render::View;
use meniscus_sim::stage::fingerprint;
use meniscus_sim::{Frame, Scene};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::Path;

/// Attribute: passes drawn.
const PASSES: &str = "passes";
/// Attribute: samples a pixel of each pass.
const SAMPLES: &str = "samples-a-pass";
/// Attribute: seed of the scene.
const SEED: &str = "seed";
/// Attribute: renderer.
const RENDERER: &str = "renderer";
/// Attribute: changes with anything that the picture is of.
const SUBJECT: &str = "subject";
/// Channels of the halves of each mean and each squared deviation; a double-precision number is two of 32 bits.
const STATE: [&str; 12] = [
    "state.mean.R.high",
    "state.mean.R.low",
    "state.mean.G.high",
    "state.mean.G.low",
    "state.mean.B.high",
    "state.mean.B.low",
    "state.square.R.high",
    "state.square.R.low",
    "state.square.G.high",
    "state.square.G.low",
    "state.square.B.high",
    "state.square.B.low",
];

/// What a picture is of: two with the same can be drawn on from one another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Subject {
    samples: u32,
    seed: u64,
    renderer: &'static str,
    hash: u64,
}

impl Subject {
    pub(crate) fn new(scene: &Scene, frame: &Frame, view: &View, renderer: &'static str) -> Self {
        let mut hasher = DefaultHasher::new();
        fingerprint(scene).hash(&mut hasher);
        frame.index.hash(&mut hasher);
        frame.time.to_bits().hash(&mut hasher);
        for value in frame.elevation.as_slice() {
            value.to_bits().hash(&mut hasher);
        }
        let view = View {
            pass: 0,
            ..view.clone()
        };
        format!("{view:?} {:?}", frame.bodies).hash(&mut hasher);
        Self {
            samples: view.samples,
            seed: scene.description.seed,
            renderer,
            hash: hasher.finish(),
        }
    }

    /// Attributes and channels that let a picture of these passes be drawn on.
    pub(crate) fn keep(&self, passes: &Passes) -> Extras {
        let attributes = vec![
            (PASSES, passes.count.to_string()),
            (SAMPLES, self.samples.to_string()),
            (SEED, self.seed.to_string()),
            (RENDERER, self.renderer.to_owned()),
            (SUBJECT, format!("{:016x}", self.hash)),
        ];
        let half = |values: &[DVec3], colour: usize, shift: u32| -> Vec<u32> {
            values
                .iter()
                .map(|v| (v[colour].to_bits() >> shift) as u32)
                .collect()
        };
        let planes = STATE.iter().enumerate().map(|(k, name)| {
            let values = if k < 6 { &passes.mean } else { &passes.square };
            let shift = if k % 2 == 0 { 32 } else { 0 };
            (*name, half(values, k % 6 / 2, shift))
        });
        Extras {
            planes: Vec::new(),
            counts: planes.collect(),
            attributes,
        }
    }

    /// The passes that a file holds; `None` if there is no such file.
    ///
    /// # Errors
    /// [`Failure::Input`] if it is not a picture of this subject that can be drawn on.
    pub(crate) fn resume(&self, file: &Path) -> Result<Option<Passes>, Failure> {
        if !file.exists() {
            return Ok(None);
        }
        let refuse = |what: String| {
            Failure::input(format_args!(
                "{}: {what}; leave out --resume, or choose another name with -o",
                file.display()
            ))
        };
        let read = output::read_exr(file).map_err(|e| refuse(format!("it cannot be drawn on: {e}")))?;
        let attribute = |name: &str| {
            read.attributes
                .get(name)
                .map(String::as_str)
                .ok_or_else(|| refuse(format!("it does not say `{name}`, so that it cannot be drawn on")))
        };
        let expected = [
            (RENDERER, self.renderer.to_owned(), "it was drawn by renderer"),
            (
                SAMPLES,
                self.samples.to_string(),
                "its passes have samples a pixel:",
            ),
            (SEED, self.seed.to_string(), "its scene has the seed"),
        ];
        for (name, wanted, what) in expected {
            let found = attribute(name)?;
            if found != wanted {
                return Err(refuse(format!("{what} {found}, not {wanted}")));
            }
        }
        if attribute(SUBJECT)? != format!("{:016x}", self.hash) {
            return Err(refuse(
                "it shows another scene, frame, view or size, or was drawn by another build".to_owned(),
            ));
        }
        let count = attribute(PASSES)?.parse().ok();
        let passes = count.and_then(|count| unpack(&read, count));
        passes
            .map(Some)
            .ok_or_else(|| refuse("what it keeps of its passes is damaged".to_owned()))
    }
}

fn unpack(file: &ExrFile, count: u32) -> Option<Passes> {
    let pixels = file.image.pixels.len();
    let mut passes = Passes {
        count,
        mean: vec![DVec3::ZERO; pixels],
        square: vec![DVec3::ZERO; pixels],
    };
    for (k, pair) in STATE.chunks_exact(2).enumerate() {
        let (high, low) = (file.counts.get(pair[0])?, file.counts.get(pair[1])?);
        if high.len() != pixels || low.len() != pixels {
            return None;
        }
        let values = if k < 3 {
            &mut passes.mean
        } else {
            &mut passes.square
        };
        for (value, (high, low)) in values.iter_mut().zip(high.iter().zip(low)) {
            let number = f64::from_bits(u64::from(*high) << 32 | u64::from(*low));
            if !number.is_finite() {
                return None;
            }
            value[k % 3] = number;
        }
    }
    (count > 0).then_some(passes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_are_kept_to_the_last_bit() {
        let passes = Passes {
            count: 7,
            mean: vec![DVec3::new(0.1, 1e-300, 3.0), DVec3::new(1.0 / 3.0, 0.0, 1e12)],
            square: vec![DVec3::new(1e-17, 5.0, 2.0_f64.sqrt()), DVec3::ZERO],
        };
        let subject = Subject {
            samples: 4,
            seed: u64::MAX,
            renderer: "path",
            hash: 5,
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let kept = subject.keep(&passes);
        let image = meniscus_sim::render::Image::new(meniscus_sim::glam::UVec2::new(2, 1));
        let extras = output::ExrExtras {
            channels: &[],
            counts: &kept.counts,
            attributes: &kept.attributes,
        };
        assert_eq!(subject.resume(&path).unwrap(), None);
        output::write_exr_with(&path, &image, &extras).unwrap();
        assert_eq!(subject.resume(&path).unwrap(), Some(passes));

        let refused = |subject: Subject| subject.resume(&path).unwrap_err().to_string();
        let other = |change: fn(&mut Subject)| {
            let mut other = subject.clone();
            change(&mut other);
            refused(other)
        };
        assert!(other(|s| s.renderer = "photon").contains("drawn by renderer path, not photon"));
        assert!(other(|s| s.samples = 8).contains("4, not 8"));
        assert!(other(|s| s.seed = 1).contains("the seed"));
        assert!(other(|s| s.hash = 6).contains("another scene"));
        output::write_exr(&path, &image, &[]).unwrap();
        assert!(refused(subject.clone()).contains("does not say"));
        std::fs::write(&path, "no picture").unwrap();
        assert!(refused(subject).contains("cannot be drawn on"));
    }
}
