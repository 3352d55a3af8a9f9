//! What was stored stays stored, whenever the power goes off.

use embedded_storage::nor_flash::ReadNorFlash;
use fastrand::Rng;
use softgrip::storage::{PAYLOAD, PLACE, SaveError, Storage, Stored};

use crate::flash::{Flash, Moment, Operation, now};

/// The sectors that the settings have in the STM32F429, and the other two sizes that it has.
const SMALL: usize = 16 << 10;
const MIDDLE: usize = 64 << 10;
const LARGE: usize = 128 << 10;

/// What is stored; none when nothing valid is.
fn load<const SECTOR: usize>(flash: &mut Flash<SECTOR>) -> (Stored, Option<Vec<u8>>) {
    let mut bytes = [0; PAYLOAD];
    let stored = Storage::new(&mut *flash)
        .load(&mut bytes)
        .expect("it reads");
    let found = match stored {
        Stored::Found { length } => Some(bytes[..length].to_vec()),
        Stored::Empty | Stored::Corrupt => None,
    };
    (stored, found)
}

/// Bytes that are never the same; some are few and some are all that fit.
fn value(random: &mut Rng) -> Vec<u8> {
    let length = match random.u8(..16) {
        0 => 8,
        1 => PAYLOAD,
        _ => random.usize(8..64),
    };
    (0..length).map(|_| random.u8(..)).collect()
}

/// How many cuts there have been.
#[derive(Debug, Default)]
struct Cuts {
    programs: u32,
    erases: u32,
    /// In the middle of what follows another cut.
    again: u32,
}

impl Cuts {
    fn count(&mut self, operation: Operation, depth: u32) {
        match operation {
            Operation::Program { .. } => self.programs += 1,
            Operation::Erase { .. } => self.erases += 1,
        }
        self.again += u32::from(depth > 0);
    }
}

/// The power goes off in each of these moments, of which some are tried at greater depth. What is found afterwards
/// was stored, or was to be; nothing at all only where nothing had been stored.
fn survives<const SECTOR: usize>(
    moments: Vec<Moment<SECTOR>>,
    allowed: &[Option<Vec<u8>>],
    depth: u32,
    random: &mut Rng,
    cuts: &mut Cuts,
) {
    for moment in moments {
        let operation = moment.operation;
        // A sector can be torn in more ways than a word.
        let times = match (depth, operation) {
            (0, Operation::Erase { .. }) => 20,
            (0, Operation::Program { .. }) => 1,
            _ => usize::from(random.u8(..) < 4),
        };
        for _ in 0..times {
            cuts.count(operation, depth);
            let flash = moment.clone().cut(random);
            survives_one(flash, allowed, depth, random, cuts);
        }
    }
}

fn survives_one<const SECTOR: usize>(
    mut flash: Flash<SECTOR>,
    allowed: &[Option<Vec<u8>>],
    depth: u32,
    random: &mut Rng,
    cuts: &mut Cuts,
) {
    for _ in 0..2 {
        let (stored, found) = load(&mut flash);
        assert!(
            allowed.contains(&found),
            "depth {depth}: {stored:?} {found:02x?} instead of {allowed:02x?}"
        );
    }
    let next = value(random);
    let log = flash.logged();
    let mut storage = Storage::new(&mut flash);
    let saved = now(storage.save(&next));
    assert_eq!(saved, Ok(()), "depth {depth}");
    if depth < 2 {
        let either = [allowed, &[Some(next.clone())]].concat();
        survives(log.take(), &either, depth + 1, random, cuts);
    }
    let last = value(random);
    if random.bool() {
        assert_eq!(now(storage.save(&last)), Ok(()));
        acknowledged(&mut flash, &last);
    } else {
        acknowledged(&mut flash, &next);
    }
}

/// However often it is read.
fn acknowledged<const SECTOR: usize>(flash: &mut Flash<SECTOR>, value: &[u8]) {
    for _ in 0..4 {
        let (stored, found) = load(flash);
        assert_eq!(found.as_deref(), Some(value), "{stored:?}");
    }
}

/// A long history, and a power cut at every program and erase of it.
fn history<const SECTOR: usize>(seed: u64, restarts: u32, cuts: &mut Cuts) {
    let mut random = Rng::with_seed(seed);
    let mut flash = Flash::<SECTOR>::new(seed);
    let mut stored = None;
    for _ in 0..restarts {
        let log = flash.logged();
        let mut storage = Storage::new(&mut flash);
        for _ in 0..random.u8(1..=6) {
            let next = value(&mut random);
            assert_eq!(now(storage.save(&next)), Ok(()));
            let either = [stored, Some(next.clone())];
            survives(log.take(), &either, 0, &mut random, cuts);
            stored = Some(next);
        }
        acknowledged(&mut flash, stored.as_deref().expect("some were stored"));
    }
}

#[test]
fn a_power_cut_at_any_program_or_erase_loses_nothing_that_was_acknowledged() {
    let mut cuts = Cuts::default();
    for seed in 0..5 {
        history::<SMALL>(seed, 12, &mut cuts);
    }
    println!("{cuts:?}");
    assert!(
        cuts.programs > 5_000 && cuts.erases > 50 && cuts.again > 2_000,
        "{cuts:?}"
    );
}

/// Saves some after each of some restarts; gives the last.
fn save_often<const SECTOR: usize>(
    flash: &mut Flash<SECTOR>,
    restarts: u32,
    saves: u32,
) -> Vec<u8> {
    let mut random = Rng::with_seed(7);
    let mut last = Vec::new();
    for _ in 0..restarts {
        let mut storage = Storage::new(&mut *flash);
        for _ in 0..saves {
            last = value(&mut random);
            assert_eq!(now(storage.save(&last)), Ok(()));
        }
    }
    last
}

