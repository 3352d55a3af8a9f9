//! Runs the image on the emulated board, and stops once per millisecond for a script.

use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use anyhow::Context;
use decode::Decoded;
use rigless::device::{Level, ResetCause};
use rigless::emulator::{
    self, AccessKind, Driver, HitKind, Host, InterruptLine, Settled, Start, Stop, Watch,
};
use rigless::session::Session;
use rigless::soc::stm32f427::generated::{DAC, IWDG, TIM5};
use rigless::soc::{Layout, Width};
use rigless::time::VirtualNanos;
use sha2::{Digest, Sha256};
use softgrip::inputs::Levels;
use softgrip::units::DacCode;

use crate::board::{DacWrite, Nucleo, REFERENCE_CODE};
use crate::flash::Array;
use crate::image::Image;
use crate::moment::Moment;
use crate::rtt::{self, Rtt};

/// Nanoseconds of a millisecond.
pub const MS: u64 = 1_000_000;

/// When the control tick comes after the whole millisecond, and a little more: what stands at the pins changes just
/// after it, so that a tick averages one state of the gripper and not two. It follows from how long the image takes to
/// start, see [`find_tick`].
static AFTER_THE_TICK: OnceLock<u64> = OnceLock::new();
const A_LITTLE: u64 = 50_000;

/// When the script is called for the `ms`th time.
pub fn moment_at(ms: u64) -> VirtualNanos {
    let after = AFTER_THE_TICK.get().copied().unwrap_or(0);
    VirtualNanos(if ms == 0 { 0 } else { ms * MS + after })
}

/// Finds out when the image's ticks come. To be called before any run that looks at more than that.
pub fn find_tick(image: &Image) -> anyhow::Result<()> {
    let setup = Setup::new(image, rtt::Host::Absent);
    let ((), record) = run(&setup, (), |(), moment| Ok(moment.ms < 20))?;
    let tick = record.ticks.last().context("the image never ticks")?;
    AFTER_THE_TICK.get_or_init(|| (tick.at.0 + A_LITTLE) % MS);
    Ok(())
}

/// A variable that gets a value once the firmware has set up its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preset {
    /// Where it lies.
    pub address: u64,
    /// What it gets.
    pub value: u32,
}

/// The watchdog's key that gives it its whole time again (RM0090, IWDG_KR).
const FEEDS: u64 = 0xaaaa;

/// Where the factory has noted what the internal reference reads at 3.3 V.
const VREFIN_CAL: u64 = 0x1fff_7a2a;

/// A message of the firmware, and the millisecond in which it was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Milliseconds since power-on.
    pub ms: u64,
    /// What it says.
    pub decoded: Decoded,
}

impl Message {
    /// What a line says, without level and time stamp; nothing if it is a record.
    pub fn text(&self) -> &str {
        match &self.decoded {
            Decoded::Record(_) => "",
            Decoded::Line(line) => &line.text,
        }
    }
}

/// One call of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tick {
    /// When.
    pub at: VirtualNanos,
    /// Instructions since power-on, at the call.
    pub retired: u64,
    /// Instructions from the call to the write of its result.
    pub step: u64,
    /// What was written.
    pub dac: DacCode,
}

/// A restart of the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reset {
    /// When.
    pub at: VirtualNanos,
    /// Why.
    pub cause: ResetCause,
}

/// What a run left behind.
#[derive(Debug, Default)]
pub struct Record {
    /// Everything that the firmware said.
    pub messages: Vec<Message>,
    /// Messages that could not be read.
    pub malformed: u64,
    /// Every write of the command output.
    pub dac: Vec<DacWrite>,
    /// Every call of the controller.
    pub ticks: Vec<Tick>,
    /// Every restart.
    pub resets: Vec<Reset>,
    /// Every arrival at the watched instruction.
    pub hits: Vec<VirtualNanos>,
    /// Every moment in which something came into the RTT buffer, where that was asked for.
    pub rtt_writes: Vec<VirtualNanos>,
    /// Milliseconds that were run.
    pub ms: u64,
    /// Instructions that were run.
    pub instructions: u64,
    /// The bytes that came over RTT.
    pub rtt: Vec<u8>,
    /// Over messages' bytes, every write's time and code, and every instruction count.
    pub digest: String,
    /// Time on the clock on the wall.
    pub wall: Duration,
}

impl Record {
    /// The first message from `ms` on that contains a text.
    pub fn message(&self, from_ms: u64, text: &str) -> Option<&Message> {
        self.messages
            .iter()
            .find(|message| message.ms >= from_ms && message.text().contains(text))
    }

    /// Instructions from each tick to the next, of everything.
    pub fn tick_instructions(&self) -> Vec<u64> {
        let pairs = self.ticks.windows(2);
        pairs
            .map(|pair| pair[1].retired - pair[0].retired)
            .collect()
    }

