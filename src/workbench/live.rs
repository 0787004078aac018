//! The running bench: what it measures and what left for the rotors, over the last minute, and what its guard says. It listens
//! through shared memory, as `monitor` does, for as long as a page looks; it has no way to say anything.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::thresholds::THRESHOLDS;
use crate::bench::BenchConfig;
use crate::clock;
use crate::report::findings::explained;
use crate::report::guard;
use crate::runtime::monitor::View;
use crate::signal::Channel;

/// Between two tries to find a bench.
const TRY: Duration = Duration::from_millis(500);

/// What is known of the bench.
#[derive(Debug)]
pub(super) struct Live {
    config: BenchConfig,
    file: Option<PathBuf>,
    heard: Mutex<Heard>,
    /// The clock of all moments, whoever listened to them.
    began: Instant,
}

#[derive(Debug, Default)]
struct Heard {
    /// When a page asked last.
    asked: Option<Instant>,
    is_listening: bool,
    listener: Option<JoinHandle<()>>,
    /// Why there is no bench to listen to.
    why: Option<String>,
    /// The newest of everything.
    now: Value,
    events: Vec<String>,
    /// Moments, each with its number, its time [s] and a value for each column.
    moments: VecDeque<(u64, f64, Vec<Option<f32>>)>,
    count: u64,
}

/// Columns of a moment: the sensors, then what left for the rotors, then the disturbance torque that the controller estimates.
fn columns() -> Vec<(&'static str, &'static str)> {
    let sensors = Channel::ALL.into_iter().map(|channel| (channel.column(), channel.unit()));
    let others = [("applied_1", "-"), ("applied_2", "-"), ("disturbance_torque_nm", "N m")];
    sensors.chain(others).collect()
}

impl Live {
    pub fn new(config: BenchConfig, file: Option<PathBuf>) -> Arc<Self> {
        Arc::new(Self { config, file, heard: Mutex::default(), began: Instant::now() })
    }

    /// The bench, and the file that says it.
    pub fn bench(&self) -> (&BenchConfig, Option<&Path>) {
        (&self.config, self.file.as_deref())
    }

    /// What is known now; moments behind number `since` only. Who asks has it listened to from then on.
    pub fn look(self: &Arc<Self>, since: u64) -> Value {
        let mut heard = self.heard();
        heard.asked = Some(Instant::now());
        if !heard.is_listening {
            heard.is_listening = true;
            let listener = Arc::clone(self);
            let spawned = thread::Builder::new().name("live".to_owned()).spawn(move || listener.listen());
            match spawned {
                Ok(thread) => heard.listener = Some(thread),
                Err(error) => {
                    heard.is_listening = false;
                    heard.why = Some(error.to_string());
                }
            }
        }
        let fresh = heard.moments.iter().filter(|(number, ..)| *number > since);
        let moments: Vec<Value> = fresh.map(|(_, at, values)| json!([at, values])).collect();
        let columns: Vec<Value> =
            columns().into_iter().map(|(name, unit)| json!({ "name": name, "unit": unit })).collect();
        json!({
            "bench": self.config.name,
            "why": heard.why,
            "now": heard.now,
            "events": heard.events,
            "columns": columns,
            "moments": moments,
            "count": heard.count,
            "kept_s": THRESHOLDS.live_s,
        })
    }

    /// Ends the listening: nothing of it stays in shared memory.
    pub fn end(&self) {
        let listener = {
            let mut heard = self.heard();
            heard.asked = None;
            heard.listener.take()
        };
        if let Some(listener) = listener {
            // One that panicked has ended, too.
            let _ = listener.join();
        }
    }

    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether somebody still looks; says so in the same breath when nobody does.
    fn is_wanted(&self) -> bool {
        let mut heard = self.heard();
        let patience = Duration::from_secs(THRESHOLDS.live_asked_within_s);
        heard.is_listening = heard.asked.is_some_and(|asked| asked.elapsed() < patience);
        if !heard.is_listening {
            // Who looks again is not shown the past as the present.
            heard.now = Value::Null;
        }
        heard.is_listening
    }

