//! What a batch tells of items that it did not run, or of which it lost what it knew; in logs, rows and pages.

#![allow(clippy::unwrap_used)]

use std::fs;

use serde_json::Value;

use crate::batch::{LIST, batch, bench, rows};

#[test]
fn a_log_of_others_stays() {
    let bench = bench(&["a", "b"], LIST);
    fs::create_dir_all(bench.path("out")).unwrap();
    bench.write("out/a.log", "mine");
    for _ in 0..2 {
        assert_eq!(batch(&bench, "").0, 3);
        assert_eq!(fs::read_to_string(bench.path("out/a.log")).unwrap(), "mine");
    }
}

#[test]
fn an_item_that_is_refused_says_so_in_its_log_and_its_row() {
    let bench = bench(&["a", "b"], LIST);
    bench.write("in/b.csv", "object,contour,x,y,z\n1,0,one,2,3\n");
    for _ in 0..2 {
        assert_eq!(batch(&bench, "").0, 3);
        let reason = rows(&bench, "summary")["b"]["reason"].as_str().unwrap().to_string();
        assert!(reason.contains("in/b.csv"), "{reason}");
        assert_eq!(fs::read_to_string(bench.path("out/b.log")).unwrap(), format!("strandline: {reason}\n"));
        let page = fs::read_to_string(bench.path("out/summary.html")).unwrap();
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        let page = roxmltree::Document::parse_with_options(&page, options).unwrap();
        let row = page.descendants().rfind(|node| node.has_tag_name("tr")).unwrap();
        let told: String = row.descendants().filter_map(|node| node.is_text().then(|| node.text()).flatten()).collect();
        assert!(told.starts_with('b') && told.contains(&reason), "{told}");
    }
    fs::copy(bench.path("marks.csv"), bench.path("in/b.csv")).unwrap();
    assert_eq!(batch(&bench, "").0, 0);
    assert!(fs::read_to_string(bench.path("out/b.log")).unwrap().starts_with("$ strandline segment"));
}

#[test]
fn a_record_that_cannot_be_read_is_told_until_it_is_removed() {
    let bench = bench(&["a", "b"], LIST);
    assert_eq!(batch(&bench, "").0, 0);
    bench.write("out/.batch/a.json", "{ cut off");
    for _ in 0..2 {
        let (code, said, ran) = batch(&bench, "");
        assert_eq!((code, ran), (3, vec!["a".into()]), "{said}");
        bench.run("batch jobs.toml -o out --summary");
        let reason = rows(&bench, "summary")["a"]["reason"].as_str().unwrap().to_string();
        assert!(reason.starts_with("out/.batch/a.json cannot be read, so it is not known whether"), "{reason}");
        assert!(reason.ends_with("; remove these three, and the item runs anew"), "{reason}");
    }
    for name in ["out/.batch/a.json", "out/a.log"] {
        fs::remove_file(bench.path(name)).unwrap();
    }
    fs::remove_dir_all(bench.path("out/a.zarr")).unwrap();
    assert_eq!(batch(&bench, "").2, ["a"]);
    // With nothing beside it a record that is lost is none.
    bench.write("out/.batch/a.json", "");
    fs::remove_file(bench.path("out/a.log")).unwrap();
    fs::remove_dir_all(bench.path("out/a.zarr")).unwrap();
    assert_eq!(batch(&bench, "").0, 0);
}

#[test]
fn an_item_of_one_time_tells_which() {
    let bench = bench(
        &["a", "b"],
        "[defaults]\ncommand = \"segment\"\npoints = \"in/{stem}.csv\"\nmax_steps = 3\n\n[[items]]\nimages = \"in/a.tif\"\ntime = 0\n\n[[items]]\nimages = \"in/b.tif\"\n",
    );
    assert_eq!(batch(&bench, "").0, 0);
    let found = rows(&bench, "summary");
    assert_eq!((&found["a"]["time"], &found["b"]["time"]), (&Value::from(0), &Value::Null));
}
