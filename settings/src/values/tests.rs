use super::*;
use std::string::ToString;
use std::vec::Vec;

const TABLE_KPA: f32 = 160.0;

#[test]
fn numbers_rise_tables_are_whole_and_defaults_are_in_their_ranges() {
    let table = |name: &'static str| name.rsplit_once('.').map_or("", |(table, _)| table);
    let mut ended = Vec::new();
    for pair in FIELDS.windows(2) {
        let [before, field] = pair else {
            continue;
        };
        assert!(before.number < field.number, "{}", field.name);
        if table(before.name) != table(field.name) {
            ended.push(table(before.name));
        }
        assert!(
            !ended.contains(&table(field.name)),
            "{}: its table has ended",
            field.name
        );
    }
    for (field, limit) in FIELDS.iter().zip(&LIMITS) {
        assert!(limit.min < limit.max, "{}", field.name);
        assert!(limit.allows(field.default), "{}", field.name);
        assert!(!field.sentence.ends_with('.'), "{}", field.name);
        let names = FIELDS.iter().filter(|other| other.name == field.name);
        assert_eq!(names.count(), 1, "{}", field.name);
    }
    assert_eq!(Values::DEFAULT.problems(TABLE_KPA).next(), None);
}

#[test]
fn every_number_sets_one_value() {
    for (place, limit) in LIMITS.iter().enumerate() {
        let mut values = Values::DEFAULT;
        values
            .set(limit.number, limit.max)
            .expect("its highest value");
        assert_eq!(values.get(limit.number), Some(limit.max));
        let others = values.all().iter().zip(Values::DEFAULT.all()).enumerate();
        for (other, (value, default)) in others {
            assert!(other == place || value == default);
        }
    }
    let mut values = Values::DEFAULT;
    for unknown in [0, 1, 99, 223, u16::MAX] {
        let error = values.set(unknown, 1.0).expect_err("no such setting");
        assert_eq!(
            error.to_string(),
            std::format!("setting {unknown}: there is none of that number")
        );
        assert_eq!(values.get(unknown), None);
    }
    assert_eq!(values, Values::DEFAULT);
}

#[test]
fn the_ends_of_every_range_are_right_and_what_lies_beyond_is_named() {
    for (place, limit) in LIMITS.iter().enumerate() {
        let (number, mut values) = (limit.number, Values::DEFAULT);
        for end in [limit.min, limit.max] {
            values.set(number, end).expect("an end of its range");
        }
        for wrong in [limit.min.next_down(), limit.max.next_up(), f32::NAN] {
            let mut values = Values::DEFAULT;
            let error = values.set(number, wrong).expect_err("beyond its range");
            assert_eq!((error.number, values), (number, Values::DEFAULT));
            // Whoever writes typed fields writes anything.
            let mut all = *Values::DEFAULT.all();
            all[place] = wrong;
            let numbers: Vec<u16> = Values::from_all(all)
                .problems(TABLE_KPA)
                .map(|p| p.number)
                .collect();
            assert!(numbers.contains(&number), "{number} = {wrong}: {numbers:?}");
        }
    }
}

#[test]
fn what_finger_regulator_and_highest_pressure_forbid_is_told_at_once() {
    let mut values = Values::DEFAULT;
    for (number, value) in [(100, 161.0), (400, 162.0), (408, 170.0)] {
        values
            .set(number, value)
            .expect("another finger may have it");
    }
    let told = |values: &Values| -> Vec<_> {
        values
            .problems(TABLE_KPA)
            .map(|problem| problem.to_string())
            .collect()
    };
    assert_eq!(
        told(&values),
        [
            "regulator.max_pressure_kpa = 161: must lie within 1 and 160",
            "grip.grip_pressure_kpa = 162: must lie within 1 and 161",
            "grip.regrip_raise_kpa = 170: must lie within 0 and 160",
        ]
    );
    let mut values = Values::DEFAULT;
    values.set(630, 100.0).expect("a smaller regulator");
    assert_eq!(
        told(&values),
        ["regulator.max_pressure_kpa = 160: must lie within 1 and 100"]
    );
}

#[test]
fn what_is_stated_stays_and_pressures_that_are_not_go_no_higher() {
    let with = |stated: &[(u16, f32)]| Values::DEFAULT.with(stated, TABLE_KPA);
    for (stated, max, grip, raise) in [
        (&[(100, 120.0)][..], 120.0, 120.0, 20.0),
        (&[(630, 100.0)], 100.0, 100.0, 20.0),
        (&[(630, 15.0)], 15.0, 15.0, 15.0),
        (&[(400, 130.0), (302, 9.0)], 160.0, 130.0, 20.0),
    ] {
        let values = with(stated).expect("good settings");
        assert_eq!(values.problems(TABLE_KPA).next(), None);
        let pressures = [100, 400, 408].map(|number| values.get(number));
        assert_eq!(pressures, [max, grip, raise].map(Some));
    }
    let values = with(&[(400, 130.0), (100, 120.0)]).expect("each in its range");
    let numbers: Vec<u16> = values.problems(TABLE_KPA).map(|p| p.number).collect();
    assert_eq!(numbers, [400]);
    assert_eq!(with(&[(302, 99.0)]).map_err(|error| error.number), Err(302));
}

#[test]
fn a_choice_is_a_whole_number_and_its_words_are_named() {
    let error = Values::DEFAULT.with(&[(407, 0.5)], TABLE_KPA);
    assert_eq!(
        error.expect_err("no place in a list").to_string(),
        "grip.on_loss = 0.5: must be a whole number from 0 to 2, 0 is hold, 1 is vent, 2 is regrip"
    );
}
