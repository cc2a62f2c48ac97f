//! `report.html` as every run that writes a store leaves it: well-formed, whole without a network, whatever files are called.

#![allow(clippy::unwrap_used)]

use std::fs;

use roxmltree::{Document, Node, ParsingOptions};
use serde_json::Value;

use crate::common::ball::{Ball, Bench, HEADER};
use crate::common::clouds::sphere;

/// A page, read as XML.
fn with_page<R>(bench: &Bench, store: &str, look: impl FnOnce(&Document<'_>) -> R) -> R {
    let text = fs::read_to_string(bench.path(&format!("{store}/report.html"))).unwrap();
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let page = Document::parse_with_options(&text, options).unwrap();
    asks_for_nothing(&page);
    look(&page)
}

fn all<'a>(page: &'a Document<'a>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    page.descendants().filter(move |node| node.tag_name().name() == name)
}

/// Nothing in the page leads out of it, and nothing runs.
fn asks_for_nothing(page: &Document<'_>) {
    for node in page.descendants().filter(Node::is_element) {
        let name = node.tag_name().name();
        assert!(!["script", "iframe", "object", "embed", "base", "form", "a"].contains(&name), "{name}");
        for attribute in node.attributes() {
            let (key, value) = (attribute.name(), attribute.value());
            assert!(!key.starts_with("on"), "{key}");
            assert!(!["src", "href", "srcset", "action"].contains(&key) || value.starts_with("data:"), "{key}={value}");
            assert!(key != "style" || !value.contains("url("), "{value}");
        }
    }
    let style = all(page, "style").next().unwrap().text().unwrap();
    assert!(!style.contains("url(") && !style.contains("@import") && !style.contains("http"));
    let policy = all(page, "meta").find(|meta| meta.attribute("http-equiv").is_some()).unwrap();
    assert!(policy.attribute("content").unwrap().contains("default-src 'none'"));
}

/// Pictures and plots of a page.
fn figures(page: &Document<'_>) -> [usize; 2] {
    for image in all(page, "img") {
        let data = image.attribute("src").unwrap().strip_prefix("data:image/png;base64,").unwrap();
        // The first bytes of every PNG.
        assert!(data.starts_with("iVBORw0KGgo"), "{}", &data[..20]);
        let side = |name: &str| image.attribute(name).unwrap().parse::<u32>().unwrap();
        assert!((100..900).contains(&side("width")) && (40..900).contains(&side("height")));
        assert!(!image.attribute("alt").unwrap().is_empty());
    }
    ["img", "svg"].map(|name| all(page, name).count())
}

fn text(page: &Document<'_>) -> String {
    all(page, "main").next().unwrap().descendants().filter_map(|node| node.text()).collect::<Vec<_>>().join("\n")
}

fn balls(bench: &Bench) {
    for (name, x) in [("a.xyz", 0.0), ("b.xyz", 6.0)] {
        let points = sphere([x, 0.0, 0.0], 2.0, 300, |_| true);
        let lines: Vec<String> = points.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect();
        bench.write(name, &lines.join("\n"));
    }
}

#[test]
fn a_segmentation_shows_what_it_found() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let marks = format!("{HEADER}{}", ball.marks(1));
    bench.write("marks.csv", &marks);
    bench.succeed("segment image.tif --points marks.csv -o out/x.zarr --cross-validate --max-steps 30 -q");
    let report = bench.json("out/x.zarr/report.json");
    with_page(&bench, "out/x.zarr", |page| {
        assert_eq!(figures(page), [5, 2], "three slices and two views; a histogram and a curve");
        let text = text(page);
        assert!(text.contains("strandline segment image.tif --points marks.csv -o out/x.zarr"), "{text}");
        for heading in ["Run", "Found", "Slices", "Surface", "Motion", "Settings", "Stages"] {
            assert!(all(page, "h2").any(|h2| h2.text() == Some(heading)), "{heading}");
        }
        for stage in report["stages"].as_array().unwrap() {
            let name = stage["name"].as_str().unwrap();
            assert!(name == "report page" || text.contains(name), "{name}");
        }
        let row = |name: &str| {
            let rows: Vec<Vec<&str>> =
                all(page, "tr").map(|tr| tr.children().filter_map(|cell| cell.text()).collect()).collect();
            rows.into_iter().find(|row| row[0] == name).unwrap().join("; ")
        };
        assert_eq!(row("max steps"), "max steps; 30; given");
        assert_eq!(row("omega"), "omega; 1.2; default");
        assert!(row("tau").contains("automatic: half of the smallest spacing"), "{}", row("tau"));
        assert!(row("mark next").contains("slice "), "{}", row("mark next"));
        let warnings = || all(page, "p").filter(|p| p.attribute("class") == Some("warning"));
        assert_eq!(warnings().count(), report["notes"].as_array().unwrap().len());
    });
    counts_all_marks(&report["result"], marks.lines().count() as u64 - 1);
}

