//! The compressions of pages.

use std::borrow::Cow;
use std::io::Read;

use crate::log::bytes::Bytes;

/// [byte] A page of numbers that says it is larger is damaged.
const LARGEST_PAGE: usize = 256 << 20;

/// So many times smaller Snappy makes nothing.
const SNAPPY_MOST: usize = 64;

/// Compressions by their code in the format.
const NAMES: [&str; 8] = ["none", "snappy", "gzip", "lzo", "brotli", "lz4", "zstd", "lz4_raw"];

/// Name of a compression that is not read here.
pub(super) fn unread(codec: i64) -> Option<&'static str> {
    let place = usize::try_from(codec).ok()?;
    [3, 4, 5].contains(&place).then(|| NAMES.get(place).copied())?
}

/// `size` bytes of a page as they were before; `None` where they are damaged.
pub(super) fn expand(codec: i64, bytes: &[u8], size: usize) -> Option<Cow<'_, [u8]>> {
    if size > LARGEST_PAGE {
        return None;
    }
    let expanded = match codec {
        0 => Cow::Borrowed(bytes),
        1 => {
            let is_size = snap::raw::decompress_len(bytes).ok()? == size && size / SNAPPY_MOST <= bytes.len();
            Cow::Owned(is_size.then(|| snap::raw::Decoder::new().decompress_vec(bytes).ok())??)
        }
        2 => Cow::Owned(read(flate2::read::MultiGzDecoder::new(bytes), size)?),
        6 => Cow::Owned(read(ruzstd::decoding::StreamingDecoder::new(bytes).ok()?, size)?),
        7 => Cow::Owned(lz4(bytes, size)?),
        _ => return None,
    };
    (expanded.len() == size).then_some(expanded)
}

/// Up to `size` bytes and one, so that too many show.
fn read(decoder: impl Read, size: usize) -> Option<Vec<u8>> {
    let mut expanded = Vec::new();
    decoder.take(size as u64 + 1).read_to_end(&mut expanded).ok()?;
    Some(expanded)
}

/// A block of LZ4.
fn lz4(bytes: &[u8], size: usize) -> Option<Vec<u8>> {
    let mut bytes = Bytes::new(bytes);
    let mut expanded: Vec<u8> = Vec::new();
    while let Some(token) = bytes.u8() {
        let literals = length(&mut bytes, token >> 4)?;
        expanded.extend_from_slice(bytes.take(literals)?);
        // The last sequence has no match.
        let Some(distance) = bytes.u16() else { break };
        let copied = length(&mut bytes, token & 0x0f)?.checked_add(4)?;
        let from = expanded.len().checked_sub(usize::from(distance)).filter(|_| distance > 0)?;
        if expanded.len().checked_add(copied)? > size {
            return None;
        }
        // What is copied may be part of itself.
        for place in from..from + copied {
            expanded.push(*expanded.get(place)?);
        }
    }
    Some(expanded)
}

fn length(bytes: &mut Bytes, short: u8) -> Option<usize> {
    let mut length = usize::from(short);
    if short == 15 {
        loop {
            let more = bytes.u8()?;
            length = length.checked_add(usize::from(more))?;
            if more < 255 {
                break;
            }
        }
    }
    Some(length)
}
