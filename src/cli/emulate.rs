//! `rotorbench emulate`: stand in for the hardware, behind shared memory or on a CAN bus.

use std::path::PathBuf;

use clap::ValueEnum;
use clap::builder::PossibleValue;

use super::check::Template;
use super::operate::BenchArguments;
use super::usage_error::UsageError;
use super::{CliError, CliResult, Outcome, output};
use crate::bench::BenchConfig;
use crate::can::{CanError, ProtocolName};
use crate::effect::{Law, Site, find};
use crate::emulate::{HiddenConfig, Impulse, PlantConfig};
use crate::model::Model;
use crate::report::run_summary;
use crate::rt::Shutdown;
use crate::runtime::lockstep::{run, two_process};
use crate::runtime::thresholds::THRESHOLDS;
use crate::runtime::{ProcessError, emulate};

/// Arguments of `emulate`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    #[command(flatten)]
    door: Door,
    #[command(flatten)]
    plant: PlantArguments,
    /// Arm as soon as the checks pass, for scripted runs
    #[arg(long, requires = "shm")]
    arm: bool,
    /// Play the bench that is built in for this protocol
    #[arg(long, value_name = "PROTOCOL", requires = "can", conflicts_with = "config")]
    protocol: Option<ProtocolName>,
    /// On DroneCAN: the emulated nodes have no node ids, and ask an allocator for them
    #[arg(long, conflicts_with = "shm")]
    dynamic_ids: bool,
    /// End after this many seconds
    #[arg(long, value_name = "S", value_parser = super::operate::seconds)]
    seconds: Option<f64>,
    /// In virtual time, step by step with `control --lockstep`, as fast as both can; 60 seconds by default
    #[arg(long, requires = "shm", conflicts_with = "arm")]
    lockstep: bool,
    /// In lockstep: how long a controller may be silent before it is taken as gone
    #[arg(long, value_name = "S", requires = "lockstep", default_value_t = THRESHOLDS.patience_s,
          value_parser = super::operate::seconds)]
    patience: f64,
    /// Write the summary as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// On which side of the guard.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
struct Door {
    /// In the place of bridge and hardware: behind shared memory, with the guard
    #[arg(long)]
    shm: bool,
    /// As ESCs and IMU on this CAN interface, which a bridge uses
    #[arg(long, value_name = "IFACE")]
    can: Option<String>,
}

/// As `--protocol` takes it, and what help says of it.
impl ValueEnum for ProtocolName {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Dbc, Self::Dronecan]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(match self {
            Self::Dbc => PossibleValue::new("dbc").help("Frames that DBC files describe"),
            Self::Dronecan => PossibleValue::new("dronecan").help("DroneCAN, version 0"),
        })
    }
}

/// What the emulated bench is made of, over what the bench file says.
#[derive(Debug, Default, clap::Args)]
pub struct PlantArguments {
    /// Take parameters and effects of the plant from a model file (`paper` is built in)
    #[arg(long, value_name = "MODEL")]
    model: Option<PathBuf>,
    /// Hide an effect: `id` or `id:parameter=value,...`; may be given several times. A parameter left out takes the middle of
    /// its usual range
    #[arg(long, value_name = "EFFECT")]
    hide: Vec<String>,
    /// Hide an effect, and how strong it is, drawn from this seed
    #[arg(long, value_name = "N")]
    hide_seed: Option<u64>,
    /// Strike the body: `at_s:duration_s:torque_nm`; may be given several times
    #[arg(long, value_name = "IMPULSE", allow_hyphen_values = true)]
    impulse: Vec<String>,
    /// Seed of the sensors' noise
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

impl PlantArguments {
    /// The options that are given.
    pub fn given(&self) -> Vec<&'static str> {
        let Self { model, hide, hide_seed, impulse, seed } = self;
        let options = [
            ("--model", model.is_some()),
            ("--hide", !hide.is_empty()),
            ("--hide-seed", hide_seed.is_some()),
            ("--impulse", !impulse.is_empty()),
            ("--seed", seed.is_some()),
        ];
        options.into_iter().filter_map(|(option, given)| given.then_some(option)).collect()
    }

