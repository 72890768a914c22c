//! Measured corrections of the points' areas, by size.
//!
//! Discs are not the leaves they stand for: what they leave bare and what they cover twice depends on
//! the tree. Where the coverage of cuts was measured against the source (`forest-eval` does), the pack
//! carries a factor on the area of points of each size, and renderers multiply.

use crate::size::SizeCode;
use forest_pack::{Codec, Pack, PackError, PackWriter, SectionId, kind};

/// Factors on footprint areas: one for each octave of [`SizeCode`], linear in between.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    factors: [f32; Self::NODES],
    /// Square roots of the interpolated factors: on radii, by size code.
    radii: Vec<f32>,
}

const ID: SectionId = SectionId::new(kind::POINTS_CALIBRATION, 0);

impl Calibration {
    /// Factors: number i is that of size code 80·i.
    pub const NODES: usize = 53;
    /// What a factor may be.
    pub const RANGE: std::ops::RangeInclusive<f32> = 0.25..=4.0;

    /// The factors of all octaves; each is brought into [`Calibration::RANGE`], and NaN to 1.
    pub fn new(factors: [f32; Self::NODES]) -> Self {
        let (low, high) = (*Self::RANGE.start(), *Self::RANGE.end());
        let factors = factors.map(|f| if f.is_nan() { 1.0 } else { f.clamp(low, high) });
        let radii = (0..=SizeCode::INFINITE.bits())
            .map(|code| {
                let at = f64::from(code) / SizeCode::PER_OCTAVE;
                let (i, t) = (at as usize, at.fract() as f32);
                let next = factors[(i + 1).min(Self::NODES - 1)];
                (factors[i] + (next - factors[i]) * t).sqrt()
            })
            .collect();
        Self { factors, radii }
    }

    /// The factors of all octaves.
    pub fn factors(&self) -> &[f32; Self::NODES] {
        &self.factors
    }

    /// Factor on the radius of points of size `code`.
    #[inline]
    pub fn radius_factor(&self, code: SizeCode) -> f64 {
        f64::from(self.radii[usize::from(code.bits())])
    }

    /// Reads the section, if there is one.
    ///
    /// # Errors
    /// When it is damaged or breaks a rule.
    pub fn read(pack: &Pack) -> Result<Option<Self>, PackError> {
        if !pack.contains(ID) {
            return Ok(None);
        }
        let stored: &[f32] = pack.records(ID)?;
        let invalid = |problem: String| PackError::invalid(pack.path(), ID, problem);
        let factors = <[f32; Self::NODES]>::try_from(stored)
            .map_err(|_| invalid(format!("{} factors, not {}", stored.len(), Self::NODES)))?;
        if let Some(i) = factors.iter().position(|f| !Self::RANGE.contains(f)) {
            return Err(invalid(format!("factor {i} is {}, not in {:?}", factors[i], Self::RANGE)));
        }
        Ok(Some(Self::new(factors)))
    }

    /// Writes the section.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn write(&self, writer: &mut PackWriter) -> Result<(), PackError> {
        writer.add(ID, Codec::None, bytemuck::cast_slice(&self.factors))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pack with `factors` in the section.
    fn pack(factors: &[f32]) -> Pack {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.fpack");
        let mut writer = PackWriter::create(&path).unwrap();
        writer.add(ID, Codec::None, bytemuck::cast_slice(factors)).unwrap();
        writer.finish().unwrap();
        Pack::open(&path).unwrap()
    }

    #[test]
    fn only_sound_factors_are_read() {
        let good = [1.5f32; Calibration::NODES];
        assert_eq!(Calibration::read(&pack(&good)).unwrap(), Some(Calibration::new(good)));
        let error = |factors: &[f32]| Calibration::read(&pack(factors)).unwrap_err().to_string();
        assert!(error(&good[1..]).ends_with("points.calibration[0]: 52 factors, not 53"));
        for bad in [f32::NAN, 0.2, 4.5, f32::INFINITY] {
            let mut factors = good;
            factors[7] = bad;
            assert!(error(&factors).contains("factor 7 is "), "{bad}");
        }
        assert_eq!(Calibration::new([f32::NAN; Calibration::NODES]).factors[3], 1.0);
    }

    #[test]
    fn factors_are_linear_between_octaves_and_stay_in_range() {
        let mut factors = [1.0; Calibration::NODES];
        factors[10] = 2.0;
        factors[30] = 9.0;
        let c = Calibration::new(factors);
        let at = |code| c.radius_factor(SizeCode::from_bits(code).unwrap()).powi(2);
        for (code, want) in [(0, 1.0), (800, 2.0), (840, 1.5), (760, 1.5), (2400, 4.0), (4095, 1.0)]
        {
            assert!((at(code) - want).abs() < 1e-6, "{code}: {}", at(code));
        }
    }
}
