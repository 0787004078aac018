//! Two hands wrote every law: this plant and the library's model. Given the same inputs and parameters they
//! must tell the same story; where they did not, one of them would be wrong.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rotorbench::model::{BodyInput, BodyStart, BodyTrace, Model, RotorInput, RotorStart, RotorTrace};

use crate::catalogue::{ENTRIES, Entry, Kind, SAG};
use crate::experiment::{Truth, actuator, attitude};
use crate::noise::Noise;
use crate::plant::{Base, HOVER_RATE, Hidden};

/// The library's model with the entry's effect.
fn model(entry: &Entry, values: &[f64]) -> Model {
    with(Model::paper(), entry, values)
}

/// The same beside what a model has already.
fn with(model: Model, entry: &Entry, values: &[f64]) -> Model {
    let mut model = model.with(&model.effect(entry.id).expect("an effect of the catalogue"));
    for ((name, _), value) in entry.parameters.iter().zip(values) {
        model.set_parameter(&format!("{}.{name}", entry.id), *value);
    }
    if ["battery_scaling", SAG.id].contains(&entry.id) {
        // It takes the place of the sag.
        model.actuator.voltage_gain = 0.0;
    }
    model
}

/// Rms difference of a rotor's rate over the noise, free run.
fn rotor_apart(model: &Model, truth: &Truth, rotor: usize) -> f64 {
    let inputs = &truth.inputs;
    let time: Vec<f64> = (0..truth.rows.len()).map(|k| inputs.period * k as f64).collect();
    let command: Vec<f64> = inputs.commands.iter().map(|command| command[rotor]).collect();
    let voltage: Vec<f64> = inputs.voltages.iter().map(|pair| (pair[0] + pair[1]) / 2.0).collect();
    let first = truth.rows[0].rate[rotor];
    let input = RotorInput {
        time: &time,
        command: &command,
        command_from: None,
        voltage: Some(&voltage),
        side: if rotor == 0 { 1.0 } else { -1.0 },
    };
    // The plant starts cold: its heat is below settled by all there is.
    let start =
        RotorStart { rate: Some(first), slow: -(first / HOVER_RATE).powi(3), ..RotorStart::default() };
    let mut trace = RotorTrace::default();
    model.equations().expect("known effects").simulate_rotor(&input, &start, &mut trace);
    let pairs = truth.rows.iter().zip(&trace.measured);
    rms(pairs.map(|(row, modelled)| (row.rate[rotor] - modelled) / Noise::USUAL.rate))
}

fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = errors.fold((0.0, 0), |(sum, count), error| (sum + error * error, count + 1));
    (sum / f64::from(count)).sqrt()
}

/// Rms difference of the body's rate, and of its angle, over the noise, in windows of half a second.
fn body_apart(model: &Model, truth: &Truth) -> f64 {
    let equations = model.equations().expect("known effects");
    let time: Vec<f64> = (0..truth.rows.len()).map(|k| truth.inputs.period * k as f64).collect();
    let torque: Vec<f64> =
        truth.rows.iter().map(|row| equations.rotor_torque(row.true_rate[0], row.true_rate[1])).collect();
    let middle = |rotor: usize| -> Vec<f64> {
        let at = |k: usize| truth.rows[k.min(truth.rows.len() - 1)].true_rate[rotor];
        (0..truth.rows.len()).map(|k| (at(k) + at(k + 1)) / 2.0).collect()
    };
    let next = |k: usize| torque[(k + 1).min(torque.len() - 1)];
    let means: Vec<f64> = (0..torque.len()).map(|k| (torque[k] + next(k)) / 2.0).collect();
    let slopes: Vec<f64> = (0..torque.len()).map(|k| (next(k) - torque[k]) / truth.inputs.period).collect();
    let input = BodyInput {
        torque: equations.torque_means(&time, &means, &slopes),
        propeller_rate: [middle(0), middle(1)],
        time: time.into(),
    };
    let (mut rates, mut angles) = (Vec::new(), Vec::new());
    for from in (0..truth.rows.len() - 50).step_by(50) {
        let row = &truth.rows[from];
        let start = BodyStart {
            angle: row.angle,
            rate: row.true_body_rate,
            sensor: row.body_rate - row.true_body_rate,
        };
        let sensor = if model.has("gyro_lag") { start.sensor } else { 0.0 };
        let mut trace = BodyTrace::default();
        equations.simulate_body(&input, from, from + 50, &BodyStart { sensor, ..start }, &mut trace);
        for (k, (rate, angle)) in trace.rate.iter().zip(&trace.angle).enumerate() {
            let row = &truth.rows[from + k];
            rates.push((row.body_rate - rate) / Noise::USUAL.gyro);
            angles.push((row.angle - angle) / Noise::USUAL.angle);
        }
    }
    rms(rates.into_iter()).max(rms(angles.into_iter()))
}

