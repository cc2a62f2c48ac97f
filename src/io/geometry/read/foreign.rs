//! Files of other programs that are known and not read: told by their first bytes, so that a message can say what they are
//! and what to do, where a reader could only say that it does not understand them.

use crate::error::Error;

/// What a file of a format holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Holds {
    /// Points or triangles.
    Shapes,
    /// Voxels or pixels.
    Image,
    /// Anything, in a form that has to be undone first.
    Packed,
}

/// A format: its name, what it holds, where its mark stands, and the mark.
type Known = (&'static str, Holds, usize, &'static [u8]);

const KNOWN: [Known; 28] = [
    ("VTK", Holds::Shapes, 0, b"# vtk DataFile"),
    ("PCD (Point Cloud Library)", Holds::Shapes, 0, b"# .PCD"),
    ("LAS", Holds::Shapes, 0, b"LASF"),
    ("E57", Holds::Shapes, 0, b"ASTM-E57"),
    ("glTF", Holds::Shapes, 0, b"glTF"),
    ("FBX", Holds::Shapes, 0, b"Kaydara FBX"),
    ("Gmsh", Holds::Shapes, 0, b"$MeshFormat"),
    ("VRML", Holds::Shapes, 0, b"#VRML"),
    ("AmiraMesh", Holds::Shapes, 0, b"# AmiraMesh"),
    ("Amira surface", Holds::Shapes, 0, b"# HyperSurface"),
    ("TIFF", Holds::Image, 0, b"II*\0"),
    ("TIFF", Holds::Image, 0, b"MM\0*"),
    ("TIFF", Holds::Image, 0, b"II+\0"),
    ("TIFF", Holds::Image, 0, b"MM\0+"),
    ("PNG", Holds::Image, 0, b"\x89PNG"),
    ("JPEG", Holds::Image, 0, b"\xff\xd8\xff"),
    ("JPEG 2000", Holds::Image, 0, b"\0\0\0\x0cjP  "),
    ("HDF5 (Imaris, ilastik, BigDataViewer)", Holds::Image, 0, b"\x89HDF"),
    ("NumPy", Holds::Image, 0, b"\x93NUMPY"),
    ("MATLAB", Holds::Image, 0, b"MATLAB 5.0 MAT-file"),
    ("NRRD", Holds::Image, 0, b"NRRD000"),
    ("NIfTI", Holds::Image, 344, b"n+1\0"),
    ("MetaImage", Holds::Image, 0, b"ObjectType = Image"),
    ("CZI (Zeiss)", Holds::Image, 0, b"ZISRAWFILE"),
    ("ND2 (Nikon)", Holds::Image, 0, b"\xda\xce\xbe\x0a"),
    ("DICOM", Holds::Image, 128, b"DICM"),
    ("gzip", Holds::Packed, 0, b"\x1f\x8b"),
    ("Zstandard", Holds::Packed, 0, b"\x28\xb5\x2f\xfd"),
];

/// XML files, by the name of their root.
const XML: [(&str, &str); 3] = [("VTK", "<VTKFile"), ("COLLADA", "<COLLADA"), ("X3D", "<X3D")];

fn known(head: &[u8]) -> Option<(&'static str, Holds)> {
    let marked = |&&(_, _, at, mark): &&Known| head.get(at..).is_some_and(|rest| rest.starts_with(mark));
    if let Some(&(name, holds, ..)) = KNOWN.iter().find(marked) {
        return Some((name, holds));
    }
    let start = String::from_utf8_lossy(&head[..head.len().min(400)]);
    let is_xml = start.trim_start().starts_with('<');
    XML.iter().find(|(_, root)| is_xml && start.contains(root)).map(|&(name, _)| (name, Holds::Shapes))
}

/// Why a file that starts so holds no points and no mesh that are read, where its format is known; `wanted` names those
/// that are.
pub(crate) fn no_source(head: &[u8], wanted: &str) -> Option<Error> {
    let (name, holds) = known(head)?;
    Some(Error::input(match holds {
        Holds::Shapes => {
            format!("is a {name} file, which is not read; save it as PLY, OBJ or STL, or its points as CSV")
        }
        Holds::Image => format!("is a {name} file, and no points or mesh; give one of {wanted}"),
        Holds::Packed => format!("is compressed ({name}); unpack it first"),
    }))
}

/// Why a file that starts so is no image that is read, where its format is known.
pub(crate) fn no_stack(head: &[u8]) -> Option<Error> {
    let (name, holds) = known(head)?;
    Some(Error::input(match holds {
        Holds::Shapes => format!("is a {name} file, and no image; give a TIFF stack or an OME-Zarr image"),
        Holds::Image => format!("is a {name} file, which is not read; save it as TIFF or OME-Zarr"),
        Holds::Packed => format!("is compressed ({name}); unpack it first"),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::geometry::read::sources::FORMATS;

    #[test]
    fn each_is_named_with_what_to_do() {
        let source = |head: &[u8]| no_source(head, "PLY").map(|error| error.to_string());
        let text = source(b"# .PCD v0.7 - Point Cloud Data file format\nFIELDS x y z\n").unwrap();
        assert!(text.contains("PCD") && text.contains("save it as PLY"), "{text}");
        let text = source(b"<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\">").unwrap();
        assert!(text.starts_with("is a VTK file"), "{text}");
        let mut nifti = vec![0; 344];
        nifti.extend(b"n+1\0");
        assert!(no_stack(&nifti).unwrap().to_string().contains("save it as TIFF"));
        assert!(source(&nifti).unwrap().contains("no points or mesh"));
        assert!(no_stack(b"\x1f\x8b\x08").unwrap().to_string().contains("unpack it"));
        for head in [&b"ply\n"[..], b"x,y,z\n1,2,3\n", b"# 1\n1 2 3\n", b"", b"solid a"] {
            assert!(source(head).is_none() && no_stack(head).is_none());
        }
    }

    #[test]
    fn nothing_that_is_read_is_called_foreign() {
        // Comments of tables start like some of them, and binary STL may hold anything, so that its length is asked first;
        // what counts is that none of these is how a mesh begins.
        for &(name, _, _, mark) in KNOWN.iter().filter(|(_, _, at, _)| *at == 0) {
            let reader = FORMATS.iter().take(4).find(|format| (format.sniff)(mark));
            assert!(reader.is_none(), "{name}");
        }
    }
}
