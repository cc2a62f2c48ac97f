//! Which of several stores a page shows: the one that its address asks for, else that of the first image. All of that has layers, those
//! of few other stores too, unseen; of many one page would hold too much.

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};

use super::described::{Image, Kind};
use super::shown::{MeshFile, Shown, root_of};

/// What stays as it is in a name that is a part of an address (RFC 3986, unreserved), and in a path.
const NAME: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'_').remove(b'.').remove(b'~');
const PATH: &AsciiSet = &NAME.remove(b'/');
/// Layers that a page's bar has room for.
const MOST_LAYERS: usize = 24;
/// Fields of a store in the bar.
const MOST_FIELDS: usize = 6;

/// What is shown, seen from one of its stores.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chosen<'s> {
    pub(super) shown: &'s Shown,
    /// The name of the store on the server.
    pub(super) root: &'s str,
}

impl<'s> Chosen<'s> {
    /// The store that is asked for; the first one with something to see where none is, or that is not there.
    pub(super) fn new(shown: &'s Shown, asked: Option<&str>) -> Self {
        let mut named = shown.roots.iter().map(|(name, _)| name.as_str());
        let root = named.find(|name| Some(*name) == asked).unwrap_or_else(|| {
            let image = shown.images.first().map(|image| root_of(&image.path));
            let mesh = || shown.meshes.iter().chain(&shown.growing.0).next().map(|mesh| root_of(&mesh.path));
            image.or_else(mesh).or(shown.roots.first().map(|(name, _)| name.as_str())).unwrap_or_default()
        });
        Self { shown, root }
    }

    /// Whether a path leads into the store.
    pub(super) fn has(&self, path: &str) -> bool {
        root_of(path) == self.root
    }

    /// Its images.
    pub(super) fn images(&self) -> impl Iterator<Item = &'s Image> {
        let root = self.root;
        self.shown.images.iter().filter(move |image| root_of(&image.path) == root)
    }

    /// Images that have layers: those of the store first.
    pub(super) fn layered(&self) -> impl Iterator<Item = &'s Image> {
        let (root, has_others) = (self.root, !self.leaves_others_out());
        let is_other = move |image: &&Image| has_others && root_of(&image.path) != root;
        self.images().chain(self.shown.images.iter().filter(is_other))
    }

    /// Whether what lies at a path has layers at all.
    pub(super) fn is_layered(&self, path: &str) -> bool {
        self.has(path) || !self.leaves_others_out() || self.is_in_no_store(path)
    }

    /// Whether a path is that of a file beside stores.
    pub(super) fn is_in_no_store(&self, path: &str) -> bool {
        !self.shown.roots.iter().any(|(root, _)| root == root_of(path))
    }

    /// Whether a layer is seen at once.
    pub(super) fn is_seen(&self, image: &Image) -> bool {
        let picture = || self.images().find(|image| image.kind == Kind::Picture);
        let is_wanted = match image.kind {
            Kind::Labels => !image.path.ends_with("/border"),
            // Of several pictures, which lie over each other, one.
            Kind::Picture => picture().is_none_or(|first| first.path == image.path),
            Kind::Field => false,
        };
        is_wanted && self.has(&image.path)
    }

    /// Whether a field waits in the list of layers alone.
    pub(super) fn is_aside(&self, image: &Image) -> bool {
        let fields = self.shown.images.iter().filter(|other| is_field_beside(other, image));
        image.kind == Kind::Field && fields.take_while(|other| other.path != image.path).count() >= MOST_FIELDS
    }

    /// Fields of the store that wait there.
    pub(super) fn fields_aside(&self) -> usize {
        self.images().filter(|image| self.is_aside(image)).count()
    }

    /// Whether there are so many stores that others have no layers.
    pub(super) fn leaves_others_out(&self) -> bool {
        // With the surfaces and marks of each.
        self.shown.images.len() + 2 * self.shown.roots.len() > MOST_LAYERS && self.shown.roots.len() > 1
    }

    /// Surfaces that still move.
    pub(super) fn growing(&self) -> impl Iterator<Item = &'s MeshFile> {
        let root = self.root;
        self.shown.growing.0.iter().filter(move |mesh| root_of(&mesh.path) == root)
    }
}

fn is_field_beside(other: &Image, image: &Image) -> bool {
    other.kind == Kind::Field && root_of(&other.path) == root_of(&image.path)
}

/// The stores among which a page may choose; none where there is one.
pub(super) fn choices(shown: &Shown) -> Vec<&str> {
    let names: Vec<&str> = shown.roots.iter().map(|(name, _)| name.as_str()).collect();
    if names.len() > 1 { names } else { Vec::new() }
}

/// The store that a request asks for, as it was sent.
pub(super) fn asked(query: Option<&str>) -> Option<String> {
    let sent = query?.split('&').find_map(|part| part.strip_prefix("store="))?;
    percent_decode_str(sent).decode_utf8().ok().map(std::borrow::Cow::into_owned)
}

/// A name as a part of an address.
pub(super) fn name_in_address(name: &str) -> String {
    utf8_percent_encode(name, NAME).to_string()
}

/// A path as a part of an address.
pub(super) fn path_in_address(path: &str) -> String {
    utf8_percent_encode(path, PATH).to_string()
}
