"""One log by one peer: what it names, how well its model runs freely on the held-out log, how long that took, as JSON:

    logs.py pysindy|sysidentpy|scipy TRAIN VALIDATE

Judged is the rate of rotor 1, or of the body where the log has one, as `diagnose` judges it: a rotor between holes in the rows, without
rows in which it stands or starts or in which a hole hid a step; a body over windows. Each run begins at the measured state, which is then
fitted, as `diagnose` fits its own. A peer begins anew at every hole, while `diagnose` runs on across those that hide no step.

Each peer knows the base: the paper's rotor, a rigid body, the torque of measured rotors. Its settings are those with the least error on
the held-out log, which is more than `diagnose` is given. The time is that of all settings, without the start of Python.
"""
import json
import sys
import time
import warnings

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

warnings.filterwarnings("ignore")
CURVE = (1124.5, 447.1)  # [rad/s] g(u) = 1124.5 u + 447.1 u², [LPC16] Table I
K_V, FULL, POLE = 40.0, 12.6, 16.0  # [rad/(s V)], [V], [rad/s]
THRUST, ARM, INERTIA = 0.0197**2 / (4 * 6.0771), 0.25, 0.032  # [N s²/rad²], [m], [kg m²]
STANDS, STARTS_S, SETTLES_S = 0.05, 0.5, 0.13  # [-] command, [s], [s] as `import` says of the thrust stand
TORQUES = (75, 301, 1001, 0)  # [rows] smoothing of what measured rotors differ by from their model; 0: the model alone
WORST = 1e6  # a run that leaves this many units of its channel behind has diverged


def stretches_of(kept):
    """Ranges of rows that are kept, ten of them or more."""
    edges = np.flatnonzero(np.diff(np.r_[False, kept, False].astype(int)))
    return [(a, b) for a, b in zip(edges[::2], edges[1::2]) if b - a >= 10]


class Log:
    """Measured states (the judged one last), inputs, and the runs that are judged: row numbers, padded, and which of them count."""

    def __init__(self, path):
        cells = np.genfromtxt(path, delimiter=",", names=True)
        names = cells.dtype.names
        self.time = cells["time_s"]
        step = np.diff(self.time)
        self.step = float(np.median(step))
        self.is_body = "body_rate_rad_s" in names
        self.is_held = "propeller_rate_1_rad_s" not in names or not self.is_body
        if self.is_body:
            self.measured = np.c_[cells["body_angle_rad"], cells["body_rate_rad_s"]]
            self.torques = [cells["torque_command_nm"]] if self.is_held else torques(cells)
            self.torque = self.torques[0]
            horizon = round((0.2 if self.is_held else 0.4) / self.step)
            self.stretches = self.between_holes(np.ones(len(self.time), bool), 1.9)
            self.runs = [(c, c + horizon) for a, b in self.stretches for c in range(a, b - horizon + 1, horizon)]
        else:
            self.command, self.voltage = cells["command_1"], cells["battery_voltage_v"]
            self.measured = cells["propeller_rate_1_rad_s"][:, None]
            self.is_paper = self.voltage.max() < 13.0
            self.stretches = self.runs = self.between_holes(self.turns(), 2.5)
        if not all(np.isfinite(it).all() for it in (self.measured, self.torque if self.is_body else self.command)):
            sys.exit(f"{path}: a log without empty cells is needed")
        longest = max(b - a for a, b in self.runs)
        self.rows = np.array([np.minimum(np.arange(a, a + longest), b - 1) for a, b in self.runs])
        self.counts = np.array([np.arange(longest) < b - a for a, b in self.runs])
        self.smooth = self.measured.copy()
        width = 9 if self.is_body else 5
        for a, b in self.stretches:
            self.smooth[a:b] = savgol_filter(self.measured[a:b], width, 2, axis=0)
        self.starts = self.smooth[self.rows[:, 0]]
        self.noise = np.sqrt(np.mean(np.diff(self.measured, 2, axis=0) ** 2, axis=0) / 6)

    def between_holes(self, kept, longest):
        """Ranges of rows that are kept, in which none follows later than `longest` usual intervals."""
        hole = np.r_[False, np.diff(self.time) > longest * self.step]
        ranges = []
        for a, b in stretches_of(kept):
            cuts = [a, *(a + np.flatnonzero(hole[a:b])), b]
            ranges += [(c, d) for c, d in zip(cuts, cuts[1:]) if d - c >= 10]
        return ranges

    def turns(self):
        """Rows in which the rotor turns, and in which no hole hid when a step began."""
        kept = np.ones(len(self.time), bool)
        for row in np.flatnonzero(self.command < STANDS):
            kept[(self.time >= self.time[row]) & (self.time <= self.time[row] + STARTS_S)] = False
        steps = 1 + np.flatnonzero(np.abs(np.diff(self.command)) > 0.02)
        for before in np.flatnonzero(np.diff(self.time) > 2.5 * self.step):
            near = steps[(steps <= before + 1) & (self.time[steps] > self.time[before] - SETTLES_S)]
            if len(near):
                kept[near[0]:np.searchsorted(self.time, self.time[before + 1] + SETTLES_S)] = False
        return kept

    def held(self, values, at):
        """What a held input was at instants; before the log began as in its first row."""
        return values[np.maximum(np.searchsorted(self.time, at + 1e-9, side="right") - 1, 0)]


