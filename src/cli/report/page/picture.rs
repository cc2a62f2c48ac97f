//! Pictures within a page: PNG as `data:` addresses, so that nothing has to be loaded.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::html::Html;
use crate::error::{Error, Result};
use crate::io::png::rgb_bytes;
use crate::kernel::image::picture::panel::Rgb;

/// A picture and what it is called.
pub(crate) struct Picture {
    address: String,
    size: [usize; 2],
    caption: String,
}

impl Picture {
    pub(super) fn new(picture: &Rgb, caption: String) -> Result<Self> {
        let side = |n: usize| u32::try_from(n).map_err(|_| Error::failed("a picture would be too large"));
        let bytes = rgb_bytes([side(picture.width)?, side(picture.height)?], &picture.pixels)?;
        let address = format!("data:image/png;base64,{}", STANDARD.encode(bytes));
        Ok(Self { address, size: [picture.width, picture.height], caption })
    }

    pub(super) fn put(&self, page: &mut Html) {
        let [width, height] = self.size.map(|n| n.to_string());
        page.within("figure", &[], |figure| {
            let about = [("src", &*self.address), ("width", &width), ("height", &height), ("alt", &self.caption)];
            figure.element("img", &about, "");
            figure.element("figcaption", &[], &self.caption);
        });
    }
}
