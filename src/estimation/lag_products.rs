//! A record of inputs and output, and one pass over it at one pole: the lagged inputs, their slopes in p, and every inner
//! product that a Gauss-Newton step needs.
//!
//! The recursion is one row after another; the products are not. Rows are laid aside in a block on the stack, and
//! their products are taken column by column with several sums at a time, which the processor does side by side.

use std::ops::Range;

use wide::f64x4;

use crate::cancel;

/// Below this the initial state has no part in the output any more.
pub(crate) const FORGOTTEN: f64 = 1e-9;
/// Rows laid aside: all columns together stay in the processor's first cache.
const BLOCK: usize = 128;
/// Sums taken at a time.
const LANES: usize = 8;

/// What is fitted: the measured output and the inputs at each sample.
#[derive(Debug, Clone)]
pub struct Record<const M: usize> {
    /// [s] rising.
    pub time: Vec<f64>,
    /// Measured output; not-a-number = not measured or not to be scored.
    pub output: Vec<f64>,
    /// Inputs x_j from this sample to the next.
    pub inputs: Vec<[f64; M]>,
    /// Stretches without holes.
    pub segments: Vec<Range<usize>>,
}

impl<const M: usize> Record<M> {
    /// The first `rows` rows.
    #[must_use]
    pub fn head(&self, rows: usize) -> Self {
        let rows = rows.min(self.time.len());
        let cut = |segment: &Range<usize>| segment.start..segment.end.min(rows);
        Self {
            time: self.time[..rows].to_vec(),
            output: self.output[..rows].to_vec(),
            inputs: self.inputs[..rows].to_vec(),
            segments: self.segments.iter().map(cut).filter(|segment| !segment.is_empty()).collect(),
        }
    }
}

/// Inner products over one stretch of w = [φ_1..φ_M, δ_1..δ_M, y] (φ the lagged inputs, δ = ∂φ/∂p), and with
/// e = exp(-p (t - t_0)), the response to the initial state, and g = ∂e/∂p.
pub(crate) struct Gram<const M: usize> {
    pub ff: [[f64; M]; M],
    pub fd: [[f64; M]; M],
    pub dd: [[f64; M]; M],
    pub fy: [f64; M],
    pub dy: [f64; M],
    pub yy: f64,
    pub ef: [f64; M],
    pub ed: [f64; M],
    pub ey: f64,
    pub ee: f64,
    pub gf: [f64; M],
    pub gd: [f64; M],
    pub gy: f64,
    pub ge: f64,
    pub gg: f64,
    pub samples: usize,
}

/// Runs the lag over one stretch; `visit(row, φ, δ, e, g)` sees every row.
pub(crate) fn run<const M: usize>(
    record: &Record<M>,
    segment: &Range<usize>,
    pole: f64,
    mut visit: impl FnMut(usize, &[f64; M], &[f64; M], f64, f64),
) {
    cancel::check();
    let (mut lagged, mut slope) = ([0.0; M], [0.0; M]);
    let (mut initial, mut elapsed) = (1.0, 0.0);
    let (mut interval, mut decay) = (f64::NAN, 1.0);
    for row in segment.clone() {
        visit(row, &lagged, &slope, initial, -elapsed * initial);
        if row + 1 >= segment.end {
            break;
        }
        let exact = record.time[row + 1] - record.time[row];
        // The exponential is the slow part; a regular grid differs from itself by rounding only.
        if (exact - interval).abs() > 1e-9 * exact || interval.is_nan() {
            interval = exact;
            decay = (-pole * interval).exp();
        }
        for ((lagged, slope), input) in lagged.iter_mut().zip(&mut slope).zip(&record.inputs[row]) {
            let away = *lagged - input;
            *slope = decay * (*slope - interval * away);
            *lagged = decay * away + input;
        }
        elapsed += interval;
        initial = if initial > FORGOTTEN { initial * decay } else { 0.0 };
    }
}

/// Scored rows laid aside, column by column.
pub(crate) struct RowBlock<const M: usize> {
    f: [[f64; BLOCK]; M],
    d: [[f64; BLOCK]; M],
    y: [f64; BLOCK],
    rows: usize,
}

impl<const M: usize> RowBlock<M> {
    pub(crate) const EMPTY: Self =
        Self { f: [[0.0; BLOCK]; M], d: [[0.0; BLOCK]; M], y: [0.0; BLOCK], rows: 0 };

    fn push(&mut self, f: &[f64; M], d: &[f64; M], y: f64) {
        let row = self.rows;
        for i in 0..M {
            self.f[i][row] = f[i];
            self.d[i][row] = d[i];
        }
        self.y[row] = y;
        self.rows += 1;
    }
}

/// Rows of `N` numbers laid aside column by column, for all products of two of them.
pub(crate) struct ProductColumns<const N: usize> {
    columns: [[f64; BLOCK]; N],
    rows: usize,
}

impl<const N: usize> ProductColumns<N> {
    pub const EMPTY: Self = Self { columns: [[0.0; BLOCK]; N], rows: 0 };

    pub fn push(&mut self, values: &[f64; N]) {
        for (column, value) in self.columns.iter_mut().zip(values) {
            column[self.rows] = *value;
        }
        self.rows += 1;
    }

    pub fn is_full(&self) -> bool {
        self.rows == BLOCK
    }