    fn listen(&self) {
        let mut view = None;
        // Nothing is known of the time without a listener: no curve leads across it.
        self.heard().keep(self.began.elapsed().as_secs_f64(), vec![None; columns().len()]);
        while self.is_wanted() {
            let Some(joined) = &mut view else {
                match View::join(&self.config) {
                    Ok(joined) => view = Some(joined),
                    Err(error) => {
                        self.heard().why = Some(explained(&error));
                        thread::sleep(TRY);
                    }
                }
                continue;
            };
            joined.listen();
            self.keep(joined, self.began.elapsed().as_secs_f64());
            thread::sleep(Duration::from_millis(THRESHOLDS.live_period_ms));
        }
    }

    fn keep(&self, view: &View, at_s: f64) {
        let (sensors, command, applied) = &view.newest;
        let alive = || view.processes.iter().filter(|process| process.is_alive(clock::monotonic_ns()));
        let is_running = alive().next().is_some();
        let processes: Vec<Value> = alive()
            .map(|process| {
                json!({
                    "role": process.role.name(),
                    "rate_hz": process.rate,
                    "lateness_us": process.shown_us.0,
                    "response_us": process.shown_us.1,
                    "skipped": process.cycle.skipped,
                    "overruns": process.cycle.overruns,
                })
            })
            .collect();
        let known = |is_there: bool, value: f64| Some(value as f32).filter(|it| is_there && it.is_finite());
        let mut values: Vec<Option<f32>> = Channel::ALL
            .into_iter()
            .map(|channel| channel.of(sensors))
            .map(|sample| known(is_running && sample.stamp_ns != 0 && sample.is_good(), sample.value))
            .collect();
        values.extend(applied.rotor.map(|rotor| known(is_running && applied.stamp_ns != 0, rotor)));
        values.push(known(is_running && command.stamp_ns != 0, command.estimate.disturbance_torque));
        let mut heard = self.heard();
        heard.why = None;
        let state = view.state().to_string();
        heard.now = json!({ "is_running": is_running, "state": state, "processes": processes });
        heard.events = view.said.iter().map(guard::event).collect();
        heard.keep(at_s, values);
    }
}

impl Heard {
    /// Keeps a moment, and those of the last minute.
    fn keep(&mut self, at_s: f64, values: Vec<Option<f32>>) {
        self.count += 1;
        self.moments.push_back((self.count, at_s, values));
        while self.moments.front().is_some_and(|(_, at, _)| at_s - at > THRESHOLDS.live_s) {
            self.moments.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whoever looks again, after nobody did, sees the last minute: its times rise, and an empty moment stands where nobody listened.
    #[test]
    fn moments_of_two_listeners_are_of_one_clock() {
        let live =
            Live::new(BenchConfig { name: "nobody-flies-it".to_owned(), ..BenchConfig::default() }, None);
        let values = || vec![Some(1.0); columns().len()];
        live.heard().keep(-2.0 * THRESHOLDS.live_s, values());
        for _ in 0..2 {
            live.heard().keep(live.began.elapsed().as_secs_f64(), values());
            let before = live.heard().count;
            live.look(0);
            while live.heard().count == before {
                thread::sleep(Duration::from_millis(1));
            }
            live.end();
        }
        let heard = live.heard();
        assert!(heard.moments.iter().is_sorted_by(|a, b| a.1 <= b.1), "{:?}", heard.moments);
        let mut known: Vec<bool> = heard.moments.iter().map(|(.., values)| values[0].is_some()).collect();
        // A bench that nobody flies adds empty ones.
        known.dedup();
        assert_eq!(known, [true, false, true, false], "and what is older than a minute has gone");
        assert!(heard.now.is_null());
    }
}
