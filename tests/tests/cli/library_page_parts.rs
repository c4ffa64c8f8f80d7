//! Parts of the page of a library by themselves: markup of documentation, equations as MathML.

mod html {
    use hyd_doc::html::{documentation, escape};

    #[test]
    fn markup_is_kept_only_where_it_is_known_and_balanced() {
        assert_eq!(escape("a < b & \"c\""), "a &lt; b &amp; &quot;c&quot;");
        assert_eq!(
            documentation("<html><P class=\"x\">a &lt; b <b>c</p> d<br>e < f</html>"),
            "<p>a &lt; b <b>c</b></p> d<br/>e &lt; f"
        );
        assert_eq!(documentation("<script>alert(1)</script><ul><li>x"), "alert(1)<ul><li>x</li></ul>");
    }
}

mod mathml {
    use hyd_doc::mathml::expression;
    use hyd_source::Files;
    use hyd_syntax::tree::EquationKind;

    /// MathML of the right side of `x = ...`, without its tags of grouping.
    fn shown(text: &str) -> String {
        let text = format!("model M equation x = {text}; end M;");
        let parsed = hyd_syntax::parse(Files::new().add("m", ""), &text);
        assert!(parsed.diagnostics.is_empty(), "{text}");
        let hyd_syntax::tree::ClassBody::Long { equations, .. } = &parsed.value.classes[0].body else { panic!() };
        let EquationKind::Equal(_, right) = &equations[0].equations[0].kind else { panic!() };
        expression(right).replace("<mrow>", "").replace("</mrow>", "")
    }

    #[test]
    fn forms_are_those_of_books() {
        assert_eq!(shown("a/(b + 1)"), "<mfrac><mi>a</mi><mi>b</mi><mo>+</mo><mn>1</mn></mfrac>");
        assert_eq!(shown("(a + b)*rho"), "<mo>(</mo><mi>a</mi><mo>+</mo><mi>b</mi><mo>)</mo><mo>⋅</mo><mi>ρ</mi>");
        assert_eq!(shown("p_R^2"), "<msup><msub><mi>p</mi><mi>R</mi></msub><mn>2</mn></msup>");
        assert_eq!(shown("der(x)"), "<mfrac><mi>d</mi><mi>x</mi><mi>d</mi><mi>t</mi></mfrac>");
        assert_eq!(shown("noEvent(sqrt(a))"), "<msqrt><mi>a</mi></msqrt>");
        assert_eq!(shown("a - (b - c)"), "<mi>a</mi><mo>−</mo><mo>(</mo><mi>b</mi><mo>−</mo><mi>c</mi><mo>)</mo>");
        assert_eq!(shown("(a/b)^2"), "<msup><mo>(</mo><mfrac><mi>a</mi><mi>b</mi></mfrac><mo>)</mo><mn>2</mn></msup>");
        assert_eq!(shown("2.5e-7"), "<mn>2.5</mn><mo>⋅</mo><msup><mn>10</mn><mo>−</mo><mn>7</mn></msup>");
        assert_eq!(shown("q[i, 1]"), "<msub><mi>q</mi><mi>i</mi><mo>,</mo><mn>1</mn></msub>");
        assert_eq!(
            shown("sum(k for k in 1:n)"),
            "<munder><mo>∑</mo><mi>k</mi><mo>=</mo><mn>1</mn><mo>,</mo><mo>…</mo><mo>,</mo><mi>n</mi></munder><mi>k</mi>"
        );
    }
}
