//! The robot arm: jerk-limited moves that lower the gripper over an object, lift it, transfer it and place
//! it, and the times at which the robot requests grip and release.

/// Phase of the arm: the paper's picking, transferring and placing, in finer steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Coming down over the object, gripper open.
    Approach,
    /// Standing still while the fingers close.
    Grip,
    /// Picking the object up.
    Lift,
    /// Transferring the object sideways.
    Carry,
    /// Lowering it onto its destination.
    Place,
    /// Standing still while the fingers open.
    Release,
    /// Going up again, leaving the object behind.
    Retreat,
    /// At rest after the last move.
    Done,
}

impl Phase {
    /// Whether the robot asks the gripper to hold on: from [`Phase::Grip`] until [`Phase::Release`].
    pub fn wants_grip(self) -> bool {
        matches!(
            self,
            Phase::Grip | Phase::Lift | Phase::Carry | Phase::Place
        )
    }
}

/// The task given to the arm. Every move starts and ends at rest, without a speed limit: the
/// paper varies acceleration only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmTask {
    /// Greatest acceleration of every move, m/s².
    pub acceleration_m_s2: f64,
    /// Time in which acceleration rises from zero to its greatest value, s.
    pub jerk_ramp_s: f64,
    /// Height from which the gripper comes down onto the object, m.
    pub approach_m: f64,
    /// Height of the lift, m.
    pub lift_m: f64,
    /// Distance of the transfer, m.
    pub carry_m: f64,
    /// Rest after each move, s.
    pub dwell_s: f64,
    /// Time given to the fingers to close, s.
    pub grip_s: f64,
    /// Time given to the fingers to open, s.
    pub release_s: f64,
}

impl Default for ArmTask {
    /// Lift, transfer and jerk ramp reproduce the outcomes that the paper states; the rest is free.
    fn default() -> Self {
        ArmTask {
            acceleration_m_s2: 5.0,
            jerk_ramp_s: 0.047,
            approach_m: 0.15,
            lift_m: 0.2,
            carry_m: 0.8,
            dwell_s: 0.2,
            grip_s: 1.0,
            release_s: 0.6,
        }
    }
}

/// State of the arm at one instant. The origin is the palm's position at the grip; x points in the direction
/// of the transfer and z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmState {
    /// Current phase.
    pub phase: Phase,
    /// Position of the palm, m.
    pub position_m: [f64; 3],
    /// Velocity of the palm, m/s.
    pub velocity_m_s: [f64; 3],
    /// Acceleration of the palm, m/s².
    pub acceleration_m_s2: [f64; 3],
}

/// A whole pick-and-place cycle as a function of time.
#[derive(Clone, Debug)]
pub struct Profile {
    stages: [Stage; 7],
    done_at_s: f64,
}

/// One phase: a straight move, then a rest.
#[derive(Clone, Copy, Debug)]
struct Stage {
    phase: Phase,
    start_s: f64,
    from_m: [f64; 3],
    /// Axis of the move: 0 = x, 2 = z.
    axis: usize,
    sign: f64,
    travel: Travel,
}

impl Stage {
    /// The arm at time `t_s`.
    fn at(&self, t_s: f64) -> ArmState {
        let (distance, velocity, acceleration) = self.travel.at(t_s - self.start_s);
        let mut state = ArmState {
            phase: self.phase,
            position_m: self.from_m,
            velocity_m_s: [0.0; 3],
            acceleration_m_s2: [0.0; 3],
        };
        state.position_m[self.axis] += self.sign * distance;
        state.velocity_m_s[self.axis] = self.sign * velocity;
        state.acceleration_m_s2[self.axis] = self.sign * acceleration;
        state
    }
}

