//! `summary.html`: all items of a batch on one page that needs nothing but itself; links lead to the items' own pages.

use super::rows::{Counts, Row};
use super::state::Folder;
use super::thumbnail;
use crate::cli::report::page::document::whole_page;
use crate::cli::report::page::html::Html;
use crate::cli::terminal::text::{bytes, duration, number};

/// The whole page.
pub(super) fn page(folder: &Folder, rows: &[Row], counts: &Counts) -> String {
    whole_page("strandline batch", |page| {
        page.element("h1", &[], "strandline batch");
        page.element("p", &[("class", "faint")], &told(counts));
        let failed = rows.iter().filter(|row| row.state == "failed");
        for row in failed {
            let time = row.time.map_or(String::new(), |time| format!(", time {time}"));
            let object = row.object.map_or(String::new(), |label| format!(", object {label}")) + &time;
            let reason = row.reason.as_deref().unwrap_or("failed");
            page.element("p", &[("class", "warning")], &format!("{}{object}: {reason}", row.item));
        }
        page.within("div", &[("class", "wide")], |page| {
            page.within("table", &[], |table| put_rows(table, folder, rows));
        });
    })
}

/// How many items are what.
pub(crate) fn told(counts: &Counts) -> String {
    let Counts { done, failed, skipped, interrupted } = *counts;
    let parts = [(done, "done"), (failed, "failed"), (interrupted, "interrupted"), (skipped, "not run yet")];
    let all = done + failed + skipped + interrupted;
    let items = if all == 1 { "item" } else { "items" };
    let parts: Vec<String> = parts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    format!("{all} {items}: {}", parts.join(", "))
}

const HEAD: [&str; 11] =
    ["", "item", "object", "at time", "state", "volume", "area", "marks off, mean", "largest", "time", "peak memory"];

fn put_rows(table: &mut Html, folder: &Folder, rows: &[Row]) {
    table.within("thead", &[], |head| {
        head.within("tr", &[], |row| HEAD.iter().for_each(|text| row.element("th", &[], text)));
    });
    table.within("tbody", &[], |body| {
        let mut before = "";
        for row in rows {
            let is_first = row.item != before;
            before = &row.item;
            body.within("tr", &[], |cells| put_row(cells, folder, row, is_first));
        }
    });
}

fn put_row(cells: &mut Html, folder: &Folder, row: &Row, is_first: bool) {
    let address = is_first.then(|| thumbnail::address(&folder.picture(&row.item))).flatten();
    let address = address.filter(|_| row.state != "failed" || row.volume.is_some());
    cells.within("td", &[("data-name", HEAD[0])], |cell| {
        if let Some(address) = &address {
            let about = format!("a slice through {}", row.item);
            cell.element("img", &[("src", address), ("alt", &about)], "");
        }
    });
    cells.within("td", &[("data-name", HEAD[1])], |cell| {
        if folder.store(&row.item).join("report.html").is_file() && row.state == "done" {
            let link = format!("{}.zarr/report.html", encoded(&row.item));
            cell.element("a", &[("href", &link)], &row.item);
        } else {
            cell.text(&row.item);
        }
    });
    let of = |value: Option<f64>| value.map_or(String::new(), number);
    for (name, number) in HEAD[2..4].iter().zip([row.object, row.time]) {
        cells.element("td", &[("data-name", name)], &number.map_or(String::new(), |number| number.to_string()));
    }
    cells.within("td", &[("data-name", HEAD[4])], |cell| {
        cell.text(row.state);
        if let Some(reason) = &row.reason {
            cell.element("div", &[("class", "faint reason")], reason);
        }
    });
    let rest = [
        of(row.volume),
        of(row.area),
        of(row.marks_mean),
        of(row.marks_max),
        row.seconds.filter(|_| is_first).map_or(String::new(), seconds),
        row.peak_memory_bytes.filter(|_| is_first).map_or(String::new(), bytes),
    ];
    for (name, text) in HEAD[5..].iter().zip(&rest) {
        cells.element("td", &[("data-name", name)], text);
    }
}

/// A time, short ones to a tenth of a second.
pub(crate) fn seconds(seconds: f64) -> String {
    if seconds < 10.0 { format!("{seconds:.1} s") } else { duration(seconds) }
}

/// A name as a part of an address.
fn encoded(name: &str) -> String {
    let one = |byte: u8| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' => char::from(byte).to_string(),
        _ => format!("%{byte:02X}"),
    };
    name.bytes().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_names_are_told() {
        let counts = Counts { done: 34, failed: 6, ..Counts::default() };
        assert_eq!(told(&counts), "40 items: 34 done, 6 failed");
        assert_eq!(encoded("a b#ä.1"), "a%20b%23%C3%A4.1");
    }
}
