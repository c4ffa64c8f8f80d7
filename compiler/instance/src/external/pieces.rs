//! A function of one variable that is a cubic polynomial between neighbouring points.

/// `y0 + ((c3*d + c2)*d + c1)*d` with `d` the distance from the left end of the piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cubic(pub [f64; 4]);

impl Cubic {
    /// A constant.
    pub const fn constant(value: f64) -> Self {
        Cubic([value, 0.0, 0.0, 0.0])
    }

    /// A straight line.
    pub const fn line(value: f64, slope: f64) -> Self {
        Cubic([value, slope, 0.0, 0.0])
    }

    /// The value at a distance.
    pub fn at(&self, d: f64) -> f64 {
        let [c0, c1, c2, c3] = self.0;
        c0 + ((c3 * d + c2) * d + c1) * d
    }

    /// The polynomial that is its derivative of an order.
    pub fn derivative(&self, order: u32) -> Self {
        let mut c = self.0;
        for _ in 0..order {
            c = [c[1], 2.0 * c[2], 3.0 * c[3], 0.0];
        }
        Cubic(c)
    }
}

/// What holds outside the points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// The first and the last value.
    Hold,
    /// Straight lines that go on from the first and the last two points.
    Line,
    /// The function is repeated.
    Repeat,
    /// Nothing: an error.
    Nothing,
}

/// The function.
#[derive(Clone, Debug, PartialEq)]
pub struct Pieces {
    /// Ends of the pieces, not decreasing; one more than there are pieces.
    pub ends: Vec<f64>,
    /// The pieces, each over the distance from its left end.
    pub cubics: Vec<Cubic>,
    /// Value at the last end.
    pub last: f64,
    /// The lines before the first end and behind the last one, over the distance from it.
    pub beyond: [Cubic; 2],
    /// What holds outside.
    pub outside: Outside,
}

impl Pieces {
    /// The value at `u`; `None` outside where nothing holds there.
    pub fn value(&self, u: f64) -> Option<f64> {
        let (first, last) = (self.ends[0], self.ends[self.ends.len() - 1]);
        let mut u = u;
        if self.outside == Outside::Repeat && !(first..=last).contains(&u) {
            u -= (last - first) * ((u - first) / (last - first)).floor();
        }
        if u < first || u > last {
            let (line, from) = if u < first { (self.beyond[0], first) } else { (self.beyond[1], last) };
            return (self.outside != Outside::Nothing).then(|| line.at(u - from));
        }
        if u >= last {
            return Some(self.last);
        }
        let k = self.ends.partition_point(|&end| end <= u) - 1;
        Some(self.cubics[k].at(u - self.ends[k]))
    }

    /// Its derivative of an order, piece by piece.
    pub fn derivative(&self, order: u32) -> Pieces {
        let of = |cubic: &Cubic| cubic.derivative(order);
        let last = match (order, self.cubics.last(), self.ends.as_slice()) {
            (0, ..) => self.last,
            (_, Some(cubic), [.., a, b]) => cubic.derivative(order).at(b - a),
            _ => 0.0,
        };
        Pieces {
            ends: self.ends.clone(),
            cubics: self.cubics.iter().map(of).collect(),
            last,
            beyond: self.beyond.map(|line| line.derivative(order)),
            outside: self.outside,
        }
    }
}
