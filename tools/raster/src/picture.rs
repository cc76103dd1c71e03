//! Pixels as images, and images as PNG.

use crate::light::Colour;
use crate::raster::Raster;

/// The raster as red, green, blue and opacity; each pixel is the mean of `factor` squared pixels of the raster.
/// `colour` is that of a pixel of the raster, none where nothing is to be seen.
pub fn image(raster: &Raster, factor: usize, colour: impl Fn(usize) -> Option<Colour>) -> Vec<u8> {
    let (width, height) = (raster.width / factor, raster.height / factor);
    let mut bytes = Vec::with_capacity(width * height * 4);
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut seen) = ([0.0; 3], 0usize);
            for row in y * factor..(y + 1) * factor {
                for column in x * factor..(x + 1) * factor {
                    if let Some(colour) = colour(row * raster.width + column) {
                        sum = std::array::from_fn(|k| sum[k] + colour[k]);
                        seen += 1;
                    }
                }
            }
            let mean = |c: f64| (c / seen.max(1) as f64).round() as u8;
            bytes.extend(sum.map(mean));
            bytes.push((255 * seen / (factor * factor)) as u8);
        }
    }
    bytes
}

/// An image on white paper, as red, green and blue.
#[must_use]
pub fn on_white(rgba: &[u8]) -> Vec<u8> {
    let over = |pixel: &[u8]| -> [u8; 3] {
        let opacity = f64::from(pixel[3]) / 255.0;
        std::array::from_fn(|k| {
            (f64::from(pixel[k]) * opacity + 255.0 * (1.0 - opacity)).round() as u8
        })
    };
    rgba.chunks_exact(4).flat_map(over).collect()
}

/// A PNG file of an image; 3 bytes a pixel for red, green and blue, or 4 with opacity.
///
/// # Errors
/// If the image does not have `width * height` pixels.
pub fn png(width: u32, height: u32, pixels: &[u8], thorough: bool) -> Result<Vec<u8>, String> {
    let count = width as usize * height as usize;
    let colors = match pixels.len() == 3 * count {
        true => png::ColorType::Rgb,
        false => png::ColorType::Rgba,
    };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(colors);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(match thorough {
        true => png::Compression::High,
        false => png::Compression::Balanced,
    });
    let text = |e: png::EncodingError| e.to_string();
    let mut writer = encoder.write_header().map_err(text)?;
    writer.write_image_data(pixels).map_err(text)?;
    writer.finish().map_err(text)?;
    Ok(bytes)
}
