//! Our steps and codec beside C, in alternating batches of one process: what `tools/peers` prints as ratios.
//!
//! `ROTORBENCH_PEERS` names the shared library made from `tools/peer/*.c`; without it only our own times are
//! printed. One JSON object a line: name, ours and theirs [ns] and the median of the batches' ratios. Before anything is
//! timed, the two languages must agree on the answer, or the comparison would be of different work.

use std::env;
use std::ffi::{CString, c_char, c_int, c_void};
use std::hint::black_box;
use std::os::unix::ffi::OsStrExt;
use std::time::Instant;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rotorbench::can::{Database, Message, Payload};
use rotorbench::control::{AnyController, Controller, ControllerConfig, ControllerKind, PlantParameters};
use rotorbench::signal::{Applied, Reference, Sample, Sensors};

/// Different inputs in a batch: more than a branch predictor learns, less than a cache holds.
const INPUTS: usize = 512;
/// Passes over the inputs in one timed batch.
const ROUNDS: u64 = 40;
/// Timed batches of each side, alternating.
const BATCHES: usize = 201;
/// [s]
const PERIOD: f64 = 0.02;

type Step = unsafe extern "C" fn(*const f64, f64, *const f64, u64, u64) -> f64;
type Decode = unsafe extern "C" fn(*const u8, u64, u64) -> f64;
type Encode = unsafe extern "C" fn(*const f64, u64, u64) -> f64;

fn main() {
    let library = env::var_os("ROTORBENCH_PEERS").map(|path| Library::open(path.as_bytes()));
    let library = library.as_ref();
    let inputs = controller_inputs();
    for (name, kind, symbol) in
        [("emc step", ControllerKind::Emc, c"peer_emc"), ("pid step", ControllerKind::Pid, c"peer_pid")]
    {
        let (controller, gains) = controller(kind);
        let sensors = sensors(&inputs);
        let theirs = library.map(|library| {
            // SAFETY: tools/peer/controllers.c defines the symbol with this signature.
            let step: Step = unsafe { std::mem::transmute::<*mut c_void, Step>(library.symbol(symbol)) };
            let (gains, inputs) = (gains.clone(), inputs.clone());
            // SAFETY: both arrays outlive the call and have the lengths that the function reads.
            move |rounds| unsafe { step(gains.as_ptr(), PERIOD, inputs.as_ptr(), INPUTS as u64, rounds) }
        });
        compare(name, INPUTS, |rounds| run_steps(&controller, &sensors, rounds), theirs);
    }

    let database =
        Database::parse("bench.dbc", include_bytes!("../../dbc/bench.dbc")).expect("ships parseable");
    let status = database.message("ESC_1_STATUS").expect("is in bench.dbc");
    let frames = payloads();
    let theirs = library.map(|library| {
        // SAFETY: tools/peer/codec.c defines the symbol with this signature.
        let decode: Decode =
            unsafe { std::mem::transmute::<*mut c_void, Decode>(library.symbol(c"peer_decode")) };
        let packed: Vec<u8> = frames.iter().flat_map(|payload| payload[..8].to_vec()).collect();
        // SAFETY: the array outlives the call and holds INPUTS frames of eight bytes.
        move |rounds| unsafe { decode(packed.as_ptr(), INPUTS as u64, rounds) }
    });
    compare("decode a frame of 5 signals", INPUTS, |rounds| run_decode(status, &frames, rounds), theirs);

    let command = database.message("COMMAND").expect("is in bench.dbc");
    let values: Vec<f64> = (0..2 * INPUTS).map(|k| 0.3 + 0.3 * ((k * 37 % 512) as f64) / 512.0).collect();
    let theirs = library.map(|library| {
        // SAFETY: tools/peer/codec.c defines the symbol with this signature.
        let encode: Encode =
            unsafe { std::mem::transmute::<*mut c_void, Encode>(library.symbol(c"peer_encode")) };
        let values = values.clone();
        // SAFETY: the array outlives the call and holds INPUTS pairs.
        move |rounds| unsafe { encode(values.as_ptr(), INPUTS as u64, rounds) }
    });
    compare("encode a frame of 4 signals", INPUTS, |rounds| run_encode(command, &values, rounds), theirs);
}

