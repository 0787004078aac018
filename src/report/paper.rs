//! The report of `paper`: every table and figure, ours beside the printed one.

use super::deviations;
use super::identification::error_plots;
use super::runs::{DISTURBANCE, Shown, answer_plots, answer_table};
use super::{Mark, Page, TextTable, Tone, number};
use crate::identify::HIGHEST_DEGREE;
use crate::studies::paper::{ControlledRun, PaperRun, PrintedNumber};
use crate::studies::thresholds::THRESHOLDS;

/// That the paper's experiments were not run to their end.
#[must_use]
pub fn interrupted(what: impl std::fmt::Display, reason: impl std::fmt::Display) -> String {
    format!("stopped in the middle of {what}, {reason}; no report was written")
}

impl PaperRun {
    /// Table I and the pole of Table IV: printed, ours, standard error.
    #[must_use]
    pub fn identified_table(&self) -> TextTable {
        let table =
            TextTable::new(["symbol", "printed", "ours", "standard error", "away [standard errors]", "unit"])
                .caption("Table I, and p of Table IV");
        let identified = self.beside.iter().filter(|row| row.table == "I" || row.symbol == "p");
        identified.fold(table, |table, row| {
            let Some((ours, error)) = row.ours.zip(row.standard_error) else {
                return table.marked_row(Mark::Bad, [row.symbol, "not identified"]);
            };
            let away = (ours - row.printed).abs() / error;
            table.marked_row(
                if away < super::thresholds::THRESHOLDS.wrong_errors { Mark::Good } else { Mark::Bad },
                [
                    row.symbol.to_owned(),
                    number(row.printed, 5),
                    number(ours, 6),
                    number(error, 2),
                    number(away, 2),
                    row.unit.to_owned(),
                ],
            )
        })
    }