    /// Adds the products of the first `used` columns, the lower half of them, and forgets the rows.
    pub fn take(&mut self, used: usize, products: &mut [[f64; N]; N]) {
        let behind = self.rows..self.rows.next_multiple_of(LANES);
        self.columns.iter_mut().for_each(|column| column[behind.clone()].fill(0.0));
        for (i, products) in products.iter_mut().enumerate().take(used) {
            for (j, product) in products.iter_mut().enumerate().take(i + 1) {
                *product += dot(&self.columns[i], &self.columns[j], self.rows);
            }
        }
        self.rows = 0;
    }
}

/// Two sums of four products each, side by side: written out, because a test build does not find them by itself.
fn dot(a: &[f64; BLOCK], b: &[f64; BLOCK], rows: usize) -> f64 {
    let mut sums = [f64x4::ZERO; LANES / 4];
    let lanes = rows.div_ceil(LANES);
    for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b.as_chunks::<LANES>().0).take(lanes) {
        for ((sum, a), b) in sums.iter_mut().zip(a.as_chunks::<4>().0).zip(b.as_chunks::<4>().0) {
            *sum += f64x4::new(*a) * f64x4::new(*b);
        }
    }
    sums.into_iter().sum::<f64x4>().reduce_add()
}

impl<const M: usize> Gram<M> {
    const ZERO: Self = Self {
        ff: [[0.0; M]; M],
        fd: [[0.0; M]; M],
        dd: [[0.0; M]; M],
        fy: [0.0; M],
        dy: [0.0; M],
        yy: 0.0,
        ef: [0.0; M],
        ed: [0.0; M],
        ey: 0.0,
        ee: 0.0,
        gf: [0.0; M],
        gd: [0.0; M],
        gy: 0.0,
        ge: 0.0,
        gg: 0.0,
        samples: 0,
    };

    /// Over one stretch; `block` is there to be used again, since stretches may be many and short.
    pub fn gather(record: &Record<M>, segment: &Range<usize>, pole: f64, block: &mut RowBlock<M>) -> Self {
        let mut gram = Self::ZERO;
        run(record, segment, pole, |row, f, d, e, g| {
            let y = record.output[row];
            if y.is_nan() {
                return;
            }
            block.push(f, d, y);
            if block.rows == BLOCK {
                gram.take(block);
            }
            // Soon forgotten: no part in what the loop costs.
            if e > 0.0 {
                gram.take_initial(f, d, y, e, g);
            }
        });
        // Sums are taken over whole lanes: what lies behind the last row in them is zero.
        let behind = block.rows..block.rows.next_multiple_of(LANES);
        block.f.iter_mut().chain(&mut block.d).for_each(|column| column[behind.clone()].fill(0.0));
        block.y[behind].fill(0.0);
        gram.take(block);
        gram.mirror();
        gram
    }

    /// Adds the products of a block, of symmetric ones the upper half, and empties it.
    fn take(&mut self, block: &mut RowBlock<M>) {
        let rows = block.rows;
        for i in 0..M {
            for j in 0..M {
                if j >= i {
                    self.ff[i][j] += dot(&block.f[i], &block.f[j], rows);
                    self.dd[i][j] += dot(&block.d[i], &block.d[j], rows);
                }
                self.fd[i][j] += dot(&block.f[i], &block.d[j], rows);
            }
            self.fy[i] += dot(&block.f[i], &block.y, rows);
            self.dy[i] += dot(&block.d[i], &block.y, rows);
        }
        self.yy += dot(&block.y, &block.y, rows);
        self.samples += block.rows;
        block.rows = 0;
    }

    fn take_initial(&mut self, f: &[f64; M], d: &[f64; M], y: f64, e: f64, g: f64) {
        for i in 0..M {
            self.ef[i] += e * f[i];
            self.ed[i] += e * d[i];
            self.gf[i] += g * f[i];
            self.gd[i] += g * d[i];
        }
        self.ey += e * y;
        self.ee += e * e;
        self.gy += g * y;
        self.ge += g * e;
        self.gg += g * g;
    }

    fn mirror(&mut self) {
        for i in 0..M {
            for j in 0..i {
                self.ff[i][j] = self.ff[j][i];
                self.dd[i][j] = self.dd[j][i];
            }
        }
    }

    /// Takes the free initial state out of every product: ⟨a, b⟩ becomes ⟨a, b⟩ - ⟨a, e⟩⟨e, b⟩ / ⟨e, e⟩.
    pub fn without_initial_state(mut self) -> Self {
        let ee = self.ee;
        if ee < FORGOTTEN {
            return self;
        }
        for i in 0..M {
            for j in 0..M {
                self.ff[i][j] -= self.ef[i] * self.ef[j] / ee;
                self.fd[i][j] -= self.ef[i] * self.ed[j] / ee;
                self.dd[i][j] -= self.ed[i] * self.ed[j] / ee;
            }
            self.fy[i] -= self.ef[i] * self.ey / ee;
            self.dy[i] -= self.ed[i] * self.ey / ee;
            self.gf[i] -= self.ge * self.ef[i] / ee;
            self.gd[i] -= self.ge * self.ed[i] / ee;
        }
        self.yy -= self.ey * self.ey / ee;
        self.gy -= self.ge * self.ey / ee;
        self.gg -= self.ge * self.ge / ee;
        self
    }
}
