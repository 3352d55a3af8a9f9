//! Grasps: the image's verdicts against what really happened, and against the host's controller.

use sim::hand::Hand;
use sim::run::{self, Outcome as Physics, Run};
use sim::scenario::{ObjectKind, Scenario};
use softgrip::settings::{FACTORY, Settings};
use softgrip::table::FINGER;

use super::test::{Context, Outcome, Test};
use crate::closed_loop::{self, Closed};

pub const TESTS: [Test; 6] = [
    Test {
        name: "grasp: sphere 150 g, 5 m/s²",
        about: "is carried and arrives; nothing is reported lost",
        run: |context| grasp(context, ObjectKind::Sphere, 0.150, 5.0, Physics::Hold),
    },
    Test {
        name: "grasp: sphere 150 g, 10 m/s²",
        about: "is lost while being carried",
        run: |context| grasp(context, ObjectKind::Sphere, 0.150, 10.0, Physics::Transfer),
    },
    Test {
        name: "grasp: sphere 250 g, 10 m/s²",
        about: "is lost while being picked",
        run: |context| grasp(context, ObjectKind::Sphere, 0.250, 10.0, Physics::Pick),
    },
    Test {
        name: "grasp: cylinder 80 g, 5 m/s²",
        about: "is carried and arrives; nothing is reported lost",
        run: |context| grasp(context, ObjectKind::Cylinder, 0.080, 5.0, Physics::Hold),
    },
    Test {
        name: "grasp: cylinder 150 g, 10 m/s²",
        about: "is lost while being picked",
        run: |context| grasp(context, ObjectKind::Cylinder, 0.150, 10.0, Physics::Pick),
    },
    Test {
        name: "repeat",
        about: "two runs are the same to the bit: outputs with their times, RTT bytes, instructions",
        run: repeat,
    },
];

/// The image's pins go through one more converter than the simulator's, and its tick is later.
const LATENCY_MORE_MS: f64 = 1.0;

fn scenario(object: ObjectKind, mass_kg: f64, accel_m_s2: f64) -> Scenario {
    Scenario {
        object,
        mass_kg,
        accel_m_s2,
        ..Scenario::default()
    }
}

fn grasp(
    context: &Context<'_>,
    object: ObjectKind,
    mass_kg: f64,
    accel_m_s2: f64,
    physics: Physics,
) -> anyhow::Result<Outcome> {
    let scenario = scenario(object, mass_kg, accel_m_s2);
    let closed = closed_loop::run(context.image, &scenario, None)?;
    let mut outcome = Outcome::default();
    same_as_host(&closed, &mut outcome);

    let run = &closed.run;
    outcome.must(
        run.outcome == physics,
        format!("the object's fate was {:?}, not {physics:?}", run.outcome),
    );
    if let Some(mistake) = run.mistake() {
        outcome.failures.push(mistake);
    }
    let host = on_host(&scenario)?;
    if let (Some(image_ms), Some(host_ms)) = (run.latency_ms(), host.latency_ms()) {
        outcome.number("loss reported after the collapse, host", host_ms, "ms");
        outcome.at_most(
            "loss reported after the collapse, image",
            image_ms,
            "ms",
            host_ms + LATENCY_MORE_MS,
        );
    }
    outcome.must(
        run.latency_ms().is_some() == host.latency_ms().is_some(),
        "image and host disagree about a loss",
    );
    let factor = closed.record.realtime_factor();
    outcome.number("speed, × real time", factor, "");
    Ok(outcome)
}

/// Every tick of the image, done again by the host's controller, must give the same bits.
fn same_as_host(closed: &Closed, outcome: &mut Outcome) {
    let (recording, record) = (&closed.recording, &closed.record);
    outcome.number("ticks compared", recording.ticks.len() as f64, "");
    outcome.at_most(
        "ticks that differ from the host's controller",
        closed.replay.differing as f64,
        "",
        0.0,
    );
    outcome.failures.extend(closed.replay.differences.clone());
    // What the image says that it has put out must be what has come out.
    let put_out = recording
        .ticks
        .iter()
        .zip(&record.ticks)
        .filter(|(seen, tick)| seen.dac != tick.dac)
        .count();
    outcome.at_most(
        "codes at the converter that differ",
        put_out as f64,
        "",
        0.0,
    );
    outcome.must(
        recording.ticks.len() + 2 >= record.ticks.len(),
        format!(
            "of {} ticks only {} were recorded",
            record.ticks.len(),
            recording.ticks.len()
        ),
    );
}

fn on_host(scenario: &Scenario) -> anyhow::Result<Run> {
    let settings = Settings::of(&FACTORY);
    let controller = run::controller(&FINGER, &settings)?;
    let (chain, grasp) = closed_loop::fingers()?;
    Ok(run::run(
        scenario,
        &closed_loop::gripper(),
        &Hand::alike(chain),
        grasp,
        controller,
        &[],
        |_| {},
    ))
}

fn repeat(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let scenario = scenario(ObjectKind::Sphere, 0.150, 10.0);
    let run = || closed_loop::run(context.image, &scenario, Some(2_500));
    let (first, second) = (run()?.record, run()?.record);
    let mut outcome = Outcome::default();
    outcome.number("RTT bytes", first.rtt.len() as f64, "");
    outcome.number("instructions", first.instructions as f64, "");
    outcome.must(
        first.digest == second.digest && first.ticks == second.ticks,
        format!("{} and {}", first.digest, second.digest),
    );
    outcome.notes.push(format!("SHA-256 {}", first.digest));
    Ok(outcome)
}
