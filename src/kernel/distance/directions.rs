//! Which sweeps a tile needs: those along the directions in which something still enters its voxels.

/// Directions in an order that turns the layout round only once: x, y, z upward or not.
const CYCLE: [[bool; 3]; 8] = [
    [true, true, true],
    [false, false, true],
    [false, false, false],
    [true, true, false],
    [true, false, false],
    [false, true, false],
    [false, true, true],
    [true, false, true],
];

/// The sides through which voxels fell: bit 2 a for the lower side of axis a, bit 2 a + 1 for the upper one.
pub(crate) type Sides = u32;

/// Repeats `sweep(direction)`, which returns the sides through which voxels fell, until a sweep changes nothing.
/// Starts with `first` and goes on with the directions that the sides call for. Returns whether anything changed.
pub(crate) fn sweep_until_quiet(first: [bool; 3], mut sweep: impl FnMut([bool; 3]) -> Sides) -> bool {
    let mut at = CYCLE.iter().position(|&d| d == first).unwrap_or(0);
    let mut changed = false;
    loop {
        let sides = sweep(CYCLE[at]);
        if sides == 0 {
            return changed;
        }
        changed = true;
        let called = |direction: &[bool; 3]| {
            (0..3).all(|a| {
                let (lower, upper) = (sides >> (2 * a) & 1 == 1, sides >> (2 * a + 1) & 1 == 1);
                (!lower && !upper) || if direction[a] { lower } else { upper }
            })
        };
        // A full turn ends at the same direction again: it is called for by what it carried itself.
        at = (1..=8).map(|step| (at + step) % 8).find(|&n| called(&CYCLE[n])).unwrap_or(at);
    }
}
