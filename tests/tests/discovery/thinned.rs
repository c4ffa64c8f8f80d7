//! Recorded sets with fewer samples.

use std::fs;
use std::path::Path;

use hyd_tests::models::root;

use super::json;

/// A recorded set with one sample of `every` only, in a folder; the path of its file.  The work of a search goes with the number of
/// samples, and what is asked of these sets stands out of far fewer than they have.
pub(super) fn thinned(folder: &Path, set: &str, every: usize) -> String {
    let data = root().join("tests/data").join(set);
    let text = fs::read_to_string(data.with_extension("json")).expect("readable");
    for shot in json(&text)["experiments"].as_array().expect("a list") {
        let file = shot["file"].as_str().expect("a name");
        let table = fs::read_to_string(data.with_file_name(file)).expect("readable");
        let mut lines = table.lines();
        let heading = lines.next().expect("a heading");
        let rows: Vec<&str> = std::iter::once(heading).chain(lines.step_by(every)).collect();
        fs::write(folder.join(file), rows.join("\n")).expect("written");
    }
    let path = folder.join("set.json");
    fs::write(&path, text).expect("written");
    path.display().to_string()
}
