//! A program that is called once for each number, as a script of the shell that every engine can run.

use std::path::{Path, PathBuf};

/// Seconds that a task waits for its program: a file system that machines share may show a new file late.
const PATIENCE: u32 = 60;

/// What is to be done for each number.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Work {
    /// By this the engine knows all tasks of the work again, also after the process that submitted them has died.
    pub name: String,
    /// Where tasks stand; absolute, on a file system that all machines share.
    pub folder: PathBuf,
    /// Absolute, too.
    pub program: PathBuf,
    /// In front of the number.
    pub arguments: Vec<String>,
    /// Processors of a task.
    pub processors: usize,
    /// Folder for what failed tasks say; absolute.
    pub logs: PathBuf,
}

impl Work {
    /// What a task says if it fails stands here; a task that ends well leaves no file.
    pub fn log(&self, number: usize) -> PathBuf {
        self.logs.join(format!("{number}.txt"))
    }

    /// The script of a task whose number the engine puts into a variable of the environment.
    pub(crate) fn script(&self, variable: &str) -> String {
        let program = quoted(&self.program.display().to_string());
        let arguments: Vec<String> = self.arguments.iter().map(|own| quoted(own)).collect();
        let (arguments, logs) = (arguments.join(" "), quoted(&self.logs.display().to_string()));
        format!(
            "n=0\n\
             while [ ! -x {program} ] && [ $n -lt {PATIENCE} ]; do sleep 1; n=$((n+1)); done\n\
             log={logs}/${variable}.txt\n\
             {program} {arguments} ${variable} >/dev/null 2>\"$log\"\n\
             code=$?\n\
             if [ $code -eq 0 ]; then rm -f \"$log\"; else echo \"exit code $code on $(uname -n)\" >>\"$log\"; fi\n\
             exit $code\n"
        )
    }
}

/// What a failed task has said, if it could say anything; the file is removed.
pub(crate) fn said(log: &Path) -> Option<String> {
    let bytes = std::fs::read(log).ok()?;
    let text = String::from_utf8_lossy(&bytes).trim().to_string();
    // A file that stays behind is overwritten by the next attempt.
    let _ = std::fs::remove_file(log);
    (!text.is_empty()).then_some(text)
}

/// A word of the shell.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_task_says_what_went_wrong_and_leaves_nothing_if_nothing_did() {
        let folder = std::env::temp_dir().join(format!("hyd it's-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let work = |program: &str, arguments: &[&str]| Work {
            name: "n".into(),
            folder: folder.clone(),
            program: program.into(),
            arguments: arguments.iter().map(|own| own.to_string()).collect(),
            processors: 1,
            logs: folder.clone(),
        };
        let run = |work: &Work| {
            let mut shell = std::process::Command::new("sh");
            shell.arg("-c").arg(work.script("TASK")).env("TASK", "7").status().unwrap().code()
        };
        let well = work("/bin/sh", &["-c", "[ \"$0 $1\" = \"it's 7\" ]", "it's"]);
        assert_eq!((run(&well), said(&well.log(7))), (Some(0), None));
        assert!(!well.log(7).exists());
        let ill = work("/bin/sh", &["-c", "echo full >&2; exit 3"]);
        assert_eq!(run(&ill), Some(3));
        let text = said(&ill.log(7)).unwrap();
        assert!(text.starts_with("full\nexit code 3 on "), "{text}");
        assert!(!ill.log(7).exists());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
