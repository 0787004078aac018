//! The report of `identify`: the tables of section III, its figures, and what the reader must know.

mod first_line;
mod plots;

use plots::body_plots;
pub(super) use plots::error_plots;

use super::{Mark, Page, TextTable, number};
use crate::effect::{self, Site, Term};
use crate::identify::{DegreeScore, Estimate, Identification, IdentifiedBody, Validation};
use crate::report::findings::{driven_by, outcome, sentence, step};
use crate::report::json::with_sentences;
use crate::report::notes::{self, Detail, Note};
use crate::screening::{DrivenBy, Finding};

/// Value and 95 % interval as cells of a row.
fn cells(name: &str, estimate: Estimate, unit: &str, from: &str) -> [String; 6] {
    let reach = 1.96 * estimate.standard_error;
    [
        name.to_owned(),
        number(estimate.value, 6),
        number(estimate.standard_error, 2),
        format!("{} to {}", number(estimate.value - reach, 6), number(estimate.value + reach, 6)),
        unit.to_owned(),
        from.to_owned(),
    ]
}

const SYMBOLS: [&str; 4] = ["c_g2 (linear)", "c_g1 (quadratic)", "c_g3 (cubic)", "c_g4 (quartic)"];

/// Four digits; a share of a rate that stands is none.
fn finite_or_dash(value: f64) -> String {
    if value.is_finite() { number(value, 4) } else { "-".to_owned() }
}

impl Identification {
    /// Everything identified, with standard errors, as one table.
    #[must_use]
    pub fn parameter_table(&self) -> TextTable {
        let mut table =
            TextTable::new(["parameter", "value", "standard error", "95 % interval", "unit", "from"])
                .caption("Identified");
        table = self
            .gains()
            .into_iter()
            .fold(table, |table, (gain, from)| table.row(cells("k_V", gain, "rad/(s V)", from)));
        if let Some(curve) = &self.static_curve {
            let from = if curve.from_ramps { "ramps, Eq. (9)" } else { "constant levels, Eq. (9)" };
            for (estimate, name) in curve.coefficients.iter().zip(SYMBOLS) {
                table = table.row(cells(name, *estimate, "rad/s", from));
            }
        }
        table = self.pole_rows().into_iter().chain(self.joint_rows()).fold(table, TextTable::row);
        if let Some(thrust) = &self.thrust {
            table = table.row(cells("c", thrust.coefficient, "N s²/rad²", "measured thrust"));
            let tangent = format!("tangent at {} rad/s, Eq. (13)", number(thrust.hover_rate, 4));
            table = table.row(cells("c_p1", thrust.slope, "N s/rad", &tangent));
            table = table.row(cells("c_p0", thrust.offset, "N", &tangent));
        }
        if let Some(body) = &self.body {
            table = Self::inertia_rows(body).into_iter().fold(table, TextTable::row);
            table = table.row(cells("bias", body.bias, "rad/s²", "constant acceleration, fitted beside"));
        }
        table
    }

    /// J, and where rotors drive the body what it is with the arm: from a commanded torque only torque / J shows.
    fn inertia_rows(body: &IdentifiedBody) -> Vec<[String; 6]> {
        let driven = driven_by(body.driven_by);
        if body.driven_by == DrivenBy::TorqueCommand.code() {
            let from = format!("{driven}, taken for N m");
            return vec![cells("J", body.inertia, "kg m²", &from)];
        }
        let with_arm = format!("with the arm d = {} m", number(body.arm, 4));
        vec![
            cells("d/J", body.arm_over_inertia, "1/(kg m)", driven),
            cells("J", body.inertia, "kg m²", &with_arm),
        ]
    }

    /// The pole from z, with the delay beside it.
    fn pole_rows(&self) -> Vec<[String; 6]> {
        let mut rows = Vec::new();
        if let Some(pole) = &self.pole {
            let id = effect::acting_as(Site::Command, Term::DeadTime).map_or("", |card| card.id);
            let (from, beside) = if pole.pole.value == self.actuator.pole {
                ("exciting commands, section III.B", format!("beside p, in the model as `{id}`"))
            } else {
                ("exciting commands, section III.B, k_V and g(u) held for exact", "beside that p".to_owned())
            };
            rows.push(cells("p", pole.pole, "rad/s", from));
            let taken = pole.delay.as_ref().map(|it| it.delay.scaled(1e3));
            rows.extend(taken.map(|delay| cells("delay", delay, "ms", &beside)));
            rows.push(cells("gain from z", pole.gain, "-", "beside p: 1 when g(u) holds in motion"));
        }
        rows
    }