    /// An option that is given and acts on nothing but the motion of the body.
    pub fn moving_the_body(&self) -> Option<String> {
        if !self.impulse.is_empty() {
            return Some("--impulse".to_owned());
        }
        let id = |text: &String| text.split(':').next().unwrap_or_default().trim().to_owned();
        let moves = |id: &String| {
            find(id).is_some_and(|card| {
                card.site == Site::Torque && matches!(card.law, Law::Static(_) | Law::Stiff(_))
            })
        };
        self.hide.iter().map(id).find(moves).map(|id| format!("--hide {id}"))
    }

    /// Writes them over the bench file's `[emulator]`.
    ///
    /// # Errors
    /// A model that cannot be read; an effect or impulse that cannot be understood.
    pub fn apply(&self, config: &mut BenchConfig) -> Result<(), CliError> {
        let emulator = &mut config.emulator;
        if let Some(path) = &self.model {
            let model = Model::load(path)?;
            emulator.plant =
                PlantConfig { angle_stop: emulator.plant.angle_stop, ..PlantConfig::from_model(&model) };
            emulator.hidden.extend(HiddenConfig::of_model(&model));
        }
        for text in &self.hide {
            emulator.hidden.push(HiddenConfig::parse(text)?);
        }
        if let Some(seed) = self.hide_seed {
            emulator.hidden.extend(HiddenConfig::draw(seed, |_| true));
        }
        for text in &self.impulse {
            emulator.impulse.push(impulse(text)?);
        }
        if let Some(seed) = self.seed {
            emulator.seed = seed;
        }
        // Who writes down what was run writes every number.
        let hidden = std::mem::take(&mut emulator.hidden);
        emulator.hidden = hidden.into_iter().map(HiddenConfig::completed).collect();
        config.emulator = config.emulator();
        Ok(())
    }
}

/// The impulse that `text` writes as `at_s:duration_s:torque_nm`.
pub(super) fn impulse(text: &str) -> Result<Impulse, UsageError> {
    let numbers: Result<Vec<f64>, _> = text.split(':').map(|number| number.trim().parse()).collect();
    let Ok(&[at_s, duration_s, torque]) = numbers.as_deref() else {
        let form = "at_s:duration_s:torque_nm, as in 3:0.05:0.6";
        return Err(UsageError::Form { option: "--impulse", value: text.to_owned(), form });
    };
    Ok(Impulse { at_s, duration_s, torque })
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let mut config = match arguments.protocol {
        Some(ProtocolName::Dronecan) => Template::Dronecan.bench()?,
        Some(ProtocolName::Dbc) | None => arguments.bench.load()?,
    };
    arguments.plant.apply(&mut config)?;
    let shutdown = Shutdown::listen()?;
    if let Some(interface) = &arguments.door.can {
        config.bus.interface.clone_from(interface);
        let summary = emulate::on_bus(&config, arguments.dynamic_ids, arguments.seconds, &shutdown);
        let summary = summary.map_err(|error| match &error {
            ProcessError::Can(CanError::Interface { .. } | CanError::Socket { .. }) => {
                CliError::from(error).of_option("--can", interface)
            }
            ProcessError::Can(CanError::Role { place, .. }) if place == "interface" => {
                CliError::from(error).of_option("--can", interface)
            }
            _ => error.into(),
        })?;
        output::say(arguments.json, &summary, || run_summary::emulated_on_bus(&summary) + "\n")?;
        return Ok(Outcome::Done);
    }
    if arguments.lockstep {
        let seconds = arguments.seconds.unwrap_or(run::DEFAULT_S);
        let summary = two_process::conduct(&config, seconds, arguments.patience, &shutdown)?;
        return super::lockstep::say(&summary, arguments.json);
    }
    let summary = emulate::behind_guard(&config, arguments.arm, arguments.seconds, &shutdown)?;
    output::say(arguments.json, &summary, || run_summary::emulated_behind_guard(&summary))?;
    Ok(Outcome::Done)
}
