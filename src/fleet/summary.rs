//! What benches have in common, and which of them are unlike the others.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::{MEDIAN_OF_NORMAL, median, quantile};
use crate::screening::Finding;

/// What came of one bench.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct BenchRow {
    /// Its name.
    pub bench: String,
    /// File of its answer, in the folder of answers.
    pub file: String,
    /// Page with its whole story, in the same folder; `null` where none was written.
    pub page: Option<String>,
    /// Why there is no diagnosis; `null` where there is one.
    pub error: Option<String>,
    /// Verdict as `diagnose --json` has it; empty without a diagnosis.
    pub verdict: String,
    /// Effects that are missing.
    pub effects: Vec<String>,
    /// Effects that its model has already.
    pub in_model: Vec<String>,
    /// Sets that the data cannot tell from it.
    pub alternatives: Vec<Vec<String>>,
    /// Value and unit of each parameter of the effects, and of each of the model's that has changed.
    #[serde(serialize_with = "values")]
    #[cfg_attr(test, schemars(with = "BTreeMap<String, Value>"))]
    pub parameters: BTreeMap<String, (f64, String)>,
    /// What the errors are, with unit.
    pub measure: String,
    /// What sensor noise alone would leave, in the unit of the measure.
    pub noise_floor: Option<f64>,
    /// Error of the model as it is, on held-out data.
    pub base: Option<f64>,
    /// Error of the model with its own parameters refitted.
    #[serde(rename = "recalibrated")]
    pub refitted: Option<f64>,
    /// Error of the model with the missing effects.
    pub extended: Option<f64>,
}

#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
struct Value<'a> {
    /// In `unit`.
    value: f64,
    /// SI unit.
    unit: &'a str,
}

fn values<S: Serializer>(parameters: &BTreeMap<String, (f64, String)>, to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(parameters.iter().map(|(name, (value, unit))| (name, Value { value: *value, unit })))
}

/// In how many benches a verdict was reached.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictCount {
    /// As `diagnose --json` has it.
    pub verdict: String,
    /// Count.
    pub benches: usize,
}

/// In how many benches an effect is missing.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectCount {
    /// Id.
    pub effect: String,
    /// Count.
    pub benches: usize,
    /// [-] of those that were diagnosed.
    pub share: f64,
    /// Count of those whose model has it already.
    pub in_models: usize,
}

/// How the values of a parameter are spread over the benches that have it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterSpread {
    /// Name.
    pub parameter: String,
    /// SI unit of the values.
    pub unit: String,
    /// Count.
    pub benches: usize,
    /// Least value.
    pub least: f64,
    /// A quarter of the benches has less.
    pub lower_quartile: f64,
    /// Half of the benches has less.
    pub median: f64,
    /// A quarter of the benches has more.
    pub upper_quartile: f64,
    /// Greatest value.
    pub greatest: f64,
}

/// Many benches.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fleet {
    /// A row for each answer, by the name of the bench.
    pub benches: Vec<BenchRow>,
    /// Benches of the plan without an answer.
    pub missing: Vec<String>,
    /// Benches with an answer that says why there is no diagnosis.
    pub failed: usize,
    /// Verdicts, the most frequent first.
    pub verdicts: Vec<VerdictCount>,
    /// Effects, the most frequent first.
    pub effects: Vec<EffectCount>,
    /// Parameters, by name.
    pub parameters: Vec<ParameterSpread>,
    /// Benches that are unlike the others, and what to know of the answers.
    pub findings: Vec<Finding>,
}

