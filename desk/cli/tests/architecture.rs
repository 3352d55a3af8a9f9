//! Which packages and crates each package of the workspace may use, that ARCHITECTURE.md says the same, and that no
//! two files of a package use each other.

mod modules;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The packages of this workspace that each package is built on; nothing else, and nothing less.
const INTERNAL: [(&str, &[&str]); 17] = [
    ("softgrip-table", &[]),
    ("softgrip-settings", &["softgrip-table"]),
    ("finger", &["softgrip-table"]),
    (
        "softgrip",
        &["finger", "softgrip-settings", "softgrip-table"],
    ),
    ("softgrip-bus", &["softgrip"]),
    ("softgrip-fw", &["softgrip", "softgrip-bus"]),
    ("softgrip-decode", &["softgrip"]),
    ("softgrip-sim", &["finger", "softgrip"]),
    ("softgrip-serve", &["bus", "settings", "sim", "softgrip"]),
    (
        "softgrip-watch",
        &["bus", "decode", "serve", "settings", "sim", "softgrip"],
    ),
    (
        "softgrip-panel",
        &["finger", "serve", "settings", "sim", "softgrip", "watch"],
    ),
    ("softgrip-check", &["settings", "softgrip", "watch"]),
    ("softgrip-report", &["finger", "sim", "softgrip"]),
    (
        "softgrip-evaluate",
        &["finger", "report", "sim", "softgrip"],
    ),
    ("softgrip-studies", &["finger", "report", "sim", "softgrip"]),
    (
        "softgrip-cli",
        &[
            "bus", "check", "evaluate", "finger", "panel", "report", "serve", "settings", "sim",
            "softgrip", "studies", "watch",
        ],
    ),
    (
        "softgrip-hil",
        &[
            "decode",
            "finger",
            "report",
            "sim",
            "softgrip",
            "softgrip-bus",
        ],
    ),
];

