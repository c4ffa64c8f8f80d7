//! The launcher's arguments by themselves: their definitions, and habits of other programs that become ours.

mod arguments {
    use hyd_launcher::arguments::{Run, Sweep};

    use clap::CommandFactory;

    #[test]
    fn the_definitions_are_consistent() {
        Run::command().debug_assert();
        Sweep::command().debug_assert();
    }
}

mod habits {
    use std::ffi::OsString;

    use hyd_launcher::habits::rewrite;

    fn ours(arguments: &[&str]) -> Result<Vec<String>, String> {
        let arguments: Vec<OsString> = [&["exe"], arguments].concat().iter().map(OsString::from).collect();
        let list = rewrite(&arguments)?;
        Ok(list[1..].iter().map(|argument| argument.to_string_lossy().into_owned()).collect())
    }

    #[test]
    fn habits_become_our_options() {
        let cases: [(&[&str], &[&str]); 6] = [
            (&["-startTime=-1", "-override=startTime=0.5"], &["--start=-1", "--start=0.5"]),
            (&["-stopTime=2", "-r", "a.mat", "--json"], &["--stop=2", "--result=a.mat", "--json"]),
            (&["-override", "a[1,2]=1,b={1, 2},stopTime=3"], &["--set=a[1,2]=1", "--set=b={1, 2}", "--stop=3"]),
            (&["-override=m=1e-3"], &["--set=m=1e-3"]),
            (&["-tolerance=1e-8", "-numberOfIntervals", "10"], &["--tolerance=1e-8", "--intervals=10"]),
            (&["--stop", "-1", "-h"], &["--stop", "-1", "-h"]),
        ];
        for (theirs, wanted) in cases {
            assert_eq!(ours(theirs), Ok(wanted.iter().map(|w| w.to_string()).collect()), "{theirs:?}");
        }
        assert_eq!(ours(&["-s=dassl"]), Err("`-s` is not known here: use --solver auto, bdf or esdirk".into()));
        assert_eq!(ours(&["-override", "a"]), Err("-override: `a` is not NAME=VALUE".into()));
        assert_eq!(ours(&["-r"]), Err("`-r` needs a value".into()));
    }
}
