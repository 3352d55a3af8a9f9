//! `softgrip fit` on fingers that are known, because the model made them.

use std::path::{Path, PathBuf};

use finger::chain::Chain;
use finger::geometry::Description;
use studies::fit::data::{self, Measurements, Noise, Quantity};
use studies::fit::identify::Selection;
use studies::fit::parameter::Parameter;
use studies::fit::{Fit, Request};
use tempfile::TempDir;
use toml_edit::DocumentMut;

const RECIPE: &str = include_str!("../../../recipes/rtv225.toml");
const FITTED_KPA: [f64; 3] = [60.0, 100.0, 140.0];
const TESTED_KPA: [f64; 3] = [80.0, 120.0, 160.0];
use Quantity::{Strain, TipAngle};

/// The finger of the recipe with its outer radius, bore radius and bore offset off by so many 0.1 mm.
fn finger(off: [f64; 3]) -> Chain {
    let mut recipe: DocumentMut = RECIPE.parse().expect("a good recipe");
    for (parameter, steps) in Parameter::ALL.into_iter().zip(off) {
        parameter.apply(&mut recipe, steps);
    }
    let description: Description = toml::from_str(&recipe.to_string()).expect("a good recipe");
    let mut pressures = [FITTED_KPA, TESTED_KPA].concat();
    pressures.sort_by(f64::total_cmp);
    let geometry = description.check().expect("a good finger");
    geometry.chain_through(&pressures).expect("solves")
}

/// The measurements of a finger; `error` is added to the values of each pressure, in multiples of noise.
fn measure(
    finger: &Chain,
    pressures_kpa: &[f64],
    quantities: &[Quantity],
    noise: Noise,
    error: &[f64],
) -> String {
    let columns: Vec<&str> = quantities.iter().map(|q| q.column()).collect();
    let mut text = format!("pressure_kpa,{}\n", columns.join(","));
    for (kpa, error) in pressures_kpa.iter().zip(error) {
        let value = |q: &Quantity| format!("{:.4}", q.of(finger, *kpa) + error * noise.of(*q));
        let values: Vec<String> = quantities.iter().map(value).collect();
        text += &format!("{kpa},{}\n", values.join(","));
    }
    text
}

fn temporary() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

fn put(dir: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = dir.path().join(name);
    std::fs::write(&path, text).expect("a file");
    path
}

fn fit(csv: &str, noise: Noise, known: &[Parameter]) -> anyhow::Result<Fit> {
    let dir = temporary();
    Fit::new(&Request {
        measured: &put(&dir, "measured.csv", csv),
        recipe: Path::new("rtv225.toml"),
        text: RECIPE,
        noise,
        known,
    })
}

/// Largest error at pressures that were not fitted, %.
fn error_percent(fit: &Fit, truth: &Chain, quantity: Quantity) -> f64 {
    let error = |kpa: f64| {
        let fitted = quantity.of(&fit.fitted().chain, kpa);
        100.0 * (fitted / quantity.of(truth, kpa) - 1.0).abs()
    };
    TESTED_KPA.map(error).into_iter().fold(0.0, f64::max)
}

