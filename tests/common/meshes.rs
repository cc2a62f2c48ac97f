//! Meshes made by formula, and writers of every format of meshes, plain and independent of the readers.

use strandline::grid::TriangleMesh;

/// The surface of a box as twelve outward triangles.
pub(crate) fn cuboid(lo: [f64; 3], hi: [f64; 3]) -> TriangleMesh {
    let corner = |n: usize| std::array::from_fn(|a| if n >> a & 1 == 0 { lo[a] } else { hi[a] });
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriangleMesh::new((0..8).map(corner).collect(), triangles).expect("a box")
}

/// Several meshes as one, none of their vertices shared.
pub(crate) fn joined(parts: &[TriangleMesh]) -> TriangleMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for part in parts {
        let first = vertices.len() as u32;
        vertices.extend(&part.vertices);
        triangles.extend(part.triangles.iter().map(|triangle| triangle.map(|v| v + first)));
    }
    TriangleMesh::new(vertices, triangles).expect("parts that are meshes")
}

/// An outward sphere, or the part of it from the pole of high z down to the polar angle `until` (pi for all of it).
pub(crate) fn sphere(centre: [f64; 3], radius: f64, steps: u32, until: f64) -> TriangleMesh {
    let rows = steps;
    let columns = 2 * steps;
    let mut vertices = Vec::new();
    for row in 0..=rows {
        let polar = until * f64::from(row) / f64::from(rows);
        // The sine of pi in floating point is not 0: the lower pole must be one place.
        let ring = if polar < std::f64::consts::PI { polar.sin() } else { 0.0 };
        for column in 0..columns {
            let angle = std::f64::consts::TAU * f64::from(column) / f64::from(columns);
            let direction = [ring * angle.cos(), ring * angle.sin(), polar.cos()];
            vertices.push(std::array::from_fn(|a| centre[a] + radius * direction[a]));
        }
    }
    let name = |row: u32, column: u32| row * columns + column % columns;
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [name(row, column), name(row, column + 1)];
            let [c, d] = [name(row + 1, column), name(row + 1, column + 1)];
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    TriangleMesh::new(vertices, triangles).expect("a sphere")
}

/// A form in which a mesh is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Form {
    PlyText,
    PlyLittle,
    PlyBig,
    PlyDouble,
    Obj,
    ObjBackwards,
    Off,
    Coff,
    StlText,
    StlBinary,
}

impl Form {
    pub(crate) const ALL: [Self; 10] = [
        Self::PlyText,
        Self::PlyLittle,
        Self::PlyBig,
        Self::PlyDouble,
        Self::Obj,
        Self::ObjBackwards,
        Self::Off,
        Self::Coff,
        Self::StlText,
        Self::StlBinary,
    ];

    /// The name of its format.
    pub(crate) fn format(self) -> &'static str {
        match self {
            Self::PlyText | Self::PlyLittle | Self::PlyBig | Self::PlyDouble => "PLY",
            Self::Obj | Self::ObjBackwards => "OBJ",
            Self::Off | Self::Coff => "OFF",
            Self::StlText | Self::StlBinary => "STL",
        }
    }

    /// True when coordinates have the digits of f64.
    pub(crate) fn keeps_f64(self) -> bool {
        !matches!(self, Self::PlyLittle | Self::PlyBig | Self::StlBinary)
    }

    /// The bytes of a file.
    pub(crate) fn write(self, mesh: &TriangleMesh) -> Vec<u8> {
        match self {
            Self::PlyText => ply(mesh, "ascii", "double"),
            Self::PlyLittle => ply(mesh, "binary_little_endian", "float"),
            Self::PlyBig => ply(mesh, "binary_big_endian", "float"),
            Self::PlyDouble => ply(mesh, "binary_big_endian", "double"),
            Self::Obj => obj(mesh, |v, _| format!("{0}/{0}/{0}", v + 1)),
            Self::ObjBackwards => obj(mesh, |v, count| format!("-{}", count - v as usize)),
            Self::Off => off(mesh, "OFF\n", ""),
            Self::Coff => off(mesh, "# made\nCOFF ", " 0.5 0.5 0.5 1"),
            Self::StlText => stl_text(mesh),
            Self::StlBinary => stl_binary(mesh),
        }
    }
}

fn ply(mesh: &TriangleMesh, format: &str, scalar: &str) -> Vec<u8> {
    let mut file = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty {scalar} x\nproperty {scalar} y\nproperty {scalar} z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.len()
    )
    .into_bytes();
    let ordered = |mut little: Vec<u8>| {
        if format == "binary_big_endian" {
            little.reverse();
        }
        little
    };
    let is_text = format == "ascii";
    for vertex in &mesh.vertices {
        for &x in vertex {
            match (is_text, scalar) {
                (true, _) => file.extend(format!("{x} ").bytes()),
                (_, "float") => file.extend(ordered((x as f32).to_le_bytes().to_vec())),
                _ => file.extend(ordered(x.to_le_bytes().to_vec())),
            }
        }
        file.extend(is_text.then_some(b'\n'));
    }
    for [a, b, c] in &mesh.triangles {
        if is_text {
            file.extend(format!("3 {a} {b} {c}\n").bytes());
        } else {
            file.push(3);
            for v in [a, b, c] {
                file.extend(ordered(v.to_le_bytes().to_vec()));
            }
        }
    }
    file
}

fn obj(mesh: &TriangleMesh, corner: impl Fn(u32, usize) -> String) -> Vec<u8> {
    let mut text = String::from("# made\no mesh\n");
    text.extend(mesh.vertices.iter().map(|[x, y, z]| format!("v {x} {y} {z}\nvn 0 0 1\nvt 0 0\n")));
    text.extend(mesh.triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.map(|v| corner(v, mesh.vertices.len()));
        format!("f {a} {b} {c}\n")
    }));
    text.into_bytes()
}

fn off(mesh: &TriangleMesh, header: &str, colour: &str) -> Vec<u8> {
    let mut text = format!("{header}{} {} 0\n", mesh.vertices.len(), mesh.len());
    text.extend(mesh.vertices.iter().map(|[x, y, z]| format!("{x} {y} {z}{colour}\n")));
    text.extend(mesh.triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")));
    text.into_bytes()
}

fn stl_text(mesh: &TriangleMesh) -> Vec<u8> {
    let mut text = String::from("solid made by hand\n");
    for n in 0..mesh.len() {
        text += "facet normal 0 0 0\n  outer loop\n";
        text.extend(mesh.corners(n).iter().map(|[x, y, z]| format!("    vertex {x:e} {y} {z}\n")));
        text += "  endloop\nendfacet\n";
    }
    (text + "endsolid made by hand\n").into_bytes()
}

fn stl_binary(mesh: &TriangleMesh) -> Vec<u8> {
    let mut file = vec![b' '; 80];
    file.extend((mesh.len() as u32).to_le_bytes());
    for n in 0..mesh.len() {
        file.extend([0; 12]);
        mesh.corners(n).iter().flatten().for_each(|&x| file.extend((x as f32).to_le_bytes()));
        file.extend([0; 2]);
    }
    file
}
