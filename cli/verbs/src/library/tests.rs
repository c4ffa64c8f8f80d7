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

/// A class `Package` is not the file of the folder that is asked for it, which is called `package.mo`.
#[test]
fn a_class_may_be_called_package() {
    let folder = Folder::new(
        "package",
        &[
            ("Lib/package.mo", "package Lib"),
            ("Lib/Sub/package.mo", "package Sub"),
            ("Lib/Package/package.mo", "package Package"),
            ("Other/package.mo", "package Other"),
            ("Other/Package.mo", "model Package"),
        ],
    );
    let mut library = LibraryPath::new();
    library.add_folder(&folder.0).unwrap();
    assert_eq!(find(&mut library, "Lib.Sub.Package"), Ok(None));
    assert_eq!(find(&mut library, "Lib.Package"), found("package Package"));
    assert_eq!(find(&mut library, "Lib.Sub"), found("package Sub"));
    assert_eq!(find(&mut library, "Other.Package"), found("model Package"));
    assert_eq!(find(&mut library, "Other"), found("package Other"));
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

#[test]
fn of_several_versions_the_one_that_is_used() {
    let text = |version: &str| format!("package Own annotation(version = \"{version}\"); end Own;");
    let texts = ["1.2.0", "1.10.0"].map(text);
    let folder = Folder::new(
        "versions",
        &[
            ("Own 1.2.0/package.mo", &texts[0]),
            ("Own 1.2.0/Part.mo", "part of 1.2.0"),
            ("Own 1.10.0/package.mo", &texts[1]),
            ("Other 2.0.mo", "package Other end Other;"),
            ("Ownership/package.mo", "package Ownership"),
        ],
    );
    let library = |main: &str| {
        let mut library = LibraryPath::new();
        library.add_main_file(Path::new("elsewhere/m.mo"), main);
        library.add_folder(&folder.0).unwrap();
        library
    };
    let mut free = library("model M end M;");
    assert_eq!(find(&mut free, "Own"), found(&texts[1]));
    assert_eq!(find(&mut free, "Own.Part"), Ok(None));
    assert_eq!(find(&mut free, "Other"), found("package Other end Other;"));
    assert!(free.remarks().is_empty());
    let mut bound = library("model M annotation(uses(Own(version = \"1.2.0\"))); end M;");
    assert_eq!(find(&mut bound, "Own"), found(&texts[0]));
    assert_eq!(find(&mut bound, "Own.Part"), found("part of 1.2.0"));
    assert!(bound.remarks().is_empty());
    let mut missing = library("model M annotation(uses(Own(version = \"2.0.0\"))); end M;");
    assert_eq!(find(&mut missing, "Own"), found(&texts[1]));
    let remarks = missing.remarks();
    assert!(
        remarks.len() == 1 && remarks[0].message.contains("`elsewhere/m.mo` uses `Own` 2.0.0, and 1.10.0 was found"),
        "{remarks:?}"
    );
}

#[test]
fn what_a_library_uses_stands_beside_it() {
    let own = "package Own annotation(uses(Other(version = \"1.0\"), Single(version = \"1.0\"))); end Own;";
    let folder = Folder::new(
        "beside",
        &[
            ("Own/package.mo", own),
            ("Other/package.mo", "package Other"),
            ("Single.mo", "package Single"),
            ("Stranger/package.mo", "package Stranger"),
        ],
    );
    let mut library = LibraryPath::new();
    library.add_folder(&folder.0.join("Own")).unwrap();
    assert_eq!(find(&mut library, "Other"), found("package Other"));
    assert_eq!(find(&mut library, "Single"), found("package Single"));
    assert_eq!(find(&mut library, "Stranger"), Ok(None));
}

#[test]
fn a_library_may_be_a_file_and_may_be_encrypted() {
    let folder = Folder::new(
        "file",
        &[
            ("any.mo", "package Own end Own;"),
            ("Model.hyd", "model Model end Model;"),
            ("Whole/package.mo", "package Whole end Whole;"),
            ("Whole/Secret.moe", "?"),
            ("Packed.mol", "?"),
            ("notes.txt", ""),
        ],
    );
    let mut library = LibraryPath::new();
    for file in ["any.mo", "Model.hyd", "Whole/package.mo"] {
        library.add_folder(&folder.0.join(file)).unwrap();
    }
    assert_eq!(find(&mut library, "Own"), found("package Own end Own;"));
    assert_eq!(find(&mut library, "Own.Part"), Ok(None));
    assert_eq!(find(&mut library, "Model"), found("model Model end Model;"));
    assert_eq!(find(&mut library, "Whole"), found("package Whole end Whole;"));
    assert_eq!(find(&mut library, "any"), Ok(None));
    let refused = find(&mut library, "Whole.Secret").unwrap_err();
    assert!(refused.starts_with("`Secret` is encrypted"), "{refused}");
    let refused = library.add_folder(&folder.0.join("Packed.mol")).unwrap_err();
    assert!(refused.starts_with("`Packed.mol` is encrypted"), "{refused}");
    let refused = library.add_folder(&folder.0.join("notes.txt")).unwrap_err();
    assert!(refused.contains("is not a library"), "{refused}");
}

#[test]
fn what_is_used_is_followed_and_named_folders_come_first() {
    let own = |version: &str| format!("package Own annotation(version = \"{version}\"); end Own;");
    let texts = ["1.2.0+b7", "2.0.0"].map(own);
    let uses = "package U annotation(uses(Own(version = \"1.2.0\"))); end U;";
    let folder = Folder::new(
        "followed",
        &[
            ("all/U/package.mo", uses),
            ("all/U/Part.mo", "within U; model Part end Part;"),
            ("all/Own 1.2.0+maint.om/package.mo", &texts[0]),
            ("all/Own 2.0.0/package.mo", &texts[1]),
            ("named/Own/package.mo", "package Own end Own;"),
            ("chain/A/package.mo", "package A annotation(uses(B(version = \"1\"))); end A;"),
            ("chain/B/package.mo", "package B annotation(uses(C(version = \"1\"))); end B;"),
            ("chain/C/package.mo", "package C end C;"),
            ("Locked/package.moe", "?"),
        ],
    );
    let mut all = LibraryPath::new();
    all.add_folder(&folder.0.join("all")).unwrap();
    assert_eq!(find(&mut all, "U"), found(uses));
    assert_eq!(find(&mut all, "Own"), found(&texts[0]));
    assert!(all.remarks().is_empty(), "{:?}", all.remarks());
    // A folder of libraries that is named first comes before a library that is named later.
    let mut two = LibraryPath::new();
    two.add_folder(&folder.0.join("named")).unwrap();
    two.add_folder(&folder.0.join("all/Own 2.0.0")).unwrap();
    assert_eq!(find(&mut two, "Own"), found("package Own end Own;"));
    // Whoever is read first: what uses another version may come after that was found.
    let mut late = LibraryPath::new();
    late.add_folder(&folder.0.join("all")).unwrap();
    assert_eq!(find(&mut late, "Own"), found(&texts[1]));
    assert!(late.remarks().is_empty());
    assert_eq!(find(&mut late, "U"), found(uses));
    let remarks = late.remarks();
    assert!(remarks.len() == 1 && remarks[0].message.starts_with("`U` uses `Own` 1.2.0, and 2.0.0"), "{remarks:?}");
    let mut chain = LibraryPath::new();
    chain.add_folder(&folder.0.join("chain/A")).unwrap();
    assert_eq!(find(&mut chain, "C"), Ok(None));
    assert_eq!(find(&mut chain, "B").map(|own| own.is_some()), Ok(true));
    assert_eq!(find(&mut chain, "C"), found("package C end C;"));
    // The library that the main file belongs to has neighbours, too.
    let mut inside = LibraryPath::new();
    inside.add_main_file(&folder.0.join("all/U/Part.mo"), "within U; model Part end Part;");
    assert_eq!(find(&mut inside, "Own"), found(&texts[0]));
    let refused = LibraryPath::new().add_folder(&folder.0.join("Locked")).unwrap_err();
    assert!(refused.starts_with("`Locked` is encrypted"), "{refused}");
}
