//! Strings of a unit: constants with the values that the model gave them.

use std::ffi::{CStr, CString, c_char, c_void};

use hyd_unit::{fmi2, fmi3};

use crate::unit_client::{ERROR, OK, Unpacked, hyd, make};

/// Characters that XML writes in its own way, two bytes for one letter, a line end.
const MODEL: &str = "model Texts
  parameter String file = \"a & <b>.txt\" \"where it's from\";
  final parameter String lines = \"one\\ntwo\";
  parameter String names[2] = {\"Öl\", \"\"};
  Part part[2](name = names, each note = file + \"!\");
  parameter Integer n = 3;
  parameter String label = \"of \" + String(n);
  parameter Real found(start = 1, fixed = false);
  parameter String late = String(found);
  parameter String nothing;
  parameter Integer size = if mode == \"long\" then 3 else 2;
  parameter String mode = \"long\";
  Real x[size](each start = 1, each fixed = true);
  model Part
    parameter String name = \"\";
    parameter String note = \"\";
    parameter String pair[2] = {\"l\", \"r\"};
    parameter String own = \"<\" + name + \">\";
  end Part;
initial equation
  found = 4;
equation
  der(x) = -n*x;
end Texts;";

const VALUES: [(&str, &str); 11] = [
    ("file", "a & <b>.txt"),
    ("lines", "one\ntwo"),
    ("names[1]", "Öl"),
    ("names[2]", ""),
    ("part[1].name", "Öl"),
    ("part[2].name", ""),
    ("part[1].note", "a & <b>.txt!"),
    ("part[2].note", "a & <b>.txt!"),
    ("part[1].pair[2]", "r"),
    ("part[2].pair[1]", "l"),
    ("mode", "long"),
];

/// A text of C.
fn read(text: *const c_char) -> String {
    assert!(!text.is_null());
    // SAFETY: the unit promises a text that ends with zero and lives until it is called again.
    #[allow(unsafe_code)]
    unsafe { CStr::from_ptr(text) }.to_str().expect("UTF-8").to_string()
}

/// The start value as a reader of XML takes it.
fn stated(unit: &Unpacked, name: &str) -> String {
    let document = quick_xml_text(&unit.description, name);
    document.unwrap_or_else(|| panic!("no {name} in\n{}", unit.description))
}

/// The value of the String of that name, by a reader of XML.
fn quick_xml_text(description: &str, name: &str) -> Option<String> {
    let document = roxmltree::Document::parse(description).expect("XML");
    let own = document.descendants().find(|node| node.attribute("name") == Some(name))?;
    let inside = own.descendants().find_map(|node| node.attribute("value").or_else(|| node.attribute("start")))?;
    assert_eq!(own.attribute("variability"), Some("constant"));
    Some(inside.to_string())
}

#[test]
fn strings_are_constants_of_units() {
    for version in ["2.0", "3.0"] {
        let unit = make("texts", version, MODEL);
        let it: *mut c_void = match version {
            "3.0" => unit.exchange(),
            _ => {
                let (name, token, resources) = (CString::default(), unit.token(), unit.resources());
                fmi2::fmi2Instantiate(name.as_ptr(), 1, token.as_ptr(), resources.as_ptr(), std::ptr::null(), 0, 0)
            }
        };
        assert!(!it.is_null());
        let references: Vec<u32> = VALUES.iter().map(|(name, _)| unit.reference(name)).collect();
        let mut texts = [std::ptr::null(); VALUES.len()];
        let status = match version {
            "3.0" => fmi3::fmi3GetString(it, references.as_ptr(), texts.len(), texts.as_mut_ptr(), texts.len()),
            _ => fmi2::fmi2GetString(it, references.as_ptr(), texts.len(), texts.as_mut_ptr()),
        };
        assert_eq!(status, OK);
        for ((name, expected), text) in VALUES.iter().zip(texts) {
            assert_eq!((read(text).as_str(), stated(&unit, name).as_str()), (*expected, *expected), "{version} {name}");
        }
        // It was fixed, and what is a number is no String.
        let other = CString::new("b.txt").expect("a text");
        let (file, x, wish) = (unit.reference("file"), unit.reference("n"), other.as_ptr());
        let mut text = std::ptr::null();
        if version == "3.0" {
            assert_eq!(fmi3::fmi3SetString(it, &file, 1, &wish, 1), ERROR);
            assert_eq!(fmi3::fmi3Reset(it), OK);
            assert_eq!(fmi3::fmi3GetString(it, &x, 1, &mut text, 1), ERROR);
            fmi3::fmi3FreeInstance(it);
        } else {
            assert_eq!(fmi2::fmi2SetString(it, &file, 1, &wish), ERROR);
            assert_eq!(fmi2::fmi2Reset(it), OK);
            assert_eq!(fmi2::fmi2GetString(it, &x, 1, &mut text), ERROR);
            fmi2::fmi2FreeInstance(it);
        }
        // What the unit says of itself follows `--set`, and who makes it hears what cannot be set.
        let again = hyd(
            &unit.folder,
            &["build", "case.hyd", "--fmu", version, "-o", "again.fmu", "--set", "file=b.txt", "--set", "mode=short"],
        );
        let said = String::from_utf8_lossy(&again.stderr);
        assert!(said.contains("because they are Strings: `file`, `names`, `part.name`"), "{said}");
        assert!(said.contains("what can be set or is found at the start: `label`, `late`"), "{said}");
        assert!(said.contains("differs along an array of components: `part.own`, `nothing`"), "{said}");
        assert!(!unit.description.contains("name=\"label\""));
        let run = hyd(&unit.folder, &["simulate", "again.fmu", "--set", "n=2", "--result", "r.csv", "--json"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        // Nothing in the model asks for this one.
        let run = hyd(&unit.folder, &["simulate", "case.hyd", "--set", "file=b.txt", "--result", "t.csv"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let list = hyd(&unit.folder, &["unit", "again.fmu", "--json"]);
        let list = String::from_utf8_lossy(&list.stdout).into_owned();
        assert!(list.contains("part[2].note"), "{list}");
    }
}
