//! Stacks that hold a bright ball in noise, with marks on its border, and the program run on them.
#![allow(clippy::unwrap_used)]

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::patience;
use super::random::Random;
use super::tiff_bytes::{Value, bytes_u16, gray_page, tiff_file};
use strandline::grid::{Box3, Geometry};

/// A ball in a stack.
#[derive(Clone, Debug)]
pub(crate) struct Ball {
    pub(crate) geometry: Geometry,
    pub(crate) centre: [f64; 3],
    pub(crate) radius: f64,
}

impl Ball {
    /// A ball of radius 6 in 40 x 36 x 20 voxels of 0.5 x 0.5 x 1.
    pub(crate) fn small() -> Self {
        let geometry = Geometry {
            shape: [40, 36, 20],
            spacing: [0.5, 0.5, 1.0],
            origin: [0.0; 3],
            unit: Some("micrometer".into()),
        };
        Self { geometry, centre: [10.0, 9.0, 9.5], radius: 6.0 }
    }

    /// The same ball on a grid five times finer.
    pub(crate) fn large() -> Self {
        let mut ball = Self::small();
        ball.geometry.shape = ball.geometry.shape.map(|n| 5 * n);
        ball.geometry.spacing = ball.geometry.spacing.map(|h| h / 5.0);
        ball
    }

    pub(crate) fn holds(&self, voxel: [i64; 3]) -> bool {
        let p = self.geometry.position(voxel);
        (0..3).map(|a| (p[a] - self.centre[a]).powi(2)).sum::<f64>() <= self.radius * self.radius
    }

    /// Grey values around 100 outside and 400 inside, x fastest.
    pub(crate) fn voxels(&self) -> Vec<u16> {
        let mut random = Random(7);
        let mut noise = || random.below(40) as u16;
        let shape = self.geometry.shape;
        let voxels = Box3::from_shape(shape).rows().flat_map(|(y, z)| (0..shape[0]).map(move |x| [x, y, z]));
        voxels.map(|v| if self.holds(v) { 400 + noise() } else { 100 + noise() }).collect()
    }

    /// Marks on every second slice that the ball crosses well, `object,contour,x,y,z` without the header; coordinates
    /// are multiples of 1/64, so that moving them rounds nothing.
    pub(crate) fn marks(&self, object: u32) -> String {
        let mut text = String::new();
        for slice in (0..self.geometry.shape[2]).filter(|z| z % 2 == 0) {
            let z = self.geometry.position([0, 0, slice])[2];
            let square = self.radius.powi(2) - (z - self.centre[2]).powi(2);
            if square < 0.1 * self.radius.powi(2) {
                continue;
            }
            for n in 0..24 {
                let angle = f64::from(n) * std::f64::consts::TAU / 24.0;
                let at = |centre: f64, of: f64| ((centre + square.sqrt() * of) * 64.0).round() / 64.0;
                let (x, y) = (at(self.centre[0], angle.cos()), at(self.centre[1], angle.sin()));
                writeln!(text, "{object},{slice},{x},{y},{z}").unwrap();
            }
        }
        text
    }
}

pub(crate) const HEADER: &str = "object,contour,x,y,z\n";

/// Writes a stack as `ImageJ` does, its spacing in the description; `channels` volumes of one shape, interleaved.
pub(crate) fn write_stack(path: &Path, geometry: &Geometry, channels: &[&[u16]]) {
    let [x, y, z] = geometry.shape;
    let plane = (x * y) as usize;
    let images = z as usize * channels.len();
    let description = format!(
        "ImageJ=1.54f\nimages={images}\nchannels={}\nslices={z}\nhyperstack=true\nunit=um\nspacing={}\n",
        channels.len(),
        geometry.spacing[2]
    );
    let resolution = |h: f64| Value::Rational(1_000_000, (h * 1e6).round() as u32);
    let page = |n: usize| {
        let voxels = &channels[n % channels.len()][n / channels.len() * plane..][..plane];
        let page = gray_page(x as u32, y as u32, 16, bytes_u16(voxels, false))
            .with(282, resolution(geometry.spacing[0]))
            .with(283, resolution(geometry.spacing[1]));
        if n == 0 { page.with(270, Value::Text(description.clone())) } else { page }
    };
    fs::write(path, tiff_file(&(0..images).map(page).collect::<Vec<_>>(), false)).unwrap();
}

/// A folder with `image.tif` and `marks.csv` of a ball, and a place for outputs.
pub(crate) struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    pub(crate) fn new(ball: &Ball) -> Self {
        let bench = Self::bare();
        write_stack(&bench.path("image.tif"), &ball.geometry, &[&ball.voxels()]);
        bench.write("marks.csv", &format!("{HEADER}{}", ball.marks(1)));
        bench
    }

    /// Without a ball.
    pub(crate) fn bare() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        fs::create_dir(bench.path("out")).unwrap();
        fs::create_dir(bench.path("scratch")).unwrap();
        bench
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    /// The program with these arguments, in the folder.
    pub(crate) fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_strandline"));
        command.args(arguments.split_whitespace()).current_dir(self.folder.path()).env("TMPDIR", self.path("scratch"));
        command
    }

    pub(crate) fn run(&self, arguments: &str) -> Output {
        patience::run(&mut self.command(arguments))
    }

    /// Runs what must succeed; returns what it printed.
    pub(crate) fn succeed(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments}: {} {complaint}", output.status);
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs what must fail with a code; returns the complaint, which must be one line and leave no trace.
    pub(crate) fn fail(&self, arguments: &str, code: i32) -> String {
        let output = self.run(arguments);
        let complaint = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{arguments}: {complaint}");
        assert!(output.stdout.is_empty(), "{arguments}: results on stdout");
        assert!(!complaint.contains("panicked"), "{arguments}: {complaint}");
        assert!(self.entries("scratch").is_empty(), "{arguments}: {:?} left", self.entries("scratch"));
        complaint
    }

    pub(crate) fn entries(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&fs::read(self.path(name)).unwrap()).unwrap()
    }
}
