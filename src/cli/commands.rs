//! The commands in groups, and the example that each one's help begins with.

use clap::Command;

use crate::effect::{self, Site, Term};

/// Commands that belong together, in the order in which they are met.
const GROUPS: [(&str, &[&str]); 3] = [
    (
        "Look at logs",
        &[
            "demo",
            "workbench",
            "import",
            "identify",
            "compare",
            "diagnose",
            "discover",
            "extend",
            "fleet",
            "effects",
            "design",
            "export",
            "replay",
            "paper",
        ],
    ),
    (
        "Run",
        &[
            "check",
            "dronecan",
            "emulate",
            "run",
            "bridge",
            "control",
            "arm",
            "disarm",
            "stop",
            "monitor",
            "record",
            "experiment",
        ],
    ),
    ("The machine", &["doctor", "jitter", "completions", "man", "schema"]),
];

/// An example of each command, by its path; which effect stands for `{effect}`, the catalogue says.
const EXAMPLES: &[(&str, &str)] = &[
    ("demo", "rotorbench demo --hide {effect}"),
    ("workbench", "rotorbench workbench train.csv held_out.csv --model model.toml"),
    ("import", "rotorbench import stand.csv --mapping rcbenchmark -o log.csv"),
    ("identify", "rotorbench identify --log ramp.csv prbs.csv -o model.toml"),
    ("compare", "rotorbench compare --model paper --log held_out.csv"),
    ("diagnose", "rotorbench diagnose --model paper --log train.csv --validate held_out.csv"),
    ("discover", "rotorbench discover --model paper --log train.csv --validate held_out.csv -o law.toml"),
    ("extend", "rotorbench extend --effect {effect} --log train.csv -o better.toml"),
    ("fleet", "rotorbench fleet run plan.toml -o answers"),
    ("fleet plan", "rotorbench fleet plan 'logs/*/' -o plan.toml"),
    ("fleet run", "rotorbench fleet run plan.toml --shard 3/20 -o answers"),
    ("fleet merge", "rotorbench fleet merge answers --plan plan.toml --report answers/fleet.html"),
    ("effects", "rotorbench effects {effect}"),
    ("design", "rotorbench design --model model.toml --delay-ms 5"),
    ("export", "rotorbench export run.mcap -o run.csv --candump run.log"),
    ("replay", "rotorbench replay run.mcap --set controller.emc.alpha=1.1"),
    ("paper", "rotorbench paper --report paper.html"),
    ("check", "rotorbench check --config bench.toml"),
    ("dronecan", "rotorbench dronecan list --interface can0"),
    ("dronecan list", "rotorbench dronecan list --interface can0"),
    ("dronecan allocate", "rotorbench dronecan allocate --interface can0 --table nodes.toml"),
    ("dronecan param", "rotorbench dronecan param 20 --interface can0"),
    ("emulate", "rotorbench emulate --shm --hide {effect}:{parameter}=0.4"),
    ("run", "rotorbench run --lockstep --seconds 20 --record run.mcap"),
    ("bridge", "rotorbench bridge --config bench.toml"),
    ("control", "rotorbench control --config bench.toml"),
    ("arm", "rotorbench arm --config bench.toml"),
    ("disarm", "rotorbench disarm --config bench.toml"),
    ("stop", "rotorbench stop --config bench.toml"),
    ("monitor", "rotorbench monitor --config bench.toml"),
    ("record", "rotorbench record --config bench.toml -o run.mcap"),
    ("experiment", "rotorbench experiment prbs --lockstep --closed-loop --amplitude 0.03 -o train.csv"),
    (
        "experiment constant",
        "rotorbench experiment constant --levels 0.3,0.5 --hold 20 --lockstep -o levels.csv",
    ),
    ("experiment ramp", "rotorbench experiment ramp --low 0.25 --high 0.7 --lockstep -o ramp.csv"),
    ("experiment steps", "rotorbench experiment steps --amplitude 0.08 --lockstep -o steps.csv"),
    ("experiment prbs", "rotorbench experiment prbs --duration 60 --lockstep -o prbs.csv"),
    ("experiment chirp", "rotorbench experiment chirp --to 10 --lockstep -o chirp.csv"),
    ("doctor", "rotorbench doctor --config bench.toml"),
    ("jitter", "rotorbench jitter --duration-s 10 --report jitter.html"),
    ("completions", "rotorbench completions bash > ~/.local/share/bash-completion/completions/rotorbench"),
    ("man", "rotorbench man ~/.local/share/man/man1"),
    ("schema", "rotorbench schema diagnose > diagnose.schema.json"),
];

