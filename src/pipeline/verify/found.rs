//! What a check tells: that all is well, or what is wrong and where.

/// Faults that are told of one check; the others are counted.
const MOST: usize = 20;

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The file, as a path in the store.
    pub file: Option<String>,
    /// The voxel of the image that is looked at, x, y, z.
    pub voxel: Option<[i64; 3]>,
    /// What is wrong.
    pub text: String,
}

/// A check that was made.
#[derive(Clone, Debug, Default)]
pub struct Check {
    /// What was looked at.
    pub name: String,
    /// What was compared, and what this check cannot decide.
    pub told: String,
    /// What is wrong, at most `MOST`.
    pub faults: Vec<Fault>,
    /// How many more are wrong.
    pub more: u64,
}

impl Check {
    /// One that has found nothing so far.
    pub(crate) fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Whether all is well.
    #[must_use]
    pub fn is_ok(&self) -> bool {
        self.faults.is_empty()
    }

    /// Adds a fault; one of the same words at the same file is told once.
    pub(super) fn add(&mut self, fault: Fault) {
        if self.faults.iter().any(|told| told.text == fault.text && told.file == fault.file) {
            return;
        }
        if self.faults.len() < MOST {
            self.faults.push(fault);
        } else {
            self.more += 1;
        }
    }

    /// Something wrong that concerns no file alone.
    pub(super) fn wrong(&mut self, text: impl Into<String>) {
        self.add(Fault { file: None, voxel: None, text: text.into() });
    }

    /// Something wrong with a file.
    pub(crate) fn wrong_in(&mut self, file: impl Into<String>, text: impl Into<String>) {
        self.add(Fault { file: Some(file.into()), voxel: None, text: text.into() });
    }

    /// Adds to what was compared.
    pub(crate) fn also(&mut self, told: &str) {
        self.told.push_str(told);
    }

    /// Takes over the faults of several parts.
    pub(super) fn take_all(&mut self, parts: Vec<Self>) {
        for part in parts {
            self.take(part);
        }
    }

    /// Takes over the faults of a part of the check, and how many more there are.
    pub(super) fn take(&mut self, part: Self) {
        part.faults.into_iter().for_each(|fault| self.add(fault));
        self.more += part.more;
    }
}

/// The fault of a voxel of an image.
pub(super) fn at(file: String, voxel: [i64; 3], text: String) -> Fault {
    Fault { file: Some(file), voxel: Some(voxel), text }
}
