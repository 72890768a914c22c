//! Buffers and buffer views, EXT_meshopt_compression included.

use super::missing;
use crate::ImportError;
use crate::files::Content;
use crate::source::Source;
use gltf::json::{Root, buffer::View};
use serde::Deserialize;
use std::borrow::Cow;
use std::ops::Range;

/// Decoded elements of one compressed view; bounds what a hostile file can make us allocate.
const MAX_ELEMENTS: usize = 1 << 28;

/// All buffers. One that is only a fallback of compressed views may be absent.
pub(crate) struct Buffers {
    data: Vec<Option<Part>>,
}

/// A part of a file.
pub(crate) struct Part {
    pub(crate) content: Content,
    pub(crate) range: Range<u64>,
}

impl Part {
    fn len(&self) -> u64 {
        self.range.end - self.range.start
    }
}

/// A view's bytes and, if it has one, its stride.
pub(crate) struct ViewBytes<'a> {
    pub(crate) bytes: Cow<'a, [u8]>,
    pub(crate) stride: Option<usize>,
}

impl Buffers {
    pub(crate) fn read(
        source: &mut Source,
        root: &Root,
        blob: Option<Part>,
    ) -> Result<Self, ImportError> {
        let mut blob = blob;
        let mut data = Vec::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            let element = format!("buffer {i}");
            let bytes = match (&buffer.uri, i) {
                (Some(uri), _) => {
                    let content = source.uri(&element, uri)?;
                    let range = 0..content.len();
                    Some(Part { content, range })
                }
                (None, 0) => blob.take(),
                (None, _) => None,
            };
            if let Some(bytes) = &bytes
                && bytes.len() < buffer.byte_length.0
            {
                let problem =
                    format!("{} bytes; byteLength says {}", bytes.len(), buffer.byte_length.0);
                return Err(source.invalid(element, problem));
            }
            data.push(bytes);
        }
        Ok(Self { data })
    }

    pub(crate) fn view(
        &self,
        source: &Source,
        root: &Root,
        index: usize,
    ) -> Result<ViewBytes<'_>, ImportError> {
        let element = format!("bufferView {index}");
        let view = root
            .buffer_views
            .get(index)
            .ok_or_else(|| missing(source, "file", "bufferView", index, root.buffer_views.len()))?;
        if let Some(packed) = Packed::of(source, &element, view)? {
            let bytes = self.slice(
                source,
                &element,
                packed.buffer,
                packed.byte_offset,
                packed.byte_length,
            )?;
            let bytes = packed.decode(source, &element, &bytes)?;
            return Ok(ViewBytes { bytes: bytes.into(), stride: Some(packed.byte_stride) });
        }
        let offset = view.byte_offset.map_or(0, |o| o.0 as usize);
        let bytes =
            self.slice(source, &element, view.buffer.value(), offset, view.byte_length.0 as usize)?;
        let stride = view.byte_stride.map(|s| s.0);
        Ok(ViewBytes { bytes, stride })
    }

    fn slice(
        &self,
        source: &Source,
        element: &str,
        buffer: usize,
        offset: usize,
        length: usize,
    ) -> Result<Cow<'_, [u8]>, ImportError> {
        let count = self.data.len();
        let data = self
            .data
            .get(buffer)
            .ok_or_else(|| missing(source, element, "buffer", buffer, count))?;
        let Some(data) = data else {
            return Err(source.invalid(element, format!("buffer {buffer} has no data")));
        };
        let (offset, length) = (offset as u64, length as u64);
        let outside = || {
            let problem = format!("bytes {offset}+{length} of buffer {buffer} with {}", data.len());
            source.invalid(element, problem)
        };
        let end =
            offset.checked_add(length).filter(|&end| end <= data.len()).ok_or_else(outside)?;
        let start = data.range.start;
        let bytes = data.content.range(start + offset..start + end);
        bytes.map_err(|e| source.io(e))?.ok_or_else(outside)
    }
}

/// The extension object of a compressed view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Packed {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: usize,
    count: usize,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

