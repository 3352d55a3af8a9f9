//! The virtual gripper, in this process and in real time.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::Duration;

use bus::robot::Item;
use serve::master::Master;
use serve::pipe::pipe;
use serve::play::{Order, Orders, Play};
use serve::port::Port;
use serve::readout::register;
use serve::run::{self, Line};
use serve::script::{Action, Script};
use serve::twin::{Ticked, Twin};
use sim::events::{self, TimedEvent};
use sim::setup::Setup;

use crate::connection::Connection;
use crate::registers::carry_out;
use crate::tick::{Scale, Tick};
use crate::told::{EventTold, Provenance, SettingsTold, Told};
use crate::wish::{Answer, Asked, Wish, Wishes};

/// The controller's ticks in a second.
const TICKS_HZ: f64 = 1e6 / softgrip::TICK_US as f64;
/// Somebody who may wish something is there: the gripper hears so this often.
const HEARTBEAT: Duration = Duration::from_millis(50);

/// What the virtual gripper is.
#[derive(Debug, Clone)]
pub struct Virtual {
    /// All its parameters.
    pub setup: Setup,
    /// There is an object between the fingers.
    pub has_object: bool,
    /// What happens to it on its own.
    pub script: Option<Script>,
    /// Its seconds in one second.
    pub speed: f64,
}

/// Runs the virtual gripper until nobody listens, or its script ends it.
///
/// # Errors
/// If its settings are not valid, gripper and object do not go together, or the script asks for what there is not.
pub fn open(gripper: &Virtual, rate_hz: f64, with_ticks: bool) -> anyhow::Result<Connection> {
    let Virtual {
        setup,
        has_object,
        script,
        speed,
    } = gripper;
    let twin = Twin::new(setup, *has_object)?;
    if let Some(script) = script {
        twin.check(script)?;
    }
    let table = setup.table();
    let every = (TICKS_HZ / rate_hz).round().max(1.0) as u32;
    let (sender, told) = mpsc::channel();
    let (wishes, asked) = mpsc::channel();
    let (order, orders) = mpsc::channel();
    let (slave, master) = pipe();
    let master = Master::at(master, twin.id());
    let options = run::Options {
        speed: *speed,
        play: script
            .as_ref()
            .map(|script| Play::new(script.clone(), &setup.gripper)),
        orders: Some(Orders::new(orders, &setup.gripper)),
    };
    let provenance = Provenance {
        source: "virtual".into(),
        version: env!("CARGO_PKG_VERSION").into(),
        recipe: table.recipe.into(),
        table: format!("{:016x}", table.inputs_hash),
    };
    thread::spawn(move || {
        let _ = sender.send(Told::Provenance(provenance));
        let stop = Arc::new(AtomicBool::new(false));
        let watch = Watch::new(sender, Arc::clone(&stop), every, with_ticks);
        let watch = RefCell::new(watch);
        let mut log = |line| watch.borrow_mut().said.push(line);
        let mut observe = |ticked: &Ticked| watch.borrow_mut().observe(ticked);
        let summary = run::run(
            Port::Pipe(slave),
            twin,
            options,
            &stop,
            &mut log,
            &mut observe,
        );
        let Watch { sender, .. } = watch.into_inner();
        if !summary.lost.is_zero() {
            let lost_s = summary.lost.as_secs_f64();
            let _ = sender.send(Told::Note(format!(
                "the gripper's clock stood still for {lost_s:.1} s: this machine was too slow"
            )));
        }
        let _ = sender.send(Told::Ended("the virtual gripper has ended".into()));
    });
    thread::spawn(move || answer(master, &order, &asked));
    Ok(Connection {
        name: "the virtual gripper".into(),
        rate_hz: TICKS_HZ / f64::from(every),
        told,
        wishes: Some(Wishes::new(wishes)),
    })
}

/// Tells what each tick brings.
struct Watch {
    sender: Sender<Told>,
    stop: Arc<AtomicBool>,
    scale: Option<Scale>,
    every: u32,
    with_ticks: bool,
    ticks: u32,
    /// What the gripper has said in this tick, its events among it.
    said: Vec<Line>,
}

impl Watch {
    fn new(sender: Sender<Told>, stop: Arc<AtomicBool>, every: u32, with_ticks: bool) -> Self {
        Self {
            sender,
            stop,
            scale: None,
            every,
            with_ticks,
            ticks: 0,
            said: Vec::new(),
        }
    }

    fn tell(&self, told: Told) {
        if self.sender.send(told).is_err() {
            self.stop.store(true, Relaxed);
        }
    }

    fn observe(&mut self, ticked: &Ticked) {
        self.ticks = self.ticks.wrapping_add(1);
        let tick = Tick {
            number: self.ticks,
            now: ticked.snapshot.now,
            frame: ticked.frame,
            command: ticked.command,
            dac: ticked.dac,
        };
        let t_s = 1e-6 * ticked.snapshot.now.micros() as f64;
        for (values, applied) in [(ticked.applied, true), (ticked.learned, false)] {
            if let Some(values) = values {
                self.scale = Some(Scale::of(&values));
                self.tell(Told::Settings(SettingsTold {
                    t_s: Some(t_s),
                    values,
                    applied,
                }));
            }
        }
        let events: Vec<EventTold> = ticked
            .events
            .iter()
            .map(|&event| EventTold {
                t_s,
                name: events::name(&event).into(),
                text: TimedEvent { t_s, event }.words(),
            })
            .collect();
        for Line { text, .. } in self.said.split_off(0) {
            if !events.iter().any(|event| event.text == text) {
                self.tell(Told::Note(text));
            }
        }
        if self.with_ticks {
            self.tell(Told::Tick(Box::new(tick)));
        }
        if self.ticks % self.every == 1 % self.every
            && let Some(scale) = &self.scale
        {
            let seen = scale.observe(&tick, &ticked.snapshot, Some(ticked.gauges));
            self.tell(Told::Observation(Box::new(seen)));
        }
        for event in events {
            self.tell(Told::Event(event));
        }
    }
}

/// Carries out wishes until nobody can have any.
fn answer(mut master: Master, order: &Sender<Order>, asked: &Receiver<Asked>) {
    loop {
        let Asked { wish, answer } = match asked.recv_timeout(HEARTBEAT) {
            Ok(asked) => asked,
            Err(RecvTimeoutError::Timeout) => {
                // Nothing is to be known but that the gripper is still there.
                if is_alive(&mut master).is_err() {
                    return;
                }
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => return,
        };
        let done = match wish {
            Wish::World(action) => happen(order, action),
            wish => carry_out(&mut master, &wish),
        };
        // Who has asked may have gone, and where the gripper has, the answer's sender goes, too.
        match done {
            Ok(done) => drop(answer.send(done)),
            Err(_) => return,
        }
    }
}

/// Looks whether the gripper is there, which tells it that somebody is.
fn is_alive(master: &mut Master) -> anyhow::Result<()> {
    master.read(register(Item::State)?, 1)?;
    Ok(())
}

/// Has something happen to the gripper.
fn happen(order: &Sender<Order>, action: Action) -> anyhow::Result<Answer> {
    let (answer, answered) = mpsc::channel();
    order.send(Order { action, answer })?;
    Ok(match answered.recv()? {
        Ok(()) => Answer::Done,
        Err(why) => Answer::Refused(why),
    })
}
