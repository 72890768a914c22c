//! Accessors as arrays of `f64` or indices: any component type, stride, normalised or not, sparse.

use super::buffers::Buffers;
use super::missing;
use crate::ImportError;
use crate::source::Source;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

/// Reads accessors of one file.
pub(crate) struct Reader<'a> {
    pub(crate) source: &'a Source<'a>,
    pub(crate) root: &'a Root,
    pub(crate) buffers: &'a Buffers,
}

/// Where elements lie in a view.
struct Layout {
    component: ComponentType,
    components: usize,
    stride: usize,
    offset: usize,
    count: usize,
    normalized: bool,
}

impl Reader<'_> {
    /// What `made` makes of elements of `N` numbers; `kinds` are the accessor types that may be read as such
    /// (missing components stay as in `fill`).
    pub(crate) fn numbers<const N: usize, T>(
        &self,
        element: &str,
        index: Index<Accessor>,
        kinds: &[Type],
        fill: [f64; N],
        made: impl Fn([f64; N]) -> T,
    ) -> Result<Vec<T>, ImportError> {
        let mut out = self.read(element, index, kinds, |values| {
            let mut v = fill;
            v.iter_mut().zip(values).for_each(|(v, x)| *v = x);
            made(v)
        })?;
        let sparse = self.sparse(element, index)?;
        if let Some((at, values)) = sparse {
            for (i, target) in at.into_iter().enumerate() {
                let count = out.len();
                let slot = out.get_mut(target as usize).ok_or_else(|| {
                    missing(self.source, element, "sparse index", target as usize, count)
                })?;
                let mut v = fill;
                v.iter_mut().zip(values(i)?).for_each(|(v, x)| *v = x);
                *slot = made(v);
            }
        }
        Ok(out)
    }

    /// Unsigned integers: vertex indices.
    pub(crate) fn indices(
        &self,
        element: &str,
        index: Index<Accessor>,
    ) -> Result<Vec<u32>, ImportError> {
        let accessor = self.accessor(element, index)?;
        let Checked::Valid(component) = accessor.component_type.as_ref() else {
            return Err(self.source.invalid(element, "unknown component type"));
        };
        if !matches!(component.0, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            let problem = format!("indices of component type {:?}", component.0);
            return Err(self.source.invalid(element, problem));
        }
        // Every u32 is exact in an f64.
        self.numbers(element, index, &[Type::Scalar], [0.0], |[v]| v as u32)
    }

    fn accessor(&self, element: &str, index: Index<Accessor>) -> Result<&Accessor, ImportError> {
        let count = self.root.accessors.len();
        let at = index.value();
        self.root
            .accessors
            .get(at)
            .ok_or_else(|| missing(self.source, element, "accessor", at, count))
    }

    fn read<T>(
        &self,
        element: &str,
        index: Index<Accessor>,
        kinds: &[Type],
        each: impl Fn(Components) -> T,
    ) -> Result<Vec<T>, ImportError> {
        let element = format!("{element}, accessor {}", index.value());
        let accessor = self.accessor(&element, index)?;
        let (Checked::Valid(component), Checked::Valid(kind)) =
            (accessor.component_type.as_ref(), accessor.type_.as_ref())
        else {
            return Err(self.source.invalid(element, "unknown type or component type"));
        };
        if !kinds.contains(kind) {
            let problem = format!("is {kind:?}; it must be one of {kinds:?}");
            return Err(self.source.invalid(element, problem));
        }
        let components = kind.multiplicity();
        let count = accessor.count.0 as usize;
        let Some(view_index) = accessor.buffer_view else {
            // Without a view all elements are zero, and sparse values replace some of them. A view
            // bounds the count by its bytes; here something else must.
            if accessor.sparse.is_none() || count > ZERO_LIMIT {
                let problem = format!("{count} elements without a bufferView");
                return Err(self.source.invalid(element, problem));
            }
            self.source.charge(&element, (count * size_of::<T>()) as u64)?;
            let zeros = [0u8; 64];
            return Ok((0..count).map(|_| each(Components::zeros(&zeros, components))).collect());
        };
        let view = self.buffers.view(self.source, self.root, view_index.value())?;
        let layout = Layout {
            component: component.0,
            components,
            stride: view.stride.unwrap_or(component.0.size() * components),
            offset: accessor.byte_offset.map_or(0, |o| o.0 as usize),
            count,
            normalized: accessor.normalized,
        };
        layout.check(&view.bytes).map_err(|problem| self.source.invalid(&element, problem))?;
        self.source.charge(&element, count as u64 * size_of::<T>() as u64)?;
        Ok((0..count).map(|i| each(layout.element(&view.bytes, i))).collect())
    }

    /// Sparse indices and a function to the values.
    #[expect(clippy::type_complexity, reason = "one caller, in this file")]
    fn sparse<'b>(
        &'b self,
        element: &'b str,
        index: Index<Accessor>,
    ) -> Result<
        Option<(Vec<u32>, Box<dyn Fn(usize) -> Result<Vec<f64>, ImportError> + 'b>)>,
        ImportError,
    > {
        let accessor = self.accessor(element, index)?;
        let (Some(sparse), Checked::Valid(component), Checked::Valid(kind)) =
            (&accessor.sparse, accessor.component_type.as_ref(), accessor.type_.as_ref())
        else {
            return Ok(None);
        };
        let Checked::Valid(index_type) = sparse.indices.component_type.as_ref() else {
            return Err(self.source.invalid(element, "unknown sparse index type"));
        };
        let count = sparse.count.0 as usize;
        let layout =
            |component: ComponentType, components: usize, offset: u64, normalized| Layout {
                component,
                components,
                stride: component.size() * components,
                offset: offset as usize,
                count,
                normalized,
            };
        let at = layout(index_type.0, 1, sparse.indices.byte_offset.0, false);
        let to = layout(
            component.0,
            kind.multiplicity(),
            sparse.values.byte_offset.0,
            accessor.normalized,
        );
        let view = |i: usize| self.buffers.view(self.source, self.root, i);
        let index_view = view(sparse.indices.buffer_view.value())?;
        let value_view = view(sparse.values.buffer_view.value())?;
        for (l, v) in [(&at, &index_view), (&to, &value_view)] {
            l.check(&v.bytes).map_err(|problem| self.source.invalid(element, problem))?;
        }
        let indices = (0..count)
            .map(|i| at.element(&index_view.bytes, i).next().unwrap_or(0.0) as u32)
            .collect();
        let values = move |i: usize| Ok(to.element(&value_view.bytes, i).collect());
        Ok(Some((indices, Box::new(values))))
    }
}