#[test]
fn tip_angles_bring_a_finger_that_is_off_within_a_percent_where_it_was_not_measured() {
    let noise = Noise::default();
    let before = finger([0.0; 3]);
    for off in [
        [1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [-1.0, -1.0, 1.0],
        [1.0, 1.0, -1.0],
        // All three in one direction: a quarter off.
        [-1.0, 1.0, 1.0],
    ] {
        let truth = finger(off);
        let wrong = (TipAngle.of(&before, 120.0) / TipAngle.of(&truth, 120.0) - 1.0).abs();
        assert!(wrong > 0.07, "{off:?}: {wrong}");
        let csv = measure(&truth, &FITTED_KPA, &[TipAngle], noise, &[0.0; 3]);
        let fit = fit(&csv, noise, &[]).expect("fits");
        let error = error_percent(&fit, &truth, TipAngle);
        assert!(error < 1.0, "{off:?}: {error} %");
    }
}

#[test]
fn strains_do_too_and_tip_angles_with_them_where_the_gauge_is_known() {
    let noise = Noise::default();
    for off in [[0.0, 1.0, 0.0], [1.0, 1.0, -1.0]] {
        let truth = finger(off);
        let csv = measure(&truth, &FITTED_KPA, &[Strain], noise, &[0.0; 3]);
        let alone = fit(&csv, noise, &[]).expect("fits");
        let error = error_percent(&alone, &truth, Strain);
        assert!(error < 1.0, "{off:?}: {error} %");
        // The gauge's distance stands for what it cannot be told from, and the report says so.
        assert!(alone.text().contains("--known gauge-distance"));
        let known = fit(&csv, noise, &[Parameter::GaugeDistance]).expect("fits");
        assert_eq!(known.fitted().chain.gauge, truth.gauge);
        for quantity in Quantity::ALL {
            let error = error_percent(&known, &truth, quantity);
            assert!(error < 1.0, "{off:?}: {error} %");
        }
    }
}

#[test]
fn both_together_tell_the_gauge_from_the_finger() {
    let noise = Noise::default();
    let mut truth = finger([1.0, 1.0, 1.0]);
    truth.gauge.distance_m *= 1.2;
    let csv = measure(&truth, &FITTED_KPA, &Quantity::ALL, noise, &[0.0; 3]);
    let fit = fit(&csv, noise, &[]).expect("fits");
    for quantity in Quantity::ALL {
        let error = error_percent(&fit, &truth, quantity);
        assert!(error < 1.0, "{error} %");
    }
    assert!(fit.json()["misfit_after"].as_f64() < Some(1.0));
    let distance_m = fit.fitted().chain.gauge.distance_m;
    assert!((distance_m / 1.2e-3 - 1.0).abs() < 0.01, "{distance_m}");
}

#[test]
fn a_little_noise_costs_little() {
    // A tenth of a degree, a protractor's best: at 80 kPa that is half a percent.
    let noise = Noise {
        tip_angle_deg: 0.1,
        strain_ue: 20.0,
    };
    let truth = finger([1.0, -1.0, 0.0]);
    for error in [[1.0, -1.0, 1.0], [-1.0, 0.5, 1.0]] {
        let csv = measure(&truth, &FITTED_KPA, &[TipAngle], noise, &error);
        let fit = fit(&csv, noise, &[]).expect("fits");
        let error = error_percent(&fit, &truth, TipAngle);
        assert!(error < 1.0, "{error} %");
    }
}

#[test]
fn no_more_is_fitted_than_the_points_can_tell() {
    let noise = Noise::default();
    let truth = finger([1.0, 1.0, 1.0]);
    let csv = |kpa: &[f64]| measure(&truth, kpa, &[TipAngle], noise, &[0.0; 3]);
    let all = fit(&csv(&FITTED_KPA), noise, &[]).expect("fits");
    assert_eq!(all.changes().len(), 2);
    let selection = |fit: &Fit, parameter| {
        let candidates = &fit.identified().candidates;
        let found = candidates.iter().find(|c| c.parameter == parameter);
        found.expect("a candidate").selection
    };
    assert_eq!(selection(&all, Parameter::BoreOffset), Selection::Fitted);
    assert_eq!(selection(&all, Parameter::OuterRadius), Selection::Alike);
    assert_eq!(selection(&all, Parameter::GaugeDistance), Selection::Weak);
    let two = fit(&csv(&[80.0, 160.0]), noise, &[]).expect("fits");
    assert_eq!(two.changes().len(), 1);
    assert_eq!(selection(&two, Parameter::Stiffness), Selection::Spare);
    let one = fit(&csv(&[120.0]), noise, &[]).expect("fits");
    assert_eq!(one.changes().len(), 1);
    assert!(one.text().contains("nothing checks the fit"));
}

#[test]
fn what_cannot_be_this_finger_is_refused() {
    for (values, expected) in [
        (
            "60,0.20\n100,0.70\n140,1.4\n",
            "the measurements are not of this",
        ),
        ("25,2\n", "nothing can be fitted"),
    ] {
        let csv = format!("pressure_kpa,tip_angle_deg\n{values}");
        let error = fit(&csv, Noise::default(), &[]).err().expect("refused");
        let message = format!("{error:#}");
        assert!(message.contains(expected), "{message}");
        assert!(message.contains("measured.csv"), "{message}");
    }
}

#[test]
fn measurements_as_people_take_them_are_read() {
    let dir = temporary();
    let read = |csv: &str| {
        let file = put(&dir, "measured.csv", csv);
        data::read(&file, 160.0, Noise::default()).expect("good measurements")
    };
    let values = |measured: &Measurements| -> Vec<(f64, f64)> {
        let points = measured.points.iter();
        points.map(|p| (p.pressure_kpa, p.value)).collect()
    };
    let columns = "pressure_kpa,tip_angle_deg\n";
    let repeats = read(&format!(
        "{columns}60,11.2\n60,11.8\n100,39\n100,41\n140,75\n"
    ));
    assert_eq!(values(&repeats)[..2], [(60.0, 11.2), (60.0, 11.8)]);
    assert_eq!(repeats.hysteresis, []);
    let sparse = read("pressure_kpa,strain_ue,tip_angle_deg\n40,700,\n60,2000,11.5\n80,4300,\n");
    assert_eq!(sparse.points.len(), 4);
    assert!(
        sparse
            .notes
            .contains(&"tip_angle_deg: 2 empty, the first in line 2".into())
    );
    let zero = read(&format!("{columns}-0.2,-0.3\n60,11.5\n"));
    assert_eq!(values(&zero), [(0.0, -0.3), (60.0, 11.5)]);
    let german = read("pressure_kpa;tip_angle_deg\n60,0;11,5\n100,0;40,0\n");
    assert_eq!(values(&german), [(60.0, 11.5), (100.0, 40.0)]);
    assert!(german.notes.contains(&"decimal commas".into()));
    let units = read("Pressure (bar),tip_angle_rad\n0.6,0\n1.0,3.141592653589793\n");
    assert_eq!(values(&units), [(60.0, 0.0), (100.0, 180.0)]);
    let unordered = read(&format!("{columns}100,40\n60,11\n140,75\n80,24\n120,57\n"));
    assert_eq!(values(&unordered)[0], (60.0, 11.0));
    assert_eq!(unordered.hysteresis, []);
}

#[test]
fn unloading_over_loading_is_told_as_a_number() {
    let csv = "pressure_kpa,tip_angle_deg\n60,11\n100,39\n140,75\n100,43\n80,28\n60,14\n";
    let fit = fit(csv, Noise::default(), &[]).expect("fits");
    let hysteresis = &fit.json()["hysteresis"][0];
    // At 100 kPa it is 43 − 39, a nineteenth of 75; at 60 and, between 11 and 39, at 80 it is 3.
    assert_eq!(hysteresis["most"], 4.0);
    assert_eq!(hysteresis["pressure_kpa"], 100.0);
    assert_eq!(hysteresis["percent"], 5.3333);
    assert!(
        fit.text()
            .contains("unloading is +4.00 above loading at 100.0 kPa")
    );
}
