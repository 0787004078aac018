//! From rotor logs to the record that the pole is fitted to: which inputs, and with which delay.

use super::pole::Record;
use super::rotor_log::RotorLog;

/// The record of all `rotors`, each stretch by itself. `inputs(u, drop)` makes the inputs from the command [-]
/// and the voltage drop v_bmax - v_b [V]. Commands act `delay` [s] late, exactly: where one changes between two
/// samples, the record gets an unscored row at that instant.
pub(super) fn record_of<const M: usize>(
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
            // A battery does not jump as a command does: over an interval it counts with the mean of both ends.
            let drop_at = |row: usize| {
                let next = (row + 1).min(segment.end - 1);
                let mean = |voltage: &Vec<f64>| 0.5 * (voltage[row] + voltage[next]);
                rotor.voltage.as_ref().map_or(0.0, |voltage| full_voltage - mean(voltage))
            };
            // `acting` is the row whose command the rotor obeys; before its delay has passed, the first one.
            let mut acting = segment.start;
            for row in segment.clone() {
                let now = rotor.time[row];
                while acting < row && rotor.time[acting + 1] + delay <= now {
                    acting += 1;
                }
                push(&mut record, now, rotor.rate[row], inputs(rotor.command[acting], drop_at(row)));
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

fn push<const M: usize>(record: &mut Record<M>, time: f64, output: f64, inputs: [f64; M]) {
    record.time.push(time);
    record.output.push(output);
    record.inputs.push(inputs);
}
