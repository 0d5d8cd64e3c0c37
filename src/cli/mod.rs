//! The command line: arguments in, exit codes out. Results go to stdout, everything else to stderr.

mod arguments;
#[cfg(feature = "polars")]
mod at_once;
mod backbone;
mod campaign;
mod check;
mod commands;
#[cfg(feature = "polars")]
mod compare;
mod cost;
mod doctor;
mod edit;
mod error;
mod export;
mod export_contact;
mod export_reduced;
mod export_vtu;
mod figures;
mod inspect;
mod inspect_map;
mod many;
mod new;
mod report;
#[cfg(feature = "polars")]
mod report_command;
#[cfg(feature = "polars")]
mod reproduce;
mod resonances;
mod run;
mod schema;
mod show;
mod stage;
mod status;
mod trade;
mod when;

use std::io::ErrorKind;
use std::process::ExitCode;

use clap::FromArgMatches;
use clap_complete::Shell;

use crate::terminal::{Results, say};
use arguments::{Cli, Command};
use error::CliError;

/// Exit codes of commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exit {
    Done,
    Failure,
    Scene,
    NotConverged,
    Damaged,
    Stopped,
    /// Stopped, with the exit code that a workload manager expects.
    StoppedAs(u8),
}

impl Exit {
    /// Returns the `Exit` that has the exit code `code` of an earlier failure.
    fn of_failure(code: u8) -> Exit {
        let failures = [Exit::Scene, Exit::NotConverged, Exit::Damaged];
        let failure = failures.into_iter().find(|exit| exit.code() == code);
        failure.unwrap_or(Exit::Failure)
    }

    fn code(self) -> u8 {
        match self {
            Exit::Done => 0,
            Exit::Failure => 1,
            Exit::Scene => 2,
            Exit::NotConverged => 3,
            Exit::Damaged => 4,
            Exit::Stopped => 75,
            Exit::StoppedAs(code) => code,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(exit.code())
    }
}

/// Prints the completions for a shell.
fn completions(shell: Shell, out: &mut Results) -> Exit {
    // The generator of completions panics if a write fails. Let the generator write to memory, where no write fails.
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut commands::command(), "fretwear", &mut script);
    write!(out, "{}", String::from_utf8_lossy(&script));
    Exit::Done
}

/// Runs the command of the arguments.
pub fn main() -> ExitCode {
    let matches = commands::command().try_get_matches();
    let command = match matches.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli.command,
        Err(answer) => return print_answer(&answer),
    };
    let mut out = Results::default();
    let exit = perform(command, &mut out).unwrap_or_else(|error| {
        // Print all errors of a scene, one per line.
        let exit = error.exit();
        match error {
            CliError::Scene(error) => error.into_each().for_each(|e| say(&format!("error: {e}"))),
            error => say(&format!("error: {error}")),
        }
        exit
    });
    match out.end() {
        Ok(()) => exit.into(),
        Err(error) => report_unprinted(&error, exit).into(),
    }
}

fn perform(command: Command, out: &mut Results) -> Result<Exit, CliError> {
    match command {
        Command::Run(arguments) => run::run(arguments, out),
        Command::Plan { scene, graph, .. } if graph => show::graph(&scene.scene, &scene.sets, out),
        Command::Plan {
            scene,
            no_rehearsal,
            json,
            ..
        } => show::plan(&scene.scene, &scene.sets, !no_rehearsal, json, out),
        Command::Check { scenes, sets, json } => Ok(check::check(&scenes, &sets, json, out)),
        Command::Stage(arguments) => stage::stage(&arguments, out),
        Command::Backbone(arguments) => backbone::backbone(&arguments, out),
        Command::Status { folder, json } => status::status(&folder, json, out),
        Command::New { path, like, sets } => new::new(&path, like.as_deref(), &sets, out),
        Command::Verify { run } => show::verify(&run, out),
        Command::When(arguments) => when::when(&arguments, out),
        Command::Trade(arguments) => trade::trade(&arguments, out),
        Command::Campaign { command } => campaign::campaign(&command, out),
        #[cfg(feature = "polars")]
        Command::Reproduce(arguments) => reproduce::reproduce(&arguments, out),
        Command::Schema {
            word,
            markdown,
            json,
            json_schema,
        } => {
            let form = schema::Form::of(markdown, json, json_schema);
            schema::schema(word.as_deref(), form, out)
        }
        Command::Doctor { dir, json } => doctor::doctor(&dir, json, out),
        Command::Completions { shell } => Ok(completions(shell, out)),
        Command::Export(arguments) => export::export(&arguments, out),
        Command::Inspect(arguments) => inspect::inspect(&arguments, out),
        #[cfg(feature = "polars")]
        Command::Compare(arguments) => compare::compare(&arguments, out),
        #[cfg(feature = "polars")]
        Command::Report(arguments) => report_command::report(&arguments, out),
        #[cfg(not(feature = "polars"))]
        Command::Reproduce(_) | Command::Compare(_) | Command::Report(_) => Err(CliError::NoPolars),
    }
}

/// Reports a result that could not be printed. The exit code of the command wins, unless the command succeeded.
fn report_unprinted(error: &std::io::Error, exit: Exit) -> Exit {
    say(&format!("error: cannot write the result: {error}"));
    match exit {
        Exit::Done => Exit::Failure,
        other => other,
    }
}

/// Prints the errors of the arguments, the help, or the version.
fn print_answer(answer: &clap::Error) -> ExitCode {
    let exit = ExitCode::from(answer.exit_code() as u8);
    match answer.print() {
        // Help and version are results: failing to print them is an error.
        Err(error) if !answer.use_stderr() && error.kind() != ErrorKind::BrokenPipe => {
            report_unprinted(&error, Exit::Done).into()
        }
        _ => exit,
    }
}