fn the_last_is_found<const SECTOR: usize>() {
    let places = SECTOR as u32 / PLACE;
    for (restarts, saves) in [(1, 1), (1, 5 * places + 3), (2 * places, 1), (7, places)] {
        let mut flash = Flash::<SECTOR>::new(1);
        let last = save_often(&mut flash, restarts, saves);
        acknowledged(&mut flash, &last);
    }
}

#[test]
fn the_last_is_found_in_sectors_of_every_size() {
    the_last_is_found::<SMALL>();
    the_last_is_found::<MIDDLE>();
    the_last_is_found::<LARGE>();
}

#[test]
fn ten_saves_a_day_wear_the_sectors_out_in_43_years_at_the_earliest() {
    /// DS9405, flash memory endurance.
    const ERASINGS: f64 = 10_000.0;
    for (restarts, saves, years) in [(4_000, 1, 43.0), (1, 4_000, 86.0)] {
        let mut flash = Flash::<SMALL>::new(1);
        save_often(&mut flash, restarts, saves);
        let most = flash.erased.into_iter().max().map_or(0.0, f64::from);
        let lasts = f64::from(restarts * saves) / most * ERASINGS / 10.0 / 365.25;
        println!("{restarts} restarts with {saves} saves each: {lasts:.1} years");
        assert!(lasts >= years, "{lasts} years");
    }
}

#[test]
fn a_new_chip_is_empty_and_foreign_bytes_are_corrupt() {
    assert_eq!(load(&mut Flash::<SMALL>::new(1)).0, Stored::Empty);
    for (at, bit) in [(0, 0), (SMALL - 4, 31), (2 * SMALL - 4, 7)] {
        let mut flash = Flash::<SMALL>::new(1);
        flash.flip(at, bit);
        assert_eq!(load(&mut flash).0, Stored::Corrupt);
    }
}

#[test]
fn nothing_is_stored_as_nothing() {
    let mut flash = Flash::<SMALL>::new(1);
    assert_eq!(now(Storage::new(&mut flash).save(&[])), Ok(()));
    assert_eq!(load(&mut flash).0, Stored::Found { length: 0 });
}

#[test]
fn one_wrong_bit_of_what_was_stored_is_said_and_can_be_saved_over() {
    let bytes = [1, 2, 3, 4, 5];
    // Number, length, bytes, sum.
    let place = PLACE as usize;
    let words = (0..5).map(|word| 4 * word).chain([place - 8]);
    for at in words {
        for bit in 0..32 {
            let mut flash = Flash::<SMALL>::new(1);
            save_often(&mut flash, 1, 3);
            let mut storage = Storage::new(&mut flash);
            assert_eq!(now(storage.save(&bytes)), Ok(()));
            // The first after a start leaves a place out.
            flash.flip(4 * place + at, bit);
            let (stored, _) = load(&mut flash);
            // What fills up the last word is not stored.
            let padding = at == 16 && bit >= 8;
            match padding {
                true => assert_eq!(stored, Stored::Found { length: 5 }),
                false => assert_eq!(stored, Stored::Corrupt, "byte {at}, bit {bit}"),
            }
            let next = save_often(&mut flash, 1, 1);
            acknowledged(&mut flash, &next);
        }
    }
}

#[test]
fn damage_that_mends_itself_is_not_newer_than_what_was_stored_since() {
    let mut flash = Flash::<SMALL>::new(1);
    save_often(&mut flash, 1, 20);
    // All but the number and its place.
    let numbers: Vec<usize> = (0..2 * SMALL).step_by(PLACE as usize).collect();
    numbers.iter().for_each(|&at| flash.flip(at, 30));
    assert_eq!(load(&mut flash).0, Stored::Corrupt);
    let next = [7; 10];
    assert_eq!(now(Storage::new(&mut flash).save(&next)), Ok(()));
    acknowledged(&mut flash, &next);
    for at in numbers {
        let mut word = [0; 4];
        flash.read(at as u32, &mut word).expect("it reads");
        // Only what has not been erased since.
        if word != [0xff; 4] && word[3] & 0x40 != 0 {
            flash.flip(at, 30);
        }
    }
    acknowledged(&mut flash, &next);
}

#[test]
fn what_is_too_long_is_refused_and_changes_nothing() {
    let mut flash = Flash::<SMALL>::new(1);
    let last = save_often(&mut flash, 1, 3);
    let log = flash.logged();
    let saved = now(Storage::new(&mut flash).save(&[0; PAYLOAD + 1]));
    assert_eq!(saved, Err(SaveError::TooLong));
    assert!(log.take().is_empty());
    assert_eq!(load(&mut flash).1, Some(last));
}

#[test]
fn a_worn_word_is_noticed_and_the_next_place_taken() {
    for word in [0, 1, 2, 4, 254, 255] {
        let mut flash = Flash::<SMALL>::new(1);
        save_often(&mut flash, 1, 3);
        // In the place that the next record takes: one is left out.
        flash.worn = Some(4 * PLACE as usize / 4 + word);
        let mut storage = Storage::new(&mut flash);
        assert_eq!(
            now(storage.save(&[0; 12])),
            Err(SaveError::Unreadable),
            "word {word}"
        );
        assert_eq!(now(storage.save(&[2; 12])), Ok(()));
        let mut bytes = [0; PAYLOAD];
        assert_eq!(storage.load(&mut bytes), Ok(Stored::Found { length: 12 }));
        assert_eq!(bytes[..12], [2; 12]);
    }
}
