//! Look-up order and file-name rules of [`LibraryPath`], on folders made for the test.

use std::fs;

use super::*;

/// A folder with files `(path, text)`, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, files: &[(&str, &str)]) -> Self {
        let root = std::env::temp_dir().join(format!("hyd-library-{name}-{}", std::process::id()));
        for (path, text) in files {
            let path = root.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        Self(root)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn find(library: &mut LibraryPath, class: &str) -> Result<Option<String>, String> {
    let path: Vec<Arc<str>> = class.split('.').map(Arc::from).collect();
    Ok(library.find(&path)?.map(|found| found.text.to_string()))
}

fn found(text: &str) -> Result<Option<String>, String> {
    Ok(Some(text.to_string()))
}

#[test]
fn classes_are_files_or_folders_without_regard_to_case() {
    let folder = Folder::new(
        "case",
        &[
            ("Lib/package.mo", "package Lib"),
            ("Lib/pump.hyd", "pump"),
            ("Lib/Parts/package.hyd", "package Parts"),
            ("Lib/Parts/Seal.mo", "seal"),
            ("Lib/Parts.hyd", "not this one"),
            ("Lib/empty/readme.txt", ""),
            ("Single.hyd", "single"),
        ],
    );
    let mut library = LibraryPath::new();
    library.add_folder(&folder.0).unwrap();
    assert_eq!(find(&mut library, "Lib"), found("package Lib"));
    assert_eq!(find(&mut library, "Lib.Pump"), found("pump"));
    assert_eq!(find(&mut library, "Lib.Parts"), found("package Parts"));
    assert_eq!(find(&mut library, "Lib.Parts.Seal"), found("seal"));
    assert_eq!(find(&mut library, "Single"), found("single"));
    for absent in ["Lib.Empty", "Lib.Nothing", "Lib.Pump.Inner", "Nowhere", "Lib.../Single", "'..'"] {
        assert_eq!(find(&mut library, absent), Ok(None), "{absent}");
    }
}

#[test]
fn a_within_clause_makes_the_folder_a_package() {
    let folder = Folder::new(
        "within",
        &[
            ("top/package.hyd", "package Drive"),
            ("top/valve.hyd", "valve"),
            ("top/inner/package.hyd", "within Drive; package Inner"),
            ("top/inner/spool.hyd", "spool"),
        ],
    );
    let mut library = LibraryPath::new();
    library.add_main_file(&folder.0.join("top/inner/spool.hyd"), "within Drive.Inner; model Spool end Spool;");
    assert_eq!(find(&mut library, "Drive"), found("package Drive"));
    assert_eq!(find(&mut library, "Drive.Valve"), found("valve"));
    assert_eq!(find(&mut library, "Drive.Inner.Spool"), found("spool"));
    assert_eq!(find(&mut library, "Valve"), Ok(None));

    let mut library = LibraryPath::new();
    library.add_main_file(&folder.0.join("top/package.hyd"), "package Drive end Drive;");
    assert_eq!(find(&mut library, "Drive.Inner.Spool"), found("spool"));

    let mut library = LibraryPath::new();
    library.add_main_file(&folder.0.join("top/valve.hyd"), "model Valve end Valve;");
    assert_eq!(find(&mut library, "Drive.Valve"), Ok(None));
    assert_eq!(find(&mut library, "package"), Ok(None));
}

#[test]
fn the_main_package_comes_before_folders_and_these_before_the_built_in_library() {
    let folder = Folder::new(
        "order",
        &[
            ("main/part.hyd", "of the main file"),
            ("first/Hyd/package.hyd", "mine"),
            ("first/P/package.hyd", "first"),
            ("first/P/Part.hyd", "of the folder"),
            ("second/P/package.hyd", "second"),
            ("second/Q.mo", "only here"),
        ],
    );
    let mut library = LibraryPath::new();
    let built_in = find(&mut library, "Hyd").unwrap().unwrap();
    assert!(built_in.contains("package Hyd"), "{built_in}");
    library.add_main_file(&folder.0.join("main/m.hyd"), "within P; model M end M;");
    library.add_folder(&folder.0.join("first")).unwrap();
    library.add_folder(&folder.0.join("second")).unwrap();
    assert_eq!(find(&mut library, "P.Part"), found("of the main file"));
    assert_eq!(find(&mut library, "P"), found("first"));
    assert_eq!(find(&mut library, "Q"), found("only here"));
    assert_eq!(find(&mut library, "Hyd"), found("mine"));
    assert!(find(&mut library, "Hyd.Units").unwrap().is_some(), "what a folder lacks is built in");
}

#[test]
fn a_folder_can_be_a_library_itself() {
    let folder = Folder::new("itself", &[("checkout/package.hyd", "package Pumps"), ("checkout/Gear.hyd", "gear")]);
    let mut library = LibraryPath::new();
    library.add_folder(&folder.0.join("checkout")).unwrap();
    assert_eq!(find(&mut library, "Pumps.Gear"), found("gear"));
}

#[test]
fn what_cannot_be_read_is_said() {
    let folder = Folder::new("unreadable", &[("Bad/package.hyd", "package Bad"), ("Bad/Worse/x.txt", "")]);
    fs::write(folder.0.join("Bad/Binary.hyd"), b"model \xFF").unwrap();
    let missing = folder.0.join("nothing");
    let mut library = LibraryPath::new();
    assert_eq!(library.add_folder(&missing), Err(format!("there is no library folder `{}`", missing.display())));
    library.add_folder(&folder.0).unwrap();
    let path = folder.0.join("Bad/Binary.hyd");
    let expected = format!("`{}` is not UTF-8 text: byte 6 (line 1) is 0xFF", path.display());
    assert_eq!(find(&mut library, "Bad.Binary"), Err(expected));
    #[cfg(unix)]
    {
        let link = folder.0.join("Bad/Loop.hyd");
        std::os::unix::fs::symlink(&link, &link).unwrap();
        let mut library = LibraryPath::new();
        library.add_folder(&folder.0).unwrap();
        let message = find(&mut library, "Bad.Loop").unwrap_err();
        assert!(message.starts_with(&format!("`{}` cannot be read: ", link.display())), "{message}");
    }
}

#[test]
fn a_file_with_underscores_holds_a_class_but_hides_none() {
    let first = Folder::new(
        "first",
        &[("small_drag.hyd", "block SmallDrag end SmallDrag;"), ("gear_box.hyd", "model gear_box \"not GearBox\"")],
    );
    let second = Folder::new("second", &[("GearBox.hyd", "model GearBox")]);
    let mut library = LibraryPath::new();
    library.add_folder(&first.0).unwrap();
    library.add_folder(&second.0).unwrap();
    assert_eq!(find(&mut library, "SmallDrag"), found("block SmallDrag end SmallDrag;"));
    assert_eq!(find(&mut library, "GearBox"), found("model GearBox"));
    assert_eq!(find(&mut library, "SmallDrags"), Ok(None));
    // What only speaks of a class does not hold it.
    let third = Folder::new("third", &[("wind_mill.hyd", "model wind_mill \"a model like WindMill\"")]);
    library.add_folder(&third.0).unwrap();
    assert_eq!(find(&mut library, "WindMill"), Ok(None));
}
