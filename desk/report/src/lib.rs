//! Output of runs and results: charts, side views, tables, JSON, text, pages and files. It computes no
//! results and knows no experiment; command lines do not belong here.
#![forbid(unsafe_code)]

pub mod files;
pub mod journal;
pub mod json;
pub mod parts;
pub mod provenance;
pub mod shard;
pub mod words;

pub mod style;

pub mod charts;
pub mod plot;
pub mod recent;
pub mod side_view;

pub mod html;
pub mod table;
