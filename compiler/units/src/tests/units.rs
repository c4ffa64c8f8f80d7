//! Reading and printing units against the tables of the SI brochure (BIPM 2019) and the Modelica specification 3.6.

use proptest::prelude::*;

use crate::{Unit, parse_unit, to_text};

fn same(a: &str, b: &str) {
    let (x, y) = (parse_unit(a).expect(a), parse_unit(b).expect(b));
    assert_eq!(x.dimension, y.dimension, "{a} and {b}");
    assert!((x.factor / y.factor - 1.0).abs() < 1e-14, "{a} and {b}: {} and {}", x.factor, y.factor);
}

#[test]
fn derived_units_are_as_in_table_4_of_the_brochure() {
    // Symbol, expression in base units, expression in other units.
    let table = [
        ("Hz", "s-1", "1/s"),
        ("N", "kg.m.s-2", "J/m"),
        ("Pa", "kg.m-1.s-2", "N/m2"),
        ("J", "kg.m2.s-2", "N.m"),
        ("W", "kg.m2.s-3", "J/s"),
        ("C", "A.s", "F.V"),
        ("V", "kg.m2.s-3.A-1", "W/A"),
        ("F", "kg-1.m-2.s4.A2", "C/V"),
        ("Ohm", "kg.m2.s-3.A-2", "V/A"),
        ("S", "kg-1.m-2.s3.A2", "A/V"),
        ("Wb", "kg.m2.s-2.A-1", "V.s"),
        ("T", "kg.s-2.A-1", "Wb/m2"),
        ("H", "kg.m2.s-2.A-2", "Wb/A"),
        ("lx", "cd.sr.m-2", "lm/m2"),
        ("Gy", "m2.s-2", "J/kg"),
        ("kat", "mol.s-1", "mol/s"),
        ("rad", "m/m", "1"),
    ];
    for (symbol, base, other) in table {
        same(symbol, base);
        same(symbol, other);
    }
}

#[test]
fn other_units_have_the_values_of_tables_7_and_8() {
    let table = [
        ("min", 60.0, "s"),
        ("h", 3600.0, "s"),
        ("d", 86400.0, "s"),
        ("deg", 0.017453292519943295, "1"),
        ("l", 1e-3, "m3"),
        ("L", 1e-3, "m3"),
        ("t", 1000.0, "kg"),
        ("bar", 1e5, "Pa"),
        ("mbar", 100.0, "Pa"),
        ("eV", 1.602176634e-19, "J"),
        ("mm2", 1e-6, "m2"),
        ("cm3", 1e-6, "m3"),
        ("l/min", 1e-3 / 60.0, "m3/s"),
        ("rpm", 0.10471975511965977, "1/s"),
        ("W.h", 3600.0, "J"),
        ("kg", 1.0, "kg"),
        ("Mg", 1000.0, "kg"),
        ("daN", 10.0, "N"),
        ("um", 1e-6, "m"),
        ("degRk", 5.0 / 9.0, "K"),
    ];
    for (text, factor, coherent) in table {
        let (unit, si) = (parse_unit(text).expect(text), parse_unit(coherent).expect(coherent));
        assert_eq!(unit.dimension, si.dimension, "{text}");
        assert!((unit.factor / factor - 1.0).abs() < 1e-14, "{text}: {}", unit.factor);
    }
    // 100 degC = 373.15 K = 212 degF
    let kelvin = |text: &str, value: f64| {
        let unit = parse_unit(text).expect(text);
        unit.factor * value + unit.offset
    };
    assert!((kelvin("degC", 100.0) - 373.15).abs() < 1e-9 && (kelvin("degF", 212.0) - 373.15).abs() < 1e-9);
}

#[test]
fn symbols_come_before_prefixes_and_notations_agree() {
    // min is not a milli-inch, cd not a centi-day, Pa not a peta-year, T not a prefix.
    assert_eq!(parse_unit("min").expect("min").factor, 60.0);
    assert_eq!(to_text(&parse_unit("cd").expect("cd")), "cd");
    for (a, b) in
        [("m3/(s.Pa)", "m3.s-1.Pa-1"), ("(N.m)/s", "W"), ("1/(s.m)", "s-1.m-1"), ("m+2", "m2"), ("1/s", "s-1")]
    {
        same(a, b);
    }
    same("m(1/2).m(1/2)", "m");
}

