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

/// Escaped text with `` `code` ``, `**bold**` and links to pages beside it set; an unpaired mark stays as it is.
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
                html.push_str(&linked(&part));
            }
        }
    }
    html
}

/// Escaped text with `[name](page.html)` as a link to a page beside this one, and to nothing else.
fn linked(text: &str) -> String {
    let parts = || {
        let (before, rest) = text.split_once('[')?;
        let (name, rest) = rest.split_once("](")?;
        let (page, behind) = rest.split_once(')')?;
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "._-".contains(letter);
        let is_page = page.ends_with(".html") && !page.starts_with('.') && page.chars().all(is_plain);
        is_page.then(|| format!("{before}<a href=\"{page}\">{name}</a>{}", linked(behind)))
    };
    parts().unwrap_or_else(|| text.to_owned())
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
