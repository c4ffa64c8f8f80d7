//! Files that texts name (a study its model, a set its tables, a model its data) must lie below a folder that the user named:
//! no text may make the command read elsewhere, and quote what it finds there.  A server that works for others in a folder holds the names that
//! they send to it in the same way.

use std::path::{Component, Path, PathBuf};

/// What lets texts name any file.
pub(crate) const OPTION: &str = "--allow-outside";

/// Refuses a path that leads out of all of these folders, by `..`, by links, or by its beginning.
pub(crate) fn refuse_outside(name: &str, path: &Path, folders: &[PathBuf]) -> Result<(), String> {
    if is_inside(path, folders) {
        return Ok(());
    }
    let folder = folders.first().map_or_else(String::new, |folder| format!(" `{}`", folder.display()));
    Err(format!("`{name}` lies outside of the folder{folder}; {OPTION} lets it be read"))
}

/// True for a path that leads into one of these folders.
pub fn is_inside(path: &Path, folders: &[PathBuf]) -> bool {
    let place = real(path);
    folders.iter().any(|folder| place.starts_with(real(folder)))
}

/// Where a path leads: as far as it exists behind its links, the rest by its words.
pub fn real(path: &Path) -> PathBuf {
    let path = std::path::absolute(if path.as_os_str().is_empty() { Path::new(".") } else { path });
    let path = path.unwrap_or_default();
    let mut known = PathBuf::new();
    for part in path.components() {
        match part {
            // After a link the folder above is that of its end.
            Component::ParentDir => {
                known.pop();
            }
            Component::CurDir => {}
            part => {
                known.push(part);
                if let Ok(end) = known.canonicalize() {
                    known = end;
                }
            }
        }
    }
    known
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn no_spelling_leads_out() {
        let root = std::env::temp_dir().join(format!("hyd-inside-{}", std::process::id()));
        let own = root.join("own");
        fs::create_dir_all(own.join("deep")).unwrap();
        fs::create_dir_all(root.join("ownother")).unwrap();
        for file in ["secret.csv", "own/a.csv", "own/deep/b.csv", "ownother/c.csv"] {
            fs::write(root.join(file), "").unwrap();
        }
        symlink("../secret.csv", own.join("link.csv")).unwrap();
        symlink("..", own.join("up")).unwrap();
        symlink("deep/b.csv", own.join("inner.csv")).unwrap();
        symlink("deep", own.join("down")).unwrap();
        symlink("../nowhere.csv", own.join("early.csv")).unwrap();
        let folders = [own.clone()];
        let is_taken = |name: &str| refuse_outside(name, &own.join(name), &folders).is_ok();
        let absolute = own.join("a.csv").display().to_string();
        let inside = [
            "a.csv",
            "./a.csv",
            "deep/b.csv",
            "deep/../a.csv",
            "inner.csv",
            "down/b.csv",
            "down/../a.csv",
            "none.csv",
            "../own/a.csv",
            absolute.as_str(),
        ];
        for name in inside {
            assert!(is_taken(name), "{name}");
        }
        let secret = root.join("secret.csv").display().to_string();
        let outside = [
            "../secret.csv",
            "link.csv",
            "up/secret.csv",
            "deep/../../secret.csv",
            "../ownother/c.csv",
            "../none.csv",
            "none/../../secret.csv",
            "down/../../secret.csv",
            secret.as_str(),
            "/etc/passwd",
        ];
        for name in outside {
            assert!(!is_taken(name), "{name}");
        }
        assert!(refuse_outside("c.csv", &root.join("ownother/c.csv"), &[own.clone(), root.join("ownother")]).is_ok());
        fs::remove_dir_all(&root).unwrap();
    }
}
