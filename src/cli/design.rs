//! `rotorbench design`: eigenvalues, gains and margins from a model.

use std::path::{Path, PathBuf};

use super::operate::BenchArguments;
use super::output::{AnswerArguments, say, writable};
use super::usage_error::{Idle, UsageError};
use super::{CliError, CliResult, Outcome};
use crate::control::design::pid_by_margins;
use crate::control::{Beta, BetaRule, ControllerConfig, ControllerKind, EmcConfig};
use crate::effect::{Site, Term, acting_as};
use crate::model::Model;
use crate::report::design::{self, Design};
use crate::session::ControlLoop;

/// Arguments of `design`. What is not given here comes from the bench file.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// Model file, or `paper` for the built-in Tables I and IV; default: the bench's
    #[arg(long, value_name = "M")]
    model: Option<PathBuf>,
    /// Control period T_c [s]
    #[arg(long, value_name = "S")]
    period_s: Option<f64>,
    /// Which controller: emc or pid
    #[arg(long, value_enum)]
    controller: Option<Kind>,
    /// β: zoh (1 - exp(-p T_c)), euler (p T_c), or a number
    #[arg(long, value_name = "B", value_parser = parse_beta)]
    beta: Option<Beta>,
    /// γ_0, the fastest complementary eigenvalue; default: β
    #[arg(long, value_name = "G")]
    gamma_0: Option<f64>,
    /// α spreads the predictor's eigenvalues
    #[arg(long, value_name = "A")]
    alpha: Option<f64>,
    /// α_c spreads the feedback's eigenvalues
    #[arg(long, value_name = "A")]
    alpha_c: Option<f64>,
    /// K as given in place of the pole placement, such as 0.276,0.120,0.052
    #[arg(long, value_name = "K1,K2,K3", value_parser = parse_numbers::<3>, allow_hyphen_values = true)]
    feedback_gain: Option<[f64; 3]>,
    /// A PID with exactly this phase margin [degrees] and at least this gain margin [factor], such as 55,2.5: of all such
    /// the one that rejects a constant torque best
    #[arg(long, value_name = "DEG,FACTOR", value_parser = parse_numbers::<2>, allow_hyphen_values = true)]
    pid_margins: Option<[f64; 2]>,
    /// Measured transport delay from the controller's step to the actuator [ms], besides the model's own
    #[arg(long, value_name = "MS", default_value_t = 0.0)]
    delay_ms: f64,
    /// Angle at which the model's effects are linearized [degrees]; default: 0
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    angle_deg: Option<f64>,
    #[command(flatten)]
    answer: AnswerArguments,
}

/// Controllers by name.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Kind {
    Emc,
    Pid,
}

fn parse_beta(text: &str) -> Result<Beta, String> {
    match text {
        "zoh" => Ok(Beta::Rule(BetaRule::ZeroOrderHold)),
        "euler" => Ok(Beta::Rule(BetaRule::Euler)),
        number => {
            number.parse().map(Beta::Value).map_err(|_| "must be `zoh`, `euler` or a number".to_owned())
        }
    }
}

/// No gain and no margin is higher.
const HIGHEST_NUMBER: f64 = 1e6;

fn parse_numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let wrong = || format!("must be {N} numbers with commas between them");
    let numbers: [f64; N] = numbers.map_err(|_| wrong())?.try_into().map_err(|_| wrong())?;
    if numbers.iter().all(|number| number.abs() <= HIGHEST_NUMBER) { Ok(numbers) } else { Err(wrong()) }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let (task, note) = arguments.task()?;
    let made = task.design()?;
    let design = Design::of(&task, &made, note);
    if let Some(path) = &arguments.answer.report {
        design::page(&design, made.closed.as_ref().map(|closed| &closed.response)).save(path)?;
    }
    say(arguments.answer.json, &design, || design::text(&design))?;
    Ok(if design.stable { Outcome::Done } else { Outcome::FoundWanting })
}

