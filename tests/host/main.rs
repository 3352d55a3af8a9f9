//! Tests of the public library on a mocked board.

mod mock;
mod properties;
mod scenarios;
