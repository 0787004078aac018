//! Memories of a delay: commands under way, and torque that has not yet reached the body.

use std::collections::VecDeque;

/// Commands that left the guard and have not reached the ESC.
#[derive(Debug, Clone)]
pub(super) struct CommandLine {
    delay_ns: u64,
    under_way: VecDeque<(u64, f64)>,
    arrived: f64,
}

impl CommandLine {
    /// Room for this many commands under way; beyond it the newest replaces the last one that set out.
    const CAPACITY: usize = 1024;

    pub fn new(delay_ns: u64) -> Self {
        Self { delay_ns, under_way: VecDeque::with_capacity(Self::CAPACITY), arrived: 0.0 }
    }

    /// A command sets out at `now_ns`.
    pub fn send(&mut self, now_ns: u64, command: f64) {
        let due = now_ns.saturating_add(self.delay_ns);
        if self.under_way.len() == Self::CAPACITY {
            self.under_way.pop_back();
        }
        self.under_way.push_back((due, command));
        self.arrive(now_ns);
    }

    /// Everything due at `now_ns` has arrived.
    pub fn arrive(&mut self, now_ns: u64) {
        while let Some(&(due, command)) = self.under_way.front() {
            if due > now_ns {
                break;
            }
            self.arrived = command;
            self.under_way.pop_front();
        }
    }

    /// The ESC stops its rotor and forgets what is under way.
    pub fn stop(&mut self) {
        self.under_way.clear();
        self.arrived = 0.0;
    }

    /// [ns] when the next command arrives; `u64::MAX` = none is under way.
    pub fn next_ns(&self) -> u64 {
        self.under_way.front().map_or(u64::MAX, |&(due, _)| due)
    }

    /// [-] command at the ESC.
    pub fn arrived(&self) -> f64 {
        self.arrived
    }
}

/// The recent past of the rotors' torque, read by linear interpolation.
#[derive(Debug, Clone)]
pub(super) struct TorqueHistory {
    span: f64,
    points: VecDeque<(f64, f64)>,
}

impl TorqueHistory {
    /// Room for a delay of 0.2 s at an integration step of 50 µs.
    const CAPACITY: usize = 4096;

    pub fn new(delay: f64) -> Self {
        let capacity = if delay > 0.0 { Self::CAPACITY } else { 0 };
        Self { span: delay, points: VecDeque::with_capacity(capacity) }
    }

    pub fn push(&mut self, time: f64, torque: f64) {
        // Two points must stay at or before the oldest time that may still be asked for.
        while self.points.len() == Self::CAPACITY
            || self.points.get(1).is_some_and(|&(second, _)| second < time - 1.1 * self.span)
        {
            self.points.pop_front();
        }
        self.points.push_back((time, torque));
    }

    /// [N m] torque at `time` [s]; zero before the beginning.
    pub fn at(&self, time: f64) -> f64 {
        let after = self.points.partition_point(|&(t, _)| t <= time);
        match (after.checked_sub(1).and_then(|index| self.points.get(index)), self.points.get(after)) {
            (Some(&(t0, v0)), Some(&(t1, v1))) => v0 + (v1 - v0) * ((time - t0) / (t1 - t0)),
            (Some(&(_, value)), None) => value,
            (None, _) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_arrives_exactly_after_its_delay() {
        let mut line = CommandLine::new(30);
        line.send(100, 0.5);
        assert_eq!(line.next_ns(), 130);
        line.arrive(129);
        assert_eq!(line.arrived(), 0.0);
        line.arrive(130);
        assert_eq!(line.arrived(), 0.5);
        assert_eq!(line.next_ns(), u64::MAX);
    }

    #[test]
    fn a_flood_of_commands_ends_with_the_newest() {
        let mut line = CommandLine::new(1000);
        for index in 0..5000 {
            line.send(index, index as f64);
        }
        line.arrive(u64::MAX);
        assert_eq!(line.arrived(), 4999.0);
    }

    #[test]
    fn torque_is_read_back_as_it_was() {
        let mut history = TorqueHistory::new(0.02);
        for index in 0..1000 {
            let time = f64::from(index) * 0.0005;
            history.push(time, 3.0 * time);
        }
        assert!((history.at(0.4995 - 0.02) - 3.0 * 0.4795).abs() < 1e-12);
        assert_eq!(history.at(-0.1), 0.0);
    }
}
