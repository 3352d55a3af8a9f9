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
#[path = "firmware/telemetry.rs"]
mod telemetry;

use defmt_rtt as _;
use embassy_executor::Spawner;
use softgrip::Controller;
use softgrip::fault::Fault;
use softgrip::settings::Settings;
use softgrip::table::FINGER;

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    // First of all: the clocks may fail to start.
    board::safe_output();
    let reset = board::reset_reason();
    let board = board::init();
    defmt::info!(
        "softgrip {=str} on {=str}, reset: {}; finger {=str}, table {=u64:016x}, error {=f32} %",
        env!("CARGO_PKG_VERSION"),
        board::NAME,
        reset,
        FINGER.recipe,
        FINGER.inputs_hash,
        FINGER.error_bound_percent,
    );

    match Settings::for_finger(&board::FRONT_END, &FINGER).validate(&board::FRONT_END, &FINGER) {
        Ok(active) => {
            let fault = reset.is_the_programs().then_some(Fault::Internal);
            let controller = Controller::starting_with(fault, &FINGER, active);
            let (sent, received) = links::events().expect("made once");
            spawner.spawn(telemetry::run(received).expect("spawned once"));
            let control = control::run(board, controller, sent);
            board::high_priority().spawn(control.expect("spawned once"));
        }
        // Nothing starts, and the output stays safe.
        Err(error) => defmt::error!("wrong settings: {}", error),
    }
}
