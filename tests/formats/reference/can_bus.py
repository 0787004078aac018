# requires: python-can
"""Random captures of a bus in Vector's formats, and the frames that python-can reads in them.

    can_bus.py FOLDER SEED COUNT
"""

import json
import random
import sys
from datetime import timezone
from pathlib import Path

import can

FD_LENGTHS = [1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64]


def message(rng, now, with_errors):
    extended = rng.random() < 0.3
    fields = {
        "timestamp": now,
        "arbitration_id": rng.randrange(1 << (29 if extended else 11)),
        "is_extended_id": extended,
        "channel": rng.randrange(3),
        "is_rx": rng.random() < 0.7,
    }
    kind = rng.random()
    if kind < 0.1 and with_errors:
        return can.Message(timestamp=now, channel=fields["channel"], is_error_frame=True, dlc=0)
    if kind < 0.2:
        return can.Message(is_remote_frame=True, dlc=rng.randrange(9), **fields)
    if kind < 0.5:
        return can.Message(is_fd=True, bitrate_switch=rng.random() < 0.5, error_state_indicator=rng.random() < 0.5,
                           data=rng.randbytes(rng.choice(FD_LENGTHS)), **fields)
    return can.Message(data=rng.randbytes(rng.randrange(9)), **fields)


def write(rng, path):
    now = 1_700_000_000 + rng.randrange(10**6)
    if path.suffix == ".asc":
        writer = can.ASCWriter(str(path), tz=timezone.utc, timestamps_format=rng.choice(["absolute", "relative"]))
    else:
        writer = can.BLFWriter(str(path), compression_level=rng.choice([-1, 0, 9]),
                               max_container_size=rng.choice([500, 10_000, 128 * 1024]))
    with writer:
        for _ in range(rng.randrange(50, 400)):
            now += rng.randrange(1, 20_000) * 1e-6
            writer.on_message_received(message(rng, now, True))
            if rng.random() < 0.02:
                writer.log_event("a remark", now)


def read(path):
    """Stamp, channel, identifier, flags as letters, length, data. Stamps of ASC count from the first line."""
    if path.suffix == ".asc":
        absolute = "timestamps absolute" in path.read_text()
        reader = can.ASCReader(str(path), relative_timestamp=absolute, tz=timezone.utc)
    else:
        reader = can.BLFReader(str(path))
    messages = list(reader)
    start = 0.0 if path.suffix == ".blf" or absolute else reader.start_time
    frames = []
    for it in messages:
        fd = it.is_fd and not it.is_error_frame and not it.is_remote_frame
        letters = "".join(letter for letter, is_so in [
            ("x", it.is_extended_id and not it.is_error_frame), ("r", it.is_remote_frame), ("e", it.is_error_frame),
            ("f", fd), ("b", it.bitrate_switch and fd), ("s", it.error_state_indicator and fd),
            ("t", not it.is_rx)] if is_so)
        known = not it.is_error_frame
        # A classic frame may say a length of up to 15, and has 8 bytes then; there is no remote frame of FD.
        length = it.dlc if fd else min(it.dlc, 8)
        frames.append([it.timestamp - start, it.channel + 1, it.arbitration_id if known else 0, letters,
                       length if known else 0, it.data.hex() if known else ""])
    return {"frames": frames}


def main():
    folder, seed, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    for index in range(count):
        path = folder / f"{seed + index}{'.blf' if index % 2 else '.asc'}"
        write(random.Random(seed + index), path)
        path.with_suffix(path.suffix + ".json").write_text(json.dumps(read(path), allow_nan=False))


if __name__ == "__main__":
    main()
