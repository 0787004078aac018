//! From rotor logs to the record that the pole is fitted to: which inputs, and with which delay.

use super::thresholds::THRESHOLDS;
use crate::estimation::variable_projection::Record;
use crate::screening::rotor_data::RotorLog;

/// [s] No delay, but scored as the others are.
pub(crate) const NO_DELAY: f64 = f64::MIN_POSITIVE;

/// The record of all `rotors`, each stretch by itself. `inputs(u, drop)` makes the inputs from the command [-]
/// and the voltage drop v_bmax - v_b [V]. Commands act `delay` [s] after they were sent, exactly: where one changes between two
/// samples, the record gets an unscored row at that instant. What is measured within `unheard_intervals` of the beginning of a
/// stretch answers to commands from before it: with a delay, however short, it is not scored, so that all delays are
/// judged on the same samples, and the free state of the stretch stands for those commands.
pub(crate) fn record_of<const M: usize>(
    rotors: &[RotorLog],
    full_voltage: f64,
    delay: f64,
    inputs: impl Fn(f64, f64) -> [f64; M],
) -> Record<M> {
    let rows: usize = rotors.iter().map(|rotor| rotor.time.len()).sum();
    let mut record = Record {
        time: Vec::with_capacity(rows),
        output: Vec::with_capacity(rows),
        inputs: Vec::with_capacity(rows),
        segments: Vec::new(),
    };
    for rotor in rotors {
        for segment in &rotor.segments {
            let start = record.time.len();
            // A battery does not jump as a command does: over an interval it counts with both ends.
            let drop_at = |row: usize| {
                let next = (row + 1).min(segment.end - 1);
                let interval = rotor.time[next] - rotor.time[row];
                let weight = rotor.instrument.map_or(0.5, |it| end_weight(it.pole * interval));
                let held = |voltage: &[f64]| voltage[row] + weight * (voltage[next] - voltage[row]);
                rotor.voltage.as_ref().map_or(0.0, |voltage| full_voltage - held(voltage))
            };
            // `acting` is the row whose command the rotor obeys; before its delay has passed, the first one.
            let mut acting = segment.start;
            let heard = if delay > 0.0 {
                rotor.time[segment.start] + THRESHOLDS.unheard_intervals * rotor.interval
            } else {
                f64::NEG_INFINITY
            };
            for row in segment.clone() {
                let now = rotor.time[row];
                let rate = if now < heard { f64::NAN } else { rotor.rate[row] };
                while acting < row && rotor.time[acting + 1] + delay <= now {
                    acting += 1;
                }
                push(&mut record, now, rate, inputs(rotor.command[acting], drop_at(row)));
                let next = if row + 1 < segment.end { rotor.time[row + 1] } else { continue };
                while acting < row && rotor.time[acting + 1] + delay < next {
                    acting += 1;
                    if rotor.command[acting] != rotor.command[acting - 1] {
                        let switch = rotor.time[acting] + delay;
                        push(&mut record, switch, f64::NAN, inputs(rotor.command[acting], drop_at(row)));
                    }
                }
            }
            record.segments.push(start..record.time.len());
        }
    }
    record
}

/// [-] with which the end of an interval counts beside its beginning, of what moves in it as 1 - e^(-p s), for what follows
/// it with the same p: ∫ p e^(-p (T - s)) (1 - e^(-p s)) ds over (1 - e^(-p T))², `through` being p T.
fn end_weight(through: f64) -> f64 {
    let left = (-through).exp();
    let gone = 1.0 - left;
    // Evenly, and 1/12 of p T more, where the difference of the two terms drowns.
    if through.abs() < 1e-3 { 0.5 + through / 12.0 } else { (gone - through * left) / (gone * gone) }
}

fn push<const M: usize>(record: &mut Record<M>, time: f64, output: f64, inputs: [f64; M]) {
    record.time.push(time);
    record.output.push(output);
    record.inputs.push(inputs);
}
