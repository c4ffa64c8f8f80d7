//! What can stand in annotations: entries and their values (Modelica 3.6, section 18), with the entries of this compiler.

use hyd_syntax::tokens::{Kind, Token};
use lsp_types::{CompletionItem, CompletionItemKind};

use crate::completion::plain;
use crate::context::opener;

/// What belongs between the parentheses of an entry, by its name.
const ENTRIES: [(&str, &[&str]); 23] = [
    (
        "annotation",
        &[
            "experiment",
            "Documentation",
            "Evaluate",
            "Inline",
            "choices",
            "Dialog",
            "Icon",
            "Diagram",
            "Placement",
            "__hyd",
        ],
    ),
    ("experiment", &["StartTime", "StopTime", "Interval", "Tolerance"]),
    ("Documentation", &["info", "revisions", "figures"]),
    ("__hyd", &["open", "effect", "place", "prior", "plot"]),
    ("Dialog", &["tab", "group", "enable"]),
    ("Icon", LAYER),
    ("Diagram", LAYER),
    ("coordinateSystem", &["extent", "preserveAspectRatio", "initialScale", "grid"]),
    ("Placement", &["transformation", "iconTransformation", "visible", "iconVisible"]),
    ("transformation", TRANSFORMATION),
    ("iconTransformation", TRANSFORMATION),
    ("Figure", &["title", "identifier", "group", "preferred", "plots", "caption"]),
    ("Plot", &["title", "identifier", "curves", "x", "y"]),
    ("Curve", &["x", "y", "legend", "zOrder"]),
    ("Axis", &["min", "max", "unit", "label", "scale"]),
    (
        "Line",
        &["points", "color", "pattern", "thickness", "arrow", "arrowSize", "smooth", "visible", "origin", "rotation"],
    ),
    (
        "Polygon",
        &["points", "smooth", "lineColor", "fillColor", "pattern", "fillPattern", "lineThickness", "visible", "origin"],
    ),
    (
        "Rectangle",
        &[
            "extent",
            "radius",
            "borderPattern",
            "lineColor",
            "fillColor",
            "pattern",
            "fillPattern",
            "lineThickness",
            "visible",
            "origin",
            "rotation",
        ],
    ),
    (
        "Ellipse",
        &[
            "extent",
            "startAngle",
            "endAngle",
            "closure",
            "lineColor",
            "fillColor",
            "pattern",
            "fillPattern",
            "lineThickness",
            "visible",
            "origin",
            "rotation",
        ],
    ),
    (
        "Text",
        &[
            "extent",
            "textString",
            "textColor",
            "fontSize",
            "fontName",
            "textStyle",
            "horizontalAlignment",
            "visible",
            "origin",
            "rotation",
        ],
    ),
    ("Bitmap", &["extent", "fileName", "imageSource", "visible", "origin", "rotation"]),
    ("choices", &["choice", "checkBox"]),
    ("Log", &["base"]),
];
const LAYER: &[&str] = &["coordinateSystem", "graphics"];
const TRANSFORMATION: &[&str] = &["extent", "rotation", "origin"];

/// Entries whose values are written with these words.
const VALUES: [(&str, &[&str]); 20] = [
    ("graphics", &["Line", "Polygon", "Rectangle", "Ellipse", "Text", "Bitmap"]),
    ("figures", &["Figure"]),
    ("plots", &["Plot"]),
    ("curves", &["Curve"]),
    ("scale", &["Linear", "Log"]),
    (
        "pattern",
        &["LinePattern.None", "LinePattern.Solid", "LinePattern.Dash", "LinePattern.Dot", "LinePattern.DashDot"],
    ),
    (
        "fillPattern",
        &[
            "FillPattern.None",
            "FillPattern.Solid",
            "FillPattern.Horizontal",
            "FillPattern.Vertical",
            "FillPattern.HorizontalCylinder",
            "FillPattern.VerticalCylinder",
            "FillPattern.Sphere",
        ],
    ),
    (
        "borderPattern",
        &["BorderPattern.None", "BorderPattern.Raised", "BorderPattern.Sunken", "BorderPattern.Engraved"],
    ),
    ("smooth", &["Smooth.None", "Smooth.Bezier"]),
    ("arrow", &["Arrow.None", "Arrow.Open", "Arrow.Filled", "Arrow.Half"]),
    ("closure", &["EllipseClosure.None", "EllipseClosure.Chord", "EllipseClosure.Radial"]),
    ("horizontalAlignment", &["TextAlignment.Left", "TextAlignment.Center", "TextAlignment.Right"]),
    ("textStyle", &["TextStyle.Bold", "TextStyle.Italic", "TextStyle.UnderLine"]),
    ("preferred", TRUTHS),
    ("preserveAspectRatio", TRUTHS),
    ("Evaluate", TRUTHS),
    ("Inline", TRUTHS),
    ("checkBox", TRUTHS),
    ("iconVisible", TRUTHS),
    ("open", TRUTHS),
];
const TRUTHS: &[&str] = &["true", "false"];

/// Entries whose values are expressions over the model.
const READ: [&str; 6] = ["x", "y", "enable", "visible", "min", "max"];

/// A place inside an annotation.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Entry {
    /// Between the parentheses of what has this name.
    Inside(String),
    /// The value of an entry, which `of` has.
    Value {
        /// The entry.
        name: String,
        /// What it stands in.
        of: String,
    },
}

/// Where the next word stands, if in an annotation.
pub(crate) fn entry(words: &[Token<'_>]) -> Option<Entry> {
    // From the inside: the names of lists, and of entries whose values are being written.
    let mut names: Vec<(bool, String)> = Vec::new();
    let mut until = words;
    loop {
        if let [.., name, equals] = until
            && equals.is("=")
            && name.kind == Kind::Word
        {
            names.push((false, name.text.to_string()));
        }
        let at = opener(until)?;
        let before = &until[..at];
        if until[at].is("(") {
            let name = before.last().filter(|name| name.kind == Kind::Word)?;
            names.push((true, name.text.to_string()));
            if name.is("annotation") {
                break;
            }
            until = &before[..before.len() - 1];
        } else {
            until = before;
        }
    }
    let (is_list, name) = names.first()?.clone();
    // An entry stands in a list at least: that of the annotation itself.
    let of = names.iter().skip(1).find(|(is_list, _)| *is_list).map(|(_, name)| name.clone());
    Some(match (is_list, of) {
        (false, Some(of)) => Entry::Value { name, of },
        _ => Entry::Inside(name),
    })
}

/// What can be written there.  None where it is any expression over the model.
pub(crate) fn proposals(entry: &Entry) -> Option<Vec<CompletionItem>> {
    let (words, kind) = match entry {
        Entry::Inside(name) => {
            let known = ENTRIES.iter().find(|(own, _)| own == name).map(|(_, words)| *words);
            (known.unwrap_or_default(), CompletionItemKind::PROPERTY)
        }
        // The axes of a plot have the names of the coordinates of a curve.
        Entry::Value { name, of } if of == "Plot" && matches!(name.as_str(), "x" | "y") => {
            (&["Axis"][..], CompletionItemKind::STRUCT)
        }
        Entry::Value { name, .. } if READ.contains(&name.as_str()) => return None,
        Entry::Value { name, .. } => {
            let known = VALUES.iter().find(|(own, _)| own == name).map(|(_, words)| *words);
            (known.unwrap_or_default(), CompletionItemKind::VALUE)
        }
    };
    Some(words.iter().map(|word| plain(word, kind, None)).collect())
}
