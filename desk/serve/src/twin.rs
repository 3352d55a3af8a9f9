//! The simulated gripper, its controller and what a robot on the bus sees of both, tick by tick.

use std::sync::atomic::AtomicU32;

use anyhow::ensure;
use bus::modbus::{Frame, Function, Reply, Request};
use bus::robot::{Link, Robot, Status, Wishes};
use sim::events::TimedEvent;
use sim::fault::{self, FaultKind};
use sim::plant::{Plant, Truth};
use sim::run;
use sim::setup::Setup;
use softgrip::blackbox::{Memory, Recorder, WORDS};
use softgrip::fault::GaugeFault;
use softgrip::settings::{Active, TARE, Values};
use softgrip::table::FingerTable;
use softgrip::telemetry::{Event, Snapshot};
use softgrip::units::{DacCode, FINGERS, Instant};
use softgrip::{Command, Controller, RawFrame, TICK_US};

use crate::script::{Script, When};

/// What one tick has brought.
pub struct Ticked {
    /// The true state of the plant.
    pub truth: Truth,
    /// What the converters delivered.
    pub frame: RawFrame,
    /// What the controller was told to do.
    pub command: Command,
    /// What it made of them.
    pub snapshot: Snapshot,
    /// For the regulator's command converter.
    pub dac: DacCode,
    /// What has failed of each gauge.
    pub gauges: [Option<GaugeFault>; FINGERS],
    /// The controller's events.
    pub events: Vec<Event>,
    /// The settings that the controller works by from this tick on, where they are new to it.
    pub applied: Option<Values>,
    /// The settings with what a tare or a sweep of this tick has found.
    pub learned: Option<Values>,
    /// The answer to the request that was waiting; empty if there is none.
    pub reply: Option<Reply>,
}

/// A gripper with its object, its arm and its controller.
pub struct Twin {
    plant: Plant,
    table: &'static FingerTable,
    controller: Controller,
    link: Link,
    robot: Robot,
    black_box: Recorder,
    id: u8,
    /// The settings in use.
    values: Values,
    /// The controller has not taken them yet.
    is_changed: bool,
    /// A digital input has come on.
    pressed: Option<Command>,
    dac: DacCode,
    ticks: u64,
    is_waiting: bool,
    /// After the last tick.
    status: Option<Status>,
}

impl Twin {
    /// A gripper around its object, or around nothing, under an arm that stands still.
    ///
    /// # Errors
    /// If the settings are not valid, or gripper and object do not go together.
    pub fn new(setup: &Setup, has_object: bool) -> anyhow::Result<Self> {
        setup.check()?;
        let table = setup.table();
        let settings = setup.settings();
        let mut plant = setup.plant_at_object();
        if !has_object {
            plant.world_mut().remove_object();
        }
        // As long as the program lives.
        let memory: &'static Memory = Box::leak(Box::new([const { AtomicU32::new(0) }; WORDS]));
        Ok(Self {
            plant,
            table,
            controller: run::controller(table, &settings)?,
            link: Link::new(),
            robot: Robot::new(settings.bus.id, table, memory),
            black_box: Recorder::new(memory, false),
            id: settings.bus.id,
            values: settings.values(),
            is_changed: false,
            pressed: None,
            dac: DacCode(0),
            ticks: 0,
            is_waiting: false,
            status: None,
        })
    }

    /// The id that the robot calls.
    pub fn id(&self) -> u8 {
        self.id
    }

    /// Checks that a script asks for what there is.
    ///
    /// # Errors
    /// If it looks at a register that cannot be read; the message names its line.
    pub fn check(&self, script: &Script) -> anyhow::Result<()> {
        for step in &script.steps {
            if let When::Register { address, .. } = step.when {
                let is_there = self.read(address).is_some();
                ensure!(
                    is_there,
                    "line {}: register = {address:#06x}: there is no such register that can be read (docs/registers.md has them all)",
                    step.line
                );
            }
        }
        Ok(())
    }

    /// The gripper's own clock.
    pub fn now(&self) -> Instant {
        Instant::from_micros(TICK_US * self.ticks)
    }

    /// The gripper's own clock, s.
    pub fn t_s(&self) -> f64 {
        1e-6 * (TICK_US * self.ticks) as f64
    }

    /// The plant, for a script.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// A digital input comes on.
    pub fn press(&mut self, input: Command) {
        self.pressed = Some(input);
    }

    /// Whether a request waits for its answer.
    pub fn is_waiting(&self) -> bool {
        self.is_waiting
    }

