"""Long logs of an attitude bench at 1 kHz with a hidden pendulum, and what a program takes."""
import os
import subprocess
import sys
import time

MOMENT = 0.4  # [N m] of the hidden pendulum
MOVES = [(5, 0.5, 3), (15, -0.5, 4), (28, 0.3, 1.5), (40, -0.4, 2), (55, 0.6, 3), (70, -0.6, 4), (85, 0.2, 1), (100, -0.2, 2)]


def bench(seconds):
    """A bench at 1 kHz whose body is moved about again and again, with a battery that lasts."""
    moves = [
        f"{{ at_s = {start + at}, angle_rad = {angle}, duration_s = {duration} }},"
        for start in range(0, seconds + 1, 115)
        for at, angle, duration in MOVES
    ]
    return "\n".join(
        ['name = "scale"', "period_s = 0.001", "[guard]", "slew_per_s = 100", "[emulator.battery]", "capacity_ah = 40",
         "[controller.reference]", "moves = [", *moves, "]", ""]
    )


def measured(command):
    """Wall time [s], time of the processors [s], greatest memory [MB] and standard output of a program."""
    start = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    output, said = child.stdout.read(), child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    # 1: found wanting, which is so.
    if os.waitstatus_to_exitcode(status) not in (0, 1):
        sys.exit(f"{' '.join(map(str, command))}: {said}")
    seconds = time.perf_counter() - start
    return seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000, output


def recorded(program, folder, rows, number):
    """A log of so many rows, the first or the one for validation; recorded where it is not there yet."""
    path = folder / f"{'log' if number == 1 else 'validation'}_{rows}.csv"
    if not path.exists():
        config = folder / "bench.toml"
        config.write_text(bench(rows // 1000))
        command = [program, "experiment", "prbs", "--config", config, "--duration", str(rows / 1000), "--lockstep",
                   "--closed-loop", "--amplitude", "0.03", "--bandwidth", "25", "--seed", str(number), "--sequence",
                   str(number), "--hide", f"gravity_pendulum:moment={MOMENT},angle_offset=0", "-o", path, "--force"]
        measured(command)
    return path
