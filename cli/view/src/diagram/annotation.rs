//! Annotations read: icons, diagrams, placements, lines of connections.
//!
//! Values may name parameters of the instance that is drawn (`visible = useHeatPort`); what cannot be known before a run keeps its default.

use hyd_instance::{Env, Scope, Scopes, Value};
use hyd_source::Files;
use hyd_syntax::tree::{
    Argument, Arguments, ClassBody, Element, Equation, Expr, ExprKind, Ident, Modification, UnaryOp,
};

use super::geometry::{Extent, Point};
use super::graphic::{Align, BLACK, Color, Fill, Form, Graphic, Placement, Stroke, default_extent};

/// Graphics of one annotation that are read.
const MOST_GRAPHICS: usize = 2000;
/// Characters of a picture that an annotation holds itself.
const LONGEST_PICTURE: usize = 200_000;
/// Enumerations that annotations use; a literal is known by its last name.
const ENUMERATIONS: [&str; 8] =
    ["LinePattern", "FillPattern", "BorderPattern", "Smooth", "EllipseClosure", "Arrow", "TextStyle", "TextAlignment"];

/// Reads annotations that stand in a class of an instance.
pub(crate) struct Reader<'r, 's> {
    pub(crate) scopes: &'r mut Scopes<'s>,
    pub(crate) scope: Scope,
}

/// The argument of an annotation with this name.
pub(crate) fn argument<'a>(annotation: &'a Modification, name: &str) -> Option<&'a Modification> {
    annotation.arguments.iter().find_map(|argument| match argument {
        Argument::Modify(modify) => match modify.target.parts.as_slice() {
            [own] if *own.name == *name => Some(&modify.modification),
            _ => None,
        },
        _ => None,
    })
}

impl Reader<'_, '_> {
    fn value(&mut self, expr: &Expr) -> Option<Value> {
        match &expr.kind {
            ExprKind::Integer(value) => Some(Value::Integer(*value)),
            ExprKind::Real(value) => Some(Value::Real(*value)),
            ExprKind::Text(text) => Some(Value::Text(text.clone())),
            ExprKind::Boolean(value) => Some(Value::Boolean(*value)),
            ExprKind::Unary(UnaryOp::Minus, inner) => self.value(inner)?.as_real().map(|value| Value::Real(-value)),
            ExprKind::Array(items) => {
                items.iter().map(|item| self.value(item)).collect::<Option<_>>().map(Value::array)
            }
            // What it would be in a tool that animates stands second.
            ExprKind::Call(name, Arguments::List { positional, .. })
                if name.parts.len() == 1 && &*name.parts[0].name.name == "DynamicSelect" =>
            {
                self.value(positional.first()?)
            }
            ExprKind::Ref(reference) => match reference.parts.as_slice() {
                [outer, literal] if ENUMERATIONS.contains(&&*outer.name.name) => {
                    Some(Value::Text(literal.name.name.clone()))
                }
                _ => self.evaluate(expr),
            },
            _ => self.evaluate(expr),
        }
    }

    fn evaluate(&mut self, expr: &Expr) -> Option<Value> {
        let scope = self.scope;
        self.scopes.quietly(|scopes| scopes.evaluate(expr, scope, &Env::default())).ok()
    }

    pub(crate) fn is_true(&mut self, expr: Option<&Expr>, default: bool) -> bool {
        match expr.and_then(|expr| self.value(expr)) {
            Some(Value::Boolean(value)) => value,
            _ => default,
        }
    }

    fn number(&mut self, expr: Option<&Expr>) -> Option<f64> {
        self.value(expr?)?.as_real().filter(|value| value.is_finite())
    }

    fn point(&mut self, expr: Option<&Expr>) -> Option<Point> {
        point_of(&self.value(expr?)?)
    }

    fn points(&mut self, expr: Option<&Expr>) -> Option<Vec<Point>> {
        self.value(expr?)?.items().iter().map(point_of).collect()
    }

    fn extent(&mut self, expr: Option<&Expr>) -> Option<Extent> {
        match self.points(expr)?.as_slice() {
            [from, to] => Some(Extent { from: *from, to: *to }),
            _ => None,
        }
    }

    fn word(&mut self, expr: Option<&Expr>) -> Option<String> {
        match self.value(expr?)? {
            Value::Text(text) => Some(text.to_string()),
            Value::Enumeration(of, k) => of.literals.get(k as usize - 1).map(ToString::to_string),
            _ => None,
        }
    }

