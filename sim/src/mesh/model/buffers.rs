//! Where the bytes of a model are: in the file, embedded in its text, or in files beside it.

use super::{Kind, MAX_BYTES};
use crate::scene::{Fault, read_file};
use std::path::Path;

/// The bytes of every buffer.
pub(super) fn read(
    document: &gltf::Document,
    base: Option<&Path>,
    blob: Option<Vec<u8>>,
) -> Result<Vec<Vec<u8>>, Kind> {
    let mut blob = blob;
    let mut all = Vec::new();
    for buffer in document.buffers() {
        let index = buffer.index();
        let missing = |reason: String| Kind::MissingBuffer { index, reason };
        let data = match buffer.source() {
            gltf::buffer::Source::Bin => blob
                .take()
                .ok_or_else(|| missing("the file has no binary part for it".into()))?,
            gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
                let data = gltf::buffer::Data::from_source(buffer.source(), None);
                data.map_err(|e| missing(format!("its embedded data cannot be decoded: {e}")))?
                    .0
            }
            gltf::buffer::Source::Uri(uri) => {
                let shown: String = uri.chars().take(120).collect();
                let name = decode_percent(uri).filter(|n| !n.contains(':') && !n.contains('\0'));
                let name = name.ok_or_else(|| missing(format!("`{shown}` is not the name of a file")))?;
                let path = base.unwrap_or(Path::new("")).join(name);
                read_file(&path, MAX_BYTES).map_err(|e| missing(e.what()))?
            }
        };
        if data.len() < buffer.length() {
            let reason = format!(
                "it has {} bytes where {} are declared",
                data.len(),
                buffer.length()
            );
            return Err(missing(reason));
        }
        all.push(data);
    }
    Ok(all)
}

/// Decodes `%20` and the like.
fn decode_percent(uri: &str) -> Option<String> {
    let mut out = Vec::with_capacity(uri.len());
    let mut bytes = uri.bytes();
    while let Some(b) = bytes.next() {
        if b == b'%' {
            let digit = |b: u8| (b as char).to_digit(16);
            let (high, low) = (digit(bytes.next()?)?, digit(bytes.next()?)?);
            out.push((16 * high + low) as u8);
        } else {
            out.push(b);
        }
    }
    String::from_utf8(out).ok()
}
