//! Free run of a rotor: from command and battery to its rate, exact between samples where the law is linear.

use super::equations::{Equations, Hook};
use super::rotor_inputs::Held;
use super::rotor_state::RotorState;
use super::rotor_stride::{Stride, Strides};
use super::rotor_trace::{MOST_STATES, Readings, Remembered, RotorInput, RotorStart, RotorTrace, TakeDown};
use super::runge_kutta::runge_kutta;
use super::thresholds::THRESHOLDS;
use crate::cancel;
use crate::effect::{Point, RowResponse};

impl Equations {
    /// Runs a rotor freely over its inputs.
    pub fn simulate_rotor(&self, input: &RotorInput, start: &RotorStart, trace: &mut RotorTrace) {
        trace.clear();
        self.run_rotor(input, start, trace);
    }

    /// The same, for whom its sensor's readings [rad/s] are enough, one a row; answers what a stretch remembers that begins at once.
    pub fn rotor_readings(&self, input: &RotorInput, start: &RotorStart, out: &mut [f64]) -> Remembered {
        let mut readings = Readings { out: out.iter_mut(), end: Remembered::default() };
        self.run_rotor(input, start, &mut readings);
        readings.out.for_each(|out| *out = f64::NAN);
        readings.end
    }

    fn run_rotor(&self, input: &RotorInput, start: &RotorStart, trace: &mut impl TakeDown) {
        if self.command.iter().any(|hook| hook.memory().is_some()) {
            let (command, end) = self.remembered_command(input, start);
            let plain = Self { command: Vec::new(), ..self.clone() };
            plain.run_rotor(&RotorInput { command: &command, ..*input }, start, trace);
            return trace.finish_command(end);
        }
        let mut point = Point { side: input.side, ..self.constants };
        if self.hold_rotor(&mut point, input, (0, 0), &mut Held::default()).is_none() {
            return;
        }
        let state = self.initial_state(point, start);
        let follows_at_once = self.command_delay == 0.0 && start.rate_holds_until.is_none();
        let is_simple = follows_at_once && input.command_from.is_none() && !trace.wants_squares();
        if self.is_lag() && is_simple {
            self.simulate_lag(input, state, trace);
            return;
        }
        self.simulate_steps((input, start), point, state, trace);
    }

    /// The run of any rotor, in steps between the changes of what it is given.
    fn simulate_steps(
        &self,
        (input, start): (&RotorInput, &RotorStart),
        mut point: Point,
        mut state: RotorState,
        trace: &mut impl TakeDown,
    ) {
        let mut sensor = point;
        // A law without memory, one of the user's, may look at what changes from row to row.
        let sensor_looks = self.rotor_sensor.iter().any(|hook| hook.memory().is_none());
        let (mut strides, mut held) = (Strides::of(self), Held::default());
        // Index of the command in force: behind the row by the delay.
        let mut delayed = 0;
        let goes_on_until = start.goes_on_until(self.arrival(input));
        // Only where they are asked for: two divisions more a row.
        let wants_squares = trace.wants_squares();
        for row in 0..input.time.len() {
            cancel::check_at(row);
            if sensor_looks {
                delayed = self.in_force(input, delayed, input.time.get(row).copied());
                if self.hold_rotor(&mut sensor, input, (delayed, row), &mut Held::default()).is_none() {
                    return;
                }
            }
            trace.row(state.rate, self.sensed(&state, &mut sensor));
            let (Some(now), Some(next)) = (input.time.get(row), input.time.get(row + 1)) else { break };
            let mut from = *now;
            let (mut turned, mut squares) = (0.0, 0.0);
            while from < *next {
                let waits = start.rate.filter(|_| from < goes_on_until);
                let to = self.held_until(input, &mut delayed, (from, *next), waits.map(|_| goes_on_until));
                if self.hold_rotor(&mut point, input, (delayed, row), &mut held).is_none() {
                    return;
                }
                point.steady_rate = waits.unwrap_or(point.steady_rate);
                let (span, before) = (to - from, state.rate);
                let over = (span, trace.wants_means());
                let gone = self.go_through(&mut state, &mut point, &mut strides, over);
                turned += gone;
                // Laws move it from there, which nobody has seen.
                state.rate = waits.unwrap_or(state.rate);
                if wants_squares {
                    squares += self.squared_over(before, state.rate, point.steady_rate, gone, span);
                }
                from = to;
            }
            trace.interval(next - now, turned, squares);
        }
        trace.finish(state.rate, state.steady);
    }

