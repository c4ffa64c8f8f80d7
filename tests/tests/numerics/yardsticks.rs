//! What results are compared with, checked by itself: the pair of Dormand and Prince, the fit by least squares, the verdict.

mod dormand_prince {
    use hyd_tests::dormand_prince::{A, Accuracy, C, E, integrate};

    #[test]
    fn coefficients_satisfy_the_row_sums() {
        for (row, c) in A.iter().zip(C) {
            assert!((row.iter().sum::<f64>() - c).abs() < 1e-14);
        }
        assert!(E.iter().sum::<f64>().abs() < 1e-15);
    }

    #[test]
    fn a_circle_is_followed() {
        let times: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.1).collect();
        let accuracy = Accuracy { rtol: 1e-11, atol: [1e-12; 2] };
        let values = integrate(|_, y: &[f64; 2]| [y[1], -y[0]], &times, [0.0, 1.0], &accuracy);
        for (t, y) in times.iter().zip(&values) {
            assert!((y[0] - t.sin()).abs() < 1e-9 && (y[1] - t.cos()).abs() < 1e-9, "{t}: {y:?}");
        }
    }
}

mod least_squares {
    use hyd_tests::least_squares::fit;

    #[test]
    fn an_exponential_is_recovered() {
        let data: Vec<(f64, f64)> =
            (0..20).map(|k| (f64::from(k) / 10.0, 3.0 * (-1.7 * f64::from(k) / 10.0).exp())).collect();
        let [a, b] = fit(|p: &[f64; 2]| data.iter().map(|(t, y)| p[0] * (-p[1] * t).exp() - y).collect(), [1.0, 0.5]);
        assert!((a - 3.0).abs() < 1e-9 && (b - 1.7).abs() < 1e-9, "{a} {b}");
    }
}

mod reference {
    use hyd_tests::reference::verdict;

    #[test]
    fn verdicts_find_the_worst_sample() {
        let times = [0.0, 1.0, 2.0];
        assert_eq!(verdict("x", &times, &[1.0, 2.0, 3.0], &[1.0, 2.0, 3.1], 0.2), "");
        let text = verdict("x", &times, &[1.0, 2.0, 3.0], &[1.0, 2.5, 3.1], 0.2);
        assert!(text.starts_with("x at 1 s: 2e0 instead of 2.5e0"), "{text}");
        assert!(!verdict("x", &times, &[1.0, f64::NAN, 3.0], &[1.0, 2.0, 3.0], 0.2).is_empty());
    }
}