#[test]
fn what_is_no_unit_is_rejected_with_a_suggestion() {
    let table = [
        ("Pascal", "did you mean `Pa`?"),
        ("Newtons", "did you mean `N`?"),
        ("kgs", "did you mean `kg`?"),
        ("pa", "did you mean `Pa`?"),
        ("mpa", "did you mean `MPa`?"),
        ("Nm", "did you mean `N.m`?"),
        ("\u{b5}m", "did you mean `um`? The letter u stands for micro"),
        ("m^2", "exponents stand directly behind the symbol: `m2`, `s-1`"),
        ("N*m", "factors are joined by `.`: `N.m`"),
        ("m/s/s", "put the denominator in parentheses: `J/(kg.K)`"),
        ("psi", "outside the SI: 1 psi = 6894.757 Pa"),
        ("1000/s", "the only number in a unit is 1; use a prefix, such as `mm` or `kPa`"),
    ];
    for (text, help) in table {
        assert_eq!(parse_unit(text).expect_err(text).help.as_deref(), Some(help), "{text}");
    }
    for text in [
        "",
        "m/",
        "(m",
        "m)",
        "m..s",
        "m-",
        "kkg",
        "mmin",
        "m999999",
        "\u{1f600}",
        "m s",
        "J/kg.K",
        "((((((((((((((((((m",
    ] {
        assert!(parse_unit(text).is_err(), "{text}");
    }
}

#[test]
fn familiar_names_are_preferred_in_print() {
    let table = [
        ("kg.m/s2", "N"),
        ("N/m2", "Pa"),
        ("W/A", "V"),
        ("kg.m2/s3", "W"),
        ("m.m/m", "m"),
        ("kg.m3/(s4.A)", "kg.m3/(s4.A)"),
    ];
    for (text, printed) in table {
        assert_eq!(to_text(&parse_unit(text).expect(text)), printed);
    }
    assert_eq!(to_text(&parse_unit("mm").expect("mm")), "0.001 m");
    assert_eq!(to_text(&parse_unit("m(1/2)").expect("root")), "m(1/2)");
}

#[test]
fn plane_angles_are_counted_apart() {
    let table = [
        ("rad", Some(1)),
        ("deg/s2", Some(1)),
        ("rpm", Some(1)),
        ("mrad", Some(1)),
        ("N.m/rad", Some(-1)),
        ("kg.m2/rad2", Some(-2)),
        ("N.m.s/(rad.K)", Some(-1)),
        ("rad(1/2)", None),
        ("cd", Some(0)),
        ("Hz", Some(0)),
        ("radian", None),
    ];
    for (text, power) in table {
        assert_eq!(crate::plane_angle(text), power, "{text}");
    }
}

proptest! {
    #[test]
    fn printed_units_read_back(exponents in proptest::array::uniform7(-6i32..7), den in 1i64..4) {
        let mut unit = Unit::ONE;
        for (symbol, n) in crate::BASE_SYMBOLS.iter().zip(exponents) {
            let base = parse_unit(symbol).expect("base");
            let exponent = crate::Rational::new(i64::from(n), den).expect("small");
            unit = unit.times(&base, exponent).expect("small");
        }
        let back = parse_unit(&to_text(&unit)).expect("printed");
        prop_assert_eq!(back.dimension, unit.dimension);
        prop_assert!((back.factor - 1.0).abs() < 1e-12);
    }

    #[test]
    fn any_text_gives_an_answer(text in "\\PC{0,40}") {
        let _ = parse_unit(&text);
    }

    #[test]
    fn any_unit_like_text_gives_an_answer(text in "[a-zA-Z0-9./()+-]{0,30}") {
        let _ = parse_unit(&text);
    }
}
