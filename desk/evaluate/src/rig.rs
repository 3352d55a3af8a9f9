//! The simulated fingers with an object on an arm with a prescribed acceleration: the plant for the
//! identification.

use finger::chain::Chain;
use sim::bodies::world_config;
use sim::hand::Hand;
use sim::setup::Setup;
use sim::world::World;
use softgrip::FINGERS;

/// Step of the world, s.
pub const STEP_S: f64 = 0.001;
/// Pressures of a closing, kPa apart.
pub const GRID_KPA: f64 = 2.0;

/// Fingers and object on an arm with a prescribed acceleration.
pub struct Rig {
    world: World,
    chain: Chain,
    pressure_kpa: f64,
    /// Position of the palm, m.
    pub position_m: [f64; 3],
    velocity_m_s: [f64; 3],
}

impl Rig {
    /// Open fingers above the object on its fixture.
    fn open(setup: &Setup) -> Self {
        let mut setup = setup.clone();
        // The first finger in the direction of x.
        setup.gripper.hand.first_finger_deg = 0.0;
        let hand = Hand::alike(&setup.chain);
        let config = world_config(&setup.scenario, &setup.gripper, &hand, &setup.grasp);
        Self {
            world: World::new(&config, [0.0; 3]),
            chain: setup.chain.clone(),
            pressure_kpa: 0.0,
            position_m: [0.0; 3],
            velocity_m_s: [0.0; 3],
        }
    }

    /// The object held at a pressure and lifted off, at rest.
    pub fn holding(setup: &Setup, pressure_kpa: f64) -> Self {
        let mut rig = Self::open(setup);
        let ticks = |s: f64| (s / STEP_S) as usize;
        for n in 0..ticks(1.0) {
            rig.pressure_kpa = pressure_kpa * (n as f64 / ticks(0.6) as f64).min(1.0);
            rig.step([0.0; 3]);
        }
        for acceleration in [2.0, -2.0] {
            for _ in 0..ticks(0.4) {
                rig.step([0.0, 0.0, acceleration]);
            }
        }
        for _ in 0..ticks(0.4) {
            rig.step([0.0; 3]);
        }
        rig
    }

    /// Advances by 1 ms at this acceleration of the palm, m/s².
    pub fn step(&mut self, acceleration_m_s2: [f64; 3]) {
        let motion = self.position_m.iter_mut().zip(&mut self.velocity_m_s);
        for ((position, velocity), acceleration) in motion.zip(acceleration_m_s2) {
            *velocity += STEP_S * acceleration;
            *position += STEP_S * *velocity;
        }
        let torques = self.chain.joint_torques_nm(self.pressure_kpa);
        self.world.step(&[torques; FINGERS], self.position_m);
    }

    /// The acceleration with a weak pull back home, so that noise does not lead the arm away.
    pub fn confined(&self, home_m: [f64; 3], acceleration_m_s2: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| {
            let away_m = self.position_m[i] - home_m[i];
            acceleration_m_s2[i] - 4.0 * self.velocity_m_s[i] - 4.0 * away_m
        })
    }

    /// Residual of each finger in steady air, µε.
    pub fn residual_ue(&self) -> [f64; FINGERS] {
        let free = self.chain.free_strain_ue(self.pressure_kpa);
        let angles = self.world.joint_angles();
        angles.map(|angles| free - self.chain.gauge_strain_ue(&angles))
    }
}

/// Mean residual of a finger while the object is gripped slowly on its fixture; its mass has no share in it.
pub fn closing(setup: &Setup) -> Vec<f64> {
    let mut rig = Rig::open(setup);
    let steps = (setup.chain.max_pressure_kpa() / GRID_KPA) as usize;
    (0..=steps)
        .map(|n| {
            rig.pressure_kpa = n as f64 * GRID_KPA;
            // Slow against the finger's 26 ms: 50 ms for each 2 kPa.
            for _ in 0..50 {
                rig.step([0.0; 3]);
            }
            let sum: f64 = rig.residual_ue().iter().sum();
            // Before the first touch the finger's own weight is no contact.
            (sum / FINGERS as f64).max(0.0)
        })
        .collect()
}

/// Response of each finger to a response across, given in x and y.
pub fn spread([x, y]: [f64; 2]) -> [f64; FINGERS] {
    directions().map(|[cos, sin]| cos * x + sin * y)
}

/// Outward directions of the fingers across, x and y.
pub fn directions() -> [[f64; 2]; FINGERS] {
    // √3 / 2.
    const SIN_60: f64 = 0.866_025_403_784_438_6;
    let all: &[[f64; 2]] = match FINGERS {
        2 => &[[1.0, 0.0], [-1.0, 0.0]],
        3 => &[[1.0, 0.0], [-0.5, SIN_60], [-0.5, -SIN_60]],
        _ => &[[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]],
    };
    std::array::from_fn(|finger| all[finger])
}
