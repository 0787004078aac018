//! What `export` says.

use std::path::Path;

use super::files;
use crate::log::export::ExportSummary;
use crate::session::ExportPart;

/// How much was written of a part, and what is missing of it.
#[must_use]
pub fn text(summary: &ExportSummary, part: ExportPart, output: &Path) -> String {
    let what = match part {
        ExportPart::Rows => "rows",
        ExportPart::Frames => "frames",
    };
    let mut lines = vec![format!("{} {what} → {}", summary.written, output.display())];
    if summary.written == 0 && part == ExportPart::Frames {
        lines.push("warning: the recording holds no raw frames: it was not made on a bus".to_owned());
    }
    if summary.lost > 0 {
        let lost = summary.lost;
        lines.push(format!(
            "warning: the recorder lost {lost} records: it or its disk was too slow, or the disk full"
        ));
    }
    if summary.out_of_order > 0 {
        lines.push(format!("warning: {} periods out of order, left out", summary.out_of_order));
    }
    if let Some(cut_off) = files::cut_off(&summary.end) {
        lines.push(format!("warning: the recording is {cut_off}; everything before it is here"));
    }
    lines.join("\n") + "\n"
}