fn counts_all_marks(result: &Value, marks: u64) {
    let counts = result["distances"]["counts"].as_array().unwrap();
    assert_eq!(counts.iter().map(|n| n.as_u64().unwrap()).sum::<u64>(), marks);
    let end = result["distances"]["bin_width"].as_f64().unwrap() * counts.len() as f64;
    assert!((end / result["hausdorff"]["max"].as_f64().unwrap() - 1.0).abs() < 1e-12);
    let residuals = result["residuals"].as_array().unwrap();
    assert_eq!(residuals.len() as u64, result["time_steps"].as_u64().unwrap());
    assert_eq!(residuals.last(), Some(&result["residual"]));
}

#[test]
fn other_runs_show_what_they_have() {
    let bench = Bench::bare();
    balls(&bench);
    for (run, expected) in [
        ("distance a.xyz b.xyz --spacing 0.25 --labels", [3, 0]),
        ("distance a.xyz --spacing 0.5 --precision f16 --max-distance 1", [3, 0]),
        ("middle a.xyz b.xyz --spacing 0.25", [5, 0]),
        ("middle a.xyz b.xyz --spacing 0.5 --ome 0.4", [5, 0]),
        ("reconstruct a.xyz", [5, 2]),
    ] {
        bench.succeed(&format!("{run} -o out/x.zarr --overwrite -q"));
        with_page(&bench, "out/x.zarr", |page| {
            assert_eq!(figures(page), expected, "{run}");
            let text = text(page);
            assert!(text.contains(&format!("strandline {run} -o out/x.zarr")), "{text}");
            assert!(!run.contains("max") || text.contains("given"), "{text}");
        });
    }
    counts_all_marks(&bench.json("out/x.zarr/report.json")["result"], 300);
}

/// What a file is called is text, and no part of the page.
#[test]
fn hostile_names_stay_text() {
    let bench = Bench::bare();
    balls(&bench);
    let name = "a<svg<onload=alert(1)>&amp;'\"\u{1}<img>.xyz";
    fs::copy(bench.path("a.xyz"), bench.path(name)).unwrap();
    bench.succeed(&format!("distance {name} --spacing 0.5 -o out/x.zarr -q"));
    with_page(&bench, "out/x.zarr", |page| {
        assert_eq!(figures(page), [3, 0]);
        assert!(text(page).contains(&name.replace('\u{1}', "\u{fffd}")), "{}", text(page));
        assert!(all(page, "title").next().unwrap().text().unwrap().contains("<svg<onload=alert(1)>&amp;'\""));
        // What is copied from there is one word to a shell.
        let command = all(page, "pre").next().unwrap().text().unwrap();
        assert!(command.contains("'a<svg<onload=alert(1)>&amp;'\\''\""), "{command}");
    });
}

/// Several objects are shown each, and pictures and plots are the same for any number of threads.
#[test]
fn objects_have_their_own_views_and_runs_the_same_figures() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    bench.write("marks.csv", &format!("{HEADER}{}{}", ball.marks(1), ball.marks(4)));
    let shown = [1, 3].map(|threads| {
        bench
            .succeed(&format!("segment image.tif --points marks.csv -o out/x.zarr --overwrite -q --threads {threads}"));
        with_page(&bench, "out/x.zarr", |page| {
            assert_eq!(figures(page), [7, 3]);
            assert!(["Object 1", "Object 4"].iter().all(|name| all(page, "h3").any(|h3| h3.text() == Some(name))));
            let pictures: Vec<String> =
                all(page, "img").map(|image| image.attribute("src").unwrap().to_owned()).collect();
            let plots: Vec<String> = all(page, "svg").map(|svg| page.input_text()[svg.range()].to_owned()).collect();
            (pictures, plots)
        })
    });
    assert!(shown[0] == shown[1]);
}
