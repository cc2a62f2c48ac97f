//! Every reader behind one call, with small whole files of its formats to start from.

use std::fs;
use std::path::{Path, PathBuf};

use strandline::error::Result;
use strandline::grid::{Box3, Geometry};
use strandline::io::label_volume::LabelVolume;
use strandline::io::ome_zarr::{ImageSpec, StoreWriter};
use strandline::io::points::read_cloud;
use strandline::io::sources::read_source;
use strandline::io::stacks::open_stack;
use strandline::io::tiff_stack::{Select, TiffStack};
use strandline::store::{Element, PlaneSource};

use crate::common::meshes::{Form, cuboid, sphere};
use crate::common::{stores, tiff_planes};

/// Files of an input: paths in its folder, and what they hold.
pub(super) type Files = Vec<(String, Vec<u8>)>;

/// What reads an input.
pub(super) struct Reader {
    pub(super) name: &'static str,
    /// Endings of files from elsewhere that it reads.
    pub(super) endings: &'static [&'static str],
    pub(super) seeds_of: fn() -> Vec<Files>,
    /// Reads all of the input in a folder.
    pub(super) read: fn(&Path) -> Result<()>,
    /// Whether whatever is wrong with an input is the input's fault: exit code 2.
    pub(super) blames_input: bool,
}

pub(super) const READERS: &[Reader] = &[
    Reader {
        name: "points",
        endings: &["csv", "tsv", "xyz", "txt"],
        seeds_of: tables,
        read: sources,
        blames_input: true,
    },
    Reader {
        name: "meshes",
        endings: &["ply", "obj", "off", "stl"],
        seeds_of: meshes,
        read: sources,
        blames_input: true,
    },
    Reader { name: "tiff", endings: &["tif", "tiff"], seeds_of: pages, read: pages_of_file, blames_input: true },
    Reader { name: "slices", endings: &[], seeds_of: slices, read: planes, blames_input: true },
    Reader { name: "zarr", endings: &["zarr"], seeds_of: images, read: labels, blames_input: false },
];

/// Voxels and planes that are read of an image at most.
const MOST_VOXELS: i64 = 1 << 20;
const MOST_PLANES: i64 = 64;
/// Files from elsewhere that are larger are left out.
const LARGEST: u64 = 1 << 16;

impl Reader {
    /// Small whole inputs: made here, and those below a folder.
    pub(super) fn seeds(&self, more: Option<&Path>) -> Vec<Files> {
        let mut seeds = (self.seeds_of)();
        if let Some(folder) = more {
            self.add_from(folder, &mut seeds);
        }
        seeds
    }

    fn add_from(&self, folder: &Path, seeds: &mut Vec<Files>) {
        let mut paths: Vec<PathBuf> = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
        paths.sort();
        for path in paths {
            let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            let is_ours = self.endings.contains(&ending.as_str());
            if path.is_dir() && is_ours {
                let files = stores::contents(&path);
                seeds.extend((files.iter().all(|(_, bytes)| bytes.len() as u64 <= LARGEST)).then_some(files));
            } else if path.is_dir() {
                self.add_from(&path, seeds);
            } else if is_ours && path.metadata().is_ok_and(|m| m.len() <= LARGEST) {
                let bytes = fs::read(&path).expect("a file of the seeds");
                seeds.push(vec![(format!("input.{ending}"), bytes)]);
            }
        }
    }
}

/// The one file of an input.
fn only_file(folder: &Path) -> PathBuf {
    let mut paths = fs::read_dir(folder).expect("the input's folder").map(|entry| entry.expect("an entry").path());
    paths.next().expect("an input of one file")
}

fn sources(folder: &Path) -> Result<()> {
    let path = only_file(folder);
    // Both are asked: neither may panic where the other refuses.
    let (source, cloud) = (read_source(&path).map(drop), read_cloud(&path).map(drop));
    source.and(cloud)
}

