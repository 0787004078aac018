//! The data of one block, laid out for residuals: of the rotors or of the body.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use super::body_block::{self, BodyRun};
use super::rotor_block::{self, RotorRun};
use super::thresholds::THRESHOLDS;
use crate::estimation::measured_rows::MeasuredRows;
use crate::estimation::moments::deviation;
use crate::estimation::output_error::Residuals;
use crate::log::Cells;
use crate::screening::channel_noise::ChannelNoise;
use crate::signal::{Sensor, columns};

/// What is measured at a block's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockOutput {
    /// Its name.
    pub name: &'static str,
    /// Its SI unit.
    pub unit: &'static str,
}

/// The data of one block.
#[derive(Debug, Clone)]
pub enum Runs {
    /// Free runs of rotors.
    Rotor(Vec<RotorRun>),
    /// Windows of the body.
    Body(Vec<BodyRun>),
}

/// The data of one block, laid out for residuals.
#[derive(Debug, Clone)]
pub struct BlockData {
    /// The runs.
    pub runs: Runs,
    /// Standard deviation of each channel's noise, in its unit.
    pub sigma: [f64; 2],
    units: Vec<Range<usize>>,
    len: usize,
    measured: Option<Arc<MeasuredRows>>,
    propagated: [f64; 2],
    noise: [ChannelNoise; 2],
}

impl BlockData {
    /// Lays out runs.
    #[must_use]
    pub fn new(mut runs: Runs) -> Self {
        let mut units = Vec::new();
        let mut len = 0;
        let mut unit = |length: usize| {
            units.push(len..len + length);
            len += length;
        };
        match &runs {
            Runs::Rotor(runs) => runs.iter().for_each(|run| unit(run.time.len())),
            Runs::Body(runs) => {
                for run in runs {
                    run.windows.iter().for_each(|window| unit(window.len() * run.channels()));
                }
            }
        }
        let propagated = match &runs {
            Runs::Rotor(_) => [0.0; 2],
            Runs::Body(runs) => body_block::propagated(runs),
        };
        let noise = match &runs {
            Runs::Rotor(runs) => {
                let rates = runs.iter().flat_map(|run| run.measured.iter().copied());
                [ChannelNoise::of(rates), ChannelNoise::default()]
            }
            Runs::Body(runs) => [
                ChannelNoise::of(runs.iter().flat_map(|run| run.rate.iter().copied())),
                ChannelNoise::of(runs.iter().flat_map(|run| run.angle.iter().copied())),
            ],
        };
        let measured = match &runs {
            Runs::Rotor(runs) => rotor_block::measured_rows(runs, &units),
            Runs::Body(runs) => body_block::measured_rows(runs, &units),
        };
        if let Runs::Body(runs) = &mut runs {
            // Nobody else asks for it, and of a long log it is long.
            runs.iter_mut().for_each(|run| run.propagated = Cells::default());
        }
        Self { runs, sigma: [1.0; 2], units, len, measured, propagated, noise }
    }

    /// The noise floor of each channel in its unit, from residuals over the data's own sigma: the sensor's noise, and
    /// what the noise of the rotors' sensors does to a body of `inertia` [kg m²] that they drive.
    #[must_use]
    pub fn floors(&self, residuals: &Residuals, inertia: f64) -> [f64; 2] {
        let mut floors = self.sigma;
        for (channel, floor) in floors.iter_mut().enumerate().take(self.channels().len()) {
            let propagated = self.propagated[channel] / inertia;
            let (left, pieces) = residuals.of_parts(&self.pieces(channel));
            let measured = self.measured(channel);
            // What a model says that leaves these residuals, in the channel's unit.
            let modelled = |row: usize| {
                let piece = pieces.partition_point(|piece| piece.end <= row);
                measured[piece][row - pieces[piece].start] - self.sigma[channel] * left[row]
            };
            let noise = self.noise[channel].in_residual((&left, &modelled), &pieces, propagated, *floor);
            *floor = noise.rms.hypot(propagated);
        }
        floors
    }

    /// The same with only what surely is noise. A search goes by these floors: a law that has not been found yet may look like noise
    /// with a memory, and what all laws together leave is judged by [`BlockData::floors`].
    #[must_use]
    pub fn white_floors(&self, residuals: &Residuals, inertia: f64) -> [f64; 2] {
        let mut floors = self.sigma;
        for (channel, floor) in floors.iter_mut().enumerate().take(self.channels().len()) {
            *floor = self.white_noise(residuals, channel).hypot(self.propagated[channel] / inertia);
        }
        floors
    }

    /// Rms of what surely is noise of the channel's own sensor, in its unit, from residuals over the data's own sigma.
    #[must_use]
    pub fn white_noise(&self, residuals: &Residuals, channel: usize) -> f64 {
        let (left, pieces) = residuals.of_parts(&self.pieces(channel));
        self.noise[channel].white_in_residual(&left, &pieces, self.sigma[channel])
    }

