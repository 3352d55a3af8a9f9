//! Self-contained HTML pages: figures inline, no script, no network.

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

use crate::charts;

const STYLE: &str = include_str!("page.css");

/// A page in the common style, from its title and its body.
pub fn page(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(charts::dark_rules())) }
            }
            body { (body) }
        }
    };
    page.into_string() + "\n"
}

/// A chart of [`charts::draw`] with what it shows below it, and a title above it if there is one.
pub fn figure(title: Option<&str>, svg: &str, caption: &impl Render) -> Markup {
    html! {
        figure {
            @if let Some(title) = title { h2 { (title) } }
            (PreEscaped(svg))
            figcaption { (caption) }
        }
    }
}