impl Arguments {
    /// The bench file with what the command line says instead, and what to note.
    fn task(&self) -> Result<(ControlLoop, Option<String>), CliError> {
        let mut bench = self.bench.load()?;
        bench.period_s = self.period_s.unwrap_or(bench.period_s);
        bench.check()?;
        let angle_deg = self.angle_deg.unwrap_or(0.0);
        if !(-180.0..=180.0).contains(&angle_deg) {
            return Err(UsageError::Range {
                option: "--angle-deg",
                value: angle_deg,
                low: -180.0,
                high: 180.0,
            }
            .into());
        }
        let path = self.model.clone().unwrap_or_else(|| PathBuf::from(&bench.model));
        writable(&self.answer.report, self.bench.config.iter().chain([&path]), self.answer.force)?;
        let model = Model::load(Path::new(&path))?;
        let made = ControlLoop::of(&model, bench.controller.clone(), bench.period_s, angle_deg.to_radians());
        let mut task = made.map_err(|error| match &self.model {
            Some(path) => CliError::from(error).of_option("--model", path.display()),
            None => error.into(),
        })?;
        let config = &mut task.config;
        let of_bench = config.kind;
        config.kind = match self.controller {
            Some(Kind::Emc) => ControllerKind::Emc,
            Some(Kind::Pid) => ControllerKind::Pid,
            None if self.pid_margins.is_some() => ControllerKind::Pid,
            None => config.kind,
        };
        self.refuse_idle(config)?;
        // Of all torques on the body the pendulum's alone has another slope at another angle.
        if self.angle_deg.is_some() && task.known.pendulum_moment == 0.0 {
            let effect = acting_as(Site::Torque, Term::Pendulum).map_or("", |card| card.id);
            return Err(
                UsageError::idle("--angle-deg", Idle::SameAtAllAngles { model: model.name, effect }).into()
            );
        }
        self.set_emc(&mut config.emc);
        task.loop_plant.delay_s += 1e-3 * self.delay_ms;
        self.set_pid(&mut task)?;
        let is_other = self.controller.is_none() && task.config.kind != of_bench;
        Ok((task, is_other.then(design::pid_on_an_emc_bench)))
    }

    fn set_emc(&self, emc: &mut EmcConfig) {
        emc.beta = self.beta.unwrap_or(emc.beta);
        emc.gamma_0 = self.gamma_0.or(emc.gamma_0);
        emc.alpha = self.alpha.unwrap_or(emc.alpha);
        emc.alpha_c = self.alpha_c.unwrap_or(emc.alpha_c);
        emc.feedback_gain = self.feedback_gain.or(emc.feedback_gain);
    }

    /// Lays the PID out by its margins, where some are asked for.
    fn set_pid(&self, task: &mut ControlLoop) -> Result<(), CliError> {
        let Some([phase_deg, gain]) = self.pid_margins else { return Ok(()) };
        if !(phase_deg > 0.0 && (..180.0).contains(&phase_deg) && gain >= 1.0) {
            return Err(UsageError::Margins { phase_deg, gain }.into());
        }
        task.config.pid =
            pid_by_margins(&task.plant, &task.loop_plant, task.period_s, phase_deg.to_radians(), gain)?;
        Ok(())
    }

    /// Refuses what would do nothing for the controller of `config`.
    fn refuse_idle(&self, config: &ControllerConfig) -> Result<(), UsageError> {
        let refuse = |option: &str, reason| Err(UsageError::idle(option, reason));
        if config.kind == ControllerKind::Emc {
            if self.pid_margins.is_some() {
                return refuse("--pid-margins", Idle::OfPid);
            }
            let placed = self.feedback_gain.is_none() && config.emc.feedback_gain.is_none();
            if self.alpha_c.is_some() && !placed {
                return refuse("--alpha-c", Idle::GainIsGiven);
            }
            return Ok(());
        }
        let of_emc = [
            ("--beta", self.beta.is_some()),
            ("--gamma-0", self.gamma_0.is_some()),
            ("--alpha", self.alpha.is_some()),
            ("--alpha-c", self.alpha_c.is_some()),
            ("--feedback-gain", self.feedback_gain.is_some()),
        ];
        of_emc.iter().find(|(_, given)| *given).map_or(Ok(()), |(option, _)| refuse(option, Idle::OfEmc))
    }
}
