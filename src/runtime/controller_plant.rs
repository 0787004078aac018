//! What a controller must know of the plant, from a model.

use std::path::Path;

use super::ProcessError;
use super::command_source::CommandSource;
use super::experiment_plan::ExperimentPlan;
use crate::bench::BenchConfig;
use crate::control::design::LoopPlant;
use crate::control::{Allocator, Compensation, PlantParameters};
use crate::effect::{Site, Term};
use crate::model::Model;

/// The plant of `model`, and what of its effects a controller can cancel.
///
/// # Errors
/// [`ProcessError::Plant`] when no controller can be built on it: its static curve falls somewhere, or does not reach hover.
pub fn of_model(model: &Model) -> Result<(PlantParameters, Compensation), ProcessError> {
    let actuator = &model.actuator;
    let curve = |power: usize| actuator.steady_rate.get(power).copied().unwrap_or(0.0);
    let value = |site, term, index: usize| model.term(site, term)?.get(index).copied();
    let of = |site, term| value(site, term, 0).unwrap_or(0.0);
    let plant = PlantParameters {
        inertia: model.body.inertia,
        arm: model.body.arm,
        pole: actuator.pole,
        // The tangent of f = c ω² at hover. [LPC16] Eq. (13).
        thrust_slope: 2.0 * actuator.thrust_coefficient * actuator.hover_rate,
        thrust_coefficient: actuator.thrust_coefficient,
        hover_rate: actuator.hover_rate,
        steady_rate_quadratic: curve(2),
        steady_rate_linear: curve(1),
        voltage_gain: actuator.voltage_gain + of(Site::SteadyRate, Term::VoltageDrop),
        full_voltage: actuator.full_voltage,
    };
    let nothing = Compensation::default();
    let compensation = Compensation {
        pendulum_moment: of(Site::Torque, Term::Pendulum),
        pendulum_offset: value(Site::Torque, Term::Pendulum, 1).unwrap_or(0.0),
        stiffness: of(Site::Torque, Term::Stiffness),
        constant_torque: of(Site::Torque, Term::Constant),
        coulomb_torque: of(Site::Torque, Term::CoulombFriction),
        coulomb_rate: value(Site::Torque, Term::CoulombFriction, 1).unwrap_or(nothing.coulomb_rate),
        viscous_friction: of(Site::Torque, Term::ViscousFriction),
        quadratic_drag: of(Site::Torque, Term::QuadraticDrag),
        dead_zone: of(Site::Command, Term::DeadZone),
        command_limit: model.greatest_command().unwrap_or(nothing.command_limit),
        steady_rate_offset: curve(0) + of(Site::SteadyRate, Term::Constant),
        steady_rate_cubic: of(Site::SteadyRate, Term::Cubic),
        cubic_center: model.hover_command(),
        steady_rate_higher: [curve(3), curve(4), curve(5)],
        scales_with_battery: model.term(Site::Command, Term::VoltageScaling).is_some(),
    };
    Allocator::build(&plant, &compensation)
        .map_err(|error| ProcessError::Plant { model: model.name.clone(), error })?;
    Ok((plant, compensation))
}

/// The linear plant of `model` at rest at `angle` [rad], with the effects that change the loop: delays, lags, and
/// the slopes of the torques on the body.
#[must_use]
pub fn loop_of_model(model: &Model, plant: &PlantParameters, known: &Compensation, angle: f64) -> LoopPlant {
    let value = |site, term| model.term(site, term)?.first().copied();
    // Of a lag of the rotors' rate the loop knows nothing: the controller does not read it.
    let delays = [Site::Command, Site::Torque].map(|site| value(site, Term::DeadTime));
    let lags = [Site::SteadyRate, Site::Torque].map(|site| value(site, Term::Lag));
    let axial = value(Site::Thrust, Term::AxialDamping).unwrap_or(0.0);
    let mut linear = LoopPlant {
        delay_s: delays.into_iter().flatten().sum(),
        lags: lags.into_iter().flatten().collect(),
        gyro_pole: value(Site::BodyRateSensor, Term::Lag),
        ..LoopPlant::new(plant)
    };
    // Each rotor loses k c ω_p v of its thrust at its own speed v = ± d ω_b.
    linear.damping += 2.0 * plant.arm * plant.arm * axial * plant.thrust_coefficient * plant.hover_rate;
    linear.with_torques(known, angle)
}

/// The controller of a bench with its reference, made for the bench's model.
///
/// # Errors
/// A model that cannot be read or inverted; a controller that cannot be built.
pub fn command_source(config: &BenchConfig) -> Result<CommandSource, ProcessError> {
    command_source_of(config, &Model::load(Path::new(&config.model))?, None)
}