impl Packed {
    fn of(source: &Source, element: &str, view: &View) -> Result<Option<Self>, ImportError> {
        let others = view.extensions.as_ref().map(|e| &e.others);
        let value = others.and_then(|o| {
            o.get("EXT_meshopt_compression").or_else(|| o.get("KHR_meshopt_compression"))
        });
        let Some(value) = value else { return Ok(None) };
        let packed: Self = serde_json::from_value(value.clone())
            .map_err(|e| source.invalid(element, format!("EXT_meshopt_compression: {e}")))?;
        if packed.count > MAX_ELEMENTS {
            let problem = format!("count {}; the limit is {MAX_ELEMENTS}", packed.count);
            return Err(source.invalid(element, problem));
        }
        Ok(Some(packed))
    }

    fn decode(&self, source: &Source, element: &str, data: &[u8]) -> Result<Vec<u8>, ImportError> {
        let bad = |problem: String| source.invalid(element, problem);
        let stride = self.byte_stride;
        let allowed = match self.mode.as_str() {
            "ATTRIBUTES" => stride.is_multiple_of(4) && (4..=256).contains(&stride),
            "TRIANGLES" | "INDICES" => stride == 2 || stride == 4,
            other => return Err(source.unsupported(format!("{element}: meshopt mode {other}"))),
        };
        if !allowed || (self.mode == "TRIANGLES" && !self.count.is_multiple_of(3)) {
            let (mode, count) = (&self.mode, self.count);
            return Err(bad(format!("byteStride {stride} and count {count} in mode {mode}")));
        }
        // The codecs spend at least 2 bits on 16 values: more cannot come of these bytes.
        let (size, most) = (self.count * stride, 256 * data.len() + 4096);
        if size > most {
            return Err(bad(format!("{} bytes cannot hold {size}; at most {most}", data.len())));
        }
        source.charge(element, size as u64)?;
        let mut out = self.unpack(data).ok_or_else(|| {
            bad(format!("{} bytes do not decode in mode {}", data.len(), self.mode))
        })?;
        let bytes: &mut [u8] = &mut out;
        match (self.filter.as_deref(), stride) {
            (None | Some("NONE"), _) => {}
            (Some("OCTAHEDRAL"), 4) => each(bytes, meshopt::decode_filter_oct::<i8>),
            (Some("OCTAHEDRAL"), 8) => each(bytes, meshopt::decode_filter_oct::<i16>),
            (Some("QUATERNION"), 8) => each(bytes, meshopt::decode_filter_quat),
            (Some("EXPONENTIAL"), _) => each(bytes, meshopt::decode_filter_exp::<1>),
            (Some(other), _) => {
                let what = format!("{element}: meshopt filter {other} with byteStride {stride}");
                return Err(source.unsupported(what));
            }
        }
        Ok(out)
    }

    fn unpack(&self, data: &[u8]) -> Option<Vec<u8>> {
        let mut out = vec![0u8; self.count * self.byte_stride];
        let (to, count, stride) = (out.as_mut_ptr().cast(), self.count, self.byte_stride);
        let (from, length) = (data.as_ptr(), data.len());
        // SAFETY: `out` has count·stride bytes, the decoders read at most `length` bytes, and
        // stride and count were checked against the decoders' preconditions.
        #[expect(unsafe_code, reason = "the safe wrappers want the stride at compile time")]
        let code = unsafe {
            match self.mode.as_str() {
                "ATTRIBUTES" => {
                    meshopt::ffi::meshopt_decodeVertexBuffer(to, count, stride, from, length)
                }
                "TRIANGLES" => {
                    meshopt::ffi::meshopt_decodeIndexBuffer(to, count, stride, from, length)
                }
                _ => meshopt::ffi::meshopt_decodeIndexSequence(to, count, stride, from, length),
            }
        };
        (code == 0).then_some(out)
    }
}

/// Runs a filter over bytes that are a whole number of its elements.
fn each<T: Copy + Default>(bytes: &mut [u8], filter: impl Fn(&mut [T])) {
    let size = size_of::<T>();
    let mut elements = vec![T::default(); bytes.len() / size];
    // SAFETY: the filters' elements are arrays of integers: any bytes are valid, and the lengths
    // are equal by construction.
    #[expect(unsafe_code, reason = "a copy between byte and element buffers of equal length")]
    unsafe {
        let length = elements.len() * size;
        std::ptr::copy_nonoverlapping(bytes.as_ptr(), elements.as_mut_ptr().cast(), length);
        filter(&mut elements);
        std::ptr::copy_nonoverlapping(elements.as_ptr().cast(), bytes.as_mut_ptr(), length);
    }
}
