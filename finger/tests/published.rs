//! The finger of `recipes/rtv225*.toml` against the numbers that the paper prints.

use std::path::Path;

use finger::chain::LINKS;
use finger::geometry::{Description, Geometry};
use finger::model::Solved;
use serde::Deserialize;

#[derive(Deserialize)]
struct Published {
    link: Link,
    joint: Joint,
    moment: Vec<Moment>,
}

#[derive(Deserialize)]
struct Link {
    mass_g: [f64; LINKS],
}

#[derive(Deserialize)]
struct Joint {
    stiffness_nmm_per_deg: [f64; LINKS],
}

#[derive(Deserialize)]
struct Moment {
    pressure_kpa: f64,
    torque_nmm: [f64; LINKS],
}

impl Published {
    fn read() -> Self {
        toml::from_str(include_str!("published.toml")).expect("the published numbers")
    }

    fn pressures_kpa(&self) -> Vec<f64> {
        self.moment
            .iter()
            .map(|moment| moment.pressure_kpa)
            .collect()
    }

    /// Table 3 over table 2, degrees.
    fn joint_angles_deg(&self, k: usize) -> [f64; LINKS] {
        std::array::from_fn(|i| self.moment[k].torque_nmm[i] / self.joint.stiffness_nmm_per_deg[i])
    }
}

fn geometry(recipe: &str) -> Geometry {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../recipes")
        .join(recipe);
    let text = std::fs::read_to_string(path).expect("the recipe");
    let description: Description = toml::from_str(&text).expect("a good recipe");
    description.check().expect("a good finger")
}

/// Errors against the paper.
#[derive(Debug)]
struct Errors {
    mass_percent: [f64; LINKS],
    stiffness_percent: [f64; LINKS],
    tip_angle_percent: Vec<f64>,
    joint_angle_rms_deg: f64,
    chain_tip_percent_of_length: Vec<f64>,
}

fn errors(solved: &Solved) -> Errors {
    let published = Published::read();
    let percent = |model: f64, printed: f64| 100.0 * (model / printed - 1.0);
    let mut squares = 0.0;
    let mut tip_angle_percent = Vec::new();
    let mut chain_tip_percent_of_length = Vec::new();
    for (k, bend) in solved.bends.iter().enumerate() {
        let model = bend.joint_angle_rad.map(f64::to_degrees);
        let printed = published.joint_angles_deg(k);
        squares += (0..LINKS)
            .map(|i| (model[i] - printed[i]).powi(2))
            .sum::<f64>();
        tip_angle_percent.push(percent(model.iter().sum(), printed.iter().sum()));
        chain_tip_percent_of_length.push(100.0 * solved.chain_tip_error(bend));
    }
    Errors {
        mass_percent: std::array::from_fn(|i| {
            percent(1e3 * solved.link_mass_kg[i], published.link.mass_g[i])
        }),
        stiffness_percent: std::array::from_fn(|i| {
            percent(
                1e3 * 1f64.to_radians() * solved.joint_stiffness_nm_per_rad[i],
                published.joint.stiffness_nmm_per_deg[i],
            )
        }),
        tip_angle_percent,
        joint_angle_rms_deg: (squares / (LINKS * solved.bends.len()) as f64).sqrt(),
        chain_tip_percent_of_length,
    }
}

fn within(values: &[f64], bound: f64) -> bool {
    values.iter().all(|value| value.abs() <= bound)
}

#[test]
fn straight_tapers_give_the_published_finger() {
    let pressures = Published::read().pressures_kpa();
    let errors = errors(&geometry("rtv225.toml").solve(&pressures).expect("solves"));
    println!("{errors:.2?}");
    // Link 5 lacks 3 %: straight tapers have no room for the bore's rounded end, which is in it.
    assert!(within(&errors.mass_percent[..4], 0.3), "{errors:.2?}");
    assert!(within(&errors.mass_percent[5..], 0.3), "{errors:.2?}");
    assert!(within(&errors.stiffness_percent, 5.0), "{errors:.2?}");
    assert!(within(&errors.tip_angle_percent, 6.0), "{errors:.2?}");
    assert!(errors.joint_angle_rms_deg <= 1.1, "{errors:.2?}");
    assert!(
        within(&errors.chain_tip_percent_of_length, 0.3),
        "{errors:.2?}"
    );
}

#[test]
fn five_stations_come_closer() {
    let pressures = Published::read().pressures_kpa();
    let errors = errors(
        &geometry("rtv225-stations.toml")
            .solve(&pressures)
            .expect("solves"),
    );
    println!("{errors:.2?}");
    assert!(within(&errors.mass_percent, 0.3), "{errors:.2?}");
    assert!(within(&errors.stiffness_percent, 5.0), "{errors:.2?}");
    assert!(within(&errors.tip_angle_percent, 5.0), "{errors:.2?}");
    assert!(errors.joint_angle_rms_deg <= 0.7, "{errors:.2?}");
    assert!(
        within(&errors.chain_tip_percent_of_length, 0.3),
        "{errors:.2?}"
    );
}

#[test]
fn no_law_proportional_to_pressure_fits() {
    // The best gain for each joint by itself still misses the tip angle at the lowest pressure by half
    // as much again as it is.
    let published = Published::read();
    let pressures = published.pressures_kpa();
    let fitted: f64 = (0..LINKS)
        .map(|i| {
            let angles = (0..pressures.len()).map(|k| published.joint_angles_deg(k)[i]);
            let along: f64 = pressures
                .iter()
                .zip(angles)
                .map(|(p, angle)| p * angle)
                .sum();
            along / pressures.iter().map(|p| p * p).sum::<f64>() * pressures[0]
        })
        .sum();
    let printed: f64 = published.joint_angles_deg(0).iter().sum();
    assert!(fitted / printed > 2.0, "{fitted} against {printed} degrees");
}
