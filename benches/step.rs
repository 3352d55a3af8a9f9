//! Cost of one control tick on the host: `cargo bench`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use softgrip::frontend::FrontEnd;
use softgrip::settings::Settings;
use softgrip::table::FINGER;
use softgrip::units::{AdcCode, Instant, Kilopascals, Microstrain, Volts};
use softgrip::{Command, Controller, Grip, RawFrame};

const FE: FrontEnd = FrontEnd::REFERENCE;

/// A steady grip at 140 kPa with a flickering gauge.
fn frame(tick: u64) -> RawFrame {
    let flicker = (tick % 7) as f32;
    RawFrame {
        gauges: [AdcCode(FE.gauge_code(0, Microstrain(4_000.0 + 20.0 * flicker)) as u16); 3],
        monitor: AdcCode(FE.monitor_code(Kilopascals(140.0)) as u16),
        supply: AdcCode(FE.supply_code(Volts(24.0)) as u16),
        rail: softgrip::frontend::RAIL,
        scans: 10,
        overrun: false,
        carried: false,
    }
}

fn step(criterion: &mut Criterion) {
    let active = Settings::default()
        .validate(&FINGER)
        .expect("the default settings are valid");
    let mut controller = Controller::new(&FINGER, active);
    let mut tick = 0;
    let mut next = |command| {
        tick += 1;
        let now = Instant::from_micros(1_000 * tick);
        controller.step(now, black_box(&frame(tick)), command)
    };
    next(Command::Grip(Grip::Default));
    let held = (0..3_000)
        .map(|_| next(Command::Continue))
        .last()
        .is_some_and(|outputs| outputs.indicators.holding);
    assert!(held, "the bench is to time a hold");
    criterion.bench_function("step while holding", |bencher| {
        bencher.iter(|| next(Command::Continue));
    });
}

criterion_group!(benches, step);
criterion_main!(benches);
