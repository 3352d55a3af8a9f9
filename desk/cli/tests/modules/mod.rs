//! The modules of a package as a graph, read from the text of its files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Names from the root of the package down.
type Name = Vec<String>;

/// The files below `root` that use each other, directly or by way of others, relative to `dir`.
/// Tests do not count.
pub fn in_circles(dir: &Path, root: &str) -> Vec<String> {
    let mut files = BTreeMap::new();
    collect(&dir.join(root), Vec::new(), &mut files);
    let names: BTreeSet<Name> = files.keys().cloned().collect();
    let uses: BTreeMap<&Name, BTreeSet<Name>> = files
        .iter()
        .map(|(name, (_, text))| (name, used(name, text, &names)))
        .collect();
    let reaches_itself = |start: &Name| {
        let mut seen = BTreeSet::new();
        let mut next: Vec<&Name> = uses[start].iter().collect();
        while let Some(name) = next.pop() {
            if seen.insert(name) {
                next.extend(&uses[name]);
            }
        }
        seen.contains(start)
    };
    let circular = files.iter().filter(|(name, _)| reaches_itself(name));
    circular
        .map(|(_, (path, _))| {
            let relative = path.strip_prefix(dir).unwrap_or(path);
            relative.display().to_string()
        })
        .collect()
}

/// Takes a module's file and those of the modules that it declares.
fn collect(path: &Path, name: Name, files: &mut BTreeMap<Name, (PathBuf, Vec<String>)>) {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let tokens = without_tests(&tokens(&text));
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    let beside = match stem {
        Some("lib" | "main" | "mod") => path.with_file_name(""),
        _ => path.with_extension(""),
    };
    for child in declared(&tokens) {
        let place = placed(&tokens, &child).map(|place| path.with_file_name(place));
        let flat = beside.join(format!("{child}.rs"));
        let nested = beside.join(&child).join("mod.rs");
        let place = place.unwrap_or(if nested.exists() { nested } else { flat });
        collect(&place, [name.clone(), vec![child]].concat(), files);
    }
    files.insert(name, (path.to_path_buf(), tokens));
}

/// The modules that a file uses.
fn used(name: &Name, tokens: &[String], names: &BTreeSet<Name>) -> BTreeSet<Name> {
    let children: BTreeSet<String> = declared(tokens).into_iter().collect();
    let mut used = BTreeSet::new();
    for path in paths(tokens) {
        let mut from = name.clone();
        let mut rest = path.as_slice();
        match rest[0].as_str() {
            // A visibility, as in `pub(super)`.
            _ if rest.len() == 1 => continue,
            "crate" => from.clear(),
            "super" | "self" => {}
            child if children.contains(child) => {}
            _ => continue,
        }
        while let Some((first, more)) = rest.split_first() {
            match first.as_str() {
                "crate" | "self" => {}
                "super" => drop(from.pop()),
                _ => break,
            }
            rest = more;
        }
        // As deep as there are modules; what follows is in that one's file.
        for part in rest {
            from.push(part.clone());
            if !names.contains(&from) {
                from.pop();
                break;
            }
        }
        if from != *name {
            used.insert(from);
        }
    }
    used
}

/// The names in `mod name;`. Tests in a file of their own do not count either.
fn declared(tokens: &[String]) -> Vec<String> {
    let modules = tokens.windows(3).filter(|t| t[0] == "mod" && t[2] == ";");
    let names = modules.map(|t| t[1].clone());
    names.filter(|name| name != "tests").collect()
}

/// Where a module's file is, if a `#[path = "…"]` stands before it.
fn placed(tokens: &[String], child: &str) -> Option<String> {
    let mut attributes = tokens.windows(6);
    let found =
        attributes.find(|t| t[0] == "path" && t[3] == "]" && t[4] == "mod" && t[5] == child)?;
    Some(found[2].trim_matches('"').to_string())
}

/// Every path in a file, those in braces each for itself.
fn paths(tokens: &[String]) -> Vec<Name> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let starts = is_name(&tokens[at]) && (at == 0 || tokens[at - 1] != "::");
        match starts {
            true => path(tokens, &mut at, &[], &mut found),
            false => at += 1,
        }
    }
    found
}

/// Reads one path from `at` on, behind what stands before its braces.
fn path(tokens: &[String], at: &mut usize, before: &[String], found: &mut Vec<Name>) {
    let mut name = before.to_vec();
    while *at < tokens.len() {
        if is_name(&tokens[*at]) {
            name.push(tokens[*at].clone());
            *at += 1;
        } else if tokens[*at] == "{" && tokens[*at - 1] == "::" {
            *at += 1;
            while *at < tokens.len() && tokens[*at] != "}" {
                match is_name(&tokens[*at]) {
                    true => path(tokens, at, &name, found),
                    false => *at += 1,
                }
            }
            *at += 1;
            return;
        }
        match tokens.get(*at).map(String::as_str) {
            Some("::") => *at += 1,
            _ => break,
        }
        match tokens.get(*at) {
            Some(token) if is_name(token) || token == "{" => {}
            Some(token) if token == "*" => {
                name.push(token.clone());
                break;
            }
            _ => break,
        }
    }
    found.push(name);
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Names, `::`, texts in quotes and single signs, without comments.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("'\"'") {
            3
        } else if first == '"' {
            let length = quoted(rest);
            tokens.push(rest[..length].to_string());
            length
        } else if is_name(rest) {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_');
            let length = end.unwrap_or(rest.len());
            tokens.push(rest[..length].to_string());
            length
        } else if rest.starts_with("::") {
            tokens.push("::".into());
            2
        } else {
            if !first.is_whitespace() {
                tokens.push(first.into());
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

/// Length of the text in quotes at the start.
fn quoted(text: &str) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// Without what is in `mod tests { … }`.
fn without_tests(tokens: &[String]) -> Vec<String> {
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        if tokens[at..].starts_with(&["mod", "tests", "{"].map(String::from)) {
            let mut open = 0;
            for token in &tokens[at..] {
                at += 1;
                open += i32::from(token == "{") - i32::from(token == "}");
                if open == 0 && token == "}" {
                    break;
                }
            }
        } else {
            kept.push(tokens[at].clone());
            at += 1;
        }
    }
    kept
}
