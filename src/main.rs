//! The firmware: a board, the control task at 1 kHz, and a task that tells the host.
#![no_std]
#![no_main]

#[cfg(not(all(target_arch = "arm", target_os = "none")))]
compile_error!("this is the firmware; `cargo fw-build` builds it for its target");
#[cfg(not(feature = "board-nucleo-f429zi"))]
compile_error!("choose a board: --features board-nucleo-f429zi");

#[cfg(feature = "board-nucleo-f429zi")]
#[path = "../boards/nucleo_f429zi.rs"]
mod board;
#[path = "firmware/control.rs"]
mod control;
#[path = "firmware/failsafe.rs"]
mod failsafe;
#[path = "firmware/links.rs"]
mod links;
#[path = "firmware/record.rs"]
mod record;
#[path = "firmware/telemetry.rs"]
mod telemetry;

use defmt_rtt as _;
use embassy_executor::Spawner;
use softgrip::Controller;
use softgrip::failure::Failure;
use softgrip::fault::Fault;
use softgrip::settings::Settings;
use softgrip::table::FINGER;

use board::{Clock, ResetReason};

// The output is the chip's first act, before it sets up its variables: 0.3 ms at its first clock.
// SAFETY: the name makes it what the start-up code calls first. It uses no variable, but registers alone.
#[unsafe(no_mangle)]
unsafe extern "C" fn __pre_init() {
    board::safe_output();
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    // First of all: the clocks may fail to start.
    board::start_watchdog();
    let reset = board::reset_reason();
    let failure = record::at_start(reset);
    if let Some(failure) = failure.filter(Failure::is_loop) {
        // Before anything that may fail once more.
        failsafe::stay(&|| {
            defmt::error!("three failures in ten seconds: stopped, until ACK, reset or power-on");
            failsafe::tell(&failure);
        });
    }
    let (board, clock) = board::init();
    let identity = Identity {
        reset,
        clock,
        failure,
    };
    identity.tell();

    match Settings::for_finger(&board::FRONT_END, &FINGER).validate(&board::FRONT_END, &FINGER) {
        Ok(active) => {
            let fault = failure.map(|_| Fault::Internal);
            let controller = Controller::starting_with(fault, &FINGER, active);
            let (sent, received) = links::events().expect("made once");
            spawner.spawn(telemetry::run(received, identity).expect("spawned once"));
            let control = control::run(board, controller, clock, sent);
            board::high_priority().spawn(control.expect("spawned once"));
        }
        Err(error) => failsafe::stay(&|| defmt::error!("wrong settings: {}", error)),
    }
}

/// What runs here, and since when: told at the start, and to a host that asks.
#[derive(Clone, Copy)]
struct Identity {
    reset: ResetReason,
    clock: Clock,
    failure: Option<Failure>,
}

impl Identity {
    fn tell(&self) {
        defmt::info!(
            "softgrip {=str} ({=str}) on {=str}, chip {=[u8; 12]:02x}, reset: {}, clock: {}; finger {=str}, table {=u64:016x}, error {=f32} %",
            env!("CARGO_PKG_VERSION"),
            env!("SOFTGRIP_COMMIT"),
            board::NAME,
            board::unique_id(),
            self.reset,
            self.clock,
            FINGER.recipe,
            FINGER.inputs_hash,
            FINGER.error_bound_percent,
        );
        if let Some(failure) = &self.failure {
            failsafe::tell(failure);
        }
        board::check_brown_out();
    }
}