    /// Takes a request. What it does beside the answer is said. It is answered with the status of a tick to come, or
    /// at once with what this gives, and that may be nothing.
    pub fn request(&mut self, frame: &Frame, say: &mut impl FnMut(String)) -> Option<Reply> {
        let mut reply = Reply::new();
        let now = self.now();
        let work = self.robot.request(now, frame, &mut self.values, &mut reply);
        let Some(work) = work else {
            return Some(reply);
        };
        self.is_changed |= work.settings_changed;
        if work.clear_black_box {
            self.black_box.clear();
        }
        if work.save {
            say("settings saved, until the virtual gripper ends".into());
            self.robot.stored(true);
        }
        self.link.ask(work.wishes);
        self.is_waiting = true;
        None
    }

    /// One tick. `damaged` frames have come so far.
    pub fn tick(&mut self, damaged: u16, say: &mut impl FnMut(String)) -> Ticked {
        let is_first = self.ticks == 0;
        let applied = (self.apply_settings() || is_first).then_some(self.values);
        self.ticks += 1;
        let (frame, truth) = self.plant.step(self.dac);
        let pins = match fault::any(self.plant.faults_mut(), FaultKind::Stop, truth.t_s) {
            true => Command::Stop,
            false => self.pressed.take().unwrap_or(Command::Continue),
        };
        if !self.is_waiting {
            // A script wants to know, too.
            self.link.ask(Wishes::NONE);
        }
        let command = self.link.command(pins);
        let outputs = self.controller.step(self.now(), &frame, command);
        self.dac = outputs.dac;
        let events: Vec<Event> = outputs.events.iter().copied().collect();
        let mut is_learned = false;
        for &event in &events {
            let timed = TimedEvent {
                t_s: truth.t_s,
                event,
            };
            say(timed.words());
            self.black_box.report(self.now(), &event);
            is_learned |= self.learn(event, say);
        }
        self.black_box.step(&frame, outputs.dac);
        let status = self.link.ticked(&self.controller, &outputs);
        self.status = status.or(self.status);
        let reply = match status {
            Some(status) if std::mem::take(&mut self.is_waiting) => {
                let mut reply = Reply::new();
                let now = self.now();
                self.robot
                    .answer(now, &status, damaged, &self.values, &mut reply);
                Some(reply)
            }
            _ => None,
        };
        Ticked {
            truth,
            frame,
            command,
            snapshot: outputs.snapshot,
            dac: outputs.dac,
            gauges: self.controller.gauge_faults(),
            events,
            applied,
            learned: is_learned.then_some(self.values),
            reply,
        }
    }

    /// A register as a client would read it now; none if there is none, or before the first tick.
    pub fn register(&self, address: u16) -> Option<u16> {
        let mut robot = self.read(address)?;
        let mut reply = Reply::new();
        robot.answer(self.now(), &self.status?, 0, &self.values, &mut reply);
        match reply.bytes() {
            [_, _, 2, upper, lower, _, _] => Some(u16::from_be_bytes([*upper, *lower])),
            _ => None,
        }
    }

    /// What a robot sees that has been asked for a register; none if there is no such. It is a copy, so that nothing is
    /// counted and no watchdog hears of it.
    fn read(&self, address: u16) -> Option<Robot> {
        let (mut robot, mut values) = (self.robot, self.values);
        let code = Function::ReadHolding as u8;
        let [upper, lower] = address.to_be_bytes();
        let data = [upper, lower, 0, 1];
        let frame = Frame {
            is_broadcast: false,
            code,
            request: Request::decode(code, &data),
        };
        robot.request(self.now(), &frame, &mut values, &mut Reply::new())?;
        Some(robot)
    }

    /// Has the controller use what has been changed, as soon as it may, and says whether it does from now on.
    fn apply_settings(&mut self) -> bool {
        if self.is_changed
            && let Ok(active) = Active::of(&self.values, self.table)
        {
            self.is_changed = self.controller.apply(active).is_err();
            return !self.is_changed;
        }
        false
    }

    /// Keeps what a tare or a sweep has found, and says whether it has found anything.
    fn learn(&mut self, event: Event, say: &mut impl FnMut(String)) -> bool {
        let stated: Vec<(u16, f32)> = match event {
            // The controller uses it already.
            Event::Tared => TARE.into_iter().zip(self.controller.tare_ue()).collect(),
            Event::Swept { .. } => {
                self.is_changed = true;
                let found = self.controller.take_calibration();
                found.map_or(Vec::new(), |found| {
                    found.stated(&self.values, self.table).into()
                })
            }
            _ => return false,
        };
        let is_any = !stated.is_empty();
        for (number, value) in stated {
            if let Err(error) = self.values.set(number, value) {
                say(format!("what has been learned is not kept: {error}"));
            }
        }
        is_any
    }
}
