//! The board that the image is built for. One file per board says pins, clocks and wiring (`nucleo_….rs`); what belongs to
//! a family of chips stands in its own (`stm32….rs`), and what all boards share in the rest.

#[cfg(not(any(feature = "board-nucleo-f429zi", feature = "board-nucleo-g474re")))]
compile_error!("choose a board: --features board-nucleo-f429zi or board-nucleo-g474re");
#[cfg(all(feature = "board-nucleo-f429zi", feature = "board-nucleo-g474re"))]
compile_error!("choose one board, not two");

#[cfg(feature = "board-nucleo-f429zi")]
mod nucleo_f429zi;
#[cfg(feature = "board-nucleo-f429zi")]
mod stm32f4;
#[cfg(feature = "board-nucleo-f429zi")]
use nucleo_f429zi as chosen;

#[cfg(feature = "board-nucleo-g474re")]
mod nucleo_g474re;
#[cfg(feature = "board-nucleo-g474re")]
mod stm32g4;
#[cfg(feature = "board-nucleo-g474re")]
use nucleo_g474re as chosen;

mod analogue;
mod chip;
mod clock;
mod half_duplex;
mod pins;
mod priority;
mod programming;
mod regulator;
mod sectors;

mod wait;
mod watchdog;

pub use chip::{Converter, ResetReason, Serial, check_option_bytes, reset_reason, safe_output};
pub use chosen::{NAME, acknowledged, show_fault};
pub use clock::Clock;
pub use pins::{IndicatorPins, InputPins};
pub use priority::high_priority;
pub use regulator::Regulator;
pub use sectors::SettingsFlash;
pub use wait::wait_us;
pub use watchdog::{feed_watchdog, start_watchdog};

/// The hardware, as the control task uses it.
pub struct Board {
    pub converter: Converter,
    pub regulator: Regulator,
    pub inputs: InputPins,
    pub indicators: IndicatorPins,
}

/// Starts clocks and drivers. The output is safe before and after.
pub fn init() -> (Board, SettingsFlash, Serial, Clock) {
    let clock = match chip::external_clock() {
        true => Clock::External,
        false => Clock::Internal,
    };
    let p = embassy_stm32::init(chosen::config(clock));
    // Setting up the ports may have reset the pin's mode.
    safe_output();
    chip::finish_start(clock == Clock::External);
    let (board, flash, serial) = chosen::board(p);
    (board, flash, serial, clock)
}

/// The chip's own number (unique device ID register).
pub fn unique_id() -> [u8; 12] {
    embassy_stm32::uid::uid()
}
