//! Files as labs write them, made of a record that is known, imported again.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::{Asked, Assumptions, Content, Imported, Plan, RawFile};
use crate::Fault;
use hyd_system::random::SplitMix;

/// Rows of the record.
const ROWS: usize = 400;
/// Its period (s).
const PERIOD: f64 = 1e-4;
/// When the trigger rises (s).
const TRIGGER: f64 = 0.01005;

/// Time (s), pressure (bar), lift (mm) and trigger (V) of a row, to the digits that files have.
fn record(row: usize) -> [f64; 4] {
    let mut draws = SplitMix(row as u64);
    let t = row as f64 * PERIOD;
    let after = (t - TRIGGER).max(0.0);
    let exact = [100.0 + 2e3 * after + 0.2 * draws.normal(), 300.0 * after + 0.01 * draws.normal()];
    let [p, y] = exact.map(|value| (value * 1000.0).round() / 1000.0);
    [t, p, y, if t > TRIGGER { 5.0 } else { 0.0 }]
}

/// The record as a text.
fn text(head: &str, row: impl Fn(&[f64; 4]) -> String) -> String {
    let mut text = head.to_string();
    (0..ROWS).for_each(|k| writeln!(text, "{}", row(&record(k))).unwrap_or_default());
    text
}

/// Semicolons, decimal commas, milliseconds, a preamble and a row of units.
fn german() -> String {
    let head = "Prüfstand 3\nVersorgung [bar];100,5\n\nZeit;Druck;Weg;Trig\nms;bar;µm;V\n";
    text(head, |[t, p, y, u]| format!("{:.1};{p:.3};{:.0};{u:.1}", t * 1e3, y * 1e3).replace('.', ","))
}

fn run(bytes: Vec<u8>, asked: &Asked) -> Result<(Plan, Imported), Fault> {
    let files = [RawFile { name: "shot_07.csv".into(), content: Content::Text(bytes.clone()) }];
    let Assumptions { plan, notes, .. } = Plan::assume("bench", "raw", &files, asked)?;
    let outcome = plan.carry_out(&notes, &mut |_| Ok(Content::Text(bytes.clone())))?;
    Ok((plan, outcome))
}