    /// [-] what laws with a memory and the others make of the commands, row by row: they hang on nothing that moves; and the states in
    /// which that leaves them.
    fn remembered_command(
        &self,
        input: &RotorInput,
        start: &RotorStart,
    ) -> (Vec<f64>, [Option<f64>; MOST_STATES]) {
        let full = self.constants.full_voltage;
        let kept = start.before.unwrap_or_default();
        let mut states = kept.command.to_vec();
        states.resize(self.command.len().max(MOST_STATES), None);
        let mut shaped = Vec::with_capacity(input.command.len());
        let mut before = input.time.first().copied().unwrap_or(0.0) - kept.hole;
        for (row, (command, time)) in input.command.iter().zip(input.time).enumerate() {
            let battery_voltage = input.voltage.and_then(|voltage| voltage.get(row)).copied().unwrap_or(full);
            let mut point =
                Point { command: *command, battery_voltage, time: *time, side: input.side, ..self.constants };
            for (hook, state) in self.command.iter().zip(&mut states) {
                point.command += match hook.memory() {
                    Some(memory) => {
                        let now = state.map_or_else(
                            || memory.steady_state(&point),
                            |state| memory.advance(state, &point, time - before),
                        );
                        *state = Some(now);
                        memory.add(now, &point)
                    }
                    None => hook.add(&point),
                };
            }
            shaped.push(point.command);
            before = *time;
        }
        (shaped, std::array::from_fn(|at| states[at]))
    }

    /// Whether the rotor is a first-order lag, a dead time apart.
    #[inline]
    pub(super) fn is_lag(&self) -> bool {
        self.steady.is_empty() && self.acceleration.is_empty() && self.rotor_sensor.is_empty()
    }

    /// The integral of the squared rate over a `span` [s] in which the rate went from `before` to `after` and turned by `gone`.
    fn squared_over(&self, before: f64, after: f64, z: f64, gone: f64, span: f64) -> f64 {
        if self.is_lag() {
            // ω ω' = p (z ω - ω²), integrated.
            return z * gone - 0.5 * (after - before) * (after + before) / self.pole;
        }
        // As a straight line about its mean.
        gone * gone / span + span * (after - before).powi(2) / 12.0
    }

    /// The run of a rotor that is a first-order lag without dead time: the general way, with nothing in it
    /// that is not needed. A search for a grid asks for it thousands of times.
    fn simulate_lag(&self, input: &RotorInput, start: RotorState, trace: &mut impl TakeDown) {
        let mut point = Point { side: input.side, ..self.constants };
        let full = std::slice::from_ref(&self.constants.full_voltage);
        let (voltage, step) = input.voltage.map_or((full, 0), |voltage| (voltage, 1));
        let (mut rate, mut response) = (start.rate, RowResponse::of(self.pole));
        let spans = input.time.windows(2).zip(input.command).enumerate();
        cancel::check();
        for (row, (times, command)) in spans {
            trace.row(rate, rate);
            let Some(voltage) = voltage.get(row * step) else { return };
            let span = times[1] - times[0];
            let response = response.over(span);
            point.time = times[0];
            let steady = self.steady_rate_at(&mut point, *command, *voltage);
            let way = steady - rate;
            trace.interval(span, steady * span - way * response / self.pole, 0.0);
            rate += way * response;
        }
        trace.row(rate, rate);
        trace.finish(rate, start.steady);
    }

    /// The steady state of everything at a held point, but for what the start says.
    pub(super) fn initial_state(&self, first: Point, start: &RotorStart) -> RotorState {
        let mut point = first;
        point.propeller_rate = start.rate.unwrap_or(first.steady_rate);
        let mut state =
            RotorState { rate: point.propeller_rate, steady: [0.0; MOST_STATES], sensor: [0.0; MOST_STATES] };
        for (at, (hook, memory_state)) in self.steady.iter().zip(&mut state.steady).enumerate() {
            if let Some(memory) = hook.memory() {
                *memory_state = match start.before.and_then(|it| Some((*it.states.get(at)?, it.hole))) {
                    Some((state, hole)) => memory.advance(state, &point, hole),
                    None => memory.steady_state(&point),
                };
                if memory.is_slow() {
                    *memory_state += start.slow;
                }
                point.steady_rate += memory.add(*memory_state, &point);
            } else {
                point.steady_rate += hook.add(&point);
            }
        }
        if start.rate.is_none() {
            state.rate = point.steady_rate;
            point.propeller_rate = state.rate;
        }
        for (hook, memory_state) in self.rotor_sensor.iter().zip(&mut state.sensor) {
            point.propeller_rate += match hook.memory() {
                Some(memory) => {
                    *memory_state = memory.steady_state(&point);
                    memory.add(*memory_state, &point)
                }
                None => hook.add(&point),
            };
        }
        state
    }

    pub(super) fn sensed(&self, state: &RotorState, point: &mut Point) -> f64 {
        point.propeller_rate = state.rate;
        for (hook, memory_state) in self.rotor_sensor.iter().zip(&state.sensor) {
            point.propeller_rate += match hook.memory() {
                Some(memory) => memory.add(*memory_state, point),
                None => hook.add(point),
            };
        }
        point.propeller_rate
    }

