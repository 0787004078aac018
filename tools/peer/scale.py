"""Time, memory and answer over rows: rotorbench, pandas and scipy on the same logs; Markdown on standard output.

scale.py PROGRAM FOLDER ROWS...
"""
import json
import sys
from pathlib import Path

from long_logs import measured, recorded

program, folder, all_rows = sys.argv[1], Path(sys.argv[2]), [int(word) for word in sys.argv[3:]]

PANDAS = "import sys, pandas; print(len(pandas.read_csv(sys.argv[1])))"
# The rotor's pole and curve by variable projection over the pole, as a script for one evening would have it.
SCIPY = """
import sys, numpy as np, pandas
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter
log = pandas.read_csv(sys.argv[1])
u, w = log["command_1"].ffill().to_numpy(), log["propeller_rate_1_rad_s"].to_numpy()
known, step = np.isfinite(w), 0.001
def left(pole):
    keep = np.exp(-pole * step)
    columns = [lfilter([0, 1 - keep], [1, -keep], power) for power in (np.ones_like(u), u, u * u)]
    columns = np.c_[tuple(columns) + (keep ** np.arange(len(u)),)][known]
    solution, *_ = np.linalg.lstsq(columns, w[known], rcond=None)
    return np.sqrt(np.mean((columns @ solution - w[known]) ** 2))
print(minimize_scalar(left, bounds=(5, 50), method="bounded", options={"xatol": 1e-4}).x)
"""


def table(rows):
    """Lines of the table for logs of so many rows."""
    log, validation = recorded(program, folder, rows, 1), recorded(program, folder, rows, 2)
    size = log.stat().st_size / 1e6
    read = measured([sys.executable, "-c", PANDAS, log])
    fitted = measured([sys.executable, "-c", SCIPY, log])
    lines = []

    def line(work, taken, answer, peer=None):
        seconds, processor, memory, _ = taken
        ratio = "-" if peer is None else f"{seconds / peer[0]:.2f}"
        lines.append(f"| {rows:,} | {work} | {seconds:.2f} | {processor:.2f} | {memory:.0f} | {ratio} | {answer} |")

    line("pandas reads the log", read, f"{size:.0f} MB of CSV")
    line("scipy fits one rotor's pole and curve", fitted, f"p = {float(fitted[3]):.3f} rad/s")
    line("`import`, beside pandas", measured([program, "import", log]), "", read)
    taken = measured([program, "compare", "--log", log, "--json"])
    blocks = {block["signal"]: block for block in json.loads(taken[3])["comparisons"][0]["blocks"] if block["name"] == "body"}
    line("`compare`, beside pandas", taken, f"body rate {blocks['body_rate_rad_s']['error']['rms']:.3f} rad/s", read)
    model = folder / "identified.toml"
    taken = measured([program, "identify", "--log", log, "-o", model, "--force"])
    pole = next((text for text in model.read_text().splitlines() if text.startswith("pole")), "pole = ?")
    line("`identify`, beside scipy", taken, f"p = {float(pole.split('=')[1]):.3f} rad/s", fitted)
    beside = {"thirds of the log held out": [], "with as long a validation log": ["--validate", validation]}
    for held_out, more in beside.items():
        taken = measured([program, "diagnose", "--log", log, *more, "--json"])
        found = json.loads(taken[3])
        moment = found["parameters"].get("gravity_pendulum.moment", {"value": float("nan"), "standard_error": float("nan")})
        error = moment["standard_error"]
        named = " + ".join(found["effects"]) or found["verdict"]
        line(f"`diagnose`, {held_out}", taken, f"{named}, m = {moment['value']:.5f} ± {error if error is None else f'{error:.1e}'} N m")
    for held_out, more in beside.items():
        taken = measured([program, "extend", "--force", "--effect", "gravity_pendulum", "--log", log, *more, "-o", folder / "extended.toml", "--json"])
        found = json.loads(taken[3])["error"]["extended"]["validate"]
        line(f"`extend`, {held_out}", taken, f"held-out error {found:.5f} rad/s")
    return lines


print("| rows | work | time [s] | of processors [s] | memory [MB] | ratio | answer |")
print("|---|---|---|---|---|---|---|")
for rows in all_rows:
    print(f"tools/scale: {rows} rows", file=sys.stderr)
    print("\n".join(table(rows)), flush=True)