/// Checks that both sides give the same answer, times them in turn, prints one line.
fn compare(
    name: &str,
    operations: usize,
    mut ours: impl FnMut(u64) -> f64,
    theirs: Option<impl FnMut(u64) -> f64>,
) {
    let scale = 1.0 / (operations as f64 * ROUNDS as f64);
    let time = |work: &mut dyn FnMut(u64) -> f64| {
        let start = Instant::now();
        black_box(work(black_box(ROUNDS)));
        start.elapsed().as_nanos() as f64 * scale
    };
    let Some(mut theirs) = theirs else {
        let mut times: Vec<f64> = (0..BATCHES).map(|_| time(&mut ours)).collect();
        println!("{{\"name\": \"{name}\", \"ours_ns\": {:.2}}}", median(&mut times));
        return;
    };
    let (a, b) = (ours(1), theirs(1));
    // The same arithmetic in another order of rounding; and cantools' C encodes by truncation, ours rounds to nearest,
    // which is up to one of about 20,000 steps for each command.
    assert!((a - b).abs() <= 5e-5 * a.abs().max(1.0), "{name}: {a} here, {b} in C");
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for _ in 0..BATCHES {
        left.push(time(&mut ours));
        right.push(time(&mut theirs));
    }
    // Of neighbours, which the machine treated alike, whatever else it did meanwhile.
    let mut ratios: Vec<f64> = left.iter().zip(&right).map(|(left, right)| left / right).collect();
    let (left, right, ratio) = (median(&mut left), median(&mut right), median(&mut ratios));
    println!(
        "{{\"name\": \"{name}\", \"ours_ns\": {left:.2}, \"theirs_ns\": {right:.2}, \"ratio\": {ratio:.3}}}"
    );
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Pairs of body rate [rad/s] and battery voltage [V].
fn controller_inputs() -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    (0..INPUTS).flat_map(|_| [random.random_range(-0.02..0.02), random.random_range(11.5..12.6)]).collect()
}

fn sensors(inputs: &[f64]) -> Vec<Sensors> {
    let rows = inputs.chunks_exact(2).enumerate();
    rows.map(|(k, row)| Sensors {
        body_rate: Sample::good(row[0], k as u64 + 1, k as u32 + 1),
        battery_voltage: Sample::good(row[1], k as u64 + 1, k as u32 + 1),
        ..Sensors::default()
    })
    .collect()
}

fn controller(kind: ControllerKind) -> (AnyController, Vec<f64>) {
    let config = ControllerConfig { kind, ..ControllerConfig::paper() };
    let built = config.build(&PlantParameters::paper(), PERIOD).expect("the paper's controller");
    let gains = match &built {
        AnyController::Emc(emc) => {
            let gains = emc.gains();
            [&[gains.beta][..], &gains.l[..], &gains.k[..]].concat()
        }
        AnyController::Pid(pid) => vec![pid.gains().k_p, pid.gains().k_i, pid.gains().k_d],
    };
    (built, gains)
}

fn run_steps(controller: &AnyController, sensors: &[Sensors], rounds: u64) -> f64 {
    let mut state = controller.start();
    let mut applied = Applied::default();
    let mut sum = 0.0;
    for _ in 0..rounds {
        for sensors in sensors {
            let command = controller.step(&mut state, sensors, &Reference::default(), &applied);
            applied.command_sequence = command.sequence;
            applied.rotor = command.rotor;
            sum += command.rotor[0];
        }
    }
    sum
}

fn payloads() -> Vec<Payload> {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    (0..INPUTS)
        .map(|_| {
            let mut payload = [0; 64];
            payload[..8].fill_with(|| random.random());
            payload
        })
        .collect()
}

fn run_decode(message: &Message, frames: &[Payload], rounds: u64) -> f64 {
    let mut sum = 0.0;
    for _ in 0..rounds {
        for payload in frames {
            for signal in &message.signals {
                sum += signal.codec.decode(payload);
            }
        }
    }
    sum
}

fn run_encode(message: &Message, values: &[f64], rounds: u64) -> f64 {
    let mut sum = 0_u64;
    for _ in 0..rounds {
        for (k, pair) in values.chunks_exact(2).enumerate() {
            let mut fields = [(k & 255) as f64, 2.0, pair[0], pair[1]].into_iter();
            let payload = message.encode(|_| fields.next());
            sum += u64::from(payload[2]) + 256 * u64::from(payload[3]);
            sum += u64::from(payload[4]) + 256 * u64::from(payload[5]);
        }
    }
    sum as f64
}

/// A C library opened at run time, so that building the project needs no C compiler.
struct Library(*mut c_void);

impl Library {
    fn open(path: &[u8]) -> Self {
        let path = CString::new(path).expect("a path without NUL");
        // SAFETY: `path` is a NUL-terminated string; the library's constructors are those of plain C.
        let handle = unsafe { libc::dlopen(path.as_ptr().cast::<c_char>(), libc::RTLD_NOW as c_int) };
        assert!(!handle.is_null(), "cannot open {}", path.to_string_lossy());
        Self(handle)
    }

    fn symbol(&self, name: &std::ffi::CStr) -> *mut c_void {
        // SAFETY: the handle is open for the life of the process; `name` is NUL-terminated.
        let symbol = unsafe { libc::dlsym(self.0, name.as_ptr()) };
        assert!(!symbol.is_null(), "the library lacks {}", name.to_string_lossy());
        symbol
    }
}
