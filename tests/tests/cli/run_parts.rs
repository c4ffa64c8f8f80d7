//! What `hyd` and executables share, part by part: texts of files, arguments, names of variables, parameters, the summary of a run.

mod text_file {
    use std::path::Path;

    use hyd_run::{decode, read_text};

    #[test]
    fn bytes_that_are_no_text_are_named() {
        let decoded = |bytes: &[u8]| decode(Path::new("a.hyd"), bytes.to_vec()).map_err(|e| e.to_string());
        assert_eq!(decoded(b"\xEF\xBB\xBFmodel"), Ok("model".to_string()));
        assert_eq!(decoded(b"model\nA \xFF"), Err("`a.hyd` is not UTF-8 text: byte 8 (line 2) is 0xFF".to_string()));
    }

    #[test]
    fn folders_and_missing_files_are_told_apart() {
        let folder = std::env::temp_dir();
        let message = |path: &Path| read_text(path).unwrap_err().to_string();
        assert_eq!(message(&folder), format!("`{}` is a folder, not a file", folder.display()));
        let missing = folder.join("hyd-no-such-file.hyd");
        assert_eq!(message(&missing), format!("there is no file `{}`", missing.display()));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn endless_files_are_refused() {
        let message = read_text(Path::new("/dev/zero")).unwrap_err().to_string();
        assert_eq!(message, "`/dev/zero` is larger than 256 MB");
    }
}

mod arguments {
    use hyd_run::arguments::{assignment, names};

    #[test]
    fn assignments_have_two_sides() {
        assert_eq!(assignment("a[2].b = {1, 2}"), Ok(("a[2].b".into(), "{1, 2}".into())));
        for wrong in ["a", "=1", "a=", " = "] {
            assert_eq!(assignment(wrong), Err("expected NAME=VALUE".to_string()));
        }
    }

    #[test]
    fn commas_in_subscripts_separate_nothing() {
        let list = |text: &str| names(text).map(|names| names.0);
        assert_eq!(list("g, a[1,2].k"), Ok(vec!["g".to_string(), "a[1,2].k".to_string()]));
        assert!(list("a,,b").is_err() && list("").is_err());
    }
}

mod run_summary {
    use hyd_run::{Counters, FinalValues, RunSummary, Status};
    use hyd_runtime::Statistics;

    #[test]
    fn the_summary_as_text_and_json() {
        let summary = RunSummary {
            status: Status::Done,
            message: None,
            model: "Fall".into(),
            unit: None,
            start: 0.0,
            stop: 2.0,
            time: 2.0,
            tolerance: 1e-6,
            solver: "bdf",
            methods: Vec::new(),
            states: 2,
            unknowns: 3,
            templates: 4,
            code_bytes: 512,
            translate_s: 0.25,
            simulate_s: 1.5,
            counters: Counters::from(&Statistics { steps: 7, residuals: 9, ..Default::default() }),
            warnings: Vec::new(),
            jumps: Vec::new(),
            result: Some("fall.csv".into()),
            plot: None,
            profile_page: None,
            told: None,
            profile: None,
            final_values: FinalValues(vec![("h".into(), 1.5, "m".into()), ("speed".into(), f64::NAN, "".into())]),
            left_out: 97,
        };
        let text = "Fall: 0 to 2 s, done\n  2 states, 3 unknowns; 4 templates, 512 bytes of code\n  \
            7 steps (0 rejected, 0 not converged), 9 residuals, 0 Jacobians, 0 factorisations\n  \
            0 state events, 0 time events\n  translated in 250.0 ms, simulated in 1.50 s of CPU time\n  \
            results in fall.csv\n\nvalues at 2 s\n  h                 1.5 m\n  speed             NaN\n  \
            ... and 97 more; `--variables REGEX` chooses\n";
        assert_eq!(summary.text(), text);
        let json = concat!(
            r#"{"status":"done","message":null,"model":"Fall","start":0.0,"stop":2.0,"time":2.0,"tolerance":1e-6,"#,
            r#""solver":"bdf","methods":[],"states":2,"unknowns":3,"templates":4,"code_bytes":512,"translate_s":0.25,"simulate_s":1.5,"#,
            r#""counters":{"steps":7,"steps_by_order":[0,0,0,0,0],"one_step_steps":0,"residuals":9,"jacobians":0,"factorisations":0,"#,
            r#""newton_iterations":0,"error_rejections":0,"convergence_failures":0,"state_events":0,"time_events":0},"#,
            r#""warnings":[],"jumps":[],"result":"fall.csv","plot":null,"final":{"h":1.5,"speed":null}}"#,
            "\n"
        );
        assert_eq!(summary.json(), json);
    }
}

mod clock {
    use hyd_run::clock;