/// What the program says of itself, without a command.
const OVERVIEW: &str = "{about-with-newline}\n{usage-heading} {usage}{after-help}\n\nOptions:\n{options}";

/// The command line with its groups, each command's help beginning with its example.
pub(super) fn with_examples(command: Command) -> Command {
    let groups = groups(&command);
    place(command, "", &|command, example| command.before_help(format!("Example: {example}")))
        .help_template(OVERVIEW)
        .after_help(groups)
}

/// The same for manual pages, which have no place before the description.
pub(super) fn for_manual(command: Command) -> Command {
    place(command, "", &|command, example| command.after_help(format!("Example: {example}")))
}

fn place(command: Command, path: &str, with: &dyn Fn(Command, &str) -> Command) -> Command {
    let names: Vec<String> = command.get_subcommands().map(|it| it.get_name().to_owned()).collect();
    names.into_iter().fold(command, |command, name| {
        let path = format!("{path} {name}").trim_start().to_owned();
        command.mut_subcommand(name, |it| {
            let it = place(it, &path, with);
            match EXAMPLES.iter().find(|(of, _)| *of == path) {
                Some((_, example)) => with(it, &filled(example)),
                None => it,
            }
        })
    })
}

/// An example with the effect that everybody has an idea of: a body that hangs like a pendulum.
fn filled(example: &str) -> String {
    let card = effect::acting_as(Site::Torque, Term::Pendulum);
    let (id, parameter) =
        card.map_or(("", ""), |card| (card.id, card.parameters.first().map_or("", |it| it.name)));
    example.replace("{effect}", id).replace("{parameter}", parameter)
}

/// Each group with one line for each of its commands.
fn groups(command: &Command) -> String {
    let line = |name: &&str| {
        let about = command.find_subcommand(name).and_then(Command::get_about);
        format!("  {name:<12} {}\n", about.map(ToString::to_string).unwrap_or_default())
    };
    let group = |(heading, names): &(&str, &[&str])| {
        format!("{heading}:\n{}", names.iter().map(line).collect::<String>())
    };
    let text = GROUPS.iter().map(group).collect::<Vec<_>>().join("\n");
    format!("{text}\n`rotorbench COMMAND --help` begins with an example and lists every option.")
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::super::{CommandLine, with_negative_numbers};
    use super::*;

    fn paths(command: &Command, above: &str, found: &mut Vec<String>) {
        for it in command.get_subcommands() {
            let path = format!("{above} {}", it.get_name()).trim_start().to_owned();
            paths(it, &path, found);
            found.push(path);
        }
    }

    #[test]
    fn every_command_is_in_one_group() {
        let command = CommandLine::command();
        let mut grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        let mut there: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
        grouped.sort_unstable();
        there.sort_unstable();
        assert_eq!(grouped, there);
    }

    #[test]
    fn every_command_has_an_example_that_parses() {
        let mut all = Vec::new();
        paths(&CommandLine::command(), "", &mut all);
        for path in &all {
            let examples: Vec<String> =
                EXAMPLES.iter().filter(|(of, _)| of == path).map(|(_, text)| filled(text)).collect();
            let [example] = &examples[..] else { panic!("`{path}` has {} examples", examples.len()) };
            let wanted = format!("rotorbench {path}");
            assert!(example.starts_with(&wanted), "`{example}` is no example of `{path}`");
            assert!(!example.contains('{'), "{example}");
            // What a shell would take for itself.
            let words = example.split(" > ").next().unwrap_or_default().split_whitespace();
            let parsed = with_negative_numbers(CommandLine::command()).try_get_matches_from(words);
            assert!(parsed.is_ok(), "{example}: {}", parsed.unwrap_err());
        }
        assert_eq!(all.len(), EXAMPLES.len(), "an example of a command that is not there");
    }

    #[test]
    fn help_begins_with_the_example() {
        let mut command = with_examples(with_negative_numbers(CommandLine::command()));
        assert!(command.render_help().to_string().contains("Look at logs:\n  demo "));
        for path in ["compare", "experiment prbs"] {
            let of =
                path.split(' ').fold(&mut command, |at, name| at.find_subcommand_mut(name).expect("there"));
            let help = of.render_help().to_string();
            assert!(help.starts_with(&format!("Example: rotorbench {path} ")), "{help}");
        }
    }
}
