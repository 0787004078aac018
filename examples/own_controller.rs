//! A controller of your own, run on the emulated bench in lockstep: virtual time, bit for bit the same each run.
//!
//!     cargo run --example own_controller

use std::error::Error;

use rotorbench::bench::BenchConfig;
use rotorbench::control::{Allocator, Compensation, Controller, MoveConfig, PlantParameters};
use rotorbench::runtime::lockstep::{Slot, run_controller};
use rotorbench::signal::{Applied, Command, Reference, Sensors};

/// Two gains, on the integrated gyro: a PD controller.
struct Pd {
    allocator: Allocator,
    plant: PlantParameters,
    period_s: f64,
}

impl Controller for Pd {
    /// [rad] the integrated angle.
    type State = f64;

    fn start(&self) -> f64 {
        0.0
    }

    fn step(&self, angle: &mut f64, sensors: &Sensors, wanted: &Reference, applied: &Applied) -> Command {
        let rate = if sensors.body_rate.is_good() { sensors.body_rate.value } else { 0.0 };
        // While the guard lets nothing through, somebody holds the body where the reference begins.
        *angle = if applied.command_sequence == 0 { wanted.angle } else { *angle + rate * self.period_s };
        let torque = 1.0 * (wanted.angle - *angle) - 0.3 * (rate - wanted.rate); // [N m]
        // From torque to the difference of both rates [rad/s], and from there to both commands.
        let difference = torque / (self.plant.inertia * self.plant.torque_gain());
        let battery = &sensors.battery_voltage;
        let voltage = if battery.is_good() { battery.value } else { self.plant.full_voltage };
        Command { rotor: self.allocator.allocate(difference, voltage).rotor, torque, ..Command::default() }
    }
}

/// Prints the result.
pub fn main() -> Result<(), Box<dyn Error>> {
    let slots = run()?;
    for slot in slots.iter().step_by(50) {
        println!(
            "{:5.1} s  angle {:7.4} rad  rotors {:.3?}",
            slot.time, slot.truth.body_angle, slot.applied.rotor
        );
    }
    Ok(())
}

/// Ten seconds with a slew to 0.3 rad on the way.
pub fn run() -> Result<Vec<Slot>, Box<dyn Error>> {
    let mut bench = BenchConfig::default();
    bench.controller.reference.moves.push(MoveConfig { at_s: 5.0, angle_rad: 0.3, duration_s: 1.5 });
    let plant = PlantParameters::paper();
    let allocator = Allocator::build(&plant, &Compensation::default())?;
    let controller = Pd { allocator, plant, period_s: bench.period_s };
    Ok(run_controller(&bench, &controller, 10.0)?)
}
