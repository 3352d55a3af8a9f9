//! No source file and no function is too long to be read at once.

use std::path::{Path, PathBuf};

/// Lines of a file, with its tests.
const FILE_LINES: usize = 500;
/// Lines of a function, from its signature to its closing brace; tests may be longer.
const FUNCTION_LINES: usize = 80;

/// Every file of Rust in the repository, relative to its root, with its text.
fn sources() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut paths = Vec::new();
    collect(&root, &mut paths);
    paths.sort();
    let sources: Vec<(String, String)> = paths
        .iter()
        .map(|path| {
            let relative = path.strip_prefix(&root).expect("below the root");
            let text = std::fs::read_to_string(path).expect("a readable file");
            (relative.display().to_string(), text)
        })
        .collect();
    assert!(sources.len() > 100, "only {} files found", sources.len());
    sources
}

fn collect(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() {
            // Neither version control nor what cargo builds.
            if !name.starts_with('.') && name != "target" {
                collect(&path, found);
            }
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
}

/// Functions outside `mod tests` with their number of lines. Relies on the layout of rustfmt: a function ends with
/// the first brace that closes at its own indentation.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let end = lines.iter().position(|line| *line == "mod tests {");
    let lines = &lines[..end.unwrap_or(lines.len())];
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let code = line.trim_start();
        let Some((before, after)) = code.split_once("fn ") else {
            continue;
        };
        let qualifier = |word: &str| {
            word.starts_with("pub")
                || ["const", "async", "unsafe", "extern", "\"C\""].contains(&word)
        };
        if !before.split_whitespace().all(qualifier) || code.ends_with([';', '}']) {
            continue;
        }
        let closing = format!("{}}}", &line[..line.len() - code.len()]);
        let length = lines[at..].iter().position(|line| *line == closing);
        let name = after.split(['(', '<']).next().unwrap_or(after);
        found.push((name, 1 + length.expect("a closing brace")));
    }
    found
}

#[test]
fn no_file_is_longer_than_its_limit() {
    let files = sources().into_iter();
    let long = files.filter(|(_, text)| text.lines().count() > FILE_LINES);
    let long: Vec<String> = long.map(|(path, _)| path).collect();
    assert!(long.is_empty(), "{long:?}");
}

#[test]
fn no_function_is_longer_than_its_limit() {
    let mut long = Vec::new();
    let mut number = 0;
    for (path, text) in sources() {
        if path.split('/').any(|part| part == "tests") {
            continue;
        }
        for (name, lines) in functions(&text) {
            number += 1;
            if lines > FUNCTION_LINES {
                long.push(format!("{path}: {name}"));
            }
        }
    }
    assert!(number > 1000, "only {number} functions found");
    assert!(long.is_empty(), "{long:?}");
}

#[test]
fn a_function_is_counted_from_its_signature_to_its_closing_brace() {
    let text = "impl A {\n    pub fn a(\n        x: u8,\n    ) -> u8 {\n        if x {\n        }\n    }\n}\n\
                fn b() {}\nconst fn c<T>() {\n}\nmod tests {\n    fn d() {\n    }\n}\n";
    assert_eq!(functions(text), [("a", 6), ("c", 2)]);
}
