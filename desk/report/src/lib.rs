//! What turns runs and numbers into charts, side views, tables, JSON, words, pages and files; it computes
//! nothing and knows no experiment, and no command line may be in it.
#![forbid(unsafe_code)]

pub mod files;
pub mod json;
pub mod words;

pub mod style;

pub mod charts;
pub mod plot;
pub mod side_view;

pub mod html;
pub mod table;