/// Elements that an accessor without a view may have.
const ZERO_LIMIT: usize = 1 << 22;

impl Layout {
    fn check(&self, bytes: &[u8]) -> Result<(), String> {
        let size = self.component.size() * self.components;
        let last = self.count.saturating_sub(1).checked_mul(self.stride);
        let end = last.and_then(|l| l.checked_add(self.offset)).and_then(|l| l.checked_add(size));
        if self.stride < size {
            return Err(format!("stride {} for elements of {size} bytes", self.stride));
        }
        if self.count > 0 && end.is_none_or(|e| e > bytes.len()) {
            let (n, s, o) = (self.count, self.stride, self.offset);
            return Err(format!(
                "{n} elements at stride {s} from offset {o} in {} bytes",
                bytes.len()
            ));
        }
        Ok(())
    }

    fn element<'b>(&self, bytes: &'b [u8], i: usize) -> Components<'b> {
        let start = self.offset + i * self.stride;
        let size = self.component.size() * self.components;
        Components {
            bytes: &bytes[start..start + size],
            component: self.component,
            normalized: self.normalized,
        }
    }
}

/// The numbers of one element.
struct Components<'b> {
    bytes: &'b [u8],
    component: ComponentType,
    normalized: bool,
}

impl<'b> Components<'b> {
    fn zeros(zeros: &'b [u8; 64], components: usize) -> Self {
        Self { bytes: &zeros[..components * 4], component: ComponentType::F32, normalized: false }
    }
}

impl Iterator for Components<'_> {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        if self.bytes.is_empty() {
            return None;
        }
        let (head, rest) = self.bytes.split_at(self.component.size());
        self.bytes = rest;
        let scaled = |v: f64, full: f64| if self.normalized { (v / full).max(-1.0) } else { v };
        Some(match (self.component, head) {
            (ComponentType::I8, &[a]) => scaled(f64::from(a as i8), 127.0),
            (ComponentType::U8, &[a]) => scaled(f64::from(a), 255.0),
            (ComponentType::I16, &[a, b]) => scaled(f64::from(i16::from_le_bytes([a, b])), 32767.0),
            (ComponentType::U16, &[a, b]) => scaled(f64::from(u16::from_le_bytes([a, b])), 65535.0),
            (ComponentType::U32, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
            (ComponentType::F32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => unreachable!("split at the component's size"),
        })
    }
}
