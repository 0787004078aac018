//! Fewer points, the same picture: nothing a pixel would have shown is lost.

use super::thresholds::THRESHOLDS;

/// Buckets along x for a line.
const BUCKETS: usize = THRESHOLDS.line_buckets;

/// Indices of `x` in ascending order; rows whose x is not finite are left out.
fn sorted_rows(x: &[f64]) -> Vec<usize> {
    let mut rows: Vec<usize> = (0..x.len()).filter(|&row| x[row].is_finite()).collect();
    if rows.windows(2).any(|pair| x[pair[0]] > x[pair[1]]) {
        rows.sort_by(|&a, &b| x[a].total_cmp(&x[b]));
    }
    rows
}

/// Rows to draw of a line: in each bucket of x its first, last, lowest and highest sample, and one missing
/// sample if it holds any, so that spikes and holes stay visible. `position` maps x to screen (log axes).
pub(super) fn line_rows(x: &[f64], y: &[f64], position: impl Fn(f64) -> f64) -> Vec<usize> {
    let rows = sorted_rows(x);
    if rows.len() <= 4 * BUCKETS {
        return rows;
    }
    let low = rows.first().map_or(0.0, |&row| position(x[row]));
    let high = rows.last().map_or(1.0, |&row| position(x[row]));
    let width = ((high - low) / BUCKETS as f64).max(f64::MIN_POSITIVE);
    let bucket_of = |row: usize| (((position(x[row]) - low) / width) as usize).min(BUCKETS - 1);
    let mut kept = Vec::with_capacity(4 * BUCKETS);
    for bucket in rows.chunk_by(|&a, &b| bucket_of(a) == bucket_of(b)) {
        let finite = || bucket.iter().copied().filter(|&row| y[row].is_finite());
        let mut chosen = [
            bucket.first().copied(),
            finite().min_by(|&a, &b| y[a].total_cmp(&y[b])),
            finite().max_by(|&a, &b| y[a].total_cmp(&y[b])),
            bucket.iter().copied().find(|&row| !y[row].is_finite()),
            bucket.last().copied(),
        ];
        // Rows of one bucket are in the order of x only if sorting kept it: compare by x, then row.
        chosen.sort_by(|a, b| match (a, b) {
            (Some(a), Some(b)) => x[*a].total_cmp(&x[*b]).then(a.cmp(b)),
            _ => a.is_none().cmp(&b.is_none()),
        });
        let mut last = None;
        for row in chosen.into_iter().flatten() {
            if last != Some(row) {
                kept.push(row);
            }
            last = Some(row);
        }
    }
    kept
}

/// Rows to draw of a scatter plot: all, or an even thinning plus what [`line_rows`] keeps.
pub(super) fn scatter_rows(x: &[f64], y: &[f64], position: impl Fn(f64) -> f64) -> Vec<usize> {
    let rows = sorted_rows(x);
    if rows.len() <= THRESHOLDS.scatter_points {
        return rows;
    }
    let stride = rows.len().div_ceil(THRESHOLDS.scatter_points);
    let mut keep = vec![false; x.len()];
    for row in rows.iter().step_by(stride) {
        keep[*row] = true;
    }
    for row in line_rows(x, y, position) {
        keep[row] = true;
    }
    rows.into_iter().filter(|&row| keep[row] && y[row].is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spikes_holes_and_ends_survive() {
        let x: Vec<f64> = (0..120_000).map(|k| f64::from(k) * 0.02).collect();
        let mut y: Vec<f64> = x.iter().map(|t| (t * 0.1).sin()).collect();
        y[77_777] = 50.0;
        y[33_333] = -50.0;
        y[55_555] = f64::NAN;
        let rows = line_rows(&x, &y, |x| x);
        assert!(rows.len() <= 5 * BUCKETS, "{} rows", rows.len());
        for row in [0, 33_333, 55_555, 77_777, 119_999] {
            assert!(rows.contains(&row), "row {row} was dropped");
        }
        assert!(rows.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn unordered_and_missing_x_are_put_right() {
        let x = [2.0, f64::NAN, 1.0, 3.0];
        assert_eq!(line_rows(&x, &[0.0; 4], |x| x), [2, 0, 3]);
        let many: Vec<f64> = (0..50_000).map(|k| f64::from((k * 7919) % 50_000)).collect();
        let mut y = many.clone();
        y[1234] = -9.0;
        let rows = scatter_rows(&many, &y, |x| x);
        assert!(rows.contains(&1234));
        assert!(rows.windows(2).all(|pair| many[pair[0]] <= many[pair[1]]));
    }
}
