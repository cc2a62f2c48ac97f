//! `strandline verify`: stores of every command are well, and damage of every kind is told with its place.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;
use zarrs::array::{Array, ArraySubset, Element};
use zarrs::filesystem::FilesystemStore;

use crate::common::ball::{Ball, Bench, HEADER};
use crate::common::clouds::sphere;
use crate::common::random::Random;

/// Two balls that overlap, of which one is in the image, and a cloud.
fn bench() -> Bench {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let beside = Ball { centre: [12.0, 9.0, 9.5], radius: 5.0, ..ball.clone() };
    bench.write("two.csv", &format!("{HEADER}{}{}", ball.marks(1), beside.marks(2)));
    bench.write("cloud.xyz", &lines(&sphere([1.0, 2.0, 3.0], 2.0, 600, |_| true)));
    bench.write("other.xyz", &lines(&sphere([5.0, 2.0, 3.0], 1.0, 200, |_| true)));
    bench
}

fn lines(cloud: &[[f64; 3]]) -> String {
    cloud.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect::<Vec<_>>().join("\n")
}

/// A store with three levels and no checksums, so that what it holds has to tell.
const LONG: &str = "distance cloud.xyz other.xyz -q --labels --shape 300,20,18 --origin -2,0,1 --spacing 0.1";

/// What is printed of a store in which something is wrong.
fn wrong(bench: &Bench, arguments: &str) -> String {
    let output = bench.run(arguments);
    let complaint = String::from_utf8(output.stderr).unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments}: {printed}{complaint}");
    assert!(complaint.contains("checks found something wrong"), "{complaint}");
    printed
}

