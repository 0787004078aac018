//! `rotorbench design`: eigenvalues, gains and margins from a model.

use std::path::{Path, PathBuf};

use nalgebra::Complex;

use super::operate::BenchArguments;
use super::output::{Force, say, writable};
use super::thresholds::THRESHOLDS;
use super::{CliError, CliResult, Outcome};
use crate::control::design::{Advice, Compensator, DiscreteLoop, LoopPlant, Margins, advise, pid_by_margins};
use crate::control::gains::{complementary_eigenvalues, feedback_matrix, predictor_matrix};
use crate::control::{
    Beta, BetaRule, Compensation, ControlError, ControllerConfig, ControllerKind, EmcConfig, EmcGains,
    PlantParameters,
};
use crate::effect::{Site, Term, acting_as};
use crate::model::Model;
use crate::report::design::{self, Design, Eigenvalue, EmcDesign};
use crate::runtime::controller_plant;
use crate::unit::short;

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
    force: Force,
    /// Write the design as JSON on standard output
    #[arg(long)]
    json: bool,
    /// Write a report with the loop's frequency response
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
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

/// What the design starts from.
struct Task {
    model: String,
    plant: PlantParameters,
    known: Compensation,
    loop_plant: LoopPlant,
    config: ControllerConfig,
    angle: f64,
    period_s: f64,
    note: Option<String>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let task = arguments.task()?;
    let mut design = Design {
        model: task.model.clone(),
        controller: task.config.kind,
        period_s: task.period_s,
        delay_s: task.loop_plant.delay_s,
        stable: false,
        refusal: None,
        emc: None,
        pid: None,
        closed_loop: Vec::new(),
        margins: None,
        note: task.note.clone(),
        warning: None,
        advice: None,
    };
    let closed = match task.close(&mut design) {
        Ok(closed) => Some(closed),
        Err(error @ (ControlError::Unstable { .. } | ControlError::Unreachable { .. })) => {
            design.refusal = Some(error.to_string());
            None
        }
        Err(error) => return Err(error.into()),
    };
    if let Some(path) = &arguments.report {
        design::page(&design, closed.as_ref()).save(path)?;
    }
    say(arguments.json, &design, || design::text(&design))?;
    Ok(if design.stable { Outcome::Done } else { Outcome::FoundWanting })
}

impl Arguments {
    /// The bench file with what the command line says instead.
    fn task(&self) -> Result<Task, CliError> {
        let mut bench = self.bench.load()?;
        bench.period_s = self.period_s.unwrap_or(bench.period_s);
        bench.check()?;
        let angle_deg = self.angle_deg.unwrap_or(0.0);
        if !(-180.0..=180.0).contains(&angle_deg) {
            let angle = short(angle_deg);
            return Err(CliError::new(format!("--angle-deg must lie in -180..180, not {angle}")));
        }
        let path = self.model.clone().unwrap_or_else(|| PathBuf::from(&bench.model));
        writable(&self.report, self.bench.config.iter().chain([&path]), self.force)?;
        let model = Model::load(Path::new(&path))?;
        let (plant, known) = controller_plant::of_model(&model)?;
        let mut config = bench.controller.clone();
        let of_bench = config.kind;
        config.kind = match self.controller {
            Some(Kind::Emc) => ControllerKind::Emc,
            Some(Kind::Pid) => ControllerKind::Pid,
            None if self.pid_margins.is_some() => ControllerKind::Pid,
            None => config.kind,
        };
        self.refuse_idle(&config)?;
        // Of all torques on the body the pendulum's alone has another slope at another angle.
        if self.angle_deg.is_some() && known.pendulum_moment == 0.0 {
            return Err(CliError::new(format!(
                "--angle-deg would do nothing: model `{}` has no effect whose slope depends on the angle ({})",
                model.name,
                acting_as(Site::Torque, Term::Pendulum).map_or("", |card| card.id)
            )));
        }
        let emc = &mut config.emc;
        emc.beta = self.beta.unwrap_or(emc.beta);
        emc.gamma_0 = self.gamma_0.or(emc.gamma_0);
        emc.alpha = self.alpha.unwrap_or(emc.alpha);
        emc.alpha_c = self.alpha_c.unwrap_or(emc.alpha_c);
        emc.feedback_gain = self.feedback_gain.or(emc.feedback_gain);
        let period_s = bench.period_s;
        let angle = angle_deg.to_radians();
        let mut loop_plant = controller_plant::loop_of_model(&model, &plant, &known, angle);
        loop_plant.delay_s += 1e-3 * self.delay_ms;
        if let Some([phase_deg, gain]) = self.pid_margins {
            if !(phase_deg > 0.0 && (..180.0).contains(&phase_deg) && gain >= 1.0) {
                return Err(CliError::new(
                    "--pid-margins needs degrees between 0 and 180 and a factor of at least 1",
                ));
            }
            config.pid = pid_by_margins(&plant, &loop_plant, period_s, phase_deg.to_radians(), gain)?;
        }
        let known = if config.compensate { known } else { Compensation::default() };
        let is_other = self.controller.is_none() && config.kind != of_bench;
        let note = is_other.then(design::pid_on_an_emc_bench);
        Ok(Task { model: model.name, plant, known, loop_plant, config, angle, period_s, note })
    }

