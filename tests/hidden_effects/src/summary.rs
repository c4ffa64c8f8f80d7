//! Rows of trials become the tables of a report: goals and what was reached, confusions, reliability, baselines.
//!
//! Shares stand with exact 95 % intervals.  The text replaces what stands between two marks of a page, so that the page
//! around it is written by hand and the figures never are.

use crate::effects::{CATALOGUE, OUTSIDE};
use crate::rows::{End, Row};
use crate::statistics::{Share, normal_share, quantile};
use std::fmt::Write;

/// Marks of a page between which the tables stand.
pub const MARKS: (&str, &str) =
    ("<!-- trials: written by hidden-effects summary -->", "<!-- end of what hidden-effects wrote -->");
/// Predicted drops of the cost that divide trials.
const FALLS: [f64; 4] = [25.0, 100.0, 400.0, f64::INFINITY];
/// Fall that a name needs, and its root.
const NEEDED: f64 = 25.0;
/// Excess of the squared gap from which its shrinking is judged.
const GAP: f64 = 0.15;

/// A page with the tables in it.
///
/// # Errors
/// When the page has no marks.
pub fn into_page(page: &str, rows: &[Row]) -> Result<String, String> {
    let (before, rest) = page.split_once(MARKS.0).ok_or_else(|| format!("the page has no line `{}`", MARKS.0))?;
    let (_, after) = rest.split_once(MARKS.1).ok_or_else(|| format!("the page has no line `{}`", MARKS.1))?;
    Ok(format!("{before}{}\n\n{}\n{}{after}", MARKS.0, tables(rows), MARKS.1))
}

/// All tables.
pub fn tables(rows: &[Row]) -> String {
    let parts = [counts(rows), goals(rows), confusion(rows), outside(rows), reliability(rows), baselines(rows)];
    parts.join("\n")
}

fn of<'a>(rows: &'a [Row], kind: &str) -> Vec<&'a Row> {
    rows.iter().filter(|row| row.kind() == kind).collect()
}

fn is_given(row: &&Row) -> bool {
    matches!(row.end(), End::Right | End::Wrong)
}

/// `named`, `law`, `unknown` or `sensor`, or a choice, on a bench on which nothing is missing.
fn is_false_alarm(row: &&Row) -> bool {
    ["named", "law", "unknown", "sensor", "ambiguous"].contains(&row.text("status"))
}

fn counts(rows: &[Row]) -> String {
    let number = |kind| of(rows, kind).len();
    let mut labels: Vec<&str> = rows.iter().map(|row| row.text("judged")).collect();
    labels.sort_unstable();
    labels.dedup();
    format!(
        "{} trials: {} with nothing hidden, {} with one effect of the catalogue, {} with one of no catalogue, {} with two and {} with three \
         effects. Judged: {}.\n",
        rows.len(),
        number("null"),
        number("effect"),
        number("outside"),
        number("pair"),
        number("triple"),
        labels.join(", ")
    )
}

