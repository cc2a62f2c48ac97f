//! Bodies of polygons whose volume and area are known, in any order and winding, and plain writers of the dialects in which
//! programs write them.
#![allow(clippy::unwrap_used)]

use super::random::Random;

/// A closed surface of polygons.
#[derive(Clone, Debug)]
pub(crate) struct Polyhedron {
    pub(crate) vertices: Vec<[f64; 3]>,
    pub(crate) faces: Vec<Vec<u32>>,
    pub(crate) volume: f64,
    pub(crate) area: f64,
}

/// The prism of a height over a counterclockwise polygon.
pub(crate) fn prism(base: &[[f64; 2]], height: f64) -> Polyhedron {
    let n = base.len() as u32;
    let vertices = [0.0, height].iter().flat_map(|&z| base.iter().map(move |[x, y]| [*x, *y, z])).collect();
    let mut faces = vec![(0..n).rev().collect::<Vec<_>>(), (n..2 * n).collect()];
    faces.extend((0..n).map(|i| vec![i, (i + 1) % n, n + (i + 1) % n, n + i]));
    let sides = (0..base.len()).map(|i| (base[i], base[(i + 1) % base.len()]));
    let area: f64 = sides.clone().map(|(p, q)| (p[0] * q[1] - p[1] * q[0]) / 2.0).sum();
    let rim: f64 = sides.map(|(p, q)| (q[0] - p[0]).hypot(q[1] - p[1])).sum();
    Polyhedron { vertices, faces, volume: area * height, area: 2.0 * area + rim * height }
}

/// The U of a notched block: sides 10, 10, 3 with a notch 4 wide and 8 deep.
pub(crate) fn notched() -> Polyhedron {
    let base = [[0, 0], [10, 0], [10, 10], [7, 10], [7, 2], [3, 2], [3, 10], [0, 10]];
    prism(&base.map(|p| p.map(f64::from)), 3.0)
}

/// A polygon seen from 0, of so many corners, as jagged as can be.
fn star(random: &mut Random, corners: usize) -> Vec<[f64; 2]> {
    (0..corners)
        .map(|n| {
            let angle = std::f64::consts::TAU * (n as f64 + 0.4 * random.unit()) / corners as f64;
            let far = 0.2 + random.unit();
            [far * angle.cos(), far * angle.sin()]
        })
        .collect()
}

/// A comb whose teeth have any length, with corners that lie straight between their neighbours.
fn comb(random: &mut Random, teeth: usize) -> Vec<[f64; 2]> {
    let mut base = vec![[0.0, 0.0], [teeth as f64, 0.0], [2.0 * teeth as f64, 0.0]];
    for tooth in (0..teeth).rev() {
        let (x, top, root) = (2.0 * tooth as f64, 2.0 + 5.0 * random.unit(), 0.5 + random.unit());
        base.extend([[x + 2.0, root], [x + 2.0, top], [x + 1.0, top], [x + 1.0, root]]);
    }
    base.push([0.0, base[base.len() - 1][1]]);
    base
}

impl Polyhedron {
    /// A box or a prism over a concave polygon, turned and shifted.
    pub(crate) fn random(random: &mut Random) -> Self {
        let (corners, height) = (4 + random.below(60), 0.2 + random.unit());
        let base = match random.below(3) {
            0 => vec![[0.0, 0.0], [1.0 + random.unit(), 0.0], [2.0, 1.0 + random.unit()], [0.0, 1.0]],
            1 => star(random, corners),
            _ => comb(random, 1 + corners / 8),
        };
        let mut body = prism(&base, height);
        let shift: [f64; 3] = std::array::from_fn(|_| 4.0 * random.unit() - 2.0);
        let angles: [f64; 2] = std::array::from_fn(|_| if random.below(2) == 0 { 0.0 } else { 7.0 * random.unit() });
        for vertex in &mut body.vertices {
            let [x, y, z] = *vertex;
            let (x, y) = (x * angles[0].cos() - y * angles[0].sin(), x * angles[0].sin() + y * angles[0].cos());
            let (y, z) = (y * angles[1].cos() - z * angles[1].sin(), y * angles[1].sin() + z * angles[1].cos());
            *vertex = [x + shift[0], y + shift[1], z + shift[2]];
        }
        body.shuffle(random);
        body
    }

