//! Makes a task go wrong: code for it waits in a corner of flash, and the task is led there.

use anyhow::Context;

use crate::bench::Placed;
use crate::calls;
use crate::image::{Image, Symbol};
use crate::moment::Moment;

/// In bank 2, which the image leaves to the settings; its last sector.
const CORNER: u64 = 0x081e_0000;
/// Room for each piece of code.
const ROOM: u64 = 32;

/// What a task does instead of its work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrong {
    /// It never returns.
    Hang,
    /// It returns at once, and is never woken again.
    Stop,
    /// It comes upon an undefined instruction.
    HardFault,
    /// It fills its stack, and what lies below.
    StackOverflow,
    /// Its stack pointer goes astray, above all RAM.
    StackAway,
    /// An interrupt is enabled and comes that nobody handles.
    Interrupt,
    /// It panics.
    Panic,
}

/// Which task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// 1 kHz, at interrupt priority.
    Control,
    /// Tells the host.
    Telemetry,
}

impl Wrong {
    const ALL: [Self; 7] = [
        Self::Hang,
        Self::Stop,
        Self::HardFault,
        Self::StackOverflow,
        Self::StackAway,
        Self::Interrupt,
        Self::Panic,
    ];

    /// Where its code lies.
    pub fn address(self) -> u64 {
        CORNER + ROOM * self as u64
    }

    fn code(self, image: &Image) -> anyhow::Result<Vec<u8>> {
        let halves: &[u16] = match self {
            // b .
            Self::Hang => &[0xe7fe],
            // bx lr
            Self::Stop => &[0x4770],
            // udf #0
            Self::HardFault => &[0xde00],
            // push {r0-r7, lr}; b back to it
            Self::StackOverflow => &[0xb5ff, 0xe7fd],
            // movw r0, #0; movt r0, #0x2004; mov sp, r0; udf #0
            Self::StackAway => &[0xf240, 0x0000, 0xf2c2, 0x0004, 0x4685, 0xde00],
            // movw r0, #0xe100; movt r0, #0xe000 (enable the first, and 0x100 above: have it come);
            // movs r1, #1; str r1, [r0]; str.w r1, [r0, #0x100]; b .
            Self::Interrupt => &[
                0xf24e, 0x1000, 0xf2ce, 0x0000, 0x2101, 0x6001, 0xf8c0, 0x1100, 0xe7fe,
            ],
            // ldr.w pc, [pc]: what follows is where to.
            Self::Panic => {
                let site = calls::panic_site(image).context("the image never panics")?;
                let to = (site as u32 | 1).to_le_bytes();
                return Ok([&[0xdf, 0xf8, 0x00, 0xf0], &to[..]].concat());
            }
        };
        Ok(halves.iter().flat_map(|half| half.to_le_bytes()).collect())
    }
}

/// The code for everything that can go wrong.
pub fn placed(image: &Image) -> anyhow::Result<Placed> {
    let mut bytes = vec![0xff; ROOM as usize * Wrong::ALL.len()];
    for wrong in Wrong::ALL {
        let code = wrong.code(image)?;
        let at = (wrong.address() - CORNER) as usize;
        bytes[at..at + code.len()].copy_from_slice(&code);
    }
    Ok(Placed {
        address: CORNER,
        bytes,
    })
}

/// Where a failing program switches its interrupts off.
pub fn interrupts_off(image: &Image) -> anyhow::Result<u64> {
    // cpsid i
    const OFF: u16 = 0xb672;
    let stop = image.function("failsafe::stop")?;
    let code = image.code(stop)?;
    let at = code.iter().position(|&half| half == OFF);
    let at = at.context("failsafe::stop leaves the interrupts on")?;
    Ok(stop.address + 2 * at as u64)
}

/// A task led astray.
pub struct Derailment {
    pool: Symbol,
    /// The functions that poll tasks.
    polls: Vec<u32>,
    to: u32,
}

impl Derailment {
    /// What it takes to have `task` go `wrong`.
    pub fn new(image: &Image, task: Task, wrong: Wrong) -> anyhow::Result<Self> {
        let pool = image.variable(match task {
            Task::Control => "control::run::POOL",
            Task::Telemetry => "telemetry::run::POOL",
        })?;
        let polls = image
            .functions()
            .filter(|(name, _)| name.contains("TaskStorage") && name.ends_with("::poll"))
            .map(|(_, symbol)| symbol.address as u32 | 1)
            .collect();
        Ok(Self {
            pool,
            polls,
            to: wrong.address() as u32 | 1,
        })
    }

    /// From its next turn on: the executor calls a task by a pointer in the task's header.
    pub fn apply(&self, moment: &mut Moment<'_>) -> anyhow::Result<()> {
        let header = (self.pool.address..self.pool.address + self.pool.size).step_by(4);
        for place in header.take(16) {
            let word = moment.word(place)?;
            if self.polls.contains(&word) {
                return moment.set_word(place, self.to);
            }
        }
        anyhow::bail!("no pointer to a task's function in its header")
    }
}
