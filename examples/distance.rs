//! The signed distance to a triangle mesh, and how far inside the deepest voxel lies.

use strandline::{DistanceField, Method, TriangleMesh};

fn main() -> strandline::Result<()> {
    // An octahedron; its corners are 1 from the middle, its faces 1 / sqrt(3).
    let vertices =
        vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let triangles = vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    let mesh = TriangleMesh::new(vertices, triangles)?;

    let found =
        DistanceField::new().mesh(&mesh).spacing([0.05; 3]).padding(0.25).method(Method::DP).signed().solve()?;
    let [x, y, z] = found.geometry().shape;
    println!("{x} x {y} x {z} voxels, at most {:.3} from the mesh", found.found().max);

    let deepest = found.distance().read()?.into_iter().fold(0.0_f32, f32::min);
    println!("the deepest voxel is {:.3} inside; the faces are {:.3} from the middle", -deepest, 1.0 / 3.0_f64.sqrt());
    Ok(())
}
