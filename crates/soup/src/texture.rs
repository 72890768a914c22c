//! Images as files hold them: 8-bit sRGB with straight alpha.

/// What happens outside `0..1` (glTF sampler wrap modes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// Every second repeat is mirrored.
    Mirror,
    /// The outermost texels go on for ever.
    Clamp,
}

impl Wrap {
    /// The texel that coordinate `i` (any integer) falls on in a row of `n` texels.
    #[inline]
    pub fn index(self, i: i64, n: u32) -> usize {
        let n = i64::from(n);
        (match self {
            Wrap::Repeat => {
                if (0..n).contains(&i) {
                    i
                } else {
                    i.rem_euclid(n)
                }
            }
            Wrap::Mirror => {
                let m = i.rem_euclid(2 * n);
                if m < n { m } else { 2 * n - 1 - m }
            }
            Wrap::Clamp => i.clamp(0, n - 1),
        }) as usize
    }
}

/// A decoded image: `width × height` texels, row 0 on top (glTF's v = 0), sRGB-encoded colour and
/// straight linear alpha, 8 bits each. 16-bit sources are rounded to 8 bits at import.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Name or path in the source; for messages.
    pub name: String,
    /// Texels in a row, ≥ 1.
    pub width: u32,
    /// Rows, ≥ 1.
    pub height: u32,
    /// `width · height` RGBA texels.
    pub texels: Vec<[u8; 4]>,
    /// Wrap modes along u and v.
    pub wrap: [Wrap; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrap_modes_follow_the_gltf_sampler_rules() {
        let row = |w: Wrap| (-3..7).map(|i| w.index(i, 3)).collect::<Vec<_>>();
        assert_eq!(row(Wrap::Repeat), [0, 1, 2, 0, 1, 2, 0, 1, 2, 0]);
        assert_eq!(row(Wrap::Mirror), [2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
        assert_eq!(row(Wrap::Clamp), [0, 0, 0, 0, 1, 2, 2, 2, 2, 2]);
    }
}
