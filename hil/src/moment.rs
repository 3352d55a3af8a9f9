//! What a script sees of the emulated chip, and does to it, between two milliseconds.

use std::ops::Range;

use anyhow::anyhow;
use rigless::emulator::{Host, Stop};
use rigless::session::Session;
use rigless::soc::Width;
use sim::plant::Pins;
use softgrip::inputs::Levels;
use softgrip::telemetry::Indicators;
use softgrip::units::DacCode;

use crate::board::{Nucleo, Restart};
use crate::image::RAM;

/// What the stack is painted with.
const PAINT: u32 = 0xa5a5_5a5a;

/// What a script sees and does, between two milliseconds.
pub struct Moment<'a> {
    /// Milliseconds since power-on.
    pub ms: u64,
    /// The emulated board.
    pub session: &'a mut Session<Nucleo>,
    /// The emulator that runs its core.
    pub host: &'a mut dyn Host,
    /// What the robot applies to the inputs.
    pub levels: &'a mut Levels,
    /// Where the core stands.
    pub stop: Stop,
}

impl Moment<'_> {
    /// Puts voltages on the converter's pins.
    pub fn set_pins(&mut self, pins: &Pins) {
        self.session.board_mut().set_pins(pins, 1.0);
    }

    /// The same on a board whose 3.3 V rail is off by a factor.
    pub fn set_pins_at_rail(&mut self, pins: &Pins, rail: f64) {
        self.session.board_mut().set_pins(pins, rail);
    }

    /// Changes what the robot applies to the inputs.
    pub fn set_levels(&mut self, levels: Levels) {
        *self.levels = levels;
        self.session.board_mut().set_levels(self.stop.at, levels);
    }

    /// The regulator's command.
    pub fn command(&mut self) -> DacCode {
        self.session.board_mut().command()
    }

    /// What the robot is told.
    pub fn indicators(&mut self) -> Indicators {
        self.session.board_mut().indicators()
    }

    /// A word of the chip's memory.
    pub fn word(&mut self, address: u64) -> anyhow::Result<u32> {
        let word = self.host.read(address, Width::W32)?;
        Ok(word as u32)
    }

    /// Changes a word of the chip's RAM.
    pub fn set_word(&mut self, address: u64, value: u32) -> anyhow::Result<()> {
        self.host.write(address, Width::W32, value.into())?;
        Ok(())
    }

    /// Reads a register of the chip as a debugger does.
    pub fn register(&mut self, address: u64) -> anyhow::Result<u32> {
        use rigless::mcu::Operate;
        let value = self
            .session
            .mcu()
            .peek(self.stop.at, address, Width::W32)
            .map_err(|fault| anyhow!("{address:#010x}: {fault:?}"))?;
        Ok(value as u32)
    }

    /// Writes a register of the chip.
    pub fn set_register(&mut self, address: u64, value: u32) -> anyhow::Result<()> {
        use rigless::mcu::Operate;
        self.session
            .mcu()
            .write(self.stop.at, address, Width::W32, value.into())
            .map_err(|fault| anyhow!("{address:#010x}: {fault:?}"))
    }

    /// Paints the stack, before anything has been put on it.
    pub fn paint(&mut self, stack: Range<u64>) -> anyhow::Result<()> {
        for address in stack.step_by(4) {
            self.set_word(address, PAINT)?;
        }
        Ok(())
    }

    /// Bytes from the stack's beginning down to the last where the paint is gone.
    pub fn used(&mut self, stack: Range<u64>) -> anyhow::Result<u64> {
        for address in stack.clone().step_by(4) {
            if self.word(address)? != PAINT {
                return Ok(stack.end - address);
            }
        }
        Ok(0)
    }

    /// Has the core's stores just below and above RAM fail, as they do on the chip; the model lets them pass.
    pub fn guard_ram(&mut self) {
        // Each serves once; an overflow and the fault that follows take less.
        for _ in 0..64 {
            self.session.fail_next(RAM.start - 0x8000, RAM.start);
            self.session.fail_next(RAM.end, RAM.end + 0x2_0000);
        }
    }

    /// Fills the chip's RAM with what it holds after a power-on: nothing in particular.
    pub fn scramble_ram(&mut self) -> anyhow::Result<()> {
        let mut noise = 0x9e37_79b9u32;
        for address in RAM.step_by(4) {
            // xorshift
            noise ^= noise << 13;
            noise ^= noise >> 17;
            noise ^= noise << 5;
            self.set_word(address, noise)?;
        }
        Ok(())
    }

    /// Restarts the chip.
    pub fn restart(&mut self, restart: Restart) {
        self.session.board_mut().set_restart(restart);
        self.session
            .reset_by_pin(self.stop.at, self.stop.instruction_count, self.host);
    }
}