    fn color(&mut self, expr: Option<&Expr>) -> Option<Color> {
        let parts = self.value(expr?)?.items();
        let part = |k: usize| parts.get(k).and_then(Value::as_real).map(|value| value.clamp(0.0, 255.0) as u8);
        Some([part(0)?, part(1)?, part(2)?])
    }

    /// The box and the graphics of a layer, `Icon` or `Diagram`.
    pub(crate) fn layer(&mut self, annotation: Option<&Modification>, layer: &str) -> (Option<Extent>, Vec<Graphic>) {
        let Some(own) = annotation.and_then(|annotation| argument(annotation, layer)) else {
            return (None, Vec::new());
        };
        let system = argument(own, "coordinateSystem").and_then(|system| argument(system, "extent"));
        let extent = self.extent(system.and_then(|own| own.binding.as_ref()));
        let listed = argument(own, "graphics").and_then(|own| own.binding.as_ref());
        let graphics = match listed.map(|expr| &expr.kind) {
            Some(ExprKind::Array(items)) => {
                items.iter().take(MOST_GRAPHICS).filter_map(|item| self.graphic(item)).collect()
            }
            _ => Vec::new(),
        };
        (extent.filter(|own| own.width() > 0.0 && own.height() > 0.0), graphics)
    }

    fn graphic(&mut self, expr: &Expr) -> Option<Graphic> {
        let ExprKind::Call(name, Arguments::List { named, .. }) = &expr.kind else { return None };
        let get = |wanted: &str| find(named, wanted);
        if !self.is_true(get("visible"), true) {
            return None;
        }
        let kind = &*name.parts.last()?.name.name;
        let color = self.color(get(if kind == "Line" { "color" } else { "lineColor" }));
        let color = match kind {
            "Text" => self.color(get("textColor")).or(color),
            _ => color,
        };
        Some(Graphic {
            form: self.form(kind, named)?,
            origin: self.point(get("origin")).unwrap_or_default(),
            rotation: self.number(get("rotation")).unwrap_or(0.0),
            color: color.unwrap_or(BLACK),
            fill_color: self.color(get("fillColor")).unwrap_or(BLACK),
            dash: self.word(get("pattern")).map_or(Stroke::Solid, |word| dash(&word)),
            fill: self.word(get("fillPattern")).map_or(Fill::None, |word| fill(&word)),
            thickness: self.number(get(if kind == "Line" { "thickness" } else { "lineThickness" })).unwrap_or(0.25),
        })
    }

