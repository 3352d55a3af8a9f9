//! Closed-form properties of the finger's cross-section (paper, appendix, eqs. 38–45).
//!
//! ```text
//!        ___         y, thin side, +
//!     .´  _  `.      |
//!    /  /   \  \     bore: radius r, centre at y = +e
//!   |  |  ·  |  |
//!    \  \_ _/  /     origin: centre of the outer circle, radius R
//!     `-------´      flat: chord at y = -R cos α, thick side
//! ```
//!
//! The printed text lacks eqs. 38–42, and eq. 43 prints `r_i sin α` where only `R sin α` closes the
//! segment; the forms here are the outer circle less bore less segment, and agree with strip integration.

use std::f64::consts::PI;

/// The cross-section of the finger at one station.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Radius `R` of the outer circle, m.
    pub outer_radius_m: f64,
    /// Radius `r` of the bore, m; 0 for a solid section.
    pub bore_radius_m: f64,
    /// Distance `e` of the bore's centre from the outer circle's, away from the flat, m.
    pub bore_offset_m: f64,
    /// Half the angle `α` that the flat subtends at the outer circle's centre, rad; 0 for no flat.
    pub flat_half_angle_rad: f64,
}

/// Why four numbers are no section.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SectionError {
    /// A dimension is negative, not finite, or an outer radius of zero.
    #[error("{name} = {value}: must be finite and {expected}")]
    Dimension {
        /// Which one, as messages call it.
        name: &'static str,
        /// Its value, m or rad.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// The bore breaks through the outer circle on the thin side.
    #[error(
        "the wall opposite the flat is {:.3} mm thick: bore offset plus bore radius must stay below \
         the outer radius", 1e3 * thickness_m
    )]
    ThinWall {
        /// `R − e − r`, m.
        thickness_m: f64,
    },
    /// The bore breaks through the flat.
    #[error(
        "the wall at the flat is {:.3} mm thick: bore radius less bore offset must stay below the \
         flat's distance from the centre, {:.3} mm", 1e3 * thickness_m, 1e3 * flat_m
    )]
    FlatWall {
        /// `R cos α + e − r`, m.
        thickness_m: f64,
        /// `R cos α`, m.
        flat_m: f64,
    },
}

impl Section {
    /// Checks that the section is closed: every dimension in range and a wall all around the bore.
    ///
    /// # Errors
    /// The first [`SectionError`] that applies.
    pub fn check(&self) -> Result<(), SectionError> {
        let within = |name, value: f64, ok: bool, expected| {
            if value.is_finite() && ok {
                Ok(())
            } else {
                Err(SectionError::Dimension {
                    name,
                    value,
                    expected,
                })
            }
        };
        let (outer, bore) = (self.outer_radius_m, self.bore_radius_m);
        let (offset, angle) = (self.bore_offset_m, self.flat_half_angle_rad);
        within("outer radius", outer, outer > 0.0, "positive")?;
        within("bore radius", bore, bore >= 0.0, "not negative")?;
        within("bore offset", offset, offset >= 0.0, "not negative")?;
        within(
            "flat half-angle",
            angle,
            (0.0..PI / 2.0).contains(&angle),
            "from 0 to below a right angle",
        )?;
        let thickness_m = self.thin_wall_m();
        if thickness_m <= 0.0 {
            return Err(SectionError::ThinWall { thickness_m });
        }
        let flat_m = outer * angle.cos();
        let thickness_m = flat_m + offset - bore;
        if thickness_m <= 0.0 {
            return Err(SectionError::FlatWall {
                thickness_m,
                flat_m,
            });
        }
        Ok(())
    }

    /// The section with the same outline and no bore: what it is beyond the bore's end.
    pub fn solid(&self) -> Self {
        Self {
            bore_radius_m: 0.0,
            bore_offset_m: 0.0,
            ..*self
        }
    }

    /// Wall opposite the flat, `R − e − r`, m.
    pub fn thin_wall_m(&self) -> f64 {
        self.outer_radius_m - self.bore_offset_m - self.bore_radius_m
    }

    /// Area of the bore, m².
    pub fn bore_area_m2(&self) -> f64 {
        PI * self.bore_radius_m.powi(2)
    }

    /// Area of the material, `A = π(R² − r²) − R²(α − sin α cos α)`, m².
    pub fn area_m2(&self) -> f64 {
        let (sin, cos) = self.flat_half_angle_rad.sin_cos();
        let r2 = self.outer_radius_m.powi(2);
        PI * r2 - self.bore_area_m2() - r2 * (self.flat_half_angle_rad - sin * cos)
    }