    #[test]
    fn work_takes_time_and_sleep_does_not() {
        let start = clock::cpu_seconds();
        let mut sum = 0.0;
        while clock::cpu_seconds() < start + 0.01 {
            sum = std::hint::black_box(sum + 1.0);
        }
        assert!(sum > 0.0);
    }
}

mod selection {
    use std::sync::Arc;

    use hyd_run::{Failure, Selection};
    use hyd_system::{NamePattern, Place, Settable, Source, Tables, ValueKind, Variability, VariableInfo};

    fn tables() -> Tables {
        let variable = |name: &str, size: u32, variability, protected| {
            let parts = vec![(Arc::from(name), if size > 0 { vec![size] } else { Vec::new() })];
            VariableInfo {
                name: NamePattern { parts, derivative: false },
                unit: "Pa".into(),
                display_unit: "".into(),
                description: "".into(),
                kind: ValueKind::Real,
                variability,
                settable: Settable::No,
                protected,
                sources: vec![Source { place: Place::Output(0), negated: false }; size.max(1) as usize],
            }
        };
        let variables = vec![
            variable("k", 0, Variability::Parameter, false),
            variable("p", 100, Variability::Continuous, false),
            variable("hidden", 0, Variability::Continuous, true),
            variable("part.q", 0, Variability::Continuous, false),
            variable("on", 0, Variability::Discrete, false),
        ];
        Tables { variables, ..Default::default() }
    }

    fn names(pattern: Option<&str>) -> Vec<String> {
        Selection::new(pattern).unwrap().shown(&tables()).into_iter().map(|shown| shown.column.name).collect()
    }

    #[test]
    fn the_default_is_few_and_public() {
        assert_eq!(names(None), ["p[1]", "p[51]", "p[100]", "on"]);
        // 97 elements of `p`, and `part.q`.
        assert_eq!(Selection::default().left_out(&tables(), 4), 98);
        assert_eq!(Selection::new(Some("on")).unwrap().left_out(&tables(), 1), 0);
    }

    #[test]
    fn a_pattern_chooses_anything() {
        assert_eq!(names(Some(r"^(k|part\..*|p\[1.\])$")).len(), 12);
        assert_eq!(names(Some("hidden")), ["hidden"]);
        assert!(matches!(Selection::new(Some("(")), Err(Failure::Usage(_))));
    }
}

mod parameter_file {
    use hyd_run::parameter_file::parse;

    #[test]
    fn names_are_written_in_three_ways() {
        let text = "\"a.b\" = 1.5\nc.d = [1, 2]\nmode = \"on\"\n[e.f]\ng = true\nh = 1e-3\n";
        let wanted = [("a.b", "1.5"), ("c.d", "{1, 2}"), ("e.f.g", "true"), ("e.f.h", "0.001"), ("mode", "on")];
        let mut list = parse(text).unwrap_or_default();
        list.sort();
        assert_eq!(list, wanted.map(|(name, value)| (name.to_string(), value.to_string())));
        assert!(parse("a = 1979-05-27").is_err() && parse("a = ").is_err());
    }
}