def torques(cells):
    """The torque of measured rotors: their model run freely, moved by what the smoothed measurement says it lacks."""
    rates = []
    for rotor in (1, 2):
        command, measured = cells[f"command_{rotor}"], cells[f"propeller_rate_{rotor}_rad_s"]
        steady = CURVE[0] * command + CURVE[1] * command**2 - K_V * (FULL - cells["battery_voltage_v"])
        run = first_order(cells["time_s"], steady, POLE, measured[:5].mean())
        lacks = measured - run
        rates.append([run + (savgol_filter(lacks, width, 2) if width else 0.0) for width in TORQUES])
    return [ARM * THRUST * (one**2 - other**2) for one, other in zip(*rates)]


def first_order(at, steady, pole, start):
    """Exact between instants, over which the steady value is held."""
    fades = np.exp(-pole * np.diff(at))
    values, now = [start], start
    for fade, goal in zip(fades.tolist(), steady.tolist()):
        now = goal + (now - goal) * fade
        values.append(now)
    return np.array(values)


def left(run, log, weights=None, rounds=2):
    """What a model leaves of the measured states, its starts fitted; `run` takes starts and gives states of each row of each run."""
    starts, counts = log.starts.copy(), log.counts[:, :, None]
    measured = log.measured[log.rows]
    size = log.starts.shape[1]
    steps = 3 * log.noise
    residual = lambda states: np.where(counts, measured - states, 0.0)
    rest = residual(run(starts))
    for turn in range(rounds):
        scale = log.noise if weights is None and turn == 0 else weights
        if scale is None:
            scale = np.sqrt(np.sum(rest**2, axis=(0, 1)) / log.counts.sum())
        slopes = []
        for k in range(size):
            moved = starts.copy()
            moved[:, k] += steps[k]
            slopes.append((rest - residual(run(moved))) / steps[k] / scale)
        slopes = np.stack([it.reshape(len(starts), -1) for it in slopes], axis=2)
        goal = (rest / scale).reshape(len(starts), -1, 1)
        square = np.swapaxes(slopes, 1, 2) @ slopes
        if not (np.isfinite(square).all() and np.isfinite(goal).all()):
            return np.full_like(rest, np.inf)
        starts = starts + (np.linalg.pinv(square) @ np.swapaxes(slopes, 1, 2) @ goal)[:, :, 0]
        rest = residual(run(starts))
    return rest


def error(run, log):
    """Of the judged channel, rms; without end where the run diverges."""
    with np.errstate(all="ignore"):
        rms = float(np.sqrt(np.sum(left(run, log)[:, :, -1] ** 2) / log.counts.sum()))
    return rms if np.isfinite(rms) and rms < WORST else np.inf


# --- scipy: the base's own numbers by output error, with a dead time and, for a body, damping and an offset of the torque


