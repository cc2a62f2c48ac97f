//! `strandline view` as a client sees it: the files of a store byte for byte, in whole and in parts, none outside of it, and a
//! state of the page whose sources are there.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};

use crate::common::ball::{Ball, Bench};
use crate::common::patience::{PATIENCE, wait_until};
use crate::common::random::Random;

/// A server of its own, ended when it is dropped.
pub(crate) struct Served {
    child: Child,
    address: String,
}

impl Served {
    pub(crate) fn new(bench: &Bench, what: &str) -> Self {
        let mut child =
            bench.command(&format!("view {what} --no-open --for 5min")).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().trim_end_matches('/').strip_prefix("http://").unwrap().to_owned();
        Self { child, address }
    }

    /// Sends what may be no request at all.
    fn send(&self, bytes: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.write_all(bytes).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        Answer::of(&answer)
    }

    fn ask(&self, method: &str, path: &str, headers: &str) -> Answer {
        self.send(
            format!("{method} {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{headers}\r\n", self.address)
                .as_bytes(),
        )
    }

    pub(crate) fn get(&self, path: &str) -> Answer {
        self.ask("GET", path, "")
    }

    pub(crate) fn json(&self, path: &str) -> serde_json::Value {
        serde_json::from_slice(&self.get(path).body).unwrap()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) code: u16,
    head: String,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    fn of(bytes: &[u8]) -> Self {
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").unwrap_or(bytes.len());
        let head = String::from_utf8_lossy(&bytes[..end]).to_ascii_lowercase();
        let code = head.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or(0);
        Self { code, head, body: bytes.get(end + 4..).unwrap_or_default().to_vec() }
    }

    fn header(&self, name: &str) -> Option<&str> {
        self.head.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(": "))
    }
}

/// A store of all that `segment` writes.
fn store() -> Bench {
    let bench = Bench::new(&Ball::small());
    bench.succeed("segment image.tif --points marks.csv -q -o out/ball.zarr");
    bench
}

#[test]
fn files_are_those_of_the_store_in_whole_and_in_parts() {
    let bench = store();
    let served = Served::new(&bench, "out/ball.zarr");
    let path = "/data/ball.zarr/meshes/surface.ply";
    let bytes = fs::read(bench.path("out/ball.zarr/meshes/surface.ply")).unwrap();
    let whole = served.get(path);
    assert_eq!((whole.code, whole.body == bytes), (200, true), "{}", whole.head);
    let mut random = Random(11);
    for _ in 0..200 {
        let (from, to) = (random.below(bytes.len()), random.below(2 * bytes.len()));
        let (text, expected) = match random.below(3) {
            0 => (format!("bytes={from}-"), &bytes[from..]),
            1 => (format!("bytes=-{}", from + 1), &bytes[bytes.len() - from - 1..]),
            _ if to < from => continue,
            _ => (format!("bytes={from}-{to}"), &bytes[from..bytes.len().min(to + 1)]),
        };
        let part = served.ask("GET", path, &format!("Range: {text}\r\n"));
        assert_eq!((part.code, part.body == expected), (206, true), "{text}: {}", part.head);
        let start = bytes.len() - expected.len();
        if !text.ends_with(&to.to_string()) {
            let range = format!("bytes {start}-{}/{}", bytes.len() - 1, bytes.len());
            assert_eq!(part.header("content-range"), Some(range.as_str()));
        }
    }
    assert_eq!(served.ask("GET", path, &format!("Range: bytes={}-\r\n", bytes.len())).code, 416);
    let head = served.ask("HEAD", path, "");
    assert_eq!(
        (head.code, head.body.len(), head.header("content-length")),
        (200, 0, Some(bytes.len().to_string().as_str()))
    );
    let tag = whole.header("etag").unwrap();
    assert_eq!(served.ask("GET", path, &format!("If-None-Match: {tag}\r\n")).code, 304);
    assert_eq!(served.ask("OPTIONS", path, "").header("access-control-allow-origin"), Some("*"));
    assert_eq!(served.ask("DELETE", path, "").code, 405);
    assert_eq!(served.get("/data/ball.zarr/0/c/9/9/9").code, 404);
}

