//! cyclictest beside us: called with what we were granted, each of its values taken in.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use hdrhistogram::Histogram;

use crate::rt::{self, RealTimeConfig, Shutdown};
use crate::screening::Finding;

/// Its name.
pub(super) const NAME: &str = "cyclictest";

/// An installed cyclictest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cyclictest {
    program: String,
}

impl Cyclictest {
    /// The one that the search path finds, or where Debian puts it for root.
    #[must_use]
    pub fn find() -> Option<Self> {
        [NAME, "/usr/sbin/cyclictest"].into_iter().find_map(Self::at)
    }

    /// `program`, if it can be called.
    #[must_use]
    pub fn at(program: &str) -> Option<Self> {
        let called = Command::new(program).arg("--help").stdin(Stdio::null()).output().ok()?;
        let said = [called.stdout, called.stderr].concat();
        let is_it = String::from_utf8_lossy(&said).contains(NAME);
        is_it.then(|| Self { program: program.to_owned() })
    }

    /// How to call it for `loops` periods with `settings`: one thread, all values, in nanoseconds, nothing on the machine
    /// tuned that we do not tune either.
    pub(crate) fn call(&self, settings: &RealTimeConfig, period_ns: u64, loops: u64) -> Vec<String> {
        let mut call: Vec<String> =
            [&self.program, "-q", "-v", "-N", "-t1", "--default-system"].map(str::to_owned).into();
        call.extend(["-i".to_owned(), (period_ns / 1000).to_string(), "-l".to_owned(), loops.to_string()]);
        match settings.priority {
            0 => call.push("--policy=other".to_owned()),
            priority => call.extend(["-p".to_owned(), priority.to_string()]),
        }
        if settings.lock_memory {
            call.push("-m".to_owned());
        }
        if let Some(processor) = settings.processor {
            call.extend(["-a".to_owned(), processor.to_string()]);
        }
        call
    }
}

/// Runs it to its end or until `shutdown`: its latencies [ns], or why there are none.
pub(crate) fn run(call: &[String], shutdown: &Shutdown) -> Result<Histogram<u64>, Finding> {
    let (program, arguments) =
        call.split_first().map_or((NAME, call), |(first, rest)| (first.as_str(), rest));
    let failed = |reason: &str| {
        Finding::new("cyclictest_failed", NAME).with("program", program).with("reason", reason)
    };
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| failed(&error.to_string()))?;
    let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
        return Err(failed("no output"));
    };
    let (sender, receiver) = mpsc::channel();
    let said = std::thread::scope(|scope| {
        scope.spawn(move || sender.send(read_values(output)));
        let words = scope.spawn(move || {
            let mut text = String::new();
            let _ = BufReader::new(errors).read_to_string(&mut text);
            text
        });
        let histogram = loop {
            match receiver.recv_timeout(Duration::from_millis(50)) {
                Ok(histogram) => break histogram,
                Err(mpsc::RecvTimeoutError::Disconnected) => break rt::histogram(),
                Err(mpsc::RecvTimeoutError::Timeout) if shutdown.is_requested() => {
                    // Its output ends with it, and what it said so far counts.
                    let _ = child.kill();
                }
                Err(mpsc::RecvTimeoutError::Timeout) => {}
            }
        };
        (histogram, words.join().unwrap_or_default())
    });
    let status = child.wait().map_err(|error| failed(&error.to_string()))?;
    let (histogram, words) = said;
    if histogram.is_empty() {
        let said = words.split_whitespace().collect::<Vec<_>>().join(" ");
        let finding = Finding::new("cyclictest_without_values", NAME);
        return Err(finding.with("status", status.to_string()).with("said", said));
    }
    Ok(histogram)
}

/// The values of `-v -N`, lines of `thread: count: nanoseconds`.
fn read_values(output: impl Read) -> Histogram<u64> {
    let mut histogram = rt::histogram();
    for line in BufReader::new(output).lines().map_while(Result::ok) {
        if let Some(latency_ns) = value(&line) {
            rt::record(&mut histogram, latency_ns);
        }
    }
    histogram
}

fn value(line: &str) -> Option<u64> {
    let mut parts = line.split(':').map(|part| part.trim().parse::<i64>());
    let (thread, count, value, end) = (parts.next()?, parts.next()?, parts.next()?, parts.next());
    if thread.is_err() || count.is_err() || end.is_some() {
        return None;
    }
    // A thread of cyclictest that wakes a little early says so with a negative number.
    value.ok().map(|value| value.max(0).unsigned_abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As cyclictest 2.4 prints it.
    const OUTPUT: &str = "Max CPUs = 2\nOnline CPUs = 2\nThread 0 Interval: 1500\n       0:       0:   48704\n       \
                          0:       1:   49877\n       0:       2: 5706113\n\
                          T: 0 (14474) P:80 I:1000 C:   2000 Min:  15537 Act:   21968 Avg:   38027 Max: 5706113\n";

    #[test]
    fn each_value_counts_and_nothing_else_does() {
        let histogram = read_values(OUTPUT.as_bytes());
        assert_eq!(histogram.len(), 3);
        // Three digits.
        assert!(histogram.max().abs_diff(5_706_113) < 5_707 && histogram.min().abs_diff(48_704) < 49);
    }

    #[test]
    fn it_is_called_with_what_the_cycle_has() {
        let cyclictest = Cyclictest { program: "cyclictest".to_owned() };
        let settings = RealTimeConfig { processor: Some(1), ..RealTimeConfig::default() };
        let call = cyclictest.call(&settings, 1_000_000, 2000).join(" ");
        assert_eq!(call, "cyclictest -q -v -N -t1 --default-system -i 1000 -l 2000 -p 80 -m -a 1");
        let normal = RealTimeConfig { priority: 0, lock_memory: false, ..RealTimeConfig::default() };
        let call = cyclictest.call(&normal, 500_000, 10).join(" ");
        assert_eq!(call, "cyclictest -q -v -N -t1 --default-system -i 500 -l 10 --policy=other");
    }

    #[test]
    fn a_program_that_says_nothing_useful_is_told() {
        let call = ["sh", "-c", "echo cannot do it >&2; exit 3"].map(str::to_owned);
        let found = run(&call, &Shutdown::default()).expect_err("no values");
        assert_eq!((found.code, found.text("said")), ("cyclictest_without_values", "cannot do it"));
        assert!(found.text("status").contains('3'), "{found:?}");
        let failed =
            run(&["/nonexistent/cyclictest".to_owned()], &Shutdown::default()).expect_err("nothing there");
        assert_eq!((failed.code, failed.text("program")), ("cyclictest_failed", "/nonexistent/cyclictest"));
        assert_eq!(Cyclictest::at("/nonexistent/cyclictest"), None);
    }

    #[test]
    fn it_ends_when_we_are_to_end() {
        let shutdown = Shutdown::default();
        shutdown.request();
        let call = ["sh", "-c", "echo '0: 0: 100'; exec sleep 1000"].map(str::to_owned);
        let histogram = run(&call, &shutdown).expect("one value");
        assert_eq!(histogram.len(), 1);
    }
}
