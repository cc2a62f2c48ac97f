//! What is found in a folder of checkpoints after runs that ended in any way.

use std::io::Write;
use std::sync::Arc;

use super::*;
use crate::grid::{BrickGrid, BrickSet};
use crate::store::{BrickArray, Scratch};

fn numbers(folder: &Path) -> Vec<u64> {
    manifests(folder).into_iter().map(|(number, _)| number).collect()
}

fn identity(spacing: &str) -> Identity {
    vec![("version".into(), "1".into()), ("--spacing".into(), spacing.into())]
}

fn field(scratch: &Scratch, value: f32) -> BrickArray<f32> {
    let set = Arc::new(BrickSet::dense(BrickGrid::new([32, 32, 16], 16)));
    let field = BrickArray::new(scratch, &set).unwrap();
    set.owned().for_each(|slot| field.write(slot, |brick| brick.fill(value)));
    field
}

/// Three checkpoints of one stage and one of another, in a folder that is let go.
fn made(folder: &Path, scratch: &Scratch) {
    let run = Checkpoints::begin(folder, identity("2"), false).unwrap();
    for step in 1..=3_u8 {
        run.save("moving", vec![step], (&[&field(scratch, f32::from(step))], &[]), &|| Ok(()), None).unwrap();
    }
    run.save("other", vec![9], (&[], &[]), &|| Ok(()), None).unwrap();
    let failing =
        run.save("moving", vec![4], (&[&field(scratch, 4.0)], &[]), &|| Err(io::Error::other("not now")), None);
    assert_eq!(failing.unwrap_err().to_string(), "not now");
}

#[test]
fn a_run_goes_on_from_the_last_whole_checkpoint() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("c.checkpoint");
    let scratch = Scratch::new(dir.path(), 1 << 30);
    made(&folder, &scratch);
    assert_eq!(numbers(&folder), [3, 4]);
    let facts =
        |run: &Checkpoints| run.entry("moving").map(|kept| (kept.parts[0].facts.clone(), kept.parts[0].files.len()));
    let (run, found) = Checkpoints::resume(&folder, identity("2")).unwrap();
    assert_eq!((found.stages, found.torn.len(), facts(&run)), (2, 0, Some((vec![3], 1))));
    let busy = [Checkpoints::resume(&folder, identity("2")).err().unwrap(), Checkpoints::would_be_lost(&folder)];
    let is_told = |error: Error| error.to_string().contains("belongs to a run that goes on (host");
    assert!(busy.into_iter().all(is_told));
    drop(run);
    let file = folder.join("000004.checkpoint");
    let whole = fs::read(&file).unwrap();
    fs::write(&file, &whole[..whole.len() - 1]).unwrap();
    let (run, found) = Checkpoints::resume(&folder, identity("2")).unwrap();
    assert_eq!((found.stages, found.torn.len(), facts(&run)), (1, 1, Some((vec![3], 1))));
    run.save("moving", vec![5], (&[&field(&scratch, 5.0)], &[]), &|| Ok(()), None).unwrap();
    assert_eq!(numbers(&folder), [3, 5], "a number is never used again, and the torn one is gone");
    run.clear();
    assert!(!folder.exists());
}

#[test]
fn a_damaged_field_leaves_nothing_to_go_on_with_where_both_checkpoints_name_it() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("c");
    let scratch = Scratch::new(dir.path(), 1 << 30);
    made(&folder, &scratch);
    let file = folder.join("000003-0.bricks");
    let mut bytes = fs::read(&file).unwrap();
    bytes[5000] ^= 4;
    fs::write(&file, bytes).unwrap();
    let (run, found) = Checkpoints::resume(&folder, identity("2")).unwrap();
    assert_eq!((found.stages, found.torn.len()), (0, 1));
    assert!(found.torn[0].contains("the checksum of a brick does not fit"), "{:?}", found.torn);
    assert!(run.entry("moving").is_none() && run.entry("other").is_none());
}

