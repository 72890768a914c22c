//! What the OBJ parser is given: lines that would make it fail on legal or hostile files are mended,
//! dropped or refused first.

/// Largest magnitude of an index in a face: beyond it no file of ours has elements, and the parser's
/// arithmetic would overflow.
const MAX_INDEX: i64 = 1 << 40;

/// OBJ text without points and lines (they have no area, and the parser takes a line of three
/// points for a face) and without faces of fewer than three corners.
///
/// # Errors
/// The number of a line whose indices are absurd, and the index.
pub(super) fn faces_only(text: &[u8]) -> Result<Vec<u8>, (usize, String)> {
    let mut out = Vec::with_capacity(text.len());
    // Positions, texture coordinates and normals so far.
    let mut counts = [0i64; 3];
    for (number, line) in text.split(|&b| b == b'\n').enumerate() {
        // As the parser splits it; what is no UTF-8 (in comments and names) would end it.
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        let first = words.next();
        if let Some(kind) = ["v", "vt", "vn"].iter().position(|k| first == Some(k)) {
            counts[kind] += 1;
        }
        match first {
            Some("l" | "p") => {}
            Some("f") => {
                let corners: Vec<&str> = words.take_while(|w| !w.starts_with('#')).collect();
                for corner in &corners {
                    check_corner(corner, counts).map_err(|index| (number + 1, index))?;
                }
                if corners.len() >= 3 {
                    out.extend_from_slice(line.as_bytes());
                }
            }
            _ => out.extend_from_slice(line.as_bytes()),
        }
        out.push(b'\n');
    }
    Ok(out)
}

/// Indices below zero count backwards from the elements so far.
fn check_corner(corner: &str, counts: [i64; 3]) -> Result<(), String> {
    let mut indices = corner.split('/').enumerate().filter(|(_, i)| !i.is_empty());
    let least = |kind: usize| -counts.get(kind).copied().unwrap_or(0);
    let wrong = |kind: usize, index: &str| {
        index.parse::<i64>().ok().is_none_or(|i| i > MAX_INDEX || i == 0 || i < least(kind))
    };
    indices.find(|(kind, index)| wrong(*kind, index)).map_or(Ok(()), |(_, i)| Err(i.to_string()))
}

/// MTL text whose colours all have three numbers: a colour of one number is a grey, and the parser
/// takes three for granted.
pub(super) fn whole_colors(text: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    for line in text.split(|&b| b == b'\n') {
        let line = String::from_utf8_lossy(line);
        let words: Vec<&str> = line.split_whitespace().collect();
        let is_color = matches!(words.first(), Some(&("Ka" | "Kd" | "Ks" | "Ke")));
        match (is_color, &words[..]) {
            (true, [_]) => {}
            // "spectral" and "xyz" colours, in whatever form, leave the default.
            (true, [_, first, ..])
                if first.contains(char::is_alphabetic) && first.parse::<f32>().is_err() => {}
            (true, [key, values @ ..]) if values.len() < 3 => {
                let last = values[values.len() - 1];
                let padded = values.iter().copied().chain(std::iter::repeat(last)).take(3);
                out.extend_from_slice(key.as_bytes());
                padded.for_each(|v| {
                    out.push(b' ');
                    out.extend_from_slice(v.as_bytes());
                });
            }
            _ => out.extend_from_slice(line.as_bytes()),
        }
        out.push(b'\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_points_and_bare_faces_are_dropped_and_absurd_indices_refused() {
        let text = b"v 0 0 0\nl 1 2 3\np 1\nf\nf 1 2\nf 1/1 2/2 -1/3 # comment\n";
        let kept = faces_only(text).unwrap();
        assert_eq!(kept, b"v 0 0 0\n\n\n\n\nf 1/1 2/2 -1/3 # comment\n\n");
        let (line, index) = faces_only(b"v 0 0 0\nf 1//6148914691236517206 2 3\n").unwrap_err();
        assert_eq!((line, index.as_str()), (2, "6148914691236517206"));
        assert!(faces_only(b"f 0 1 2\n").is_err());
        // Found by fuzzing: the parser counts on from the end of its numbers.
        let three = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n";
        assert!(faces_only(&[three, &b"f -3/-1 -2 -1"[..]].concat()).is_ok());
        for face in ["f -4 -2 -1", "f -3/-2 -2 -1", "f -3//-1 -2 -1"] {
            assert!(faces_only(&[three, face.as_bytes()].concat()).is_err(), "{face}");
        }
    }

    #[test]
    fn grey_colours_are_made_whole() {
        let mended =
            whole_colors(b"newmtl a\nKd 0.5\nKs 0.1 0.2\nKa spectral file.rfl 1\nKd\nKe 1 2 3\n");
        assert_eq!(mended, b"newmtl a\nKd 0.5 0.5 0.5\nKs 0.1 0.2 0.2\n\n\nKe 1 2 3\n\n");
        // Found by fuzzing: words end at any white space.
        assert_eq!(whole_colors("Kd\u{b}0.5".as_bytes()), b"Kd 0.5 0.5 0.5\n");
    }
}