    /// Refuses what would do nothing for the controller of `config`.
    fn refuse_idle(&self, config: &ControllerConfig) -> Result<(), CliError> {
        let refuse =
            |option: &str, why: &str| Err(CliError::new(format!("{option} would do nothing: {why}")));
        if config.kind == ControllerKind::Emc {
            if self.pid_margins.is_some() {
                return refuse("--pid-margins", "the controller is EMC; leave out --controller emc");
            }
            let placed = self.feedback_gain.is_none() && config.emc.feedback_gain.is_none();
            if self.alpha_c.is_some() && !placed {
                return refuse("--alpha-c", "the feedback gain is given, not placed by eigenvalues");
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
        of_emc.iter().find(|(_, given)| *given).map_or(Ok(()), |(option, _)| {
            refuse(option, "the controller is a PID, and this is a setting of EMC")
        })
    }
}

impl Task {
    /// Gains, closed loop, margins and advice, as far as they go.
    fn close(&self, design: &mut Design) -> Result<DiscreteLoop, ControlError> {
        let compensator = match self.config.kind {
            ControllerKind::Emc => {
                let gains = self.config.emc.gains(self.plant.pole, self.period_s)?;
                design.emc = Some(emc_design(&self.config.emc, &gains));
                Compensator::Emc(gains)
            }
            ControllerKind::Pid => {
                self.config.pid.validate()?;
                design.pid = Some(self.config.pid);
                Compensator::Pid(self.config.pid)
            }
        };
        let closed = self.closed(&compensator)?;
        let margins = closed.margins();
        design.stable = true;
        design.closed_loop = closed.eigenvalues().iter().map(Eigenvalue::from).collect();
        design.margins = Some(margins);
        design.warning = self.sluggish(&closed, &margins);
        if self.config.kind == ControllerKind::Emc {
            design.advice = self.advice(&margins).as_ref().map(design::advice);
        }
        Ok(closed)
    }

    fn closed(&self, compensator: &Compensator) -> Result<DiscreteLoop, ControlError> {
        let Self { plant, loop_plant, known, angle, period_s, .. } = self;
        DiscreteLoop::build(plant, loop_plant, compensator, known, *angle, *period_s)
    }

    /// Where a loop is stable and of no use.
    fn sluggish(&self, closed: &DiscreteLoop, margins: &Margins) -> Option<String> {
        let slowest = closed.eigenvalues().first()?.norm();
        let fades_s = -self.period_s / slowest.ln();
        let is_sluggish = fades_s > THRESHOLDS.sluggish_s;
        is_sluggish.then(|| design::sluggish(self.config.kind, (fades_s, slowest), margins))
    }

    fn advice(&self, margins: &Margins) -> Option<Advice> {
        advise(&self.config.emc, margins, self.plant.pole, self.period_s, |changed| {
            let gains = changed.gains(self.plant.pole, self.period_s).ok()?;
            Some(self.closed(&Compensator::Emc(gains)).ok()?.margins())
        })
    }
}

fn emc_design(config: &EmcConfig, gains: &EmcGains) -> EmcDesign {
    let gamma_0 = config.gamma_0.unwrap_or(gains.beta);
    let values = |eigenvalues: &[Complex<f64>]| eigenvalues.iter().map(Eigenvalue::from).collect();
    EmcDesign {
        beta: gains.beta,
        gamma: complementary_eigenvalues(gamma_0, config.alpha),
        gamma_c: complementary_eigenvalues(gamma_0, config.alpha_c),
        observer_gain: gains.l,
        feedback_gain: gains.k,
        predictor: values(predictor_matrix(gains.beta, gains.l).complex_eigenvalues().as_slice()),
        feedback: values(feedback_matrix(gains.beta, gains.k).complex_eigenvalues().as_slice()),
    }
}