/// Who alone may use a crate that says what a package is for: command lines, progress bars, JSON, pictures,
/// pages, threads, sockets of pages, physics.
const RESERVED: [(&str, &[&str]); 13] = [
    ("clap", &["softgrip-cli", "softgrip-hil"]),
    ("indicatif", &["softgrip-cli"]),
    (
        "serde_json",
        &[
            "softgrip-check",
            "softgrip-cli",
            "softgrip-evaluate",
            "softgrip-hil",
            "softgrip-panel",
            "softgrip-report",
            "softgrip-studies",
        ],
    ),
    (
        "plotters",
        &["softgrip-evaluate", "softgrip-report", "softgrip-studies"],
    ),
    (
        "maud",
        &["softgrip-evaluate", "softgrip-report", "softgrip-studies"],
    ),
    (
        "rayon",
        &["softgrip-cli", "softgrip-evaluate", "softgrip-studies"],
    ),
    ("tungstenite", &["softgrip-panel"]),
    ("rapier3d-f64", &["softgrip-sim"]),
    ("parquet", &["softgrip-studies"]),
    ("mcap", &["softgrip-watch"]),
    ("foxglove", &["softgrip-watch"]),
    ("probe-rs", &["softgrip-watch"]),
    ("defmt-decoder", &["softgrip-decode"]),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn manifest(dir: &Path) -> toml::Table {
    let path = dir.join("Cargo.toml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.parse()
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Every package of the workspace by its name, with its directory and its manifest.
fn packages() -> BTreeMap<String, (PathBuf, toml::Table)> {
    let members = manifest(&root())["workspace"]["members"].clone();
    let mut dirs = Vec::new();
    for member in members.as_array().expect("a list of members") {
        let member = member.as_str().expect("a path");
        match member.strip_suffix("/*") {
            None => dirs.push(root().join(member)),
            Some(folder) => {
                let entries = std::fs::read_dir(root().join(folder)).expect("a folder of packages");
                dirs.extend(entries.map(|entry| entry.expect("an entry").path()));
            }
        }
    }
    dirs.into_iter()
        .map(|dir| {
            let manifest = manifest(&dir);
            let name = manifest["package"]["name"].as_str().expect("a name");
            (name.to_string(), (dir, manifest))
        })
        .collect()
}

/// What a package is built with, tests aside, on every target.
fn dependencies(manifest: &toml::Table) -> BTreeMap<String, toml::Value> {
    let mut all = BTreeMap::new();
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    let targets = targets.into_iter().flat_map(|targets| targets.values());
    let tables = targets.filter_map(toml::Value::as_table).chain([manifest]);
    for table in tables {
        for kind in ["dependencies", "build-dependencies"] {
            let found = table.get(kind).and_then(toml::Value::as_table);
            all.extend(
                found
                    .into_iter()
                    .flatten()
                    .map(|(k, v)| (k.clone(), v.clone())),
            );
        }
    }
    all
}

#[test]
fn every_package_is_built_on_what_it_may_use_and_on_nothing_else() {
    let packages = packages();
    let mut built_on = BTreeMap::new();
    let mut users: BTreeMap<&str, BTreeSet<&str>> =
        RESERVED.map(|(name, _)| (name, BTreeSet::new())).into();
    for (package, (_, manifest)) in &packages {
        let dependencies = dependencies(manifest);
        let internal = dependencies
            .iter()
            .filter(|(_, how)| how.get("path").is_some());
        let internal: Vec<String> = internal.map(|(name, _)| name.clone()).collect();
        built_on.insert(package.as_str(), internal);
        for name in dependencies.keys() {
            if let Some(users) = users.get_mut(name.as_str()) {
                users.insert(package);
            }
        }
    }
    let allowed: BTreeMap<&str, Vec<String>> = INTERNAL
        .map(|(package, on)| (package, on.iter().map(ToString::to_string).collect()))
        .into();
    assert_eq!(built_on, allowed, "left: as it is; right: as it may be");
    let reserved: BTreeMap<&str, BTreeSet<&str>> = RESERVED
        .map(|(name, users)| (name, users.iter().copied().collect()))
        .into();
    assert_eq!(users, reserved, "left: as it is; right: as it may be");
}

#[test]
fn no_files_of_a_package_use_each_other_in_a_circle() {
    let mut circles = BTreeMap::new();
    for (package, (dir, _)) in &packages() {
        let roots = ["src/lib.rs", "src/main.rs"].into_iter();
        let roots = roots.filter(|root| dir.join(root).exists());
        let found: Vec<String> = roots
            .flat_map(|root| modules::in_circles(dir, root))
            .collect();
        if !found.is_empty() {
            circles.insert(package.clone(), found);
        }
    }
    assert!(circles.is_empty(), "{circles:#?}");
}

/// A table of ARCHITECTURE.md, by its heading and the title of its first column: the names in backticks in its last
/// column, by the name in its first.
fn documented(heading: &str, first_column: &str) -> BTreeMap<String, BTreeSet<String>> {
    let path = root().join("ARCHITECTURE.md");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let quoted = |cell: &str| -> BTreeSet<String> {
        let names = cell.split('`').skip(1).step_by(2);
        names.map(str::to_string).collect()
    };
    let lines = text.lines().skip_while(|line| *line != heading);
    let header = format!("| {first_column} |");
    let table = lines.skip_while(|line| !line.starts_with(&header));
    let rows = table.skip(2).take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
        let name = quoted(cells[0]).pop_first().expect("a name in backticks");
        (name, quoted(cells[cells.len() - 1]))
    })
    .collect()
}

#[test]
fn architecture_md_describes_every_package_and_what_it_is_built_on() {
    let packages = packages();
    let described = documented("## Packages", "package");
    let built_on = documented("## Who imports whom", "package");
    for (name, (_, manifest)) in &packages {
        assert!(described.contains_key(name), "no row for {name}");
        let dependencies = dependencies(manifest);
        let inside = dependencies
            .iter()
            .filter(|(_, how)| how.get("path").is_some());
        let real: BTreeSet<&str> = inside
            .map(|(key, how)| match how.get("package") {
                Some(package) => package.as_str().expect("a package's name"),
                None => key.as_str(),
            })
            .collect();
        let documented = built_on.get(name);
        let documented: BTreeSet<&str> = documented
            .unwrap_or_else(|| panic!("no row for {name}"))
            .iter()
            .map(String::as_str)
            .collect();
        assert_eq!(documented, real, "{name}; left: documented; right: real");
    }
}

#[test]
fn architecture_md_says_who_may_use_a_reserved_crate() {
    let reserved: BTreeMap<String, BTreeSet<String>> = RESERVED
        .map(|(name, users)| {
            let users = users.iter().map(ToString::to_string);
            (name.to_string(), users.collect())
        })
        .into();
    let documented = documented("## Who imports whom", "crate");
    assert_eq!(documented, reserved, "left: documented; right: the rule");
}