impl Profile {
    /// Plans all moves of a task.
    pub fn new(task: &ArmTask) -> Profile {
        let (x, z) = (0, 2);
        let plan = [
            (Phase::Approach, z, -task.approach_m, task.dwell_s),
            (Phase::Grip, z, 0.0, task.grip_s),
            (Phase::Lift, z, task.lift_m, task.dwell_s),
            (Phase::Carry, x, task.carry_m, task.dwell_s),
            (Phase::Place, z, -task.lift_m, task.dwell_s),
            (Phase::Release, z, 0.0, task.release_s),
            (Phase::Retreat, z, task.lift_m, task.dwell_s),
        ];
        let mut at_m = [0.0, 0.0, task.approach_m];
        let mut time_s = 0.0;
        let stages = plan.map(|(phase, axis, distance_m, rest_s)| {
            let stage = Stage {
                phase,
                start_s: time_s,
                from_m: at_m,
                axis,
                sign: distance_m.signum(),
                travel: Travel::new(distance_m.abs(), task.acceleration_m_s2, task.jerk_ramp_s),
            };
            at_m[axis] += distance_m;
            time_s += stage.travel.duration_s() + rest_s;
            stage
        });
        Profile {
            stages,
            done_at_s: time_s,
        }
    }

    /// The arm at time `t_s`; it waits in its first position before zero and in its last after the end.
    pub fn at(&self, t_s: f64) -> ArmState {
        let stage = self
            .stages
            .iter()
            .rev()
            .find(|s| s.start_s <= t_s)
            .unwrap_or(&self.stages[0]);
        let mut state = stage.at(t_s);
        if t_s >= self.done_at_s {
            state.phase = Phase::Done;
        }
        state
    }

    /// Time at which a phase begins, s.
    pub fn start_s(&self, phase: Phase) -> f64 {
        self.stages
            .iter()
            .find(|s| s.phase == phase)
            .map_or(self.done_at_s, |s| s.start_s)
    }

    /// Time at which everything is done, s.
    pub fn duration_s(&self) -> f64 {
        self.done_at_s
    }
}

/// A move that an arm is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Move {
    /// Up, off the stand.
    Lift,
    /// Sideways to the other stand, or back.
    Carry,
    /// Down onto a stand.
    Lower,
}

/// Why an arm does not make a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hindrance {
    /// The last one has not ended.
    Moving,
    /// It is up already, and was to be lifted.
    Up,
    /// It is down, where it can neither be lowered nor go sideways.
    Down,
}

/// An arm that is told each move when it is due. It begins at the origin, where the object is between the fingers.
#[derive(Clone, Copy, Debug)]
pub struct Led {
    stage: Stage,
}

impl Led {
    /// At rest.
    pub fn new() -> Led {
        Led {
            stage: Stage {
                phase: Phase::Grip,
                start_s: 0.0,
                from_m: [0.0; 3],
                axis: 2,
                sign: 1.0,
                travel: Travel {
                    jerk_m_s3: 0.0,
                    ramp_s: 0.0,
                    level_s: 0.0,
                },
            },
        }
    }

    /// The arm at time `t_s`.
    pub fn at(&self, t_s: f64) -> ArmState {
        self.stage.at(t_s)
    }

    /// Whether it has not come to rest at `t_s`.
    pub fn is_moving(&self, t_s: f64) -> bool {
        t_s < self.stage.start_s + self.stage.travel.duration_s()
    }

    /// Begins a move at `t_s`, with the distances and limits of a task.
    ///
    /// # Errors
    /// If the arm is elsewhere, or still moves; nothing is begun then.
    pub fn begin(&mut self, t_s: f64, wanted: Move, task: &ArmTask) -> Result<(), Hindrance> {
        if self.is_moving(t_s) {
            return Err(Hindrance::Moving);
        }
        let from_m = self.at(t_s).position_m;
        let is_up = from_m[2] > task.lift_m / 2.0;
        let is_away = from_m[0] > task.carry_m / 2.0;
        let (phase, axis, distance_m) = match (wanted, is_up) {
            (Move::Lift, false) => (Phase::Lift, 2, task.lift_m),
            (Move::Lift, true) => return Err(Hindrance::Up),
            (Move::Carry | Move::Lower, false) => return Err(Hindrance::Down),
            (Move::Carry, true) if is_away => (Phase::Carry, 0, -task.carry_m),
            (Move::Carry, true) => (Phase::Carry, 0, task.carry_m),
            (Move::Lower, true) => (Phase::Place, 2, -task.lift_m),
        };
        self.stage = Stage {
            phase,
            start_s: t_s,
            from_m,
            axis,
            sign: distance_m.signum(),
            travel: Travel::new(distance_m.abs(), task.acceleration_m_s2, task.jerk_ramp_s),
        };
        Ok(())
    }
}

