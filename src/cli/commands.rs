//! The commands by task with examples. Each help page fits on one screen.

use clap::{Command, CommandFactory};

use super::arguments::Cli;

/// The commands of a task: the name of the task, then name and example of each command.
pub type TaskCommands = (&'static str, &'static [(&'static str, &'static str)]);

/// All commands by task. [`CAMPAIGN_COMMANDS`] has the examples of `campaign`.
pub const GROUPS: [TaskCommands; 5] = [
    (
        "Write a scene",
        &[
            (
                "new",
                "fretwear new joint --set contact.normal_load=\"20 kN\"",
            ),
            ("check", "fretwear check joint.toml"),
            ("plan", "fretwear plan joint.toml --set wear.cycles=1e6"),
            ("schema", "fretwear schema preload"),
            ("inspect", "fretwear inspect stiffness.mtx mass.mtx"),
        ],
    ),
    (
        "Compute",
        &[
            ("run", "fretwear run joint.toml --max-wall \"8 h\""),
            ("status", "fretwear status runs/joint"),
            ("stage", "fretwear stage wear --run runs/joint@12"),
            ("backbone", "fretwear backbone runs/joint@0 runs/joint@12"),
        ],
    ),
    (
        "Use the results",
        &[
            ("report", "fretwear report runs/joint"),
            (
                "when",
                "fretwear when runs/joint --preload 90% --depth 10um",
            ),
            ("compare", "fretwear compare runs/* --csv runs.csv"),
            ("export", "fretwear export runs/joint@12 --vtu fields"),
            ("verify", "fretwear verify runs/joint"),
        ],
    ),
    (
        "Run many",
        &[
            (
                "campaign",
                "fretwear campaign plan campaign.toml --dir study",
            ),
            ("trade", "fretwear trade joint.toml --knob wear_tolerance"),
            ("reproduce", "fretwear reproduce --jobs 2"),
        ],
    ),
    (
        "Set up",
        &[
            ("doctor", "fretwear doctor /data/runs"),
            ("completions", "fretwear completions bash > fretwear.bash"),
        ],
    ),
];

/// The subcommands of `campaign`: name and example of each.
pub const CAMPAIGN_COMMANDS: [(&str, &str); 5] = [
    ("plan", "fretwear campaign plan campaign.toml --dir study"),
    ("run", "fretwear campaign run --dir study --jobs 4"),
    ("status", "fretwear campaign status --dir study"),
    ("collect", "fretwear campaign collect --dir study"),
    ("report", "fretwear campaign report --dir study"),
];

/// Builds the command line. The help of the command line lists the commands by task, with an example per command.
pub fn command() -> Command {
    let mut listing = String::new();
    let cli = Cli::command();
    for (task, commands) in GROUPS {
        listing += &format!("\n{task}:\n");
        let rows = commands.iter().map(|(name, _)| row(&cli, name));
        listing.extend(rows);
    }
    let examples = || GROUPS.iter().flat_map(|(_, commands)| *commands);
    let cli = cli.help_template(format!(
        "{{about}}\n\n{{usage-heading}} {{usage}}\n{listing}\nOptions:\n{{options}}{{after-help}}"
    ));
    cli.mut_subcommands(|command| {
        let example = example_of(examples(), &command);
        one_screen(command, example).mut_subcommands(|inner| {
            let example = example_of(CAMPAIGN_COMMANDS.iter(), &inner);
            one_screen(inner, example)
        })
    })
}

fn row(cli: &Command, name: &str) -> String {
    let about = cli.find_subcommand(name).and_then(Command::get_about);
    let about = about.map(ToString::to_string).unwrap_or_default();
    format!("  {name:<12} {about}\n")
}

fn example_of<'a>(
    mut examples: impl Iterator<Item = &'a (&'static str, &'static str)>,
    command: &Command,
) -> Option<&'static str> {
    let entry = examples.find(|(name, _)| *name == command.get_name());
    entry.map(|(_, example)| *example)
}

/// Makes `-h` and `--help` equal: both print the full text, one or two lines per option, and the example last.
fn one_screen(command: Command, example: Option<&str>) -> Command {
    let long = command.get_long_about().cloned();
    let mut command = match long {
        Some(long) => command.about(long).long_about(None::<&str>),
        None => command,
    };
    if let Some(example) = example {
        let more = command.get_after_help().map(|text| format!("\n\n{text}"));
        let more = more.unwrap_or_default();
        command = command.after_help(format!("Example:\n  {example}{more}"));
    }
    command.mut_args(|arg| match arg.get_long_help().cloned() {
        Some(long) => arg.help(long).long_help(None::<&str>),
        None => arg,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names<'a>(commands: impl IntoIterator<Item = &'a Command>) -> Vec<&'a str> {
        let mut names: Vec<&str> = commands.into_iter().map(Command::get_name).collect();
        names.sort_unstable();
        names
    }

    /// Every command has exactly one task in the help, including hidden commands.
    #[test]
    fn each_command_has_one_task() {
        let cli = Cli::command();
        let all = GROUPS.iter().flat_map(|(_, commands)| *commands);
        let mut listed: Vec<&str> = all.map(|(name, _)| *name).collect();
        listed.sort_unstable();
        assert_eq!(names(cli.get_subcommands()), listed);
        let campaign = cli.find_subcommand("campaign").expect("a command");
        let mut listed = CAMPAIGN_COMMANDS.map(|(name, _)| name);
        listed.sort_unstable();
        assert_eq!(names(campaign.get_subcommands()), listed);
    }

    #[test]
    fn each_example_is_of_its_command() {
        let groups = GROUPS.iter().flat_map(|(_, commands)| *commands);
        for (name, example) in groups.chain(&CAMPAIGN_COMMANDS) {
            let line = example.split(" > ").next().unwrap_or_default();
            let words = shlex::split(line).expect("words");
            assert!(words[1..3].iter().any(|word| word == name), "{example}");
            let parsed = command().try_get_matches_from(&words);
            assert!(parsed.is_ok(), "{example}: {:?}", parsed.err());
        }
    }

    #[test]
    fn each_help_is_one_screen() {
        const LINES: usize = 40;
        const COLUMNS: usize = 100;
        let mut paths = vec![vec!["fretwear".to_owned()]];
        while let Some(mut path) = paths.pop() {
            let name = path.join(" ");
            path.push("--help".to_owned());
            let shown = command().try_get_matches_from(&path).expect_err("its help");
            let text = shown.to_string();
            path.pop();
            assert!(text.lines().count() <= LINES, "{name}: {text}");
            let longest = text.lines().map(|line| line.chars().count()).max();
            assert!(longest <= Some(COLUMNS), "{name}: {longest:?}\n{text}");
            let cli = command();
            let subcommand = path[1..]
                .iter()
                .try_fold(&cli, |parent, name| parent.find_subcommand(name));
            let inner = subcommand.expect("a command").get_subcommands();
            paths.extend(inner.map(|inner| [&path[..], &[inner.get_name().to_owned()]].concat()));
            let examples = text.matches("Example:\n  fretwear").count();
            assert_eq!(examples, usize::from(path.len() > 1), "{name}: {text}");
        }
    }
}