    /// What was measured in a channel, in its unit, in each of its [pieces](Self::pieces).
    fn measured(&self, channel: usize) -> Vec<Cells> {
        match &self.runs {
            Runs::Rotor(runs) => runs.iter().map(|run| run.measured.clone()).collect(),
            Runs::Body(runs) => {
                let having = runs.iter().filter(|run| channel < run.channels());
                let values =
                    |run: &'_ BodyRun| if channel == 0 { run.rate.clone() } else { run.angle.clone() };
                let of_run = |run: &'_ BodyRun| {
                    let values = values(run);
                    run.windows.iter().map(move |rows| values.part(rows.clone())).collect::<Vec<Cells>>()
                };
                having.flat_map(of_run).collect()
            }
        }
    }

    /// What no error of a channel can resolve, in its unit.
    #[must_use]
    pub fn resolution(&self, channel: usize) -> f64 {
        self.noise[channel].resolution
    }

    /// Whether it is a body that measured rotors drive.
    #[must_use]
    pub fn is_driven_by_rotors(&self) -> bool {
        matches!(&self.runs, Runs::Body(runs) if runs.iter().any(|run| !run.input.propeller_rate[0].is_empty()))
    }

    /// Whether it is the rotor block.
    #[must_use]
    pub fn is_rotor(&self) -> bool {
        matches!(self.runs, Runs::Rotor(_))
    }

    /// Units of the residual vector: stretches of a rotor, windows of the body.
    #[must_use]
    pub fn units(&self) -> &[Range<usize>] {
        &self.units
    }

    /// Length of the residual vector.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// The rows in which something was measured; `None` where they are most.
    #[must_use]
    pub fn measured_rows(&self) -> Option<&Arc<MeasuredRows>> {
        self.measured.as_ref()
    }

    /// How many of the samples were measured.
    #[must_use]
    pub fn readings(&self) -> usize {
        let finite = |values: &[f64]| values.iter().filter(|value| value.is_finite()).count();
        match &self.runs {
            Runs::Rotor(runs) => runs.iter().map(|run| finite(&run.measured)).sum(),
            Runs::Body(runs) => runs.iter().map(|run| finite(&run.rate) + finite(&run.angle)).sum(),
        }
    }

    /// Whether there is nothing to compare.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// [s] standard deviation of what is known of a dead time of the commands from when they step; 0 where that is at rows.
    #[must_use]
    pub(crate) fn delay_unknown(&self) -> f64 {
        let Runs::Rotor(runs) = &self.runs else { return 0.0 };
        runs.iter().map(|run| run.delay_unknown).fold(0.0, f64::max)
    }

    /// [s] the dead time that rates say beside the instants of steps, in the mean over logs by how well each knows it; `None` where no
    /// command steps between rows.
    pub(crate) fn step_delay(&self) -> Option<f64> {
        let Runs::Rotor(runs) = &self.runs else { return None };
        let mut of_logs: BTreeMap<(usize, usize), (usize, f64)> = BTreeMap::new();
        for run in runs.iter().filter(|run| run.command_from.is_some()) {
            let steps = of_logs.get(&(run.log, run.rotor)).map_or(0, |known| known.0) + run.steps();
            of_logs.insert((run.log, run.rotor), (steps, run.delay_found));
        }
        // Even instants know it to one over their number.
        let weighed = of_logs.values().map(|(steps, delay)| ((*steps as f64).powi(2), delay));
        let (weights, sum) = weighed
            .fold((0.0, 0.0), |(weights, sum), (weight, delay)| (weights + weight, sum + weight * delay));
        (weights > 0.0).then(|| sum / weights)
    }

    /// Has the steps of all runs come when one dead time [s] of all says so.
    pub(crate) fn take_delay(&mut self, common: f64) {
        if let Runs::Rotor(runs) = &mut self.runs {
            runs.iter_mut().for_each(|run| run.take_delay(common));
        }
    }

    /// Channels: what is measured at the block's end.
    #[must_use]
    pub fn channels(&self) -> Vec<BlockOutput> {
        let rate = BlockOutput { name: columns::BODY_RATE, unit: "rad/s" };
        let angle = BlockOutput { name: columns::BODY_ANGLE, unit: "rad" };
        match &self.runs {
            Runs::Rotor(_) => {
                vec![BlockOutput { name: Sensor::PropellerRate.name_with_unit(), unit: "rad/s" }]
            }
            Runs::Body(runs) if runs.iter().all(|run| run.channels() == 2) => vec![rate, angle],
            Runs::Body(_) => vec![rate],
        }
    }

    /// Standard deviation of what was measured in a channel, in its unit.
    #[must_use]
    pub fn spread(&self, channel: usize) -> f64 {
        match &self.runs {
            Runs::Rotor(runs) => deviation(runs.iter().flat_map(|run| run.measured.iter().copied())),
            Runs::Body(runs) if channel == 0 => {
                deviation(runs.iter().flat_map(|run| run.rate.iter().copied()))
            }
            Runs::Body(runs) => deviation(runs.iter().flat_map(|run| run.angle.iter().copied())),
        }
    }

    /// The pieces of the residual vector that belong to a channel.
    #[must_use]
    pub fn pieces(&self, channel: usize) -> Vec<Range<usize>> {
        match &self.runs {
            Runs::Rotor(_) => self.units.clone(),
            Runs::Body(runs) => {
                let channels = runs.iter().flat_map(|run| run.windows.iter().map(|_| run.channels()));
                let split = |(unit, channels): (&Range<usize>, usize)| {
                    let length = unit.len() / channels;
                    (channel < channels)
                        .then(|| unit.start + channel * length..unit.start + (channel + 1) * length)
                };
                self.units.iter().zip(channels).filter_map(split).collect()
            }
        }
    }

    /// A copy in which only part `part` of `parts` counts, or only the others. A part is made of stretches spread over
    /// all of the data.
    #[must_use]
    pub fn part(&self, part: usize, parts: usize, held_out: bool) -> Self {
        let mut copy = self.clone();
        let share =
            |index: usize, count: usize| ((index * THRESHOLDS.fold_stretches) / count.max(1)) % parts == part;
        match &mut copy.runs {
            Runs::Rotor(runs) => {
                let stretches = rotor_block::fold_stretches(runs, THRESHOLDS.fold_stretches);
                let all = runs.iter_mut().flat_map(|run| run.counts.iter_mut());
                all.zip(stretches)
                    .for_each(|(counts, stretch)| *counts &= (stretch % parts == part) == held_out);
            }
            Runs::Body(runs) => {
                let count: usize = runs.iter().map(|run| run.counts.len()).sum();
                let all = runs.iter_mut().flat_map(|run| run.counts.iter_mut());
                all.enumerate().for_each(|(index, counts)| *counts &= share(index, count) == held_out);
            }
        }
        copy
    }

    /// Whether rotors are driven by levels held for long.
    #[must_use]
    pub fn holds_levels(&self) -> bool {
        matches!(&self.runs, Runs::Rotor(runs) if rotor_block::hold_levels(runs))
    }

    /// One sample in `share`, in pieces from all over each rotor's run: a part of an experiment in one piece may hold a few
    /// commands only. Of the body every so many windows.
    #[must_use]
    pub fn in_short_pieces(&self, share: usize) -> Self {
        self.in_pieces(share, THRESHOLDS.most_pieces)
    }

    /// The same, in as few and long pieces as leave a slow state of each run its own start: two of each of two rotors.
    #[must_use]
    pub fn in_long_pieces(&self, share: usize) -> Self {
        let runs = match &self.runs {
            Runs::Rotor(runs) => runs.len(),
            Runs::Body(runs) => runs.len(),
        };
        self.in_pieces(share, (THRESHOLDS.most_slow_starts / runs.max(1)).max(1))
    }

    fn in_pieces(&self, share: usize, most: usize) -> Self {
        let Runs::Rotor(runs) = &self.runs else { return self.thinned(share) };
        let pieces = runs.iter().flat_map(|run| {
            let all = run.time.len();
            let count = (all / share / THRESHOLDS.shortest_piece).clamp(1, most);
            let length = (all / share / count).max(2).min(all);
            let gap = (all - (length * count).min(all)) / count;
            (0..count).map(move |piece| run.cut((piece * (length + gap) + gap / 2).min(all - length), length))
        });
        Self { sigma: self.sigma, ..Self::new(Runs::Rotor(pieces.collect())) }
    }

    /// The samples of each level of each rotor's run that suffice to compare starts.
    #[must_use]
    pub fn with_levels_thinned(&self) -> Self {
        let Runs::Rotor(runs) = &self.runs else { return self.clone() };
        let thinned = runs.iter().map(RotorRun::with_levels_thinned).collect();
        Self { sigma: self.sigma, ..Self::new(Runs::Rotor(thinned)) }
    }

    /// One sample in `share`: a piece near the middle of each rotor's run, every so many windows of the body.
    #[must_use]
    pub fn thinned(&self, share: usize) -> Self {
        let runs = match &self.runs {
            Runs::Rotor(runs) => Runs::Rotor(runs.iter().map(|run| run.near_middle(share)).collect()),
            Runs::Body(runs) => Runs::Body(runs.iter().map(|run| run.thinned(share)).collect()),
        };
        Self { sigma: self.sigma, propagated: self.propagated, ..Self::new(runs) }
    }
}
