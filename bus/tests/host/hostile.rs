//! Random and mutated frames at a gripper that runs, and a simple model of what they may do.

use std::ops::Range;

use bus::modbus::{Function, Receiver, Request, Timing, crc};
use fastrand::Rng;
use softgrip::blackbox::WORDS;
use softgrip::settings::{Settings, Values};

use crate::line::{Bus, ID, writing};

/// What may be written, settings apart.
const WRITABLE: [Range<u16>; 2] = [0x03E8..0x03EB, 0x1100..0x1106];
/// What may be read beside.
const READABLE: [Range<u16>; 7] = [
    0x07D0..0x07D6,
    0x1000..0x1008,
    0x1010..0x1026,
    0x1030..0x1039,
    0x1040..0x104A,
    0x1106..0x110B,
    // The black box.
    0x3000..0x3000 + 2 * WORDS as u16,
];
const SETTINGS: u16 = 0x2000;

/// What has become of the frames so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    pub frames: u64,
    pub answered: u64,
    pub exceptions: u64,
    pub broadcasts: u64,
    pub written: u64,
    pub settings: u64,
}

/// The gripper, and what its writable registers must be.
pub struct Hostile {
    bus: Bus,
    registers: [Vec<u16>; 2],
    values: Values,
    pub tally: Tally,
}

fn fail<T>(what: &str, bytes: &[u8]) -> Result<T, String> {
    Err(format!("{what}: {bytes:02x?}"))
}

impl Hostile {
    pub fn new() -> Self {
        let mut bus = Bus::new(Settings::default());
        bus.receiver = Receiver::new(ID, Timing::line(115_200));
        Self {
            values: bus.values,
            bus,
            registers: WRITABLE.map(|range| vec![0; range.len()]),
            tally: Tally::default(),
        }
    }

    /// A frame, good or not.
    pub fn frame(&self, rng: &mut Rng) -> Vec<u8> {
        if rng.u8(..8) == 0 {
            return (0..rng.usize(..300)).map(|_| rng.u8(..)).collect();
        }
        let mut pdu = self.pdu(rng);
        if rng.u8(..4) == 0 {
            mutate(rng, &mut pdu);
        }
        let id = rng
            .choice([ID, ID, ID, ID, ID, ID, 0, 8, 10])
            .expect("some");
        let mut bytes = Bus::framed_for(id, &pdu);
        if rng.u8(..4) == 0 {
            mutate(rng, &mut bytes);
        }
        bytes
    }

    /// A request that may be right.
    fn pdu(&self, rng: &mut Rng) -> Vec<u8> {
        let range = match rng.bool() {
            true => rng.choice(&WRITABLE),
            false => rng.choice(&READABLE),
        };
        let range = range.expect("some").clone();
        let mut address = rng.u16(range.clone());
        let mut values: Vec<u16> = (0..rng.u16(1..=120.min(range.end - address)))
            .map(|_| {
                let any = rng.u16(..);
                rng.choice([0, 1, 3, 0x0100, 0x0900, any]).expect("some")
            })
            .collect();
        if rng.bool() {
            let field = rng.choice(&softgrip_settings::FIELDS).expect("some");
            let limit = field.limit();
            let value = limit.min + rng.f32() * (limit.max - limit.min);
            let value = if limit.whole { value.round() } else { value };
            address = SETTINGS + 2 * field.number;
            values = vec![(value.to_bits() >> 16) as u16, value.to_bits() as u16];
        }
        let count = (values.len() as u16).to_be_bytes();
        let [upper, lower] = address.to_be_bytes();
        match rng.u8(..6) {
            0 => vec![3, upper, lower, count[0], count[1]],
            1 => vec![4, upper, lower, count[0], count[1]],
            2 => {
                let value = values[0].to_be_bytes();
                vec![6, upper, lower, value[0], value[1]]
            }
            3 => {
                let mut pdu = vec![23, 0x07, 0xD0, 0, 3];
                pdu.extend(&writing(address, &values)[1..]);
                pdu
            }
            _ => writing(address, &values),
        }
    }