impl Fleet {
    /// Puts rows together; `rows` are in their order.
    pub(super) fn of(rows: Vec<BenchRow>, missing: Vec<String>, notes: Vec<Finding>) -> Self {
        let diagnosed: Vec<&BenchRow> = rows.iter().filter(|row| row.error.is_none()).collect();
        let verdicts = counted(diagnosed.iter().map(|row| row.verdict.as_str()));
        let named = || diagnosed.iter().flat_map(|row| &row.effects).map(String::as_str);
        let mut effects = counted(named());
        // What every model has, and none lacks, stands below what is missing.
        let in_models = counted(diagnosed.iter().flat_map(|row| &row.in_model).map(String::as_str));
        let known = in_models.iter().filter(|(effect, _)| named().all(|it| it != effect));
        effects.extend(known.map(|(effect, _)| (effect.clone(), 0)).collect::<Vec<_>>());
        let spreads = spreads(&diagnosed);
        let mut findings = notes;
        if diagnosed.len() >= THRESHOLDS.fewest_benches {
            findings.extend(unlike_in_effects(&diagnosed, &effects));
            findings.extend(unlike_in_parameters(&diagnosed));
        }
        let share = |benches: usize| benches as f64 / diagnosed.len().max(1) as f64;
        let effects = effects.into_iter().map(|(effect, benches)| EffectCount {
            benches,
            share: share(benches),
            in_models: in_models.iter().find(|(name, _)| *name == effect).map_or(0, |(_, benches)| *benches),
            effect,
        });
        Self {
            missing,
            failed: rows.len() - diagnosed.len(),
            verdicts: verdicts
                .into_iter()
                .map(|(verdict, benches)| VerdictCount { verdict, benches })
                .collect(),
            effects: effects.collect(),
            parameters: spreads,
            findings,
            benches: rows,
        }
    }

    /// Whether every bench of the plan has a diagnosis.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.missing.is_empty() && self.failed == 0
    }
}

/// How often each name stands there, the most frequent first, then by name.
fn counted<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(String, usize)> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    names.for_each(|name| *counts.entry(name).or_default() += 1);
    let mut counts: Vec<(String, usize)> =
        counts.into_iter().map(|(name, count)| (name.to_owned(), count)).collect();
    counts.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    counts
}

/// For each parameter and unit the benches that have it, and its values.
fn by_parameter<'a>(rows: &[&'a BenchRow]) -> BTreeMap<(&'a str, &'a str), Vec<(&'a BenchRow, f64)>> {
    let mut all: BTreeMap<_, Vec<(&BenchRow, f64)>> = BTreeMap::new();
    for row in rows {
        for (name, (value, unit)) in &row.parameters {
            all.entry((name.as_str(), unit.as_str())).or_default().push((row, *value));
        }
    }
    all
}

fn spreads(rows: &[&BenchRow]) -> Vec<ParameterSpread> {
    let spread = |((parameter, unit), values): ((&str, &str), Vec<(&BenchRow, f64)>)| {
        let at = |share| quantile(values.iter().map(|(_, value)| *value), share);
        Some(ParameterSpread {
            parameter: parameter.to_owned(),
            unit: unit.to_owned(),
            benches: values.len(),
            least: at(0.0)?,
            lower_quartile: at(0.25)?,
            median: at(0.5)?,
            upper_quartile: at(0.75)?,
            greatest: at(1.0)?,
        })
    };
    by_parameter(rows).into_iter().filter_map(spread).collect()
}

/// Benches without an effect that is usual, and with one that hardly any other has.
fn unlike_in_effects(rows: &[&BenchRow], effects: &[(String, usize)]) -> Vec<Finding> {
    let usual = THRESHOLDS.usual_share * rows.len() as f64;
    let rare = rows.len() as f64 - usual;
    let mut found = Vec::new();
    for (effect, _) in effects.iter().filter(|(_, named)| *named > 0) {
        // A bench whose model has the effect has it.
        let has_it = |row: &&&BenchRow| row.effects.contains(effect) || row.in_model.contains(effect);
        let benches = rows.iter().filter(has_it).count();
        let count = benches as f64;
        let (code, has) = match count {
            _ if count >= usual => ("lacks_usual_effect", false),
            _ if count <= rare => ("has_rare_effect", true),
            _ => continue,
        };
        let which = rows.iter().filter(|row| has_it(row) == has);
        found.extend(which.map(|row| {
            Finding::new(code, effect.as_str()).of(&row.bench).with("benches", benches).with("of", rows.len())
        }));
    }
    found
}

