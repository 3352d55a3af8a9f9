//! `softgrip gauge` as its users call it.

use std::process::Command;

use serde_json::Value;

#[test]
fn the_command_recommends_a_place_and_does_not_depend_on_threads() {
    let gauge = |jobs: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_softgrip"))
            .args(["gauge", "--runs", "5", "--json", "--jobs", jobs])
            .output()
            .expect("softgrip starts");
        assert!(output.status.success(), "{output:?}");
        serde_json::from_slice::<Value>(&output.stdout).expect("JSON")
    };
    let one = gauge("1");
    assert_eq!(one, gauge("2"));
    let at = |place: &Value, name: &str| place[name].as_f64().expect("a number");
    assert!(at(&one["best"], "to_mm") - at(&one["best"], "from_mm") >= 14.99);
    // Near the tip a sphere leaves nothing of the contact, so its loss is not seen there.
    let spans = one["spans"].as_array().expect("a list");
    let tip = spans.iter().find(|span| at(span, "from_mm") == 60.0);
    assert!(tip.expect("a span")["sphere"]["loss_ms"]["p50"].is_null());
    assert!(at(&one["best"]["sphere"]["loss_ms"], "p90") > 0.0);
    assert!(at(&one["best"]["sphere"], "warned_before_15_mm") > 0.9);
}