def rotor_run(log, full, numbers):
    """Polynomial, battery, pole, dead time. What is held changes at the rows (voltage) and a dead time after them (command)."""
    *curve, gain, pole, delay = numbers

    def run(starts):
        states = np.zeros((*log.rows.shape, 1))
        for k, (a, b) in enumerate(log.runs):
            at = log.time[a:b]
            late = log.time[(log.time + delay > at[0]) & (log.time + delay < at[-1])] + delay
            instants = np.concatenate([at, late])
            order = np.argsort(instants, kind="stable")
            instants = instants[order]
            command = log.held(log.command, instants - delay)
            steady = sum(c * command ** (i + 1) for i, c in enumerate(curve)) - gain * (full - log.held(log.voltage, instants))
            states[k, : b - a, 0] = first_order(instants, steady[:-1], pole, starts[k, 0])[order < b - a]
        return states

    return run


def body_run(log, numbers):
    """Inertia, damping, offset torque, dead time. The torque of an interval is its mean, from held or from linear values."""
    inertia, damping, offset, delay = numbers
    step = np.diff(log.time)
    mean = log.torque[:-1] if log.is_held else (log.torque[:-1] + log.torque[1:]) / 2
    impulse = np.r_[0.0, np.cumsum(step * mean)]
    late = np.interp(log.time - delay, log.time, impulse)
    goal = np.r_[np.diff(late) / step, 0.0] + offset
    fall, step = damping / inertia, np.r_[step, 0.0]
    gone = fall * step
    # What a rate and an acceleration add up to while the damping acts; a series where the quotient would lose its digits.
    once = np.where(np.abs(gone) < 1e-4, step * (1 - gone / 2), -np.expm1(-gone) / (fall or 1.0))
    twice = np.where(np.abs(gone) < 1e-4, step**2 * (0.5 - gone / 6), (step - once) / (fall or 1.0))
    fade, acceleration = np.exp(-gone), goal / inertia

    def run(starts):
        angle, now = starts[:, 0].copy(), starts[:, 1].copy()
        states = np.zeros((*log.rows.shape, 2))
        states[:, 0] = starts
        for k in range(1, log.rows.shape[1]):
            row = log.rows[:, k - 1]
            angle = angle + now * once[row] + acceleration[row] * twice[row]
            now = now * fade[row] + acceleration[row] * once[row]
            states[:, k, 0], states[:, k, 1] = angle, now
        return states

    return run


def fitted(make, log, start, lower, upper):
    """Numbers and their standard errors; channels weighed by what is left of them."""
    weights = log.noise
    for _ in range(2 if log.is_body else 1):
        rest = lambda numbers: (left(make(log, numbers), log, weights, 1) / weights)[log.counts].ravel()
        found = least_squares(rest, start, bounds=(lower, upper), x_scale=np.maximum(np.abs(start), 1e-3), diff_step=1e-4)
        start = found.x
        weights = np.sqrt(np.mean(left(make(log, start), log, weights, 1)[log.counts] ** 2, axis=0))
    spread = np.linalg.pinv(found.jac.T @ found.jac) * 2 * found.cost / max(1, len(found.fun) - len(start))
    return found.x, np.sqrt(np.diag(spread))


def by_scipy(train, held_out):
    best = (np.inf, "diverges")
    if not train.is_body:
        full = FULL if train.is_paper else train.voltage.max()
        make = lambda log, numbers: rotor_run(log, full, numbers)
        for degree in (2, 3, 4):
            powers = np.stack([train.command ** (i + 1) for i in range(degree)], axis=1)
            curve = np.linalg.lstsq(powers, train.measured[:, 0], rcond=None)[0]
            names = ["c_u", "c_u²", "c_u³", "c_u⁴"][:degree] + ["k_V", "pole", "dead time"]
            lower, upper = [-1e5] * degree + [-500.0, 1.0, 0.0], [1e5] * degree + [500.0, 200.0, 0.1]
            # The error has more than one valley along the dead time.
            for delay in (0.002, 0.02, 0.04):
                numbers, spread = fitted(make, train, [*curve, K_V, POLE, delay], lower, upper)
                rms = error(make(held_out, numbers), held_out)
                if rms < best[0]:
                    known = dict(zip(names, (*CURVE, *[0.0] * (degree - 2), K_V, POLE, 0.0))) if train.is_paper else {"dead time": 0.0}
                    best = (rms, said(names, numbers, spread, known))
    else:
        names = ["inertia", "damping", "offset torque", "dead time"]
        known = dict(zip(names, (INERTIA, 0.0, 0.0, 0.0)))
        for number, torque in enumerate(train.torques):
            train.torque, held_out.torque = torque, held_out.torques[number]
            for delay in (0.002, 0.02) if train.is_held else (0.0,):
                # Measured rotors do turn the body: no dead time.
                latest = 0.1 if train.is_held else 1e-9
                start = [INERTIA / (8 if train.is_held else 1), 1e-3, 0.0, max(delay, 1e-10)]
                numbers, spread = fitted(body_run, train, start, [1e-4, -1.0, -1.0, 0.0], [1.0, 1.0, 1.0, latest])
                rms = error(body_run(held_out, numbers), held_out)
                if rms < best[0]:
                    best = (rms, said(names, numbers, spread, known if train.is_held else dict(list(known.items())[:3])))
    return best


