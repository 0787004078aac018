//! One case: what is hidden, the two logs, and the truth beside them.

use std::path::Path;
use std::{fs, io};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Map, Value, json};

use crate::answer::WITHOUT_MODEL;
use crate::catalogue::{ENTRIES, Entry, Kind, SAG};
use crate::experiment::{Truth, actuator, attitude};
use crate::laws::Family;
use crate::noise::{Flaw, Noise};
use crate::outside::{OUTSIDE_ACTUATOR, OUTSIDE_ATTITUDE, outside};
use crate::plant::{Base, Hidden, Outside};
use crate::score::{BESIDE, NOTHING_BUT, OWN_BASE};
use crate::strength::{ROUNDS, Rest, without};

/// What a case is about.
#[derive(Clone)]
pub enum Question {
    Nothing(Kind),
    Single(&'static Entry, Kind),
    Pair(&'static Entry, &'static Entry, Kind),
    Three([&'static Entry; 3], Kind),
    /// A parameter of the base: its name, and the bench.
    Changed(&'static str, Kind),
    /// A law outside the catalogue, by number.
    Outside(usize, Kind),
    /// A law with a formula, and its strength [-] from the weakest to the strongest.
    Law(&'static Family, f64),
    /// A strong effect, and a small one that nobody asks about.
    Blurred(&'static Entry, Small, Kind),
    /// Another question, of logs in which the battery is read in coarse steps, as speed controllers send it.
    Coarse(Box<Question>),
    /// Nothing is missing, and the sensors' noise is not white: which flaw in turn, and the bench.
    Flawed(u64, Kind),
    /// Another question, of a bench whose motors, propellers and body nobody gave numbers of: the program identifies its base.
    OwnBase(Box<Question>),
    /// Another question, of a bench of other numbers, which the model has; and which flaw in turn, where its log is as poor as
    /// telemetry is.
    OtherBench(Box<Question>, Option<u64>),
}

/// What is too small to be named, and moves the numbers of what is.
#[derive(Clone)]
pub enum Small {
    Effect(&'static Entry),
    /// A law outside the catalogue, by number.
    Outside(usize),
}

/// Parameters of the base that a case may change, as the diagnosis calls them.
pub const CHANGES: &[(&str, Kind)] = &[
    ("inertia", Kind::Attitude),
    ("thrust_coefficient", Kind::Attitude),
    ("pole", Kind::Actuator),
    ("pole", Kind::Attitude),
    ("voltage_gain", Kind::Actuator),
    ("steady_rate_quadratic", Kind::Actuator),
    ("steady_rate_linear", Kind::Actuator),
];

/// Base parameters that a case with an effect leaves as they are, most of the time: a bench whose inertia is
/// not the drawing's and that has friction as well is still a bench with friction.
const BASE_CHANGED_AS_WELL: f64 = 0.15;

/// The paper's model as its numbers are printed, without the battery's part.
const WITHOUT_BATTERY: &str = r#"name = "without the battery"

[actuator]
steady_rate = [0.0, 1124.5, 447.1]
voltage_gain = 0.0
full_voltage = 12.6
pole = 16.0
thrust_coefficient = 1.596526e-5
hover_rate = 616.964467

[body]
inertia = 0.032
arm = 0.25
"#;

/// Error over the noise floor below which an effect is drawn again.
const BARELY_VISIBLE: f64 = 1.03;

/// A made case.
pub struct Case {
    pub train: Truth,
    pub validate: Truth,
    pub noise: Noise,
    pub truth: Value,
    /// The model that is asked about, where it is not the paper's.
    model: Option<String>,
    /// The program is asked for the base, too.
    is_own_base: bool,
}

fn change(base: &mut Base, name: &str, factor: f64) {
    match name {
        "inertia" => base.inertia *= factor,
        "thrust_coefficient" => base.thrust *= factor,
        "pole" => base.pole *= factor,
        "voltage_gain" => base.voltage_gain *= factor,
        "steady_rate_quadratic" => base.steady[0] *= factor,
        "steady_rate_linear" => base.steady[1] *= factor,
        other => unreachable!("no base parameter is called {other}"),
    }
}

impl Question {
    pub fn kind(&self) -> Kind {
        match self {
            Self::Nothing(kind)
            | Self::Flawed(_, kind)
            | Self::Single(_, kind)
            | Self::Pair(_, _, kind)
            | Self::Three(_, kind)
            | Self::Changed(_, kind)
            | Self::Outside(_, kind)
            | Self::Blurred(_, _, kind) => *kind,
            Self::Law(family, _) => family.kind,
            Self::Coarse(question) | Self::OwnBase(question) | Self::OtherBench(question, _) => {
                question.kind()
            }
        }
    }

    /// All singles on every bench where they show, in the catalogue's order.
    pub fn singles() -> Vec<Self> {
        let benches = [Kind::Actuator, Kind::Attitude];
        ENTRIES
            .iter()
            .flat_map(|entry| benches.map(|kind| (entry, kind)))
            .filter(|(entry, kind)| entry.shows_on(*kind))
            .map(|(entry, kind)| Self::Single(entry, kind))
            .collect()
    }

    /// The effect that the paper's model has already, on both benches.
    pub fn sags() -> [Self; 2] {
        [Kind::Actuator, Kind::Attitude].map(|kind| Self::Single(&SAG, kind))
    }

    /// The model that is asked about does not know of the battery.
    fn lacks_battery(&self) -> bool {
        matches!(self, Self::Single(entry, _) if entry.id == SAG.id)
    }

    /// A random pair of different effects that both show on one bench.
    pub fn pair(rng: &mut ChaCha8Rng) -> Self {
        let kind = if rng.random_bool(0.5) { Kind::Actuator } else { Kind::Attitude };
        // On the attitude bench at least one of the two is the body's own.
        let all: Vec<&'static Entry> = ENTRIES.iter().filter(|entry| entry.shows_on(kind)).collect();
        loop {
            let (a, b) = (all[rng.random_range(0..all.len())], all[rng.random_range(0..all.len())]);
            if a.id < b.id && (kind == Kind::Actuator || !a.actuator || !b.actuator) {
                return Self::Pair(a, b, kind);
            }
        }
    }

    /// Three random different effects in one block: of a rotor, or of the body.
    pub fn three(rng: &mut ChaCha8Rng) -> Self {
        let kind = if rng.random_bool(0.5) { Kind::Actuator } else { Kind::Attitude };
        let is_own = |entry: &&Entry| kind == Kind::Actuator || !entry.actuator;
        let all: Vec<&'static Entry> =
            ENTRIES.iter().filter(|entry| entry.shows_on(kind)).filter(is_own).collect();
        loop {
            let [a, b, c] = [0; 3].map(|_| all[rng.random_range(0..all.len())]);
            if a.id < b.id && b.id < c.id {
                return Self::Three([a, b, c], kind);
            }
        }
    }

    /// Nothing, a random effect or a random pair, in turns, beside a battery that is read in coarse steps.
    pub fn coarse(number: u64, rng: &mut ChaCha8Rng) -> Self {
        let kind = if rng.random_bool(0.5) { Kind::Actuator } else { Kind::Attitude };
        let singles = Self::singles();
        Self::Coarse(Box::new(match number % 3 {
            0 => Self::Nothing(kind),
            1 => singles[rng.random_range(0..singles.len())].clone(),
            _ => Self::pair(rng),
        }))
    }

    /// Of each six three random effects, two random pairs and nothing, on a bench of its own numbers.
    pub fn own_base(number: u64, rng: &mut ChaCha8Rng) -> Self {
        let singles = Self::singles();
        Self::OwnBase(Box::new(match number % 6 {
            0 | 2 | 4 => singles[rng.random_range(0..singles.len())].clone(),
            1 | 3 => Self::pair(rng),
            _ => Self::Nothing(if rng.random_bool(0.5) { Kind::Actuator } else { Kind::Attitude }),
        }))
    }

    /// Each flaw of the sensors in turn, on either bench.
    pub fn flawed(number: u64) -> Self {
        Self::Flawed(number / 2, if number.is_multiple_of(2) { Kind::Actuator } else { Kind::Attitude })
    }

    /// A random strong effect beside a small one: of the catalogue, or a law outside it.
    pub fn blurred(rng: &mut ChaCha8Rng) -> Self {
        let kind = if rng.random_bool(0.5) { Kind::Actuator } else { Kind::Attitude };
        let all: Vec<&'static Entry> = ENTRIES.iter().filter(|entry| entry.shows_on(kind)).collect();
        let strong = all[rng.random_range(0..all.len())];
        if rng.random_bool(0.5) {
            let laws = if kind == Kind::Actuator { OUTSIDE_ACTUATOR } else { OUTSIDE_ATTITUDE };
            return Self::Blurred(strong, Small::Outside(rng.random_range(0..laws)), kind);
        }
        let can_be_weak = |entry: &&&'static Entry| entry.id != strong.id && entry.weakens();
        let others: Vec<&&'static Entry> = all.iter().filter(can_be_weak).collect();
        Self::Blurred(strong, Small::Effect(others[rng.random_range(0..others.len())]), kind)
    }

    /// Makes the case of `seed`, drawing again where the loop left its bench or an effect cannot be seen.
    /// `None` where that goes on: two effects that do the same cannot be a pair.
    pub fn make(&self, seed: u64) -> Option<Case> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..25).find_map(|_| self.draw(&mut rng, seed))
    }

    fn draw(&self, rng: &mut ChaCha8Rng, seed: u64) -> Option<Case> {
        if let Self::Coarse(question) = self {
            let mut case = question.draw(rng, seed)?;
            // Of a clean reading of 4 mV, up to one that flickers over a step.
            case.noise.battery = rng.random_range(0.002..0.02);
            case.noise.steps_per_volt = if rng.random_bool(0.5) { 20.0 } else { 10.0 };
            case.truth["battery_step_v"] = json!(1.0 / case.noise.steps_per_volt);
            return Some(case);
        }
        if let Self::OwnBase(question) = self {
            let base = Base::draw(rng);
            let mut case = question.draw_on(base, rng, seed)?;
            case.truth[OWN_BASE] = json!({
                "steady_rate_quadratic": base.steady[0], "steady_rate_linear": base.steady[1],
                "voltage_gain": base.voltage_gain, "pole": base.pole, "inertia": base.inertia,
            });
            case.is_own_base = true;
            return Some(case);
        }
        if let Self::OtherBench(question, flaw) = self {
            let base = Base::draw(rng);
            let mut case = question.draw_on(base, rng, seed)?;
            if let Some(number) = flaw {
                case.noise.flaw = Flaw::poor(*number, rng);
                case.truth["flaw"] = json!(format!("{:?}", case.noise.flaw));
                if !case.is_seen_in(case.noise.flaw.noise_grows()) {
                    return None;
                }
            }
            case.model = Some(base.model("bench"));
            return Some(case);
        }
        let base = Base {
            voltage_gain: if self.lacks_battery() { 0.0 } else { Base::PAPER.voltage_gain },
            ..Base::PAPER
        };
        self.draw_on(base, rng, seed)
    }

    /// A case of a bench that has the numbers `base` where nothing of it is changed; its controller was made for them.
    fn draw_on(&self, as_designed: Base, rng: &mut ChaCha8Rng, seed: u64) -> Option<Case> {
        let kind = self.kind();
        let mut base = as_designed;
        let mut hidden = Hidden::nothing();
        let mut effects: Vec<(&'static Entry, Vec<f64>)> = Vec::new();
        let (mut named, mut flaw) = (Map::new(), Flaw::White);
        let effect = match self {
            Self::Nothing(_) => "none".to_owned(),
            Self::Flawed(number, _) => {
                flaw = Flaw::draw(*number, kind, rng);
                format!("{NOTHING_BUT}{}", flaw.name())
            }
            Self::Single(entry, _) => {
                effects.push((*entry, draw_parameters(entry, rng)));
                entry.id.to_owned()
            }
            Self::Pair(a, b, _) => {
                for entry in [a, b] {
                    effects.push((*entry, draw_parameters(entry, rng)));
                }
                format!("{}+{}", a.id, b.id)
            }
            Self::Three(entries, _) => {
                effects.extend(entries.map(|entry| (entry, draw_parameters(entry, rng))));
                entries.map(|entry| entry.id).join("+")
            }
            Self::Coarse(_) | Self::OwnBase(_) | Self::OtherBench(..) => return None,
            Self::Changed(name, _) => {
                let size = 0.06 * 8.0_f64.powf(rng.random::<f64>());
                let factor = if rng.random_bool(0.5) { 1.0 + size } else { 1.0 / (1.0 + size) };
                change(&mut base, name, factor);
                named.insert("ratio".to_owned(), json!(factor));
                format!("{name}_change")
            }
            Self::Outside(number, _) => {
                let (name, law) = outside(*number, kind, rng);
                if let Some(numbers) = law.numbers() {
                    named.insert("numbers".to_owned(), json!(numbers));
                }
                hidden.outside = law;
                named.insert("law".to_owned(), json!(name));
                "unknown".to_owned()
            }
            Self::Law(family, share) => {
                let numbers = family.draw(*share, rng);
                hidden.outside = Outside::Law(family, numbers);
                named.insert("law".to_owned(), json!(family.name));
                named.insert("numbers".to_owned(), json!(numbers));
                "unknown".to_owned()
            }
            Self::Blurred(entry, small, _) => {
                effects.push((*entry, draw_parameters(entry, rng)));
                match small {
                    Small::Effect(other) => {
                        let weak = other.parameters.iter().map(|(name, draw)| draw.weak(name, rng)).collect();
                        effects.push((*other, weak));
                    }
                    Small::Outside(number) => {
                        let (name, law) = outside(*number, kind, rng);
                        let factor = 0.05 * 10.0_f64.powf(rng.random::<f64>());
                        hidden.outside = law.scaled(factor);
                        named.insert("law".to_owned(), json!(name));
                    }
                }
                format!("{}{BESIDE}", entry.id)
            }
        };
        for (entry, values) in &effects {
            (entry.hide)(&mut hidden, values);
            for ((name, _), value) in entry.parameters.iter().zip(values) {
                let key = if effects.len() > 1 { format!("{}.{name}", entry.id) } else { (*name).to_owned() };
                named.insert(key, json!(value));
            }
        }
        let mut also = Map::new();
        if matches!(self, Self::Single(..) | Self::Pair(..) | Self::Three(..))
            && rng.random_bool(BASE_CHANGED_AS_WELL)
        {
            let name = if kind == Kind::Attitude { "inertia" } else { "pole" };
            let factor = rng.random_range(0.85..1.2);
            change(&mut base, name, factor);
            also.insert(name.to_owned(), json!(factor));
        }
        let spread = rng.random_range(0.6..1.6);
        let noise = Noise {
            rate: Noise::USUAL.rate * spread,
            gyro: Noise::USUAL.gyro * spread,
            angle: Noise::USUAL.angle * spread,
            flaw,
            ..Noise::USUAL
        };
        // A paper's controller is built on the paper's numbers, its k_V among them.
        let law = Base {
            voltage_gain: if self.lacks_battery() {
                Base::PAPER.voltage_gain
            } else {
                as_designed.voltage_gain
            },
            ..as_designed
        };
        let mut run = |validate| match kind {
            Kind::Actuator => actuator(&base, &hidden, rng, validate),
            Kind::Attitude => attitude((&base, &law), &hidden, rng, validate),
        };
        let (train, validate) = (run(false)?, run(true)?);
        let removal = self.removal(&train, &base, &effects, noise);
        // What nobody can see is not hidden but absent.
        if removal.values().filter_map(Value::as_f64).any(|ratio| ratio < BARELY_VISIBLE) {
            return None;
        }
        let truth = json!({
            "bench": kind.name(), "effect": effect, "parameters": named,
            "base_changed_as_well": also, "seed": seed, "removal": removal,
            "flaw": format!("{flaw:?}"), "noise": {"propeller_rate_rad_s": noise.rate, "body_rate_rad_s": noise.gyro, "body_angle_rad": noise.angle},
        });
        let model = self.lacks_battery().then(|| WITHOUT_BATTERY.to_owned());
        Some(Case { train, validate, noise, truth, model, is_own_base: false })
    }

    /// Error over the noise floor with each effect left out, by its name; with the base as printed, where a
    /// parameter of it has changed; with the base fitted, where the law is outside the catalogue.
    fn removal(
        &self,
        train: &Truth,
        base: &Base,
        effects: &[(&'static Entry, Vec<f64>)],
        noise: Noise,
    ) -> Map<String, Value> {
        let bare = |base: Base| Rest { effects: Vec::new(), base };
        let mut out = Map::new();
        if matches!(self, Self::Blurred(..)) {
            return out;
        }
        for left_out in effects {
            let rest = effects.iter().filter(|effect| effect.0.id != left_out.0.id).cloned().collect();
            let error = without(train, &Rest { effects: rest, base: *base }, noise, ROUNDS);
            out.insert(left_out.0.id.to_owned(), json!(error));
        }
        match self {
            Self::Changed(name, _) => {
                out.insert((*name).to_owned(), json!(without(train, &bare(Base::PAPER), noise, 0)));
            }
            Self::Outside(..) | Self::Law(..) => {
                out.insert("unknown".to_owned(), json!(without(train, &bare(*base), noise, ROUNDS)));
            }
            _ => {}
        }
        out
    }
}

fn draw_parameters(entry: &Entry, rng: &mut ChaCha8Rng) -> Vec<f64> {
    entry.parameters.iter().map(|(_, draw)| draw.take(rng)).collect()
}

impl Case {
    /// Puts what leaving an effect out costs in noise that is `times` as large, and says whether any can still be seen.
    fn is_seen_in(&mut self, times: f64) -> bool {
        let Some(removal) = self.truth["removal"].as_object_mut() else { return true };
        let mut ratios = removal.values_mut().filter_map(|ratio| Some((ratio.as_f64()?, ratio)));
        ratios.all(|(ratio, value)| {
            let grown = (1.0 + (ratio * ratio - 1.0) / (times * times)).sqrt();
            *value = json!(grown);
            grown >= BARELY_VISIBLE
        })
    }

    /// Writes `train.csv` and `validate.csv` into `folder`, `model.toml` where another model than the paper's is asked about, and an
    /// empty file where the program is to make the model itself.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        fs::create_dir_all(folder)?;
        if let Some(model) = &self.model {
            fs::write(folder.join("model.toml"), model)?;
        }
        if self.is_own_base {
            fs::write(folder.join(WITHOUT_MODEL), "")?;
        }
        let seed = self.truth["seed"].as_u64().unwrap_or_default();
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x006E_6F69_7365);
        fs::write(folder.join("train.csv"), self.train.csv(self.noise, &mut rng))?;
        fs::write(folder.join("validate.csv"), self.validate.csv(self.noise, &mut rng))
    }
}
