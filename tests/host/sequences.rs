//! Random commands on a random plant keep what the controller promises about objects, faults and commands.

use crate::torture::generate;
use crate::torture::hostile::seed_of;
use crate::torture::promises::Tally;
use crate::torture::season::Season;
use fastrand::Rng;

const SEED: u64 = 1;
const SEASONS: u64 = 30;
const PER_SEASON: u64 = 100;

#[test]
fn random_sequences_of_commands_and_mishaps_keep_every_promise() {
    let mut tally = Tally::default();
    for number in 0..SEASONS {
        let season = Season::new(seed_of(SEED, u64::MAX - number));
        for index in PER_SEASON * number..PER_SEASON * (number + 1) {
            let mut rng = Rng::with_seed(seed_of(SEED, index));
            let sequence = generate::sequence(&mut rng, &season);
            match sequence.play(&season) {
                Ok((_, seen)) => tally.add(&seen),
                Err(failure) => {
                    let (smallest, failure) = sequence.minimised(&season, &failure);
                    panic!(
                        "seed {SEED}, sequence {index}: {failure}\n{}",
                        smallest.story(&season)
                    );
                }
            }
        }
    }
    assert!(tally.losses > 300 && tally.holds > 500, "{tally:?}");
}
