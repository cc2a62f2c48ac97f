//! Shapes, files and slow plain references that several tests share.