def said(names, numbers, spread, known):
    """Numbers more than three standard errors from what stands for no change, by their distance in those."""
    away = []
    for name, number, width in zip(names, numbers, spread):
        if name in known and width > 0 and abs(number - known[name]) > 3 * width:
            change = f"{name} {known[name]:.4g} → {number:.4g}" if known[name] else f"{name} {number:.4g}"
            away.append((abs(number - known[name]) / width, change))
    return ", ".join(text for _, text in sorted(away, reverse=True)) or "nothing beside its base"


# --- PySINDy: sparse sums of candidate laws, the catalogue's among them


def rotor_library(log, delay, full):
    """Names, what base they are of, power of the rate, and the input that it is multiplied by."""
    command = log.held(log.command, log.time - delay)
    fall = full - log.voltage
    one = np.ones_like(command)
    table = [("1", 0, one), ("u", 0, command), ("u²", 0, command**2), ("u³", 0, command**3), ("u⁴", 0, command**4),
             ("fall", 0, fall), ("ω", 1, one)]
    base = {"1", "u", "u²", "fall", "ω"} | (set() if log.is_paper else {"u³", "u⁴"})
    table += [("u fall", 0, command * fall), ("t", 0, log.time), ("u t", 0, command * log.time), ("ω u", 1, command),
              ("ω fall", 1, fall), ("ω t", 1, log.time), ("ω²", 2, one)]
    for limit in np.arange(0.3, 0.91, 0.05):
        table.append((f"max(u - {limit:.2f}, 0)", 0, np.maximum(command - limit, 0)))
    load = (CURVE[0] * command + CURVE[1] * command**2) ** 3 / 617.0**3
    for warming in (10.0, 20.0, 40.0):
        table.append((f"u heat({warming:.0f} s)", 0, command * first_order(log.time, load[:-1], 1 / warming, 0.0)))
    return table, base


BODY = {
    "1": lambda angle, rate: np.ones_like(rate), "ω": lambda angle, rate: rate, "θ": lambda angle, rate: angle,
    "sin θ": lambda angle, rate: np.sin(angle), "cos θ": lambda angle, rate: np.cos(angle),
    "ω|ω|": lambda angle, rate: rate * np.abs(rate), "tanh(ω/0.05)": lambda angle, rate: np.tanh(rate / 0.05),
    "tanh(ω/0.01)": lambda angle, rate: np.tanh(rate / 0.01),
}


def spans(log, columns, rows, held):
    """Rise of the judged state, and means of the columns, over `rows` rows: integrals, which the noise of a derivative does not bias."""
    step = np.diff(log.time)
    sums = []
    for values, is_held in zip(columns, held):
        values = values[:-1] if is_held else (values[:-1] + values[1:]) / 2
        sums.append(np.r_[0.0, np.cumsum(step * values)])
    sums = np.stack(sums, axis=1)
    begins = np.concatenate([np.arange(a, b - rows) for a, b in log.stretches])
    ends = begins + rows
    long = (log.time[ends] - log.time[begins])[:, None]
    return (sums[ends] - sums[begins]) / long, (log.measured[ends, -1:] - log.measured[begins, -1:]) / long


def sparse(table, goal, threshold):
    """Columns and goal scaled to one size, so that one threshold fits all."""
    import pysindy as ps

    size = np.sqrt(np.mean(table**2, axis=0))
    unit = np.sqrt(np.mean(goal**2))
    size[size == 0] = 1.0
    optimizer = ps.STLSQ(threshold=threshold, alpha=1e-5 * len(goal), max_iter=30)
    optimizer.fit(table / size, goal / unit)
    weights = np.ravel(optimizer.coef_)
    return weights * unit / size, np.abs(weights)


