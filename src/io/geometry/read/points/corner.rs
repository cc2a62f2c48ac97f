//! Corners of shapes that were drawn, as tables list them.

/// What kind of shape a point belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShapeKind {
    Closed,
    /// A path or a line, whose ends are not joined.
    Open,
    /// Four corners of the box around an ellipse.
    Ellipse,
}

/// What a line says of its point's place in a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub(crate) vertex: Option<i64>,
    pub(crate) kind: ShapeKind,
}
