//! Linear pictures with named channels and attributes.

use super::staged::Staged;
use super::{OutputError, check_length, check_size};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Layer, LayerAttributes, ReadChannels,
    ReadLayers, Text, WritableImage,
};
use glam::{UVec2, Vec3};
use meniscus_sim::render::Image;
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the attribute of all attributes.
const ATTRIBUTE: &str = "meniscus";

/// One more channel of an EXR, of as many values as the picture has pixels.
#[derive(Clone, Copy, Debug)]
pub struct Channel<'a> {
    /// Name, such as `refracted.X`.
    pub name: &'a str,
    /// Values, row-major from the top left.
    pub values: &'a [f32],
}

/// What an EXR holds beside its picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExrExtras<'a> {
    /// Channels of 32-bit floats.
    pub channels: &'a [Channel<'a>],
    /// Channels of 32-bit whole numbers: name and values, row-major from the top left.
    pub counts: &'a [(&'a str, Vec<u32>)],
    /// What else is said of the picture: name and value, without `=` and line breaks in names. All of it becomes the one
    /// attribute `meniscus`, a line each.
    pub attributes: &'a [(&'a str, String)],
}

/// A picture that was read, with what its file holds beside it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExrFile {
    /// The channels `R`, `G`, `B`.
    pub image: Image,
    /// Other channels of whole numbers, by name.
    pub counts: BTreeMap<String, Vec<u32>>,
    /// What is said in the attribute `meniscus`, by name.
    pub attributes: BTreeMap<String, String>,
}

/// Writes a picture as 32-bit float EXR: linear radiance in `R`, `G`, `B`, and further channels under their names.
///
/// # Errors
/// [`OutputError`].
pub fn write_exr(path: &Path, image: &Image, more: &[Channel<'_>]) -> Result<(), OutputError> {
    let extras = ExrExtras {
        channels: more,
        ..ExrExtras::default()
    };
    write_exr_with(path, image, &extras)
}

/// As [`write_exr`], with channels of whole numbers and attributes besides.
///
/// # Errors
/// [`OutputError`].
pub fn write_exr_with(path: &Path, image: &Image, extras: &ExrExtras<'_>) -> Result<(), OutputError> {
    check_size(path, image.size)?;
    check_length(path, image.size, image.pixels.len())?;
    let text = |name: &str| {
        Text::new_or_none(name)
            .ok_or_else(|| OutputError::encode(path, format!("the name or text `{name}` is not ASCII")))
    };
    let plane = |k: usize| FlatSamples::F32(image.pixels.iter().map(|p| p[k]).collect());
    let mut channels: exr::prelude::SmallVec<[AnyChannel<FlatSamples>; 4]> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(|(k, name)| AnyChannel::new(name, plane(k)))
        .collect();
    for channel in extras.channels {
        check_length(path, image.size, channel.values.len())?;
        let samples = FlatSamples::F32(channel.values.to_vec());
        channels.push(AnyChannel::new(text(channel.name)?, samples));
    }
    for (name, values) in extras.counts {
        check_length(path, image.size, values.len())?;
        channels.push(AnyChannel::new(text(name)?, FlatSamples::U32(values.clone())));
    }
    let mut attributes = LayerAttributes::default();
    if !extras.attributes.is_empty() {
        // One attribute for all: the order of several is not the same from run to run.
        let lines: Vec<String> = extras
            .attributes
            .iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        let all = AttributeValue::Text(text(&lines.join("\n"))?);
        attributes.other.insert(text(ATTRIBUTE)?, all);
    }
    let layer = Layer::new(
        (image.size.x as usize, image.size.y as usize),
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let staged = Staged::new(path)?;
    let mut file = staged.create()?;
    exr::prelude::Image::from_layer(layer)
        .write()
        .to_buffered(&mut file)
        .map_err(|e| OutputError::encode(path, e))?;
    staged.commit(file)
}

/// Reads a picture that [`write_exr_with`] wrote.
///
/// # Errors
/// [`OutputError::Io`] if the file cannot be read, [`OutputError::Decode`] if it is no such picture.
pub fn read_exr(path: &Path) -> Result<ExrFile, OutputError> {
    let file = std::fs::File::open(path).map_err(|e| OutputError::io(path, "reading", e))?;
    let fail = |message: String| OutputError::Decode {
        path: path.to_owned(),
        message,
    };
    let read = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::BufReader::new(file))
        .map_err(|e| fail(e.to_string()))?;
    let layer = read.layer_data;
    let size = UVec2::new(layer.size.x() as u32, layer.size.y() as u32);
    check_size(path, size)?;
    let mut found = ExrFile {
        image: Image::new(size),
        ..ExrFile::default()
    };
    let mut colours = 0;
    for channel in layer.channel_data.list {
        let name = channel.name.to_string();
        let colour = ["R", "G", "B"].iter().position(|c| *c == name);
        match (channel.sample_data, colour) {
            (FlatSamples::F32(values), Some(k)) if values.len() == found.image.pixels.len() => {
                colours += 1;
                for (pixel, value) in found.image.pixels.iter_mut().zip(values) {
                    pixel[k] = value;
                }
            }
            (FlatSamples::U32(values), None) => {
                found.counts.insert(name, values);
            }
            _ => {}
        }
    }
    if colours != 3 || !found.image.pixels.iter().all(|p: &Vec3| p.is_finite()) {
        return Err(fail("it has no finite 32-bit channels R, G and B".to_owned()));
    }
    let all = layer
        .attributes
        .other
        .into_iter()
        .find(|(name, _)| *name == *ATTRIBUTE);
    if let Some((_, AttributeValue::Text(lines))) = all {
        let lines = lines.to_string();
        let pairs = lines.lines().filter_map(|line| line.split_once('='));
        found.attributes = pairs
            .map(|(name, value)| (name.to_owned(), value.to_owned()))
            .collect();
    }
    Ok(found)
}