/// The table of goals.
fn goals(rows: &[Row]) -> String {
    let (null, effect, outside) = (of(rows, "null"), of(rows, "effect"), of(rows, "outside"));
    let named: Vec<&Row> = effect.iter().copied().filter(is_given).collect();
    let clear: Vec<&Row> = effect.iter().copied().filter(|row| row.number("power").unwrap_or(0.0) > 400.0).collect();
    let physics: Vec<&Row> = effect
        .iter()
        .copied()
        .filter(|row| !row.is_sensor() && !matches!(row.end(), End::Adequate | End::None))
        .collect();
    let detected: Vec<&Row> = effect.iter().copied().filter(|row| !matches!(row.end(), End::Adequate)).collect();
    let seen: Vec<&Row> = outside.iter().copied().filter(|row| row.text("status") != "adequate").collect();
    let wrong_kind = |row: &&Row| row.kinds().iter().any(|kind| (*kind == "sensor") != row.is_sensor());
    let sizes: Vec<bool> =
        named.iter().filter(|row| row.end() == End::Right).filter_map(|row| row.is_size_inside()).collect();
    let pairs = of(rows, "pair");
    let triples = of(rows, "triple");
    let is_found = |row: &&Row| matches!(row.end(), End::Right | End::Among);
    let mut text = String::from("| quantity | goal | found (95 % interval) |\n|---|---|---|\n");
    let mut add = |quantity: &str, goal: &str, found: String| {
        let _ = writeln!(text, "| {quantity} | {goal} | {found} |");
    };
    let right = |row: &&Row| row.end() == End::Right;
    add("right among those named, one effect", "97 %, bound 94 %", Share::of(&named, right).shown());
    add("named or in a choice of three, expected drop above 400", "97 %", Share::of(&clear, is_found).shown());
    add(
        "named, expected drop above 400 (the rest is ambiguous, unknown or absorbed)",
        "",
        Share::of(&clear, right).shown(),
    );
    add("false alarms where nothing is missing", "1 %, bound 2.5 %", Share::of(&null, is_false_alarm).shown());
    add("false names where nothing is missing", "", Share::of(&null, is_given).shown());
    add(
        "true equation or place first (effects of the machine that were noticed)",
        "95 %",
        Share::of(&physics, |row| row.place() == Some(1)).shown(),
    );
    add("true one among the first five", "99 %", Share::of(&physics, |row| row.place().is_some()).shown());
    add(
        "first, with the place that the list for saturation lacked (see below)",
        "95 %",
        Share::of(&physics, |row| row.place_by_present_lists() == Some(1)).shown(),
    );
    add(
        "outside the library: `unknown` or `law`, true equation among the first three",
        "85 %",
        Share::of(&seen, |row| row.end() == End::Unknown && row.place().is_some_and(|place| place <= 3)).shown(),
    );
    let law = |row: &&Row| row.text("status") == "law";
    add(
        "outside the library: a law, its equation the true one",
        "",
        Share::of(&seen, |row| law(row) && row.place() == Some(1)).shown(),
    );
    add("a law where nothing is missing", "1 %", Share::of(&null, law).shown());
    add("outside the library: a false name", "2 %", Share::of(&outside, is_given).shown());
    add("two effects: both named, nothing else", "85 %", Share::of(&pairs, |row| row.all_named()).shown());
    add("three effects", "60 %", Share::of(&triples, |row| row.all_named()).shown());
    // Rows of earlier programs do not say how much each of several effects can be seen beside the others.
    for (several, words, goal) in [(&pairs, "two effects", "90 %"), (&triples, "three effects", "70 %")] {
        let visible: Vec<&Row> = several.iter().copied().filter(|row| row.is_each_above(400.0)).collect();
        if !visible.is_empty() {
            let words =
                format!("{words}, an expected drop above 400 for each beside the others: all named, nothing else");
            add(&words, goal, Share::of(&visible, |row| row.all_named()).shown());
        }
    }
    add(
        "machine taken for sensor or the other way round, among those noticed",
        "1 %",
        Share::of(&detected, wrong_kind).shown(),
    );
    add(
        "size within its 95 % interval (right names, sizes stated alike)",
        "93 to 97 %",
        Share::of(&sizes, |inside| *inside).shown(),
    );
    let is_right = |row: &&Row| match row.text("kind") {
        "null" => row.end() == End::Adequate,
        _ => row.end() == End::Right,
    };
    let right = rows.iter().filter(is_right);
    let (inside, all) =
        right.map(|row| row.parameters_inside()).fold((0, 0), |sum, own| (sum.0 + own.0, sum.1 + own.1));
    if all > 0 {
        // Those of one bench depend on each other, so that the share has no interval of its own.
        let share = 100.0 * inside as f64 / all as f64;
        add(
            "fitted parameters within 1.96 standard errors of what was drawn (right answers)",
            "93 to 97 %",
            format!("{inside}/{all} = {share:.1} %"),
        );
    }
    shrinking(&named, &mut add);
    cost(rows, &mut add);
    text
}