fn pages_of_file(folder: &Path) -> Result<()> {
    planes(&only_file(folder))
}

fn planes(path: &Path) -> Result<()> {
    let stack = TiffStack::open(path, Select::default())?;
    let [width, height, depth] = stack.shape();
    let size = width.saturating_mul(height).max(1);
    (0..depth.min(MOST_VOXELS / size).min(MOST_PLANES)).try_for_each(|z| tiff_planes::plane(&stack, z).map(drop))
}

fn labels(folder: &Path) -> Result<()> {
    let stack = open_stack(folder, Select::default())?;
    let [width, height, depth] = stack.shape();
    let geometry = Geometry { shape: [width, height, depth], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let volume = LabelVolume::new(folder, stack, geometry);
    let size = width.saturating_mul(height).max(1);
    (0..depth.min(MOST_VOXELS / size).min(MOST_PLANES))
        .try_for_each(|z| volume.read_box(&Box3::new([0, 0, z], [width, height, z + 1]), &mut Vec::new()))
}

fn tables() -> Vec<Files> {
    let texts = [
        "x,y,z\n1,2,3\n4,5,6\n7.5,8,9e0\n",
        "x;y;z;object;contour\n1,5;2;3;1;1\n4;5,25;6;1;1\n7;8;9;2;3\n",
        "\"object\"\t\"x\"\t\"y\"\t\"z\"\n1\t1\t2\t3\n2\t4\t5\t6\n",
        "index,axis-0,axis-1,axis-2\n0,3.0,2.0,1.0\n1,4.0,2.0,1.0\n",
        "index,shape-type,vertex-index,axis-0,axis-1,axis-2\n0,polygon,0,3,2,1\n0,polygon,1,3,4,1\n0,polygon,2,3,4,5\n",
        "# a cloud\n1 2 3\n4 5 6 0.1 0.2 0.3\n\n7 8 9\n",
        "3\n1 2 3\n4 5 6\n7 8 9\n",
        "sep=;\nx;y;z\n1;2;3\n4;5;6\n",
        "LABEL,ID,POSITION_X,POSITION_Y,POSITION_Z\nLabel,Id,X,Y,Z\n,,(micron),(micron),(micron)\nID1,1,1.0,2.0,3.0\nID2,2,4.0,5.0,6.0\n",
        "Position\n====================\nPosition X,Position Y,Position Z,Unit\n1,2,3,um\n4,5,6,um\n",
        " ,Area,X,Y,Slice\n1,10,1.5,2.5,3\n2,12,4.5,5.5,4\n",
    ];
    texts.iter().map(|text| vec![("input.csv".to_owned(), text.as_bytes().to_vec())]).collect()
}

fn meshes() -> Vec<Files> {
    let shapes = [cuboid([0.0; 3], [1.0, 2.0, 3.0]), sphere([1.0, 0.0, -1.0], 2.0, 4, std::f64::consts::PI)];
    let written = shapes.iter().flat_map(|mesh| Form::ALL.iter().map(|form| form.write(mesh)));
    let rest = [
        &b"ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
           property uchar red\nproperty list uchar float extra\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n\
           end_header\n0 0 0 1 0\n1 0 0 1 2 1 1\n0 1 0 1 0\n0 1\n"[..],
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
          element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n5 0 1 2 3 -1\n",
        b"OFF8 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n5 0 1 2 3 4\n",
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .5 0\nf 1 2 3 4 5\nl 1 2\np 1\ng a\nusemtl b\nf 1/2/3 2/3 3//4\n",
    ];
    let all = written.chain(rest.iter().map(|bytes| bytes.to_vec()));
    all.map(|bytes| vec![("input.mesh".to_owned(), bytes)]).collect()
}

fn pages() -> Vec<Files> {
    let made = crate::tiff_hostile::seeds();
    made.into_iter().map(|(_, bytes)| vec![("input.tif".to_owned(), bytes)]).collect()
}

/// Folders of three slices each.
fn slices() -> Vec<Files> {
    let made = crate::tiff_hostile::seeds();
    let three = |bytes: &Vec<u8>| (8..11).map(|n| (format!("s{n:02}.tif"), bytes.clone())).collect();
    made.iter().map(|(_, bytes)| three(bytes)).collect()
}

/// Stores that this program writes, and those of plain chunks by hand, of both versions.
fn images() -> Vec<Files> {
    vec![written::<u16>(), written::<u8>(), plain_three(), plain_two()]
}

fn written<T: Element>() -> Files {
    let folder = tempfile::tempdir().expect("room for a store");
    let path = folder.path().join("seed.zarr");
    let store = StoreWriter::create(&path, false).expect("a new store");
    let geometry =
        Geometry { shape: [5, 4, 3], spacing: [0.5, 0.5, 2.0], origin: [0.0; 3], unit: Some("micrometer".into()) };
    let spec = ImageSpec { name: "seed", geometry: &geometry, element: T::TYPE, window: None };
    let image = store.image("", &spec).expect("an image");
    for level in image.levels() {
        for shard in level.shards() {
            let values: Vec<T> = (0..shard.len()).map(|n| T::from_f64((n % 7) as f64)).collect();
            level.write_shard(&shard, &values).expect("a shard");
        }
    }
    store.finish().expect("a whole store");
    stores::contents(&path)
}

fn plain_three() -> Files {
    let group = r#"{"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"version": "0.5", "multiscales": [{"axes": [
        {"name": "z", "type": "space", "unit": "micrometer"}, {"name": "y", "type": "space", "unit": "micrometer"},
        {"name": "x", "type": "space", "unit": "micrometer"}], "datasets": [{"path": "0", "coordinateTransformations":
        [{"type": "scale", "scale": [2.0, 0.5, 0.5]}, {"type": "translation", "translation": [1, 2, 3]}]}]}]}}}"#;
    let array = r#"{"zarr_format": 3, "node_type": "array", "shape": [2, 3, 4], "data_type": "uint16", "chunk_grid": {"name": "regular",
        "configuration": {"chunk_shape": [2, 3, 4]}}, "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": 0, "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}], "dimension_names": ["z", "y", "x"]}"#;
    vec![
        ("zarr.json".to_owned(), group.into()),
        ("0/zarr.json".to_owned(), array.into()),
        ("0/c/0/0/0".to_owned(), (0..48).map(|n| u8::from(n % 2 == 0 && n > 9)).collect()),
    ]
}

