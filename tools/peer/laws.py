#!/usr/bin/env python3
"""Laws outside the catalogue by PySINDy or by gplearn, asked as `rotorbench discover` is, so that `campaign score` judges all by one rule:

    laws.py discover --json --model paper --log a.csv --validate b.csv        (ROTORBENCH_PEER=pysindy or gplearn)

Each gets what is known without a law: the paper's base, its pole, inertia and thrust curve, and the channels that `discover` may look
at. What is left of the measured acceleration (smoothed, as is best on the held-out log) is theirs to explain. Everything that one of
them finds is called a law where it explains most of the held-out variance of that.
"""
import json
import os
import sys
import warnings

import numpy as np

warnings.filterwarnings("ignore")
C_G = (1124.5, 447.1)  # [rad/s] g(u) = 1124.5 u + 447.1 u², [LPC16] Table I
K_V, FULL, POLE = 40.0, 12.6, 16.0  # [rad/(s V)], [V], [rad/s]
THRUST, ARM, INERTIA = 0.0197**2 / (4 * 6.0771), 0.25, 0.032  # [N s²/rad²], [m], [kg m²]
SMOOTHERS = (5, 9, 15)  # [rows] windows of the smoothed derivative
LEAST_EXPLAINED = 0.6  # as `discover` asks


def read(path, window):
    """Channels and what the base leaves of the acceleration."""
    from scipy.signal import savgol_filter

    log = np.genfromtxt(path, delimiter=",", names=True)
    step = float(np.median(np.diff(log["time_s"])))
    slope = lambda values: savgol_filter(values, window, 3, deriv=1, delta=step)
    smooth = lambda values: savgol_filter(values, window, 3)
    if "body_rate_rad_s" in log.dtype.names:
        rates = [smooth(log[f"propeller_rate_{k}_rad_s"]) for k in (1, 2)]
        torque = ARM * THRUST * (rates[0] ** 2 - rates[1] ** 2)
        channels = {"body_angle": smooth(log["body_angle_rad"]), "body_rate": smooth(log["body_rate_rad_s"]),
                    "torque": torque, "time": log["time_s"]}
        left = INERTIA * slope(log["body_rate_rad_s"]) - torque
        return channels, torque, left
    command, voltage, rate = log["command_1"], log["battery_voltage_v"], smooth(log["propeller_rate_1_rad_s"])
    steady = C_G[0] * command + C_G[1] * command**2 - K_V * (FULL - voltage)
    channels = {"command": command, "battery_voltage": voltage, "propeller_rate": rate, "time": log["time_s"]}
    return channels, steady, slope(rate) / POLE - (steady - rate)


LOGGED = {"body_angle": "body_angle_rad", "body_rate": "body_rate_rad_s", "torque": "torque_nm", "time": "time_s",
          "command": "command", "battery_voltage": "battery_voltage_v", "propeller_rate": "propeller_rate_rad_s"}


def pysindy(train, held_out):
    """Sparse combinations of powers, sizes, saturations and waves of the channels."""
    import pysindy as ps

    names = list(train[0])
    terms = []
    for name in names:
        span = float(np.ptp(train[0][name])) or 1.0
        if name == "time":
            terms += [name]
            continue
        terms += [name, f"{name}^2", f"{name}^3", f"abs({name})", f"{name}*abs({name})",
                  f"tanh({name}/{0.1 * span:.6g})"]
        for turns in (1, 2, 3, 4, 6, 8):
            terms += [f"{wave}({2 * np.pi * turns / span:.6g}*{name})" for wave in ("sin", "cos")]
        terms += [f"{name}*{other}" for other in names if other > name and other != "time"]
    value = lambda term, channels: np.broadcast_to(
        eval(term.replace("^", "**"), {"sin": np.sin, "cos": np.cos, "tanh": np.tanh, "abs": np.abs}, dict(channels)),
        next(iter(channels.values())).shape)
    table = lambda data: np.c_[tuple(value(term, data[0]) for term in terms)]
    inside, outside = table(train), table(held_out)
    best = None
    for threshold in (1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0):
        optimizer = ps.STLSQ(threshold=threshold, alpha=0.05, normalize_columns=True)
        optimizer.fit(inside, train[2].reshape(-1, 1))
        weights = np.ravel(optimizer.coef_)
        score = explained(held_out[2], outside @ weights) - 0.005 * np.count_nonzero(weights)
        if best is None or score > best[0]:
            best = (score, " + ".join(f"({w:.8g})*{term}" for term, w in zip(terms, weights) if w != 0.0))
    return best[0], best[1] or "0"


def gplearn(train, held_out):
    """Symbolic regression over the channels."""
    from gplearn.genetic import SymbolicRegressor

    names = list(train[0])
    table = lambda data: np.c_[tuple(data[0][name] for name in names)]
    found = SymbolicRegressor(
        population_size=1000, generations=20, function_set=("add", "sub", "mul", "div", "sin", "cos", "abs", "max"),
        parsimony_coefficient=1e-4, metric="mse", random_state=1, feature_names=names, const_range=(-50.0, 50.0))
    found.fit(table(train), train[2])
    program = found._program.program
    return explained(held_out[2], found.predict(table(held_out))), written(list(program), names)


def written(program, names):
    """A program of gplearn, which is in prefix order, as an expression."""
    head = program.pop(0)
    if not hasattr(head, "arity"):
        return names[head] if isinstance(head, (int, np.integer)) else f"({float(head):.8g})"
    parts = [written(program, names) for _ in range(head.arity)]
    signs = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
    if head.name in signs:
        return f"({parts[0]}{signs[head.name]}{parts[1]})"
    return f"{head.name}({','.join(parts)})"


def explained(truth, said):
    return 1.0 - float(np.var(truth - said) / np.var(truth))


def main():
    path = lambda option: sys.argv[sys.argv.index(option) + 1]
    method = {"pysindy": pysindy, "gplearn": gplearn}[os.environ["ROTORBENCH_PEER"]]
    best = None
    for window in SMOOTHERS:
        train, held_out = read(path("--log"), window), read(path("--validate"), window)
        score, expression = method(train, held_out)
        if best is None or score > best[0]:
            best = (score, expression, [name for name in train[0] if name in expression], "body_angle" in train[0])
    score, expression, channels, is_body = best
    print(json.dumps({
        "verdict": "law" if score > LEAST_EXPLAINED else "unknown",
        "site": "torque" if is_body else "steady_rate",
        "channels": [LOGGED[name] for name in channels], "expression": expression, "parameters": {},
        "effects": [], "alternatives": [], "error": {"extended": {"validate": None}, "noise_floor": None},
    }))


main()
