//! What `workbench` says on the terminal, and who points to it.

/// At the end of what other commands say.
pub const POINTER: &str = "to look, ask and add yourself, in a browser: `rotorbench workbench`";
/// The address was printed, and nothing here can show it.
pub const NO_BROWSER: &str = "no browser was found here: open this address in one";
