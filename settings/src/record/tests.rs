use super::*;
use std::vec::Vec;

const TABLE_KPA: f32 = 160.0;

fn encoded(settings: &Values) -> Vec<u8> {
    let mut bytes = [0; ENCODED_BYTES];
    let length = settings.encode(&Values::DEFAULT, &mut bytes);
    bytes[..length.expect("they fit")].to_vec()
}

fn decoded(bytes: &[u8]) -> Decoded {
    let decoded = Values::decode(&Values::DEFAULT, bytes, TABLE_KPA);
    assert_eq!(decoded.values.problems(TABLE_KPA).next(), None);
    decoded
}

/// A setting with any bits.
fn pair(number: u16, value: f32) -> Vec<u8> {
    [&number.to_le_bytes()[..], &value.to_le_bytes()].concat()
}

#[test]
fn what_was_stored_is_read_bit_by_bit() {
    let default = Values::DEFAULT;
    assert!(encoded(&default).is_empty());
    let mut settings = default;
    for limit in &LIMITS {
        let limit = limit.up_to(150.0);
        let low = settings.get(limit.number) != Some(limit.min);
        let end = if low { limit.min } else { limit.max };
        settings
            .set(limit.number, end)
            .expect("an end of the range");
    }
    let bytes = encoded(&settings);
    assert_eq!(bytes.len(), ENCODED_BYTES);
    let decoded = decoded(&bytes);
    assert_eq!(decoded.values, settings);
    assert_eq!((decoded.unknown, decoded.wrong().count()), (0, 0));
    let mut short = [0; ENCODED_BYTES - 1];
    assert_eq!(settings.encode(&default, &mut short), None);
}

#[test]
fn a_wrong_value_is_the_factorys_and_named_and_the_rest_stays() {
    let bytes = [
        pair(101, 500.0),
        pair(302, 51.0),
        pair(202, f32::NAN),
        pair(200, 1.0),
        pair(407, 1.5),
        pair(401, 200.0),
    ]
    .concat();
    let decoded = decoded(&bytes);
    let wrong: Vec<u16> = decoded.wrong().collect();
    assert_eq!(wrong, [202, 302, 407]);
    assert_eq!(decoded.unknown, 0);
    let stated = [(101, 500.0), (200, 1.0), (401, 200.0)];
    let expected = Values::DEFAULT.with(&stated, TABLE_KPA);
    assert_eq!(Ok(decoded.values), expected);
}

#[test]
fn settings_that_this_release_does_not_know_are_counted_and_left_out() {
    let mut bytes = [pair(9_999, 1.0), pair(407, 2.0), pair(0, f32::NAN)].concat();
    assert_eq!(decoded(&bytes).unknown, 2);
    assert_eq!(decoded(&bytes).values.get(407), Some(2.0));
    // An end that is no whole setting.
    bytes.push(1);
    assert_eq!(decoded(&bytes).unknown, 3);
}

#[test]
fn pressures_that_do_not_go_together_are_the_factorys_as_far_as_these_go() {
    // Beyond the finger.
    let over = decoded(&pair(100, 170.0));
    assert_eq!(over.wrong().collect::<Vec<_>>(), [100]);
    assert_eq!(over.values, Values::DEFAULT);
    // Beyond the highest pressure, and so is the factory's.
    let mut bytes = pair(100, 120.0);
    bytes.extend(pair(400, 130.0));
    let between = decoded(&bytes);
    assert_eq!(between.wrong().collect::<Vec<_>>(), [400]);
    assert_eq!(between.values.get(100), Some(120.0));
    assert_eq!(between.values.get(400), Some(120.0));
}

#[test]
fn any_bytes_give_valid_settings() {
    let mut rng = fastrand::Rng::with_seed(1);
    for _ in 0..20_000 {
        let mut bytes = Vec::new();
        for _ in 0..rng.usize(..40) {
            let number = match rng.bool() {
                true => LIMITS[rng.usize(..LIMITS.len())].number,
                false => rng.u16(..),
            };
            let value = match rng.bool() {
                true => f32::from_bits(rng.u32(..)),
                false => 200.0 * rng.f32(),
            };
            bytes.extend(pair(number, value));
        }
        bytes.truncate(bytes.len().saturating_sub(rng.usize(..7)));
        decoded(&bytes);
    }
}