#[test]
fn files_of_the_output_are_linked_once_and_go_with_the_checkpoints_that_name_them() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("c.checkpoint");
    let file = |name: &str| {
        let path = dir.path().join(name);
        fs::write(&path, name).unwrap();
        Linked { path, name: name.to_owned() }
    };
    let (a, b, c) = (file("a"), file("b"), file("c"));
    let linked = || {
        let mut names = names(&folder);
        names.retain(|name| name.contains(".shard"));
        names.sort();
        names
    };
    let run = Checkpoints::begin(&folder, identity("2"), false).unwrap();
    let save =
        |run: &Checkpoints, linked: &[Linked]| run.save("writing", vec![1], (&[], linked), &|| Ok(()), None).unwrap();
    // A name that a killed run left is in nobody's way.
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("000002-1.shard"), "left").unwrap();
    assert_eq!(save(&run, std::slice::from_ref(&a)).bytes, 0);
    fs::write(folder.join("000002-1.shard"), "left").unwrap();
    save(&run, &[a.clone(), b.clone()]);
    assert_eq!(linked(), ["000001-0.shard", "000002-1.shard"]);
    for gone in [&a, &b] {
        fs::remove_file(&gone.path).unwrap();
    }
    drop(run);
    let (run, found) = Checkpoints::resume(&folder, identity("2")).unwrap();
    let links = run.entry("writing").unwrap().parts[0].links.clone();
    assert_eq!((found.torn.len(), links.len()), (0, 2));
    assert_eq!(links.iter().map(|link| fs::read(link).unwrap()).collect::<Vec<_>>(), [b"a", b"b"]);
    run.forget("writing");
    assert!(run.entry("writing").is_none());
    // Anew: what was linked before is linked no more when no manifest that is kept names it.
    for linked in [&a, &b] {
        file(&linked.name);
    }
    save(&run, std::slice::from_ref(&b));
    save(&run, &[b, c]);
    assert_eq!(linked(), ["000003-0.shard", "000004-1.shard"]);
    let missing = Linked { path: dir.path().join("nowhere"), name: "d".into() };
    let failed = run.save("writing", vec![2], (&[], &[missing]), &|| Ok(()), None).unwrap_err().to_string();
    assert!(failed.contains("cannot have a second name"), "{failed}");
    assert_eq!((run.entry("writing").unwrap().parts[0].facts.clone(), numbers(&folder)), (vec![1], vec![3, 4]));
    run.clear();
    assert!(!folder.exists() && a.path.exists());
}

#[test]
fn other_runs_are_refused_and_nothing_is_lost_without_leave() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("c");
    made(&folder, &Scratch::new(dir.path(), 1 << 30));
    let error = Checkpoints::resume(&folder, identity("3")).err().unwrap().to_string();
    assert!(error.contains("--spacing was 2 and is 3"), "{error}");
    let error = Checkpoints::begin(&folder, identity("2"), false).err().unwrap().to_string();
    assert!(error.contains("give --resume to go on with it"), "{error}");
    let (_, found) = Checkpoints::resume(&dir.path().join("nowhere"), identity("2")).unwrap();
    assert_eq!(found, Found::default());
    let mine = ["mine.txt", "2024-11-05.bricks", "12-3.shard", "lock"];
    for name in mine {
        fs::write(folder.join(name), "x").unwrap();
    }
    drop(Checkpoints::begin(&folder, identity("3"), true).unwrap());
    assert!(numbers(&folder).is_empty() && mine.iter().all(|name| folder.join(name).exists()));
}

#[test]
fn runs_that_began_in_one_folder_leave_each_others_checkpoints() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("c");
    let [first, second] = ["2", "3"].map(|spacing| Checkpoints::begin(&folder, identity(spacing), false).unwrap());
    first.save("moving", vec![1], (&[], &[]), &|| Ok(()), None).unwrap();
    let refused = second.save("moving", vec![2], (&[], &[]), &|| Ok(()), None).unwrap_err().to_string();
    assert!(refused.contains("belongs to a run that goes on"), "{refused}");
    second.clear();
    assert_eq!(numbers(&folder), [1]);
    drop(first);
    let refused = second.save("moving", vec![2], (&[], &[]), &|| Ok(()), None).unwrap_err().to_string();
    assert!(refused.contains("another run has put checkpoints"), "{refused}");
    second.clear();
    assert_eq!(numbers(&folder), [1]);
}

/// A field that claims to be larger than any disk.
struct Endless;

impl SavedField for Endless {
    fn saved_bytes(&self) -> u64 {
        1 << 60
    }

    fn save(&self, _: &mut dyn Write, _: &dyn Fn() -> io::Result<()>) -> io::Result<()> {
        panic!("what does not fit is not begun with")
    }
}

#[test]
fn what_does_not_fit_is_told_with_what_it_needs_and_the_last_one_stays() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("c.checkpoint");
    let scratch = Scratch::new(dir.path(), 1 << 30);
    let run = Checkpoints::begin(&folder, identity("2"), false).unwrap();
    for step in 1..=2_u8 {
        run.save("moving", vec![step], (&[&field(&scratch, f32::from(step))], &[]), &|| Ok(()), None).unwrap();
    }
    assert_eq!(numbers(&folder), [1, 2]);
    let full = run.save("moving", vec![3], (&[&Endless], &[]), &|| Ok(()), None).unwrap_err();
    let said = full.to_string();
    assert_eq!(full.kind(), io::ErrorKind::StorageFull);
    assert!(said.contains("c.checkpoint: the disk is full: a checkpoint needs 1048576 TiB, and has "), "{said}");
    // The room of the one before may be what the run needs.
    assert_eq!((numbers(&folder), names(&folder).len()), (vec![2], 2));
    // Of one that fails half way nothing stays.
    let small = field(&scratch, 4.0);
    let count = std::cell::Cell::new(0);
    let goes_on = || {
        count.set(count.get() + 1);
        if count.get() < 7 { Ok(()) } else { Err(io::Error::other("enough")) }
    };
    assert!(run.save("moving", vec![4], (&[&small, &small], &[]), &goes_on, None).is_err());
    assert_eq!((numbers(&folder), names(&folder).len()), (vec![2], 2));
    drop(run);
    let (run, found) = Checkpoints::resume(&folder, identity("2")).unwrap();
    assert_eq!((found.torn.len(), run.entry("moving").unwrap().parts[0].facts.clone()), (0, vec![2]));
}

