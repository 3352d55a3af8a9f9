//! The image and the simulated gripper, one millisecond each in turn.

use std::sync::OnceLock;

use anyhow::{Context, ensure};
use finger::chain::Chain;
use finger::grasp::Grasp;
use finger::recipe;
use rigless::time::VirtualNanos;
use sim::events::TimedEvent;
use sim::gripper::Gripper;
use sim::hand::Hand;
use sim::plant::{Pins, Plant, Truth};
use sim::run::{POSE_TICKS, Pose, Run, Sample};
use sim::scenario::Scenario;
use softgrip::TICK_US;
use softgrip::frontend::FrontEnd;
use softgrip::inputs::Levels;
use softgrip::settings::{FACTORY, Settings};
use softgrip::table::FINGER;
use softgrip::units::{Kilopascals, Microstrain, Volts};

use crate::bench::{self, Record, Setup, moment_at};
use crate::image::Image;
use crate::moment::Moment;
use crate::recording::{Recording, Replay};
use crate::rtt::Host;

/// Nothing applied but the closed stop circuit.
pub const REST: Levels = Levels {
    grip: false,
    release: false,
    stop_closed: true,
    acknowledge: false,
};

/// When the arm sets off, ms: the image runs, and knows the noise of its gauges.
const START_MS: u64 = 100;

/// A converter's code as a share of its reference.
fn share(code: f32) -> f64 {
    f64::from(code) / 65_536.0
}

/// The simulated gripper with the electronics that the image was built for.
pub fn gripper() -> Gripper {
    Gripper {
        front_end: Settings::of(&FACTORY).front_end,
        ..Gripper::reference()
    }
}

/// These electronics.
pub fn front_end() -> FrontEnd {
    FrontEnd::of(&Settings::of(&FACTORY).front_end, [1.0; softgrip::FINGERS])
}

/// Open fingers without pressure.
pub fn pins_at_rest() -> Pins {
    let front_end = front_end();
    Pins {
        gauges: [share(front_end.gauge_code(0, Microstrain(0.0))); 3],
        monitor: share(front_end.monitor_code(Kilopascals(0.0))),
        supply: share(front_end.supply_code(Volts(24.0))),
    }
}

/// The fingers that the image was built for, and how they stand. It takes a second to compute, once.
pub fn fingers() -> anyhow::Result<&'static (Chain, Grasp)> {
    static FINGERS: OnceLock<(Chain, Grasp)> = OnceLock::new();
    if let Some(fingers) = FINGERS.get() {
        return Ok(fingers);
    }
    let recipe = recipe::load(&crate::image::root().join("recipes/rtv225.toml"))?;
    ensure!(
        recipe.inputs_hash == FINGER.inputs_hash,
        "the program was built for another finger than recipes/rtv225.toml: unset SOFTGRIP_RECIPE"
    );
    let grasp = recipe.grasp.context("recipes/rtv225.toml has no [grasp]")?;
    Ok(FINGERS.get_or_init(|| (recipe.chain, grasp)))
}

/// The gripper at the image's pins.
pub struct Loop {
    plant: Plant,
    truths: Vec<Truth>,
    poses: Vec<Pose>,
    /// The robot has asked for a grip.
    gripped: bool,
    /// The 24 V supply, where it is not what it should be, V.
    pub supply_v: Option<f32>,
}

impl Loop {
    /// The gripper above an object.
    pub fn new(scenario: &Scenario, (chain, grasp): &(Chain, Grasp)) -> Self {
        Self {
            plant: Plant::new(scenario, &gripper(), &Hand::alike(chain), grasp),
            truths: Vec::new(),
            poses: Vec::new(),
            gripped: false,
            supply_v: None,
        }
    }

    /// How long the arm's cycle takes, ms.
    pub fn duration_ms(&self) -> u64 {
        (1e3 * self.plant.profile().duration_s()) as u64
    }

