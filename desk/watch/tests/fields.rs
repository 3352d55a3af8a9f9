//! The table of what is told, and the manual's page about it.

use std::collections::BTreeSet;

use watch::fields::FIELDS;
use watch::page::Page;

#[test]
fn a_csv_file_begins_as_a_trace_does() {
    let names: Vec<&str> = FIELDS.iter().map(|field| field.name).collect();
    assert_eq!(names[..6], sim::trace::COLUMNS);
}

#[test]
fn no_two_values_have_a_name_or_a_number_in_common() {
    let names: BTreeSet<&str> = FIELDS.iter().map(|field| field.name).collect();
    let numbers: BTreeSet<u32> = FIELDS.iter().map(|field| field.number).collect();
    assert_eq!((names.len(), numbers.len()), (FIELDS.len(), FIELDS.len()));
}

#[test]
fn every_value_has_a_place_of_its_own_in_an_observation() {
    for field in &FIELDS {
        let mut observation = watch::Observation::default();
        match (field.place)(&mut observation) {
            watch::fields::Place::Double(place) => *place = Some(1.0),
            watch::fields::Place::Float(place) => *place = Some(1.0),
            watch::fields::Place::Whole(place) => *place = Some(1),
            watch::fields::Place::Flag(place) => *place = Some(true),
        }
        for other in &FIELDS {
            let is_set = !other.text(&mut observation).is_empty();
            assert_eq!(is_set, other.number == field.number, "{}", field.name);
        }
    }
}

#[test]
fn the_page_of_the_manual_has_every_value_as_it_is() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/telemetry.md");
    let page = std::fs::read_to_string(page).expect("the page");
    assert!(
        page.ends_with(&Page.to_string()),
        "docs/telemetry.md must end with what `softgrip telemetry` prints"
    );
}