#[test]
fn what_somebody_removes_is_not_named_again() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("c.checkpoint");
    let scratch = Scratch::new(dir.path(), 1 << 30);
    let run = Checkpoints::begin(&folder, identity("2"), false).unwrap();
    let save = |stage: &str| run.save(stage, vec![1], (&[&field(&scratch, 1.0)], &[]), &|| Ok(()), None);
    save("first").unwrap();
    save("second").unwrap();
    fs::remove_file(folder.join("000001-0.bricks")).unwrap();
    save("third").unwrap();
    let known = || ["first", "second", "third"].map(|stage| run.entry(stage).is_some());
    assert_eq!(known(), [false, true, true]);
    // All of it, and something else comes in its place: told each time, and good again when that goes.
    fs::remove_dir_all(&folder).unwrap();
    fs::write(&folder, "mine").unwrap();
    let refused = save("first").unwrap_err().to_string();
    assert!(refused.contains("c.checkpoint: cannot be made: "), "{refused}");
    fs::remove_file(&folder).unwrap();
    save("first").unwrap();
    assert_eq!((known(), numbers(&folder).len()), ([true, false, false], 1));
    let busy = Checkpoints::resume(&folder, identity("2")).err().unwrap().to_string();
    assert!(busy.contains("belongs to a run that goes on"), "{busy}");
    run.clear();
    assert!(!folder.exists());
}

/// What several ranks put by together stands where all of them have; what one has put by for itself stands alone.
#[test]
fn ranks_go_on_from_the_last_that_all_of_them_have() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("c.checkpoint");
    let begun = |first: Checkpoints, ranks: usize| {
        let (first, shared) = first.of_first(ranks).unwrap();
        let others = (1..ranks).map(|rank| Checkpoints::of_rank(shared.clone(), rank, ranks).unwrap());
        std::iter::once(first).chain(others).collect::<Vec<_>>()
    };
    let together = |run: &Checkpoints, facts: u8, is_whole: bool| {
        run.save("solved", vec![facts], (&[], &[]), &|| Ok(()), Some(&|_| Ok(is_whole))).map(drop)
    };
    let alone = |run: &Checkpoints, key: &str, facts: u8| {
        run.save(key, vec![facts], (&[], &[]), &|| Ok(()), None).unwrap();
    };
    let facts = |run: &Checkpoints, key: &str| {
        run.entry(key).map(|kept| kept.parts.into_iter().map(|part| part.facts[0]).collect::<Vec<_>>())
    };
    let ranks = begun(Checkpoints::begin(&folder, identity("2"), false).unwrap(), 3);
    (0..).zip(&ranks).for_each(|(rank, run)| together(run, 10 + rank, true).unwrap());
    alone(&ranks[2], "object 5", 50);
    // The second rank could not put by its part of another one; and then all but one have.
    (0..).zip(&ranks).for_each(|(rank, run)| assert!(together(run, 20 + rank, false).is_err()));
    (0..).zip(&ranks[..2]).for_each(|(rank, run)| together(run, 30 + rank, true).unwrap());
    drop(ranks);
    let resumed = || Checkpoints::resume(&folder, identity("2")).unwrap();
    let (one, found) = resumed();
    assert_eq!((found.stages, found.torn.len()), (2, 0));
    assert_eq!((facts(&one, "solved"), facts(&one, "object 5")), (Some(vec![10, 11, 12]), Some(vec![50])));
    // On two ranks, of which one puts by something of its own before all do.
    let ranks = begun(one, 2);
    let known: Vec<_> = ranks.iter().map(|run| facts(run, "solved")).collect();
    assert_eq!(known, [Some(vec![10, 11, 12]), Some(vec![10, 11, 12])]);
    alone(&ranks[1], "object 6", 60);
    drop(ranks);
    let (one, _) = resumed();
    let known = ["solved", "object 5", "object 6"].map(|key| facts(&one, key));
    assert_eq!(known, [Some(vec![10, 11, 12]), Some(vec![50]), Some(vec![60])]);
    let ranks = begun(one, 2);
    (0..).zip(&ranks).for_each(|(rank, run)| together(run, 40 + rank, true).unwrap());
    drop(ranks);
    // On one: when it has put by twice nothing of the ranks is left but what it still knows from them.
    let (one, _) = resumed();
    assert_eq!(facts(&one, "solved"), Some(vec![40, 41]));
    alone(&one, "solved", 70);
    alone(&one, "solved", 71);
    assert!(names(&folder).iter().all(|name| !name.contains("-r")), "{:?}", names(&folder));
    assert_eq!(facts(&one, "object 6"), Some(vec![60]));
    one.clear();
    assert!(!folder.exists());
}
