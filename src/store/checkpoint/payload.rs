//! The bricks of a field in a file: a head, then of each stored brick that was written its number, the CRC-32C of number and values,
//! and its values, little-endian, as they lie in it. Of a field that has faces alone it is these. A rank of several writes the bricks
//! that it owns, and takes those that it owns out of the files of all.

use std::io::{self, Read, Seek, Write};

use crate::grid::{BrickId, BrickSet, FACES, Slot};
use crate::store::{BrickArray, Element};

/// What the files begin with.
const MAGIC: [u8; 8] = *b"slbricks";
/// Magic, digest of the grid, name of the type, values of a brick, bricks in the file, checksum.
const HEAD: usize = 8 + 4 + 8 + 8 + 8 + 4;
/// Number and checksum.
const BRICK_HEAD: usize = 8 + 4;

/// A field that can be put into a checkpoint.
pub trait SavedField: Sync {
    /// Bytes of its file.
    fn saved_bytes(&self) -> u64;

    /// Writes it; `goes_on` is asked between bricks.
    ///
    /// # Errors
    /// When it cannot be written, or is not to go on.
    fn save(&self, out: &mut dyn Write, goes_on: &dyn Fn() -> io::Result<()>) -> io::Result<()>;
}

impl<T: Element> SavedField for BrickArray<T> {
    fn saved_bytes(&self) -> u64 {
        bytes_of(self, written(self).count())
    }

    fn save(&self, out: &mut dyn Write, goes_on: &dyn Fn() -> io::Result<()>) -> io::Result<()> {
        save(self, &written(self).collect::<Vec<_>>(), out, goes_on)
    }
}

/// Some bricks of a field, where the others are not needed any more or hold nothing yet.
pub struct SomeBricks<'a, T: Element> {
    /// The field.
    pub field: &'a BrickArray<T>,
    /// The bricks.
    pub slots: Vec<Slot>,
}

impl<T: Element> SavedField for SomeBricks<'_, T> {
    fn saved_bytes(&self) -> u64 {
        bytes_of(self.field, self.slots.len())
    }

    fn save(&self, out: &mut dyn Write, goes_on: &dyn Fn() -> io::Result<()>) -> io::Result<()> {
        save(self.field, &self.slots, out, goes_on)
    }
}

fn bytes_of<T: Element>(field: &BrickArray<T>, bricks: usize) -> u64 {
    (HEAD + bricks * (BRICK_HEAD + values_of(field) * size_of::<T>())) as u64
}

/// Values that are kept of a brick.
fn values_of<T: Element>(field: &BrickArray<T>) -> usize {
    let area = field.set().grid().edge().pow(2) as usize;
    if is_faces_alone(field) { FACES.len() * area } else { field.values_of_brick() }
}

fn is_faces_alone<T: Element>(field: &BrickArray<T>) -> bool {
    field.values_of_brick() == 0 && field.has_faces()
}

