//! A queue of a few lines of shell that has the names and the answers of Slurm's programs.

use std::fs;
use std::io;
use std::path::Path;

/// Makes it in a folder: `bin` is for the front of the `PATH`.  A file `script`N is a job, `task.NAME.K` is there while a task waits or runs, `group.K` is
/// the process group of its last attempt.  Where `lost.K` is there, the next attempt at task K ends before it has begun; where `full.K` is
/// there, none can write a file of more than a block.  Where `hurried` is there, the time in which a task goes on with others is over at once; where
/// `single` is there, one task runs at a time, and the next one begins 5 s later.  `begun` has a line for each attempt.
///
/// # Errors
/// Files that cannot be written.
pub fn make(place: &Path) -> io::Result<()> {
    fs::create_dir_all(place.join("bin"))?;
    let bin = place.join("bin");
    let place = place.display();
    let programs = [
        ("date", format!("[ -e {place}/hurried ] && exec /bin/date +%s%N; exec /bin/date \"$@\"")),
        ("scontrol", "echo 'MaxArraySize            = 101'".to_string()),
        (
            "sbatch",
            format!(
                "for a; do case $a in --array=*) array=${{a#--array=}};; --job-name=*) name=${{a#--job-name=}};; esac; done\n\
                 job=$(ls {place} | wc -l); cat >{place}/script$job; list=\n\
                 for range in $(echo $array | tr , ' '); do list=\"$list $(seq -s ' ' ${{range%-*}} ${{range#*-}})\"; done\n\
                 for k in $list; do : >{place}/task.$name.$k; done\n\
                 (for k in $list; do (\n\
                    [ -e {place}/task.$name.$k ] || exit\n\
                    echo $k >>{place}/begun\n\
                    export SLURM_ARRAY_TASK_ID=$k\n\
                    if [ -e {place}/lost.$k ]; then rm {place}/lost.$k\n\
                    elif [ -e {place}/full.$k ]; then (trap '' XFSZ; ulimit -f 1; /bin/sh {place}/script$job)\n\
                    else setsid /bin/sh {place}/script$job & echo $! >{place}/group.$k; wait $!; fi\n\
                    rm -f {place}/task.$name.$k\n\
                  ) &\n\
                  [ -e {place}/single ] && wait && ls {place}/task.$name.* && sleep 5; done) >/dev/null 2>&1 </dev/null &\n\
                 echo \"$job;loopback\""
            ),
        ),
        (
            "squeue",
            format!(
                "for a; do case $a in --name=*) name=${{a#--name=}};; esac; done\n\
                 for t in {place}/task.$name.*; do [ -e \"$t\" ] && echo \"${{t##*.}}\"; done; exit 0"
            ),
        ),
        (
            "scancel",
            format!(
                "for a; do case $a in --name=*) name=${{a#--name=}};; esac; done\n\
                 for t in {place}/task.$name.*; do [ -e \"$t\" ] || continue\n\
                   rm -f $t; kill -9 -$(cat {place}/group.${{t##*.}}) 2>/dev/null; done; exit 0"
            ),
        ),
    ];
    for (name, text) in programs {
        let path = bin.join(name);
        fs::write(&path, format!("#!/bin/sh\n{text}\n"))?;
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            fs::set_permissions(&path, fs::Permissions::from_mode(0o755))?;
        }
    }
    Ok(())
}
