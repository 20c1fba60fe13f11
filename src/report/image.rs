//! Pixels: an RGB image, its parts, and its PNG.

use std::io::Write as _;

use crate::error::{Error, Result};

use super::palette::Colour;

/// Of pictures, twice those of the page: a PNG is as large in print as on it.
const PER_INCH: f64 = 192.0;

/// Eight bits a channel, row after row from the upper left corner.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<u8>,
}

impl Image {
    pub fn new(width: usize, height: usize, colour: Colour) -> Self {
        let pixels = [colour.0, colour.1, colour.2].repeat(width * height);
        Image { width, height, pixels }
    }

    pub fn at(&self, x: usize, y: usize) -> Colour {
        let at = 3 * (y * self.width + x);
        Colour(self.pixels[at], self.pixels[at + 1], self.pixels[at + 2])
    }

    pub fn set(&mut self, x: usize, y: usize, colour: Colour) {
        let at = 3 * (y * self.width + x);
        self.pixels[at..at + 3].copy_from_slice(&[colour.0, colour.1, colour.2]);
    }

    /// Lays another image on this one, its upper left corner at `corner`; what reaches beyond is cut off.
    pub fn put(&mut self, corner: [usize; 2], other: &Image) {
        let columns = other.width.min(self.width.saturating_sub(corner[0]));
        let rows = other.height.min(self.height.saturating_sub(corner[1]));
        for row in 0..rows {
            let from = 3 * row * other.width;
            let to = 3 * ((row + corner[1]) * self.width + corner[0]);
            self.pixels[to..to + 3 * columns].copy_from_slice(&other.pixels[from..from + 3 * columns]);
        }
    }

    /// Every pixel the mean of `n` by `n`; a rest at the right and lower edges is left out.
    pub fn averaged(&self, n: usize) -> Image {
        let n = n.max(1);
        let (width, height) = (self.width / n, self.height / n);
        let mut pixels = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            for x in 0..width {
                let mut sums = [0_usize; 3];
                for row in 0..n {
                    let start = 3 * ((n * y + row) * self.width + n * x);
                    for pixel in self.pixels[start..start + 3 * n].chunks_exact(3) {
                        for (sum, &channel) in sums.iter_mut().zip(pixel) {
                            *sum += usize::from(channel);
                        }
                    }
                }
                pixels.extend(sums.map(|sum| ((sum + n * n / 2) / (n * n)) as u8));
            }
        }
        Image { width, height, pixels }
    }

    /// The image as a PNG file.
    pub fn to_png(&self) -> Result<Vec<u8>> {
        self.to_png_of(PER_INCH)
    }

    /// The same of so many pixels an inch.
    pub fn to_png_of(&self, per_inch: f64) -> Result<Vec<u8>> {
        let fault = |e: png::EncodingError| Error::Usage(format!("a picture cannot be encoded: {e}"));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Balanced);
        let per_metre = (per_inch / 0.0254).round() as u32;
        let (xppu, yppu) = (per_metre, per_metre);
        encoder.set_pixel_dims(Some(png::PixelDimensions { xppu, yppu, unit: png::Unit::Meter }));
        let mut writer = encoder.write_header().map_err(fault)?;
        writer.write_image_data(&self.pixels).map_err(fault)?;
        writer.finish().map_err(fault)?;
        bytes.flush().map_err(|e| Error::io("write", "a picture".as_ref(), e))?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averages_and_parts() {
        let mut image = Image::new(4, 2, Colour(0, 0, 0));
        image.put([2, 0], &Image::new(5, 1, Colour(200, 100, 40)));
        assert_eq!(image.at(3, 0), Colour(200, 100, 40));
        let half = image.averaged(2);
        assert_eq!((half.width, half.height), (2, 1));
        assert_eq!([half.at(0, 0), half.at(1, 0)], [Colour(0, 0, 0), Colour(100, 50, 20)]);
    }

    #[test]
    fn png_reads_back() {
        let mut image = Image::new(3, 2, Colour(1, 2, 3));
        image.set(2, 1, Colour(250, 0, 9));
        let bytes = image.to_png().unwrap_or_else(|e| panic!("{e}"));
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!(pixels, image.pixels);
    }
}
