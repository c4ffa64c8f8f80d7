//! Names that are close to a wrong one, and places in a text as lines and columns.

mod diagnostic {
    use hyd_source::{did_you_mean, edit_distance};

    #[test]
    fn suggestions_are_close_or_absent() {
        let names = ["pressure", "position", "p", "Velocity"];
        assert_eq!(did_you_mean("presure", names), Some("did you mean `pressure`?".into()));
        assert_eq!(did_you_mean("velocity", names), Some("did you mean `Velocity`?".into()));
        assert_eq!(did_you_mean("F0", ["F", "F_0", "G0"]), Some("did you mean `F_0`?".into()));
        assert_eq!(did_you_mean("K_mass", ["KMASS", "k_mass"]), Some("did you mean `k_mass`?".into()));
        assert_eq!(did_you_mean("stiffness", names), None);
        assert_eq!(did_you_mean("k", names), None);
        assert_eq!(did_you_mean("P", names), Some("did you mean `p`?".into()));
        assert_eq!(edit_distance("ab", "ba"), 1);
    }
}

mod files {
    use hyd_source::{Files, Location, Span};

    #[test]
    fn locations_count_lines_and_characters_from_one() {
        let mut files = Files::new();
        let id = files.add("a.hyd", "äb\ncd\n");
        let at = |k| files.location(Span::new(id, k, k));
        assert_eq!(at(0), Location { line: 1, column: 1 });
        assert_eq!(at(2), Location { line: 1, column: 2 });
        assert_eq!(at(4), Location { line: 2, column: 1 });
        assert_eq!(at(7), Location { line: 3, column: 1 });
    }
}