    fn form(&mut self, kind: &str, named: &[(Ident, Expr)]) -> Option<Form> {
        let get = |wanted: &str| find(named, wanted);
        let smooth = self.word(get("smooth")).is_some_and(|word| word == "Bezier");
        Some(match kind {
            "Line" => {
                let points = self.points(get("points")).filter(|points| points.len() > 1)?;
                let arrows = match get("arrow").map(|expr| &expr.kind) {
                    Some(ExprKind::Array(ends)) if ends.len() == 2 => {
                        [0, 1].map(|k| self.word(Some(&ends[k])).is_some_and(|word| word != "None"))
                    }
                    _ => [false; 2],
                };
                Form::Line { points, smooth, arrows }
            }
            "Polygon" => Form::Polygon { points: self.points(get("points")).filter(|own| own.len() > 2)?, smooth },
            "Rectangle" => {
                let radius = self.number(get("radius")).unwrap_or(0.0);
                Form::Rectangle { extent: self.extent(get("extent"))?, radius }
            }
            "Ellipse" => {
                let angles =
                    (self.number(get("startAngle")).unwrap_or(0.0), self.number(get("endAngle")).unwrap_or(360.0));
                let pie = self.word(get("closure")).is_none_or(|word| word == "Radial");
                Form::Ellipse { extent: self.extent(get("extent"))?, angles, pie }
            }
            "Text" => {
                let text = self.word(get("textString").or_else(|| get("string")))?;
                let align = match self.word(get("horizontalAlignment")).as_deref() {
                    Some("Left") => Align::Left,
                    Some("Right") => Align::Right,
                    _ => Align::Center,
                };
                let styles: Vec<String> = match get("textStyle").map(|expr| &expr.kind) {
                    Some(ExprKind::Array(styles)) => styles.iter().filter_map(|style| self.word(Some(style))).collect(),
                    _ => Vec::new(),
                };
                let has = |style: &str| styles.iter().any(|own| own == style);
                Form::Text {
                    extent: self.extent(get("extent"))?,
                    text,
                    size: self.number(get("fontSize")).unwrap_or(0.0),
                    align,
                    bold: has("Bold"),
                    italic: has("Italic"),
                }
            }
            "Bitmap" => {
                let data = self.word(get("imageSource")).filter(|data| data.len() <= LONGEST_PICTURE)?;
                let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '/' | '=');
                let data: String = data.chars().filter(|c| !c.is_whitespace()).collect();
                Form::Picture {
                    extent: self.extent(get("extent"))?,
                    data: Some(data).filter(|own| own.chars().all(is_plain))?,
                }
            }
            _ => return None,
        })
    }

    /// Where an annotation places a component; `icon`: in the icon of what has it.  `Err`: it is not shown there.
    pub(crate) fn placement(&mut self, annotation: Option<&Modification>, icon: bool) -> Result<Option<Placement>, ()> {
        let Some(own) = annotation.and_then(|annotation| argument(annotation, "Placement")) else { return Ok(None) };
        let visible = |own: &Modification, name: &str| argument(own, name).and_then(|own| own.binding.clone());
        let in_icon = argument(own, "iconTransformation").filter(|_| icon);
        let shown = match in_icon {
            Some(_) => visible(own, "iconVisible").or_else(|| visible(own, "visible")),
            None => visible(own, "visible"),
        };
        if !self.is_true(shown.as_ref(), true) {
            return Err(());
        }
        let Some(own) = in_icon.or_else(|| argument(own, "transformation")) else { return Ok(None) };
        let get = |name: &str| argument(own, name).and_then(|own| own.binding.as_ref());
        let Some(extent) = self.extent(get("extent")) else { return Ok(None) };
        let origin = self.point(get("origin")).unwrap_or_default();
        let rotation = self.number(get("rotation")).unwrap_or(0.0);
        Ok(Some(Placement { origin, extent, rotation }))
    }

    /// The line of a connection, in points of the diagram, with its colour.
    pub(crate) fn line(&mut self, annotation: &Modification) -> Option<(Vec<Point>, Option<Color>)> {
        let own = argument(annotation, "Line")?;
        let get = |name: &str| argument(own, name).and_then(|own| own.binding.as_ref());
        let points = self.points(get("points")).filter(|points| points.len() > 1)?;
        let origin = self.point(get("origin")).unwrap_or_default();
        let moved = points.into_iter().map(|own| Point::new(own.x + origin.x, own.y + origin.y)).collect();
        Some((moved, self.color(get("color"))))
    }
}

fn find<'a>(named: &'a [(Ident, Expr)], wanted: &str) -> Option<&'a Expr> {
    named.iter().find(|(name, _)| *name.name == *wanted).map(|(_, expr)| expr)
}

fn point_of(value: &Value) -> Option<Point> {
    let Value::Array(parts) = value else { return None };
    match parts.iter().map(Value::as_real).collect::<Option<Vec<f64>>>()?.as_slice() {
        [x, y] if x.is_finite() && y.is_finite() => Some(Point::new(*x, *y)),
        _ => None,
    }
}

fn dash(word: &str) -> Stroke {
    match word {
        "None" => Stroke::None,
        "Dash" => Stroke::Dash,
        "Dot" => Stroke::Dot,
        "DashDot" => Stroke::DashDot,
        "DashDotDot" => Stroke::DashDotDot,
        _ => Stroke::Solid,
    }
}

fn fill(word: &str) -> Fill {
    match word {
        "Solid" => Fill::Solid,
        "Horizontal" => Fill::Horizontal,
        "Vertical" => Fill::Vertical,
        "Cross" => Fill::Cross,
        "Forward" => Fill::Forward,
        "Backward" => Fill::Backward,
        "CrossDiag" => Fill::CrossDiagonal,
        "HorizontalCylinder" => Fill::HorizontalCylinder,
        "VerticalCylinder" => Fill::VerticalCylinder,
        "Sphere" => Fill::Sphere,
        _ => Fill::None,
    }
}

/// The annotation behind an equation.  Trees of equations do not keep it, so it is read from the text up to the end of the equation.
pub(crate) fn annotation_behind(files: &Files, equation: &Equation) -> Option<Modification> {
    let text = files.text(equation.span.file);
    let whole = text.get(equation.span.start as usize..)?;
    let length = end_of(whole)?;
    let at = whole[..length].find("annotation")?;
    let mut own = Files::new();
    let written = format!("model X {}; end X;", &whole[at..length]);
    let file = own.add("annotation", written.as_str());
    let parsed = hyd_syntax::parse(file, &written).value;
    parsed.classes.first()?.annotation.clone()
}