    /// Advances every state over a span in which command and voltage hold; answers the angle turned [rad].
    pub(super) fn advance(
        &self,
        state: &mut RotorState,
        point: &mut Point,
        stride: &Stride,
        wants_mean: bool,
    ) -> f64 {
        let (step, held) = (stride.step, point.steady_rate);
        let wants_mean = wants_mean || !self.rotor_sensor.is_empty();
        let mut turned = 0.0;
        for left in (0..stride.count).rev() {
            let (before, all_before) = (state.rate, if stride.may_rest() { Some(*state) } else { None });
            point.propeller_rate = before;
            let z = self.steady_over(state, point, held, stride);
            state.rate = self.accelerate(before, point, z, stride);
            if wants_mean {
                // The slopes at both ends bend the straight line: the pole is what bends it most.
                let bend = self.pole * ((z[0] - before) - (z[2] - state.rate));
                let mean = 0.5 * (before + state.rate) + step * bend * (1.0 / 12.0);
                turned += step * mean;
                if !self.rotor_sensor.is_empty() {
                    (point.propeller_rate, point.steady_rate) = (mean, held);
                    self.advance_sensor(state, point, &stride.sensor);
                }
            }
            if all_before.is_some_and(|before| state.rests_at(&before)) {
                // What has settled stays so until something else is commanded.
                return turned + left as f64 * step * state.rate;
            }
        }
        turned
    }

    /// z at the begin, the middle and the end of a step, the memories on the way advanced.
    fn steady_over(&self, state: &mut RotorState, point: &mut Point, held: f64, stride: &Stride) -> [f64; 3] {
        let mut z = [held; 3];
        // Until a law remembers, z is the same all the way.
        let mut is_held = true;
        for ((hook, memory_state), transition) in
            self.steady.iter().zip(&mut state.steady).zip(&stride.half_steady)
        {
            let Some(memory) = hook.memory() else {
                if is_held {
                    point.steady_rate = z[0];
                    z = [z[0] + hook.add(point); 3];
                    continue;
                }
                for value in &mut z {
                    point.steady_rate = *value;
                    *value += hook.add(point);
                }
                continue;
            };
            is_held = false;
            let mut added = [0.0; 3];
            for (node, add) in added.iter_mut().enumerate() {
                if node > 0 {
                    point.steady_rate = 0.5 * (z[node - 1] + z[node]);
                    *memory_state = memory.advance_by(*memory_state, point, *transition);
                }
                point.steady_rate = z[node];
                *add = memory.add(*memory_state, point);
            }
            for (value, add) in z.iter_mut().zip(added) {
                *value += add;
            }
        }
        z
    }

    /// One classical Runge-Kutta step of the rate.
    fn accelerate(&self, rate: f64, point: &mut Point, z: [f64; 3], stride: &Stride) -> f64 {
        // [LPC16] Eq. (2).
        if self.acceleration.is_empty() {
            return rate + z.iter().zip(stride.weights).map(|(z, weight)| weight * (z - rate)).sum::<f64>();
        }
        let pole = self.pole;
        if let [Hook::Static(law, parameters)] = self.acceleration.as_slice() {
            // Most have one law, and it is asked for four times a step.
            let with_law = |rate: f64, z: f64| {
                (point.propeller_rate, point.steady_rate) = (rate, z);
                pole * (z - rate) + law(parameters, point)
            };
            return runge_kutta(with_law, rate, z, stride.step);
        }
        let with_laws = |rate: f64, z: f64| {
            (point.propeller_rate, point.steady_rate) = (rate, z);
            pole * (z - rate) + self.acceleration.iter().map(|hook| hook.add(point)).sum::<f64>()
        };
        runge_kutta(with_laws, rate, z, stride.step)
    }

    /// Whether a rotor's telemetry remembers.
    pub(super) fn senses_rotor_late(&self) -> bool {
        self.rotor_sensor.iter().any(|hook| hook.memory().is_some())
    }

    /// [rad/s] what telemetry shows at the end of these rates of a rotor [rad/s], of which the first had lasted.
    pub(super) fn shown_of_ramp(&self, time: &[f64], rates: &[f64]) -> f64 {
        let mut point = self.constants;
        let mut state =
            self.initial_state(point, &RotorStart { rate: rates.first().copied(), ..RotorStart::default() });
        for (times, rates) in time.windows(2).zip(rates.windows(2)) {
            let transitions = self.sensor_transitions((times[1] - times[0]) / THRESHOLDS.ramp_steps as f64);
            for part in 0..THRESHOLDS.ramp_steps {
                let share = (part as f64 + 0.5) / THRESHOLDS.ramp_steps as f64;
                point.propeller_rate = rates[0] + (rates[1] - rates[0]) * share;
                self.advance_sensor(&mut state, &mut point, &transitions);
            }
            state.rate = rates[1];
        }
        self.sensed(&state, &mut point)
    }

    fn advance_sensor(&self, state: &mut RotorState, mean: &mut Point, transitions: &[f64; MOST_STATES]) {
        for ((hook, memory_state), transition) in
            self.rotor_sensor.iter().zip(&mut state.sensor).zip(transitions)
        {
            mean.propeller_rate += match hook.memory() {
                Some(memory) => {
                    *memory_state = memory.advance_by(*memory_state, mean, *transition);
                    memory.add(*memory_state, mean)
                }
                None => hook.add(mean),
            };
        }
    }
}
