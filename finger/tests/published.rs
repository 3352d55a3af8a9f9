//! The finger of `recipes/rtv225*.toml` against the numbers that the paper prints.

use std::path::Path;

use finger::capability::{GRAVITY_M_S2, Grip};
use finger::chain::LINKS;
use finger::geometry::{Description, Geometry};
use finger::model::Solved;
use finger::object::Object;
use serde::Deserialize;

#[derive(Deserialize)]
struct Published {
    link: Link,
    joint: Joint,
    moment: Vec<Moment>,
    contact: Contact,
    outcome: Vec<Outcome>,
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

#[derive(Deserialize)]
struct Contact {
    friction_static: f64,
    object_diameter_mm: f64,
    pressure_kpa: f64,
}

#[derive(Deserialize)]
struct Outcome {
    object: String,
    mass_g: f64,
    acceleration_m_s2: Vec<f64>,
    result: Vec<String>,
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
    assert!(within(&errors.mass_percent, 0.3), "{errors:.2?}");
    assert!(within(&errors.stiffness_percent, 4.0), "{errors:.2?}");
    assert!(within(&errors.tip_angle_percent, 3.5), "{errors:.2?}");
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
    assert!(within(&errors.stiffness_percent, 1.5), "{errors:.2?}");
    assert!(within(&errors.tip_angle_percent, 2.0), "{errors:.2?}");
    assert!(errors.joint_angle_rms_deg <= 0.7, "{errors:.2?}");
    assert!(
        within(&errors.chain_tip_percent_of_length, 0.3),
        "{errors:.2?}"
    );
}

/// The gripper of the twin around one of its two objects: the lift that statics gives, N.
fn lift_n(grip: &Grip, object: &str) -> f64 {
    let diameter_m = 1e-3 * Published::read().contact.object_diameter_mm;
    let radius_m = diameter_m / 2.0;
    let (object, depth_m) = match object {
        "sphere" => (Object::Sphere { radius_m }, 39e-3),
        _ => (
            Object::Cylinder {
                radius_m,
                height_m: diameter_m,
            },
            57e-3,
        ),
    };
    grip.strongest(object, depth_m).expect("closes").lift_n
}

fn grip(link_length_m: [f64; LINKS], stiffness: [f64; LINKS], free: [f64; LINKS]) -> Grip {
    Grip {
        fingers: 3,
        link_length_m,
        joint_stiffness_nm_per_rad: stiffness,
        free_angle_rad: free,
        palm_radius_m: 39.98e-3,
        link_radius_m: 4.5e-3,
        friction: Published::read().contact.friction_static,
    }
}

/// Two of the ten lie within 2 % of the lift (the sphere of 150 g at 10 m/s², that of 250 g at 2 m/s²): a
/// millimetre of depth would turn them.
#[test]
fn statics_of_the_published_chain_gives_the_published_outcomes() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recipes/paper.toml");
    let chain = finger::recipe::load(&path).expect("a good recipe").chain;
    let published = Published::read();
    let grip = grip(
        chain.link_length_m,
        chain.joint_stiffness_nm_per_rad,
        chain.joint_angles_rad(published.contact.pressure_kpa),
    );
    let mut judged = 0;
    for outcome in &published.outcome {
        let lift = lift_n(&grip, &outcome.object);
        for (acceleration, result) in outcome.acceleration_m_s2.iter().zip(&outcome.result) {
            let needed = 1e-3 * outcome.mass_g * (GRAVITY_M_S2 + acceleration);
            println!(
                "{} {} g at {acceleration} m/s²: {needed:.2} N of {lift:.2} N, published: {result}",
                outcome.object, outcome.mass_g,
            );
            match result.as_str() {
                "unstated" => continue,
                "hold" => assert!(lift > needed),
                // In which phase it falls is not for statics to say.
                _ => assert!(lift < needed),
            }
            judged += 1;
        }
    }
    assert_eq!(judged, 10);
}

#[test]
fn statics_of_the_modelled_finger_comes_close() {
    let published = Published::read();
    for recipe in ["rtv225.toml", "rtv225-stations.toml"] {
        let pressure = published.contact.pressure_kpa;
        let solved = geometry(recipe).solve(&[pressure]).expect("solves");
        let grip = grip(
            solved.link_length_m,
            solved.joint_stiffness_nm_per_rad,
            solved.bends[0].joint_angle_rad,
        );
        let [sphere, cylinder] = ["sphere", "cylinder"].map(|object| lift_n(&grip, object));
        println!("{recipe}: sphere {sphere:.3} N, cylinder {cylinder:.3} N");
        // What the published chain lifts, within the 5 % of its stiffness.
        assert!((sphere / 2.93 - 1.0).abs() < 0.05);
        assert!((cylinder / 1.45 - 1.0).abs() < 0.05);
    }
}

#[test]
fn no_law_proportional_to_pressure_fits() {
    // The best gain for each joint by itself gives more than twice the tip angle at the lowest pressure.
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
