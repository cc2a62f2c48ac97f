//! Surfaces as they are seen from two sides, coloured by how far they are from the marks, or by how thick what they halve is.
//!
//! Triangles come from the files in the store, one by one; distances are looked up only where a pixel shows the surface. So a
//! surface costs what its file takes to be read, and a few pictures of memory.

use std::collections::BTreeMap;
use std::path::Path;

use super::evidence::{Evidence, Measure};
use super::html::Html;
use super::picture::Picture;
use crate::cli::terminal::text::number;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::io::geometry::read::ply::triangles::{READING, each_triangle, extent};
use crate::kernel::distance::features::source_trees::SourceTrees;
use crate::kernel::image::picture::camera::Camera;
use crate::kernel::image::picture::dots::dot;
use crate::kernel::image::picture::palette::label_color;
use crate::kernel::image::picture::panel::Rgb;
use crate::kernel::image::picture::ramp::Ramp;
use crate::kernel::image::picture::shading::shaded;
use crate::kernel::image::picture::z_buffer::{Seen, ZBuffer};

/// From where surfaces are seen, and what that is called.
const FROM: [([f64; 3], &str); 2] =
    [([0.55, -1.0, 0.5], "seen along y, from above"), ([-0.55, 1.0, 0.35], "seen from behind")];
/// Pixels of a picture along its sides: of a single surface, of several.
const LARGE: [usize; 2] = [440, 380];
const SMALL: [usize; 2] = [280, 250];
/// The colours end at this share of what is seen, so that a few far places do not make the others alike.
const SHARE: f64 = 0.98;
/// Sources that distances are looked up among, at most, and the bytes that each takes while they are.
const MOST_SOURCES: usize = 2_000_000;
const SOURCE_BYTES: u64 = 320;
/// Points that are drawn on a surface, at most.
const MOST_DOTS: usize = 4000;
const MARK: [u8; 3] = [255, 225, 77];
/// A point is hidden by what lies so many pixels before it.
const SLACK: f64 = 4.0;

/// A surface in the store.
pub(super) struct Surface {
    /// Its file in the store.
    pub(super) file: String,
    /// The label of the object; 0 where each triangle has labels of its own.
    pub(super) label: u32,
}

/// Two pictures of a surface, and what their colours mean.
pub(super) struct Views {
    pub(super) pictures: Vec<Picture>,
    legend: Option<Legend>,
}

struct Legend {
    ramp: Ramp,
    high: f64,
}

/// Looks at surfaces.
pub(super) struct Viewer<'a> {
    folder: &'a Path,
    evidence: &'a Evidence<'a>,
    /// None where there are no sources, or too many.
    trees: Option<SourceTrees>,
    size: [usize; 2],
}

impl<'a> Viewer<'a> {
    /// Bytes that looking takes at most.
    pub(super) fn bytes(evidence: &Evidence<'_>) -> u64 {
        let sources = if looks_up(evidence) { evidence.sources.len() as u64 * SOURCE_BYTES } else { 0 };
        // Lengths, colours and the picture, plain and packed.
        let pixels = (LARGE[0] * LARGE[1]) as u64 * (4 + 4 + 3 + 3 + 6);
        READING + sources + FROM.len() as u64 * (ZBuffer::bytes(LARGE) + pixels)
    }

    pub(super) fn new(folder: &'a Path, evidence: &'a Evidence<'a>, several: bool) -> Self {
        let trees = looks_up(evidence).then(|| SourceTrees::new(evidence.sources));
        Self { folder, evidence, trees, size: if several { SMALL } else { LARGE } }
    }

    /// What is said beside the pictures of colours that are left out.
    pub(super) fn note(&self) -> Option<String> {
        let too_many = self.trees.is_none() && !self.evidence.sources.is_empty();
        too_many.then(|| "There are too many sources to colour the surface by distances from them.".into())
    }

    /// The surface from both sides.
    ///
    /// # Errors
    /// When its file cannot be read, or the run is interrupted.
    pub(super) fn look(&self, stage: &Stage<'_>, engine: &Engine, surface: &Surface) -> Result<Option<Views>> {
        let path = self.folder.join(&surface.file);
        let Some(around) = extent(&path)? else { return Ok(None) };
        let mut seen = FROM.map(|(from, _)| ZBuffer::new(Camera::around(around, from, self.size)));
        let mut pairs = BTreeMap::new();
        let mut count = 0_u64;
        each_triangle(&path, &mut |corners, labels| {
            // Beyond these names the last one is shared.
            let next = u16::try_from(pairs.len()).unwrap_or(u16::MAX);
            let tag = *pairs.entry(labels).or_insert(next);
            for buffer in &mut seen {
                buffer.add(corners, tag);
            }
            count += 1;
            if count.is_multiple_of(1 << 16) { engine.check() } else { Ok(()) }
        })?;
        let mut labels = vec![[0; 2]; pairs.len().min(1 << 16)];
        for (pair, tag) in pairs {
            labels[tag as usize] = pair;
        }
        let lengths =
            stage.run(&seen, &Workers::none(), |(), buffer| Ok(self.lengths(buffer, surface.label, &labels)))?;
        let legend = self.legend(&lengths);
        let sides: Vec<_> = seen.iter().zip(&lengths).zip(FROM).collect();
        let pictures = stage.run(&sides, &Workers::none(), |(), ((buffer, lengths), (_, name))| {
            let picture = self.picture(buffer, lengths, surface.label, legend.as_ref());
            Picture::new(&picture, (*name).into())
        })?;
        Ok(Some(Views { pictures, legend }))
    }

