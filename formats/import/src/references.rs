//! What files refer to, without reading that.

use crate::ImportError;
use crate::obj;
use crate::photographs::frame_file;
use crate::source::resolved;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Largest JSON chunk of a binary glTF file that is read: what asks has not checked anything yet.
const MOST_JSON: u64 = 1 << 30;

/// The files that a tree's file, or a `transforms.json`, refers to: at least those that its import would read,
/// and perhaps more (pictures that no material uses). They need not be there.
///
/// # Errors
/// When the file cannot be read, or is so far from its format that its references cannot be found.
pub fn references(path: &Path) -> Result<Vec<PathBuf>, ImportError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let io = |source| ImportError::Io { file: path.into(), source };
    let names = match extension.as_deref() {
        Some("glb" | "gltf") => of_gltf(&json(path).map_err(io)?, path)?,
        Some("json") => of_transforms(&json(path).map_err(io)?, path)?,
        Some("obj") => return of_obj(path).map_err(io),
        _ => BTreeSet::new(),
    };
    Ok(names.iter().map(|n| resolved(path, n)).collect())
}

/// The JSON of a file, or of a binary glTF container.
fn json(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut file = BufReader::new(File::open(path)?);
    let mut bytes = Vec::new();
    if file.fill_buf()?.starts_with(b"glTF") {
        // Magic, version and length; length and type of the first chunk.
        let mut header = [0; 20];
        file.read_exact(&mut header)?;
        let [.., a, b, c, d, _, _, _, _] = header;
        let length = u64::from(u32::from_le_bytes([a, b, c, d]));
        file.take(length.min(MOST_JSON)).read_to_end(&mut bytes)?;
    } else {
        file.take(MOST_JSON).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

fn of_gltf(json: &[u8], path: &Path) -> Result<BTreeSet<String>, ImportError> {
    let root: Value =
        serde_json::from_slice(json).map_err(|e| ImportError::invalid(path, "JSON", e))?;
    let uris = ["buffers", "images"].iter().filter_map(|k| root[k].as_array()).flatten();
    let uris = uris.filter_map(|v| v["uri"].as_str()).filter(|u| !u.starts_with("data:"));
    let decoded = |u: &str| percent_encoding::percent_decode_str(u).decode_utf8_lossy().into();
    Ok(uris.map(decoded).collect())
}

fn of_transforms(json: &[u8], path: &Path) -> Result<BTreeSet<String>, ImportError> {
    let root: Value =
        serde_json::from_slice(json).map_err(|e| ImportError::invalid(path, "JSON", e))?;
    let frames = root["frames"].as_array().into_iter().flatten();
    Ok(frames.filter_map(|f| f["file_path"].as_str()).map(frame_file).collect())
}

/// Material libraries, and the pictures that they name.
fn of_obj(path: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut libraries = BTreeSet::new();
    for_lines(path, |line| {
        if let Some(name) = line.strip_prefix("mtllib") {
            // As one name, or as several.
            libraries.extend(name.split_whitespace().map(String::from));
            libraries.insert(name.trim().into());
        }
    })?;
    let mut out = BTreeSet::new();
    for library in libraries.iter().map(|l| resolved(path, l)) {
        // It may be missing, or half of a name.
        let _ = for_lines(&library, |line| {
            let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let key = key.to_ascii_lowercase();
            if key.starts_with("map_") || key == "bump" || key == "norm" {
                out.insert(resolved(path, obj::picture_name(value)));
            }
        });
        out.insert(library);
    }
    Ok(out.into_iter().collect())
}

fn for_lines(path: &Path, mut tell: impl FnMut(&str)) -> std::io::Result<()> {
    let mut file = BufReader::new(File::open(path)?);
    let mut line = Vec::new();
    while file.read_until(b'\n', &mut line)? > 0 {
        // Most lines are numbers.
        if !line.starts_with(b"v") && !line.starts_with(b"f") {
            tell(String::from_utf8_lossy(&line).trim());
        }
        line.clear();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(file: &str, text: &[u8], others: &[(&str, &str)]) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes);
        write(file, text).unwrap();
        others.iter().for_each(|(name, text)| write(name, text.as_bytes()).unwrap());
        let found = references(&folder.path().join(file)).unwrap();
        let name = |p: &PathBuf| p.strip_prefix(folder.path()).unwrap().display().to_string();
        found.iter().map(name).collect()
    }

    #[test]
    fn gltf_names_buffers_and_images_in_either_container() {
        let json = br#"{"buffers":[{"uri":"a%20b.bin"},{"uri":"data:x"},{}],"images":[{"uri":"t/bark.png"}]}"#;
        let want = ["a b.bin", "t/bark.png"];
        assert_eq!(names("t.gltf", json, &[]), want);
        let mut glb = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        glb.extend((json.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(json);
        glb.extend(b"\x04\0\0\0BIN\0abcd");
        assert_eq!(names("t.glb", &glb, &[]), want);
    }

    #[test]
    fn obj_names_libraries_and_their_pictures() {
        let obj = b"# tree\nmtllib my tree.mtl\nv 0 0 0\n";
        let mtl = "newmtl a\nmap_Kd -s 2 2 2 leaf card.png\n  bump -bm 0.5 bark.png\nKd 1 1 1\n";
        let found = names("t.obj", obj, &[("my tree.mtl", mtl)]);
        for want in ["my tree.mtl", "leaf card.png", "bark.png"] {
            assert!(found.iter().any(|n| n == want), "{want}: {found:?}");
        }
    }

    #[test]
    fn captures_name_their_photographs_with_the_extension_that_is_read() {
        let json = br#"{"frames":[{"file_path":"./r_0"},{"file_path":"images/1.webp"}]}"#;
        assert_eq!(names("transforms.json", json, &[]), ["r_0.png", "images/1.webp"]);
    }
}
