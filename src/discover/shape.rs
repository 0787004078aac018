//! What is missing without a formula: the smooth function at the place of the answer, as it is drawn.

use super::answer::{ChannelDirection, Shape, ShapePoint};
use super::channels::LawInput;
use super::formula::{Formula, LawTask};
use super::law::{CandidateLaw, LawTerm, unit_at};
use super::places::{PlaceScore, knot_at};
use super::search::BlockResult;
use super::thresholds::THRESHOLDS;
use crate::diagnose::model_selection::{floor, joint_floors};
use crate::effect::signals;
use crate::effect::{Expression, Point};

/// The smooth function at the place of the answer.
pub(super) struct Shaped<'a> {
    pub place: &'a PlaceScore,
    pub explained: f64,
    variance: f64,
}

impl<'a> Shaped<'a> {
    /// At the place of the formula where there is one, else where it explains most.
    pub fn of(searched: &'a BlockResult) -> Option<Self> {
        let formula = searched.formula.as_ref();
        let is_of_formula = |place: &&PlaceScore| {
            formula.is_none_or(|it| place.place.is_place_of(it.law.site, &it.law.channels()))
        };
        // Beside a law that remembers the one that does so, too.
        let is_same_kind = |place: &&PlaceScore| {
            formula.is_none_or(|it| it.law.terms.iter().any(LawTerm::remembers) == place.place.way.is_some())
        };
        let mut own = searched.places.iter().filter(is_of_formula);
        let place = own.clone().find(is_same_kind).or_else(|| own.next())?;
        let rows = place.score.residuals.iter().filter(|value| **value != 0.0).count();
        let variance = place.score.held_out / rows.max(1) as f64;
        Some(Self { place, explained: share(searched, place), variance })
    }

    /// The whole fit of the function: one step of Gauss and Newton finds it, and is off where the law is strong.
    pub fn refit(&self, task: &LawTask) -> Option<Formula> {
        task.refit(&self.place.law, &self.place.score.coefficients, &[])
    }

    /// Whether the function explains what there is.
    pub fn is_near(&self, task: &LawTask, refitted: &Formula) -> bool {
        task.over_floor(&refitted.fitted) <= THRESHOLDS.shape_near_floor
    }

    /// What coefficients add up to at each point: where the function looks at the way, a knot has two, on the way up and on the way down.
    fn at_points(&self, coefficients: &[f64]) -> Vec<f64> {
        if self.place.place.way.is_none() {
            return coefficients.to_vec();
        }
        let (plain, by_way) = coefficients.split_at(coefficients.len() / 2);
        let on_way = |sign: f64| plain.iter().zip(by_way).map(move |(plain, by_way)| plain + sign * by_way);
        on_way(1.0).chain(on_way(-1.0)).collect()
    }

    /// Value and standard error at each point, but for a constant. By how far one step was off the errors are wider: they are those of
    /// the step. A function that leaves more than noise has none.
    fn values(&self, refitted: Option<&Formula>, task: &LawTask) -> Vec<(f64, Option<f64>)> {
        let score = &self.place.score;
        let one = centred(&self.at_points(&score.coefficients));
        let Some(refitted) = refitted else { return one.into_iter().map(|value| (value, None)).collect() };
        let whole = self.place.law.coefficients_in(&refitted.fitted.model, task.id);
        let whole = centred(&self.at_points(&whole));
        let is_near = self.is_near(task, refitted);
        // Of a sum as of a difference of two that are independent.
        let (count, half) = (score.variances.len(), score.variances.len() / 2);
        let variance = |index: usize| match self.place.place.way {
            Some(_) => score.variances[index % half] + score.variances[(half + index % half) % count],
            None => score.variances[index],
        };
        let of = |(index, (whole, one)): (usize, (f64, &f64))| {
            let error = Some((variance(index) * self.variance).sqrt().hypot(whole - one));
            (whole, error.filter(|error| is_near && error.is_finite()))
        };
        whole.into_iter().zip(&one).enumerate().map(of).collect()
    }

    /// Where each point is: the values of the channels, and the way of one that has two.
    fn places(&self) -> Vec<(Vec<f64>, Option<ChannelDirection>)> {
        let channels = &self.place.place.channels;
        let count = self.place.score.coefficients.len();
        let at = |channel: &LawInput, knot: usize, knots: usize| knot_at(channel, knot, knots);
        match (&channels[..], self.place.place.way) {
            ([first, second, ..], _) => {
                let knots = THRESHOLDS.pair_knots;
                let both =
                    |index: usize| vec![at(first, index % knots, knots), at(second, index / knots, knots)];
                (0..count).map(|index| (both(index), None)).collect()
            }
            ([only], None) => (0..count).map(|index| (vec![at(only, index, count)], None)).collect(),
            ([only], Some(_)) => {
                let knots = count / 2;
                let on_way = |way| (0..knots).map(move |knot| (vec![at(only, knot, knots)], Some(way)));
                on_way(ChannelDirection::Rising).chain(on_way(ChannelDirection::Falling)).collect()
            }
            ([], _) => Vec::new(),
        }
    }