    /// Centroid of the material, `Yc = (⅔R³ sin³α − eπr²)/A` (eq. 43, corrected), m towards the thin side.
    pub fn centroid_m(&self) -> f64 {
        let sin = self.flat_half_angle_rad.sin();
        let segment = 2.0 / 3.0 * (self.outer_radius_m * sin).powi(3);
        (segment - self.bore_offset_m * self.bore_area_m2()) / self.area_m2()
    }

    /// Second moment about the axis through the outer circle's centre parallel to the flat, m⁴:
    /// `I_O = πR⁴/4 − πr⁴/4 − πr²e² − R⁴/4 (α − sin α cos α + 2 sin³α cos α)`.
    pub fn second_moment_about_centre_m4(&self) -> f64 {
        let (sin, cos) = self.flat_half_angle_rad.sin_cos();
        let r4 = self.outer_radius_m.powi(4) / 4.0;
        let bore =
            self.bore_area_m2() * (self.bore_radius_m.powi(2) / 4.0 + self.bore_offset_m.powi(2));
        let segment = r4 * (self.flat_half_angle_rad - sin * cos + 2.0 * sin.powi(3) * cos);
        PI * r4 - bore - segment
    }

    /// Second moment about the centroid, `I_xC = I_O − A Yc²` (eq. 38), m⁴.
    pub fn second_moment_m4(&self) -> f64 {
        self.second_moment_about_centre_m4() - self.area_m2() * self.centroid_m().powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Area, first and second moment about the centre by midpoint strips of equal height.
    fn strips(section: &Section) -> [f64; 3] {
        let bottom = -section.outer_radius_m * section.flat_half_angle_rad.cos();
        let n = 40_000;
        let h = (section.outer_radius_m - bottom) / f64::from(n);
        let chord = |radius: f64, y: f64| 2.0 * (radius * radius - y * y).max(0.0).sqrt();
        let mut sums = [0.0; 3];
        for i in 0..n {
            let y = bottom + (f64::from(i) + 0.5) * h;
            let width = chord(section.outer_radius_m, y)
                - chord(section.bore_radius_m, y - section.bore_offset_m);
            for (power, sum) in sums.iter_mut().enumerate() {
                *sum += width * h * y.powi(power as i32);
            }
        }
        sums
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn agrees_with_strip_integration(
            outer in 2e-3f64..20e-3,
            bore in 0.05f64..0.6,
            offset in 0.0f64..0.9,
            angle in 0.0f64..1.1,
        ) {
            let bore = bore * outer;
            let section = Section {
                outer_radius_m: outer,
                bore_radius_m: bore,
                bore_offset_m: offset * (outer - bore),
                flat_half_angle_rad: angle,
            };
            prop_assume!(section.check().is_ok());
            let [area, first, second] = strips(&section);
            prop_assert!((section.area_m2() / area - 1.0).abs() < 1e-5);
            prop_assert!((section.centroid_m() - first / area).abs() < 1e-5 * outer);
            let about_centroid = second - first * first / area;
            prop_assert!((section.second_moment_about_centre_m4() / second - 1.0).abs() < 1e-5);
            prop_assert!((section.second_moment_m4() / about_centroid - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn an_open_section_is_named() {
        let good = Section {
            outer_radius_m: 10e-3,
            bore_radius_m: 5e-3,
            bore_offset_m: 2e-3,
            flat_half_angle_rad: 1.0,
        };
        assert_eq!(good.check(), Ok(()));
        assert_eq!(good.solid().check(), Ok(()));
        for (section, expected) in [
            (
                Section {
                    bore_offset_m: 5e-3,
                    ..good
                },
                "the wall opposite the flat is 0.000 mm",
            ),
            (
                Section {
                    bore_radius_m: 7.5e-3,
                    ..good
                },
                "the wall at the flat is -0.097 mm",
            ),
            (
                Section {
                    bore_radius_m: -1e-3,
                    ..good
                },
                "bore radius = -0.001: must be finite and not negative",
            ),
            (
                Section {
                    outer_radius_m: f64::NAN,
                    ..good
                },
                "outer radius = NaN",
            ),
            (
                Section {
                    flat_half_angle_rad: 1.6,
                    ..good
                },
                "flat half-angle = 1.6",
            ),
        ] {
            // The wall opposite the flat is the first to be looked at.
            let message = match section.check() {
                Err(error) => error.to_string(),
                Ok(()) => panic!("{section:?} was accepted"),
            };
            assert!(message.contains(expected), "{message}");
        }
    }
}