def sindy_rotor_run(log, table, weights):
    add = [np.zeros(len(log.time)) for _ in range(3)]
    for (_, power, values), weight in zip(table, weights):
        add[power] = add[power] + weight * values
    parts = [it.tolist() for it in add]
    at = log.time.tolist()

    def run(starts):
        states = np.full((*log.rows.shape, 1), 0.0)
        for k, (a, b) in enumerate(log.runs):
            now = float(starts[k, 0])
            values = [now]
            for row in range(a, b - 1):
                slope = parts[1][row] + 2 * parts[2][row] * now
                gone = at[row + 1] - at[row]
                force = parts[0][row] + (parts[1][row] + parts[2][row] * now) * now
                # Exact for what is linear in the rate, of second order for its square.
                now += force * (np.expm1(slope * gone) / slope if abs(slope) > 1e-9 else gone)
                if not abs(now) < WORST:
                    return np.full_like(states, np.inf)
                values.append(now)
            states[k, : b - a, 0] = values
        return states

    return run


def sindy_body_run(log, torque, names, weights):
    laws = [(BODY[name], weight) for name, weight in zip(names, weights) if name != "τ" and weight]
    gain = dict(zip(names, weights))["τ"]
    pieces = 4 if any("tanh" in name and weight for name, weight in zip(names, weights)) else 1

    def run(starts):
        angle, rate = starts[:, 0], starts[:, 1]
        states = np.zeros((*log.rows.shape, 2))
        states[:, 0] = starts
        for k in range(1, log.rows.shape[1]):
            row, following = log.rows[:, k - 1], log.rows[:, k]
            gone = (log.time[following] - log.time[row]) / pieces
            one, two = torque[row], torque[row] if log.is_held else torque[following]
            for piece in range(pieces):
                moment = gain * (one + (two - one) * (piece + 0.5) / pieces)
                force = moment + sum(weight * law(angle, rate) for law, weight in laws)
                middle = rate + force * gone / 2
                force = moment + sum(weight * law(angle + rate * gone / 2, middle) for law, weight in laws)
                angle, rate = angle + middle * gone, rate + force * gone
            states[:, k, 0], states[:, k, 1] = angle, rate
        return states

    return run


def by_pysindy(train, held_out):
    best = (np.inf, "diverges", np.inf)
    tried = set()
    delays = (0.0,) if train.is_body and not train.is_held else (0.0, 0.01, 0.02, 0.025, 0.03)
    for number, delay in [(n, d) for n in range(len(train.torques) if train.is_body else 1) for d in delays]:
        if train.is_body:
            late = lambda log: log.held(log.torques[number], log.time - delay) if log.is_held else log.torques[number]
            names = ["τ", *BODY]
            columns = [late(train)] + [law(*train.smooth.T) for law in BODY.values()]
            held, base = [train.is_held] + [False] * len(BODY), {"τ"}
        else:
            full = FULL if train.is_paper else train.voltage.max()
            table, base = rotor_library(train, delay, full)
            other, _ = rotor_library(held_out, delay, full)
            names = [name for name, _, _ in table]
            columns = [values * train.smooth[:, 0] ** power for _, power, values in table]
            held = [power == 0 for _, power, _ in table]
        of_base = np.array([name in base or (train.is_body and name in ("1", "ω")) for name in names])
        # The base, the base with one candidate, and all of them.
        alone = np.eye(len(names), dtype=bool)[~of_base]
        libraries = [of_base, *(of_base | alone), of_base | True]
        means = {rows: spans(train, columns, rows, held) for rows in (1, 2, 5, 10, 20, 40)}
        for rows, library in [(rows, library) for rows in means for library in libraries]:
            inside, goal = means[rows]
            for threshold in (0.0, 0.003, 0.01, 0.03, 0.1, 0.3) if library.all() else (0.0, 0.03):
                weights, sizes = np.zeros((2, len(names)))
                weights[library], sizes[library] = sparse(inside[:, library], goal, threshold)
                key = (number, delay, rows, tuple(weights != 0))
                if key in tried or not weights.any():
                    continue
                tried.add(key)
                run = sindy_body_run(held_out, late(held_out), names, weights) if train.is_body else \
                    sindy_rotor_run(held_out, other, weights)
                rms, terms = error(run, held_out), np.count_nonzero(weights)
                # A term has to take 3 % off the squared error, as an effect of `diagnose`.
                if rms * 1.015 ** terms < best[0]:
                    law = listed([(size, name) for size, name in zip(sizes, names) if size and name not in base])
                    best = (rms * 1.015 ** terms, f"{law}, {1000 * delay:.0f} ms late" if delay else law, rms)
    return best[-1], best[1]


