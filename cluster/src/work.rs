//! A program that is called once for each number, as a script of the shell that every engine can run.

use std::path::{Path, PathBuf};

/// Seconds that a task waits for its program: a file system that machines share may show a new file late.
const PATIENCE: u32 = 60;
/// Seconds after its start in which a task begins others: two seconds until the next one starts are less than a hundredth of them.
const SPARE: u32 = 300;
/// Tasks in a row that others have taken after which a task stops to look for more: what comes then began by itself.
const MISSED: u32 = 100;

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
    /// Number of all tasks, where one that is done may go on with others, because the program finds at once that there is nothing left to do if
    /// it is called again for one that is done.  None where every task is to have a process of its own.
    pub goes_on: Option<usize>,
}

impl Work {
    /// What a task says if it fails stands here; a task that ends well leaves no file.
    pub fn log(&self, number: usize) -> PathBuf {
        self.logs.join(format!("{number}.txt"))
    }

    /// The script of a task whose number the engine puts into a variable of the environment.
    pub(crate) fn script(&self, variable: &str) -> String {
        format!("{}task ${variable}\n", self.function())
    }

    /// The same for an engine that is slow to start the next task: one that is done in time goes on with others, from the last to the first, that
    /// neither began by themselves nor were taken by another.  What is taken, and the last one that was, are only hints (a folder that stays behind
    /// does no harm): each task begins by itself too when its turn comes, and finds that nothing is left to do.
    pub(crate) fn script_that_goes_on(&self, variable: &str) -> String {
        let Some(count) = self.goes_on else { return self.script(variable) };
        let (function, taken) = (self.function(), quoted(&self.taken().display().to_string()));
        format!(
            "end=$(($(date +%s)+{SPARE}))\n\
             {function}\
             mkdir {taken} 2>/dev/null\n\
             mkdir {taken}/${variable} 2>/dev/null\n\
             task ${variable} || exit $?\n\
             k={count}\n\
             missed=0\n\
             while :; do\n\
             n=\n\
             {{ read -r n <{taken}/next; }} 2>/dev/null\n\
             case $n in ''|*[!0-9]*) ;; *) [ \"$n\" -lt \"$k\" ] && k=$n;; esac\n\
             k=$((k-1))\n\
             [ \"$k\" -ge 0 ] && [ \"$(date +%s)\" -lt $end ] || break\n\
             if mkdir {taken}/$k 2>/dev/null; then\n\
             missed=0\n\
             echo $k >{taken}/next.${variable} && mv -f {taken}/next.${variable} {taken}/next\n\
             task $k || break\n\
             else\n\
             missed=$((missed+1))\n\
             [ -d {taken}/$k ] && [ $missed -lt {MISSED} ] || break\n\
             fi\n\
             done\n\
             exit 0\n"
        )
    }

    /// Where tasks that go on leave a folder for each that they have taken.
    pub(crate) fn taken(&self) -> PathBuf {
        self.logs.join("taken")
    }

    /// What a task does, as a function of the shell; it waits for the program first.
    fn function(&self) -> String {
        let program = quoted(&self.program.display().to_string());
        let arguments: Vec<String> = self.arguments.iter().map(|own| quoted(own)).collect();
        let (arguments, logs) = (arguments.join(" "), quoted(&self.logs.display().to_string()));
        format!(
            "n=0\n\
             while [ ! -x {program} ] && [ $n -lt {PATIENCE} ]; do sleep 1; n=$((n+1)); done\n\
             task() {{\n\
             log={logs}/$1.txt\n\
             {program} {arguments} $1 >/dev/null 2>\"$log\"\n\
             code=$?\n\
             if [ $code -eq 0 ]; then rm -f \"$log\"; else echo \"exit code $code on $(uname -n)\" >>\"$log\"; fi\n\
             return $code\n\
             }}\n"
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
            goes_on: None,
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

    #[cfg(unix)]
    #[test]
    fn a_task_that_is_done_in_time_goes_on_with_others() {
        let folder = std::env::temp_dir().join(format!("hyd-goes-on-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        // Each task adds its number to what was done; one cannot.
        let script = "[ $0 != 2 ] || exit 5; echo $0 >>done";
        let work = |goes_on| Work {
            name: "n".into(),
            folder: folder.clone(),
            program: "/bin/sh".into(),
            arguments: ["-c", script].map(String::from).to_vec(),
            processors: 1,
            logs: folder.join("logs"),
            goes_on,
        };
        let run = |work: &Work, task: &str| {
            let mut shell = std::process::Command::new("sh");
            shell.arg("-c").arg(work.script_that_goes_on("TASK")).env("TASK", task).current_dir(&folder);
            let code = shell.status().unwrap().code();
            (code, std::fs::read_to_string(folder.join("done")).unwrap_or_default().replace('\n', " "))
        };
        std::fs::create_dir_all(folder.join("logs")).unwrap();
        assert_eq!(run(&work(None), "6"), (Some(0), "6 ".to_string()));
        let all = work(Some(7));
        // Another one has begun task 5.
        std::fs::create_dir_all(all.taken().join("5")).unwrap();
        assert_eq!(run(&all, "0"), (Some(0), "6 0 6 4 3 ".to_string()));
        assert!(said(&all.log(2)).unwrap().starts_with("exit code 5 on "));
        assert_eq!(run(&all, "2").0, Some(5));
        assert_eq!(run(&all, "5"), (Some(0), "6 0 6 4 3 5 1 ".to_string()));
        assert_eq!(run(&all, "3"), (Some(0), "6 0 6 4 3 5 1 3 ".to_string()));
        std::fs::write(all.taken().join("next"), "").unwrap();
        assert_eq!(run(&all, "4"), (Some(0), "6 0 6 4 3 5 1 3 4 ".to_string()));
        // Where others have got to is where it goes on, and it does not look through all that is taken.
        let fresh = |taken: std::ops::Range<usize>, next: &str| {
            std::fs::remove_dir_all(folder.join("logs")).unwrap();
            std::fs::remove_file(folder.join("done")).unwrap();
            for task in taken {
                std::fs::create_dir_all(all.taken().join(task.to_string())).unwrap();
            }
            std::fs::create_dir_all(all.taken()).unwrap();
            std::fs::write(all.taken().join("next"), next).unwrap();
        };
        fresh(0..0, "2\n");
        assert_eq!(run(&all, "6"), (Some(0), "6 1 0 ".to_string()));
        fresh(2..102, "");
        assert_eq!(run(&work(Some(102)), "6"), (Some(0), "6 ".to_string()));
        assert!(!all.log(2).exists());
        // One less, and it comes to the task that fails.
        fresh(3..102, "");
        assert_eq!(run(&work(Some(102)), "6"), (Some(0), "6 ".to_string()));
        assert!(all.log(2).exists());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
