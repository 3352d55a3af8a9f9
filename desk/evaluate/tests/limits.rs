//! The margins of the detector's limits, measured on a few runs.

use std::path::Path;

use evaluate::options::Options;
use evaluate::{alarms, limits};
use sim::setup::Setup;

#[test]
fn held_objects_stay_below_every_limit_and_lost_ones_go_far_beyond_the_evidence_that_is_needed() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recipes/rtv225.toml");
    let base =
        Setup::of(&finger::recipe::load(&path).expect("the default recipe")).expect("a setup");
    let options = Options {
        seed: 2,
        losses: 4,
        hours: 0.02,
        recordings: None,
        slowest: 0,
        settings: base.settings(),
    };
    let models = alarms::models(&base).expect("grips");
    let measured = limits::measure(&base, &options, &models, &|_| {}).expect("limits");
    assert_eq!(measured.len(), 3);
    for situation in measured {
        for row in situation.rows {
            assert!(row.held < row.limit, "{:?}: {row:?}", situation.situation);
            if row.sign == evaluate::reach::Sign::Evidence {
                assert_eq!(row.losses, 4);
                assert!(
                    row.lost.is_some_and(|lost| lost > 10.0 * row.limit),
                    "{row:?}"
                );
            }
        }
    }
}
