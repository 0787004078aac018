//! The page: blocks in, one HTML file out.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

use super::bars::Bars;
use super::markup::{escape, inline};
use super::plot::Plot;
use super::table::{Mark, TextTable};
use super::{ReportError, write_atomically};

/// uPlot, as vendored.
pub const UPLOT_SCRIPT: &str = include_str!("assets/uPlot.iife.min.js");
/// Its style sheet.
pub const UPLOT_STYLE: &str = include_str!("assets/uPlot.min.css");
/// The colours of reports and of the workbench, light and dark.
pub const PALETTE: &str = include_str!("assets/palette.css");
const UPLOT_LICENSE: &str = include_str!("assets/LICENSE-uPlot");
const SCRIPT: &str = include_str!("assets/page.js");
const STYLE: &str = include_str!("assets/page.css");

#[derive(Debug, Clone)]
enum Element {
    Heading(String),
    Subheading(String),
    Paragraph(String),
    Formula(String),
    Verdict(Mark, String),
    List(Vec<String>),
    KeyNumbers(Vec<(String, String)>),
    Table(TextTable),
    Plot(Box<Plot>),
    Bars(Bars),
    Details(String, Vec<Element>),
}

/// A report: a title and blocks, emitted as one self-contained HTML file.
///
/// Text is escaped; inside it, `` `code` `` and `**bold**` work.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    blocks: Vec<Element>,
}

impl Page {
    /// An empty page.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), blocks: Vec::new() }
    }

    /// Starts a section; sections are listed at the top.
    pub fn heading(&mut self, text: impl Into<String>) -> &mut Self {
        self.push(Element::Heading(text.into()))
    }

    /// Starts a part of a section.
    pub fn subheading(&mut self, text: impl Into<String>) -> &mut Self {
        self.push(Element::Subheading(text.into()))
    }

    /// Adds a paragraph.
    pub fn paragraph(&mut self, text: impl Into<String>) -> &mut Self {
        self.push(Element::Paragraph(text.into()))
    }

    /// Adds an equation on a line of its own, as plain text: `ω̇_p = -p ω_p + p z`.
    pub fn formula(&mut self, text: impl Into<String>) -> &mut Self {
        self.push(Element::Formula(text.into()))
    }

    /// Adds a boxed sentence that the reader must not miss.
    pub fn verdict(&mut self, mark: Mark, text: impl Into<String>) -> &mut Self {
        self.push(Element::Verdict(mark, text.into()))
    }

    /// Adds a bulleted list; an empty one leaves no trace.
    pub fn list<T: Into<String>>(&mut self, items: impl IntoIterator<Item = T>) -> &mut Self {
        let items: Vec<String> = items.into_iter().map(Into::into).collect();
        if items.is_empty() { self } else { self.push(Element::List(items)) }
    }

    /// Adds a row of large numbers, each with a few words below it: `("error left", "0.26 rad/s")`.
    pub fn key_numbers<N: Into<String>, V: Into<String>>(
        &mut self,
        numbers: impl IntoIterator<Item = (N, V)>,
    ) -> &mut Self {
        let numbers = numbers.into_iter().map(|(name, value)| (name.into(), value.into())).collect();
        self.push(Element::KeyNumbers(numbers))
    }

    /// Adds a table.
    pub fn table(&mut self, table: TextTable) -> &mut Self {
        self.push(Element::Table(table))
    }

    /// Adds a plot.
    pub fn plot(&mut self, plot: Plot) -> &mut Self {
        self.push(Element::Plot(Box::new(plot)))
    }

    /// Adds a bar chart.
    pub fn bars(&mut self, bars: Bars) -> &mut Self {
        self.push(Element::Bars(bars))
    }

    /// Adds what `fill` writes, folded away under `summary`.
    pub fn details(&mut self, summary: impl Into<String>, fill: impl FnOnce(&mut Self)) -> &mut Self {
        let mut inner = Self::new("");
        fill(&mut inner);
        self.push(Element::Details(summary.into(), inner.blocks))
    }

    fn push(&mut self, block: Element) -> &mut Self {
        self.blocks.push(block);
        self
    }

    /// The whole page as HTML.
    #[must_use]
    pub fn emit(&self) -> String {
        // The browser's tab shows no markup.
        let (title, heading) = (escape(&self.title.replace('`', "")), inline(&self.title));
        let mut body = String::new();
        let mut headings = Vec::new();
        emit_elements(&self.blocks, &mut body, &mut headings);
        let contents = if headings.len() < 3 {
            String::new()
        } else {
            let links: Vec<String> = headings
                .iter()
                .enumerate()
                .map(|(index, text)| format!("<a href=\"#section-{}\">{}</a>", index + 1, inline(text)))
                .collect();
            format!("<nav aria-label=\"contents\">{}</nav>", links.join(""))
        };
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"generator\" content=\"rotorbench {version}\">\n<title>{title}</title>\n\
             <style>{UPLOT_STYLE}\n{PALETTE}{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{heading}</h1>\n{contents}\n{body}\
             <footer>rotorbench {version}. Plots: drag to zoom, double-click for all, click a name to hide it. \
             Drawn by uPlot (MIT licence, in this file's source).</footer>\n</main>\n\
             <noscript><p>The plots of this report need JavaScript; nothing is loaded from the network.</p></noscript>\n\
             <!--\n{license}\n-->\n<script>{UPLOT_SCRIPT}</script>\n<script>{SCRIPT}</script>\n</body>\n</html>\n",
            version = env!("CARGO_PKG_VERSION"),
            policy = policy(&format!("{UPLOT_STYLE}\n{PALETTE}{STYLE}"), [UPLOT_SCRIPT, SCRIPT]),
            license = UPLOT_LICENSE.trim(),
        )
    }

    /// Writes the page; a file that was there is replaced only when all is written.
    ///
    /// # Errors
    /// [`ReportError::Write`] with the path.
    pub fn save(&self, path: &Path) -> Result<(), ReportError> {
        write_atomically(path, &self.emit())
    }
}