    pub fn drawn(
        &self,
        refitted: Option<&Formula>,
        task: &LawTask,
        formula: Option<(&CandidateLaw, &Vec<f64>)>,
    ) -> Shape {
        let channels = &self.place.place.channels;
        let by_direction = self.place.place.way.is_some();
        let all = self.places();
        let firsts: Vec<f64> = all.iter().filter_map(|(at, _)| at.first().copied()).collect();
        let said = formula.filter(|_| channels.len() == 1 && !by_direction);
        let said = said.and_then(|(law, coefficients)| along(law, coefficients, &firsts));
        let values = self.values(refitted, task);
        let point = |(index, (at, direction)): (usize, (Vec<f64>, Option<ChannelDirection>))| {
            let (value, standard_error) = values[index];
            let formula = said.as_ref().map(|values| values[index]);
            ShapePoint { at, direction, value, standard_error, formula }
        };
        Shape {
            channels: names(channels.iter()),
            by_direction,
            explained: self.explained,
            unit: unit_at(self.place.place.site).to_owned(),
            points: all.into_iter().enumerate().map(point).collect(),
        }
    }
}

pub(super) fn names<'a>(channels: impl Iterator<Item = &'a LawInput>) -> Vec<String> {
    channels.map(|channel| channel.log.to_owned()).collect()
}

/// Share of the held-out squared error above the noise that a place explains.
pub(super) fn share(searched: &BlockResult, place: &PlaceScore) -> f64 {
    let Some(without) = &searched.without else { return 0.0 };
    let (split, start) = (searched.task.split(), searched.task.start);
    let best = searched.formula.as_ref().map_or(start, |formula| &formula.fitted);
    let noise = floor(split, &joint_floors(split, best)) / start.validate(split);
    let room = 1.0 - noise.min(1.0);
    let fall = 1.0 - place.score.held_out / without.held_out;
    if room > 0.0 { (fall / room).clamp(0.0, 1.0) } else { 0.0 }
}

/// What a law adds along one channel; `None` where it looks at others, or is not a number.
pub(super) fn along(law: &CandidateLaw, coefficients: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    let channels = law.channels();
    let [only] = channels[..] else { return None };
    // What remembers is no function of where the channel is.
    if law.terms.iter().any(LawTerm::remembers) {
        return None;
    }
    let user = law.user_effect("law", coefficients);
    let names: Vec<&str> = user.parameters.iter().map(|it| it.name.as_str()).collect();
    let numbers: Vec<f64> = user.parameters.iter().map(|it| it.start).collect();
    let expression = Expression::parse(&user.expression, &names).ok()?;
    let of = |value: &f64| {
        let mut point = Point::default();
        let place = match only.signal {
            signals::TIME => &mut point.time,
            signals::COMMAND => &mut point.command,
            signals::BATTERY_VOLTAGE => &mut point.battery_voltage,
            signals::PROPELLER_RATE => &mut point.propeller_rate,
            signals::TORQUE => &mut point.torque,
            signals::BODY_ANGLE => &mut point.body_angle,
            signals::BODY_RATE => &mut point.body_rate,
            _ => return None,
        };
        *place = *value;
        let value = expression.value(&numbers, &point);
        value.is_finite().then_some(value)
    };
    values.iter().map(of).collect()
}

/// Values about their mean: a constant is the base's own numbers' to take up.
pub(super) fn centred(values: &[f64]) -> Vec<f64> {
    let centre = crate::estimation::moments::mean(values);
    values.iter().map(|value| value - centre).collect()
}

#[cfg(test)]
mod tests {
    use super::super::linear::Score;
    use super::super::places::Place;
    use super::*;
    use crate::effect::Site;

    #[test]
    fn a_function_that_looks_at_the_way_has_a_value_for_each_way_at_each_knot() {
        let channel = LawInput {
            signal: "body_angle",
            log: "body_angle_rad",
            unit: "rad",
            low: -0.4,
            high: 0.4,
            is_signed: true,
        };
        let place = Place { way: Some(0.02), ..Place::of(Site::Torque, vec![channel]) };
        let coefficients = vec![1.0, 2.0, 3.0, 0.1, 0.2, 0.3];
        let score = Score {
            train: 1.0,
            held_out: 6.0,
            variances: vec![1.0; 6],
            steps: Vec::new(),
            residuals: vec![1.0; 6],
            coefficients: coefficients.clone(),
        };
        let law = place.shape(3);
        let place = PlaceScore { place, law, score };
        let shaped = Shaped { place: &place, explained: 1.0, variance: 1.0 };
        let near = |found: &[f64], wanted: &[f64]| {
            found.len() == wanted.len() && found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        assert!(near(&shaped.at_points(&coefficients), &[1.1, 2.2, 3.3, 0.9, 1.8, 2.7]));
        let places = shaped.places();
        let angles: Vec<f64> = places.iter().map(|(at, _)| at[0]).collect();
        assert!(near(&angles, &[-0.4, 0.0, 0.4, -0.4, 0.0, 0.4]), "{angles:?}");
        let ways: Vec<_> = places.iter().filter_map(|(_, way)| *way).collect();
        let (rising, falling) = (ChannelDirection::Rising, ChannelDirection::Falling);
        assert_eq!(ways, [rising, rising, rising, falling, falling, falling]);
    }
}
