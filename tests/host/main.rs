//! Tests of the public library on a mocked board.

mod commands;
mod faults;
mod mock;
mod properties;
mod scenarios;
