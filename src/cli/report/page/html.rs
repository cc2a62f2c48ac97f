//! Text with marks, as HTML that is XML too: every text and every attribute is escaped where it is put in.

/// A page, or a part of one, in the making.
#[derive(Debug, Default)]
pub(crate) struct Html {
    text: String,
}

/// Elements that hold nothing.
const EMPTY: [&str; 4] = ["meta", "link", "img", "br"];

impl Html {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// An element with its attributes, and what is in it.
    pub(crate) fn within(&mut self, name: &str, attributes: &[(&str, &str)], inside: impl FnOnce(&mut Self)) {
        self.text.push('<');
        self.text.push_str(name);
        for (attribute, value) in attributes {
            self.text.push(' ');
            self.text.push_str(attribute);
            self.text.push_str("=\"");
            self.text(value);
            self.text.push('"');
        }
        if EMPTY.contains(&name) {
            self.text.push_str("/>\n");
            return;
        }
        self.text.push('>');
        inside(self);
        self.text.push_str("</");
        self.text.push_str(name);
        self.text.push_str(if INLINE.contains(&name) { ">" } else { ">\n" });
    }

    /// An element with nothing in it but text.
    pub(crate) fn element(&mut self, name: &str, attributes: &[(&str, &str)], text: &str) {
        self.within(name, attributes, |inside| inside.text(text));
    }

    /// Text.
    pub(crate) fn text(&mut self, text: &str) {
        for c in text.chars() {
            match c {
                '&' => self.text.push_str("&amp;"),
                '<' => self.text.push_str("&lt;"),
                '>' => self.text.push_str("&gt;"),
                '"' => self.text.push_str("&quot;"),
                '\'' => self.text.push_str("&#39;"),
                '\n' | '\t' => self.text.push(c),
                // No XML may hold these, nor what is no character at all.
                c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => self.text.push('\u{fffd}'),
                c => self.text.push(c),
            }
        }
    }

    /// What is HTML already: made by this program from numbers and words of its own.
    pub(crate) fn raw(&mut self, html: &str) {
        self.text.push_str(html);
    }

    /// A table; its first row are the headings. Cells name their heading, for narrow pages, which show rows as paragraphs.
    pub(crate) fn table(&mut self, rows: &[Vec<String>]) {
        let Some((head, body)) = rows.split_first() else { return };
        self.within("div", &[("class", "wide")], |inside| {
            inside.within("table", &[], |table| {
                if head.iter().any(|text| !text.is_empty()) {
                    table.within("thead", &[], |table| {
                        table.within("tr", &[], |row| head.iter().for_each(|text| row.element("th", &[], text)));
                    });
                }
                table.within("tbody", &[], |table| body.iter().for_each(|row| table.row(head, row)));
            });
        });
    }

    fn row(&mut self, head: &[String], row: &[String]) {
        self.within("tr", &[], |table| {
            for (name, text) in head.iter().zip(row) {
                table.element("td", &[("data-name", name)], text);
            }
        });
    }

    pub(crate) fn finish(self) -> String {
        self.text
    }
}

/// Elements within a line.
const INLINE: [&str; 6] = ["a", "b", "code", "span", "th", "td"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_put_in_stays_text() {
        let hostile = "</p><script>alert('1')</script>\u{1}&amp;\" onload=\"x";
        let mut html = Html::new();
        html.within("p", &[("title", hostile)], |p| p.text(hostile));
        html.element("img", &[("alt", hostile)], "");
        let text = format!("<body>{}</body>", html.finish());
        let read = roxmltree::Document::parse(&text).unwrap();
        let p = read.descendants().find(|node| node.has_tag_name("p")).unwrap();
        let shown = hostile.replace('\u{1}', "\u{fffd}");
        assert_eq!((p.text(), p.attribute("title")), (Some(&*shown), Some(&*shown)));
        assert!(read.descendants().all(|node| !node.has_tag_name("script")));
    }
}