    /// Feeds bytes at once, and then lets the line be silent.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.tally.frames += 1;
        let mut from = 0;
        for (place, &byte) in bytes.iter().enumerate() {
            self.bus.receiver.receive(self.bus.now(), byte);
            if let Some(answer) = self.bus.take() {
                self.check(&bytes[from..=place], &answer)?;
                from = place + 1;
            }
        }
        for _ in 0..3 {
            if self.bus.tick().is_some() {
                return fail("an answer to nothing", bytes);
            }
            if let Some(answer) = self.bus.take() {
                self.check(&bytes[from..], &answer)?;
            }
        }
        self.compare(bytes)
    }

    /// Checks one answer: to a frame at the end of these bytes.
    fn check(&mut self, bytes: &[u8], answer: &[u8]) -> Result<(), String> {
        let is_frame =
            |frame: &&[u8]| frame.len() >= 4 && crc(frame) == 0 && [ID, 0].contains(&frame[0]);
        let frame = (0..bytes.len()).map(|from| &bytes[from..]).find(is_frame);
        let Some(frame) = frame else {
            return fail("taken for a frame", bytes);
        };
        let (id, code, data) = (frame[0], frame[1], &frame[2..frame.len() - 2]);
        let is_done = self.bus.work.is_some();
        match answer {
            [] if id == 0 => self.tally.broadcasts += 1,
            [ID, echo, .., _, _] if id == ID && crc(answer) == 0 => {
                self.tally.answered += 1;
                match answer[2] {
                    1 | 2 | 3 | 6 if *echo == code | 0x80 && answer.len() == 5 && !is_done => {
                        self.tally.exceptions += 1;
                    }
                    _ if *echo == code && is_done => {}
                    _ => return fail("answered with what is no answer", answer),
                }
            }
            _ => return fail("answered", answer),
        }
        match Request::decode(code, data) {
            Ok(request) if is_done => self.write(&request, bytes),
            Err(_) if is_done => fail("carried out", bytes),
            _ => Ok(()),
        }
    }

    /// What a request that has been carried out has changed.
    fn write(&mut self, request: &Request, bytes: &[u8]) -> Result<(), String> {
        let is_setting = |address: u16| {
            let number = address.wrapping_sub(SETTINGS) / 2;
            address >= SETTINGS && self.values.get(number).is_some()
        };
        let readable = |address: u16| {
            let mut ranges = WRITABLE.iter().chain(&READABLE);
            ranges.any(|range| range.contains(&address)) || is_setting(address)
        };
        if !request.read.addresses().all(readable) {
            return fail("read where nothing is", bytes);
        }
        if request.function == Function::ReadHolding || request.function == Function::ReadInput {
            return Ok(());
        }
        self.tally.written += 1;
        let mut values = self.values;
        let mut upper = 0;
        for (address, value) in request.written() {
            let block = WRITABLE.iter().position(|range| range.contains(&address));
            if let Some(block) = block {
                let place = usize::from(address - WRITABLE[block].start);
                self.registers[block][place] = value;
            } else if is_setting(address) && address % 2 == 0 {
                upper = value;
            } else if is_setting(address) {
                let value = f32::from_bits(u32::from(upper) << 16 | u32::from(value));
                if values.set((address - SETTINGS) / 2, value).is_err() {
                    return fail("a setting that cannot be", bytes);
                }
                self.tally.settings += 1;
            } else {
                return fail("written where nothing may be", bytes);
            }
        }
        self.values = values;
        Ok(())
    }

    /// All that may be written is what the model says.
    fn compare(&mut self, bytes: &[u8]) -> Result<(), String> {
        if self.bus.values != self.values {
            return fail("settings are not what was written", bytes);
        }
        if self
            .values
            .first_problem(softgrip::table::FINGER.max_pressure_kpa)
            .is_some()
        {
            return fail("settings that cannot be", bytes);
        }
        if self.tally.frames.is_multiple_of(8) {
            for (range, registers) in WRITABLE.iter().zip(&self.registers) {
                if self.bus.read(range.start, range.len() as u16) != *registers {
                    return fail("registers are not what was written", bytes);
                }
            }
        }
        Ok(())
    }
}

/// Something goes wrong on the line, or in a driver.
fn mutate(rng: &mut Rng, bytes: &mut Vec<u8>) {
    for _ in 0..rng.usize(1..4) {
        let at = rng.usize(..=bytes.len());
        match rng.u8(..5) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at, rng.u8(..)),
            2 if at < bytes.len() => bytes[at] ^= 1 << rng.u8(..8),
            3 if at < bytes.len() => bytes[at] = rng.u8(..),
            _ => bytes.extend(vec![rng.u8(..); rng.usize(..4)]),
        }
    }
}

#[test]
fn random_and_mutated_frames_do_what_the_map_allows_and_nothing_else() {
    let mut rng = Rng::with_seed(1);
    let mut hostile = Hostile::new();
    for _ in 0..40_000 {
        let bytes = hostile.frame(&mut rng);
        hostile.feed(&bytes).expect("as the model has it");
    }
    let tally = hostile.tally;
    assert!(
        tally.exceptions > 1_000 && tally.broadcasts > 500,
        "{tally:?}"
    );
    assert!(tally.written > 5_000 && tally.settings > 1_000, "{tally:?}");
}