fn told(printed: &str, words: &[&str]) {
    let line = printed.lines().find(|line| line.starts_with("wrong") && words.iter().all(|word| line.contains(word)));
    assert!(line.is_some(), "{words:?} in:\n{printed}");
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// All files of a folder, by their paths in it.
fn files(folder: &Path) -> Vec<String> {
    strandline::io::ome_zarr::store_files(folder).unwrap()
}

/// Sets a voxel through the `zarrs` crate, so that the chunk is a valid one; x, y, z.
fn set<T: Element>(folder: &Path, array: &str, [x, y, z]: [u64; 3], value: T) {
    let array = Array::open(Arc::new(FilesystemStore::new(folder).unwrap()), array).unwrap();
    let voxel = ArraySubset::new_with_ranges(&[z..z + 1, y..y + 1, x..x + 1]);
    array.store_array_subset(&voxel, &[value]).unwrap();
}

#[test]
fn what_every_command_writes_is_well() {
    let bench = bench();
    for command in [
        "segment image.tif --points two.csv -q",
        "segment image.tif --points two.csv -q --overlap first --ome 0.4",
        "segment image.tif --points two.csv -q --overlap last --live",
        "segment image.tif --points two.csv -q --fill-gaps auto --crop 1:40,2:36,0:20",
        "segment image.tif --points marks.csv -q --compress none",
        "reconstruct cloud.xyz -q",
        "reconstruct cloud.xyz -q --ome 0.4",
        LONG,
        "distance cloud.xyz other.xyz -q --labels --closest-point --shape 30,20,18 --origin -2,0,1 --spacing 0.2 --ome 0.4",
        "distance cloud.xyz -q --method fsm --shape 30,20,18 --origin -2,0,1 --spacing 0.2 --max-distance 0.7 --precision f16",
        "middle cloud.xyz other.xyz -q --shape 30,20,18 --origin -2,0,1 --spacing 0.3",
        "convert image.tif",
    ] {
        let command =
            if command.starts_with("convert") { format!("{command} OUT -q") } else { format!("{command} -o OUT") };
        bench.succeed(&command.replace("OUT", "out/x.zarr"));
        let printed = bench.succeed("verify out/x.zarr");
        assert!(printed.lines().all(|line| line.starts_with("ok ")), "{command}: {printed}");
        assert!(printed.contains("ok     checksums: ") && printed.contains("ok     voxels of image: "), "{printed}");
        assert_eq!(bench.succeed("verify out/x.zarr --quiet --threads 1 --memory 200M"), "");
        fs::remove_dir_all(bench.path("out/x.zarr")).unwrap();
    }
}

/// No byte of a store is without its checksum.
#[test]
fn every_flipped_bit_is_told() {
    let bench = bench();
    for version in ["0.5", "0.4"] {
        let out = bench.path("out/x.zarr");
        bench.succeed(&format!(
            "distance cloud.xyz other.xyz --labels -q --overwrite --shape 12,10,9 --origin -1,1,2 --spacing 0.5 --ome {version} -o \
             out/x.zarr"
        ));
        let mut random = Random(11);
        let mut all = files(&out);
        all.push("checksums.txt".into());
        for file in all {
            let path = out.join(&file);
            let whole = fs::read(&path).unwrap();
            for _ in 0..4 {
                let mut damaged = whole.clone();
                damaged[random.below(whole.len())] ^= 1 << random.below(8);
                fs::write(&path, damaged).unwrap();
                let printed = wrong(&bench, "verify out/x.zarr");
                assert!(file == "checksums.txt" || printed.contains(&file), "{file}: {printed}");
                told(&printed, &["checksums"]);
            }
            fs::write(&path, whole).unwrap();
        }
        assert!(bench.succeed("verify out/x.zarr").lines().all(|line| line.starts_with("ok ")));
    }
}

/// What is wrong shows without checksums too where chunks cannot be decoded or values do not agree.
#[test]
fn shards_that_are_cut_lost_swapped_or_changed_are_told() {
    let bench = bench();
    bench.succeed(&format!("{LONG} -o out/whole.zarr"));
    fs::remove_file(bench.path("out/whole.zarr/checksums.txt")).unwrap();
    let printed = bench.succeed("verify out/whole.zarr");
    assert!(printed.contains("there is no checksums.txt"), "{printed}");
    let damaged = |damage: &dyn Fn(&PathBuf)| {
        let out = bench.path("out/x.zarr");
        copy(&bench.path("out/whole.zarr"), &out);
        damage(&out);
        let printed = wrong(&bench, "verify out/x.zarr");
        fs::remove_dir_all(out).unwrap();
        printed
    };
    let shard = "0/c/0/0/1";
    let cut = damaged(&|out| {
        let bytes = fs::read(out.join(shard)).unwrap();
        fs::write(out.join(shard), &bytes[..bytes.len() - 7]).unwrap();
    });
    told(&cut, &["voxels of image", shard, "cannot be decoded"]);
    // The last byte of the index, before its checksum.
    let index = damaged(&|out| {
        let mut bytes = fs::read(out.join(shard)).unwrap();
        let place = bytes.len() - 6;
        bytes[place] ^= 4;
        fs::write(out.join(shard), bytes).unwrap();
    });
    told(&index, &["voxels of image", shard, "cannot be decoded"]);
    let lost = damaged(&|out| fs::remove_file(out.join(shard)).unwrap());
    told(&lost, &["voxels of image", "1/c/0/0/", "where the finer level gives"]);
    let swapped = damaged(&|out| {
        fs::rename(out.join("0/c/0/0/0"), out.join("a")).unwrap();
        fs::rename(out.join(shard), out.join("0/c/0/0/0")).unwrap();
        fs::rename(out.join("a"), out.join(shard)).unwrap();
    });
    told(&swapped, &["voxels of image", "where the finer level gives"]);
    let coarser = damaged(&|out| set(out, "/1", [97, 3, 2], 5.0_f32));
    told(&coarser, &["voxels of image", "1/c/0/0/0", "voxel 97, 3, 2 is 5"]);
    let label = damaged(&|out| set(out, "/labels/nearest/1", [97, 3, 2], 1_u8));
    told(&label, &["voxels of labels/nearest", "labels/nearest/1/c/0/0/0", "voxel 97, 3, 2 is 1"]);
    told(&damaged(&|out| fs::write(out.join("0/c/0/0/9"), "").unwrap()), &["structure", "0/c/0/0/9", "no part"]);
    told(&damaged(&|out| fs::remove_dir_all(out.join("2")).unwrap()), &["structure", "holds no OME-Zarr image"]);
    told(&damaged(&|out| fs::remove_dir_all(out.join("labels/nearest")).unwrap()), &["structure", "labels", "nearest"]);
    let scaled = damaged(&|out| {
        let text = fs::read_to_string(out.join("zarr.json")).unwrap();
        fs::write(out.join("zarr.json"), text.replacen("0.4", "0.5", 1)).unwrap();
    });
    told(&scaled, &["structure", "extents, spacing and place"]);
}

#[test]
fn labels_meshes_and_reports_that_do_not_fit_are_told() {
    let bench = bench();
    bench.succeed("segment image.tif --points two.csv -q -o out/x.zarr");
    let out = bench.path("out/x.zarr");
    fs::remove_file(out.join("checksums.txt")).unwrap();
    set(&out, "/labels/segmentation/0", [1, 2, 3], 2_u8);
    let printed = wrong(&bench, "verify out/x.zarr");
    told(
        &printed,
        &["labels against level sets", "labels/segmentation/0/c/0/0/0", "voxel 1, 2, 3 has the label 2, and no"],
    );
    told(&printed, &["report.json", "voxels of label 2"]);
    set(&out, "/labels/segmentation/0", [1, 2, 3], 0_u8);
    edit(&out.join("report.json"), |report| report["result"]["objects"][1]["volume"] = 1000.0.into());
    told(&wrong(&bench, "verify out/x.zarr"), &["meshes/object-2.ply", "volume: 1000"]);
    move_first_vertex(&out.join("meshes/object-1.ply"), 0.01);
    let printed = wrong(&bench, "verify out/x.zarr --log json");
    assert_eq!(printed, "", "events go to stderr");
    told(&wrong(&bench, "verify out/x.zarr"), &["meshes/object-1.ply", "vertex 0 at ["]);
    let output = bench.run("verify out/x.zarr --log json");
    let events: Vec<Value> =
        String::from_utf8(output.stderr).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let fault = events.iter().find(|event| event["check"] == "meshes/object-1.ply").unwrap();
    assert_eq!((&fault["ok"], &fault["faults"][0]["file"]), (&false.into(), &"meshes/object-1.ply".into()));
    fs::remove_file(out.join("report.json")).unwrap();
    told(&wrong(&bench, "verify out/x.zarr"), &["report.json", "is missing"]);
    let text = bench.fail("verify out/none.zarr", 2);
    assert!(text.contains("there is no such store"), "{text}");
}

#[test]
fn settings_and_inputs_are_those_of_the_run() {
    let bench = bench();
    bench.succeed(&format!("{LONG} -o out/x.zarr"));
    let settings = |printed: &str| printed.lines().find(|line| line.contains("settings")).unwrap().to_owned();
    let printed = bench.succeed("verify out/x.zarr");
    assert!(settings(&printed).ends_with("7 of 7 facts of the distance that made it"), "{printed}");
    // Of another length, so that it is not the file that was read, whatever its hash.
    bench.write("cloud.xyz", "0 0 0\n");
    let printed = bench.succeed("verify out/x.zarr");
    assert!(settings(&printed).contains("6 of 7") && settings(&printed).contains("cloud.xyz ("), "{printed}");
    let report = bench.path("out/x.zarr/report.json");
    edit(&report, |report| {
        let arguments = report["arguments"].as_array_mut().unwrap();
        *arguments.iter_mut().find(|word| *word == "0.1").unwrap() = "0.2".into();
    });
    told(&wrong(&bench, "verify out/x.zarr"), &["settings", "has --spacing 0.2 in its arguments", "made with 0.1"]);
    bench.succeed(&format!("{LONG} -o out/x.zarr --overwrite --checkpoint off"));
    assert!(settings(&bench.succeed("verify out/x.zarr")).contains("not compared"));
}

/// Moves the first vertex of a mesh along x.
fn move_first_vertex(mesh: &Path, by: f32) {
    let mut bytes = fs::read(mesh).unwrap();
    let start = bytes.windows(11).position(|word| word == b"end_header\n").unwrap() + 11;
    let x = f32::from_le_bytes(bytes[start..start + 4].try_into().unwrap());
    bytes[start..start + 4].copy_from_slice(&(x + by).to_le_bytes());
    fs::write(mesh, bytes).unwrap();
}

#[test]
fn a_middle_surface_lies_where_labels_change() {
    let bench = bench();
    let grid = "--shape 30,20,18 --origin -2,0,1 --spacing 0.3";
    bench.succeed(&format!("middle cloud.xyz other.xyz -q {grid} -o out/x.zarr"));
    fs::remove_file(bench.path("out/x.zarr/checksums.txt")).unwrap();
    assert!(bench.succeed("verify out/x.zarr").contains("vertices where labels/nearest changes"));
    move_first_vertex(&bench.path("out/x.zarr/meshes/surface.ply"), -1.2);
    told(&wrong(&bench, "verify out/x.zarr"), &["meshes/surface.ply", "vertex 0 at [", "lies in the midst of label 1"]);
}

#[test]
fn vertices_at_the_points_lie_near_the_level_set() {
    let bench = bench();
    bench.succeed("reconstruct cloud.xyz -q -o out/x.zarr");
    fs::remove_file(bench.path("out/x.zarr/checksums.txt")).unwrap();
    assert!(bench.succeed("verify out/x.zarr").contains(" of the surface u = 1/2 of "));
    edit(&bench.path("out/x.zarr/report.json"), |report| report["result"]["moved_vertices"] = 1e-4.into());
    told(&wrong(&bench, "verify out/x.zarr"), &["meshes/surface.ply", "from where u crosses 1/2, more than 0.0001"]);
    edit(&bench.path("out/x.zarr/report.json"), |report| report["result"]["moved_vertices"] = 5.0.into());
    move_first_vertex(&bench.path("out/x.zarr/meshes/surface.ply"), -1.2);
    told(&wrong(&bench, "verify out/x.zarr"), &["meshes/surface.ply", "vertex 0 at [", "from where u crosses 1/2"]);
}

fn edit(path: &Path, change: impl Fn(&mut Value)) {
    let mut value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    change(&mut value);
    fs::write(path, value.to_string()).unwrap();
}

#[test]
fn a_second_run_is_the_same_or_told() {
    let bench = bench();
    bench.succeed("segment image.tif --points=two.csv --overlap first -qo out/s.zarr --threads 2 --picture out/p.png");
    bench.succeed(&format!("{LONG} -o out/d.zarr"));
    for (store, layout) in [("s", "--threads 1, --brick 32"), ("d", "--threads ")] {
        let printed = bench.succeed(&format!("verify out/{store}.zarr --rerun"));
        let line = printed.lines().last().unwrap();
        assert!(line.starts_with("ok     rerun: ") && line.contains(layout), "{printed}");
    }
    fs::create_dir(bench.path("other")).unwrap();
    bench.succeed("verify out/d.zarr --rerun --scratch other");
    bench.fail("verify out/d.zarr --rerun --scratch nowhere", 2);
    assert!(bench.entries("other").is_empty());
    assert_eq!(bench.entries("out"), ["d.zarr", "p.png", "s.zarr"], "nothing is left beside");
    bench.write("cloud.xyz", &lines(&sphere([1.1, 2.0, 3.0], 2.0, 600, |_| true)));
    told(&wrong(&bench, "verify out/d.zarr --rerun"), &["rerun", "0/c/0/0/0", "in the second run"]);
    fs::remove_file(bench.path("image.tif")).unwrap();
    let text = bench.fail("verify out/s.zarr --rerun", 2);
    assert!(text.contains("the input image.tif is not there any more"), "{text}");
}
