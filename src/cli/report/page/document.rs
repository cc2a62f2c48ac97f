//! The page from top to bottom: warnings, what was run on what, what was found, pictures, plots, settings, stages.

use serde_json::Value;

use super::evidence::{Evidence, Measure};
use super::html::Html;
use super::picture::Picture;
use super::settings::told;
use super::views::Views;
use super::{objects, plots, settings, slices, stages, warnings};
use crate::cli::terminal::text::{bytes, duration, grouped};
use crate::error::Result;
use crate::exec::StageReport;
use crate::kernel::image::picture::palette::label_color;

const STYLE: &str = include_str!("style.css");
/// Nothing is loaded and nothing runs, whatever stands in the page.
const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// Inputs by the names that they have among the settings.
const INPUTS: [(&str, &str); 6] = [
    ("image", "image"),
    ("points", "marks"),
    ("seeds", "seeds (x, y, z, radius)"),
    ("sources", "sources"),
    ("cloud", "points"),
    ("output", "output"),
];

/// What the page shows beside numbers.
pub(super) struct Figures {
    pub(super) slices: Vec<Picture>,
    /// By label, 0 where a surface has none of its own.
    pub(super) surfaces: Vec<(u32, Views)>,
    /// Surfaces that there are beside these.
    pub(super) more_surfaces: usize,
    /// What is to be said of surfaces.
    pub(super) notes: Vec<String>,
}

/// A run and what its page tells of it.
pub(super) struct Document<'a> {
    pub(super) report: &'a Value,
    pub(super) typed: &'a [String],
    pub(super) stages: &'a [StageReport],
    pub(super) evidence: &'a Evidence<'a>,
    pub(super) figures: &'a Figures,
}

/// A page that needs nothing but itself.
pub(crate) fn whole_page(title: &str, body: impl FnOnce(&mut Html)) -> String {
    let mut page = Html::new();
    page.raw("<!DOCTYPE html>\n");
    page.within("html", &[("lang", "en"), ("xmlns", "http://www.w3.org/1999/xhtml")], |page| {
        page.within("head", &[], |head| {
            head.element("meta", &[("charset", "utf-8")], "");
            head.element("meta", &[("http-equiv", "Content-Security-Policy"), ("content", POLICY)], "");
            head.element("meta", &[("name", "viewport"), ("content", "width=device-width, initial-scale=1")], "");
            // Without it browsers ask the server for an icon.
            head.element("link", &[("rel", "icon"), ("href", "data:,")], "");
            head.element("title", &[], title);
            head.within("style", &[], |style| style.raw(STYLE));
        });
        page.within("body", &[], |page| page.within("main", &[], body));
    });
    page.finish()
}

