//! The codec against cantools, bit for bit: vectors made by `tools/golden`, which says their format.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use rotorbench::can::{Database, Id, MAXIMUM_LENGTH, Message, NumberFormat};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// What the vector files agreed on.
#[derive(Default)]
struct Tally {
    files: usize,
    decoded: usize,
    encoded: usize,
    refused: usize,
    wrong: Vec<String>,
}

#[test]
fn agrees_with_cantools_bit_for_bit() {
    let mut folders = vec![Path::new(ROOT).join("tests/can/golden")];
    folders.extend(std::env::var_os("ROTORBENCH_GOLDEN").map(PathBuf::from));
    let mut tally = Tally::default();
    for folder in folders {
        let mut paths: Vec<PathBuf> =
            fs::read_dir(folder).expect("readable").map(|entry| entry.expect("readable").path()).collect();
        paths.sort();
        paths.iter().for_each(|path| tally.check_file(path));
    }
    println!(
        "{} DBC files: {} payloads decoded, {} encoded, {} files refused as cantools does",
        tally.files, tally.decoded, tally.encoded, tally.refused
    );
    assert!(tally.wrong.is_empty(), "{} differences:\n{}", tally.wrong.len(), tally.wrong.join("\n"));
    assert!(tally.files >= 24 && tally.decoded > 1000 && tally.encoded > 250, "the vectors were there");
}

impl Tally {
    fn check_file(&mut self, path: &Path) {
        let text = fs::read_to_string(path).expect("readable");
        let mut lines = text.lines();
        let name =
            lines.next().and_then(|line| line.strip_prefix("# ")).and_then(|line| line.split(',').next());
        let database = Database::load(&Path::new(ROOT).join(name.expect("names its DBC file")));
        self.files += 1;
        for line in lines {
            let words: Vec<&str> = line.split_whitespace().collect();
            match (&database, words.first()) {
                (Err(_), Some(&"refuse")) => self.refused += 1,
                (Ok(_), Some(&"refuse")) => {
                    self.wrong.push(format!("{}: accepted, but: {line}", path.display()))
                }
                (Err(error), _) => return self.wrong.push(format!("refused: {error}")),
                (Ok(database), Some(&kind)) => {
                    let difference = check_line(database, kind, &words[1..], self);
                    self.wrong.extend(difference.map(|what| format!("{}: {what}: {line}", path.display())));
                }
                (Ok(_), None) => {}
            }
        }
    }
}

fn check_line(database: &Database, kind: &str, words: &[&str], tally: &mut Tally) -> Option<String> {
    let [id, payload, signals @ ..] = words else { return Some("no vector".to_owned()) };
    let id = Id::new(u32::from_str_radix(id, 16).expect("hex"), id.len() == 8).expect("valid");
    let Some(message) = database.messages.iter().find(|message| message.id == id) else {
        return Some("no such message".to_owned());
    };
    let payload = bytes(payload);
    let expected: BTreeMap<&str, &str> =
        signals.iter().map(|signal| signal.split_once('=').expect("SIGNAL=BITS")).collect();
    if kind == "encode" {
        tally.encoded += 1;
        let encoded = encode(message, &expected);
        return (encoded[..message.length] != payload).then(|| format!("{encoded:02x?}"));
    }
    tally.decoded += 1;
    let decoded: BTreeMap<&str, String> =
        message.decode(&payload).map(|(signal, _, value)| (signal.name.as_str(), bits(value))).collect();
    if let Some(what) = differs_after_encoding(message, &payload) {
        return Some(what);
    }
    let same = decoded.len() == expected.len()
        && decoded
            .iter()
            .zip(&expected)
            .all(|((name, bits), (other, wanted))| name == other && bits == wanted);
    (!same).then(|| format!("{decoded:?}"))
}

/// What is decoded, encoded and decoded again has the same bits, as far as a value of 53 bits can hold them.
fn differs_after_encoding(message: &Message, payload: &[u8]) -> Option<String> {
    let values: BTreeMap<&str, (u64, f64)> =
        message.decode(payload).map(|(signal, raw, value)| (signal.name.as_str(), (raw, value))).collect();
    let encoded = message.encode(|signal| values.get(signal.name.as_str()).map(|(_, value)| *value));
    let again: BTreeMap<&str, u64> = message
        .decode(&encoded[..payload.len().min(MAXIMUM_LENGTH)])
        .map(|(signal, raw, _)| (signal.name.as_str(), raw))
        .collect();
    message.signals.iter().find_map(|signal| {
        let (raw, value) = values.get(signal.name.as_str())?;
        let layout = signal.codec.layout();
        // Of longer integers neighbours may share a value, and an offset eats the digits of a small float.
        let is_exact =
            layout.size <= 32 && matches!(layout.number, NumberFormat::Unsigned | NumberFormat::Signed);
        let found = again.get(signal.name.as_str());
        let name = &signal.name;
        (is_exact && found != Some(raw))
            .then(|| format!("{name} = {value} encodes as {found:x?}, not {raw:x}"))
    })
}

fn encode(message: &Message, values: &BTreeMap<&str, &str>) -> [u8; MAXIMUM_LENGTH] {
    let mut payload = [0; MAXIMUM_LENGTH];
    for (name, raw) in values {
        let signal = message.signal(name).expect("the vector's signal");
        signal.codec.encode_raw(&mut payload, u64::from_str_radix(raw, 16).expect("hex"));
    }
    payload
}

fn bits(value: f64) -> String {
    if value.is_nan() { "nan".to_owned() } else { format!("{:016x}", value.to_bits()) }
}

fn bytes(hex: &str) -> Vec<u8> {
    let hex = hex.trim_start_matches('-').as_bytes();
    hex.chunks(2)
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).expect("ASCII"), 16).expect("hex"))
        .collect()
}
