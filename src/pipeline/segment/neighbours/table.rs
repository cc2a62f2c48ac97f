//! The faces between labels as a table for other programs.

use std::fmt::Write;

use crate::kernel::surface::Contact;

/// The contacts as CSV with a header; label 0 is what has none.
pub(in crate::pipeline::segment) fn csv(contacts: &[Contact]) -> String {
    let mut text = String::from("label_low,label_high,area,centre_x,centre_y,centre_z,triangles\n");
    for contact in contacts {
        let ([low, high], [x, y, z]) = (contact.labels, contact.centre);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{low},{high},{},{x},{y},{z},{}", contact.area, contact.triangles);
    }
    text
}
