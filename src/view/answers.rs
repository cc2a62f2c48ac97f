//! What each path of the server answers: the page at `/`, the files of stores at `/data/NAME/...`, meshes at `/mesh`, the page's
//! state at `/state.json`, surfaces that still move at `/growing`, and how far a store that is still written is at `/live.json`.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;

use axum::Router;
use axum::body::Body;
use axum::extract::{Path, RawQuery, Request, State};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{Method, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use flate2::read::GzDecoder;
use serde_json::{Map, Value, json};
use tokio::io::AsyncReadExt;
use tokio_util::io::ReaderStream;

use super::choice::{Chosen, asked, choices};
use super::folder::Opened;
use super::ranges::{Asked, Part, part};
use super::shown::{Drawn, MeshFile, Shown};
use super::site::{Now, Site};
use super::{mesh, page, told};
use crate::io::geometry::write::precomputed;
use crate::io::ome_zarr::{Live, LiveState};

/// Bytes of a file that are in memory at a time, of each request.
const PIECE: usize = 64 << 10;
/// What a page of a store may do.
const PAGE_POLICY: &str = "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'";
/// Metres where nobody says what a unit of length is: the page takes the numbers as they are.
const NO_UNIT: f64 = 1.0;

/// The answers for what is shown.
pub(super) fn router(shown: Shown) -> Router {
    let site = Arc::new(Site::new(shown));
    Router::new()
        .route("/", get(|headers: HeaderMap| async move { page_file("", &headers) }))
        .route("/state.json", get(page_state))
        .route("/live.json", get(live))
        .route("/mesh/{name}", get(mesh_part))
        .route("/mesh/segment_properties/info", get(mesh_names))
        .route("/growing/{moved}/{name}", get(growing_part))
        .route("/data/{*path}", get(data))
        .route("/{name}", get(|Path(name): Path<String>, headers: HeaderMap| async move { page_file(&name, &headers) }))
        .layer(middleware::from_fn(open_to_all))
        .with_state(site)
}

/// Looks at what is shown, where that does not hold up other answers.
async fn looked_at(site: Arc<Site>) -> Arc<Now> {
    let before = site.now();
    tokio::task::spawn_blocking(move || site.looked_at()).await.unwrap_or(before)
}

/// What is told of what is shown, seen from the store that a request asks for.
async fn told_of(site: Arc<Site>, query: Option<String>, tell: fn(&Now, &Chosen<'_>) -> String) -> Response {
    let told = move || {
        let now = site.looked_at();
        let asked = asked(query.as_deref());
        tell(&now, &Chosen::new(&now.shown, asked.as_deref()))
    };
    match tokio::task::spawn_blocking(told).await {
        Ok(told) => of_type("application/json", told),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

async fn page_state(State(site): State<Arc<Site>>, RawQuery(query): RawQuery) -> Response {
    told_of(site, query, |now, chosen| now.state(chosen).to_string()).await
}

async fn live(State(site): State<Arc<Site>>, RawQuery(query): RawQuery) -> Response {
    told_of(site, query, live_state).await
}

/// Pages of other origins may read what is shown, as a neuroglancer elsewhere does; nothing can be changed here.
async fn open_to_all(request: Request, next: Next) -> Response {
    let mut answer = match *request.method() {
        Method::OPTIONS => StatusCode::NO_CONTENT.into_response(),
        _ => next.run(request).await,
    };
    let headers = answer.headers_mut();
    for (name, value) in [
        (header::ACCESS_CONTROL_ALLOW_ORIGIN, "*"),
        (header::ACCESS_CONTROL_ALLOW_HEADERS, "range, if-none-match, if-range"),
        (header::ACCESS_CONTROL_ALLOW_METHODS, "GET, HEAD, OPTIONS"),
        (header::ACCESS_CONTROL_EXPOSE_HEADERS, "content-range, content-length, etag, accept-ranges"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    answer
}

fn of_type(media_type: &'static str, body: impl Into<Body>) -> Response {
    ([(header::CONTENT_TYPE, media_type), (header::CACHE_CONTROL, "no-cache")], body.into()).into_response()
}

fn page_file(name: &str, headers: &HeaderMap) -> Response {
    let Some(file) = page::file(name) else { return StatusCode::NOT_FOUND.into_response() };
    if text(headers, &header::ACCEPT_ENCODING).is_some_and(|accepted| accepted.contains("gzip")) {
        let mut answer = of_type(file.media_type, file.packed);
        answer.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
        return answer;
    }
    let mut unpacked = Vec::new();
    match GzDecoder::new(file.packed).read_to_end(&mut unpacked) {
        Ok(_) => of_type(file.media_type, unpacked),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

fn text<'h>(headers: &'h HeaderMap, name: &HeaderName) -> Option<&'h str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

/// What the page is of, which store it shows of which, and what there is to say of it, how far the stores are that are still written, a number that grows with what is
/// written, one that is another when there is something else to show, and one for each store that is another when that is.
fn live_state(now: &Now, chosen: &Chosen<'_>) -> String {
    let states: Vec<Live> = now.shown.live().collect();
    let running = states.iter().filter(|live| live.state == LiveState::Running);
    let share = running.clone().map(|live| live.done).fold(1.0, f64::min);
    let words = match running.count() {
        0 if now.is_cut_short => format!("{} is gone: it was taken away while it was written", now.shown.name),
        0 if now.is_gone => format!("{} is gone", now.shown.name),
        0 if states.iter().any(|live| live.state == LiveState::Interrupted) => {
            "interrupted before it was complete".into()
        }
        0 => String::new(),
        1 => format!("running, {:.0} % done", 100.0 * share),
        several => format!("{several} stores are written, {:.0} % done", 100.0 * share),
    };
    let written: u64 = states.iter().map(|live| live.written).sum();
    let mut hasher = DefaultHasher::new();
    now.state(chosen).hash(&mut hasher);
    let shown = format!("{:x}", hasher.finish());
    let stores: Map<String, Value> =
        now.present.iter().map(|store| (store.name.clone(), format!("{:x}", store.number).into())).collect();
    let answer = json!({
        "name": now.shown.name, "store": chosen.root, "choices": choices(&now.shown),
        "reports": told::links(chosen), "notes": told::notes(chosen),
        "running": now.is_live, "gone": now.is_gone, "text": words,
        "written": written, "shown": shown, "stores": stores,
    });
    answer.to_string()
}

async fn mesh_part(State(site): State<Arc<Site>>, Path(name): Path<String>) -> Response {
    let now = looked_at(site).await;
    part_of_mesh(&now.shown, &now.shown.meshes, &name).await
}

async fn growing_part(State(site): State<Arc<Site>>, Path((_moved, name)): Path<(String, String)>) -> Response {
    let now = looked_at(site).await;
    part_of_mesh(&now.shown, &now.shown.growing.0, &name).await
}

async fn part_of_mesh(shown: &Shown, meshes: &[MeshFile], name: &str) -> Response {
    if name == "info" {
        return of_type("application/json", precomputed::info(&names(meshes)).to_string());
    }
    let numbered = |digits: &str| {
        let segment: u64 = digits.parse().ok()?;
        meshes.iter().find(|mesh| mesh.segment == segment)
    };
    if let Some(mesh) = name.strip_suffix(":0").and_then(numbered) {
        return of_type("application/json", json!({ "fragments": [mesh.segment.to_string()] }).to_string());
    }
    let Some(mesh_file) = numbered(name) else { return StatusCode::NOT_FOUND.into_response() };
    let metres = shown.axes_at(&mesh_file.path).iter().find_map(|axis| axis.metres).unwrap_or(NO_UNIT);
    let drawn = mesh_file.drawn.clone();
    let read = move || match drawn {
        Drawn::Fragment(file) => std::fs::read(file).ok(),
        Drawn::Mesh(file) => mesh::fragment(&file, metres).ok(),
    };
    match tokio::task::spawn_blocking(read).await {
        Ok(Some(bytes)) => of_type("application/octet-stream", bytes),
        _ => StatusCode::NOT_FOUND.into_response(),
    }
}

/// What segments are called that are no objects.
fn names(meshes: &[MeshFile]) -> Vec<(u64, String)> {
    meshes.iter().filter_map(|mesh| Some((mesh.segment, mesh.name.clone()?))).collect()
}

async fn mesh_names(State(site): State<Arc<Site>>) -> Response {
    let now = looked_at(site).await;
    of_type("application/json", precomputed::properties(&names(&now.shown.meshes)).to_string())
}

/// A file of a store, or a part of it.
async fn data(State(site): State<Arc<Site>>, request: Request) -> Response {
    // The path as it was sent: it is decoded once, where it is checked.
    let path = request.uri().path().strip_prefix("/data/").unwrap_or_default().to_owned();
    let headers = request.headers().clone();
    let opened = tokio::task::spawn_blocking(move || {
        let shown = &site.now().shown;
        let Some((name, inside)) = path.split_once('/') else {
            // Of what lies beside stores one page alone.
            return shown.beside.as_ref().filter(|_| path == told::BATCH)?.open(&path);
        };
        let name = percent_encoding::percent_decode_str(name).decode_utf8().ok()?;
        shown.roots.iter().find(|(root, _)| *root == name)?.1.open(inside)
    });
    match opened.await {
        Ok(Some(opened)) => part_of(opened, &headers),
        // It may be there the next time.
        _ => (StatusCode::NOT_FOUND, [(header::CACHE_CONTROL, "no-store")]).into_response(),
    }
}

fn part_of(opened: Opened, headers: &HeaderMap) -> Response {
    let Opened { mut file, length, tag, media_type } = opened;
    let asked = Asked {
        range: text(headers, &header::RANGE),
        if_range: text(headers, &header::IF_RANGE),
        if_none_match: text(headers, &header::IF_NONE_MATCH),
    };
    let (status, from, to) = match part(asked, length, &tag) {
        Part::Whole => (StatusCode::OK, 0, length),
        Part::Bytes(from, to) => (StatusCode::PARTIAL_CONTENT, from, to),
        Part::Unchanged => return (StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response(),
        Part::Outside => {
            return (StatusCode::RANGE_NOT_SATISFIABLE, [(header::CONTENT_RANGE, format!("bytes */{length}"))])
                .into_response();
        }
    };
    if from > 0 && file.seek(SeekFrom::Start(from)).is_err() {
        return StatusCode::NOT_FOUND.into_response();
    }
    let stream = ReaderStream::with_capacity(tokio::fs::File::from_std(file).take(to - from), PIECE);
    let mut answer = (status, of_type(media_type, Body::from_stream(stream))).into_response();
    let own = answer.headers_mut();
    own.insert(header::CONTENT_LENGTH, HeaderValue::from(to - from));
    own.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    // A page in a store, as its report is, may have come from elsewhere: it shows itself, and neither runs nor asks for anything.
    own.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(PAGE_POLICY));
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        own.insert(header::ETAG, tag);
    }
    if status == StatusCode::PARTIAL_CONTENT
        && let Ok(range) = HeaderValue::from_str(&format!("bytes {from}-{}/{length}", to - 1))
    {
        own.insert(header::CONTENT_RANGE, range);
    }
    answer
}
