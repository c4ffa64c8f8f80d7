//! Units that tests make and call as an importer does.
//!
//! The library in the archive is the one that these functions are linked from, so no other loader is needed.

use std::ffi::{CString, c_void};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hyd_unit::fmi3;

pub(crate) const OK: i32 = 0;
pub(crate) const DISCARD: i32 = 2;
pub(crate) const ERROR: i32 = 3;

/// The library that tests are linked with, as the build has left it.
pub(crate) fn library() -> PathBuf {
    let name = if cfg!(target_vendor = "apple") { "libhyd_unit.dylib" } else { "libhyd_unit.so" };
    Path::new(env!("CARGO_BIN_EXE_hyd-under-test")).with_file_name("deps").join(name)
}

/// A unit that was made and unpacked; the folder goes with it.
pub(crate) struct Unpacked {
    pub(crate) folder: PathBuf,
    pub(crate) description: String,
    pub(crate) files: Vec<String>,
}

impl Drop for Unpacked {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

pub(crate) fn hyd(folder: &Path, arguments: &[&str]) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
    command.env("HYD_UNIT", library()).env("NO_COLOR", "1").env_remove("HYD_LIBRARY").env_remove("MODELICAPATH");
    command.args(arguments).current_dir(folder).output().expect("started")
}

pub(crate) fn make(case: &str, version: &str, text: &str) -> Unpacked {
    make_with(case, version, text, &[])
}

/// As [`make`] with further arguments.
pub(crate) fn make_with(case: &str, version: &str, text: &str, more: &[&str]) -> Unpacked {
    let folder = std::env::temp_dir().join(format!("hyd unit {case} {version} {}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join("case.hyd"), text).expect("written");
    let arguments = ["build", "case.hyd", "--fmu", version, "-o", "case.fmu"];
    let output = hyd(&folder, &[&arguments[..], more].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = fs::File::open(folder.join("case.fmu")).expect("the unit");
    let mut archive = zip::ZipArchive::new(file).expect("an archive");
    archive.extract(&folder).expect("unpacked");
    let files = archive.file_names().map(|name| name.expect("a name").into_owned()).collect();
    let description = fs::read_to_string(folder.join("modelDescription.xml")).expect("the description");
    Unpacked { folder, description, files }
}

impl Unpacked {
    /// An attribute of the first element that begins so.
    pub(crate) fn attribute(&self, begin: &str, name: &str) -> String {
        let at = self.description.find(begin).unwrap_or_else(|| panic!("no {begin} in\n{}", self.description));
        let element = &self.description[at..][..self.description[at..].find('>').expect("closed")];
        let value = element.split(&format!(" {name}=\"")).nth(1).unwrap_or_else(|| panic!("no {name} in {element}"));
        value.split('"').next().expect("a value").to_string()
    }

    pub(crate) fn reference(&self, variable: &str) -> u32 {
        let at = self.description.find(&format!(" name=\"{variable}\"")).unwrap_or_else(|| panic!("no {variable}"));
        let rest = self.description[at..].split("valueReference=\"").nth(1).expect("a reference");
        rest.split('"').next().expect("a number").parse().expect("a number")
    }

    pub(crate) fn token(&self) -> CString {
        let three = self.description.contains("instantiationToken");
        let token = self.attribute("<fmiModelDescription", if three { "instantiationToken" } else { "guid" });
        CString::new(token).expect("a text")
    }

    pub(crate) fn resources(&self) -> CString {
        CString::new(self.folder.join("resources").display().to_string()).expect("a text")
    }

    pub(crate) fn stepping(&self) -> *mut c_void {
        self.stepping_with(false)
    }

    pub(crate) fn stepping_with(&self, events: bool) -> *mut c_void {
        let (name, token, resources) = (CString::default(), self.token(), self.resources());
        let null = std::ptr::null_mut();
        let unit = fmi3::fmi3InstantiateCoSimulation(
            name.as_ptr(),
            token.as_ptr(),
            resources.as_ptr(),
            false,
            false,
            events,
            events,
            std::ptr::null(),
            0,
            null,
            None,
            None,
        );
        assert!(!unit.is_null());
        unit
    }

    pub(crate) fn exchange(&self) -> *mut c_void {
        let (name, token, resources) = (CString::default(), self.token(), self.resources());
        fmi3::fmi3InstantiateModelExchange(
            name.as_ptr(),
            token.as_ptr(),
            resources.as_ptr(),
            false,
            false,
            std::ptr::null_mut(),
            None,
        )
    }

    pub(crate) fn get(&self, unit: *mut c_void, variable: &str) -> f64 {
        let (reference, mut value) = (self.reference(variable), f64::NAN);
        assert_eq!(fmi3::fmi3GetFloat64(unit, &reference, 1, &mut value, 1), OK, "{variable}");
        value
    }

    pub(crate) fn set(&self, unit: *mut c_void, variable: &str, value: f64) -> i32 {
        fmi3::fmi3SetFloat64(unit, &self.reference(variable), 1, &value, 1)
    }
}

pub(crate) fn begin(unit: *mut c_void, stop: f64) {
    assert_eq!(fmi3::fmi3EnterInitializationMode(unit, true, 1e-8, 0.0, true, stop), OK);
    assert_eq!(fmi3::fmi3ExitInitializationMode(unit), OK);
}

/// A step: status, event needed, terminated, early, time reached.
pub(crate) fn step(unit: *mut c_void, from: f64, length: f64) -> (i32, bool, bool, bool, f64) {
    let (mut event, mut end, mut early, mut last) = (false, false, false, f64::NAN);
    let status = fmi3::fmi3DoStep(unit, from, length, true, &mut event, &mut end, &mut early, &mut last);
    (status, event, end, early, last)
}
