//! A mocked gripper on a bus: frames in, frames out, one tick after another.

use bus::modbus::{self, Receiver, Reply, Timing};
use bus::robot::{Link, Robot, Work};
use softgrip::blackbox::{Memory, Recorder, WORDS};
use softgrip::settings::{Settings, Values};
use softgrip::table::FINGER;
use softgrip::units::Instant;
use softgrip::{Command, RawFrame};
use std::sync::atomic::AtomicU32;

use crate::mock::MockBoard;

/// The slave's id.
pub const ID: u8 = 9;

// Registers of the compatible block.
pub const REQUEST: u16 = 0x03E8;
pub const STATUS: u16 = 0x07D0;

/// gFLT, gPR, … of the three status registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shown {
    pub act: bool,
    pub gto: bool,
    pub sta: u8,
    pub obj: u8,
    pub flt: u8,
    pub pr: u8,
    pub po: u8,
    pub cu: u8,
}

impl Shown {
    pub fn of(words: &[u16]) -> Self {
        let [status, fault, position] = words[..3] else {
            panic!("three registers");
        };
        assert_eq!(status & 0xff, 0);
        let status = (status >> 8) as u8;
        Self {
            act: status & 1 != 0,
            gto: status & 8 != 0,
            sta: status >> 4 & 3,
            obj: status >> 6,
            flt: (fault >> 8) as u8,
            pr: fault as u8,
            po: (position >> 8) as u8,
            cu: position as u8,
        }
    }
}

/// The gripper and its line.
#[derive(Clone)]
pub struct Bus {
    pub board: MockBoard,
    pub robot: Robot,
    pub link: Link,
    pub receiver: Receiver,
    pub values: Values,
    pub reply: Reply,
    black_box: Recorder,
    /// Ticks that the last answer took.
    pub ticks: u32,
    /// What the digital inputs want in the next tick; a stop lasts, as its circuit stays open.
    pub pins: Command,
    /// Ticks before that.
    pub pins_in: u32,
    /// What the last request asked for.
    pub work: Option<Work>,
}

impl Bus {
    pub fn new(settings: Settings) -> Self {
        Self::of(MockBoard::new(settings), settings)
    }

    pub fn of(board: MockBoard, settings: Settings) -> Self {
        let memory: &'static Memory = Box::leak(Box::new([const { AtomicU32::new(0) }; WORDS]));
        let mut bus = Self {
            board,
            robot: Robot::new(ID, &FINGER, memory),
            black_box: Recorder::new(memory, false),
            link: Link::new(),
            receiver: Receiver::new(ID, Timing::stream()),
            values: settings.values(),
            reply: Reply::new(),
            ticks: 0,
            pins: Command::Continue,
            pins_in: 0,
            work: None,
        };
        bus.run(1);
        bus
    }

    /// Activated, with the fingers open.
    pub fn activated(settings: Settings) -> Self {
        let mut bus = Self::new(settings);
        bus.activate();
        bus
    }

    pub fn activate(&mut self) {
        self.write(REQUEST, &[0, 0, 0]);
        self.write(REQUEST, &[0x0100, 0, 0]);
        self.run(200);
        assert_eq!(self.shown().sta, 3);
    }

    pub fn now(&self) -> Instant {
        Instant::from_micros(self.board.now_us)
    }

    /// One tick; if that was the last of what a request wanted, what is answered to it.
    pub fn tick(&mut self) -> Option<Vec<u8>> {
        let mut pins = self.pins;
        if self.pins_in > 0 {
            self.pins_in -= 1;
            pins = Command::Continue;
        } else if pins != Command::Stop {
            self.pins = Command::Continue;
        }
        let command = self.link.command(pins);
        let outputs = self.board.step(command);
        for event in outputs.events.iter() {
            self.black_box.report(self.now(), event);
        }
        // Of what was measured nothing is of interest here.
        self.black_box.step(&RawFrame::default(), outputs.dac);
        let status = self.link.ticked(&self.board.controller, &outputs)?;
        let damaged = self.receiver.damaged();
        let now = self.now();
        self.robot
            .answer(now, &status, damaged, &self.values, &mut self.reply);
        Some(self.reply.bytes().to_vec())
    }

    /// So many ticks without a request.
    pub fn run(&mut self, ms: u64) {
        for _ in 0..ms {
            assert_eq!(self.tick(), None);
        }
    }

    /// The object falls, as [`MockBoard::drop_object`] has it.
    pub fn drop_object(&mut self) {
        for ms in 0..80 {
            self.board.grip = [(1.0 - ms as f32 / 44.0).max(0.14); 3];
            self.run(1);
        }
    }