def listed(terms, most=4):
    """The largest by name, the others by number."""
    names = [name for _, name in sorted(terms, reverse=True)]
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return (", ".join(names[:most]) + more) or "nothing beside its base"


# --- SysIdentPy: polynomial NARX, its terms by FROLS


def by_sysidentpy(train, held_out):
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS

    class Stretches(FROLS):
        """Chooses terms by rows only whose lags do not reach across the end of a stretch."""

        def run_mss_algorithm(self, psi, y, process_term_number):
            kept = self.kept[self.max_lag:]
            rows = np.r_[y[:self.max_lag], y[self.max_lag:][kept]]
            _, chosen, _ = self.error_reduction_ratio(psi[kept], rows, process_term_number)
            return np.zeros(psi.shape[1]), chosen, psi[:, chosen]

    best = (np.inf, "diverges")
    widths = (1, 9) if train.is_body else (1,)
    for number in range(len(train.torques) if train.is_body else 1):
        grid, pieces = narx_inputs(train, number, train.step)
        outside = narx_inputs(held_out, number, train.step)
        for width in widths:
            output = pieces["y"] if width == 1 else savgol_filter(pieces["y"], width, 2)
            unit = [np.abs(output).max(), *[max(np.abs(it).max(), 1e-9) for it in pieces["x"]]]
            for degree, ylag, xlag in [(d, y, x) for d in (1, 2, 3) for y in (1, 2) for x in (1, 2, 4)]:
                lags = [list(range(1, xlag + 1)), [1]]
                model = Stretches(ylag=ylag, xlag=lags, order_selection=False, n_terms=40, basis_function=Polynomial(degree=degree))
                most = max(ylag, xlag)
                model.kept = grid["since"] >= most
                table = np.stack([it / u for it, u in zip(pieces["x"], unit[1:])], axis=1)
                scaled = (output / unit[0]).reshape(-1, 1)
                model.n_terms = min(40, terms_of(degree, ylag + xlag + 1))
                model.fit(X=table, y=scaled)
                values = regressors(model.final_model, scaled[:, 0], table)
                for count in (3, 4, 5, 6, 8, 10, 13, 16, 20, 30, 40):
                    if count > len(model.final_model):
                        break
                    weights = np.linalg.lstsq(values[model.kept][:, :count], scaled[model.kept, 0], rcond=None)[0]
                    run = narx_run(held_out, outside, model.final_model[:count], weights, unit, ylag)
                    rms = error(run, held_out)
                    if rms < best[0]:
                        labels = ("ω", "τ", "θ") if train.is_body else ("ω", "u", "V")
                        best = (rms, f"{count} terms: " + ", ".join(written(it, labels) for it in model.final_model[:min(count, 4)])
                                + (", ..." if count > 4 else ""))
    return best


def terms_of(degree, variables):
    return int(np.prod([(variables + k) / k for k in range(1, degree + 1)]) + 0.5)


def written(code, labels):
    """A term of SysIdentPy: 1002 is the output two rows before, 2001 the first input one row before."""
    factors = [f"{labels[it // 1000 - 1]}(k-{it % 1000})" for it in code if it]
    return " ".join(factors) or "1"


