//! Whether an impulse shows in the angle, where nobody says that there was one.

use super::impulse_response::Moment;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::{MEDIAN_OF_NORMAL, median};

/// [rad] the largest angle of a run and the usual one (rms) before `struck_s` [s], where the one is too like the other for an impulse to
/// be seen in it. `None` where it stands out, or too little lies before it to tell.
pub(super) fn nothing_stands_out(moments: &[Moment], struck_s: f64) -> Option<(f64, f64)> {
    let from_s = moments.first()?.time;
    if struck_s - from_s < THRESHOLDS.shortest_answer_s {
        return None;
    }
    let size = |moment: &Moment| moment.angle.abs();
    let largest = moments.iter().map(size).fold(0.0, f64::max);
    // The median, since a body may swing when the rotors start.
    let before = moments.iter().take_while(|moment| moment.time < struck_s);
    let usual = median(before.map(size))? / MEDIAN_OF_NORMAL;
    (largest < THRESHOLDS.strike_over_usual * usual).then_some((largest, usual))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run of 10 s at 50 Hz whose angle wanders by a milliradian, with a swing of `swing` [rad] from 6 s on.
    fn run(swing: f64) -> Vec<Moment> {
        let angle = |time: f64| {
            let away = time - 6.0;
            let noise = 1.4e-3 * ((7.3 * time).sin() + (12.9 * time + 1.0).sin()) / 1.4;
            noise + if away > 0.0 { swing * (-away).exp() * (3.0 * away).sin() } else { 0.0 }
        };
        let moment = |time: f64| Moment {
            time,
            angle: angle(time),
            torque: 0.0,
            estimate: 0.0,
            disturbance: f64::NAN,
        };
        (0..500).map(|period| moment(0.02 * f64::from(period))).collect()
    }

    #[test]
    fn noise_is_no_impulse_and_a_swing_is() {
        let (largest, usual) = nothing_stands_out(&run(0.0), 6.0).expect("noise alone");
        assert!(largest > usual && usual > 5e-4, "{largest} {usual}");
        assert_eq!(nothing_stands_out(&run(0.1), 6.0), None);
        // Struck at once, there is nothing to hold it against.
        assert_eq!(nothing_stands_out(&run(0.0), 0.2), None);
    }
}
