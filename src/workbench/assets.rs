//! The files of the page, inside the program. A build for development reads them from the sources: a change shows when the
//! page is loaded again.

use std::borrow::Cow;
use std::path::Path;

use crate::report::{PALETTE, UPLOT_SCRIPT, UPLOT_STYLE};

/// Path, content.
macro_rules! files {
    ($($name:literal),+ $(,)?) => {
        /// Name and text of each file in `page/`.
        const FILES: &[(&str, &str)] = &[$(($name, include_str!(concat!("page/", $name)))),+];
    };
}

files![
    "index.html",
    "style.css",
    "main.js",
    "margins.js",
    "act.js",
    "against.js",
    "ask.js",
    "beside.js",
    "card.js",
    "charts.js",
    "cursors.js",
    "details.js",
    "dom.js",
    "drawing.js",
    "drop.js",
    "files.js",
    "follow.js",
    "guess.js",
    "keys.js",
    "ladder.js",
    "law.js",
    "live.js",
    "logs.js",
    "looks.js",
    "models.js",
    "part.js",
    "plots.js",
    "progress.js",
    "shell.js",
];

/// A file of the page.
pub(super) struct Asset {
    pub kind: &'static str,
    pub text: Cow<'static, str>,
}

/// The file at this path, from `/` on.
pub(super) fn find(path: &str) -> Option<Asset> {
    let name = if path == "/" { "index.html" } else { path.strip_prefix('/')? };
    let borrowed = |kind, text| Some(Asset { kind, text: Cow::Borrowed(text) });
    match name {
        "uplot.js" => return borrowed("text/javascript; charset=utf-8", UPLOT_SCRIPT),
        "uplot.css" => return borrowed("text/css; charset=utf-8", UPLOT_STYLE),
        "palette.css" => return borrowed("text/css; charset=utf-8", PALETTE),
        _ => {}
    }
    let (name, text) = FILES.iter().find(|(own, _)| *own == name)?;
    let kind = match name.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        _ => "text/javascript; charset=utf-8",
    };
    Some(Asset { kind, text: current(name, text) })
}

/// The file as it is now, where this is a build for development; as it was built in else.
fn current(name: &str, text: &'static str) -> Cow<'static, str> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src/workbench/page"));
    let read = cfg!(debug_assertions).then(|| std::fs::read_to_string(folder.join(name)).ok()).flatten();
    read.map_or(Cow::Borrowed(text), Cow::Owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_the_page_is_served_and_small_enough_to_read() {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src/workbench/page"));
        let mut bytes = UPLOT_SCRIPT.len() + UPLOT_STYLE.len() + PALETTE.len();
        for file in std::fs::read_dir(folder).expect("the page's folder") {
            let file = file.expect("an entry").path();
            let name = file.file_name().expect("a name").to_string_lossy().into_owned();
            let text = std::fs::read_to_string(&file).expect("UTF-8");
            assert!(FILES.iter().any(|(own, _)| *own == name), "{name} is not served");
            assert!(text.lines().count() <= 300, "{name} has more than 300 lines");
            bytes += text.len();
        }
        assert!(bytes <= 400_000, "the page has {bytes} bytes");
        assert!(find("/../Cargo.toml").is_none() && find("/page/main.js").is_none());
    }

    #[test]
    fn no_file_of_the_page_makes_markup_of_text_or_runs_text() {
        for (name, text) in FILES.iter().filter(|(name, _)| name.ends_with(".js")) {
            for way in
                ["innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "new Function"]
            {
                assert!(!text.contains(way), "{name} uses {way}");
            }
        }
        let (_, html) = FILES[0];
        assert!(!html.contains("style=") && !html.contains("onclick") && !html.contains("<script>"));
    }
}