    /// Receives bytes at once, and gives what is answered to the first request in them, after as many ticks as it takes,
    /// or up to 50.
    pub fn exchange(&mut self, bytes: &[u8]) -> Vec<u8> {
        for (place, &byte) in bytes.iter().enumerate() {
            self.receiver.receive(self.now(), byte);
            if let Some(answer) = self.take() {
                for &byte in &bytes[place + 1..] {
                    self.receiver.receive(self.now(), byte);
                }
                return answer;
            }
        }
        for _ in 0..50 {
            self.tick();
            if let Some(answer) = self.take() {
                return answer;
            }
        }
        Vec::new()
    }

    /// Takes the request that has ended, if one has, and gives what is answered to it.
    pub fn take(&mut self) -> Option<Vec<u8>> {
        let now = self.now();
        let frame = self.receiver.frame(now)?;
        let values = &mut self.values;
        self.work = self.robot.request(now, &frame, values, &mut self.reply);
        let Some(work) = self.work else {
            return Some(self.reply.bytes().to_vec());
        };
        if work.clear_black_box {
            self.black_box.clear();
        }
        if work.settings_changed {
            let active = softgrip::settings::Active::of(&self.values, &FINGER);
            let active = active.expect("they have been checked");
            // What waits for an idle gripper is the caller's to try again.
            let _ = self.board.controller.apply(active);
        }
        self.link.ask(work.wishes);
        self.ticks = 0;
        loop {
            self.ticks += 1;
            assert!(self.ticks < 10, "a status is overdue");
            if let Some(answer) = self.tick() {
                return Some(answer);
            }
        }
    }

    /// A frame with id and checksum around a function code and its data.
    pub fn framed(pdu: &[u8]) -> Vec<u8> {
        Self::framed_for(ID, pdu)
    }

    pub fn framed_for(id: u8, pdu: &[u8]) -> Vec<u8> {
        let mut bytes = vec![id];
        bytes.extend(pdu);
        let sum = modbus::crc(&bytes);
        bytes.extend(sum.to_le_bytes());
        bytes
    }

    /// Function code and data of what is answered; the frame around them must be right.
    pub fn ask(&mut self, pdu: &[u8]) -> Vec<u8> {
        let answer = self.exchange(&Self::framed(pdu));
        assert!(answer.len() >= 5, "no answer to {pdu:02x?}");
        assert_eq!(answer[0], ID);
        assert_eq!(modbus::crc(&answer), 0, "{answer:02x?}");
        answer[1..answer.len() - 2].to_vec()
    }

    /// The exception to a request.
    pub fn refused(&mut self, pdu: &[u8]) -> u8 {
        match self.ask(pdu)[..] {
            [code, exception] if code == pdu[0] | 0x80 => exception,
            ref other => panic!("{other:02x?}"),
        }
    }

    /// Reads registers with this function.
    pub fn read_by(&mut self, function: u8, address: u16, count: u16) -> Vec<u16> {
        let mut pdu = vec![function];
        pdu.extend(address.to_be_bytes());
        pdu.extend(count.to_be_bytes());
        let answer = self.ask(&pdu);
        words(&answer, function, count)
    }

    pub fn read(&mut self, address: u16, count: u16) -> Vec<u16> {
        self.read_by(3, address, count)
    }

    pub fn read_one(&mut self, address: u16) -> u16 {
        self.read(address, 1)[0]
    }

    pub fn shown(&mut self) -> Shown {
        Shown::of(&self.read(STATUS, 3))
    }

    /// Writes registers with function 16.
    pub fn write(&mut self, address: u16, values: &[u16]) {
        let pdu = writing(address, values);
        assert_eq!(self.ask(&pdu), pdu[..5], "{pdu:02x?}");
    }

    /// Writes with function 23 and gives what it reads.
    pub fn write_read(&mut self, address: u16, values: &[u16], from: u16, count: u16) -> Vec<u16> {
        let mut pdu = vec![23];
        pdu.extend(from.to_be_bytes());
        pdu.extend(count.to_be_bytes());
        pdu.extend(&writing(address, values)[1..]);
        let answer = self.ask(&pdu);
        words(&answer, 23, count)
    }

    /// Goes to a position with all speed and force.
    pub fn go(&mut self, position: u8) -> Shown {
        self.write(REQUEST, &[0x0900, position.into(), 0xffff]);
        self.shown()
    }
}

/// Function 16 with its data.
pub fn writing(address: u16, values: &[u16]) -> Vec<u8> {
    let mut pdu = vec![16];
    pdu.extend(address.to_be_bytes());
    pdu.extend((values.len() as u16).to_be_bytes());
    pdu.push(2 * values.len() as u8);
    values
        .iter()
        .for_each(|value| pdu.extend(value.to_be_bytes()));
    pdu
}

fn words(answer: &[u8], function: u8, count: u16) -> Vec<u16> {
    assert_eq!(answer[0], function, "{answer:02x?}");
    assert_eq!(u16::from(answer[1]), 2 * count);
    let words = answer[2..]
        .chunks(2)
        .map(|word| u16::from_be_bytes([word[0], word[1]]));
    let words: Vec<u16> = words.collect();
    assert_eq!(words.len(), usize::from(count));
    words
}