    /// What a reader of [`PaperRun::identified_table`] will ask: how far off is still chance, and why k_V is there twice.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let away = |row: &&PrintedNumber| {
            let (ours, error) = row.ours.zip(row.standard_error)?;
            Some((row.symbol, (ours - row.printed).abs() / error))
                .filter(|(_, away)| *away > super::thresholds::THRESHOLDS.remarkable_errors)
        };
        let far: Vec<(&str, f64)> = self.beside.iter().filter_map(|row| away(&row)).collect();
        let mut remarks: Vec<String> = far.iter().map(|(symbol, away)| chance(symbol, *away)).collect();
        let is_of_curve = |symbol: &str| symbol.starts_with("c_g");
        if far.iter().any(|(symbol, _)| is_of_curve(symbol))
            && let Some(curve) = &self.identification.static_curve
        {
            remarks.push(format!(
                "c_g1 and c_g2 come from the same ramps and err together, one up and one down: between the commands {} and {} \
                 our curve is nowhere further than {} rad/s from the printed one.",
                number(curve.range.0, 2),
                number(curve.range.1, 2),
                number(self.furthest(curve.range), 2)
            ));
        }
        let steady = self.identification.battery.as_ref().map(|battery| battery.gain);
        let joint = self.identification.joint.as_ref().and_then(|joint| joint.voltage_gain);
        if let Some((steady, joint)) = steady.zip(joint) {
            let apart =
                (steady.value - joint.value).abs() / steady.standard_error.hypot(joint.standard_error);
            let (surer, why) = if steady.standard_error <= joint.standard_error {
                ("from the constant commands", "its standard error is the smaller one")
            } else {
                ("from the PRBS", "its standard error is the smaller one: it sees more of the discharge")
            };
            remarks.push(format!(
                "k_V is found twice: {} ± {} from the constant commands by Eq. (6), as the paper found its own, which is the one \
                 in Table I; and {} ± {} from the PRBS with g(u), k_V and p fitted at once. They are {} standard errors \
                 apart; the model takes the one {surer}, because {why}.",
                number(steady.value, 4),
                number(steady.standard_error, 2),
                number(joint.value, 4),
                number(joint.standard_error, 2),
                number(apart, 2),
            ));
        }
        remarks
    }

    /// [rad/s] the largest distance of our curve from the printed one over a range of commands [-].
    fn furthest(&self, (low, high): (f64, f64)) -> f64 {
        let coefficient = |power: usize| self.identification.actuator.coefficients.get(power - 1).copied();
        let gap = |step: u32| {
            let u = low + (high - low) * f64::from(step) / 100.0;
            let ours: f64 = (1..=HIGHEST_DEGREE)
                .filter_map(|power| Some(coefficient(power)? * u.powi(power as i32)))
                .sum();
            let printed = self.beside.iter().filter_map(|row| match row.symbol {
                "c_g1" => Some(row.printed * u * u),
                "c_g2" => Some(row.printed * u),
                _ => None,
            });
            (ours - printed.sum::<f64>()).abs()
        };
        (0..=100).map(gap).fold(0.0, f64::max)
    }

    /// Tables II and III.
    #[must_use]
    pub fn gain_table(&self) -> TextTable {
        let table = TextTable::new(["table", "symbol", "printed", "ours", "unit", "remark"])
            .caption("Tables II and III: gains for β = γ_0 = 0.276");
        let computed = self.beside.iter().filter(|row| matches!(row.table, "II" | "III"));
        computed.fold(table, |table, row| {
            let remark = match row.symbol {
                "k_1" | "k_2" | "k_3" => "as printed unstable",
                "k_P" | "k_I" | "k_D" => "as printed",
                "l_0" => "zero but for rounding",
                _ => "",
            };
            table.row([
                row.table.to_owned(),
                row.symbol.to_owned(),
                as_printed(row.printed),
                number(row.ours.unwrap_or(f64::NAN), 4),
                row.unit.to_owned(),
                remark.to_owned(),
            ])
        })
    }

    /// The rest of Table IV: what is taken as given, and β.
    #[must_use]
    pub fn given_table(&self) -> TextTable {
        let table =
            TextTable::new(["symbol", "printed", "ours", "unit", "remark"]).caption("The rest of Table IV");
        let given = self.beside.iter().filter(|row| row.table == "IV" && row.symbol != "p");
        given.fold(table, |table, row| {
            let remark = match row.symbol {
                "β" => "a design input; 0.276 gives Table II",
                "c_p1" | "c_p0" => "tangent of the parabola at hover",
                _ => "as given",
            };
            let ours = number(row.ours.unwrap_or(f64::NAN), 5);
            table.row([row.symbol, &number(row.printed, 5), &ours, row.unit, remark].map(str::to_owned))
        })
    }

    /// EMC against PID, with and without delay.
    #[must_use]
    pub fn run_table(&self) -> TextTable {
        let shown: Vec<Shown> = self.runs.iter().map(shown).collect();
        answer_table(
            &shown,
            &format!(
                "The same impulse, 0.6 N m for 50 ms, judged for {} s behind it",
                THRESHOLDS.answer_window_s
            ),
        )
    }

    /// The whole report.
    #[must_use]
    pub fn page(&self) -> Page {
        let mut page = Page::new(
            "Identification and control of a quadrotor from experimental data: ours beside the print",
        );
        page.paragraph(
            "Lotufo, Perez-Montenegro, Colangelo, Canuto, Novara, MED 2016, 10.1109/MED.2016.7535956, sections III to V, \
             repeated on the emulated bench with the paper's parameters. The emulator is a process of its own for each \
             experiment and run, integrates finer than the fitter and shares no law with it. Everything runs in simulated time.",
        );
        page.heading("Tables I and IV: identification").table(self.identified_table());
        page.list(self.remarks());
        page.table(self.given_table()).table(self.identification.parameter_table());
        page.list([
            "The print's Eqs. (2), (4), (5), (9) carry + k_V; its Eq. (6) and physics ask for z = g(u) - k_V (v_bmax - v_b), used here.",
            "Eq. (6) by plain least squares is pulled towards zero by the noise of the voltage reading; the reading's smooth course is used instead.",
            "J = 0.032 kg m² and d = 0.25 m are the paper's CAD values, and the thrust curve is the parabola with the tangent of Table IV: taken as given.",
        ]);
        self.identification.degree_table().into_iter().for_each(|table| {
            page.table(table);
        });
        page.heading("Fig. 3: validation");
        self.identification.error_table().into_iter().for_each(|table| {
            page.table(table);
        });
        if let Some(run) = self.identification.validation.first() {
            error_plots(&mut page, run);
        }
        page.heading("Fig. 5: frequency response");
        self.identification.response_plots(&mut page);
        page.heading("Tables II and III: gains").table(self.gain_table());
        page.list([
            "β prints as 0.27; Table II needs 0.276, which is used.",
            "k in Table III repeats γ_0, γ_1, γ_2 of Table II: put into A_c - B_c K it gives |λ| = 1.171, unstable. Ours is the pole placement with the text's α_c = 0.",
        ]);
        page.heading("Figs. 8 and 9: torque impulse").table(self.run_table()).paragraph(DISTURBANCE);
        page.paragraph(self.peaks());
        let mut delays: Vec<f64> = self.runs.iter().map(|run| run.delay).collect();
        delays.dedup();
        for delay in delays {
            self.run_plots(&mut page, delay);
        }
        page.heading("Deviations from the print").table(deviations::table());
        page
    }

    /// What the runs of this report say about peaks and swings, in their own numbers.
    fn peaks(&self) -> String {
        let mut text = String::new();
        for pair in self.runs.chunks_exact(2) {
            let [emc, pid] = pair else { continue };
            let smaller = if pid.answer.peak < emc.answer.peak { "PID" } else { "EMC" };
            text.push_str(&format!(
                "With a loop delay of {} ms {smaller} has the smaller peak: EMC {} rad, swinging through {} with {} % \
                 overshoot; PID {} rad, swinging through {} with {} %. \
                 EMC's disturbance estimate follows the impulse, smoothed, to {} N m. ",
                number(1e3 * emc.delay, 3),
                number(emc.answer.peak, 2),
                times(emc.answer.swings),
                number(emc.answer.overshoot_percent, 2),
                number(pid.answer.peak, 2),
                times(pid.answer.swings),
                number(pid.answer.overshoot_percent, 2),
                number(emc.answer.disturbance_peak, 2),
            ));
        }
        text.push_str(
            "The print does not say how strong its impulses were or how late its loop is, so peaks cannot be compared \
             with it; its ringing of the PID needs loop delay, which is a setting here. ",
        );
        if let Some([emc, pid]) = self.runs.last_chunk() {
            text.push_str(&format!(
                "Both controllers have the paper's settings, which were made for a loop without delay: by `design` EMC's is \
                 stable up to a delay of {} ms, the PID's up to {} ms. The {} ms run here leave the PID little, and that \
                 is why it rings: this is what these gains do with that delay, not all that a PID can do.",
                number(1e3 * emc.delay_limit, 3),
                number(1e3 * pid.delay_limit, 3),
                number(1e3 * pid.delay, 3),
            ));
        }
        text
    }

    fn run_plots(&self, page: &mut Page, delay: f64) {
        let runs = self.runs.iter().filter(|run| run.delay == delay).map(shown);
        let runs: Vec<Shown> = runs.collect();
        let title = |figure: &str| format!("{figure}, loop delay {} ms", number(1e3 * delay, 3));
        let titles = [title("Fig. 8: angle"), title("Fig. 9: disturbance estimate")];
        let [angle, torque] = answer_plots(&runs, [&titles[0], &titles[1]], &format!("delay {delay}"));
        page.plot(angle).plot(torque);
    }
}

