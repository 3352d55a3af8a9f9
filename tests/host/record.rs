//! A record gives back every bit that was put into it.

use proptest::prelude::*;
use softgrip::command::{Motion, Payload};
use softgrip::detect::{Loss, LossCause};
use softgrip::fault::RULES;
use softgrip::grasp::{Purpose, State};
use softgrip::table::ObjectKind;
use softgrip::telemetry::{Record, RecordError, Snapshot};
use softgrip::units::{
    AdcCode, DacCode, Degrees, Instant, Kilograms, Kilopascals, MetresPerSecondSquared,
    Microstrain, Millivolts,
};
use softgrip::{Command, Grip, RawFrame};

/// Any number, and any that is none.
fn number() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

fn kpa() -> impl Strategy<Value = Kilopascals> {
    number().prop_map(Kilopascals)
}

fn moment() -> impl Strategy<Value = Instant> {
    any::<u64>().prop_map(Instant::from_micros)
}

fn command() -> impl Strategy<Value = Command> {
    let payload = (any::<bool>(), number(), number()).prop_map(|(sphere, mass, acceleration)| {
        Command::Grip(Grip::Payload(Payload {
            kind: match sphere {
                true => ObjectKind::Sphere,
                false => ObjectKind::Cylinder,
            },
            mass: Kilograms(mass),
            acceleration: MetresPerSecondSquared(acceleration),
        }))
    });
    prop_oneof![
        Just(Command::Continue),
        Just(Command::Alive),
        Just(Command::Motion(Motion::Moving)),
        Just(Command::Motion(Motion::Still)),
        number().prop_map(Command::Slew),
        Just(Command::Grip(Grip::Default)),
        kpa().prop_map(|pressure| Command::Grip(Grip::Pressure(pressure))),
        number().prop_map(|bend| Command::Grip(Grip::Bend(Degrees(bend)))),
        payload,
        Just(Command::Release),
        Just(Command::Halt),
        Just(Command::Stop),
        Just(Command::Acknowledge),
        Just(Command::Tare),
        Just(Command::Sweep),
    ]
}

fn state() -> impl Strategy<Value = State> {
    const PURPOSES: [Purpose; 3] = [Purpose::Grip, Purpose::Change, Purpose::Regrip];
    prop_oneof![
        Just(State::Idle),
        (
            kpa(),
            prop::option::of(moment()),
            prop::sample::select(&PURPOSES[..])
        )
            .prop_map(|(target, reached, purpose)| State::Closing {
                target,
                reached,
                purpose
            }),
        (kpa(), moment()).prop_map(|(target, since)| State::Holding { target, since }),
        kpa().prop_map(|target| State::Empty { target }),
        kpa().prop_map(|target| State::Sweeping { target }),
        (moment(), any::<bool>()).prop_map(|(since, holding)| State::Releasing { since, holding }),
        (prop::sample::select(&RULES[..]), kpa(), any::<bool>()).prop_map(
            |(rule, target, watching)| State::Fault {
                fault: rule.fault,
                target,
                watching
            }
        ),
    ]
}

fn loss() -> impl Strategy<Value = Loss> {
    const CAUSES: [LossCause; 3] = [LossCause::Collapse, LossCause::OneSided, LossCause::Missing];
    let cause = prop::sample::select(&CAUSES[..]);
    let evidence = prop::array::uniform3(prop::option::of(number()));
    (moment(), moment(), cause, evidence).prop_map(|(onset, flagged, cause, evidence)| Loss {
        onset,
        flagged,
        cause,
        evidence,
    })
}

prop_compose! {
    fn snapshot()(
        (now, state, lost) in (moment(), state(), prop::option::of(loss())),
        (pressure, setpoint) in (prop::option::of(kpa()), kpa()),
        residual in prop::array::uniform3(prop::option::of(number())),
        (touching, tare_due) in any::<([bool; 3], bool)>(),
        (bend, level, margin) in (number(), prop::option::of(number()), prop::option::of(number())),
        noise in prop::array::uniform3(number()),
        drift in prop::array::uniform3(number()),
    ) -> Snapshot {
        Snapshot {
            now,
            state,
            lost,
            pressure,
            setpoint,
            residual: residual.map(|residual| residual.map(Microstrain)),
            touching,
            bend: Degrees(bend),
            level,
            margin,
            noise: noise.map(Microstrain),
            drift: drift.map(Microstrain),
            tare_due,
        }
    }
}

