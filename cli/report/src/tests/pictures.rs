//! Whole pictures: well-formed, complete, bounded in size, and never a panic.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

use std::sync::Arc;

use crate::{Curve, Figure, Shape};

fn curve(name: &str, run: usize, points: &[(f64, f64)]) -> Curve {
    let times: Arc<[f64]> = points.iter().map(|p| p.0).collect();
    Curve { name: name.into(), run, times, values: points.iter().map(|p| p.1).collect() }
}

fn wave(count: usize, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    (0..count).map(|k| k as f64 / (count - 1) as f64 * 0.04).map(|t| (t, f(t))).collect()
}

/// Checks that tags nest and attributes are quoted; returns the texts between tags.
fn texts_of(svg: &str) -> Vec<String> {
    let (mut open, mut texts) = (Vec::new(), Vec::new());
    let mut rest = svg;
    while let Some(start) = rest.find('<') {
        let text = rest[..start].trim();
        if !text.is_empty() {
            assert!(!open.is_empty(), "text outside of the root: {text}");
            texts.push(text.to_string());
        }
        let end = rest.find('>').expect("a tag ends");
        let tag = &rest[start + 1..end];
        assert!(!tag.contains('<') && tag.matches('"').count().is_multiple_of(2), "<{tag}>");
        let name = tag.split_whitespace().next().unwrap();
        match name.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop(), Some(name)),
            None if tag.ends_with('/') || tag.starts_with('?') => {}
            None => open.push(name),
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty() && rest.trim().is_empty());
    texts
}

#[test]
fn axes_legends_and_units_are_written() {
    let curves = vec![
        ("Pa".to_string(), curve("hy.p_R", 0, &wave(500, |t| 1e7 * (1.0 - (-200.0 * t).exp())))),
        ("Pa".to_string(), curve("hy.p_0", 0, &wave(500, |_| 1e7))),
        ("m".to_string(), curve("sh.x", 0, &wave(500, |t| 1.5e-3 * (100.0 * t).sin()))),
    ];
    let figure = Figure { title: Some("Drive <1> & more".into()), ..Figure::by_unit(vec!["run".into()], curves) };
    let texts = texts_of(&figure.draw().svg());
    let expected = [
        "Drive &lt;1&gt; &amp; more",
        "hy.p_R",
        "hy.p_0",
        "0",
        "2",
        "4",
        "6",
        "8",
        "10",
        "[MPa]",
        "0",
        "5",
        "10",
        "15",
        "20",
        "25",
        "30",
        "35",
        "40",
        "−1.0",
        "−0.5",
        "0.0",
        "0.5",
        "1.0",
        "1.5",
        "sh.x [mm]",
        "time [ms]",
    ];
    assert_eq!(texts, expected);
}

#[test]
fn curves_stay_inside_the_picture_and_below_two_thousand_points() {
    let points = wave(200_001, |t| (1e5 * t).sin());
    let figure = Figure::by_unit(vec![], [("V".to_string(), curve("u", 0, &points))]);
    let drawing = figure.draw();
    let mut longest = 0;
    for shape in &drawing.shapes {
        let Shape::Lines { pieces, .. } = shape else {
            continue;
        };
        for (x, y) in pieces.iter().flatten() {
            assert!((0.0..=drawing.width).contains(x) && (0.0..=drawing.height).contains(y));
        }
        longest = longest.max(pieces.iter().map(Vec::len).sum());
    }
    assert!((1000..=2000).contains(&longest), "{longest}");
}

#[test]
fn an_event_is_a_vertical_line() {
    let points = [(0.0, 0.0), (1.0, 0.0), (1.0, 5.0), (2.0, 5.0)];
    let drawing = Figure::by_unit(vec![], [("V".to_string(), curve("u", 0, &points))]).draw();
    let Some(Shape::Lines { pieces, .. }) = drawing.shapes.last_chunk::<2>().map(|[curve, _]| curve) else {
        panic!("the curve is drawn before the time's label")
    };
    assert_eq!(pieces[0][1].0, pieces[0][2].0);
    assert!(pieces[0][1].1 > pieces[0][2].1 + 100.0);
}

#[test]
fn strange_data_still_give_a_picture() {
    let nan = f64::NAN;
    let cases: [&[(f64, f64)]; 8] = [
        &[],
        &[(0.0, 1.0)],
        &[(0.0, nan), (1.0, nan)],
        &[(0.0, 1.0), (1.0, nan), (2.0, 3.0)],
        &[(0.0, 1e308), (1.0, -1e308)],
        &[(0.0, 5e-324), (1.0, 0.0)],
        &[(nan, 1.0), (f64::INFINITY, 2.0)],
        &[(0.0, 1.0), (1e-300, 2.0)],
    ];
    for points in cases {
        for unit in ["", "Pa", "1", "kg/m3"] {
            let long = "a.very.long.name".repeat(20);
            let curves = [(unit.to_string(), curve(&long, 0, points)), (unit.to_string(), curve("b", 1, points))];
            let drawing = Figure::by_unit(vec![long.clone(), "b".into()], curves).draw();
            texts_of(&drawing.svg());
            drawing.png(1.0).unwrap();
        }
    }
    texts_of(&Figure::by_unit(vec![], []).draw().svg());
}