#[test]
fn nothing_outside_of_the_store_is_answered() {
    let bench = store();
    bench.write("secret", "secret");
    #[cfg(unix)]
    std::os::unix::fs::symlink(bench.path("secret"), bench.path("out/ball.zarr/link")).unwrap();
    let served = Served::new(&bench, "out/ball.zarr");
    for path in [
        "/data/ball.zarr/../../secret",
        "/data/ball.zarr/%2e%2e/%2e%2e/secret",
        "/data/ball.zarr/..%2f..%2fsecret",
        "/data/ball.zarr/%252e%252e/secret",
        "/data/ball.zarr//etc/passwd",
        "/data//etc/passwd",
        "/data/..",
        "/data/ball.zarr/link",
        "/data/ball.zarr/",
        "/data/ball.zarr/meshes",
        "/data/ball.zarr/%00",
        "/data/ball.zarr/a\\..\\..\\secret",
        "/../secret",
        "/mesh/../secret",
        "/mesh/99",
    ] {
        let answer = served.get(path);
        assert!([400, 404].contains(&answer.code), "{path}: {}", answer.head);
        assert!(!answer.body.windows(6).any(|six| six == b"secret"), "{path}");
    }
    for odd in [&b"GARBAGE\r\n\r\n"[..], b"GET / HTTP/9.9\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n"] {
        assert!([0, 400, 505].contains(&served.send(odd).code));
    }
    let large = format!("GET / HTTP/1.1\r\nHost: a\r\nX: {}\r\n\r\n", "a".repeat(1 << 17));
    let _ = TcpStream::connect(&served.address).unwrap().write_all(large.as_bytes());
    assert_eq!(served.get("/").code, 200);
}