    /// What the joint estimation found.
    fn joint_rows(&self) -> Vec<[String; 6]> {
        let mut rows = Vec::new();
        if let Some(joint) = &self.joint {
            // Where the paper's steps could be gone, too, the model has their numbers but for the more certain k_V.
            let alone = self.static_curve.is_none();
            let from =
                |used: bool| if alone || used { "joint estimation" } else { "joint estimation, as a check" };
            for (estimate, name) in joint.coefficients.iter().zip(SYMBOLS) {
                rows.push(cells(name, *estimate, "rad/s", from(false)));
            }
            // Where constant commands have one, too, both stand at the top.
            if let Some(gain) = joint.voltage_gain.filter(|_| self.battery.is_none()) {
                let is_used = gain.value == self.actuator.voltage_gain;
                let from = if is_used && !alone { "joint estimation, in the model" } else { from(is_used) };
                rows.push(cells("k_V", gain, "rad/(s V)", from));
            }
            let is_used = joint.pole.value == self.actuator.pole;
            let from = if is_used && !alone { "joint estimation, in the model" } else { from(is_used) };
            rows.push(cells("p", joint.pole, "rad/s", from));
            let taken = joint.delay.as_ref().map(|it| it.delay.scaled(1e3));
            rows.extend(taken.map(|delay| cells("delay", delay, "ms", from)));
        }
        rows
    }

    /// k_V of constant commands and of several supplies, and where exciting commands have another: the one in the model first.
    fn gains(&self) -> Vec<(Estimate, &'static str)> {
        let Some(between) = self.supplies.as_ref().map(|supplies| supplies.gain) else {
            return self.own_gains(true);
        };
        let is_in_model = between.value == self.actuator.voltage_gain;
        let mut gains = self.own_gains(!is_in_model);
        if is_in_model {
            gains.insert(0, (between, "levels at several supplies, in the model"));
        } else {
            gains.push((between, "levels at several supplies, less certain"));
        }
        gains
    }

    /// The same without several supplies; `is_in_model` = one of them is the model's, and is called so.
    fn own_gains(&self, is_in_model: bool) -> Vec<(Estimate, &'static str)> {
        let Some(steady) = self.battery.as_ref().map(|battery| battery.gain) else { return Vec::new() };
        let Some(exciting) = self.joint.as_ref().and_then(|joint| joint.voltage_gain) else {
            return vec![(steady, "constant commands, Eq. (6)")];
        };
        if steady.value == self.actuator.voltage_gain {
            let from = if is_in_model {
                "constant commands, Eq. (6), in the model"
            } else {
                "constant commands, Eq. (6)"
            };
            return vec![(steady, from), (exciting, "joint estimation, less certain")];
        }
        // Without ramps k_V goes with the curve of the exciting commands, however sure the other is.
        let beside = if steady.standard_error < exciting.standard_error {
            "constant commands, Eq. (6), as a check"
        } else {
            "constant commands, Eq. (6), less certain"
        };
        let from = if is_in_model { "joint estimation, in the model" } else { "joint estimation" };
        vec![(exciting, from), (steady, beside)]
    }

    /// Which steps of section III the logs permit.
    #[must_use]
    pub fn part_table(&self) -> TextTable {
        let table = TextTable::new(["step of section III", "outcome"]).caption("What the logs permit");
        self.parts.iter().fold(table, |table, part| {
            let mark = if part.done { Mark::Good } else { Mark::Plain };
            let done = if part.done { "done" } else { "not done" };
            let outcome = format!("{done}: {}", outcome(part));
            table.marked_row(mark, [step(part.step).to_owned(), outcome])
        })
    }