    /// Numbers the vertices anew and starts each face elsewhere.
    fn shuffle(&mut self, random: &mut Random) {
        let mut order: Vec<usize> = (0..self.vertices.len()).collect();
        for n in (1..order.len()).rev() {
            order.swap(n, random.below(n + 1));
        }
        self.vertices = order.iter().map(|&n| self.vertices[n]).collect();
        let mut name = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| name[old] = new as u32);
        for face in &mut self.faces {
            for v in face.iter_mut() {
                *v = name[*v as usize];
            }
            let start = random.below(face.len());
            face.rotate_left(start);
        }
    }

    /// The same, inside out.
    pub(crate) fn inverted(mut self) -> Self {
        self.faces.iter_mut().for_each(|face| face.reverse());
        self
    }

    /// Text of an OBJ file in some dialect.
    pub(crate) fn obj(&self, random: &mut Random) -> Vec<u8> {
        let (backwards, slashes, first) = (random.below(2) == 0, random.below(4), random.below(2) == 0);
        let f = ["", "F"][random.below(2)];
        let end = ["\n", "\r\n"][random.below(2)];
        let count = self.vertices.len() as i64;
        let corner = |&v: &u32| {
            let name = if backwards { i64::from(v) - count } else { i64::from(v) + 1 };
            ["/1", "//1", "/1/1", ""][slashes].chars().fold(name.to_string(), |text, c| text + &c.to_string())
        };
        let faces: Vec<String> =
            self.faces.iter().map(|face| format!("f {}", words(face.iter().map(corner)))).collect();
        let vertices: Vec<String> =
            self.vertices.iter().map(|v| format!("v  {}", words(v.iter().map(|x| format!("{x}{f}"))))).collect();
        // A face may name vertices that come later, unless it counts backwards.
        let parts = if first && !backwards { [faces, vertices] } else { [vertices, faces] };
        let head = format!("# by hand{end}mtllib a.mtl{end}g a{end}vn 0 0 1{end}vt 0 0{end}");
        (head + &parts.concat().join(end) + end).into_bytes()
    }

    /// Text of an OFF file in some dialect.
    pub(crate) fn off(&self, random: &mut Random) -> Vec<u8> {
        let (prefix, extra) =
            [("", ""), ("C", " 1 0 0 1"), ("N", " 0 0 1"), ("NC", " 0 0 1 255 0 0 255"), ("ST", " 0 0")]
                [random.below(5)];
        let between = ["", " ", "\n", " # counts\n", "\r\n\r\n"][random.below(5)];
        let colour = ["", " 0.5 0.5 0.5", " 7"][random.below(3)];
        let mut text = format!("{prefix}OFF{between}{} {} 0\n", self.vertices.len(), self.faces.len());
        text.extend(self.vertices.iter().map(|v| format!("  {}{extra}\n", words(v.iter().map(ToString::to_string)))));
        text.extend(
            self.faces
                .iter()
                .map(|face| format!("{}  {}{colour}\n", face.len(), words(face.iter().map(ToString::to_string)))),
        );
        text.into_bytes()
    }

    /// A PLY file in some dialect, and whether its coordinates are single.
    pub(crate) fn ply(&self, random: &mut Random) -> (Vec<u8>, bool) {
        let format = ["ascii", "binary_little_endian", "binary_big_endian"][random.below(3)];
        let (scalar, normal) = (["float", "double"][random.below(2)], ["", "nx"][random.below(2)]);
        let (length, index) = (["uchar", "int"][random.below(2)], ["int", "uint", "ushort"][random.below(3)]);
        let mut file = format!("ply\nformat {format} 1.0\ncomment by hand\nelement vertex {}\n", self.vertices.len());
        file.extend(
            ["x", "y", "z", normal].iter().filter(|n| !n.is_empty()).map(|n| format!("property {scalar} {n}\n")),
        );
        let faces = format!(
            "element face {}\nproperty uchar red\nproperty list {length} {index} vertex_indices\nend_header\n",
            self.faces.len()
        );
        let mut file = (file + &faces).into_bytes();
        let mut put = |kind: &str, value: f64| match (format, kind) {
            ("ascii", "end") => file.push(b'\n'),
            (_, "end") => {}
            ("ascii", _) if value.is_nan() => file.extend(b"-nan(ind) "),
            ("ascii", _) => file.extend(format!("{value} ").bytes()),
            (_, kind) => {
                let mut bytes = match kind {
                    "float" => (value as f32).to_le_bytes().to_vec(),
                    "double" => value.to_le_bytes().to_vec(),
                    "uchar" => vec![value as u8],
                    "ushort" => (value as u16).to_le_bytes().to_vec(),
                    _ => (value as u32).to_le_bytes().to_vec(),
                };
                if format == "binary_big_endian" {
                    bytes.reverse();
                }
                file.extend(bytes);
            }
        };
        for vertex in &self.vertices {
            for &x in vertex {
                put(scalar, x);
            }
            if !normal.is_empty() {
                put(scalar, f64::NAN);
            }
            put("end", 0.0);
        }
        for face in &self.faces {
            put("uchar", 7.0);
            put(length, face.len() as f64);
            for &v in face {
                put(index, f64::from(v));
            }
            put("end", 0.0);
        }
        // Bytes after the last element are none of it.
        file.extend([&b""[..], b"\n\0trailing"][random.below(2)]);
        (file, format != "ascii" && scalar == "float")
    }
}

fn words(words: impl Iterator<Item = String>) -> String {
    words.collect::<Vec<_>>().join(" ")
}