impl Document<'_> {
    /// The whole page.
    ///
    /// # Errors
    /// When a plot cannot be drawn.
    pub(super) fn page(&self) -> Result<String> {
        let body = self.body()?;
        Ok(whole_page(&self.title(), |main| main.raw(&body)))
    }

    fn title(&self) -> String {
        let settings = &self.report["settings"];
        let name = |value: &Value| {
            let text = told(value);
            text.rsplit('/').next().unwrap_or_default().to_owned()
        };
        let of = ["image", "cloud"].into_iter().find(|of| settings[of].is_string()).map(|of| name(&settings[of]));
        let sources = || settings["sources"].as_array().map(|all| all.iter().map(name).collect::<Vec<_>>().join(", "));
        format!("strandline {}: {}", told(&self.report["command"]), of.or_else(sources).unwrap_or_default())
    }

    fn body(&self) -> Result<String> {
        let mut page = Html::new();
        page.element("h1", &[], &self.title());
        self.summary(&mut page);
        self.warnings(&mut page);
        self.inputs(&mut page);
        page.element("h2", &[], "Found");
        let unit = self.report["grid"]["unit"].as_str().unwrap_or("units of length");
        page.element(
            "p",
            &[("class", "faint")],
            &format!("Lengths in {unit}; areas and volumes in its square and cube."),
        );
        objects::found(&mut page, &self.report["result"]);
        self.slices(&mut page);
        self.surfaces(&mut page, unit)?;
        self.motion(&mut page)?;
        page.element("h2", &[], "Settings");
        settings::settings(&mut page, self.report, self.typed);
        page.element("h2", &[], "Stages");
        stages::stages(&mut page, self.stages);
        Ok(page.finish())
    }

    fn summary(&self, page: &mut Html) {
        let report = self.report;
        let shape: Vec<String> = xyz(&report["grid"]["shape_zyx"]).iter().map(told).collect();
        page.element(
            "p",
            &[("class", "faint")],
            &format!(
                "strandline {}; {} voxels (x, y, z), {} with {} threads, at most {} of memory. All numbers are in \
                 report.json beside this page.",
                told(&report["version"]),
                shape.join(" × "),
                seconds(report["seconds"].as_f64().unwrap_or(0.0)),
                told(&report["threads"]),
                bytes(report["peak_rss_bytes"].as_u64().unwrap_or(0)),
            ),
        );
    }

    fn warnings(&self, page: &mut Html) {
        let notes: Vec<String> = self.report["notes"].as_array().into_iter().flatten().map(told).collect();
        for line in warnings::lines(&notes) {
            page.element("p", &[("class", "warning")], &line);
        }
    }

    fn inputs(&self, page: &mut Html) {
        page.element("h2", &[], "Run");
        page.element("p", &[("class", "faint")], "The command as it was typed; a click selects it.");
        page.element("pre", &[], &command_line(self.typed));
        let settings = &self.report["settings"];
        let mut rows = vec![["", ""].map(String::from).to_vec()];
        for (key, name) in INPUTS {
            let value = &settings[key];
            if value.as_array().is_some_and(Vec::is_empty) || value.is_null() {
                continue;
            }
            rows.push(vec![name.into(), told(value)]);
        }
        let grid = &self.report["grid"];
        let unit = grid["unit"].as_str().unwrap_or("no unit");
        let triple = |key: &str| xyz(&grid[key]).iter().map(told).collect::<Vec<_>>().join(", ");
        rows.push(vec!["voxel spacing (x, y, z)".into(), format!("{} ({unit})", triple("spacing_zyx"))]);
        rows.push(vec!["first voxel (x, y, z)".into(), triple("origin_zyx")]);
        page.table(&rows);
    }

    fn slices(&self, page: &mut Html) {
        page.element("h2", &[], "Slices");
        page.element("p", &[("class", "faint")], &slices::explained(self.evidence));
        page.within("div", &[("class", "figures")], |page| {
            self.figures.slices.iter().for_each(|slice| slice.put(page));
        });
    }

    fn surfaces(&self, page: &mut Html, unit: &str) -> Result<()> {
        let figures = self.figures;
        if figures.surfaces.is_empty() && figures.notes.is_empty() {
            return Ok(());
        }
        page.element("h2", &[], if figures.surfaces.len() == 1 { "Surface" } else { "Surfaces" });
        if figures.more_surfaces > 0 {
            let text = format!(
                "The {} largest objects are shown; {} more are in the table and in meshes/.",
                figures.surfaces.len(),
                grouped(figures.more_surfaces as u64)
            );
            page.element("p", &[], &text);
        }
        figures.notes.iter().for_each(|note| page.element("p", &[("class", "faint")], note));
        for (label, views) in &figures.surfaces {
            if figures.surfaces.len() > 1 {
                page.element("h3", &[], &format!("Object {label}"));
            }
            let measure = self.evidence.measure;
            views.put_legend(page, self.evidence, if unit == "units of length" { "" } else { unit });
            let plot = self.histogram(*label, unit)?;
            page.within("div", &[("class", "figures")], |page| {
                views.pictures.iter().for_each(|picture| picture.put(page));
                if let Some(plot) = plot.filter(|_| measure == Measure::ToMarks) {
                    page.within("figure", &[], |figure| {
                        figure.raw(&plot);
                        let points = self.evidence.points;
                        let caption = format!("How far {points} lie from the surface; the red line is one voxel.");
                        figure.element("figcaption", &[], &caption);
                    });
                }
            });
        }
        Ok(())
    }

    /// The histogram of an object's marks, where they were measured.
    fn histogram(&self, label: u32, unit: &str) -> Result<Option<String>> {
        let result = &self.report["result"];
        let of_label =
            |objects: &Vec<Value>| objects.iter().find(|o| o["label"].as_u64() == Some(label.into())).cloned();
        let object = result["objects"].as_array().and_then(of_label);
        let distances = &object.as_ref().unwrap_or(result)["distances"];
        let (Some(width), Some(counts)) = (distances["bin_width"].as_f64(), distances["counts"].as_array()) else {
            return Ok(None);
        };
        let counts: Vec<u64> = counts.iter().filter_map(Value::as_u64).collect();
        let spacings = self.report["grid"]["spacing_zyx"].as_array().into_iter().flatten().filter_map(Value::as_f64);
        plots::histogram(width, &counts, spacings.fold(0.0, f64::max), unit, self.evidence.points).map(Some)
    }

    /// How surfaces came to rest.
    fn motion(&self, page: &mut Html) -> Result<()> {
        let result = &self.report["result"];
        let numbers =
            |value: &Value| -> Vec<f64> { value.as_array().into_iter().flatten().filter_map(Value::as_f64).collect() };
        let shown: Vec<u32> = self.figures.surfaces.iter().map(|(label, _)| *label).collect();
        let curves: Vec<(Vec<f64>, [u8; 3])> = match result["objects"].as_array() {
            Some(objects) => objects
                .iter()
                .map(|object| (object["label"].as_u64().unwrap_or(0) as u32, numbers(&object["residuals"])))
                .filter(|(label, _)| shown.contains(label))
                .map(|(label, curve)| (curve, label_color(label)))
                .collect(),
            None => vec![(numbers(&result["residuals"]), label_color(1))],
        };
        let curves: Vec<_> = curves.into_iter().filter(|(curve, _)| !curve.is_empty()).collect();
        if curves.is_empty() {
            return Ok(());
        }
        let settings = &self.report["settings"];
        let what = match settings["stop"].as_str() {
            Some("l2") => "The discrete L2 norm of each time step's change",
            _ => "The mean motion of the surface in a unit of time, after each time step",
        };
        page.element("h2", &[], "Motion");
        page.element("p", &[("class", "faint")], &format!("{what}; the red line is where it counts as at rest."));
        let plot = plots::motion(&curves, settings["tol"].as_f64().unwrap_or(f64::NAN))?;
        page.within("div", &[("class", "figures few")], |page| {
            page.within("figure", &[], |figure| figure.raw(&plot));
        });
        Ok(())
    }
}

/// A time, short ones to a tenth of a second.
fn seconds(seconds: f64) -> String {
    if seconds < 10.0 { format!("{seconds:.1} s") } else { duration(seconds) }
}

/// A triple of the report, which lists z, y, x.
fn xyz(zyx: &Value) -> Vec<Value> {
    zyx.as_array().into_iter().flatten().rev().cloned().collect()
}

/// The command line as a shell takes it.
pub(super) fn command_line(typed: &[String]) -> String {
    let quoted = |(n, word): (usize, &String)| {
        let word = if n == 0 { word.rsplit('/').next().unwrap_or(word) } else { word };
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
        if !word.is_empty() && word.chars().all(is_plain) {
            word.to_owned()
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    };
    typed.iter().enumerate().map(quoted).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_can_be_copied() {
        let typed = ["/opt/bin/strandline", "segment", "a b.tif", "--tau=2", "it's", ""].map(String::from);
        assert_eq!(command_line(&typed), "strandline segment 'a b.tif' --tau=2 'it'\\''s' ''");
    }
}