fn save<T: Element>(
    field: &BrickArray<T>,
    slots: &[Slot],
    out: &mut dyn Write,
    goes_on: &dyn Fn() -> io::Result<()>,
) -> io::Result<()> {
    out.write_all(&head(field, slots.len() as u64))?;
    let mut bytes = Vec::with_capacity(values_of(field) * size_of::<T>());
    for &slot in slots {
        goes_on()?;
        bytes.clear();
        if is_faces_alone(field) {
            for face in FACES {
                field.read_face(slot, face, |values| T::append_bytes(values, &mut bytes));
            }
        } else {
            field.read(slot, |values| T::append_bytes(values, &mut bytes));
        }
        let id = field.set().id(slot);
        out.write_all(&id.to_le_bytes())?;
        out.write_all(&checksum(id, &bytes).to_le_bytes())?;
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// The bricks that hold more than the value they began with.
fn written<T: Element>(field: &BrickArray<T>) -> impl Iterator<Item = Slot> + '_ {
    field.set().owned().filter(|&slot| field.unwritten(slot).is_none())
}

fn checksum(id: BrickId, bytes: &[u8]) -> u32 {
    crc32c::crc32c_append(crc32c::crc32c(&id.to_le_bytes()), bytes)
}

fn head<T: Element>(field: &BrickArray<T>, count: u64) -> Vec<u8> {
    let mut name = [0_u8; 8];
    let told = T::TYPE.name().as_bytes();
    name[..told.len().min(8)].copy_from_slice(&told[..told.len().min(8)]);
    let mut head = MAGIC.to_vec();
    head.extend(digest(field.set()).to_le_bytes());
    head.extend(name);
    head.extend((values_of(field) as u64).to_le_bytes());
    head.extend(count.to_le_bytes());
    head.extend(crc32c::crc32c(&head).to_le_bytes());
    head
}

/// What tells one grid of bricks from others.
fn digest(set: &BrickSet) -> u32 {
    let grid = set.grid();
    let numbers = grid.shape().into_iter().chain([grid.edge()]);
    numbers.fold(0, |sum, number| crc32c::crc32c_append(sum, &number.to_le_bytes()))
}

/// Goes through a file of bricks and checks it.
///
/// # Errors
/// When it is cut short or damaged.
pub(super) fn check(from: &mut dyn Read, bytes: u64) -> io::Result<()> {
    let mut head = [0; HEAD];
    from.read_exact(&mut head)?;
    let sum = crc32c::crc32c(&head[..HEAD - 4]);
    if head[..8] != MAGIC || head[HEAD - 4..] != sum.to_le_bytes() {
        return Err(damaged("is damaged at its beginning"));
    }
    let count = number(&head[28..36]);
    let of_bricks = bytes.saturating_sub(HEAD as u64);
    let brick = of_bricks.checked_div(count).unwrap_or(0);
    if count.checked_mul(brick) != Some(of_bricks) || (count > 0 && brick < BRICK_HEAD as u64) {
        return Err(damaged("has not the length that it tells"));
    }
    let mut record = vec![0; brick as usize];
    for _ in 0..count {
        from.read_exact(&mut record)?;
        take(&record)?;
    }
    Ok(())
}

/// A brick's number and its bytes out of a record whose checksum fits.
fn take(record: &[u8]) -> io::Result<(BrickId, &[u8])> {
    let (head, bytes) = record.split_at(BRICK_HEAD);
    let id = number(&head[..8]);
    if head[8..] != checksum(id, bytes).to_le_bytes() {
        return Err(damaged("is damaged: the checksum of a brick does not fit"));
    }
    Ok((id, bytes))
}

/// Puts the bricks of a file that the field owns back where they were, with their faces where the field has some; others stay as they
/// are. Returns how many these were, and how many the file has.
///
/// # Errors
/// When the file is cut short or damaged, or is that of another field.
pub fn restore<T: Element>(field: &BrickArray<T>, from: &mut (impl Read + Seek)) -> io::Result<[u64; 2]> {
    let mut there = [0; HEAD];
    from.read_exact(&mut there)?;
    let count = number(&there[28..36]);
    if there[..] != head(field, count)[..] {
        return Err(damaged("is of another field than that of this run"));
    }
    let (mut restored, mut record) = (0, vec![0; BRICK_HEAD + values_of(field) * size_of::<T>()]);
    for _ in 0..count {
        from.read_exact(&mut record[..BRICK_HEAD])?;
        let Some(slot) = field.set().own_slot(number(&record[..8])) else {
            from.seek_relative((record.len() - BRICK_HEAD) as i64)?;
            continue;
        };
        from.read_exact(&mut record[BRICK_HEAD..])?;
        let (_, bytes) = take(&record)?;
        restored += 1;
        if is_faces_alone(field) {
            field.write_faces(slot, |values| T::fill_from_bytes(values, bytes));
            continue;
        }
        field.write(slot, |values| T::fill_from_bytes(values, bytes));
        if field.has_faces() {
            field.refresh_faces(slot);
        }
    }
    Ok([restored, count])
}

fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}

fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;
    use std::sync::Arc;

    use super::*;
    use crate::grid::BrickGrid;
    use crate::store::Scratch;

    fn field(scratch: &Scratch) -> BrickArray<f32> {
        let set = Arc::new(BrickSet::from_fn(BrickGrid::new([40, 33, 20], 16), |id| id != 2));
        BrickArray::blank(scratch, &set, 9.0).unwrap()
    }

    #[test]
    fn written_bricks_come_back_with_their_faces_and_no_others() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 1 << 30);
        let (before, after) = (field(&scratch), field(&scratch));
        for slot in [0, 3, 4] {
            before.write(slot, |brick| {
                (0..).zip(brick.iter_mut()).for_each(|(n, value)| *value = (slot * 5000 + n) as f32);
            });
        }
        let mut file = Vec::new();
        before.save(&mut file, &|| Ok(())).unwrap();
        assert_eq!(file.len() as u64, before.saved_bytes());
        check(&mut file.as_slice(), file.len() as u64).unwrap();
        assert_eq!(restore(&after, &mut Cursor::new(&file)).unwrap(), [3; 2]);
        for slot in before.set().owned() {
            assert_eq!(after.unwritten(slot), before.unwritten(slot));
            before.read(slot, |from| after.read(slot, |to| assert!(before.unwritten(slot).is_some() || from == to)));
        }
        after.read_face(3, crate::grid::FACES[0], |face| assert_eq!(face[1], 15_016.0));
    }

    #[test]
    fn some_bricks_come_back_alone() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 1 << 30);
        let (before, after) = (field(&scratch), field(&scratch));
        before.set().owned().for_each(|slot| before.write(slot, |brick| brick.fill(slot as f32)));
        let some = SomeBricks { field: &before, slots: vec![1, 3] };
        let mut file = Vec::new();
        some.save(&mut file, &|| Ok(())).unwrap();
        assert_eq!(file.len() as u64, some.saved_bytes());
        check(&mut file.as_slice(), file.len() as u64).unwrap();
        assert_eq!(restore(&after, &mut Cursor::new(&file)).unwrap(), [2; 2]);
        for slot in before.set().owned() {
            let is_back = [1, 3].contains(&slot);
            assert_eq!(after.unwritten(slot).is_none(), is_back, "{slot}");
            after.read(slot, |brick| assert!(!is_back || brick.iter().all(|&value| value == slot as f32)));
        }
    }

    #[test]
    fn faces_come_back_where_there_is_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 1 << 30);
        let faces = || BrickArray::blank_faces(&scratch, field(&scratch).set(), 9.0_f32).unwrap();
        let (before, after) = (faces(), faces());
        before.write_faces(2, |faces| (0..).zip(faces).for_each(|(n, value)| *value = n as f32));
        let mut file = Vec::new();
        before.save(&mut file, &|| Ok(())).unwrap();
        assert_eq!(file.len() as u64, before.saved_bytes());
        check(&mut file.as_slice(), file.len() as u64).unwrap();
        assert_eq!(restore(&after, &mut Cursor::new(&file)).unwrap(), [1; 2]);
        assert_eq!((after.unwritten(2), after.unwritten(1)), (None, Some(9.0)));
        for (n, face) in FACES.into_iter().enumerate() {
            after.read_face(2, face, |values| {
                assert_eq!((values[0], values[255]), ((n * 256) as f32, (n * 256 + 255) as f32));
            });
        }
    }

    /// What ranks own of a field, put by, comes back on any number of ranks.
    #[test]
    fn ranks_take_their_bricks_out_of_the_files_of_all() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 1 << 30);
        let whole = field(&scratch).set().clone();
        let part = |owned: std::ops::Range<BrickId>| {
            let set = Arc::new(whole.part(&owned, &FACES.map(crate::grid::Face::offset)));
            BrickArray::blank(&scratch, &set, 9.0_f32).unwrap()
        };
        let mut files = Vec::new();
        for owned in [0..5, 5..12] {
            let field = part(owned);
            field.set().owned().for_each(|slot| field.write(slot, |brick| brick.fill(field.set().id(slot) as f32)));
            let mut file = Vec::new();
            field.save(&mut file, &|| Ok(())).unwrap();
            files.push(file);
        }
        for owned in [0..12, 0..3, 3..9, 9..12] {
            let field = part(owned);
            let restored: u64 = files.iter().map(|file| restore(&field, &mut Cursor::new(file)).unwrap()[0]).sum();
            assert_eq!(restored, field.set().owned().len() as u64);
            for slot in field.set().owned() {
                field.read(slot, |brick| assert!(brick.iter().all(|&value| value == field.set().id(slot) as f32)));
            }
        }
    }

    #[test]
    fn damage_is_seen_by_who_checks_and_by_who_restores() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 1 << 30);
        let before = field(&scratch);
        before.write(1, |brick| brick.fill(2.5));
        let mut whole = Vec::new();
        before.save(&mut whole, &|| Ok(())).unwrap();
        for at in (0..whole.len()).step_by(61).chain(0..HEAD + BRICK_HEAD) {
            let mut damaged = whole.clone();
            damaged[at] ^= 1 << (at % 8);
            let is_seen = check(&mut damaged.as_slice(), damaged.len() as u64).is_err();
            assert!(is_seen, "a bit of byte {at}");
            let is_seen =
                restore(&field(&scratch), &mut Cursor::new(damaged)).map_or(true, |[restored, _]| restored < 1);
            assert!(is_seen, "a bit of byte {at}");
            assert!(check(&mut &whole[..at], at as u64).is_err(), "cut at {at}");
            assert!(restore(&field(&scratch), &mut Cursor::new(&whole[..at])).is_err(), "cut at {at}");
        }
    }
}