/// What to think of a number that far away, of four that are drawn.
fn chance(symbol: &str, away: f64) -> String {
    // 1 - (1 - P(|z| > a))⁴ of a normal z: 0.44 at 1.5, 0.17 at 2, 0.011 at 3.
    let verdict = if away < super::thresholds::THRESHOLDS.unlikely_errors {
        "as chance has it: of four honest numbers one at least is beyond 1.5 in 44 of 100 runs, and another --seed draws \
         others"
    } else if away < super::thresholds::THRESHOLDS.wrong_errors {
        "which chance brings about: of four honest numbers one at least is beyond 2 in 17 of 100 runs; see whether another \
         --seed has it, too"
    } else {
        "which chance hardly brings about: one run of a hundred has such a number among its four; if another --seed has it, too, \
         the method is biased here"
    };
    format!("{symbol} is {} standard errors from the print, {verdict}.", number(away, 2))
}

fn shown(run: &ControlledRun) -> Shown<'_> {
    Shown {
        name: run.controller.to_owned(),
        delay: Some(run.delay),
        tone: if run.controller == "EMC" { Tone::Model } else { Tone::Residual },
        answer: &run.answer,
        moments: &run.moments,
        begins: 0.0,
    }
}

fn times(count: usize) -> String {
    match count {
        1 => "once".to_owned(),
        2 => "twice".to_owned(),
        count => format!("{count} times"),
    }
}

/// Three digits, as Tables II and III have them, or more where the print has more.
fn as_printed(value: f64) -> String {
    let three = number(value, 3);
    if three.parse() == Ok(value) { three } else { crate::unit::short(value) }
}

#[cfg(test)]
mod tests {
    #[test]
    fn no_digit_of_the_print_is_lost() {
        assert_eq!([2.248, 0.276, 4.7].map(super::as_printed), ["2.248", "0.276", "4.70"]);
    }
}
