//! Linear pictures with named channels.

use super::staged::Staged;
use super::{OutputError, check_length, check_size};
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, WritableImage};
use meniscus_sim::render::Image;
use std::path::Path;

/// One more channel of an EXR, of as many values as the picture has pixels.
#[derive(Clone, Copy, Debug)]
pub struct Channel<'a> {
    /// Name, such as `refracted.X`.
    pub name: &'a str,
    /// Values, row-major from the top left.
    pub values: &'a [f32],
}

/// Writes a picture as 32-bit float EXR: linear radiance in `R`, `G`, `B`, and further channels under their names.
///
/// # Errors
/// [`OutputError`].
pub fn write_exr(path: &Path, image: &Image, more: &[Channel<'_>]) -> Result<(), OutputError> {
    check_size(path, image.size)?;
    check_length(path, image.size, image.pixels.len())?;
    let plane = |k: usize| FlatSamples::F32(image.pixels.iter().map(|p| p[k]).collect());
    let mut channels: exr::prelude::SmallVec<[AnyChannel<FlatSamples>; 4]> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(|(k, name)| AnyChannel::new(name, plane(k)))
        .collect();
    for channel in more {
        check_length(path, image.size, channel.values.len())?;
        let Some(name) = exr::prelude::Text::new_or_none(channel.name) else {
            return Err(OutputError::encode(
                path,
                format!("channel name `{}` is not ASCII", channel.name),
            ));
        };
        channels.push(AnyChannel::new(name, FlatSamples::F32(channel.values.to_vec())));
    }
    let size = (image.size.x as usize, image.size.y as usize);
    let layer = Layer::new(
        size,
        LayerAttributes::default(),
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
