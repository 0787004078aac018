"""The missing law of an attitude log by PySINDy: which terms, how right, how long, as JSON.

It gets what `diagnose` has: the log, the rotors' thrust curve, and as candidates the laws of the catalogue that act on
the body. It may choose differentiation and threshold by the held-out log, which `diagnose` gets, too.
"""
import json
import sys
import time
import warnings

import numpy as np
import pysindy as ps

warnings.filterwarnings("ignore")
THRUST_COEFFICIENT = 0.0197**2 / (4 * 6.0771)  # [N s²/rad²], [LPC16] Fig. 4: f = c ω² with the printed tangent
ARM = 0.25  # [m]
NAMES = ["θ", "ω", "τ", "sin θ", "cos θ", "ω|ω|", "tanh(ω/0.05)"]


def read(path):
    log = np.genfromtxt(path, delimiter=",", names=True)
    angle, rate = log["body_angle_rad"], log["body_rate_rad_s"]
    first, second = (THRUST_COEFFICIENT * log[f"propeller_rate_{k}_rad_s"] ** 2 for k in (1, 2))
    torque = ARM * (first - second)
    inputs = np.c_[torque, np.sin(angle), np.cos(angle), rate * np.abs(rate), np.tanh(rate / 0.05)]
    if not np.isfinite(inputs).all():
        sys.exit(f"{path}: a regular log without holes is needed")
    return log["time_s"], np.c_[angle, rate], inputs


train, held_out = read(sys.argv[1]), read(sys.argv[2])
differentiations = [
    ps.FiniteDifference(),
    ps.SmoothedFiniteDifference(),
    ps.SmoothedFiniteDifference(smoother_kws={"window_length": 25}),
]
best, tried = None, 0
start = time.perf_counter()
for differentiation in differentiations:
    for threshold in (0.01, 0.1, 0.5, 1.0, 2.0, 5.0):
        model = ps.SINDy(
            optimizer=ps.STLSQ(threshold=threshold, alpha=0.0),
            feature_library=ps.PolynomialLibrary(degree=1, include_bias=True),
            differentiation_method=differentiation,
        )
        model.fit(train[1], u=train[2], t=train[0], feature_names=NAMES)
        terms = {
            name: float(value)
            for name, value in zip(model.get_feature_names(), model.coefficients()[1])
            if value != 0.0
        }
        # Half a percent of what is explained is worth less than a term.
        score = model.score(held_out[1], u=held_out[2], t=held_out[0]) - 0.005 * len(terms)
        tried += 1
        if best is None or score > best[0]:
            best = (score, terms)
print(json.dumps({"terms": best[1], "seconds": time.perf_counter() - start, "tried": tried}))
