//! What is printed. Whoever reads it may stop before its end, as `head` does: the work goes on all the same, and the exit
//! code says how it went.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write, stderr, stdout};
use std::process::exit;

/// Prints a line of results.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::output::result(format_args!($($text)*)) };
}

/// Prints a line of what happens meanwhile, to standard error.
macro_rules! remark {
    ($($text:tt)*) => { $crate::cli::output::remark(format_args!($($text)*)) };
}

pub fn result(line: Arguments) {
    match writeln!(stdout(), "{line}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            remark!("error: standard output cannot be written to: {error}");
            exit(1);
        }
        _ => {}
    }
}

pub fn remark(line: Arguments) {
    // There is nowhere left to say that this failed.
    let _ = writeln!(stderr(), "{line}");
}