/// The command source of a bench of `model`: its controller, or what `plan` says.
///
/// # Errors
/// A model that cannot be inverted; a controller or experiment that cannot be built.
pub fn command_source_of(
    config: &BenchConfig,
    model: &Model,
    plan: Option<&ExperimentPlan>,
) -> Result<CommandSource, ProcessError> {
    let experiment = plan.map(|plan| plan.experiment.build(config.period_s)).transpose()?;
    if let (Some(experiment), Some(ExperimentPlan { closed_loop: false, .. })) = (&experiment, plan) {
        return Ok(CommandSource::experiment(experiment.clone()));
    }
    let (plant, known) = of_model(model)?;
    let controller = config.controller.build_compensated(&plant, &known, config.period_s)?;
    let source = CommandSource::controller(controller, config.controller.reference.build(config.period_s)?);
    Ok(match experiment {
        Some(experiment) => source.excited_by(experiment),
        None => source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Actuator;

    #[test]
    fn the_papers_model_gives_the_papers_plant() {
        let (plant, known) = of_model(&Model::paper()).expect("a parabola");
        let paper = PlantParameters::paper();
        let close = |ours: f64, printed: f64| (ours - printed).abs() <= 1e-12 * printed.abs();
        assert!(close(plant.inertia, paper.inertia) && close(plant.arm, paper.arm));
        assert!(close(plant.pole, paper.pole) && close(plant.thrust_slope, paper.thrust_slope));
        assert!(close(plant.thrust_coefficient, paper.thrust_coefficient));
        assert!(close(plant.hover_rate, paper.hover_rate));
        assert!(close(plant.steady_rate_quadratic, paper.steady_rate_quadratic));
        assert!(close(plant.steady_rate_linear, paper.steady_rate_linear));
        assert!(close(plant.voltage_gain, paper.voltage_gain));
        assert!(close(plant.full_voltage, paper.full_voltage));
        assert!(!known.acts_on_body() && !known.scales_with_battery);
    }

    /// What comes of a model with this static curve: the greatest error [rad/s] of its inverse over the commands from 0 to 1.
    fn inverse_error(steady_rate: &[f64], hover_rate: f64) -> Result<f64, ProcessError> {
        let mut model = Model::paper();
        model.actuator =
            Actuator { steady_rate: steady_rate.to_vec(), hover_rate, voltage_gain: 0.0, ..model.actuator };
        let (plant, known) = of_model(&model)?;
        let allocator = Allocator::build(&plant, &known)?;
        let error = |difference: f64| {
            let allocation = allocator.allocate(difference, plant.full_voltage);
            let is = allocation.rotor.map(|u| model.steady_rate(u));
            let wanted = [hover_rate + 0.5 * difference, hover_rate - 0.5 * difference];
            let of =
                |rotor: usize| if allocation.saturated { 0.0 } else { (is[rotor] - wanted[rotor]).abs() };
            of(0).max(of(1))
        };
        Ok((-200..=200).map(|step| error(0.01 * f64::from(step) * hover_rate)).fold(0.0, f64::max))
    }

    /// The first was identified on a bench; its parabola alone falls from 0.6 on. The others: degree 4, degree 5, and one that is level
    /// for a moment.
    #[test]
    fn a_curve_of_any_degree_is_inverted_where_it_rises() {
        let curves: [&[f64]; 4] = [
            &[0.0, 5588.1, -4663.1, 2534.3],
            &[0.0, 2500.0, -1800.0, 400.0, 300.0],
            &[5.0, 1500.0, 200.0, -300.0, 100.0, -80.0],
            &[0.0, 3010.0, -6000.0, 4000.0],
        ];
        for curve in curves {
            let hover = 0.5 * crate::model::polynomial(curve, 1.0);
            let error = inverse_error(curve, hover).expect("it rises");
            assert!(error < 1e-6, "{curve:?}: {error} rad/s");
        }
    }

    #[test]
    fn a_curve_that_falls_is_refused_by_where_it_does() {
        let said = |curve: &[f64], hover| inverse_error(curve, hover).expect_err("refused").to_string();
        // g' = 3000 (1 - 4 u + 3.96 u²): zero at 0.4546 and 0.5555.
        let dips = said(&[0.0, 3000.0, -6000.0, 3960.0], 600.0);
        assert!(dips.starts_with("model `paper`: g(u)") && dips.contains("u = 0.455 and 0.555"), "{dips}");
        assert!(dips.contains("`identify --degree 2`"), "{dips}");
        let turns = said(&[0.0, 1000.0, -600.0], 300.0);
        assert!(turns.contains("u = 0.834 and 1.000") && turns.contains("`identify --degree 1`"), "{turns}");
        let weak = said(&[0.0, 1000.0, 400.0, -300.0], 1150.0);
        assert!(weak.contains("hover_rate is 1150: it must be below g(1)"), "{weak}");
    }
}
