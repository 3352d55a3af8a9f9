//! Sections without a flat, and with next to none.

use finger::geometry::Description;
use finger::hyperelastic::Rubber;
use finger::mesh::MeshSize;
use finger::section::Section;
use finger::yeoh::{Inflated, SectionModel};

/// A section in millimetres and degrees at 60 kPa.
fn inflated(outer: f64, bore: f64, offset: f64, flat_deg: f64) -> Inflated {
    let section = Section {
        outer_radius_m: 1e-3 * outer,
        bore_radius_m: 1e-3 * bore,
        bore_offset_m: 1e-3 * offset,
        flat_half_angle_rad: flat_deg.to_radians(),
    };
    let rubber = Rubber::incompressible([0.11e6, 0.02e6, 0.0]);
    SectionModel::new(&section, rubber, MeshSize::STANDARD)
        .and_then(|model| model.inflate(&[60e3]))
        .unwrap_or_else(|error| panic!("R {outer} r {bore} e {offset} α {flat_deg}: {error}"))[0]
}

#[test]
fn a_round_section_is_the_limit_of_a_narrow_flat() {
    for (outer, bore, offset) in [(10.0, 5.0, 2.0), (8.0, 4.0, 1.5), (12.0, 4.0, 6.5)] {
        let narrow = inflated(outer, bore, offset, 0.5);
        for flat_deg in [0.0, 1e-6, 0.01, 0.04, 0.06, 0.1] {
            let round = inflated(outer, bore, offset, flat_deg);
            for (round, narrow) in [
                (round.curvature_per_m, narrow.curvature_per_m),
                (round.stretch, narrow.stretch),
                (round.bending_stiffness_nm2, narrow.bending_stiffness_nm2),
            ] {
                // A tenth of what a finer mesh changes.
                let off = (round / narrow - 1.0).abs();
                assert!(off < 1e-4, "{outer} {bore} {offset} {flat_deg}: {off}");
            }
        }
    }
    // On a mesh of twice as many elements each way: 1.2361 1/m.
    let round = inflated(10.0, 5.0, 2.0, 0.0);
    assert!((round.curvature_per_m / 1.2361 - 1.0).abs() < 3e-4);
}

#[test]
fn a_concentric_tube_stretches_and_does_not_bend() {
    let tube = inflated(10.0, 5.0, 0.0, 0.0);
    assert!(tube.curvature_per_m.abs() < 1e-6, "{tube:?}");
    assert!(tube.stretch > 1.005, "{tube:?}");
}

#[test]
fn a_round_finger_has_a_chain() {
    let recipe = include_str!("../../recipes/rtv225.toml");
    let at = |flat: &str, pressure_kpa: f64| {
        let text = recipe.replacen("flat_half_angle_deg = 56.106", flat, 1);
        assert_ne!(text, recipe);
        let description: Description = toml::from_str(&text).expect("a good recipe");
        let finger = description.check().expect("a good finger");
        let solved = finger.solve(&[pressure_kpa]).expect("solves");
        solved.bends[0].curve.tip_angle_rad()
    };
    let round = at("flat_half_angle_deg = 0.0", 60.0);
    let narrow = at("flat_half_angle_deg = 0.5", 60.0);
    assert!((round / narrow - 1.0).abs() < 1e-4, "{round} {narrow}");
}