/// Names and columns of a table.
fn columns(csv: &str) -> BTreeMap<String, Vec<f64>> {
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let names: Vec<String> = reader.headers().map(|own| own.iter().map(String::from).collect()).unwrap_or_default();
    let mut columns: BTreeMap<String, Vec<f64>> = names.iter().map(|name| (name.clone(), Vec::new())).collect();
    for row in reader.records().flatten() {
        for (name, field) in names.iter().zip(row.iter()) {
            columns.entry(name.clone()).or_default().push(field.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

fn near(found: &[f64], expected: impl Fn(&[f64; 4]) -> f64) -> bool {
    let same = |(k, value): (usize, &f64)| {
        let wanted = expected(&record(k));
        (value - wanted).abs() <= 1e-9 * wanted.abs().max(1e-6)
    };
    found.len() == ROWS && found.iter().enumerate().all(same)
}

#[test]
fn the_same_record_comes_of_every_form() {
    let latin: Vec<u8> = german().chars().map(|c| u32::from(c) as u8).collect();
    let wide: Vec<u8> = format!("\u{FEFF}{}", german()).encode_utf16().flat_map(u16::to_le_bytes).collect();
    let tabs = text("t [s]\tDruck [bar]\tWeg (mm)\tTrig [V]\n", |[t, p, y, u]| format!("{t:.4}\t{p:.3}\t{y:.3}\t{u}"));
    let blanks =
        text("# t_ms Druck_bar Weg_mm Trig_V\n", |[t, p, y, u]| format!(" {:.1}  {p:.3}  {y:.3} {u}", t * 1e3));
    let commas =
        text("time,Druck / kPa,Weg in mm,Trig\n", |[t, p, y, u]| format!("{t:.4},{:.1},{y:.3},{u}", p * 100.0));
    for bytes in [german().into_bytes(), latin, wide, tabs.into_bytes(), blanks.into_bytes(), commas.into_bytes()] {
        let (plan, outcome) = run(bytes, &Asked::default()).expect("it is imported");
        let (name, csv) = &outcome.tables[0];
        let found = columns(csv);
        assert_eq!(name, "shot_07.csv");
        let trigger = found.keys().find(|name| name.starts_with("Trig")).expect("the trigger");
        assert!(near(&found["Druck"], |row| row[1] * 1e5), "{csv}");
        assert!(near(&found["Weg"], |row| row[2] * 1e-3), "{csv}");
        assert!(near(&found[trigger], |row| row[3]), "{csv}");
        assert!(near(&found["time_s"], |row| row[0] - TRIGGER), "{csv}");
        assert_eq!(plan.shot[0].number, 7);
        // What is written as TOML is read as the same plan.
        let again = Plan::parse(&plan.text()).expect("the text of a plan");
        assert_eq!(again, plan);
    }
}

#[test]
fn the_set_has_conditions_and_estimated_noise() {
    let (plan, outcome) = run(german().into_bytes(), &Asked::default()).expect("it is imported");
    let set: serde_json::Value = serde_json::from_str(&outcome.set).expect("JSON");
    let noise = set["noise_std"]["Druck"].as_f64().expect("noise");
    assert!((noise / 0.2e5 - 1.0).abs() < 0.15, "{noise}");
    assert!(
        set["remarks"][0].as_str().is_some_and(|remark| remark.contains("`Druck`") && remark.contains("estimates"))
    );
    assert_eq!(set["experiments"][0]["Versorgung"].as_f64(), Some(10_050_000.0));
    assert_eq!(set["sampling_Hz"].as_f64(), Some(1e4));
    // What the lab states is not estimated.
    let edited = plan.text().replace("# noise_std = { p = 3e4 }", "noise_std = { Druck = 3e4 }");
    let plan = Plan::parse(&edited).expect("an edited plan");
    let outcome = plan.carry_out(&BTreeMap::new(), &mut |_| Ok(Content::Text(german().into_bytes()))).expect("again");
    let set: serde_json::Value = serde_json::from_str(&outcome.set).expect("JSON");
    assert_eq!(set["noise_std"]["Druck"].as_f64(), Some(3e4));
    assert!(set["remarks"][0].as_str().is_some_and(|remark| !remark.contains("`Druck`")));
    // The study that comes with it is one.
    let study = crate::Study::parse(&outcome.study).expect("a study");
    assert_eq!(study.channels.keys().collect::<Vec<_>>(), ["Druck", "Weg"]);
    let table = &outcome.tables[0].1;
    let bench =
        crate::Bench::parse("set.json".as_ref(), &outcome.set, &study, &mut |_| Ok(table.clone())).expect("a set");
    assert_eq!((bench.shots[0].number, bench.warnings), (7, Vec::new()));
}

#[test]
fn rates_stand_in_for_times() {
    let plain = text("p [bar];y [mm]\n", |[_, p, y, _]| format!("{p};{y}"));
    let said = run(plain.clone().into_bytes(), &Asked::default()).err().expect("no times").sentence;
    assert!(said.starts_with("`shot_07.csv`: line 1: no column of times was found among p [bar], y [mm]"), "{said}");
    let asked = Asked { rate: Some(1e4), ..Asked::default() };
    let with_head = format!("Sample rate;10000 Hz\n{plain}");
    for outcome in [run(plain.into_bytes(), &asked), run(with_head.into_bytes(), &Asked::default())] {
        let (plan, outcome) = outcome.expect("it is imported");
        assert_eq!(plan.layout[0].rate, Some(1e4));
        assert!(near(&columns(&outcome.tables[0].1)["time_s"], |row| row[0]));
    }
}

#[test]
fn a_column_of_times_can_be_named() {
    let plain = text("ticks;p [bar];y [mm]\n", |[t, p, y, _]| format!("{:.1};{p};{y}", 1.0 + (t * 1e4).powi(2)));
    let said = run(plain.clone().into_bytes(), &Asked::default()).err().expect("no times").sentence;
    assert!(said.contains("--time COLUMN names it, or --rate HZ"), "{said}");
    let asked = Asked { time: vec!["ticks".into()], ..Asked::default() };
    let (plan, outcome) = run(plain.clone().into_bytes(), &asked).expect("it is imported");
    assert_eq!(plan.layout[0].time.as_deref(), Some("ticks"));
    assert!(near(&columns(&outcome.tables[0].1)["time_s"], |row| 1.0 + (row[0] * 1e4).round().powi(2)));
    let asked = Asked { time: vec!["tick".into()], ..Asked::default() };
    let said = run(plain.into_bytes(), &asked).err().expect("no such column").sentence;
    assert_eq!(said, "no file has a column `tick` that could hold its times; did you mean `ticks`?");
}

#[test]
fn repeated_times_are_left_out_where_that_is_asked_for() {
    let twice = german().replacen("2,3;", "2,2;", 1);
    assert_ne!(twice, german());
    let said = run(twice.clone().into_bytes(), &Asked::default()).err().expect("a time twice").sentence;
    assert!(said.contains("stands twice: 0.0022 s after 0.0022 s; times must ascend (--drop-repeated"), "{said}");
    let asked = Asked { drop_repeated: true, ..Asked::default() };
    let (plan, outcome) = run(twice.clone().into_bytes(), &asked).expect("it is imported");
    assert!(outcome.words.contains("; 1 row is left out, for its time is that of the row before"), "{}", outcome.words);
    assert_eq!(columns(&outcome.tables[0].1)["Druck"].len(), ROWS - 1);
    let again = Plan::parse(&plan.text()).expect("the text of a plan");
    assert_eq!(again, plan);
    // A clock of ten steps for four hundred rows is too coarse.
    let coarse = text("t [s];p\n", |[t, p, _, _]| format!("{:.3};{p}", (t * 250.0).floor() / 250.0));
    let said = run(coarse.into_bytes(), &Asked::default()).err().expect("times twice").sentence;
    assert!(said.contains("(390 of 400 rows have the time of the row before, so the clock is too coarse"), "{said}");
}

#[test]
fn a_file_is_cut_into_parts() {
    let asked = Asked { no_trigger: true, ..Asked::default() };
    let (plan, _) = run(german().into_bytes(), &asked).expect("it is imported");
    assert_eq!(plan.layout[0].trigger, None);
    let shot = "file = \"shot_07.csv\"\nnumber = ";
    let cut = plan.text().replace(
        &format!("[[shot]]\n{shot}7\n"),
        &format!("[[shot]]\n{shot}7\nend = 0.00995\n\n[[shot]]\n{shot}8\nbegin = 0.01\nend = 0.0149\nzero = 0.01\n"),
    );
    let plan = Plan::parse(&cut).expect("an edited plan");
    assert_eq!(Plan::parse(&plan.text()).expect("its text"), plan);
    let read = |plan: &Plan| plan.carry_out(&BTreeMap::new(), &mut |_| Ok(Content::Text(german().into_bytes())));
    let outcome = read(&plan).expect("it is imported");
    let times: Vec<Vec<f64>> = outcome.tables.iter().map(|(_, csv)| columns(csv)["time_s"].clone()).collect();
    assert_eq!((times[0].len(), times[0][0], times[0][99]), (100, 0.0, 0.0099));
    assert_eq!((times[1].len(), times[1][0], times[1][49]), (50, 0.0, 0.0049));
    assert_eq!(columns(&outcome.tables[1].1)["Druck"][0], record(100)[1] * 1e5);
    for (from, to, expected) in [
        ("begin = 0.01", "begin = 0.02", "the shot ends at 0.0149 s, and begins at 0.02 s"),
        ("end = 0.0149", "end = 0.0101", "2 rows are too few"),
        (
            "begin = 0.01\nend = 0.0149",
            "begin = 1.0",
            "no row lies between `begin` and `end`; its times are 0 to 0.0399 s",
        ),
        ("begin = 0.01", "begin = nan", "`begin` is NaN, which is not a time"),
    ] {
        let edited = plan.text().replace(from, to);
        let said = Plan::parse(&edited).and_then(|plan| read(&plan)).err().expect("a fault").sentence;
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn several_times_become_one_with_gaps() {
    let slow = text("t1 [s];p [bar];t2 [ms];T [K]\n", |[t, p, _, _]| {
        let row = (t / PERIOD).round() as usize;
        let late = if row < 100 { format!("{};{}", 0.25 * row as f64, 300 + row) } else { ";".to_string() };
        format!("{t:.4};{p:.3};{late}")
    });
    let (_, outcome) = run(slow.into_bytes(), &Asked::default()).expect("it is imported");
    let found = columns(&outcome.tables[0].1);
    let of = |t: f64, name: &str| {
        let row = found["time_s"].iter().position(|own| (own - t).abs() < 1e-9).expect("the time");
        found[name][row]
    };
    assert_eq!((of(0.0, "T"), of(0.00025, "T"), of(0.0005, "T"), of(0.02475, "T")), (300.0, 301.0, 302.0, 399.0));
    assert!(of(0.00025, "p").is_nan() && of(0.0001, "T").is_nan() && !of(0.0005, "p").is_nan());
    assert!(outcome.words.contains("`t2 [ms]` are the times of the columns to the right of it"), "{}", outcome.words);
}

#[test]
fn shorter_and_sparser_columns_keep_their_own_times() {
    // A second clock that ends early, one that has a row in ten, and two of one name.
    let row = |t: f64| (t / PERIOD).round() as usize;
    let value = |k: usize| ((k * 7919) % 13) as f64;
    let early = text("t_fast [s],y [mm],t_slow [s],T [degC]\n", |[t, _, y, _]| match row(*t) {
        k if k < 40 => format!("{t:.4},{y:.3},{:.3},{}", 1e-3 * k as f64, value(k)),
        _ => format!("{t:.4},{y:.3},,"),
    });
    let sparse = text("Time [s],y [mm],t2 [s],T [degC]\n", |[t, _, y, _]| match row(*t) {
        k if k % 10 == 0 => format!("{t:.4},{y:.3},{t:.4},{}", value(k / 10)),
        _ => format!("{t:.4},{y:.3},,"),
    });
    let twice = early.replace("t_fast [s]", "Time [s]").replace("t_slow [s]", "Time [s]");
    // The fast column stands behind the slow times.
    let moved = text("t_fast [s],t_slow [s],T [degC],y [mm]\n", |[t, _, y, _]| match row(*t) {
        k if k < 40 => format!("{t:.4},{:.3},{},{y:.3}", 1e-3 * k as f64, value(k)),
        _ => format!("{t:.4},,,{y:.3}"),
    });
    let said = [
        "`t_slow [s]` are the times of the columns to the right of it",
        "`t2 [s]` are the times of the columns to the right of it",
        "more than one column is called `Time [s]`: column 3 is called `Time 2 [s]`",
        "`y [mm]` has values where `t_slow [s]` has no time: it belongs to the times of `t_fast [s]`",
    ];
    for (bytes, said) in [early, sparse, twice, moved].into_iter().zip(said) {
        let (plan, outcome) = run(bytes.clone().into_bytes(), &Asked::default()).expect("it is imported");
        assert!(outcome.words.contains(said), "{}", outcome.words);
        let found = columns(&outcome.tables[0].1);
        let pairs = found["time_s"].iter().zip(&found["T"]).filter(|(_, value)| !value.is_nan());
        let slow: Vec<(f64, f64)> = pairs.map(|(t, value)| (*t, *value)).collect();
        assert_eq!(slow.len(), 40);
        for (k, (t, own)) in slow.iter().enumerate() {
            assert!((t - 1e-3 * k as f64).abs() < 1e-9 && (own - 273.15 - value(k)).abs() < 1e-6, "{k}: {t} {own}");
        }
        assert!(near(&found["y"], |row| row[2] * 1e-3));
        // The import file says the same.
        let again = plan.carry_out(&BTreeMap::new(), &mut |_| Ok(Content::Text(bytes.clone().into_bytes())));
        assert_eq!(again.expect("again").tables, outcome.tables);
    }
    // A value without a time is no gap.
    let lost: String = (0..60)
        .map(|k| format!("{k};{};{};{}\n", k * k, if k < 20 { (2 * k).to_string() } else { String::new() }, k % 7))
        .collect();
    let (_, outcome) = run(format!("t [s];p;t2 [s];q\n{lost}").into_bytes(), &Asked::default()).expect("imported");
    assert!(outcome.words.contains("`q` has values where `t2 [s]` has no time"), "{}", outcome.words);
}

#[test]
fn temperatures_called_like_times_are_channels() {
    let value = |t: f64| ((t / PERIOD).round() as usize * 7919) % 13;
    for (head, is_heating) in [("t|y|T\n", false), ("t|y|T\n", true), ("time|y|T2\n", true)] {
        let bytes = text(head, |[t, _, y, _]| {
            let heat = if is_heating { 20.0 + t.sqrt() } else { value(*t) as f64 };
            format!("{t:.4}|{y:.3}|{heat}")
        });
        let (_, outcome) = run(bytes.into_bytes(), &Asked::default()).expect("it is imported");
        let found = columns(&outcome.tables[0].1);
        let name = head.trim().rsplit('|').next().expect("a heading");
        let wanted = |row: &[f64; 4]| if is_heating { 20.0 + row[0].sqrt() } else { value(row[0]) as f64 };
        assert!(near(&found[name], wanted) && near(&found["time_s"], |row| row[0]), "{head}");
        assert_eq!(outcome.words.contains("is taken for a channel, for there are other times"), is_heating);
    }
}

#[test]
fn points_in_time_become_seconds() {
    let clock = |t: f64, mark: char| {
        // Ten milliseconds before midnight.
        let ticks = (t / PERIOD).round() as usize;
        let (day, left) = if ticks < 100 { (1, 59.99 + t) } else { (2, t - 0.01) };
        let (hours, minutes) = if day == 1 { (23, 59) } else { (0, 0) };
        (day, format!("{hours:02}:{minutes:02}:{left:07.4}").replace('.', &mark.to_string()))
    };
    let whole = text("Timestamp,y [mm]\n", |[t, _, y, _]| {
        let (day, time) = clock(*t, '.');
        format!("2024-03-{day:02} {time},{y:.3}")
    });
    let apart = text("Date;Time;y [mm]\n", |[t, _, y, _]| {
        let (day, time) = clock(*t, ',');
        format!("0{day}.03.2024;{time};{y:.3}")
    });
    for (bytes, said) in [
        (whole.clone(), "`Timestamp` holds points in time: they are read as seconds since the first row of the file\n"),
        (apart, "`Date` holds dates and is left out"),
    ] {
        let (plan, outcome) = run(bytes.clone().into_bytes(), &Asked::default()).expect("it is imported");
        assert!(outcome.words.contains(said), "{}", outcome.words);
        assert!(outcome.words.contains("`, seconds since the first row\n"), "{}", outcome.words);
        let found = columns(&outcome.tables[0].1);
        assert!(near(&found["time_s"], |row| row[0]) && near(&found["y"], |row| row[2] * 1e-3));
        let again = plan.carry_out(&BTreeMap::new(), &mut |_| Ok(Content::Text(bytes.clone().into_bytes())));
        assert_eq!(again.expect("again").tables, outcome.tables);
    }
    let said = run(whole.replacen("2024-03-02", "yesterday", 1).into_bytes(), &Asked::default());
    let said = said.err().expect("a fault").sentence;
    assert!(
        said.contains("line 102, column `Timestamp`: `yesterday 00:") && said.contains("nor like the points in time"),
        "{said}"
    );
}

#[test]
fn what_is_no_table_is_left_out_by_name() {
    let file = |name: &str, text: &str| RawFile { name: name.into(), content: Content::Text(text.as_bytes().to_vec()) };
    let files = [file("notes_1.txt", "Shot 1 was warm.\n"), file("shot_1.csv", &german())];
    let own = Plan::assume("bench", "raw", &files, &Asked::default()).unwrap_or_else(|fault| panic!("{fault}"));
    let why = "line 1: no rows of numbers were found; it is not a table of measurements".to_string();
    assert_eq!(own.left_out, [("notes_1.txt".to_string(), why)]);
    // It takes no number from a shot.
    assert_eq!((own.plan.shot.len(), own.plan.shot[0].number), (1, 1));
    assert!(Plan::assume("bench", "raw", &files[..1], &Asked::default()).is_err());
}

#[test]
fn bad_files_end_in_a_sentence_with_their_line() {
    let plain = |from: &str, to: &str| {
        let all: String = (0..40).map(|k| format!("{k};{}\n", k * k)).collect();
        format!("t;p\n{all}").replacen(from, to, 1)
    };
    let wide: String = format!("t;p;p\n{}", (0..40).map(|k| format!("{k};1;2\n")).collect::<String>());
    for (text, expected) in [
        (String::new(), "the file is empty"),
        (" ".repeat(1000), "line 1: the file holds nothing but blanks"),
        (plain("20;400\n", "20;text\n"), "line 22, column `p`: `text` is not a number; --skip \"p\""),
        (plain("20;400\n", "19;400\n"), "line 22, column `t`: the time stands twice: 19 s after 19 s"),
        (plain("20;400\n", "3;400\n"), "line 22, column `t`: the time goes back: 3 s after 19 s"),
        (plain("20;400\n", ";400\n"), "line 22, column `t`: a time is missing"),
        (plain("20;400\n", "20\n"), "line 22 has 1 field, and line 21 has 2"),
        (plain("20;400\n", "20;400;1\n"), "line 22 has 3 fields, and line 21 has 2"),
        (wide, "line 1: the columns 2 and 3 are both called `p`"),
        ("t;p\n1;2\n2;3\n3;4\n4;5\n".to_string(), "4 rows are too few"),
    ] {
        let said = run(text.into_bytes(), &Asked::default()).err().expect("a fault").sentence;
        assert!(said.starts_with(&format!("`shot_07.csv`: {expected}")), "{said}");
    }
    let asked = Asked { trigger: Some("q".into()), ..Asked::default() };
    let said = run(plain("", "").into_bytes(), &asked).err().expect("a fault").sentence;
    assert_eq!(said, "`shot_07.csv`: it has no column `q` for the trigger; it has: p");
    let asked = Asked { skip: vec!["q".into()], ..Asked::default() };
    assert!(run(plain("", "").into_bytes(), &asked).is_err());
}

#[test]
fn import_files_are_refused_with_their_line() {
    let (plan, _) = run(german().into_bytes(), &Asked::default()).expect("it is imported");
    let text = plan.text();
    for (from, to, expected) in [
        ("decimal = \",\"", "decimals = \",\"", "line 10: unknown field `decimals`, "),
        ("decimal = \",\"", "decimal = \";\"", "line 10: the decimal mark is `;`"),
        ("delimiter = \";\"", "delimiter = \"x\"", "line 9: the delimiter \"x\" is not one of"),
        ("encoding = \"utf-8\"", "encoding = \"utf8\"", "line 8: `utf8` is not one of the encodings"),
        ("time = \"Zeit\"", "", "line 6: a layout has either `time`"),
        ("time = \"Zeit\"", "time = \"Zei\"", "line 14: the column of times `Zei` is not in `times`"),
        ("scale = 100000.0", "scale = 0", "line 18: `Druck`: the scale must be"),
        ("number = 7", "number = 7\nzero = 1.0", "line 28: `shot_07.csv` has both `zero` and"),
        ("file = \"shot_07.csv\"", "file = \"b.csv\"", "line 26: the file `b.csv` of a shot must"),
    ] {
        let edited = text.replacen(from, to, 1);
        assert_ne!(edited, text, "{from}");
        let said = Plan::parse(&edited).expect_err("a fault").sentence;
        assert!(said.starts_with(expected), "{said}\n{edited}");
    }
    let edited = Plan::parse(&text.replace("\"Weg\" = {", "\"Wege\" = {")).expect("a plan");
    let said = edited.carry_out(&BTreeMap::new(), &mut |_| Ok(Content::Text(german().into_bytes()))).err();
    let said = said.expect("a fault").sentence;
    assert!(said.starts_with("`shot_07.csv`: there is no column `Wege`; did you mean `Weg`?"), "{said}");
}
