//! Plays a script on the simulated gripper, and does what somebody wants of it at once.

use std::sync::mpsc::{Receiver, Sender};

use sim::arm::Hindrance;
use sim::events;
use sim::fault::Injected;
use sim::gripper::Gripper;
use sim::plant::{Disturbance, Plant, Truth};
use softgrip::Command;
use softgrip::telemetry::Event;

use crate::script::{Action, Script, When};

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
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// It waits for its moment.
    Waiting,
    /// Its moment was there; it acts at this time, s.
    Due(f64),
    /// It acts.
    Acting(Acting),
}

/// A script that is being played.
pub struct Play {
    script: Script,
    gripper: Gripper,
    at: usize,
    stage: Stage,
    /// Names of the events since the step before began.
    heard: Vec<&'static str>,
    pressed: Option<Command>,
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
            pressed: None,
        }
    }

    /// The register that the present step waits for.
    pub fn register(&self) -> Option<u16> {
        match (self.stage, &self.script.steps.get(self.at)?.when) {
            (Stage::Waiting, When::Register { address, .. }) => Some(*address),
            _ => None,
        }
    }

    /// The digital input that has come on, once.
    pub fn take_input(&mut self) -> Option<Command> {
        self.pressed.take()
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
            let begun = Acting::begin(step.action, &self.gripper, plant, seen.truth);
            let acting = begun.unwrap_or_else(|(acting, why)| {
                say(format!("script, line {}: {why}", step.line));
                acting
            });
            if let Action::Input(command) = step.action {
                self.pressed = Some(command);
            }
            self.heard.clear();
            self.stage = Stage::Acting(acting);
        }
        if let Stage::Acting(acting) = self.stage
            && acting.is_over(plant, seen.truth)
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

/// An action that has begun.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Acting {
    action: Action,
    /// When it began, s.
    since_s: f64,
    /// Where the object was then, m.
    from_m: [f64; 3],
}

impl Acting {
    /// Begins an action; where nothing comes of it, also why.
    fn begin(
        action: Action,
        gripper: &Gripper,
        plant: &mut Plant,
        truth: &Truth,
    ) -> Result<Self, (Self, String)> {
        let begun = Self {
            action,
            since_s: truth.t_s,
            from_m: truth.object_m,
        };
        match action {
            Action::Appear => plant.world_mut().place_object(),
            Action::PullOut => plant.world_mut().lower_ground(LOWERED_M),
            Action::Arm(wanted, acceleration) => {
                let task = gripper.arm_task(acceleration);
                let arm = plant.arm_mut();
                let moves = arm.map(|arm| arm.begin(truth.t_s, wanted, &task));
                if let Some(Err(why)) = moves {
                    let why = match why {
                        Hindrance::Moving => "it still moves",
                        Hindrance::Up => "it is up already",
                        Hindrance::Down => "it is down: lift it first",
                    };
                    return Err((begun, format!("the arm stays: {why}")));
                }
            }
            Action::Push(push_n, _) => push(plant, push_n),
            Action::Fault(kind, finger, for_s) => plant.faults_mut().push(Injected {
                kind,
                finger,
                from_s: truth.t_s,
                until_s: truth.t_s + for_s,
            }),
            Action::Repair => {
                plant.faults_mut().clear();
                plant.set_supply(gripper.regulator.supply_v);
            }
            Action::Supply(supply_v) => plant.set_supply(supply_v),
            Action::Input(_) | Action::End => {}
        }
        Ok(begun)
    }

    /// Goes on with it, and says whether it is over.
    fn is_over(&self, plant: &mut Plant, truth: &Truth) -> bool {
        let acting_s = truth.t_s - self.since_s;
        match self.action {
            Action::Appear
            | Action::Fault(..)
            | Action::Repair
            | Action::Supply(_)
            | Action::Input(_)
            | Action::End => true,
            Action::Arm(..) => !plant.arm_mut().is_some_and(|arm| arm.is_moving(truth.t_s)),
            Action::Push(_, for_s) => {
                let is_over = acting_s >= for_s;
                if is_over {
                    push(plant, [0.0; 3]);
                }
                is_over
            }
            Action::PullOut => {
                let moved_m = self.from_m[2] - truth.object_m[2];
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
}

/// What somebody wants to happen to the gripper at once.
pub struct Order {
    /// What.
    pub action: Action,
    /// Whether it has begun, or why nothing comes of it.
    pub answer: Sender<Result<(), String>>,
}

/// Orders as they come.
pub struct Orders {
    orders: Receiver<Order>,
    gripper: Gripper,
    acting: Vec<Acting>,
    pressed: Option<Command>,
}

impl Orders {
    /// From whoever sends them.
    pub fn new(orders: Receiver<Order>, gripper: &Gripper) -> Self {
        Self {
            orders,
            gripper: gripper.clone(),
            acting: Vec::new(),
            pressed: None,
        }
    }

    /// The digital input that has come on, once.
    pub fn take_input(&mut self) -> Option<Command> {
        self.pressed.take()
    }

    /// After each tick.
    pub fn step(&mut self, plant: &mut Plant, truth: &Truth) -> Flow {
        let mut flow = Flow::GoesOn;
        while let Ok(Order { action, answer }) = self.orders.try_recv() {
            let begun = if can_begin(&action, plant) {
                Acting::begin(action, &self.gripper, plant, truth).map_err(|(_, why)| why)
            } else {
                Err("the fingers are not open: an object cannot appear between them".into())
            };
            match action {
                Action::Input(command) => self.pressed = Some(command),
                Action::End => flow = Flow::Ends,
                _ => {}
            }
            // Who has asked may have gone.
            let _ = answer.send(begun.map(|acting| self.acting.push(acting)));
        }
        self.acting.retain(|acting| !acting.is_over(plant, truth));
        flow
    }
}
