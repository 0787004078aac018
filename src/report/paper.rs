//! The report of `paper`: every table and figure, ours beside the printed one.

use super::identification::error_plots;
use super::{Axis, Mark, Page, Plot, Series, Table, Tone, number};
use crate::identify::Estimate;
use crate::process::paper::{Flight, PaperRun};

impl PaperRun {
    /// Table I and the pole of Table IV: printed, ours, standard error.
    #[must_use]
    pub fn identified_table(&self) -> Table {
        let found = &self.identification;
        let table =
            Table::new(["symbol", "printed", "ours", "standard error", "away [standard errors]", "unit"])
                .caption("Table I, and p of Table IV");
        let row = |table: Table, name: &str, printed: f64, ours: Option<Estimate>, unit: &str| match ours {
            Some(ours) => {
                let away = ours.distance(printed);
                let mark = if away < 3.0 { Mark::Good } else { Mark::Bad };
                table.marked_row(
                    mark,
                    [
                        name.to_owned(),
                        number(printed, 5),
                        number(ours.value, 6),
                        number(ours.standard_error, 2),
                        number(away, 2),
                        unit.to_owned(),
                    ],
                )
            }
            None => table.marked_row(Mark::Bad, [name, "not identified"]),
        };
        let curve = |index: usize| {
            found.static_curve.as_ref().and_then(|curve| curve.coefficients.get(index)).copied()
        };
        let table = row(table, "c_g1", 447.1, curve(1), "rad/s");
        let table = row(table, "c_g2", 1124.5, curve(0), "rad/s");
        let table = row(table, "k_V", 40.0, found.battery.as_ref().map(|battery| battery.gain), "rad/(s V)");
        row(table, "p", 16.0, found.pole.as_ref().map(|fit| fit.pole), "rad/s")
    }

    /// Tables II and III.
    #[must_use]
    pub fn gain_table(&self) -> Table {
        let [l_0, l_1, l_2, l_3] = self.gains.l;
        let [k_1, k_2, k_3] = self.gains.k;
        let row = |table: Table, name: &str, printed: &str, ours: f64| {
            table.row([name.to_owned(), printed.to_owned(), number(ours, 4)])
        };
        let table =
            Table::new(["symbol", "printed", "ours"]).caption("Tables II and III: gains for β = γ_0 = 0.276");
        let table = row(table, "l_0", "-5.03e-17", l_0);
        let table = row(table, "l_1", "1.95e-1", l_1);
        let table = row(table, "l_2", "1.02e-2", l_2);
        let table = row(table, "l_3", "1.43e-4", l_3);
        let table = row(table, "k_1", "0.276 (unstable)", k_1);
        let table = row(table, "k_2", "0.120 (unstable)", k_2);
        row(table, "k_3", "0.052 (unstable)", k_3)
    }

    /// EMC against PID, with and without delay.
    #[must_use]
    pub fn flight_table(&self) -> Table {
        let table = Table::new([
            "controller",
            "loop delay [ms]",
            "peak [rad]",
            "settling [s]",
            "overshoot [%]",
            "swings",
            "ITAE [rad s²]",
            "effort [N m]",
            "disturbance-estimate error [N m]",
        ])
        .caption("The same impulse, 0.6 N m for 50 ms");
        self.flights.iter().fold(table, |table, flight| {
            let answer = &flight.answer;
            table.row([
                flight.controller.to_owned(),
                number(1e3 * flight.delay, 3),
                number(answer.peak, 3),
                number(answer.settling, 3),
                number(answer.overshoot_percent, 3),
                answer.swings.to_string(),
                number(answer.itae, 3),
                number(answer.effort, 3),
                number(answer.disturbance_error, 3),
            ])
        })
    }

    /// The whole report.
    #[must_use]
    pub fn page(&self) -> Page {
        let mut page = Page::new(
            "Identification and control of a quadrotor from experimental data: ours beside the print",
        );
        page.paragraph(
            "Lotufo, Perez-Montenegro, Colangelo, Canuto, Novara, MED 2016, 10.1109/MED.2016.7535956, sections III to V, \
             repeated on the emulated bench with the paper's parameters. The emulator integrates finer than the fitter \
             and shares no law with it. Everything runs in simulated time.",
        );
        page.heading("Tables I and IV: identification").table(self.identified_table());
        page.table(self.identification.parameter_table());
        page.list([
            "The print's Eqs. (2), (4), (5), (9) carry + k_V; its Eq. (6) and physics ask for z = g(u) - k_V (v_bmax - v_b), used here.",
            "Eq. (6) by plain least squares is pulled towards zero by the noise of the voltage reading; the reading's smooth course is used instead.",
            "J = 0.032 kg m² and d = 0.25 m are the paper's CAD values, and the thrust curve is the parabola with the tangent of Table IV: taken as given.",
        ]);
        self.identification.degree_table().into_iter().for_each(|table| {
            page.table(table);
        });
        page.heading("Fig. 3: validation").table(self.identification.error_table());
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
        page.heading("Figs. 8 and 9: torque impulse").table(self.flight_table());
        page.paragraph(
            "On the bare model the PID has the smaller peak (about 0.07 rad against about 0.11 rad of EMC with α_c = 0), \
             and swings once or twice. The stronger ringing of the print needs loop delay, which is a setting here. What \
             EMC gives is one small overshoot and a disturbance estimate that follows the impulse; the PID's integral \
             hardly moves. Neither controller is tuned to lose.",
        );
        let mut delays: Vec<f64> = self.flights.iter().map(|flight| flight.delay).collect();
        delays.dedup();
        for delay in delays {
            self.flight_plots(&mut page, delay);
        }
        page
    }

    fn flight_plots(&self, page: &mut Page, delay: f64) {
        let flights: Vec<&Flight> = self.flights.iter().filter(|flight| flight.delay == delay).collect();
        let column = |flight: &Flight, index: usize| -> Vec<f64> {
            flight.traces.iter().map(|row| row[index]).collect()
        };
        let group = format!("delay {delay}");
        let title = |figure: &str| format!("{figure}, loop delay {} ms", number(1e3 * delay, 3));
        let axes = |quantity: &str, unit: &str| (Axis::new("time", "s"), Axis::new(quantity, unit));
        let (x, y) = axes("angle", "rad");
        let mut angle = Plot::new(title("Fig. 8: angle"), x, y).group(group.as_str());
        let (x, y) = axes("torque", "N m");
        let mut torque = Plot::new(title("Fig. 9: disturbance estimate"), x, y).group(group);
        for flight in &flights {
            let tone = if flight.controller == "EMC" { Tone::Model } else { Tone::Residual };
            let time = column(flight, 0);
            angle = angle.series(Series::line(flight.controller, &time, &column(flight, 1)).tone(tone));
            torque = torque.series(Series::line(flight.controller, &time, &column(flight, 2)).tone(tone));
        }
        if let Some(flight) = flights.first() {
            torque = torque.series(
                Series::line("true disturbance", &column(flight, 0), &column(flight, 3)).tone(Tone::Quiet),
            );
        }
        page.plot(angle).plot(torque);
    }
}
