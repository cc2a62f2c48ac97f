//! Colours for labels: hues that walk around the colour circle by the golden ratio, so that any first n of them lie
//! far apart and a label keeps its colour whatever others there are.

/// The red, green and blue of a label; the background (0) is black.
#[must_use]
pub fn label_color(label: u32) -> [u8; 3] {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    if label == 0 {
        return [0; 3];
    }
    // The first hue is a warm orange, which stands out on a grey image.
    let hue = (0.09 + f64::from(label - 1) * GOLDEN).fract();
    // Every full set of colours is a little different in brightness from the one before.
    let value = [1.0, 0.86, 0.93][(label as usize - 1) / 8 % 3];
    from_hsv(hue, 0.72, value)
}

/// Hue, saturation and value (each 0 to 1) as red, green and blue.
fn from_hsv(hue: f64, saturation: f64, value: f64) -> [u8; 3] {
    [5.0, 3.0, 1.0].map(|offset: f64| {
        let k = (offset + hue * 6.0) % 6.0;
        let channel = value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0);
        (channel * 255.0).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_the_colour_circle() {
        assert_eq!(from_hsv(0.0, 1.0, 1.0), [255, 0, 0]);
        assert_eq!(from_hsv(1.0 / 3.0, 1.0, 1.0), [0, 255, 0]);
        assert_eq!(from_hsv(0.5, 1.0, 1.0), [0, 255, 255]);
        assert_eq!(from_hsv(0.7, 0.0, 0.5), [128; 3]);
    }

    #[test]
    fn the_first_labels_differ_clearly() {
        assert_eq!(label_color(0), [0; 3]);
        for a in 1..12_u32 {
            for b in a + 1..12 {
                let (a, b) = (label_color(a), label_color(b));
                let apart: i32 = (0..3).map(|c| (i32::from(a[c]) - i32::from(b[c])).abs()).sum();
                assert!(apart > 30, "{a:?} and {b:?} look alike");
            }
        }
        assert_ne!(label_color(u32::MAX), [0; 3]);
    }
}
