//! The firmware: a board, the control task at 1 kHz, a task that tells the host, and one that stores settings.
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
#[path = "firmware/identity.rs"]
mod identity;
#[path = "firmware/line.rs"]
mod line;
#[path = "firmware/links.rs"]
mod links;
#[path = "firmware/log.rs"]
mod log;
#[path = "firmware/record.rs"]
mod record;
#[path = "firmware/storage.rs"]
mod storage;
#[path = "firmware/telemetry.rs"]
mod telemetry;

use core::sync::atomic::Ordering::Relaxed;

use embassy_executor::Spawner;
use softgrip::Controller;
use softgrip::failure::Failure;
use softgrip::fault::Fault;
use softgrip::march::march;
use softgrip::settings::Active;
use softgrip::table::FINGER;

use identity::Identity;

// The output is the chip's first act. Then the memory of the variables is tested, which nobody uses yet: 3 ms
// at the chip's first clock. With bad memory nothing can run, and the output stays safe.
// SAFETY: the name makes it what the start-up code calls first. It uses no variable, but registers and stack.
#[unsafe(no_mangle)]
unsafe extern "C" fn __pre_init() {
    unsafe extern "C" {
        static mut __sdata: u32;
        static mut __ebss: u32;
    }
    board::safe_output();
    let first = &raw mut __sdata;
    let words = (&raw mut __ebss as usize - first as usize) / size_of::<u32>();
    let good = march(
        words,
        // SAFETY: within the words that the start-up code is about to set.
        |at| unsafe { first.add(at).read_volatile() },
        |at, value| unsafe { first.add(at).write_volatile(value) },
    );
    if !good {
        board::show_fault();
        loop {
            cortex_m::asm::wfi();
        }
    }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    // First of all: the clocks may fail to start.
    board::start_watchdog();
    log::start();
    let reset = board::reset_reason();
    let failure = record::at_start(reset);
    if let Some(failure) = failure.filter(Failure::is_loop) {
        // Before anything that may fail once more.
        failsafe::stay(&|| {
            defmt::error!("three failures in ten seconds: stopped, until ACK, reset or power-on");
            failsafe::tell(&failure);
        });
    }
    let (board, flash, serial, clock) = board::init();
    let identity = Identity {
        reset,
        clock,
        failure,
    };
    identity.tell();

    let keeper = storage::keeper(flash).expect("made once");
    let black_box = keeper.black_box(failure.is_some());
    let values = links::values();
    match Active::of(&values, &FINGER) {
        Ok(active) => {
            let bus = active.bus();
            links::TELEMETRY_PERIOD_US.store(active.telemetry_us(), Relaxed);
            let fault = match keeper.invalid {
                true => Some(Fault::SettingsInvalid),
                false => failure.map(|_| Fault::Internal),
            };
            // In a place of its own: handed to the task by value it would stand on the stack three times.
            let controller = cortex_m::singleton!(
                CONTROLLER: Controller = Controller::starting_with(fault, &FINGER, active)
            );
            let controller = controller.expect("made once");
            let (sent, received) = links::events().expect("made once");
            spawner.spawn(telemetry::run(received, identity).expect("spawned once"));
            spawner.spawn(storage::run(keeper).expect("spawned once"));
            spawner.spawn(line::run(serial, bus).expect("spawned once"));
            let control = control::run(board, controller, clock, sent, black_box);
            board::high_priority().spawn(control.expect("spawned once"));
        }
        Err(error) => failsafe::stay(&|| defmt::error!("wrong settings: {}", error)),
    }
}
