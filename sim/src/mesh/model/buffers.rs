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
            gltf::buffer::Source::Uri(uri) => of_uri(uri, base, MAX_BYTES).map_err(missing)?,
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

/// The bytes that a URI stands for: embedded in it, or in a file beside the model. Else why there are none.
pub(super) fn of_uri(uri: &str, base: Option<&Path>, limit: u64) -> Result<Vec<u8>, String> {
    if uri.starts_with("data:") {
        let data = gltf::buffer::Data::from_source(gltf::buffer::Source::Uri(uri), None);
        return data
            .map(|data| data.0)
            .map_err(|e| format!("its embedded data cannot be decoded: {e}"));
    }
    let shown: String = uri.chars().take(120).collect();
    let name = decode_percent(uri).filter(|n| !n.contains(':') && !n.contains('\0'));
    let name = name.ok_or_else(|| format!("`{shown}` is not the name of a file"))?;
    let path = base.unwrap_or(Path::new("")).join(name);
    read_file(&path, limit).map_err(|e| e.what())
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
