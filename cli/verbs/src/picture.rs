//! A figure to a picture file, its format taken from the file's name.

use std::path::Path;

use hyd_report::Figure;

use crate::Failure;
use hyd_results::write_whole;
use hyd_run::check_target;

/// Image pixels per pixel of the drawing: 192 dpi.
const PNG_SCALE: f64 = 2.0;

/// Formats of pictures.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum PictureFormat {
    /// Lines and texts.
    Svg,
    /// Pixels.
    Png,
}

/// Refuses a picture of `option` that would replace a file that is read, or of no format.
///
/// # Errors
/// Wrong usage.
pub fn check_picture(option: &str, path: &Path) -> Result<(), Failure> {
    picture_format(path)?;
    check_target(option, path, &[])
}

/// The format that a file's name asks for.
fn picture_format(path: &Path) -> Result<PictureFormat, Failure> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("svg") => Ok(PictureFormat::Svg),
        Some("png") => Ok(PictureFormat::Png),
        _ => Err(Failure::Usage(format!("`{}`: a picture ends in .svg or .png", path.display()))),
    }
}

/// Draws a figure into a file, which appears when it is whole.
///
/// # Errors
/// A name of no format, or a file that cannot be written.
pub fn write_picture(path: &Path, figure: &Figure) -> Result<(), Failure> {
    let drawing = figure.draw();
    let failed = |error: String| Failure::Fault(format!("`{}` cannot be written: {error}", path.display()));
    let bytes = match picture_format(path)? {
        PictureFormat::Svg => drawing.svg().into_bytes(),
        PictureFormat::Png => drawing.png(PNG_SCALE).map_err(|error| failed(error.to_string()))?,
    };
    write_whole(path, &bytes).map_err(|error| failed(error.to_string()))
}