/// What a browser may do with the page: the style and the scripts of this program by their hashes, and nothing else. A text that
/// got into the page past its escaping could not run, and nothing is loaded or sent.
fn policy(style: &str, scripts: [&str; 2]) -> String {
    let hash = |text: &str| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text)));
    let scripts = scripts.map(hash).join(" ");
    format!(
        "default-src 'none'; script-src {scripts}; style-src {}; base-uri 'none'; form-action 'none'",
        hash(style)
    )
}

fn emit_elements(blocks: &[Element], html: &mut String, headings: &mut Vec<String>) {
    for block in blocks {
        let text = match block {
            Element::Heading(text) => {
                headings.push(text.clone());
                format!("<h2 id=\"section-{}\">{}</h2>\n", headings.len(), inline(text))
            }
            Element::Subheading(text) => format!("<h3>{}</h3>\n", inline(text)),
            Element::Paragraph(text) => format!("<p>{}</p>\n", inline(text)),
            Element::Formula(text) => format!("<p class=\"formula\">{}</p>\n", escape(text)),
            Element::Verdict(mark, text) => {
                format!("<p class=\"verdict {}\">{}</p>\n", mark.class(), inline(text))
            }
            Element::List(items) => {
                let items: String = items.iter().map(|item| format!("<li>{}</li>", inline(item))).collect();
                format!("<ul>{items}</ul>\n")
            }
            Element::KeyNumbers(numbers) => {
                let cards: String = numbers
                    .iter()
                    .map(|(name, value)| {
                        format!("<div><strong>{}</strong><span>{}</span></div>", inline(value), inline(name))
                    })
                    .collect();
                format!("<div class=\"key-numbers\">{cards}</div>\n")
            }
            Element::Table(table) => table.html(),
            Element::Plot(plot) => plot_html(plot),
            Element::Bars(bars) => bars.html(),
            Element::Details(summary, inner) => {
                let mut folded = String::new();
                emit_elements(inner, &mut folded, headings);
                format!("<details><summary>{}</summary>\n{folded}</details>\n", inline(summary))
            }
        };
        html.push_str(&text);
    }
}

fn plot_html(plot: &Plot) -> String {
    // "<" would let a curve's name end the script element.
    let data = plot.json().to_string().replace('<', "\\u003c");
    let title = inline(&plot.title);
    format!(
        "<figure class=\"plot\"><figcaption>{title}</figcaption><div class=\"drawing\"></div>\
         <script type=\"application/json\">{data}</script></figure>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::super::{Axis, Series};
    use super::*;

    #[test]
    fn one_file_with_everything_inside_and_all_text_escaped() {
        let mut page = Page::new("a <script> & \"b\"");
        page.heading("<h>").paragraph("`x<y` and **bold** and 2 * 3 and a ` alone").plot(
            Plot::new("p", Axis::new("t", "s"), Axis::new("</script>", "-")).series(Series::line(
                "</script><b>",
                &[0.0, 1.0],
                &[0.0, f64::NAN],
            )),
        );
        let html = page.emit();
        assert!(html.contains("<title>a &lt;script&gt; &amp; &quot;b&quot;</title>"));
        assert!(html.contains("<code>x&lt;y</code> and <b>bold</b> and 2 * 3 and a ` alone"));
        assert!(html.contains("\\u003c/script>\\u003cb>"));
        // The scripts that belong there: the data, the library, the page's own.
        assert_eq!(html.matches("</script>").count(), 3);
        // Each of them, and the style, has its hash in the policy, taken of what a browser sees between the tags.
        for (tag, end) in [("<script>", "</script>"), ("<style>", "</style>")] {
            for text in html.split(tag).skip(1).filter_map(|rest| rest.split_once(end)) {
                let hash = STANDARD.encode(Sha256::digest(text.0));
                assert!(html.contains(&format!("'sha256-{hash}'")), "{tag} would not run");
            }
        }
        assert!(html.contains("default-src 'none'; script-src 'sha256-"));
        assert!(!html.contains("style=\"") && !html.contains("onclick"), "what the policy forbids");
        for outside in ["src=", "href=\"http", "@import", "url("] {
            assert!(!html.contains(outside), "the page would load something: {outside}");
        }
    }

    #[test]
    fn a_failed_save_names_the_file_and_keeps_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.html");
        std::fs::write(&path, "old").unwrap();
        let missing = folder.path().join("nowhere").join("report.html");
        let error = Page::new("x").save(&missing).unwrap_err();
        assert!(error.to_string().contains("nowhere"), "{error}");
        Page::new("x").save(&path).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap().starts_with("<!doctype html>"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no leftover beside the report");
    }
}