    /// One millisecond. Says whether the arm is still on its way.
    pub fn step(&mut self, moment: &mut Moment<'_>) -> bool {
        if moment.ms < START_MS {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
            return true;
        }
        let (mut pins, truth) = self.plant.step_pins(moment.command());
        if let Some(supply) = self.supply_v {
            pins.supply = share(front_end().supply_code(Volts(supply)));
        }
        moment.set_pins(&pins);
        let grip = truth.arm.phase.wants_grip();
        self.gripped |= grip;
        moment.set_levels(Levels {
            grip,
            release: self.gripped && !grip,
            ..REST
        });
        if (self.truths.len() as u64 + 1).is_multiple_of(POSE_TICKS) {
            self.poses.push(Pose::of(&self.plant, &truth));
        }
        self.truths.push(truth);
        (self.truths.len() as u64) < self.duration_ms()
    }
}

/// A whole run: as the simulator tells it, and as the image does.
pub struct Closed {
    /// The run with the image's verdicts.
    pub run: Run,
    /// The image's ticks, done again by the host's controller.
    pub replay: Replay,
    /// What the image reported.
    pub recording: Recording,
    /// What the emulator saw.
    pub record: Record,
}

/// Runs a scenario under the image, with every tick recorded, until the arm is done or `until_ms`.
pub fn run(image: &Image, scenario: &Scenario, until_ms: Option<u64>) -> anyhow::Result<Closed> {
    let setup = Setup {
        telemetry_us: TICK_US as u32,
        ..Setup::new(image, Host::Reading)
    };
    let plant = Loop::new(scenario, fingers()?);
    let (plant, record) = bench::run(&setup, plant, move |plant, moment| {
        let on_its_way = plant.step(moment);
        let done = plant.truths.len() as u64;
        Ok(on_its_way && until_ms.is_none_or(|until| done < until))
    })?;
    let recording = Recording::of(&record.messages)?;
    let replay = Replay::of(&recording)?;
    let run = judge(scenario, &plant, &recording, &replay, &record)?;
    Ok(Closed {
        run,
        replay,
        recording,
        record,
    })
}

/// Lays the image's ticks over the gripper's milliseconds.
fn judge(
    scenario: &Scenario,
    plant: &Loop,
    recording: &Recording,
    replay: &Replay,
    record: &Record,
) -> anyhow::Result<Run> {
    ensure!(
        recording.dropped == 0,
        "the recording lacks {} messages",
        recording.dropped
    );
    // Time of the arm's cycle: its first step was made at the start, and is the first tick.
    let cycle_s = |at: VirtualNanos| 1e-9 * (at.0 as f64 - moment_at(START_MS).0 as f64) + 1e-3;
    let mut samples = Vec::new();
    let mut tick = 0;
    for (i, truth) in plant.truths.iter().enumerate() {
        let end = moment_at(START_MS + i as u64 + 1);
        while record.ticks.get(tick + 1).is_some_and(|next| next.at < end) {
            tick += 1;
        }
        // The last tick of the run may still be on its way to the host.
        let (Some(seen), Some(&snapshot)) = (recording.ticks.get(tick), replay.snapshots.get(tick))
        else {
            break;
        };
        let asked = truth.arm.phase.wants_grip();
        samples.push(Sample {
            truth: *truth,
            seen: snapshot,
            strain_ue: front_end()
                .strains(&seen.frame.gauges)
                .map(|strain| strain.0),
            asked_kpa: if asked { scenario.pressure_kpa } else { 0.0 },
        });
    }
    let events = replay
        .events
        .iter()
        .map(|&(tick, event)| {
            let began = record.ticks.get(tick).context("an event without a tick")?;
            let t_s = cycle_s(began.at);
            Ok(TimedEvent { t_s, event })
        })
        .collect::<anyhow::Result<_>>()?;
    let mut poses = plant.poses.clone();
    poses.retain(|pose| {
        samples
            .last()
            .is_some_and(|last| pose.t_s <= last.truth.t_s)
    });
    Ok(Run::new(scenario, &[], samples, poses, events, record.wall))
}
