//! Histograms in files that HdrHistogram's own tools read: the interval log (`HistogramLogProcessor`, `hdrh`), with
//! everything under a tag of its own, and the percentile text (`.hgrm`), which its plotters draw, one for each.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use hdrhistogram::Histogram;
use hdrhistogram::serialization::V2DeflateSerializer;
use hdrhistogram::serialization::interval_log::{IntervalLogWriterBuilder, Tag};

use super::{ReportError, write_atomically};

/// [ns] in the unit of the percentile text, µs.
const NANOSECONDS_PER_MICROSECOND: f64 = 1e3;
/// Lines of the percentile text for each halving of what is left.
const TICKS: u32 = 5;

/// A histogram of spans [ns] with its name; the name has no space and no comma.
pub type Named<'a> = (String, &'a Histogram<u64>);

/// Writes `histograms` to `path`: percentile text, a file for each with its name in the file's, where the path ends in
/// `.hgrm`; else one interval log. Returns the files written.
///
/// # Errors
/// [`ReportError::Write`] with the path.
pub fn save(
    path: &Path,
    histograms: &[Named<'_>],
    began: SystemTime,
    duration: Duration,
) -> Result<Vec<PathBuf>, ReportError> {
    if path.extension().is_none_or(|it| it != "hgrm") {
        write_atomically(path, &interval_log(histograms, began, duration))?;
        return Ok(vec![path.to_owned()]);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    histograms
        .iter()
        .map(|(name, histogram)| {
            let file = path.with_file_name(format!("{stem}-{name}.hgrm"));
            write_atomically(&file, &percentile_text(histogram))?;
            Ok(file)
        })
        .collect()
}

/// An interval log of one interval, version 1.3: values in ns, maxima shown in µs.
#[must_use]
pub fn interval_log(histograms: &[Named<'_>], began: SystemTime, duration: Duration) -> String {
    let mut bytes = Vec::new();
    let mut serializer = V2DeflateSerializer::new();
    let mut builder = IntervalLogWriterBuilder::new();
    builder
        .add_comment("[Histogram log format version 1.3]")
        .add_comment(&format!("[rotorbench {}; values in ns, Interval_Max in µs]", env!("CARGO_PKG_VERSION")))
        .with_start_time(began)
        .with_base_time(began)
        .with_max_value_divisor(NANOSECONDS_PER_MICROSECOND);
    // Writing to a vector cannot fail, nor can the serializer on histograms of a fixed size.
    if let Ok(mut writer) = builder.begin_log_with(&mut bytes, &mut serializer) {
        for (name, histogram) in histograms {
            let _ = writer.write_histogram(histogram, Duration::ZERO, duration, Tag::new(name));
        }
    }
    String::from_utf8(bytes).unwrap_or_default()
}

/// The text of `outputPercentileDistribution`, values in µs.
fn percentile_text(histogram: &Histogram<u64>) -> String {
    let scaled = |value: u64| value as f64 / NANOSECONDS_PER_MICROSECOND;
    let mut text =
        format!("{:>12} {:>14} {:>10} {:>14}\n\n", "Value", "Percentile", "TotalCount", "1/(1-Percentile)");
    let mut total = 0;
    // Writing to a String cannot fail.
    for step in histogram.iter_quantiles(TICKS) {
        total += step.count_since_last_iteration();
        let (value, quantile) = (scaled(step.value_iterated_to()), step.quantile_iterated_to());
        let _ = write!(text, "{value:12.3} {quantile:.12} {total:10}");
        let _ =
            if quantile < 1.0 { writeln!(text, " {:14.2}", 1.0 / (1.0 - quantile)) } else { writeln!(text) };
    }
    let (mean, deviation) = (histogram.mean(), histogram.stdev());
    let _ = writeln!(
        text,
        "#[Mean    = {:12.3}, StdDeviation   = {:12.3}]\n#[Max     = {:12.3}, Total count    = {:12}]\n\
         #[Buckets = {:12}, SubBuckets     = {:12}]",
        mean / NANOSECONDS_PER_MICROSECOND,
        deviation / NANOSECONDS_PER_MICROSECOND,
        scaled(histogram.max()),
        histogram.len(),
        histogram.buckets(),
        histogram.distinct_values(),
    );
    text
}

#[cfg(test)]
mod tests {
    use hdrhistogram::serialization::Deserializer;
    use hdrhistogram::serialization::interval_log::{IntervalLogIterator, LogEntry};

    use super::*;

    fn histogram(values: impl Iterator<Item = u64>) -> Histogram<u64> {
        let mut histogram = crate::rt::histogram();
        values.for_each(|value| crate::rt::record(&mut histogram, value));
        histogram
    }

    /// RFC 4648, section 4: written apart from the crate that wrote the log.
    fn base64(text: &str) -> Vec<u8> {
        let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let bits = text.bytes().filter_map(|byte| letters.iter().position(|letter| *letter == byte));
        let (mut word, mut held, mut bytes) = (0_usize, 0, Vec::new());
        for six in bits {
            word = (word << 6 | six) & 0xFFFF;
            held += 6;
            if held >= 8 {
                held -= 8;
                bytes.push((word >> held & 0xFF) as u8);
            }
        }
        bytes
    }

    #[test]
    fn the_interval_log_is_read_back_with_tags_and_all_values() {
        let (one, other) = (histogram(1..5_000), histogram([3_000_000_000, 7].into_iter()));
        let began = SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000);
        let log = interval_log(
            &[("bare.lateness".to_owned(), &one), ("cyclictest".to_owned(), &other)],
            began,
            Duration::from_secs(10),
        );
        assert!(log.starts_with("#[Histogram log format version 1.3]\n"));
        let mut found = Vec::new();
        for entry in IntervalLogIterator::new(log.as_bytes()) {
            if let LogEntry::Interval(interval) = entry.expect("a line of the format") {
                assert_eq!(interval.duration(), Duration::from_secs(10));
                let bytes = base64(interval.encoded_histogram());
                let histogram: Histogram<u64> =
                    Deserializer::new().deserialize(&mut bytes.as_slice()).expect("V2, compressed");
                found.push((interval.tag().expect("tagged").as_str().to_owned(), histogram));
            }
        }
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["bare.lateness", "cyclictest"]);
        assert_eq!(found[0].1, one);
        assert_eq!(found[1].1, other);
    }

    #[test]
    fn the_percentile_text_counts_everything_up_to_the_maximum() {
        let text = percentile_text(&histogram((1..=1000).map(|k| k * 1000)));
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(2)
            .take_while(|line| !line.starts_with('#'))
            .map(|line| line.split_whitespace().map(|word| word.parse().expect("a number")).collect())
            .collect();
        assert!(rows.windows(2).all(|pair| pair[0][0] <= pair[1][0] && pair[0][1] < pair[1][1]));
        // Three digits; the upper end of the bucket.
        let median = rows.iter().find(|row| row[1] >= 0.5).expect("half of it");
        assert!((median[0] - 500.0).abs() < 1.0 && median[2] >= 500.0, "{median:?}");
        let last = rows.last().expect("rows");
        assert!((last[0] - 1000.0).abs() < 1.0 && last[1] == 1.0 && last[2] == 1000.0 && last.len() == 3);
        assert!(text.contains("Total count    =         1000]"));
    }

    #[test]
    fn percentile_text_goes_into_a_file_for_each() {
        let folder = tempfile::tempdir().expect("a folder");
        let one = histogram(1..10);
        let named = [("bare".to_owned(), &one), ("cyclictest".to_owned(), &one)];
        let files = save(&folder.path().join("j.hgrm"), &named, SystemTime::now(), Duration::from_secs(1));
        let names: Vec<_> = files
            .expect("written")
            .iter()
            .filter_map(|it| it.file_name()?.to_str().map(str::to_owned))
            .collect();
        assert_eq!(names, ["j-bare.hgrm", "j-cyclictest.hgrm"]);
        let log = save(&folder.path().join("j.hdr"), &named, SystemTime::now(), Duration::from_secs(1));
        assert_eq!(log.expect("written").len(), 1);
        let nowhere =
            save(Path::new("/nonexistent/j.hdr"), &named, SystemTime::now(), Duration::from_secs(1));
        assert!(matches!(nowhere, Err(ReportError::Write { .. })));
    }
}