def regressors(codes, output, table):
    values = np.ones((len(output), len(codes)))
    for k, code in enumerate(codes):
        for it in code[code > 0]:
            channel = output if it < 2000 else table[:, it // 1000 - 2]
            values[:, k] *= np.r_[np.zeros(it % 1000), channel[: -(it % 1000)]]
    return values


def narx_inputs(log, number, step):
    """Stretches on a grid of equal steps, one after the other; each input is what was held at its instant."""
    times, since, output, inputs = [], [], [], [[], []]
    for a, b in log.stretches:
        at = log.time[a:b] if log.is_body else np.arange(log.time[a], log.time[b - 1] + 1e-9, step)
        times.append(at)
        since.append(np.arange(len(at)))
        output.append(np.interp(at, log.time[a:b], log.measured[a:b, -1]))
        if log.is_body:
            torque = log.torques[number]
            # A torque between rows is their mean; a held one is that of the row before.
            inputs[0].append(torque[a:b] if log.is_held else np.r_[(torque[a:b - 1] + torque[a + 1:b]) / 2, torque[b - 1]])
            inputs[1].append(log.smooth[a:b, 0])
        else:
            inputs[0].append(log.held(log.command, at))
            inputs[1].append(log.held(log.voltage, at) - (FULL if log.is_paper else 25.0))
    grid = {"time": times, "since": np.concatenate(since), "step": step}
    return grid, {"y": np.concatenate(output), "x": [np.concatenate(it) for it in inputs]}


def narx_run(log, prepared, codes, weights, unit, ylag):
    """Free run; what was the output before its first rows is the smoothed measurement, moved with the start."""
    grid, pieces = prepared
    step, torque = grid["step"], pieces["x"][0]
    plain = [([int(it) for it in code if it], float(weight)) for code, weight in zip(codes, weights)]

    def body(starts):
        states = np.zeros((*log.rows.shape, 2))
        shift = starts - log.starts
        for k in range(log.rows.shape[1]):
            row = log.rows[:, k]
            if k < ylag:
                states[:, k] = log.smooth[row] + shift
                continue
            value = 0.0
            for code, weight in plain:
                term = weight
                for it in code:
                    lag, kind = it % 1000, it // 1000
                    if kind == 1:
                        term = term * states[:, k - lag, 1] / unit[0]
                    elif kind == 2:
                        term = term * torque[np.maximum(row - lag, 0)] / unit[1]
                    else:
                        term = term * states[:, k - lag, 0] / unit[2]
                value = value + term
            states[:, k, 1] = value * unit[0]
            states[:, k, 0] = states[:, k - 1, 0] + (states[:, k - 1, 1] + states[:, k, 1]) / 2 * log.step
            if not np.abs(states[:, k]).max() < WORST:
                return np.full_like(states, np.inf)
        return states

    def rotor(starts):
        states = np.zeros((*log.rows.shape, 1))
        for k, (a, b) in enumerate(log.runs):
            at = grid["time"][k]
            # What no output multiplies is known before the run; the rest is polynomials of the outputs before.
            parts = []
            for code, weight in plain:
                known = np.full(len(at), weight)
                for it in [it for it in code if it >= 2000]:
                    values, off = (log.command, 0.0) if it < 3000 else (log.voltage, FULL if log.is_paper else 25.0)
                    known = known * (log.held(values, at - (it % 1000) * step) - off) / unit[it // 1000 - 1]
                parts.append((known.tolist(), [it % 1000 for it in code if it < 2000]))
            shift = starts[k, 0] - log.starts[k, 0]
            values = ((np.interp(at[:ylag], log.time[a:b], log.smooth[a:b, 0]) + shift) / unit[0]).tolist()
            fixed = np.sum([known for known, lags in parts if not lags] or [np.zeros(len(at))], axis=0).tolist()
            moving = [it for it in parts if it[1]]
            for row in range(ylag, len(at)):
                now = fixed[row]
                for known, lags in moving:
                    term = known[row]
                    for lag in lags:
                        term *= values[row - lag]
                    now += term
                if not abs(now) < 100:
                    return np.full_like(states, np.inf)
                values.append(now)
            states[k, : b - a, 0] = np.interp(log.time[a:b], at, np.array(values) * unit[0])
        return states

    return body if log.is_body else rotor


def main():
    method, *paths = sys.argv[1:]
    answer = {"pysindy": by_pysindy, "sysidentpy": by_sysidentpy, "scipy": by_scipy}[method]
    __import__(method)
    began = time.perf_counter()
    rms, names = answer(*map(Log, paths))
    print(json.dumps({"names": names, "held_out": rms if np.isfinite(rms) else None, "unit": "rad/s",
                      "seconds": time.perf_counter() - began}, ensure_ascii=False))


main()
