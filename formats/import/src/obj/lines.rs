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
    for (number, line) in text.split(|&b| b == b'\n').enumerate() {
        let mut words = line.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty());
        match words.next() {
            Some(b"l" | b"p") => {}
            Some(b"f") => {
                let corners: Vec<&[u8]> = words.take_while(|w| !w.starts_with(b"#")).collect();
                for corner in &corners {
                    check_corner(corner).map_err(|index| (number + 1, index))?;
                }
                if corners.len() >= 3 {
                    out.extend_from_slice(line);
                }
            }
            _ => out.extend_from_slice(line),
        }
        out.push(b'\n');
    }
    Ok(out)
}

fn check_corner(corner: &[u8]) -> Result<(), String> {
    let text = String::from_utf8_lossy(corner);
    for index in text.split('/').filter(|i| !i.is_empty()) {
        if index.parse::<i64>().ok().is_none_or(|i| i.abs() > MAX_INDEX || i == 0) {
            return Err(index.to_string());
        }
    }
    Ok(())
}

/// MTL text whose colours all have three numbers: a colour of one number is a grey, and the parser
/// takes three for granted.
pub(super) fn whole_colors(text: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    for line in text.split(|&b| b == b'\n') {
        let words: Vec<&[u8]> =
            line.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty()).collect();
        let is_color = matches!(words.first(), Some(&(b"Ka" | b"Kd" | b"Ks" | b"Ke")));
        match (is_color, &words[..]) {
            (true, [_]) => {}
            // "spectral" and "xyz" colours, in whatever form, leave the default.
            (true, [_, first, ..])
                if first.iter().any(u8::is_ascii_alphabetic) && !is_number(first) => {}
            (true, [key, values @ ..]) if values.len() < 3 => {
                let last = values[values.len() - 1];
                let padded = values.iter().copied().chain(std::iter::repeat(last)).take(3);
                out.extend_from_slice(key);
                padded.for_each(|v| {
                    out.push(b' ');
                    out.extend_from_slice(v);
                });
            }
            _ => out.extend_from_slice(line),
        }
        out.push(b'\n');
    }
    out
}

fn is_number(word: &[u8]) -> bool {
    std::str::from_utf8(word).is_ok_and(|w| w.parse::<f32>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_points_and_bare_faces_are_dropped_and_absurd_indices_refused() {
        let text = b"v 0 0 0\nl 1 2 3\np 1\nf\nf 1 2\nf 1/1 2/2 -3/3 # comment\n";
        let kept = faces_only(text).unwrap();
        assert_eq!(kept, b"v 0 0 0\n\n\n\n\nf 1/1 2/2 -3/3 # comment\n\n");
        let (line, index) = faces_only(b"v 0 0 0\nf 1//6148914691236517206 2 3\n").unwrap_err();
        assert_eq!((line, index.as_str()), (2, "6148914691236517206"));
        assert!(faces_only(b"f 0 1 2\n").is_err());
    }

    #[test]
    fn grey_colours_are_made_whole() {
        let mended =
            whole_colors(b"newmtl a\nKd 0.5\nKs 0.1 0.2\nKa spectral file.rfl 1\nKd\nKe 1 2 3\n");
        assert_eq!(mended, b"newmtl a\nKd 0.5 0.5 0.5\nKs 0.1 0.2 0.2\n\n\nKe 1 2 3\n\n");
    }
}