#[test]
fn the_page_finds_all_that_its_state_names() {
    let bench = store();
    let served = Served::new(&bench, "out");
    let page = served.get("/");
    assert!(page.code == 200 && String::from_utf8_lossy(&page.body).contains("main.js"), "{}", page.head);
    for name in ["main.js", "main.css", "chunk_worker.bundle.js", "async_computation.bundle.js"] {
        let (plain, packed) =
            (served.get(&format!("/{name}")), served.ask("GET", &format!("/{name}"), "Accept-Encoding: gzip\r\n"));
        assert_eq!((plain.code, packed.header("content-encoding")), (200, Some("gzip")), "{name}");
        let mut unpacked = Vec::new();
        flate2::read::GzDecoder::new(&packed.body[..]).read_to_end(&mut unpacked).unwrap();
        assert!(unpacked == plain.body, "{name}");
    }
    let state = served.json("/state.json");
    let layers = state["layers"].as_array().unwrap();
    let names: Vec<&str> = layers.iter().map(|layer| layer["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["image", "segmentation", "distance", "levelset", "surfaces", "marks"]);
    let marks = layers[5]["annotations"].as_array().unwrap();
    assert_eq!(marks.len(), fs::read_to_string(bench.path("marks.csv")).unwrap().lines().count() - 1);
    assert_eq!(layers[5]["source"]["transform"]["outputDimensions"]["x"], serde_json::json!([1e-6, "m"]));
    for layer in &layers[..5] {
        let url = layer["source"]["url"].as_str().unwrap();
        let metadata = match url.strip_suffix("|zarr3:") {
            Some(folder) => format!("{folder}zarr.json"),
            None => format!("{}/info", url.strip_prefix("precomputed://").unwrap()),
        };
        assert_eq!(served.get(&metadata).code, 200, "{metadata}");
    }
    // 40 x 36 x 20 voxels of 0.5, 0.5 and 1 micrometer.
    assert_eq!(state["position"], serde_json::json!([20.0, 18.0, 10.0]));
    assert_eq!(state["dimensions"]["z"], serde_json::json!([1e-6, "m"]));
    assert_eq!(served.json("/live.json")["running"], false);
}

/// Names that mean something in addresses, and several stores, of which the first one is seen.
#[test]
fn stores_of_any_name_are_shown_apart() {
    let bench = store();
    let odd = "50% #2|a?b%20.zarr";
    fs::rename(bench.path("out/ball.zarr"), bench.path("out").join(odd)).unwrap();
    bench.succeed("distance marks.csv --like image.tif -q -o out/z.zarr");
    fs::copy(bench.path("out").join(odd).join("meshes/surface.ply"), bench.path("out/beside.ply")).unwrap();
    let served = Served::new(&bench, "out");
    let state = served.json("/state.json");
    let layers = state["layers"].as_array().unwrap();
    let seen = |layer: &serde_json::Value| layer["visible"].as_bool().unwrap();
    let names: Vec<(&str, bool)> = layers.iter().map(|layer| (layer["name"].as_str().unwrap(), seen(layer))).collect();
    let of_odd = |name: &str| format!("50% #2|a?b%20 {name}");
    let [image, labels, distance, surfaces, marks] =
        ["image", "segmentation", "distance", "surfaces", "marks"].map(of_odd);
    for wanted in [(image.as_str(), true), (&labels, true), (&distance, false), (&surfaces, true), (&marks, true)] {
        assert!(names.contains(&wanted), "{wanted:?} in {names:?}");
    }
    assert!(names.contains(&("z distance", false)) && names.contains(&("beside.ply", false)), "{names:?}");
    let sources = layers.iter().filter_map(|layer| layer["source"]["url"].as_str()?.strip_suffix("|zarr3:"));
    let sources: Vec<&str> = sources.collect();
    assert!(sources.len() > 4);
    for source in sources {
        assert!(!source.contains(['#', '?', '|', ' ']), "{source}");
        assert_eq!(served.get(&format!("{source}zarr.json")).code, 200, "{source}");
    }
    let told = bench.succeed("view out --no-open --for 1s --print-links");
    assert!(told.contains("/50%25%20%232%7Ca%3Fb%2520.zarr/|zarr3:") && told.contains(&format!("{odd}'")), "{told}");
    assert!(!told.contains("Fiji"), "these read version 0.4 alone: {told}");
}

/// A page of a mesh alone looks at that, in its own numbers.
#[test]
fn a_mesh_alone_fills_the_page() {
    let bench = store();
    fs::copy(bench.path("out/ball.zarr/meshes/surface.ply"), bench.path("ball.ply")).unwrap();
    let state = Served::new(&bench, "ball.ply").json("/state.json");
    let (ball, unit) = (Ball::small(), state["dimensions"]["x"][0].as_f64().unwrap());
    for a in 0..3 {
        let at = unit * state["position"][a].as_f64().unwrap();
        assert!((at - ball.centre[a]).abs() < 1.0, "{state}");
    }
    let wide = unit * state["projectionScale"].as_f64().unwrap();
    assert!(wide > 2.0 * ball.radius && wide < 6.0 * ball.radius, "{wide}");
    assert_eq!((&state["dimensions"]["x"][1], &state["showScaleBar"]), (&"".into(), &false.into()));
}

/// The mesh of the page against the file that it was made of.
#[test]
fn meshes_are_those_of_the_store_in_nanometres() {
    let bench = store();
    let served = Served::new(&bench, "out/ball.zarr");
    assert_eq!(served.json("/mesh/1:0"), serde_json::json!({ "fragments": ["1"] }));
    let fragment = served.get("/mesh/1").body;
    let word = |n: usize| <[u8; 4]>::try_from(&fragment[4 * n..4 * n + 4]).unwrap();
    let count = u32::from_le_bytes(word(0)) as usize;
    let measured: serde_json::Value =
        serde_json::from_str(&bench.succeed("measure out/ball.zarr/meshes/surface.ply --json")).unwrap();
    assert_eq!(measured["vertices"], count);
    assert_eq!(measured["triangles"], (fragment.len() / 4 - 1 - 3 * count) / 3);
    let positions: Vec<f64> = (1..=3 * count).map(|n| f64::from(f32::from_le_bytes(word(n)))).collect();
    // The ball's radius in nanometres.
    let ball = Ball::small();
    for p in positions.chunks_exact(3) {
        let away = (0..3).map(|a| (p[a] - 1000.0 * ball.centre[a]).powi(2)).sum::<f64>().sqrt();
        assert!((away - 1000.0 * ball.radius).abs() < 1000.0, "{p:?}");
    }
}

/// What a store has ready is served as it is; without that the page gets the same of its PLY.
#[test]
fn meshes_that_are_ready_are_those_made_on_request() {
    let bench = store();
    let ready = bench.path("out/ball.zarr/meshes/precomputed");
    let served = Served::new(&bench, "out/ball.zarr").get("/mesh/1").body;
    assert!(served == fs::read(ready.join("1")).unwrap() && served.len() > 10_000);
    fs::remove_dir_all(ready).unwrap();
    let made = Served::new(&bench, "out/ball.zarr");
    assert_eq!(made.json("/mesh/info"), serde_json::json!({ "@type": "neuroglancer_legacy_mesh" }));
    assert!(made.get("/mesh/1").body == served);
}

#[test]
fn pairs_of_labels_are_meshes_in_colours_of_their_own() {
    let bench = Bench::bare();
    for (name, x, y) in [("a", 0.0, 0.0), ("b", 1.0, 0.0), ("c", 0.5, 1.0)] {
        bench.write(&format!("{name}.xyz"), &format!("{x} {y} 0\n{x} {y} 0.1\n"));
    }
    bench.succeed("middle a.xyz b.xyz c.xyz --spacing 0.05 --padding 0.4 -q -o out/m.zarr");
    // A copy with fewer triangles is no surface of its own.
    fs::create_dir(bench.path("out/m.zarr/meshes/simplified")).unwrap();
    fs::copy(bench.path("out/m.zarr/meshes/surface.ply"), bench.path("out/m.zarr/meshes/simplified/surface.ply"))
        .unwrap();
    let served = Served::new(&bench, "out/m.zarr");
    let state = served.json("/state.json");
    let layers = state["layers"].as_array().unwrap();
    let surfaces = layers.iter().find(|layer| layer["name"] == "surfaces").unwrap();
    assert_eq!(surfaces["segments"], serde_json::json!(["1", "2", "3"]));
    let labels = layers.iter().find(|layer| layer["name"] == "nearest").unwrap();
    let colors = |layer: &serde_json::Value| -> Vec<String> {
        layer["segmentColors"].as_object().unwrap().values().map(ToString::to_string).collect()
    };
    let (of_pairs, of_labels) = (colors(surfaces), colors(labels));
    assert!(
        of_pairs.len() == 3 && of_pairs.iter().all(|color| !of_labels.contains(color)),
        "{of_pairs:?} {of_labels:?}"
    );
    let info = served.json("/mesh/info");
    let names = served.json(&format!("/mesh/{}/info", info["segment_properties"].as_str().unwrap()));
    assert_eq!(names["inline"]["properties"][0]["values"], serde_json::json!(["1 | 2", "1 | 3", "2 | 3"]));
    for segment in 1..=3 {
        assert_eq!(served.json(&format!("/mesh/{segment}:0"))["fragments"][0], segment.to_string());
        let ready = fs::read(bench.path(&format!("out/m.zarr/meshes/precomputed/{segment}"))).unwrap();
        assert!(served.get(&format!("/mesh/{segment}")).body == ready);
    }
    assert_eq!(served.get("/mesh/4").code, 404);
}

#[test]
fn what_cannot_be_shown_is_refused_and_the_time_ends() {
    let bench = Bench::bare();
    assert!(bench.fail("view out --no-open", 2).contains("holds nothing that can be shown"));
    assert!(bench.fail("view none.zarr --no-open", 2).contains("none.zarr"));
    fs::create_dir(bench.path("broken.zarr")).unwrap();
    bench.write("broken.zarr/zarr.json", "{\"zarr_format\": 3,");
    let told = bench.fail("view broken.zarr --no-open", 2);
    assert!(told.contains("broken.zarr/zarr.json: is no JSON: "), "{told}");
    let axis = |name: &str| serde_json::json!({ "name": name, "type": "space" });
    let levels =
        serde_json::json!([{ "path": "0", "coordinateTransformations": [{ "type": "scale", "scale": [1, 0, 1] }] }]);
    let axes = ["z", "y", "x"].map(axis);
    let ome = serde_json::json!({ "version": "0.5", "multiscales": [{ "axes": axes, "datasets": levels }] });
    fs::create_dir_all(bench.path("flat.zarr/0")).unwrap();
    bench.write("flat.zarr/0/zarr.json", r#"{"shape": [4, 4, 4], "data_type": "uint8"}"#);
    bench.write(
        "flat.zarr/zarr.json",
        &serde_json::json!({ "zarr_format": 3, "attributes": { "ome": ome } }).to_string(),
    );
    assert!(bench.fail("view flat.zarr --no-open", 2).contains("holds nothing that can be shown"), "no spacing");
    bench.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert!(bench.succeed("view a.obj --no-open --for 1s --print-links").contains("precomputed://http://127.0.0.1:"));
}

/// A port that somebody has, and times without an end.
#[test]
fn ports_in_use_are_told_and_no_time_is_too_long() {
    let bench = Bench::bare();
    bench.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let told = bench.fail(&format!("view a.obj --no-open --port {port}"), 1);
    assert!(told.contains(&format!("port {port} is in use; give another --port")), "{told}");
    let mut child =
        bench.command("view a.obj --no-open --for 500000000000years").stdout(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    let served = Served { address: line.trim().trim_end_matches('/').strip_prefix("http://").unwrap().into(), child };
    assert_eq!(served.get("/").code, 200);
}

/// A run that is killed before there is anything to see, and a store that is taken away, are not told as running.
#[test]
fn runs_that_have_ended_are_not_running() {
    for (is_taken, word) in [(false, "interrupted before"), (true, "taken away")] {
        let bench = Bench::bare();
        bench.write("points.xyz", "0 0 0\n1 0 0\n0 1 0\n");
        let run = "distance points.xyz --origin=-1,-1,-1 --spacing 0.005 --shape 600,600,600 --live -q -o out.zarr";
        let mut run = bench.command(run).stderr(Stdio::null()).spawn().unwrap();
        wait_until("a store", || bench.path("out.zarr/zarr.json").is_file());
        let served = Served::new(&bench, "out.zarr");
        assert_eq!(served.json("/live.json")["running"], true);
        run.kill().unwrap();
        run.wait().unwrap();
        if is_taken {
            fs::remove_dir_all(bench.path("out.zarr")).unwrap();
        }
        wait_until(word, || served.json("/live.json")["running"] == false);
        let told = served.json("/live.json");
        assert!(told["text"].as_str().unwrap().contains(word), "{told}");
    }
}

#[test]
fn the_report_of_a_run_is_served_and_asks_for_nothing() {
    let bench = store();
    let told = bench.succeed("view out/ball.zarr --no-open --for 1s --print-links");
    assert!(
        told.lines().any(|line| line.starts_with("report") && line.ends_with("/data/ball.zarr/report.html")),
        "{told}"
    );
    let served = Served::new(&bench, "out/ball.zarr");
    for path in ["/data/ball.zarr/report.html", "/data/ball%2Ezarr/report.html"] {
        let page = served.get(path);
        assert_eq!((page.code, page.header("content-type")), (200, Some("text/html; charset=utf-8")));
        assert!(page.header("content-security-policy").unwrap().starts_with("sandbox; default-src 'none'"));
        assert!(page.body == fs::read(bench.path("out/ball.zarr/report.html")).unwrap());
    }
}
