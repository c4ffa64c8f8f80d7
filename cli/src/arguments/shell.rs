//! Arguments of the verbs for the shell: `completions`, `man`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

/// `hyd completions`
#[derive(Args, Debug)]
#[command(after_help = "bash: hyd completions bash > ~/.local/share/bash-completion/completions/hyd\n\
                        zsh:  hyd completions zsh > DIR/_hyd, where DIR is in fpath\n\
                        fish: hyd completions fish > ~/.config/fish/completions/hyd.fish")]
pub struct Completions {
    /// The shell
    #[arg(value_name = "SHELL")]
    pub shell: Shell,
}

/// `hyd man`
#[derive(Args, Debug)]
pub struct ManPages {
    /// Folder of the pages; made if it is not there
    #[arg(long, short, value_name = "DIR")]
    pub output: PathBuf,
}
