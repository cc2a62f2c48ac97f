//! Files with a few wrong bytes.

use super::random::Random;

/// One of the files with up to five of its bytes changed, left out or put in from `letters`, and now and then cut short.
pub(crate) fn damaged(random: &mut Random, files: &[Vec<u8>], letters: &[u8]) -> Vec<u8> {
    let mut file = files[random.below(files.len())].clone();
    for _ in 0..=random.below(4) {
        let place = random.below(file.len());
        match random.below(4) {
            0 => file[place] = random.below(256) as u8,
            1 => file[place] ^= 1 << random.below(8),
            2 => drop(file.remove(place)),
            _ => file.insert(place, letters[random.below(letters.len())]),
        }
    }
    file.truncate(file.len().saturating_sub(random.below(8).saturating_sub(5)));
    file
}
