//! Round dots on pictures, with smooth edges and a dark rim that keeps them apart from what is bright.

use super::panel::Rgb;

/// Samples along the edge of a pixel.
const SAMPLES: usize = 4;
/// Width of the rim, pixels.
const RIM: f64 = 0.8;
const RIM_COLOR: [u8; 3] = [24, 24, 28];

/// Draws a dot of `radius` pixels around `centre`, in pixels from the upper left corner of the picture: the middle of its first
/// pixel is at 0.5, 0.5. What lies outside is left out.
pub fn dot(picture: &mut Rgb, centre: [f64; 2], radius: f64, color: [u8; 3]) {
    let reach = radius + RIM;
    let size = [picture.width, picture.height];
    let span = |a: usize| {
        let (low, high) = ((centre[a] - reach).floor().max(0.0), (centre[a] + reach).ceil().max(0.0));
        (low as usize).min(size[a])..(high as usize).min(size[a])
    };
    for row in span(1) {
        for column in span(0) {
            let (mut inner, mut rim) = (0, 0);
            for sample in 0..SAMPLES * SAMPLES {
                let within = [sample % SAMPLES, sample / SAMPLES].map(|n| (n as f64 + 0.5) / SAMPLES as f64);
                let away = libm::hypot(column as f64 + within[0] - centre[0], row as f64 + within[1] - centre[1]);
                inner += usize::from(away <= radius);
                rim += usize::from(away > radius && away <= reach);
            }
            let at = 3 * (row * picture.width + column);
            for (c, value) in picture.pixels[at..at + 3].iter_mut().enumerate() {
                let all = SAMPLES * SAMPLES;
                let sum = inner * usize::from(color[c])
                    + rim * usize::from(RIM_COLOR[c])
                    + (all - inner - rim) * usize::from(*value);
                *value = ((sum + all / 2) / all) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dot_is_round_and_stays_in_the_picture() {
        let blank = || Rgb { width: 40, height: 30, pixels: vec![200; 3 * 40 * 30] };
        let mut picture = blank();
        dot(&mut picture, [20.0, 15.0], 6.0, [255, 0, 0]);
        let red = picture.pixels.chunks(3).filter(|p| *p == [255, 0, 0]).count() as f64;
        let area = std::f64::consts::PI * 36.0;
        assert!(red < area && red > 0.75 * area, "{red} of {area} pixels");
        let touched = picture.pixels.chunks(3).filter(|p| *p != [200; 3]).count() as f64;
        assert!(touched > std::f64::consts::PI * 6.8 * 6.8 && touched < std::f64::consts::PI * 8.3 * 8.3);
        for centre in [[-3.0, 15.0], [43.0, 15.0], [20.0, -2.0], [20.0, 33.0], [-100.0, -100.0], [1e9, 1e9]] {
            dot(&mut picture, centre, 5.0, [0, 255, 0]);
        }
        let mut beyond = blank();
        dot(&mut beyond, [-10.0, 15.0], 5.0, [0; 3]);
        assert_eq!(beyond, blank());
    }
}
