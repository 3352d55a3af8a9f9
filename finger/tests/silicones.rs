//! Rubbers as they are published, in a section of a finger.

use std::path::Path;

use finger::hyperelastic::Rubber;
use finger::mesh::MeshSize;
use finger::section::Section;
use finger::yeoh::{Inflated, InflationError, SectionModel};

const SECTION: Section = Section {
    outer_radius_m: 10e-3,
    bore_radius_m: 5e-3,
    bore_offset_m: 2e-3,
    flat_half_angle_rad: std::f64::consts::FRAC_PI_6,
};

fn inflate(rubber: Rubber, pressures_pa: &[f64]) -> Result<Vec<Inflated>, InflationError> {
    SectionModel::new(&SECTION, rubber, MeshSize::STANDARD)?.inflate(pressures_pa)
}

fn yeoh_mpa(constants: [f64; 3]) -> Rubber {
    Rubber::incompressible(constants.map(|mpa| 1e6 * mpa))
}

/// Fits to tensile tests of cast silicones from Shore 00-30 to A 50, most with a negative last constant.
const SILICONES_MPA: [[f64; 3]; 8] = [
    // Ecoflex 00-30 (Steck et al., J. Appl. Polym. Sci. 136, 2019).
    [0.017, -0.000_2, 0.000_023],
    // Ecoflex 00-50 (Elsayed et al., Soft Robotics 1, 2014).
    [0.019, 0.000_9, -0.000_004_75],
    // As soft as, in this order, Dragon Skin 10, 20 and 30, Elastosil M4601, Smooth-Sil 940 and 950.
    [0.032, 0.002_6, -0.000_12],
    [0.061, 0.007_4, -0.000_61],
    [0.094, 0.011, -0.000_9],
    [0.112, 0.022, -0.002_5],
    [0.21, 0.045, -0.009],
    [0.33, 0.061, -0.014],
];

#[test]
fn silicones_with_a_negative_constant_bend_where_they_are_stable() {
    for constants in SILICONES_MPA {
        let [c1, c2, _] = constants;
        // In proportion to the stiffness, as all that follows.
        let pressures_pa = [0.1, 0.2, 0.3].map(|share| 1e6 * c1 * share);
        let states = inflate(yeoh_mpa(constants), &pressures_pa)
            .unwrap_or_else(|error| panic!("{constants:?}: {error}"));
        let cut = inflate(yeoh_mpa([c1, c2, 0.0]), &pressures_pa).expect("stable");
        for (pair, cut) in states.windows(2).zip(&cut) {
            assert!(pair[1].curvature_per_m > pair[0].curvature_per_m);
            // The last constant has next to no say at small stretches.
            let off = pair[0].curvature_per_m / cut.curvature_per_m - 1.0;
            assert!(off.abs() < 0.01, "{constants:?}: {off}");
        }
    }
}

#[test]
fn beyond_the_stretches_of_its_fit_an_energy_is_refused_with_stretch_and_pressure() {
    for constants in [
        [0.055, 0.015, -0.002_2],
        [0.1, 0.03, -0.006],
        [0.086_56, 0.013_8, -0.001_466],
        [0.061, 0.007_4, -0.000_61],
    ] {
        let rubber = yeoh_mpa(constants);
        let error = inflate(rubber, &[20e3, 160e3]).expect_err("unstable");
        let InflationError::Unstable {
            stretches,
            pressure_pa,
        } = error
        else {
            panic!("{constants:?}: {error}");
        };
        // The stretches are where the energy ends: short of them it is stable, beyond it is not.
        let at = |share: f64| stretches.map(|stretch| stretch.powf(share));
        assert!(rubber.energy.is_stable_at(at(0.999)), "{stretches:?}");
        assert!(!rubber.energy.is_stable_at(at(1.001)), "{stretches:?}");
        assert!((stretches.iter().product::<f64>() - 1.0).abs() < 0.05);
        // Just below that pressure there is an answer.
        assert!(inflate(rubber, &[pressure_pa - 200.0]).is_ok());
        let words = format!("unstable beyond a stretch of {:.2} (with ", stretches[0]);
        assert!(error.to_string().contains(&words), "{error}");
        let words = format!("reached at {:.1} kPa", 1e-3 * pressure_pa);
        assert!(error.to_string().contains(&words), "{error}");
    }
}

#[test]
fn a_section_that_balloons_far_from_the_end_of_its_energy_balloons() {
    for constants in [[0.1, 0.0, 0.0], [0.1, 0.0, -0.000_1]] {
        let error = inflate(yeoh_mpa(constants), &[160e3]).expect_err("balloons");
        assert!(matches!(error, InflationError::Balloons { .. }), "{error}");
    }
}

