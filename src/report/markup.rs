//! Text inside HTML and SVG.

/// Text safe inside HTML and SVG, in elements and in quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            // Control characters are not text; a log's column name may hold any byte.
            letter if letter.is_control() && letter != '\n' && letter != '\t' => safe.push('\u{fffd}'),
            letter => safe.push(letter),
        }
    }
    safe
}

/// Escaped text with `` `code` `` and `**bold**` set; an unpaired mark stays as it is.
pub(super) fn inline(text: &str) -> String {
    let mut html = String::new();
    for (index, part) in paired(&escape(text), "`").into_iter().enumerate() {
        if index % 2 == 1 {
            html.push_str(&format!("<code>{part}</code>"));
            continue;
        }
        for (index, part) in paired(&part, "**").into_iter().enumerate() {
            if index % 2 == 1 {
                html.push_str(&format!("<b>{part}</b>"));
            } else {
                html.push_str(&part);
            }
        }
    }
    html
}

/// Parts of `text` between marks: the odd ones were inside a pair.
fn paired(text: &str, mark: &str) -> Vec<String> {
    let mut parts: Vec<String> = text.split(mark).map(str::to_owned).collect();
    if parts.len().is_multiple_of(2)
        && let Some(last) = parts.pop()
        && let Some(before) = parts.last_mut()
    {
        before.push_str(mark);
        before.push_str(&last);
    }
    parts
}
