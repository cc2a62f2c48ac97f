//! `strandline convert`: a volume or a mesh in another format, told by the names of input and output.

mod mesh;

use std::path::Path;
use std::sync::Arc;

use crate::cli::args::convert::ConvertArgs;
use crate::cli::args::values::{CompressArg, OmeArg};
use crate::cli::inputs::image::{OpenStack, chosen_notes, open_volume};
use crate::cli::inputs::settings;
use crate::cli::outputs::checks::Outputs;
use crate::cli::print;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::signals;
use crate::cli::terminal::text::grouped;
use crate::error::{Error, Result};
use crate::exec::{Cancel, Progress};
use crate::io::geometry::write::formats as meshes;
use crate::io::ome_zarr::{Compression, LabelColor, OmeVersion, StoreWriter, is_store};
use crate::io::stack::formats::{format_of, open_stack};
use crate::io::stack::volume::StackInfo;
use crate::io::stack::write::formats::{FORMATS, Format, VolumeFile, VolumeSpec};
use crate::io::stack::zarr::label_colors;
use crate::job::disk::Disk;
use crate::job::resources::Resources;
use crate::pipeline::convert::{Conversion, Kind};
use crate::store::ElementType;

/// What the output's name asks for.
#[derive(Clone, Copy)]
enum Target {
    Store,
    Volume(&'static Format),
    Mesh(&'static meshes::Format),
}

impl Target {
    fn of(path: &Path) -> Result<Self> {
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zarr")) {
            return Ok(Self::Store);
        }
        let found = Format::of(path).map(Self::Volume).or_else(|| meshes::Format::of(path).map(Self::Mesh));
        found.ok_or_else(|| {
            let volumes = FORMATS.iter().flat_map(|format| format.extensions).copied();
            let endings = std::iter::once("zarr").chain(volumes).chain(meshes::FORMATS.iter().map(|f| f.extension));
            let endings: Vec<String> = endings.map(|ending| format!(".{ending}")).collect();
            let endings = endings.join(", ");
            Error::usage(format!("ends like no format that is written; give a name that ends in one of {endings}"))
                .at(path)
        })
    }

    fn name(self) -> &'static str {
        match self {
            Self::Store => "OME-Zarr",
            Self::Volume(format) => format.name,
            Self::Mesh(format) => format.name,
        }
    }

    /// Refuses flags that say nothing of it.
    fn check_flags(self, args: &ConvertArgs) -> Result<()> {
        let is_packed = match self {
            Self::Store => true,
            Self::Volume(format) => format.is_packed,
            Self::Mesh(_) => false,
        };
        let is_packing = args.compress.is_some_and(|compress| compress != CompressArg::None);
        if is_packing && !is_packed {
            return Err(Error::usage(format!(
                "--compress is for OME-Zarr, TIFF and NRRD; {} is not packed",
                self.name()
            )));
        }
        if args.ome.is_some() && !matches!(self, Self::Store) {
            return Err(Error::usage("--ome is for an output that ends in .zarr"));
        }
        Ok(())
    }
}

/// Runs the command.
pub(crate) fn run(args: &ConvertArgs) -> Result<()> {
    let (input, output) = (&args.input, &args.output);
    let target = Target::of(output)?;
    target.check_flags(args)?;
    let is_store_out = matches!(target, Target::Store);
    let outputs = Outputs {
        inputs: vec![input],
        store: is_store_out.then_some(output),
        files: if is_store_out { Vec::new() } else { vec![output] },
        overwrite: args.overwrite,
    };
    outputs.check()?;
    let cancel = signals::cancel_on_signals()?;
    let resources = Resources::new(args.memory, args.threads, args.scratch.as_deref(), Some(output))?;
    let console = Arc::new(Console::new(Voice::told(args.log, args.quiet, false)));
    let is_volume = is_store(input) || format_of(input).is_some();
    match target {
        Target::Mesh(_) if is_volume => Err(Error::usage(
            "is a volume, of which no mesh is made here; segment, reconstruct and middle draw surfaces",
        )
        .at(input)),
        Target::Mesh(format) => mesh::run(args, format, &resources, &console),
        _ if is_volume => Job { args, target, resources, console, cancel }.run(),
        _ if input.exists() && mesh::is_source(input) => {
            Err(Error::usage("is no volume; strandline distance makes one of points or a mesh").at(input))
        }
        // Nothing there, or nothing that is known: whoever reads it says best what is wrong.
        _ => open_stack(input, args.volume.select()).map(drop),
    }
}

/// A volume that is to be written once more.
struct Job<'a> {
    args: &'a ConvertArgs,
    target: Target,
    resources: Resources,
    console: Arc<Console>,
    cancel: Cancel,
}