    fn picture(&self, buffer: &ZBuffer, lengths: &[f32], label: u32, legend: Option<&Legend>) -> Rgb {
        let mut colors = vec![[0; 3]; self.size[0] * self.size[1]];
        for (Seen { pixel, tag, .. }, &length) in buffer.seen().zip(lengths) {
            colors[pixel] = match legend {
                Some(legend) if !length.is_nan() => legend.color(length.into()),
                _ if label == 0 => label_color(u32::from(tag) + 1),
                _ => label_color(label),
            };
        }
        let mut picture = shaded(buffer, &colors);
        for at in self.marks(buffer, label) {
            dot(&mut picture, at, 1.6, MARK);
        }
        picture
    }

    /// The length that colours each pixel that shows the surface; no number where there is none.
    fn lengths(&self, buffer: &ZBuffer, label: u32, pairs: &[[u32; 2]]) -> Vec<f32> {
        let length = |seen: &Seen| {
            let trees = self.trees.as_ref()?;
            match self.evidence.measure {
                Measure::ToMarks => trees.distance(label, seen.place),
                Measure::Thickness => {
                    let [low, high] = pairs[seen.tag as usize].map(|label| trees.distance(label, seen.place));
                    low.zip(high).map(|(low, high)| low + high)
                }
            }
        };
        buffer.seen().map(|seen| length(&seen).map_or(f32::NAN, |length| length as f32)).collect()
    }

    fn legend(&self, lengths: &[Vec<f32>]) -> Option<Legend> {
        let mut all: Vec<f32> = lengths.iter().flatten().copied().filter(|length| !length.is_nan()).collect();
        all.sort_unstable_by(f32::total_cmp);
        let high = f64::from(*all.get((all.len() as f64 * SHARE) as usize)?);
        let ramp = match self.evidence.measure {
            Measure::ToMarks => Ramp::Alarm,
            Measure::Thickness => Ramp::Size,
        };
        Some(Legend { ramp, high: high.max(f64::MIN_POSITIVE) })
    }

    /// Where marks of the object are seen, unless they are so many that they would hide the surface.
    fn marks(&self, buffer: &ZBuffer, label: u32) -> Vec<[f64; 2]> {
        let sources = self.evidence.sources;
        let set = sources.labels().iter().position(|&other| other == label);
        let Some(points) = set.and_then(|set| sources.clouds().nth(set)) else { return Vec::new() };
        if points.len() > MOST_DOTS {
            return Vec::new();
        }
        let slack = SLACK / buffer.camera().scale();
        points.filter_map(|n| buffer.shows(sources.positions[n as usize], slack)).collect()
    }
}

fn looks_up(evidence: &Evidence<'_>) -> bool {
    (1..=MOST_SOURCES).contains(&evidence.sources.len())
}

impl Legend {
    fn color(&self, length: f64) -> [u8; 3] {
        self.ramp.color(length / self.high)
    }
}

impl Views {
    /// A bar with the colours, and what they mean.
    pub(super) fn put_legend(&self, page: &mut Html, evidence: &Evidence<'_>, unit: &str) {
        let Some(Legend { ramp, high }) = self.legend else { return };
        let stops = ramp.stops().map(|[r, g, b]| format!("rgb({r},{g},{b})")).join(",");
        let what = match evidence.measure {
            Measure::ToMarks => format!("to the nearest of the {}", evidence.points),
            Measure::Thickness => "of thickness: the distances to both sets, added".into(),
        };
        page.within("p", &[("class", "legend")], |p| {
            p.text("0 ");
            p.element(
                "span",
                &[("class", "bar"), ("style", &format!("background:linear-gradient(90deg,{stops})"))],
                "",
            );
            p.text(&format!(" {} or more {what}", with_unit(&number(high), unit)));
        });
    }
}

fn with_unit(number: &str, unit: &str) -> String {
    if unit.is_empty() { number.into() } else { format!("{number} {unit}") }
}