impl Default for Led {
    fn default() -> Self {
        Self::new()
    }
}

/// The quickest straight move from rest to rest with limited acceleration and jerk: seven pieces
/// of constant jerk, +j 0 −j −j 0 +j, of which the two in the middle are one.
#[derive(Clone, Copy, Debug)]
struct Travel {
    jerk_m_s3: f64,
    ramp_s: f64,
    level_s: f64,
}

impl Travel {
    fn new(distance_m: f64, acceleration_m_s2: f64, ramp_s: f64) -> Travel {
        // Speeding up takes T = 2·ramp + level and reaches v = a·(ramp + level); by symmetry the move
        // covers v·T. A move too short to reach the full acceleration (level < 0) keeps the ramp
        // and lowers the acceleration instead: d = 2·a·ramp².
        let speeding_up_s =
            (ramp_s + (ramp_s * ramp_s + 4.0 * distance_m / acceleration_m_s2).sqrt()) / 2.0;
        let level_s = speeding_up_s - 2.0 * ramp_s;
        if level_s >= 0.0 {
            Travel {
                jerk_m_s3: acceleration_m_s2 / ramp_s,
                ramp_s,
                level_s,
            }
        } else {
            Travel {
                jerk_m_s3: distance_m / (2.0 * ramp_s * ramp_s * ramp_s),
                ramp_s,
                level_s: 0.0,
            }
        }
    }

    fn duration_s(&self) -> f64 {
        if self.jerk_m_s3 == 0.0 {
            0.0
        } else {
            4.0 * self.ramp_s + 2.0 * self.level_s
        }
    }

