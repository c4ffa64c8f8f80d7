//! A file for what does not fit into memory; nobody sees it, and it goes with the value.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::whole_file::{target, temporary};

/// Scratch space on a disk.
#[derive(Debug)]
pub struct ScratchFile {
    file: File,
    /// Its name, where the system keeps files that are open from being removed.
    name: Option<PathBuf>,
}

impl ScratchFile {
    /// In the folder of `path`, where results go and room for them is; in the folder of temporary files if none can be made there.
    ///
    /// # Errors
    /// The system's.
    pub fn beside(path: &Path) -> io::Result<Self> {
        let here = target(path).and_then(|path| temporary(&path));
        let (file, name) = here.or_else(|_| temporary(&std::env::temp_dir().join("hyd")))?;
        let name = fs::remove_file(&name).err().map(|_| name);
        Ok(Self { file, name })
    }

    /// To read and write.
    pub fn file(&mut self) -> &mut File {
        &mut self.file
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        if let Some(name) = &self.name {
            // It is ours and of no use to anybody; if it cannot be removed, nothing depends on it.
            let _ = fs::remove_file(name);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::io::{Read, Seek, SeekFrom, Write};

    use super::*;

    #[test]
    fn it_holds_what_was_written_and_leaves_nothing() {
        let folder = std::env::temp_dir().join(format!("hyd-scratch-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let mut scratch = ScratchFile::beside(&folder.join("r.parquet")).unwrap();
        scratch.file().write_all(b"rows").unwrap();
        scratch.file().seek(SeekFrom::Start(1)).unwrap();
        let mut text = String::new();
        scratch.file().read_to_string(&mut text).unwrap();
        assert_eq!(text, "ows");
        drop(scratch);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        fs::remove_dir_all(&folder).unwrap();
        assert!(ScratchFile::beside(&folder.join("none/r.parquet")).is_ok(), "the folder of temporary files");
    }
}