prop_compose! {
    fn record()(
        (number, longest_tick_us, events_lost) in any::<(u32, u32, u32)>(),
        (internal_clock, overrun, carried) in any::<(bool, bool, bool)>(),
        (gauges, monitor, supply) in any::<([u16; 3], u16, u16)>(),
        (rail, scans, dac) in any::<(u16, u16, u16)>(),
        command in command(),
        snapshot in snapshot(),
    ) -> Record {
        Record {
            number,
            longest_tick_us,
            events_lost,
            internal_clock,
            frame: RawFrame {
                gauges: gauges.map(AdcCode),
                monitor: AdcCode(monitor),
                supply: AdcCode(supply),
                rail: Millivolts(rail),
                scans,
                overrun,
                carried,
            },
            command,
            dac: DacCode(dac),
            snapshot,
        }
    }
}

fn encoded(record: &Record) -> Vec<u8> {
    record.encode(&mut [0xff; Record::BYTES]).to_vec()
}

proptest! {
    #[test]
    fn a_record_is_read_as_it_was_written(record in record()) {
        let bytes = encoded(&record);
        let length = match record.snapshot.lost {
            Some(_) => Record::BYTES,
            None => Record::BYTES_WITHOUT_LOSS,
        };
        prop_assert_eq!(bytes.len(), length);
        let read = Record::decode(&bytes).expect("a record");
        // In words: a number that is none is equal to nothing.
        prop_assert_eq!(format!("{read:?}"), format!("{record:?}"));
        // And to the bit, which words do not show of what is no number.
        prop_assert_eq!(encoded(&read), bytes);
    }

    #[test]
    fn a_record_that_is_cut_or_longer_is_none(record in record(), length in 0usize..200) {
        let mut bytes = encoded(&record);
        if length != bytes.len() {
            bytes.resize(length, 0);
            prop_assert_eq!(Record::decode(&bytes), Err(RecordError::Malformed));
        }
    }

    #[test]
    fn any_bytes_are_a_record_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = Record::decode(&bytes);
    }

    #[test]
    fn a_record_of_another_layout_is_named(record in record(), layout: u8) {
        let mut bytes = encoded(&record);
        if layout != Record::LAYOUT {
            bytes[0] = layout;
            prop_assert_eq!(Record::decode(&bytes), Err(RecordError::Layout(layout)));
        }
    }
}

#[test]
fn every_command_of_the_layout_has_its_own_code() {
    let mut bytes = encoded(&sample());
    let commands: Vec<String> = (0..=u8::MAX)
        .filter_map(|code| {
            bytes[2] = code;
            let record = Record::decode(&bytes).ok()?;
            assert_eq!(encoded(&record)[2], code);
            Some(format!("{:?}", record.command))
        })
        .collect();
    assert_eq!(commands.len(), 16, "{commands:#?}");
}

fn sample() -> Record {
    Record {
        number: 7,
        longest_tick_us: 31,
        events_lost: 0,
        internal_clock: false,
        frame: RawFrame {
            gauges: [0x1011, 0x1213, 0x1415].map(AdcCode),
            monitor: AdcCode(0x1617),
            supply: AdcCode(0x1819),
            rail: Millivolts(3_300),
            scans: 9,
            overrun: true,
            carried: false,
        },
        command: Command::Slew(0.5),
        dac: DacCode(12),
        snapshot: Snapshot {
            now: Instant::from_micros(0x1_0000_0002),
            state: State::Holding {
                target: Kilopascals(1.0),
                since: Instant::from_micros(5),
            },
            lost: None,
            pressure: Some(Kilopascals(2.0)),
            setpoint: Kilopascals(3.0),
            residual: [Some(Microstrain(4.0)), None, Some(Microstrain(5.0))],
            touching: [true, false, true],
            bend: Degrees(6.0),
            level: None,
            margin: Some(0.25),
            noise: [Microstrain(7.0); 3],
            drift: [Microstrain(8.0); 3],
            tare_due: true,
        },
    }
}

/// Whoever changes this changes [`Record::LAYOUT`]: recordings are read long after they were made.
#[test]
fn the_layout_is_the_one_of_its_number() {
    assert_eq!(Record::LAYOUT, 1);
    let number = |number: f32| number.to_bits();
    let words: Vec<u32> = vec![
        0x00_04_04_01,
        0x00_00_5a_7a,
        7,
        2,
        1,
        5,
        0,
        number(1.0),
        number(2.0),
        number(3.0),
        number(4.0),
        0,
        number(5.0),
        number(6.0),
        0,
        number(0.25),
        number(7.0),
        number(7.0),
        number(7.0),
        number(8.0),
        number(8.0),
        number(8.0),
        number(0.5),
        0,
        0x1213_1011,
        0x1617_1415,
        3_300 << 16 | 0x1819,
        12 << 16 | 9,
        31,
        0,
    ];
    let bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
    assert_eq!(encoded(&sample()), bytes);
}