    /// Simulated time over wall time.
    pub fn realtime_factor(&self) -> f64 {
        1e-3 * self.ms as f64 / self.wall.as_secs_f64()
    }
}

/// Bytes that lie somewhere in the chip's memory before it starts.
pub struct Placed {
    /// Where.
    pub address: u64,
    /// What.
    pub bytes: Vec<u8>,
}

/// How a run begins.
pub struct Setup<'a> {
    /// What is run.
    pub image: &'a Image,
    /// What the host at the debug port does.
    pub host: rtt::Host,
    /// The millisecond from which on it does so.
    pub host_from_ms: u64,
    /// Whether the ST-LINK gives the chip its clock.
    pub has_clock: bool,
    /// What else lies in flash.
    pub placed: Option<Placed>,
    /// What the settings' flash holds; nothing, as from the factory, if none.
    pub settings: Option<Vec<u8>>,
    /// Time between two snapshots, µs.
    pub telemetry_us: u32,
    /// Another variable with a value of its own.
    pub preset: Option<Preset>,
    /// An instruction whose arrivals are noted.
    pub watch: Option<u64>,
    /// Whether the moments are noted in which something comes into the RTT buffer. Slows the run down.
    pub watch_rtt: bool,
    /// An instruction before which a control tick falls.
    pub tick_before: Option<u64>,
}

impl<'a> Setup<'a> {
    /// A run as on the desk.
    pub fn new(image: &'a Image, host: rtt::Host) -> Self {
        Self {
            image,
            host,
            host_from_ms: 0,
            has_clock: true,
            placed: None,
            settings: None,
            telemetry_us: 20_000,
            preset: None,
            watch: None,
            watch_rtt: false,
            tick_before: None,
        }
    }
}

/// The emulator's driver.
struct Bench<S, F> {
    state: S,
    script: F,
    next_ms: u64,
    rtt: Rtt,
    host_from_ms: u64,
    /// An instruction before which a control tick is still to be brought about.
    tick_before: Option<u64>,
    levels: Levels,
    /// Address of the controller's step.
    step: u64,
    /// A call of the controller whose result has not been written yet.
    open: Option<Tick>,
    resets: usize,
    /// A variable that is set once the firmware has set up its own.
    preset: Option<Preset>,
    /// The time between two snapshots, which is set once the firmware has set it from its settings.
    period: Preset,
    /// Which of the two are still to be set.
    unset: [bool; 2],
    record: Record,
    digest: Sha256,
    failed: Option<anyhow::Error>,
}

/// Address of the command output's holding register.
fn holding_register() -> u64 {
    use rigless::soc::stm32f427::generated::dac::Register;
    DAC.base + u64::from(Register::Dhr12r1.spec().offset)
}

