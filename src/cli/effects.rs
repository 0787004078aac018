//! `rotorbench effects`: the catalogue of physical effects, or one card.

use std::path::PathBuf;

use serde::Serialize;

use super::usage_error::UsageError;
use super::{CliError, CliResult, Outcome, output};
use crate::effect::{CATALOGUE, Card, Site, find};
use crate::model::{Model, UserEffect};
use crate::report;
use crate::session;

/// Arguments of `effects`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Show the card of this effect
    id: Option<String>,
    /// Model file, whose own effects are listed too
    #[arg(long, default_value = "paper")]
    model: PathBuf,
    /// Instead: print a model file to begin with, the paper's model with an effect of one's own beside it
    #[arg(long, conflicts_with_all = ["id", "json", "model"])]
    template: bool,
    /// Answer as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// An effect of one's own, as docs/guide/diagnose.md has it.
const OWN: &str = r#"[[user_effects]]
id = "creaking_pivot"
site = "torque"            # command, steady_rate, rotor_acceleration, thrust, torque, body_rate_sensor, rotor_rate_sensor
expression = "-k*body_rate*abs(body_rate)^0.5"     # what it ADDS to the site's quantity
[[user_effects.parameters]]
name = "k"
unit = "N m"
start = 0.01
lower = 0.0
upper = 1.0
"#;

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    if arguments.template {
        print!("{}\n{OWN}", Model::paper().emit()?);
        return Ok(Outcome::Done);
    }
    let model = session::open_model(&arguments.model)?;
    let Some(id) = &arguments.id else {
        let own = model.user_effects.iter().map(EffectAnswer::of_own);
        let cards: Vec<EffectAnswer> =
            CATALOGUE.iter().map(|card| EffectAnswer::of(card)).chain(own).collect();
        output::say(arguments.json, &cards, || report::effects::list(&model))?;
        return Ok(Outcome::Done);
    };
    let Some(card) = find(id) else {
        let own = model.user_effects.iter().find(|user| user.id == *id);
        let own = own.ok_or_else(|| {
            model
                .effect(id)
                .err()
                .map_or_else(|| UsageError::UnknownEffect { id: id.clone() }.into(), CliError::from)
        })?;
        output::say(arguments.json, &EffectAnswer::of_own(own), || report::effects::own_card(own))?;
        return Ok(Outcome::Done);
    };
    output::say(arguments.json, &EffectAnswer::of(card), || report::effects::card(card))?;
    Ok(Outcome::Done)
}

/// A card, as `--json` writes it; of a law of one's own what its model file does not say is empty.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
pub(super) struct EffectAnswer<'a> {
    /// Name in files.
    id: &'a str,
    /// One line.
    meaning: &'a str,
    /// The law, in the paper's symbols.
    equation: &'a str,
    /// Where the law is from.
    source: &'a str,
    /// Where it acts.
    site: Site,
    /// Its parameters, in the order of the law.
    parameters: Vec<ParameterAnswer<'a>>,
    /// Log columns it cannot be judged without (`*` stands for the rotor).
    needs: &'a [&'a str],
    /// Two plain sentences.
    report: [&'a str; 2],
    /// How it shows in the residual.
    residual: &'a str,
    /// Ids of what it is confused with.
    confused_with: &'a [&'a str],
    /// Which experiment excites it, or tells it from those.
    experiment: &'a str,
}

/// A parameter of a card.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
struct ParameterAnswer<'a> {
    /// Name in files.
    name: &'a str,
    /// Symbol in the equation.
    symbol: &'a str,
    /// SI unit.
    unit: &'a str,
    /// Smallest value a fit may take, in the unit.
    lower: f64,
    /// Largest value a fit may take.
    upper: f64,
    /// Where a fit starts.
    start: f64,
    /// What it is.
    meaning: &'a str,
}

impl<'a> EffectAnswer<'a> {
    fn of(card: &'a Card) -> Self {
        let parameters = card.parameters.iter().map(|it| ParameterAnswer {
            name: it.name,
            symbol: it.symbol,
            unit: it.unit,
            lower: it.lower,
            upper: it.upper,
            start: it.start,
            meaning: it.meaning,
        });
        Self {
            id: card.id,
            meaning: card.meaning,
            equation: card.equation,
            source: card.source,
            site: card.site,
            parameters: parameters.collect(),
            needs: card.needs,
            report: card.report,
            residual: card.residual,
            confused_with: card.confused_with,
            experiment: card.experiment,
        }
    }

    /// A law of one's own, with what its model file says of it.
    fn of_own(own: &'a UserEffect) -> Self {
        let parameters = own.parameters.iter().map(|it| ParameterAnswer {
            name: &it.name,
            symbol: &it.name,
            unit: &it.unit,
            lower: it.lower,
            upper: it.upper,
            start: it.start,
            meaning: "",
        });
        Self {
            id: &own.id,
            meaning: &own.meaning,
            equation: &own.expression,
            source: "",
            site: own.site,
            parameters: parameters.collect(),
            needs: &[],
            report: ["", ""],
            residual: "",
            confused_with: &[],
            experiment: "",
        }
    }
}