fn plain_two() -> Files {
    let attributes = r#"{"multiscales": [{"version": "0.4", "axes": [{"name": "t", "type": "time"}, {"name": "c", "type": "channel"},
        {"name": "z", "type": "space"}, {"name": "y", "type": "space"}, {"name": "x", "type": "space", "unit": "micrometer"}],
        "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 1, 2.0, 0.5, 0.5]}]}],
        "coordinateTransformations": [{"type": "scale", "scale": [1, 1, 1, 1, 1]}]}]}"#;
    let array = r#"{"zarr_format": 2, "shape": [1, 1, 2, 3, 4], "chunks": [1, 1, 1, 3, 4], "dtype": "<i8", "order": "C",
        "compressor": null, "filters": null, "fill_value": 0, "dimension_separator": "/"}"#;
    let chunk = |z: u8| (0..96).map(|n| if n % 8 == 0 { z + 1 } else { 0 }).collect();
    vec![
        (".zgroup".to_owned(), br#"{"zarr_format": 2}"#.to_vec()),
        (".zattrs".to_owned(), attributes.into()),
        ("0/.zarray".to_owned(), array.into()),
        ("0/0/0/0/0/0".to_owned(), chunk(0)),
        ("0/0/0/1/0/0".to_owned(), chunk(1)),
    ]
}
