//! How deep the voxels of one brick lie in the pockets that a ball cannot reach (`pipeline/enclosure/pockets.rs`).

/// A ball, and from where on what it cannot reach counts; physical lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its radius.
    pub radius: f32,
    /// Pockets begin so far from its centres.
    pub from: f32,
    /// Nearer to the cloud than this is a wall of points.
    pub wall: f32,
}

/// Turns `away`, the distance to where the ball's centre may be, into how deep each voxel lies in a pocket, 0 for not.
/// `d` is the distance to the cloud, `level` the radius of the largest ball that gets there, `inside` 1 or 0; dense
/// bricks.
pub fn depth(ball: Ball, d: &[f32], level: &[f32], inside: &[u8], away: &mut [f32]) {
    for (n, away) in away.iter_mut().enumerate() {
        let is_open = level[n] < ball.radius && d[n] >= ball.wall && inside[n] == 0;
        *away = if is_open { (*away - ball.from).max(0.0) } else { 0.0 };
    }
}
