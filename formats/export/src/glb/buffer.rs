//! The binary chunk of a glb: views and accessors, as they are added.

use bytemuck::Pod;
use serde_json::{Value, json};

/// glTF's numbers for what a view holds.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// glTF's numbers for types of components.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// The names of types with 1 … 4 components.
const TYPES: [&str; 4] = ["SCALAR", "VEC2", "VEC3", "VEC4"];

/// A binary chunk in the making. What is added gets the next number.
#[derive(Default)]
pub(crate) struct Binary {
    pub(crate) bytes: Vec<u8>,
    pub(crate) views: Vec<Value>,
    pub(crate) accessors: Vec<Value>,
}

impl Binary {
    /// Bytes as a view.
    pub(crate) fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, component: u32, kind: &str, count: usize) -> usize {
        self.accessors.push(json!({
            "bufferView": view, "componentType": component, "type": kind, "count": count,
        }));
        self.accessors.len() - 1
    }

    /// Floats of `N` components a vertex.
    pub(crate) fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize
    where
        [f32; N]: Pod,
    {
        let view = self.view(bytemuck::cast_slice(rows), Some(ARRAY_BUFFER));
        self.accessor(view, FLOAT, TYPES[N - 1], rows.len())
    }

    /// Places, with the box around them that glTF asks for.
    pub(crate) fn positions(&mut self, rows: &[[f32; 3]]) -> usize {
        let number = self.floats(rows);
        let bound = |pick: fn(f32, f32) -> f32| -> Value {
            [0, 1, 2].map(|k| rows.iter().map(|p| p[k]).reduce(pick).unwrap_or(0.0)).to_vec().into()
        };
        self.accessors[number]["min"] = bound(f32::min);
        self.accessors[number]["max"] = bound(f32::max);
        number
    }

    /// Parts of one, as 16-bit fractions.
    pub(crate) fn fractions(&mut self, rows: &[[f32; 4]]) -> usize {
        let code = |v: f32| (v.clamp(0.0, 1.0) * 65535.0).round() as u16;
        let codes: Vec<[u16; 4]> = rows.iter().map(|r| r.map(code)).collect();
        let view = self.view(bytemuck::cast_slice(&codes), Some(ARRAY_BUFFER));
        let number = self.accessor(view, UNSIGNED_SHORT, TYPES[3], rows.len());
        self.accessors[number]["normalized"] = true.into();
        number
    }

    /// Corners of triangles.
    pub(crate) fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let view = self.view(bytemuck::cast_slice(triangles), Some(ELEMENT_ARRAY_BUFFER));
        self.accessor(view, UNSIGNED_INT, TYPES[0], 3 * triangles.len())
    }
}
