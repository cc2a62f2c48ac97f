//! Pictures of slices through a field of numbers: each value a colour, dark lines where it passes a multiple of a step, white ones
//! where it changes its sign and between labels.

use super::panel::{BACKGROUND, Rgb, Slice};
use super::ramp::Ramp;

const LINE: [u8; 3] = [255, 255, 255];
/// How dark the lines of equal values are.
const SHADE: f64 = 0.62;

/// Draws a slice, its values as its intensities, with `scale` pixels to a slice's pixel along its rows; `window` are the values of the
/// first and the last colour, lines of equal values lie `step` apart. What is not finite is left dark.
///
/// # Panics
/// When the slices do not fit their size, the size is zero, or scale, aspect or step is not positive.
#[must_use]
pub fn field_panel(slice: &Slice<'_>, window: [f64; 2], step: f64, scale: f64) -> Rgb {
    let len = slice.width * slice.height;
    assert!(len > 0 && slice.grey.len() == len && slice.labels.len() == len, "the slices do not fit their size");
    assert!(step > 0.0 && scale > 0.0 && slice.pixel_aspect > 0.0, "step, scale and aspect must be positive");
    let size = |n: usize, scale: f64| ((n as f64 * scale).round() as usize).max(1);
    let (width, height) = (size(slice.width, scale), size(slice.height, scale * slice.pixel_aspect));
    let mut values = Vec::with_capacity(width * height);
    let mut labels = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            let place = slice.place([column, row], [width, height]);
            values.push(f64::from(slice.grey_at(place)));
            let nearest = [(place[0], slice.width), (place[1], slice.height)]
                .map(|(at, n)| (at.round().max(0.0) as usize).min(n - 1));
            labels.push(slice.labels[nearest[1] * slice.width + nearest[0]]);
        }
    }
    let mut pixels = Vec::with_capacity(3 * width * height);
    for at in 0..width * height {
        let beside = [(at % width + 1 < width).then_some(at + 1), (at / width + 1 < height).then_some(at + width)];
        let differs = |of: &dyn Fn(usize) -> bool| beside.into_iter().flatten().any(of);
        let value = values[at];
        if !value.is_finite() {
            pixels.extend(BACKGROUND);
        } else if differs(&|other| labels[other] != labels[at] || (values[other] < 0.0) != (value < 0.0)) {
            pixels.extend(LINE);
        } else {
            let color = Ramp::Size.color((value - window[0]) / (window[1] - window[0]));
            let on_line = differs(&|other| (values[other] / step).floor() != (value / step).floor());
            pixels.extend(color.map(|c| if on_line { (f64::from(c) * SHADE).round() as u8 } else { c }));
        }
    }
    Rgb { width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_lie_where_values_pass_steps_and_labels_change() {
        let grey: Vec<f32> = (0..10 * 4).map(|n| (n % 10) as f32 - 2.5).collect();
        let labels: Vec<u32> = (0..10 * 4).map(|n| u32::from(n % 10 >= 8)).collect();
        let slice = Slice { grey: &grey, labels: &labels, width: 10, height: 4, pixel_aspect: 1.0 };
        let picture = field_panel(&slice, [-2.5, 6.5], 3.0, 1.0);
        let row: Vec<[u8; 3]> = picture.pixels[..30].chunks(3).map(|p| p.try_into().unwrap()).collect();
        assert_eq!(row[0], Ramp::Size.stops()[0]);
        assert_eq!(row[9], Ramp::Size.stops()[4]);
        // From -0.5 to 0.5, and from label 0 to 1.
        assert_eq!((row[2], row[7]), (LINE, LINE));
        // From 2.5 to 3.5.
        let plain = Ramp::Size.color(5.0 / 9.0);
        assert_eq!(row[5], plain.map(|c| (f64::from(c) * SHADE).round() as u8));
        assert!([1, 3, 4, 6].into_iter().all(|n| row[n] == Ramp::Size.color(n as f64 / 9.0)));
    }
}