    /// Distance, velocity and acceleration after `t_s`.
    fn at(&self, t_s: f64) -> (f64, f64, f64) {
        let (j, ramp, level) = (self.jerk_m_s3, self.ramp_s, self.level_s);
        let pieces = [
            (j, ramp),
            (0.0, level),
            (-j, 2.0 * ramp),
            (0.0, level),
            (j, ramp),
        ];
        let (mut x, mut v, mut a, mut left_s) = (0.0, 0.0, 0.0, t_s.max(0.0));
        for (jerk, length_s) in pieces {
            let t = left_s.min(length_s);
            x += t * (v + t * (a / 2.0 + t * jerk / 6.0));
            v += t * (a + t * jerk / 2.0);
            a += t * jerk;
            left_s -= t;
        }
        // After the last piece, v and a are zero but for rounding.
        if left_s > 0.0 {
            (x, 0.0, 0.0)
        } else {
            (x, v, a)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_move_keeps_its_limits_and_its_state_is_consistent() {
        for acceleration in [2.0, 5.0, 10.0, 40.0] {
            let task = ArmTask {
                acceleration_m_s2: acceleration,
                ..ArmTask::default()
            };
            let profile = Profile::new(&task);
            let dt = 1e-4;
            let mut last = profile.at(0.0);
            for n in 1..=(profile.duration_s() / dt) as usize + 100 {
                let now = profile.at(n as f64 * dt);
                for axis in 0..3 {
                    let a = now.acceleration_m_s2[axis];
                    let jerk = (a - last.acceleration_m_s2[axis]) / dt;
                    assert!(a.abs() <= acceleration * (1.0 + 1e-9));
                    assert!(jerk.abs() <= acceleration / task.jerk_ramp_s * (1.0 + 1e-6));
                    let dv = now.velocity_m_s[axis] - last.velocity_m_s[axis];
                    assert!((dv / dt - a).abs() <= acceleration / task.jerk_ramp_s * dt);
                    let dx = now.position_m[axis] - last.position_m[axis];
                    assert!((dx / dt - now.velocity_m_s[axis]).abs() <= acceleration * dt);
                }
                last = now;
            }
        }
    }

    #[test]
    fn phases_follow_each_other_at_rest_and_end_at_the_destination() {
        let task = ArmTask::default();
        let profile = Profile::new(&task);
        let stations = [
            (Phase::Approach, [0.0, 0.0, task.approach_m]),
            (Phase::Grip, [0.0; 3]),
            (Phase::Lift, [0.0; 3]),
            (Phase::Carry, [0.0, 0.0, task.lift_m]),
            (Phase::Place, [task.carry_m, 0.0, task.lift_m]),
            (Phase::Release, [task.carry_m, 0.0, 0.0]),
            (Phase::Retreat, [task.carry_m, 0.0, 0.0]),
            (Phase::Done, [task.carry_m, 0.0, task.lift_m]),
        ];
        for (phase, position) in stations {
            let state = profile.at(profile.start_s(phase));
            assert_eq!(state.phase, phase);
            for (is, expected) in state.position_m.iter().zip(position) {
                assert!((is - expected).abs() < 1e-12);
            }
            assert_eq!(state.velocity_m_s, [0.0; 3]);
            assert_eq!(state.acceleration_m_s2, [0.0; 3]);
        }
        assert_eq!(profile.at(-1.0), profile.at(0.0));
        assert_eq!(profile.at(1e3).phase, Phase::Done);
    }

    #[test]
    fn the_robot_asks_for_grip_from_grip_to_release() {
        let profile = Profile::new(&ArmTask::default());
        let asks = |t| profile.at(t).phase.wants_grip();
        let (grip, release) = (
            profile.start_s(Phase::Grip),
            profile.start_s(Phase::Release),
        );
        assert!(!asks(grip - 1e-3) && asks(grip));
        assert!(asks(release - 1e-3) && !asks(release));
    }

    #[test]
    fn an_arm_that_is_led_goes_from_stand_to_stand_and_back() {
        let task = ArmTask::default();
        let mut arm = Led::new();
        let mut t_s = 0.0;
        let up = [0.0, 0.0, task.lift_m];
        let over = [task.carry_m, 0.0, task.lift_m];
        let there = [task.carry_m, 0.0, 0.0];
        for (wanted, expected) in [
            (Move::Lift, up),
            (Move::Carry, over),
            (Move::Lower, there),
            (Move::Lift, over),
            (Move::Carry, up),
            (Move::Lower, [0.0; 3]),
        ] {
            arm.begin(t_s, wanted, &task).expect("a possible move");
            assert!(arm.is_moving(t_s + 0.1));
            t_s += 2.0;
            assert!(!arm.is_moving(t_s));
            let state = arm.at(t_s);
            for (is, expected) in state.position_m.iter().zip(expected) {
                assert!((is - expected).abs() < 1e-12, "{wanted:?}: {state:?}");
            }
            assert_eq!(state.velocity_m_s, [0.0; 3]);
        }
    }

    #[test]
    fn an_arm_that_is_led_begins_nothing_that_it_cannot_do() {
        let task = ArmTask::default();
        let mut arm = Led::new();
        assert_eq!(arm.begin(0.0, Move::Carry, &task), Err(Hindrance::Down));
        assert_eq!(arm.begin(0.0, Move::Lower, &task), Err(Hindrance::Down));
        assert_eq!(arm.at(1.0).position_m, [0.0; 3]);
        assert_eq!(arm.begin(1.0, Move::Lift, &task), Ok(()));
        assert_eq!(arm.begin(1.1, Move::Carry, &task), Err(Hindrance::Moving));
        assert_eq!(arm.begin(3.0, Move::Lift, &task), Err(Hindrance::Up));
    }
}
