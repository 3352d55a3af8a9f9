//! Plays a script on the simulated gripper.

use sim::arm::Hindrance;
use sim::events;
use sim::fault::Injected;
use sim::gripper::Gripper;
use sim::plant::{Disturbance, Plant, Truth};
use softgrip::telemetry::Event;

use crate::script::{Action, Script, Step, When};

/// Fingers are open where no joint is bent further, rad.
const OPEN_RAD: f64 = 0.05;
/// Somebody who takes the object pulls so much harder every second, N/s …
const PULL_N_PER_S: f64 = 40.0;
/// … until it has moved so far against the palm, m.
const PULLED_OUT_M: f64 = 0.1;
/// … or for so long, s, for it may lie on the floor.
const LONGEST_PULL_S: f64 = 5.0;
/// Meanwhile the ground is out of the way, m.
const LOWERED_M: f64 = 0.3;

/// What of the gripper a script can look at.
pub struct Seen<'a> {
    /// The true state of the plant.
    pub truth: &'a Truth,
    /// Events of the last tick.
    pub events: &'a [Event],
    /// What the register shows that [`Play::register`] asks for.
    pub register: Option<u16>,
}

/// Whether the virtual gripper goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// It does.
    GoesOn,
    /// The script has ended it.
    Ends,
}

/// How far the present step is.
#[derive(Debug, Clone, Copy)]
enum Stage {
    /// It waits for its moment.
    Waiting,
    /// Its moment was there; it acts at this time, s.
    Due(f64),
    /// It acts since this time, s; the object was there then, m.
    Acting(f64, [f64; 3]),
}

/// A script that is being played.
pub struct Play {
    script: Script,
    gripper: Gripper,
    at: usize,
    stage: Stage,
    /// Names of the events since the step before began.
    heard: Vec<&'static str>,
}

impl Play {
    /// From the first step on.
    pub fn new(script: Script, gripper: &Gripper) -> Self {
        Self {
            script,
            gripper: gripper.clone(),
            at: 0,
            stage: Stage::Waiting,
            heard: Vec::new(),
        }
    }

    /// The register that the present step waits for.
    pub fn register(&self) -> Option<u16> {
        match (self.stage, &self.script.steps.get(self.at)?.when) {
            (Stage::Waiting, When::Register { address, .. }) => Some(*address),
            _ => None,
        }
    }

    /// After each tick. What happens is said.
    pub fn step(&mut self, plant: &mut Plant, seen: &Seen, say: &mut impl FnMut(String)) -> Flow {
        let Some(step) = self.script.steps.get(self.at) else {
            return Flow::GoesOn;
        };
        let now_s = seen.truth.t_s;
        for name in seen.events.iter().map(events::name) {
            if !self.heard.contains(&name) {
                self.heard.push(name);
            }
        }
        if let Stage::Waiting = self.stage
            && self.is_moment(&step.when, seen)
        {
            self.stage = Stage::Due(now_s + step.after_s);
        }
        if let Stage::Due(due_s) = self.stage
            && due_s <= now_s
            && can_begin(&step.action, plant)
        {
            say(format!("script, line {}: {}", step.line, step.action));
            self.begin(step, plant, now_s, say);
            self.heard.clear();
            self.stage = Stage::Acting(now_s, seen.truth.object_m);
        }
        if let Stage::Acting(since_s, from_m) = self.stage
            && is_over(&step.action, plant, seen.truth, since_s, from_m)
        {
            if step.action == Action::End {
                return Flow::Ends;
            }
            self.stage = Stage::Waiting;
            self.at += 1;
            if self.script.repeat && self.at == self.script.steps.len() {
                self.at = 0;
            }
        }
        Flow::GoesOn
    }

    fn is_moment(&self, when: &When, seen: &Seen) -> bool {
        match when {
            When::Before => true,
            When::At(at_s) => *at_s <= seen.truth.t_s,
            When::Register { mask, equals, .. } => {
                seen.register.is_some_and(|value| value & mask == *equals)
            }
            When::Event(name) => self.heard.contains(&name.as_str()),
        }
    }

    fn begin(&self, step: &Step, plant: &mut Plant, now_s: f64, say: &mut impl FnMut(String)) {
        match step.action {
            Action::Appear => plant.world_mut().place_object(),
            Action::PullOut => plant.world_mut().lower_ground(LOWERED_M),
            Action::Arm(wanted, acceleration) => {
                let task = self.gripper.arm_task(acceleration);
                let arm = plant.arm_mut();
                let begun = arm.map(|arm| arm.begin(now_s, wanted, &task));
                if let Some(Err(why)) = begun {
                    let why = match why {
                        Hindrance::Moving => "it still moves",
                        Hindrance::Up => "it is up already",
                        Hindrance::Down => "it is down: lift it first",
                    };
                    say(format!("script, line {}: the arm stays: {why}", step.line));
                }
            }
            Action::Push(push_n, _) => push(plant, push_n),
            Action::Fault(kind, finger, for_s) => plant.faults_mut().push(Injected {
                kind,
                finger,
                from_s: now_s,
                until_s: now_s + for_s,
            }),
            Action::Repair => {
                plant.faults_mut().clear();
                plant.set_supply(self.gripper.regulator.supply_v);
            }
            Action::Supply(supply_v) => plant.set_supply(supply_v),
            Action::End => {}
        }
    }
}

/// An object cannot appear where fingers are.
fn can_begin(action: &Action, plant: &Plant) -> bool {
    let mut angles = plant.joint_angles().into_iter().flatten();
    *action != Action::Appear || angles.all(|angle| angle.abs() < OPEN_RAD)
}

fn push(plant: &mut Plant, push_n: [f64; 3]) {
    plant.disturb(Disturbance {
        push_n,
        ..Disturbance::default()
    });
}

/// Goes on with an action, and says whether it is over.
fn is_over(
    action: &Action,
    plant: &mut Plant,
    truth: &Truth,
    since_s: f64,
    from_m: [f64; 3],
) -> bool {
    let acting_s = truth.t_s - since_s;
    match *action {
        Action::Appear | Action::Fault(..) | Action::Repair | Action::Supply(_) | Action::End => {
            true
        }
        Action::Arm(..) => !plant.arm_mut().is_some_and(|arm| arm.is_moving(truth.t_s)),
        Action::Push(_, for_s) => {
            let is_over = acting_s >= for_s;
            if is_over {
                push(plant, [0.0; 3]);
            }
            is_over
        }
        Action::PullOut => {
            let moved_m = from_m[2] - truth.object_m[2];
            let is_over = moved_m >= PULLED_OUT_M || acting_s >= LONGEST_PULL_S;
            if is_over {
                plant.world_mut().remove_object();
                push(plant, [0.0; 3]);
            } else {
                push(plant, [0.0, 0.0, -PULL_N_PER_S * acting_s]);
            }
            is_over
        }
    }
}