type Add<'a> = &'a mut dyn FnMut(&str, &str, String);

fn shrinking(named: &[&Row], add: Add<'_>) {
    let gaps = named.iter().filter(|row| row.end() == End::Right).filter_map(|row| row.held_out());
    let gaps: Vec<(f64, f64)> = gaps.filter(|(before, _)| before * before - 1.0 > GAP).collect();
    let shrunk: Vec<f64> = gaps.iter().map(|(b, a)| (b * b - 1.0) / (a * a - 1.0).max(1e-3)).collect();
    let median = quantile(&shrunk, 0.5).map_or("no trial".into(), |value| format!("{value:.0} times"));
    add("shrinking of the excess on shots held out, median", "10 times", median);
    add("squared gap there at most 1.1 after", "90 %", Share::of(&gaps, |(_, after)| after * after <= 1.1).shown());
}

fn cost(rows: &[Row], add: Add<'_>) {
    let list = |key: &str| rows.iter().filter_map(|row| row.number(key)).collect::<Vec<f64>>();
    let shown = |values: &[f64]| {
        let at = |part| quantile(values, part).unwrap_or(f64::NAN);
        format!("{:.0}, {:.0}, {:.0}", at(0.5), at(0.9), at(1.0))
    };
    add("CPU seconds of a search: median, nine of ten, all below", "120 (60 s on two cores)", shown(&list("cpu")));
    add("runs of one shot", "", shown(&list("simulations")));
}

fn confusion(rows: &[Row]) -> String {
    let mut text = String::from(
        "Trials with one effect by what was hidden:\n\n\
         | hidden | trials | right | in a choice | other name | `unknown` | `adequate` | no answer | other names | expected drop, median | size inside its interval |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---|---:|---:|\n",
    );
    for effect in &CATALOGUE {
        let own: Vec<&Row> = of(rows, "effect").into_iter().filter(|row| row.hidden() == [effect.id]).collect();
        let count = |end: End| own.iter().filter(|row| row.end() == end).count();
        let wrong = own.iter().filter(|row| row.end() == End::Wrong).map(|row| row.named().join(" + "));
        let power: Vec<f64> = own.iter().filter_map(|row| row.number("power")).collect();
        let right = own.iter().filter(|row| row.end() == End::Right);
        let sizes: Vec<bool> = right.filter_map(|row| row.is_size_inside()).collect();
        let within = sizes.iter().filter(|inside| **inside).count();
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.0} | {within} of {} |",
            effect.id,
            own.len(),
            count(End::Right),
            count(End::Among),
            count(End::Wrong),
            count(End::Unknown),
            count(End::Adequate),
            count(End::None),
            wrong.collect::<Vec<_>>().join(", "),
            quantile(&power, 0.5).unwrap_or(f64::NAN),
            sizes.len()
        );
    }
    text
}

fn outside(rows: &[Row]) -> String {
    let mut text = String::from(
        "Effects of no catalogue:\n\n| hidden | trials | `unknown` or `law` | true equation first | among three | a name | names | `adequate` |\n\
         |---|---:|---:|---:|---:|---:|---|---:|\n",
    );
    for effect in &OUTSIDE {
        let own: Vec<&Row> = of(rows, "outside").into_iter().filter(|row| row.hidden() == [effect.id]).collect();
        let count = |condition: &dyn Fn(&Row) -> bool| own.iter().filter(|row| condition(row)).count();
        let names: Vec<String> = own.iter().map(|row| row.named().join(" + ")).filter(|own| !own.is_empty()).collect();
        let unknown = |row: &Row| ["unknown", "law"].contains(&row.text("status"));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            effect.id,
            own.len(),
            count(&unknown),
            count(&|row| unknown(row) && row.place() == Some(1)),
            count(&|row| unknown(row) && row.place().is_some_and(|place| place <= 3)),
            names.len(),
            names.join(", "),
            count(&|row| row.text("status") == "adequate")
        );
    }
    text
}