#[test]
fn plant_and_model_agree_on_every_law() {
    let mut wrong = Vec::new();
    for entry in ENTRIES.iter().chain([&SAG]) {
        for kind in [Kind::Actuator, Kind::Attitude] {
            if !entry.shows_on(kind) {
                continue;
            }
            let mut rng = ChaCha8Rng::seed_from_u64(23);
            let values: Vec<f64> = entry.parameters.iter().map(|(_, draw)| draw.take(&mut rng)).collect();
            let mut hidden = Hidden::nothing();
            (entry.hide)(&mut hidden, &values);
            let model = model(entry, &values);
            let base = Base { voltage_gain: if entry.id == SAG.id { 0.0 } else { 40.0 }, ..Base::PAPER };
            let apart = match kind {
                Kind::Actuator => {
                    let truth = actuator(&base, &hidden, &mut rng, false).expect("stays on its bench");
                    rotor_apart(&model, &truth, 0)
                }
                Kind::Attitude => {
                    let truth = attitude((&base, &Base::PAPER), &hidden, &mut rng, false)
                        .expect("stays on its bench");
                    rotor_apart(&model, &truth, 0)
                        .max(rotor_apart(&model, &truth, 1))
                        .max(body_apart(&model, &truth))
                }
            };
            // The stand's inputs are the same to the last digit: what remains is the two integrators. On the
            // pivot the model sees rotor rates at 100 Hz only, as straight lines, and their torque as means over
            // 10 ms: a quarter of the gyro's noise, more where a lag has to follow them, most where friction holds.
            let limit = match (kind, entry.id) {
                (Kind::Actuator, _) => 0.05,
                (_, "pivot_coulomb_friction") => 1.0,
                _ => 0.6,
            };
            if apart > limit {
                wrong.push(format!("{} on the {} bench: {apart:.2} of the noise", entry.id, kind.name()));
            }
        }
    }
    assert!(wrong.is_empty(), "plant and model differ:\n{}", wrong.join("\n"));
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    /// In whatever order two effects of a rotor were added to the model: what each acts on is what the other left of it.
    #[test]
    fn plant_and_model_agree_on_pairs_of_a_rotor_in_either_order() {
        // Whether an ESC rounds a command before or behind its dead zone is each ESC's own, and so is the order of adding.
        let is_each_own = |one: &Entry, other: &Entry| {
            let is = |id: &str| one.id == id || other.id == id;
            is("command_dead_zone") && is("command_quantization")
        };
        let entries: Vec<&Entry> = ENTRIES.iter().filter(|entry| entry.shows_on(Kind::Actuator)).collect();
        let (mut wrong, mut asked) = (Vec::new(), 0);
        for (at, one) in entries.iter().enumerate() {
            for other in entries[at + 1..].iter().filter(|other| !is_each_own(one, other)) {
                let mut rng = ChaCha8Rng::seed_from_u64(29);
                let mut hidden = Hidden::nothing();
                let [first, second] = [one, other].map(|entry| {
                    let values: Vec<f64> =
                        entry.parameters.iter().map(|(_, draw)| draw.take(&mut rng)).collect();
                    (entry.hide)(&mut hidden, &values);
                    values
                });
                let Some(truth) = actuator(&Base::PAPER, &hidden, &mut rng, false) else { continue };
                asked += 1;
                let models = [
                    with(with(Model::paper(), one, &first), other, &second),
                    with(with(Model::paper(), other, &second), one, &first),
                ];
                for model in models {
                    let apart = rotor_apart(&model, &truth, 0);
                    // The two integrators, and how a lag of the reading begins, which no log says: up to 0.08. A lag ahead of a slew limit
                    // is 2.9 apart.
                    if apart > 0.1 {
                        let ids: Vec<&str> = model.effects.iter().map(|added| added.id.as_str()).collect();
                        wrong.push(format!("{ids:?}: {apart:.2} of the noise"));
                    }
                }
            }
        }
        assert!(wrong.is_empty(), "plant and model differ:\n{}", wrong.join("\n"));
        assert!(asked > 60, "{asked}");
    }
}