/// Where the first `;` stands outside of strings, comments and parentheses.
fn end_of(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let (mut k, mut depth) = (0, 0_i32);
    while k < bytes.len() {
        match bytes[k] {
            b'"' => {
                k += 1;
                while k < bytes.len() && bytes[k] != b'"' {
                    k += if bytes[k] == b'\\' { 2 } else { 1 };
                }
            }
            b'/' if bytes[k..].starts_with(b"//") => {
                while k < bytes.len() && bytes[k] != b'\n' {
                    k += 1;
                }
            }
            b'/' if bytes[k..].starts_with(b"/*") => k += text[k..].find("*/")?,
            b'(' | b'{' | b'[' => depth += 1,
            b')' | b'}' | b']' => depth -= 1,
            b';' if depth <= 0 => return Some(k),
            _ => {}
        }
        k += 1;
    }
    None
}

/// The box that icons and diagrams of a class have, the class itself asked first, and their graphics, bases first.
pub(crate) fn inherited(scopes: &mut Scopes<'_>, inst: hyd_instance::InstId, layer: &str) -> (Extent, Vec<Graphic>) {
    // A connector that is a variable has a class, but no components that a shape would tell.
    let class = scopes.instances[inst].class;
    let shape =
        scopes.instances[inst].shape.clone().or_else(|| scopes.quietly(|scopes| scopes.table.shape(class?).ok()));
    let Some(shape) = shape else { return (default_extent(), Vec::new()) };
    let mut extent = None;
    let mut by_frame = Vec::new();
    for (k, frame) in shape.frames.iter().enumerate() {
        let def = scopes.table.class(frame.class).def.clone();
        let scope = Scope { inst, frame: k as u32 };
        let (own, graphics) = Reader { scopes, scope }.layer(def.annotation.as_ref(), layer);
        extent = extent.or(own);
        by_frame.push(graphics);
    }
    let mut order = Vec::new();
    let ends: Vec<usize> =
        shape.frames.iter().map(|own| own.visible.iter().max().map_or(0, |&last| last as usize)).collect();
    bases_first(&ends, 0, &mut order);
    let graphics = order.into_iter().flat_map(|k| std::mem::take(&mut by_frame[k])).collect();
    (extent.unwrap_or_else(default_extent), graphics)
}

/// Frames with those of their bases before them; `ends`: of each frame the last one that it is made of.
fn bases_first(ends: &[usize], own: usize, order: &mut Vec<usize>) {
    let mut base = own + 1;
    while base <= ends[own] && base < ends.len() {
        bases_first(ends, base, order);
        base = ends[base].max(base) + 1;
    }
    order.push(own);
}

/// The declaration of a component, as it was redeclared, and one behind it with an annotation where that has none.
pub(crate) fn declared_annotation(scopes: &Scopes<'_>, inst: hyd_instance::InstId) -> Option<(Modification, Scope)> {
    let parent = scopes.instances[inst].parent?;
    let shape = scopes.instances[parent].shape.clone()?;
    let element = &shape.elements[*shape.by_name.get(scopes.declared_name(inst))? as usize];
    let read = |frame: u32, position: u32| {
        let class = shape.frames.get(frame as usize)?.class;
        let ClassBody::Long { elements, .. } = &scopes.table.class(class).def.body else { return None };
        match elements.get(position as usize)? {
            Element::Component(component) => component.annotation.clone(),
            _ => None,
        }
        .map(|annotation| (annotation, Scope { inst: parent, frame }))
    };
    let own = read(element.frame, element.position);
    own.or_else(|| element.replaced.and_then(|(frame, position)| read(frame, position)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_an_equation_is_found() {
        assert_eq!(end_of("connect(a, b) annotation(Line(points={{1,2}}));"), Some(46));
        assert_eq!(end_of("connect(a, b) \"a;b\" /* ; */ // ;\n;"), Some(33));
        assert_eq!(end_of("connect(a, b)"), None);
    }

    #[test]
    fn bases_are_drawn_first() {
        // 0 extends 1 and 3, 1 extends 2.
        let mut order = Vec::new();
        bases_first(&[3, 2, 2, 3], 0, &mut order);
        assert_eq!(order, [2, 1, 3, 0]);
    }
}