/// Benches whose parameter is far from where the others' are.
fn unlike_in_parameters(rows: &[&BenchRow]) -> Vec<Finding> {
    let mut found = Vec::new();
    for ((parameter, unit), values) in by_parameter(rows) {
        if values.len() < THRESHOLDS.fewest_benches {
            continue;
        }
        let Some(middle) = median(values.iter().map(|(_, value)| *value)) else { continue };
        let Some(spread) = median(values.iter().map(|(_, value)| (value - middle).abs())) else { continue };
        let limit = (THRESHOLDS.unlike_deviations * spread / MEDIAN_OF_NORMAL)
            .max(THRESHOLDS.least_deviation_share * middle.abs());
        for (row, value) in values.iter().filter(|(_, value)| (value - middle).abs() > limit) {
            let finding = Finding::new("parameter_unlike_others", parameter).of(&row.bench);
            found.push(finding.with("value", *value).with("median", middle).with("unit", unit));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(number: usize, effects: &[&str], gain: f64) -> BenchRow {
        BenchRow {
            bench: format!("bench-{number:02}"),
            verdict: if effects.is_empty() { "adequate" } else { "missing_effect" }.to_owned(),
            effects: effects.iter().map(|&effect| effect.to_owned()).collect(),
            parameters: [("heat.gain".to_owned(), (gain, "-".to_owned()))].into(),
            ..BenchRow::default()
        }
    }

    #[test]
    fn benches_that_differ_are_found() {
        let mut rows: Vec<BenchRow> =
            (0..20).map(|at| row(at, &["heat"], 1.0 + 0.01 * f64::from(at as u32 % 5))).collect();
        rows[3].effects.clear();
        rows[5].effects.push("friction".to_owned());
        rows[7].parameters.insert("heat.gain".to_owned(), (1.5, "-".to_owned()));
        rows[9].error = Some("no log".to_owned());
        let fleet = Fleet::of(rows, vec!["bench-20".to_owned()], Vec::new());
        let found: Vec<(&str, &str, &str)> =
            fleet.findings.iter().map(|it| (it.code, it.log.as_str(), it.subject.as_str())).collect();
        assert_eq!(
            found,
            [
                ("lacks_usual_effect", "bench-03", "heat"),
                ("has_rare_effect", "bench-05", "friction"),
                ("parameter_unlike_others", "bench-07", "heat.gain"),
            ]
        );
        assert_eq!((fleet.failed, fleet.is_whole()), (1, false));
        assert_eq!((fleet.effects[0].benches, fleet.effects[1].benches), (18, 1));
        assert!(
            (fleet.parameters[0].median - 1.02).abs() < 1e-12,
            "of 19 values, three or four of each step"
        );
    }

    #[test]
    fn a_bench_whose_model_has_an_effect_is_not_unlike_those_that_miss_it() {
        let mut rows: Vec<BenchRow> = (0..10).map(|at| row(at, &["heat"], 1.0)).collect();
        rows[3].effects.clear();
        rows[3].in_model = vec!["heat".to_owned(), "delay".to_owned()];
        let fleet = Fleet::of(rows, Vec::new(), Vec::new());
        assert_eq!(fleet.findings, []);
        let counts: Vec<(&str, usize, usize)> =
            fleet.effects.iter().map(|it| (it.effect.as_str(), it.benches, it.in_models)).collect();
        assert_eq!(counts, [("heat", 9, 1), ("delay", 0, 1)]);
    }

    #[test]
    fn of_few_benches_none_is_unlike() {
        let rows =
            (0..4).map(|at| row(at, if at == 0 { &[] } else { &["heat"] }, 10.0 * at as f64)).collect();
        assert_eq!(Fleet::of(rows, Vec::new(), Vec::new()).findings, []);
    }
}
