//! The files of the page.

/// A file: where it is, what it is, and its bytes.
pub struct File {
    /// Where a browser asks for it.
    pub path: &'static str,
    /// What it is.
    pub content_type: &'static str,
    /// What is in it.
    pub text: &'static str,
}

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const PLAIN: &str = "text/plain; charset=utf-8";

const fn file(path: &'static str, content_type: &'static str, text: &'static str) -> File {
    File {
        path,
        content_type,
        text,
    }
}

/// All of them. uPlot 1.6.32 (MIT) draws the charts.
#[rustfmt::skip]
static FILES: [File; 11] = [
    file("/", HTML, include_str!("../page/index.html")),
    file("/panel.css", STYLE, include_str!("../page/panel.css")),
    file("/panel.js", SCRIPT, include_str!("../page/panel.js")),
    file("/link.js", SCRIPT, include_str!("../page/link.js")),
    file("/colors.js", SCRIPT, include_str!("../page/colors.js")),
    file("/fingers.js", SCRIPT, include_str!("../page/fingers.js")),
    file("/charts.js", SCRIPT, include_str!("../page/charts.js")),
    file("/settings.js", SCRIPT, include_str!("../page/settings.js")),
    file("/calibrate.js", SCRIPT, include_str!("../page/calibrate.js")),
    file("/uplot/uPlot.min.css", STYLE, include_str!("../page/uplot/uPlot.min.css")),
    file("/uplot/uPlot.iife.min.js", SCRIPT, include_str!("../page/uplot/uPlot.iife.min.js")),
];

static LICENCE: File = file(
    "/uplot/LICENSE",
    PLAIN,
    include_str!("../page/uplot/LICENSE"),
);

/// The file at a path.
pub fn at(path: &str) -> Option<&'static File> {
    FILES
        .iter()
        .chain([&LICENCE])
        .find(|file| file.path == path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_that_another_asks_for_is_there_and_none_comes_from_elsewhere() {
        let mut asked = 0;
        for file in &FILES {
            if file.path.starts_with("/uplot/") {
                continue;
            }
            for marker in ["href=\"", "src=\"", "from \"./"] {
                for part in file.text.split(marker).skip(1) {
                    let name = part.split('"').next().unwrap_or_default();
                    if name.starts_with("data:") {
                        continue;
                    }
                    assert!(at(&format!("/{name}")).is_some(), "{}: {name}", file.path);
                    asked += 1;
                }
            }
            let foreign = file.text.match_indices("://").filter(|(at, _)| {
                // The page's own socket, and the name of a vocabulary.
                !file.text[..*at].ends_with("ws") && !file.text[*at..].starts_with("://www.w3.org/")
            });
            assert_eq!(foreign.count(), 0, "{}", file.path);
        }
        assert!(asked > 8, "{asked}");
    }
}