impl<S: Send, F> Bench<S, F>
where
    F: FnMut(&mut S, &mut Moment<'_>) -> anyhow::Result<bool> + Send,
{
    fn follow_resets(&mut self, session: &mut Session<Nucleo>) {
        while let Some(reset) = session.resets().get(self.resets).copied() {
            self.resets += 1;
            self.record.resets.push(Reset {
                at: reset.at,
                cause: reset.cause,
            });
            self.open = None;
            self.unset = [true; 2];
            self.rtt.restart();
            // The model of the ports forgets what drives them.
            session.board_mut().set_levels(reset.at, self.levels);
        }
    }

    fn each_ms(
        &mut self,
        session: &mut Session<Nucleo>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> anyhow::Result<bool> {
        let ms = self.next_ms;
        for write in session.board_mut().dac().writes.drain(..) {
            self.digest.update(write.at.0.to_le_bytes());
            let code = write.code.map_or(u16::MAX, |code| code.0);
            self.digest.update(code.to_le_bytes());
            self.record.dac.push(write);
        }
        let (bytes, decoded) = match ms >= self.host_from_ms {
            true => self.rtt.take(host)?,
            false => Default::default(),
        };
        self.digest.update(&bytes);
        self.digest.update(stop.instruction_count.to_le_bytes());
        self.record.rtt.extend(&bytes);
        self.record
            .messages
            .extend(decoded.into_iter().map(|decoded| Message { ms, decoded }));
        self.record.malformed = self.rtt.malformed();
        self.record.ms = ms;
        self.record.instructions = stop.instruction_count;
        let mut moment = Moment {
            ms,
            session,
            host,
            levels: &mut self.levels,
            stop,
        };
        let goes_on = (self.script)(&mut self.state, &mut moment)?;
        self.follow_resets(session);
        Ok(goes_on)
    }
}

impl<S: Send, F> Driver<Nucleo> for Bench<S, F>
where
    F: FnMut(&mut S, &mut Moment<'_>) -> anyhow::Result<bool> + Send,
{
    fn on_settled(&mut self, session: &mut Session<Nucleo>, host: &mut dyn Host, settled: Settled) {
        self.follow_resets(session);
        match settled {
            Settled::Hit(hit) if hit.kind == HitKind::Write => {
                self.record.rtt_writes.push(hit.at);
            }
            // The watchdog is the first that it starts once its variables are there.
            Settled::Access { access, value } if access.address == IWDG.base => {
                let [preset, period] = &mut self.unset;
                let preset = std::mem::take(preset).then_some(self.preset).flatten();
                // The control task feeds it before its first tick, and before another task has its turn.
                let period = (value == FEEDS && std::mem::take(period)).then_some(self.period);
                for Preset { address, value } in preset.into_iter().chain(period) {
                    if let Err(error) = host.write(address, Width::W32, value.into()) {
                        self.failed = Some(error.into());
                    }
                }
            }
            Settled::Hit(hit) if hit.address == self.step => {
                self.open = Some(Tick {
                    at: hit.at,
                    retired: hit.instruction_count,
                    step: 0,
                    dac: DacCode(0),
                });
            }
            Settled::Hit(hit) if Some(hit.address) == self.tick_before => {
                self.tick_before = None;
                if let Err(error) = session.board_mut().make_tick_due(hit.at) {
                    self.failed = Some(error);
                }
                let line = InterruptLine::new(TIM5.interrupts[0]).expect("the chip has it");
                host.set_interrupt(line, Level::High);
            }
            Settled::Hit(hit) => self.record.hits.push(hit.at),
            Settled::Access { access, value }
                if access.kind == AccessKind::Write && access.address == holding_register() =>
            {
                if let Some(tick) = self.open.take() {
                    self.record.ticks.push(Tick {
                        step: access.instruction_count - tick.retired,
                        dac: DacCode(value as u16),
                        ..tick
                    });
                }
            }
            _ => {}
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Nucleo>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        // A stop can be for something else, or some nanoseconds late.
        if stop.at >= moment_at(self.next_ms) {
            match self.each_ms(session, stop, host) {
                Ok(true) => self.next_ms += 1,
                Ok(false) => return None,
                Err(error) => {
                    self.failed = Some(error);
                    return None;
                }
            }
        }
        Some(moment_at(self.next_ms))
    }
}

/// Runs the image from power-on until the script, called once per millisecond, says no. Gives what the
/// script kept, and what the run left.
pub fn run<S: Send + 'static>(
    setup: &Setup<'_>,
    state: S,
    script: impl FnMut(&mut S, &mut Moment<'_>) -> anyhow::Result<bool> + Send + 'static,
) -> anyhow::Result<(S, Record)> {
    let image = setup.image;
    let step = image.function("controller::Controller::step")?;
    let mut images = vec![rigless::image::Image::new(
        &image.path,
        image.bytes.clone(),
        None,
    )?];
    let factory = Placed {
        address: VREFIN_CAL,
        bytes: REFERENCE_CODE.to_le_bytes().to_vec(),
    };
    for placed in setup.placed.iter().chain([&factory]) {
        let bytes = placed.bytes.clone();
        images.push(rigless::image::Image::new(
            Path::new("placed"),
            bytes,
            Some(placed.address),
        )?);
    }
    let array = Array::new(setup.settings.as_deref());
    let board = Nucleo::new(setup.has_clock, array)?;
    let mut session = Session::new(Box::new(board), 0, VirtualNanos(0))?;
    session.watch(Watch::Instruction(step.address));
    for address in setup.watch.into_iter().chain(setup.tick_before) {
        session.watch(Watch::Instruction(address));
    }
    let block = image.variable("_SEGGER_RTT")?.address;
    if setup.watch_rtt {
        session.watch(Watch::Writes {
            address: block + rtt::WRITTEN,
            length: 4,
        });
    }
    let period = image.variable("TELEMETRY_PERIOD_US")?.address;
    let rtt = Rtt::new(block, setup.host, image.messages);
    let bench = Bench {
        state,
        script,
        next_ms: 0,
        rtt,
        host_from_ms: setup.host_from_ms,
        tick_before: setup.tick_before,
        levels: Levels::default(),
        step: step.address,
        open: None,
        resets: 0,
        preset: setup.preset,
        period: Preset {
            address: period,
            value: setup.telemetry_us,
        },
        unset: [true; 2],
        record: Record::default(),
        digest: Sha256::new(),
        failed: None,
    };
    let began = Instant::now();
    let finished = emulator::run(session, &Start::new(&images), bench).context("the emulator")?;
    let mut bench = finished.driver;
    if let Some(error) = bench.failed {
        return Err(error);
    }
    bench.record.wall = began.elapsed();
    bench.record.digest = format!("{:x}", bench.digest.finalize());
    Ok((bench.state, bench.record))
}