/// Probability of being seen that the expected drop foretells.
pub fn foretold(power: f64) -> f64 {
    normal_share(power.max(0.0).sqrt() - NEEDED.sqrt())
}

fn reliability(rows: &[Row]) -> String {
    let effect = of(rows, "effect");
    let mut text = String::from(
        "Is what should be seen seen? The expected drop of the cost is computed by the generator alone (squared signature after projection). Seen: \
         any status but `adequate` and none.\n\n\
         | expected drop | trials | foretold | seen | right or in a choice |\n|---|---:|---:|---:|---:|\n",
    );
    let mut from = 0.0;
    for to in FALLS {
        let own: Vec<&Row> = effect
            .iter()
            .copied()
            .filter(|row| row.number("power").is_some_and(|power| power >= from && power < to))
            .collect();
        let foretold: f64 =
            own.iter().filter_map(|row| row.number("power")).map(foretold).sum::<f64>() / own.len().max(1) as f64;
        let seen = Share::of(&own, |row| !matches!(row.end(), End::Adequate | End::None));
        let found = Share::of(&own, |row| matches!(row.end(), End::Right | End::Among));
        let words = if to.is_finite() { format!("{from:.0} to {to:.0}") } else { format!("above {from:.0}") };
        let percent =
            |value: f64| if value.is_finite() { format!("{:.0} %", 100.0 * value) } else { "no trial".into() };
        let shown = if own.is_empty() { "no trial".into() } else { percent(foretold) };
        let _ = writeln!(
            text,
            "| {words} | {} | {shown} | {} | {} |",
            own.len(),
            percent(seen.value()),
            percent(found.value())
        );
        from = to;
    }
    text
}

/// The search and simpler methods on the same trials.
fn baselines(rows: &[Row]) -> String {
    let (null, effect) = (of(rows, "null"), of(rows, "effect"));
    let mut text = String::from(
        "Simpler methods on the same trials (a name for every trial with one effect would be best, none where nothing is missing):\n\n\
         | method | right names of all with one effect | wrong names among names | names where nothing is missing |\n|---|---|---|---|\n",
    );
    let mut add = |words: &str, name: &dyn Fn(&Row) -> Vec<String>| {
        let given: Vec<(&Row, Vec<String>)> =
            effect.iter().map(|row| (*row, name(row))).filter(|(_, names)| !names.is_empty()).collect();
        let right = effect.iter().filter(|row| name(row) == row.hidden()).count();
        let _ = writeln!(
            text,
            "| {words} | {} | {} | {} |",
            Share { hits: right, all: effect.len() }.shown(),
            Share::of(&given, |(row, names)| *names != row.hidden()).shown(),
            Share::of(&null, |row| !name(row).is_empty()).shown()
        );
    };
    add("`hyd discover`", &|row| row.named().into_iter().map(String::from).collect());
    add("(a) parameters are fitted, nothing else", &|_| Vec::new());
    let best = |key: &'static str| {
        move |row: &Row| {
            row.best(key).filter(|(_, fall)| *fall > NEEDED).map(|(id, _)| vec![id.to_string()]).unwrap_or_default()
        }
    };
    add("(b) the effect with the largest drop of the misfit, parameters held where they were fitted", &best("alone"));
    add("the effect with the largest score, nuisances projected out, without a fit", &best("promised"));
    if rows.iter().all(|row| row.by_derivatives().is_some()) {
        let matched =
            |row: &Row| row.by_derivatives().into_iter().filter(|id| !id.is_empty()).map(String::from).collect();
        add("(d) sparse regression on matched derivatives", &matched);
    }
    text
}
