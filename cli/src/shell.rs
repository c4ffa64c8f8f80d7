//! `hyd completions SHELL` and `hyd man -o DIR`: what shells and `man` want to know of the command, made of its definition.

use clap::CommandFactory;
use clap_mangen::Man;
use hyd_results::write_whole;

use crate::arguments::{Arguments, Completions, ManPages};
use crate::{Failure, output};

/// Name of the command.
const NAME: &str = "hyd";

/// Prints the completions of a shell.
pub(crate) fn completions(arguments: &Completions) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), NAME, &mut script);
    output::print(&String::from_utf8_lossy(&script))
}

/// Writes a page for the command and one for each verb.
pub(crate) fn man(arguments: &ManPages) -> Result<(), Failure> {
    let folder = &arguments.output;
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::Fault(format!("the folder `{}` cannot be made: {error}", folder.display())))?;
    let mut command = Arguments::command().disable_help_subcommand(true);
    command.build();
    let mut pages = 0;
    let mut left = vec![command];
    while let Some(command) = left.pop() {
        left.extend(command.get_subcommands().filter(|own| !own.is_hide_set()).cloned());
        let page = Man::new(command);
        let path = folder.join(page.get_filename());
        let failed = |error: std::io::Error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display()));
        let mut text = Vec::new();
        page.render(&mut text).map_err(failed)?;
        write_whole(&path, &text).map_err(failed)?;
        pages += 1;
    }
    output::print(&format!(
        "{pages} pages in {}; `man -l {}` shows the first\n",
        folder.display(),
        folder.join("hyd.1").display()
    ))
}
