//! The manual's page about the registers.

use bus::page::Page;

#[test]
fn the_page_of_the_manual_has_every_register_as_it_is() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/registers.md");
    let page = std::fs::read_to_string(page).expect("the page");
    assert!(
        page.ends_with(&Page.to_string()),
        "docs/registers.md must end with what `softgrip registers` prints"
    );
}
