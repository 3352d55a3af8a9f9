//! Tests of the public library on a mocked board.

mod faults;
mod mock;
mod properties;
mod scenarios;
