//! Widths and outlines of letters, from a font that comes along (DejaVu Sans, freely licensed).
//!
//! Layout needs widths for SVG as well: viewers without this font mostly take one that is as wide or narrower.

use std::sync::OnceLock;

use ttf_parser::{Face, GlyphId};

/// The font, parsed once.
pub(crate) fn face() -> &'static Face<'static> {
    static FACE: OnceLock<Face<'static>> = OnceLock::new();
    FACE.get_or_init(|| Face::parse(dejavu::sans::regular(), 0).expect("invariant: the built-in font can be read"))
}

/// The letter's picture; a box for what the font does not have.
pub(crate) fn glyph(letter: char) -> GlyphId {
    face().glyph_index(letter).unwrap_or(GlyphId(0))
}

/// Width of a glyph in units of the font, and units per letter height.
pub(crate) fn advance(glyph: GlyphId) -> f64 {
    f64::from(face().glyph_hor_advance(glyph).unwrap_or(0))
}

/// Width of a text in pixels at `size` pixels per em.
pub(crate) fn text_width(text: &str, size: f64) -> f64 {
    text.chars().map(|c| advance(glyph(c))).sum::<f64>() * size / f64::from(face().units_per_em())
}

/// The text, cut with an ellipsis where it is wider than `width` pixels.
pub(crate) fn fit_text(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_string();
    }
    let mut short: String = text.to_string();
    while short.pop().is_some() {
        if text_width(&short, size) + text_width("…", size) <= width {
            break;
        }
    }
    short + "…"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_cut_to_fit() {
        let text = "drive.cylinder.chamber[3].p";
        assert_eq!(fit_text(text, 12.0, 1000.0), text);
        let short = fit_text(text, 12.0, 80.0);
        assert!(short.ends_with('…') && text.starts_with(short.trim_end_matches('…')));
        assert!(text_width(&short, 12.0) <= 80.0 && text_width(&short, 12.0) > 60.0);
    }

    #[test]
    fn the_signs_of_axes_exist() {
        for sign in "−·µΩ°²³⁻⁶…".chars() {
            assert!(face().glyph_index(sign).is_some(), "{sign}");
        }
    }
}
