//! Which of a vehicle's outputs drives which motor, by its parameters.

use std::collections::HashMap;

/// Motors that ArduPilot counts, and their functions: 33 to 40, 82 to 85.
const FUNCTIONS: [(u32, u32); 2] = [(33, 8), (82, 4)];
/// Outputs in an `RCOU` message.
const OUTPUTS: u32 = 14;

/// What drives the motors.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Motors {
    /// Which output each motor has, from 1; in the motors' order.
    outputs: Vec<Option<u32>>,
    /// [µs] pulses of a motor at rest and at full throttle.
    pulses: (f64, f64),
}

impl Motors {
    /// From the parameters `SERVOn_FUNCTION` and those of pulses.
    pub(super) fn new(parameters: &HashMap<String, f64>) -> Self {
        let number = |name: &str| parameters.get(name).copied();
        let output_of = |function: u32| {
            (1..=OUTPUTS)
                .find(|output| number(&format!("SERVO{output}_FUNCTION")) == Some(f64::from(function)))
        };
        let functions = FUNCTIONS.iter().flat_map(|(first, count)| *first..first + count);
        let mut outputs: Vec<Option<u32>> = functions.map(output_of).collect();
        while outputs.last() == Some(&None) {
            outputs.pop();
        }
        // A plane that hovers has parameters of the same meaning with another beginning.
        let either = |name: &str| number(&format!("MOT_{name}")).or_else(|| number(&format!("Q_M_{name}")));
        // With DShot, 4 to 7, the outputs are written as pulses of 1000 to 2000 µs, whatever the parameters of pulses say.
        let digital = either("PWM_TYPE").is_some_and(|kind| (4.0..8.0).contains(&kind));
        let set = either("PWM_MIN")
            .zip(either("PWM_MAX"))
            .filter(|(low, high)| !digital && *low > 0.0 && high > low);
        Self { outputs, pulses: set.unwrap_or((1_000.0, 2_000.0)) }
    }

    /// The motors from 0, each with the name of the output that drives it in `RCOU`.
    pub(super) fn commands(&self) -> impl Iterator<Item = (usize, String)> {
        let outputs = self.outputs.iter().enumerate();
        outputs.filter_map(|(motor, output)| output.map(|output| (motor, format!("C{output}"))))
    }

    /// The motor from 0 whose ESC reports as this instance: they are counted by outputs, from 0.
    pub(super) fn of_esc(&self, instance: u8) -> Option<usize> {
        self.outputs.iter().position(|output| *output == Some(u32::from(instance) + 1))
    }

    /// The command, 0 to 1, of a pulse [µs].
    pub(super) fn command(&self, pulse: f64) -> f64 {
        let (low, high) = self.pulses;
        (pulse - low) / (high - low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motors(parameters: &[(&str, f64)]) -> Motors {
        Motors::new(&parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect())
    }

    #[test]
    fn outputs_are_the_motors_that_the_parameters_say() {
        let motors = motors(&[
            ("SERVO1_FUNCTION", 4.0),
            ("SERVO9_FUNCTION", 33.0),
            ("SERVO10_FUNCTION", 36.0),
            ("MOT_PWM_TYPE", 0.0),
            ("MOT_PWM_MIN", 1_100.0),
            ("MOT_PWM_MAX", 1_900.0),
        ]);
        let commands: Vec<_> = motors.commands().collect();
        assert_eq!(commands, [(0, "C9".to_owned()), (3, "C10".to_owned())]);
        assert_eq!([motors.of_esc(8), motors.of_esc(9), motors.of_esc(0)], [Some(0), Some(3), None]);
        assert_eq!([1_100.0, 1_500.0, 1_900.0].map(|pulse| motors.command(pulse)), [0.0, 0.5, 1.0]);
    }

    #[test]
    fn dshot_has_pulses_of_its_own() {
        let motors = motors(&[
            ("MOT_PWM_TYPE", 6.0),
            ("MOT_PWM_MIN", 1_100.0),
            ("MOT_PWM_MAX", 1_900.0),
            ("SERVO1_FUNCTION", 33.0),
        ]);
        assert_eq!([1_000.0, 1_250.0, 2_000.0].map(|pulse| motors.command(pulse)), [0.0, 0.25, 1.0]);
    }
}