    /// What the reader must know, first what is said of the model, then of its logs; and of which rotor.
    fn notes(&self) -> Vec<Note<'_>> {
        let (of_logs, of_model): (Vec<_>, Vec<_>) =
            self.findings.iter().partition(|finding| !finding.place().is_empty());
        // That the template's battery is another one is said where another voltage is taken as full.
        let takes_own = self.findings.iter().any(|it| it.code == "battery_above_full_voltage");
        let is_said = |finding: &&Finding| !(takes_own && finding.code == "battery_of_other_bench");
        let of_all = notes::of_all(of_model.into_iter().chain(of_logs).filter(is_said));
        let of_rotors = self.rotors.iter().flat_map(|of| {
            let own = of.findings.iter().filter(|it| !self.findings.contains(it)).filter(is_said);
            own.map(|finding| {
                let rotor = format!("rotor {}", of.rotor);
                (if finding.is_of_rotor && finding.subject == rotor { String::new() } else { rotor }, finding)
            })
        });
        of_all.into_iter().chain(of_rotors).collect()
    }

    /// The same in sentences, each of each log.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let said = |(whose, finding): Note| {
            let said = sentence(finding);
            if whose.is_empty() { said } else { format!("{whose}: {said}") }
        };
        self.notes().into_iter().map(said).collect()
    }

    /// The same as lines of a terminal.
    #[must_use]
    pub fn note_lines(&self, detail: Detail) -> String {
        notes::lines(&self.notes(), "Note: ", detail)
    }

    /// The answer of `--json`: with the sentences of its findings, and with what became of each step.
    ///
    /// # Errors
    ///
    /// What cannot be written as JSON.
    pub fn json(&self) -> Result<serde_json::Value, serde_json::Error> {
        let mut value = with_sentences(self, &self.findings)?;
        for (at, part) in self.parts.iter().enumerate() {
            value["parts"][at]["step"] = step(part.step).into();
            value["parts"][at]["outcome"] = outcome(part).into();
        }
        Ok(value)
    }

    /// Errors of the identified rotor on training and validation logs; `None` where no log has a rotor.
    #[must_use]
    pub fn error_table(&self) -> Option<TextTable> {
        let headers = ["log", "rms [rad/s]", "rms [%]", "99 % within [%]", "fit [%]", "samples"];
        let row = |table: TextTable, (kind, run): (&str, &Validation)| {
            let name = format!("{} ({kind})", run.source);
            let numbers = [run.rms, run.rms_percent, run.worst_percent, run.fit_percent].map(finite_or_dash);
            table.row([name].into_iter().chain(numbers).chain([run.samples.to_string()]))
        };
        let training = self.training.iter().map(|run| ("training", run));
        let all = training.chain(self.validation.iter().map(|run| ("validation", run)));
        let caption = "Free run from the measured commands, each stretch from the rate that fits it best";
        let table = all.fold(TextTable::new(headers).caption(caption), row);
        (!(self.training.is_empty() && self.validation.is_empty())).then_some(table)
    }

    /// Degrees of g(u) side by side.
    #[must_use]
    pub fn degree_table(&self) -> Option<TextTable> {
        let curve = self.static_curve.as_ref().map(|curve| &curve.degrees);
        let degrees: &Vec<DegreeScore> = curve.or(self.joint.as_ref().map(|joint| &joint.degrees))?;
        let used = self.actuator.coefficients.len();
        let table = TextTable::new([
            "degree",
            "fitted rms [rad/s]",
            "held-out rms [rad/s]",
            "coefficients from u [rad/s]",
        ])
        .caption("Degree of g(u)");
        Some(degrees.iter().fold(table, |table, score| {
            let is_used = score.degree == used;
            let mark = if is_used { Mark::Good } else { Mark::Plain };
            let coefficients: Vec<String> = score.coefficients.iter().map(|c| number(*c, 5)).collect();
            table.marked_row(
                mark,
                [
                    format!("{}{}", score.degree, if is_used { " (used)" } else { "" }),
                    number(score.train, 4),
                    number(score.held_out, 4),
                    coefficients.join(", "),
                ],
            )
        }))
    }

    /// The first-order lag against a delay and a second pole.
    #[must_use]
    pub fn alternatives_table(&self) -> Option<TextTable> {
        let alone = self.pole.as_ref();
        let alone = alone.map(|fit| (fit.pole, fit.residual_rms, &fit.delay, &fit.alternatives));
        let joint = self.joint.as_ref();
        let joint = joint.map(|fit| (fit.pole, fit.residual_rms, &fit.delay, &fit.alternatives));
        let (pole, rms, taken, alternatives) = alone.or(joint)?;
        let (pole, rms) = taken.as_ref().map_or((pole.value, rms), |taken| {
            // Pole and rest are then those beside the delay.
            (taken.pole_without.value, taken.residual_without)
        });
        let table = TextTable::new([
            "model",
            "time [ms]",
            "standard error [ms]",
            "pole p beside it [rad/s]",
            "rms left [rad/s]",
            "asked for by the data",
        ])
        .caption("First order against alternative model structures")
        .row([
            "first-order lag".to_owned(),
            String::new(),
            String::new(),
            number(pole, 5),
            number(rms, 4),
            String::new(),
        ]);
        Some(alternatives.iter().fold(table, |table, alternative| {
            let is_taken = taken.is_some() && alternative.term == Term::DeadTime;
            let (mark, asked) = match (is_taken, alternative.needed) {
                (true, _) => (Mark::Good, "yes, and in the model"),
                (false, true) if taken.is_some() && !alternative.clear => (Mark::Plain, "in its place only"),
                (false, true) => (Mark::Warning, "yes"),
                (false, false) => (Mark::Plain, "no"),
            };
            table.marked_row(
                mark,
                [
                    alternative.effect.to_owned(),
                    number(1e3 * alternative.time.value, 3),
                    number(1e3 * alternative.time.standard_error, 2),
                    number(alternative.pole, 5),
                    number(alternative.residual_rms, 4),
                    asked.to_owned(),
                ],
            )
        }))
    }

    /// The whole report.
    #[must_use]
    pub fn page(&self) -> Page {
        let mut page = Page::new("Identification");
        page.paragraph(
            "Section III of Lotufo et al., MED 2016, as far as the logs permit. Standard errors allow for correlated \
             residuals.",
        );
        self.headline().or_else(|| self.caution()).into_iter().for_each(|headline| {
            page.verdict(Mark::Bad, headline + ".");
        });
        for warning in self.warnings() {
            page.verdict(Mark::Warning, warning);
        }
        page.heading("Result").table(self.parameter_table()).table(self.part_table());
        super::rotors::models(self).into_iter().for_each(|table| {
            page.table(table);
        });
        let command = if self.actuator.delay > 0.0 { "u(t - τ)" } else { "u" };
        page.formula(format!("z = g({command}) - k_V (v_bmax - v_b),   dω_p/dt = p (z - ω_p),   f = c ω_p²"));
        page.heading("Static curve");
        self.degree_table().into_iter().for_each(|table| {
            page.table(table);
        });
        self.levels(&mut page);
        page.heading("Dynamics");
        self.alternatives_table().into_iter().for_each(|table| {
            page.table(table);
        });
        self.response_plots(&mut page);
        page.heading("Validation");
        self.error_table().into_iter().for_each(|table| {
            page.table(table);
        });
        let shown = if self.validation.is_empty() { &self.training } else { &self.validation };
        for run in shown {
            error_plots(&mut page, run);
        }
        if let Some(body) = &self.body {
            body_plots(&mut page, body);
        }
        page
    }

    /// k_V level by level.
    fn levels(&self, page: &mut Page) {
        if let Some(battery) = &self.battery {
            let table = TextTable::new([
                "log",
                "command [-]",
                "k_V [rad/(s V)]",
                "standard error",
                "Eq. (6) as printed",
                "voltage moved [V]",
            ])
            .caption("k_V level by level");
            page.table(battery.levels.iter().fold(table, |table, level| {
                table.row([
                    level.source.clone(),
                    number(level.command, 4),
                    number(level.gain.value, 4),
                    number(level.gain.standard_error, 2),
                    number(level.as_printed, 4),
                    number(level.voltage_change, 3),
                ])
            }));
            page.paragraph(
                "The print's least squares of Eq. (6) carries the noise of the voltage reading and of its first sample \
                 in the regressor, which pulls k_V towards zero; the estimate used replaces the reading by its smooth \
                 course.",
            );
        }
    }
}
