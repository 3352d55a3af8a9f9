//! What each package of the workspace may use, and that no two files of a package use each other.

mod modules;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The packages of this workspace that each package is built on; nothing else, and nothing less.
const INTERNAL: [(&str, &[&str]); 8] = [
    ("softgrip", &["finger"]),
    ("finger", &[]),
    ("softgrip-sim", &["finger", "softgrip"]),
    ("softgrip-report", &["finger", "sim", "softgrip"]),
    (
        "softgrip-evaluate",
        &["finger", "report", "sim", "softgrip"],
    ),
    ("softgrip-studies", &["finger", "report", "sim", "softgrip"]),
    (
        "softgrip-cli",
        &["evaluate", "finger", "report", "sim", "softgrip", "studies"],
    ),
    ("softgrip-hil", &["finger", "report", "sim", "softgrip"]),
];

/// Who alone may use a crate that says what a package is for: command lines, progress bars, JSON, pictures,
/// pages, threads, physics.
const RESERVED: [(&str, &[&str]); 8] = [
    ("clap", &["softgrip-cli", "softgrip-hil"]),
    ("indicatif", &["softgrip-cli"]),
    (
        "serde_json",
        &[
            "softgrip-cli",
            "softgrip-evaluate",
            "softgrip-hil",
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
    ("rapier3d-f64", &["softgrip-sim"]),
    ("parquet", &["softgrip-studies"]),
];

/// Files that still use each other, by package. An entry that is over must go.
const KNOWN: [(&str, &[&str]); 2] = [
    (
        "finger",
        &[
            "src/capability.rs",
            "src/chain.rs",
            "src/contact.rs",
            "src/hyperelastic.rs",
            "src/links.rs",
            "src/model.rs",
            "src/object.rs",
            "src/ogden.rs",
            "src/recipe.rs",
            "src/table.rs",
        ],
    ),
    ("softgrip-studies", &["src/fit.rs", "src/fit/text.rs"]),
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
    let known: BTreeMap<String, Vec<String>> = KNOWN
        .map(|(package, files)| {
            let files = files.iter().map(ToString::to_string);
            (package.to_string(), files.collect())
        })
        .into();
    assert_eq!(circles, known, "left: as it is; right: as known");
}
