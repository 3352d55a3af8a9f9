//! The manual says of faults and settings what the code has.

use softgrip::fault::{Fault, RULES, Rule, SafeOutput};
use softgrip_settings::FIELDS;

#[test]
fn the_manual_has_one_row_for_every_fault_with_its_number_and_output() {
    let manual = include_str!("../../docs/faults.md");
    let rows: Vec<&str> = manual
        .lines()
        .filter(|line| line.contains("| as set |") || line.contains("| vents |"))
        .collect();
    assert_eq!(rows.len(), RULES.len());
    for (Rule { fault, output, .. }, row) in RULES.into_iter().zip(rows) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let name = format!("[{fault:?}](faults/{})", page_name(fault));
        let expected = (fault.code().to_string(), name, in_words(output));
        let found = (cells[1].to_string(), cells[2].to_string(), cells[5]);
        assert_eq!(found, expected);
    }
}

fn in_words(output: SafeOutput) -> &'static str {
    match output {
        SafeOutput::AsSet => "as set",
        SafeOutput::Vent => "vents",
    }
}

/// `02-not-following.md`.
fn page_name(fault: Fault) -> String {
    let mut name = format!("{:02}", fault.code());
    for letter in format!("{fault:?}").chars() {
        if letter.is_uppercase() {
            name.push('-');
        }
        name.push(letter.to_ascii_lowercase());
    }
    name + ".md"
}

#[test]
fn the_manual_has_a_page_for_every_fault_with_what_it_does_and_no_other() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/faults");
    let pages = std::fs::read_dir(folder).expect("docs/faults is there");
    assert_eq!(pages.count(), RULES.len());
    for rule in RULES {
        let name = page_name(rule.fault);
        let page = std::fs::read_to_string(format!("{folder}/{name}")).expect(&name);
        let title = format!("# {} {:?}", rule.fault.code(), rule.fault);
        assert_eq!(page.lines().next(), Some(title.as_str()));
        let row = page.lines().nth(4).expect("a row of what it does");
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let watches = if rule.watches { "yes" } else { "no" };
        let cleared = match rule.acknowledges {
            true => "an acknowledgement, once the cause is gone",
            false => "a restart",
        };
        assert_eq!(
            &cells[2..5],
            [in_words(rule.output), watches, cleared],
            "{name}"
        );
        let time = match rule.fault {
            // Its own, after what the settings allow by default.
            Fault::NotFollowing => 300,
            _ => rule.within_ms,
        };
        let time = format!("{time} ms");
        assert_eq!(cells[1].split(" if").next(), Some(time.as_str()), "{name}");
        for part in ["## Cause", "## Effect", "## Remedy"] {
            let text = page.split(part).nth(1).expect(part);
            let text = text.split("\n## ").next().unwrap_or_default();
            assert!(text.trim().len() > 40, "{name}: {part} says nothing");
        }
    }
}

#[test]
fn the_manual_names_no_setting_that_does_not_exist() {
    let groups = [
        "regulator.",
        "air.",
        "finger.",
        "detection.",
        "grip.",
        "gauge.",
    ];
    let groups = [&groups[..], &["front_end.", "io.", "telemetry.", "bus."]].concat();
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/docs");
    let mut named = 0;
    for folder in [docs.to_string(), format!("{docs}/faults")] {
        for entry in std::fs::read_dir(folder).expect("the manual is there") {
            let path = entry.expect("a page").path();
            if path.extension().is_none_or(|kind| kind != "md") {
                continue;
            }
            let page = std::fs::read_to_string(&path).expect("text");
            let quoted = page.split('`').skip(1).step_by(2);
            let is_name = |text: &&str| {
                let plain = |c: char| c.is_ascii_lowercase() || c == '_' || c == '.';
                groups.iter().any(|group| text.starts_with(group)) && text.chars().all(plain)
            };
            for name in quoted.filter(is_name) {
                let exists = FIELDS.iter().any(|field| {
                    let field = field.name.split('[').next().unwrap_or_default();
                    field == name
                });
                assert!(exists, "{}: {name}", path.display());
                named += 1;
            }
        }
    }
    assert!(named > 50, "{named}");
}
