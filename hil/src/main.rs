//! The firmware's image on an emulated microcontroller, closed with the simulated gripper.
#![forbid(unsafe_code)]
#![allow(dead_code)]

mod bench;
mod board;
mod calls;
mod closed_loop;
mod image;
mod recording;
mod rtt;

use softgrip::inputs::Levels;

fn main() -> anyhow::Result<()> {
    let image = image::Image::read(std::path::Path::new(&std::env::args().nth(1).unwrap()))?;
    let setup = bench::Setup::new(&image, rtt::Host::Reading);
    let ((), record) = bench::run(&setup, (), |(), moment| {
        if moment.ms == 0 {
            moment.set_levels(Levels {
                stop_closed: true,
                ..Levels::default()
            });
            moment.set_pins(&twin::plant::Pins {
                gauges: [0.5; 3],
                monitor: 0.0,
                supply: 24.0 / 11.0 / 3.3,
            });
        }
        Ok(moment.ms < 1000)
    })?;
    for message in record.messages.iter().take(10) {
        println!("{} {}", message.ms, message.text);
    }
    println!("{:?}", &record.dac[..record.dac.len().min(10)]);
    println!("{:?}", &record.ticks[..record.ticks.len().min(5)]);
    println!(
        "{:?} {} {}",
        record.resets,
        record.instructions,
        record.realtime_factor()
    );
    Ok(())
}
