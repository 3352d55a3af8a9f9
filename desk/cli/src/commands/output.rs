//! Printing of results. A reader that closes the pipe early, as `head` does, is not an error.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write, stderr, stdout};

use anyhow::Context;

/// Prints to standard output, and nothing into one that was closed.
pub fn print(text: Arguments) -> anyhow::Result<()> {
    let mut stdout = stdout().lock();
    match stdout.write_fmt(text).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.context("standard output: cannot write"),
    }
}

/// Says something on standard error, if anybody listens.
pub fn note(note: Arguments) {
    // There is nowhere left to say that nobody does.
    let _ = stderr().write_fmt(format_args!("softgrip: {note}\n"));
}

/// [`print!`](std::print) by way of [`print()`].
macro_rules! out {
    ($($text:tt)*) => {
        $crate::commands::output::print(format_args!($($text)*))?
    };
}

/// [`println!`](std::println) by way of [`print()`].
macro_rules! outln {
    ($($text:tt)*) => {
        $crate::commands::output::print(format_args!("{}\n", format_args!($($text)*)))?
    };
}

pub(crate) use {out, outln};