impl Job<'_> {
    fn run(&self) -> Result<()> {
        let (args, console) = (self.args, &self.console);
        let spacing = settings::spacing("--image-spacing", args.image_spacing)?;
        let select = args.volume.select();
        let opened = open_volume(&args.input, select, spacing)?;
        let info = opened.stack.info();
        let chosen = chosen_notes(&args.input, info, select);
        opened.notes.iter().chain(&chosen).for_each(|note| console.note(note));
        let stored = stored_type(&args.input, info)?;
        let result = self.write(&opened, stored);
        console.clear();
        let stored = result?;
        if !args.quiet {
            let [x, y, z] = opened.geometry.shape.map(|n| grouped(n.unsigned_abs()));
            print(&format!("{}: {}, {x} x {y} x {z} {}\n", args.output.display(), self.target.name(), stored.name()))?;
        }
        Ok(())
    }

    /// Writes the volume; returns the type of its voxels in the output.
    fn write(&self, opened: &OpenStack, stored: ElementType) -> Result<ElementType> {
        let output = &self.args.output;
        let format = if let Target::Volume(format) = self.target { Some(format) } else { None };
        let stored = format.map_or(stored, |format| self.told_type(format, stored));
        let conversion = Conversion { volume: opened.stack.as_ref(), geometry: &opened.geometry, stored };
        let needs = conversion.needs(self.resources.threads, format.is_none());
        Disk::of_copy(&self.resources, output, &opened.geometry, &needs)?.check(|text| self.console.note(text))?;
        let engine = self.resources.engine(&self.cancel, self.console.clone())?;
        let compression = self.args.compress.map_or(Compression::default(), Compression::from);
        let name = name_of(&self.args.input);
        if let Some(format) = format {
            self.note_lost(format, opened);
            let (geometry, guessed) = (&opened.geometry, opened.guessed);
            let spec = VolumeSpec { name: &name, geometry, guessed, element: stored, compression };
            let mut file = VolumeFile::create(format, output, &spec)?;
            conversion.into_file(&engine, &mut file)?;
            engine.check()?;
            file.finish(self.args.overwrite)?;
            return Ok(stored);
        }
        let version = self.args.ome.map_or(OmeVersion::default(), OmeArg::into);
        let store = StoreWriter::create_as(version, output, self.args.overwrite)?.packed(compression);
        let colors = self.colors(stored)?;
        let kind = match &colors {
            Some(colors) => Kind::Labels { name: &name, colors },
            None => Kind::Image { name: &name },
        };
        conversion.into_store(&engine, &store, &kind)?;
        engine.check()?;
        store.finish()?;
        Ok(stored)
    }

    /// The type in which a format holds voxels, told where it is another one.
    fn told_type(&self, format: &Format, stored: ElementType) -> ElementType {
        let held = format.element(stored);
        if held != stored {
            let (held, stored) = (held.name(), stored.name());
            self.console.note(&format!("{} holds no {stored}; voxels are written as {held}", format.name));
        }
        held
    }

    /// Says what of where voxels lie a format does not hold.
    fn note_lost(&self, format: &Format, opened: &OpenStack) {
        let [x, y, z] = opened.geometry.origin;
        if !format.has_origin && [x, y, z] != [0.0; 3] {
            let name = format.name;
            self.console.note(&format!(
                "{name} does not tell where a volume lies: its first voxel, at {x}, {y}, {z}, is then at 0, 0, 0"
            ));
        }
    }

    /// Colours of labels; none of an image that is no label image.
    fn colors(&self, stored: ElementType) -> Result<Option<Vec<LabelColor>>> {
        let told = if is_store(&self.args.input) { label_colors(&self.args.input) } else { None };
        let is_float = matches!(stored, ElementType::F16 | ElementType::F32 | ElementType::F64);
        if self.args.labels && is_float {
            let what = format!("holds {} numbers, and --labels is for whole ones", stored.name());
            return Err(Error::usage(what).at(&self.args.input));
        }
        let colors = told.or_else(|| self.args.labels.then(Vec::new)).filter(|_| !is_float);
        Ok(colors.map(|colors| colors.into_iter().map(|(label, rgba)| LabelColor { label, rgba }).collect()))
    }
}

/// The type that a file's voxels have; refused where no type that is handed out holds all of its values.
fn stored_type(path: &Path, info: &StackInfo) -> Result<ElementType> {
    Ok(match info.file_type.as_str() {
        "int8" => ElementType::I8,
        "int16" => ElementType::I16,
        "int32" => ElementType::I32,
        "float16" => ElementType::F16,
        wide @ ("int64" | "uint64") => {
            let what = format!(
                "holds {wide} numbers, which are not converted: they are read as doubles, which do not hold all of them"
            );
            return Err(Error::input(what).at(path));
        }
        _ => info.element,
    })
}

/// What an input is called, without its folder and ending.
fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let stem = name.split_once('.').map_or(name.as_str(), |(stem, _)| stem);
    if stem.is_empty() { name } else { stem.to_owned() }
}
