//! Results on standard output. The library's `print!` panics where that takes no more, as a full disk.

use std::fmt;
use std::io::Write;
use std::process;

/// As the library's; where standard output takes no more it says so and ends with 2.
macro_rules! print {
    ($($text:tt)*) => { $crate::cli::print::out(format_args!($($text)*)) };
}

/// As the library's, by [`print!`].
macro_rules! println {
    () => { $crate::cli::print::out(format_args!("\n")) };
    ($($text:tt)*) => { $crate::cli::print::out(format_args!("{}\n", format_args!($($text)*))) };
}

/// Writes `text`, to its end: it is seen when a line is.
pub(super) fn out(text: fmt::Arguments) {
    let mut output = std::io::stdout().lock();
    if let Err(error) = output.write_fmt(text).and_then(|()| output.flush()) {
        // What a bench runs has ended when its results are printed.
        eprintln!("error: {}", super::brief::brief(&format!("standard output: {error}")));
        process::exit(2);
    }
}
