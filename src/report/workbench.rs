//! What `workbench` says on the terminal, and who points to it.

/// At the end of what other commands say.
pub const POINTER: &str = "to look, ask and add yourself, in a browser: `rotorbench workbench`";
/// The address was printed, and nothing here can show it.
pub const NO_BROWSER: &str = "no browser was found here: open this address in one";

/// A page that leads to the workbench's first address, whose letters and digits are none that markup knows.
#[must_use]
pub fn redirect(address: &str) -> String {
    format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\">\
         <meta http-equiv=\"refresh\" content=\"0; url={address}\"><title>rotorbench workbench</title>\
         <p><a href=\"{address}\">To the workbench</a></p></html>\n"
    )
}
