//! Points, boxes and affine maps in the coordinates of diagrams: x to the right, y upwards, as Modelica 3.6, section 18.6.1, has them.

/// A point.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Point {
    pub(crate) fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }
}

/// Two corners; the second may lie left of the first or below it, which mirrors what is drawn between them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Extent {
    pub(crate) from: Point,
    pub(crate) to: Point,
}

impl Extent {
    pub(crate) fn new(x1: f64, y1: f64, x2: f64, y2: f64) -> Self {
        Self { from: Point::new(x1, y1), to: Point::new(x2, y2) }
    }

    pub(crate) fn width(&self) -> f64 {
        (self.to.x - self.from.x).abs()
    }

    pub(crate) fn height(&self) -> f64 {
        (self.to.y - self.from.y).abs()
    }

    pub(crate) fn center(&self) -> Point {
        Point::new((self.from.x + self.to.x) / 2.0, (self.from.y + self.to.y) / 2.0)
    }

    pub(crate) fn left(&self) -> f64 {
        self.from.x.min(self.to.x)
    }

    pub(crate) fn right(&self) -> f64 {
        self.from.x.max(self.to.x)
    }

    pub(crate) fn bottom(&self) -> f64 {
        self.from.y.min(self.to.y)
    }

    pub(crate) fn top(&self) -> f64 {
        self.from.y.max(self.to.y)
    }

    /// The smallest box around this one and a point.
    pub(crate) fn around(&self, point: Point) -> Self {
        Self::new(
            self.left().min(point.x),
            self.bottom().min(point.y),
            self.right().max(point.x),
            self.top().max(point.y),
        )
    }

    /// The corners.
    pub(crate) fn corners(&self) -> [Point; 4] {
        let (a, b) = (self.from, self.to);
        [a, Point::new(b.x, a.y), b, Point::new(a.x, b.y)]
    }
}

/// `(x, y)` becomes `(a*x + c*y + e, b*x + d*y + f)`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Affine {
    pub(crate) a: f64,
    pub(crate) b: f64,
    pub(crate) c: f64,
    pub(crate) d: f64,
    pub(crate) e: f64,
    pub(crate) f: f64,
}

impl Affine {
    pub(crate) const IDENTITY: Self = Self { a: 1.0, b: 0.0, c: 0.0, d: 1.0, e: 0.0, f: 0.0 };

    /// Moved to `origin` after a turn by so many degrees.
    pub(crate) fn placed(origin: Point, rotation: f64) -> Self {
        let (sin, cos) = match rotation.rem_euclid(360.0) {
            0.0 => (0.0, 1.0),
            90.0 => (1.0, 0.0),
            180.0 => (0.0, -1.0),
            270.0 => (-1.0, 0.0),
            other => hyd_system::math::sin_cos(other.to_radians()),
        };
        Self { a: cos, b: sin, c: -sin, d: cos, e: origin.x, f: origin.y }
    }

    /// Maps one box onto another; one without size is only moved.
    pub(crate) fn onto(from: Extent, to: Extent) -> Self {
        let scale = |own: f64, other: f64| if own == 0.0 { 1.0 } else { other / own };
        let a = scale(from.to.x - from.from.x, to.to.x - to.from.x);
        let d = scale(from.to.y - from.from.y, to.to.y - to.from.y);
        Self { a, b: 0.0, c: 0.0, d, e: to.from.x - a * from.from.x, f: to.from.y - d * from.from.y }
    }

    /// This map after `first`.
    pub(crate) fn after(&self, first: &Self) -> Self {
        let at = self.apply(Point::new(first.e, first.f));
        Self {
            a: self.a * first.a + self.c * first.b,
            b: self.b * first.a + self.d * first.b,
            c: self.a * first.c + self.c * first.d,
            d: self.b * first.c + self.d * first.d,
            e: at.x,
            f: at.y,
        }
    }

    pub(crate) fn apply(&self, point: Point) -> Point {
        Point::new(self.a * point.x + self.c * point.y + self.e, self.b * point.x + self.d * point.y + self.f)
    }

    /// The box around an image of a box.
    pub(crate) fn bounds(&self, extent: &Extent) -> Extent {
        let [first, rest @ ..] = extent.corners().map(|corner| self.apply(corner));
        let own = Extent { from: first, to: first };
        rest.into_iter().fold(own, |own, point| own.around(point))
    }

    /// By how much lengths along x and y grow.
    pub(crate) fn scales(&self) -> (f64, f64) {
        ((self.a * self.a + self.b * self.b).sqrt(), (self.c * self.c + self.d * self.d).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_goes_onto_another_mirrored_and_turned() {
        let icon = Extent::new(-100.0, -100.0, 100.0, 100.0);
        let map = Affine::placed(Point::new(50.0, 20.0), 90.0)
            .after(&Affine::onto(icon, Extent::new(10.0, -10.0, -10.0, 10.0)));
        // The right of the icon is mirrored to the left, which a quarter turn brings down.
        assert_eq!(map.apply(Point::new(100.0, 0.0)), Point::new(50.0, 10.0));
        assert_eq!(map.apply(Point::new(0.0, 100.0)), Point::new(40.0, 20.0));
        assert_eq!(map.scales(), (0.1, 0.1));
        assert_eq!(map.bounds(&icon), Extent::new(40.0, 10.0, 60.0, 30.0));
    }
}