#[test]
fn one_rubber_under_three_names_bends_alike() {
    let pressures_pa = [10e3, 30e3];
    let states = |rubber| inflate(rubber, &pressures_pa).expect("stable");
    let (c10, c01) = (0.07e6, 0.02e6);
    let mooney = states(Rubber::mooney_rivlin([c10, c01]));
    for same in [
        Rubber::ogden(&[[2.0 * c10, 2.0], [-2.0 * c01, -2.0]]),
        Rubber::ogden_abaqus(&[[2.0 * c10, 2.0], [2.0 * c01, -2.0]]),
    ] {
        for (a, b) in mooney.iter().zip(states(same)) {
            assert!((a.curvature_per_m / b.curvature_per_m - 1.0).abs() < 1e-9);
        }
    }
    let neo = states(Rubber::incompressible([c10, 0.0, 0.0]));
    for (a, b) in neo.iter().zip(states(Rubber::mooney_rivlin([c10, 0.0]))) {
        assert!((a.curvature_per_m / b.curvature_per_m - 1.0).abs() < 1e-9);
        assert!((a.bending_stiffness_nm2 / b.bending_stiffness_nm2 - 1.0).abs() < 1e-9);
    }
}

#[test]
fn ogdens_rubbers_bend_and_stiffen_as_their_exponents_say() {
    // Vulcanised natural rubber (Ogden, Proc. R. Soc. A 326, 1972): three terms, MPa.
    let natural = Rubber::ogden(&[[0.63e6, 1.3], [0.0012e6, 5.0], [-0.01e6, -2.0]]);
    let modulus = 1.5e6 * (0.63 * 1.3 + 0.0012 * 5.0 + 0.01 * 2.0);
    assert!((natural.youngs_modulus_pa() / modulus - 1.0).abs() < 1e-12);
    // As soft as Ecoflex 00-30, in the form that finite-element programs print.
    let soft = Rubber::ogden_abaqus(&[[1.9e3, -3.8], [22.0e3, 0.7], [3.6e3, 4.2]]);
    for rubber in [natural, soft] {
        let unit = rubber.youngs_modulus_pa();
        let states = inflate(rubber, &[0.02 * unit, 0.05 * unit]).expect("stable");
        assert!(states[1].curvature_per_m > 2.0 * states[0].curvature_per_m);
        let beam = unit * SECTION.second_moment_m4();
        let rest = inflate(rubber, &[0.0]).expect("rest")[0];
        assert!((rest.bending_stiffness_nm2 / beam - 1.0).abs() < 0.01);
    }
    // Of two rubbers with one modulus only the one that does not stiffen with stretch balloons.
    let at_120_kpa = |alpha| inflate(Rubber::ogden_abaqus(&[[0.2e6, alpha]]), &[120e3]);
    assert!(matches!(
        at_120_kpa(2.0),
        Err(InflationError::Balloons { .. })
    ));
    assert!(at_120_kpa(6.0).is_ok());
}

#[test]
fn what_is_no_rubber_at_small_strain_is_refused() {
    for (rubber, expected) in [
        (
            yeoh_mpa([-0.1, 0.2, 0.3]),
            "C1 = -100000 Pa: must be finite and positive",
        ),
        (
            Rubber::mooney_rivlin([0.1e6, -0.2e6]),
            "shear modulus = -200000 Pa: must be finite and positive",
        ),
        (
            Rubber::ogden_abaqus(&[[0.1e6, 0.0]]),
            "Ogden's exponent is 0: must be finite and not zero",
        ),
    ] {
        let error = inflate(rubber, &[1e3]).expect_err("no rubber");
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn a_recipe_names_the_field_the_stretch_the_pressure_and_the_place() {
    let recipe = include_str!("../../recipes/rtv225.toml");
    let with = |rubber: &str, max: &str| {
        let text = recipe
            .replacen("yeoh_mpa = [0.1, 0.02, 0.0002]", rubber, 1)
            .replacen("max_pressure_kpa = 160.0", max, 1);
        assert!(text.contains(rubber) && text.contains(max));
        finger::recipe::parse(Path::new("x.toml"), &text)
    };
    let ends = "yeoh_mpa = [0.0551, 0.01521, -0.002194]";
    let error = with(ends, "max_pressure_kpa = 160.0").expect_err("unstable");
    let message = error.to_string();
    for words in [
        "x.toml: rubber.yeoh_mpa: the strain energy is unstable beyond a stretch of ",
        ", reached at ",
        " kPa, ",
        " mm from the clamp: lower max_pressure_kpa, or take constants",
    ] {
        assert!(message.contains(words), "{message}");
    }
    assert!(with(ends, "max_pressure_kpa = 30.0").is_ok());
    for rubber in [
        "yeoh_mpa = [0.1, 0.02]",
        "mooney_rivlin_mpa = [0.09, 0.01]",
        "ogden = [[0.1, 1.3], [0.02, 5.0], [-0.01, -2.0]]",
        "ogden_abaqus = [[0.08, 1.3], [0.05, 5.0]]",
    ] {
        let finger = with(rubber, "max_pressure_kpa = 30.0");
        let finger = finger.unwrap_or_else(|error| panic!("{rubber}: {error}"));
        assert!(finger.chain.tip_angle_rad(30.0) > 0.01);
    }
}
