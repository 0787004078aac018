# requires: numpy pyulog
"""Random PX4 logs, and what pyulog reads in them.

    ulog.py FOLDER SEED COUNT
"""

import json
import random
import struct
import sys
from pathlib import Path

import numpy as np
from pyulog import ULog

TYPES = {"int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I", "int64_t": "q",
         "uint64_t": "Q", "float": "f", "double": "d", "bool": "?"}


def message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


def keyed(key, value):
    return struct.pack("<B", len(key)) + key.encode() + value


def value(rng, kind):
    """A value of a type, packed."""
    letter = TYPES[kind]
    if letter in "fd":
        number = rng.choice([rng.gauss(0, 1), rng.gauss(0, 1e6), float("nan"), float("-inf"), 0.0])
    elif letter == "?":
        number = rng.random() < 0.5
    else:
        bits = 8 * struct.calcsize(letter)
        # Beyond 2^53 the reference's conversion to f64 rounds as ours does.
        number = rng.getrandbits(bits) - (0 if letter.isupper() else 1 << (bits - 1))
    return struct.pack("<" + letter, number)


def fields(rng, count):
    """Definition and how to make a row of it."""
    text, makers = "", []
    for index in range(count):
        kind = rng.choice(list(TYPES))
        length = rng.choice([None, None, 1, 3])
        text += f"{kind}{'' if length is None else f'[{length}]'} f{index};"
        makers.extend([kind] * (length or 1))
    if rng.random() < 0.4:
        text += "char[5] text;"
        makers.append(None)
    return text, lambda: b"".join(value(rng, kind) if kind else b"hello" for kind in makers)


class Log:
    """A log under way."""

    def __init__(self, rng):
        self.rng, self.bytes, self.topics, self.now = rng, b"", [], rng.randrange(10**8)

    def define(self, text):
        self.bytes += message("F", text.encode())

    def topic(self, name, row, instances=1):
        for instance in range(instances):
            self.topics.append((len(self.topics), name, instance, row))

    def rows(self, count):
        for _ in range(count):
            self.now += self.rng.randrange(1, 20_000)
            number, _, _, row = self.rng.choice(self.topics)
            self.bytes += message("D", struct.pack("<HQ", number, self.now) + row())
            if self.rng.random() < 0.02:
                self.bytes += self.rng.choice([
                    message("S", bytes.fromhex("2f731320250cbb12")),
                    message("O", struct.pack("<H", 40)),
                    message("L", struct.pack("<BQ", 54, self.now) + b"taking off"),
                    message("C", struct.pack("<BHQ", 54, 3, self.now) + b"tagged"),
                    message("I", keyed("uint32_t later", struct.pack("<I", 7))),
                    message("P", keyed("float MPC_X", struct.pack("<f", 1.5))),
                    message("Z", b"of a later version"),
                ])


def esc_status(log):
    """Eight ESCs of which some are there; which motor each drives, or nothing of that."""
    rng = log.rng
    named = rng.random() < 0.5
    log.define("esc_report:uint64_t timestamp;int32_t esc_rpm;float esc_voltage;float esc_current;float esc_temperature;"
               + "uint8_t esc_state;" + ("uint8_t actuator_function;" if named else "") + "uint8_t[2] _padding0;")
    log.define("esc_status:uint64_t timestamp;uint16_t counter;uint8_t esc_count;uint8_t[5] _padding0;esc_report[8] esc;")
    there = rng.randrange(1, 9)
    stamped = rng.random() < 0.8
    order = rng.sample(range(there), there)
    last = [bytes(25 + named) + bytes(2)] * 8

    def row():
        for esc in rng.sample(range(there), rng.randrange(1, there + 1)):
            rates = struct.pack("<ifffB", rng.randrange(-9000, 9000), 15 + rng.random(), rng.random(), 30 + rng.random(), 1)
            # A servo has a place among the ESCs in simulations, too.
            function = struct.pack("<B", 101 + order[esc] if order[esc] < 6 else 45) if named else b""
            last[esc] = struct.pack("<Q", log.now if stamped else 0) + rates + function + bytes(2)
        return struct.pack("<HB5x", rng.randrange(65536), there) + b"".join(last)

    log.topic("esc_status", row)


def write(rng):
    """The bytes of a log."""
    log = Log(rng)
    log.bytes = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", log.now)
    flags_at = len(log.bytes)
    log.bytes += message("B", bytes(40))
    log.bytes += message("I", keyed("char[3] sys_name", b"PX4")) + message("I", keyed("char[4] ver_hw", b"V5X\0"))
    log.bytes += message("M", b"\0" + keyed("char[3] boot", b"log")) + message("P", keyed("int32_t SDLOG_PROFILE", struct.pack("<i", 1)))
    log.bytes += message("Q", b"\1" + keyed("int32_t SDLOG_PROFILE", struct.pack("<i", 1)))
    for index in range(rng.randrange(1, 5)):
        text, row = fields(rng, rng.randrange(1, 8))
        padding = rng.choice(["", "uint8_t[3] _padding0;"])
        log.define(f"topic_{index}:uint64_t timestamp;{text}{padding}")
        log.topic(f"topic_{index}", row, rng.randrange(1, 4))
    text, row = fields(rng, 3)
    log.define(f"inner:{text}")
    log.define("outer:uint64_t timestamp;inner[2] part;float last;")
    log.topic("outer", lambda row=row: row() + row() + value(rng, "float"))
    log.define("vehicle_attitude:uint64_t timestamp;float[4] q;uint8_t quat_reset_counter;uint8_t[7] _padding0;")

    def attitude():
        q = np.array([rng.gauss(0, 1) for _ in range(4)])
        return struct.pack("<4fB", *(q / np.linalg.norm(q)), 3)

    log.topic("vehicle_attitude", attitude)
    log.define("actuator_motors:uint64_t timestamp;uint64_t timestamp_sample;uint16_t reversible_flags;float[12] control;")
    log.topic("actuator_motors", lambda: struct.pack("<QH12f", log.now - 300, 0, *([rng.random() for _ in range(4)] + [float("nan")] * 8)))
    esc_status(log)
    subscriptions = b"".join(message("A", struct.pack("<BH", instance, number) + name.encode())
                             for number, name, instance, _ in log.topics)
    log.bytes += subscriptions
    log.rows(rng.randrange(100, 300))
    if rng.random() < 0.5:
        # Power was lost within a message, and after the reboot more was appended. The reference wants to hear again what the
        # message ids stand for.
        log.bytes += message("D", struct.pack("<HQ", 0, log.now) + bytes(50))[:20]
        offset = len(log.bytes)
        flags = bytes(8) + b"\1" + bytes(7) + struct.pack("<3Q", offset, 0, 0)
        log.bytes = log.bytes[:flags_at] + message("B", flags) + log.bytes[flags_at + 43:]
        log.bytes += subscriptions
        log.rows(50)
    return log.bytes


def table(name, time, columns):
    plain = lambda values: [float(it) if np.isfinite(it) else str(it) for it in np.asarray(values, dtype=np.float64)]
    columns = [{"name": key, "values": plain(it)} for key, it in columns.items() if not np.isnan(it).all()]
    return {"name": name, "time": plain(time), "columns": columns}


def read(path):
    """The tables that our reader should make, by pyulog and the rules of our page."""
    log = ULog(str(path))
    tables = []
    # One for each run of data: those of a name and an instance are one topic.
    together = {}
    for data in log.data_list:
        first = together.setdefault((data.name, data.multi_id), data)
        if first is not data:
            first.data = {key: np.concatenate([values, data.data[key]]) for key, values in first.data.items()}
    for data in together.values():
        name = data.name + (f"[{data.multi_id}]" if data.multi_id else "")
        texts = {field.field_name for field in data.field_data if field.type_str == "char"}
        columns = {key: np.asarray(it, dtype=np.float64) for key, it in data.data.items()
                   if key not in texts and not key.split(".")[-1].startswith("_padding")}
        if data.name == "vehicle_attitude":
            w, x, y, z = (columns[f"q[{index}]"] for index in range(4))
            columns["roll"] = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
            columns["pitch"] = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
            columns["yaw"] = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        time = columns.pop("timestamp") / 1e6
        parts = [key[: -len(".timestamp")] for key in columns if key.endswith(".timestamp")]
        own = {part: {key[len(part) + 1:]: columns.pop(key) for key in list(columns) if key.startswith(part + ".")} for part in parts}
        if columns:
            tables.append(table(name, time, columns))
        new = {}
        for part, inner in own.items():
            stamps = inner["timestamp"]
            new[part] = (stamps != 0) & (stamps != np.concatenate([[0], stamps[:-1]]))
        functions = {part: set(inner["actuator_function"][new[part]]) for part, inner in own.items() if "actuator_function" in inner}
        functions = {part: int(it.pop()) - 101 for part, it in functions.items() if len(it) == 1}
        functions = {part: motor for part, motor in functions.items() if 0 <= motor < 12}
        for part, inner in own.items():
            stamps = inner.pop("timestamp")
            called = part.replace("esc[", "motor[")
            if functions:
                called = f"motor[{functions[part]}]" if part in functions else part
            if new[part].any():
                tables.append(table(f"{name}.{called}", stamps[new[part]] / 1e6, {key: it[new[part]] for key, it in inner.items()}))
            elif not any(it.any() for it in new.values()) and any(it.any() for it in inner.values()):
                tables.append(table(f"{name}.{called}", time, inner))
    return {"tables": [it for it in tables if it["columns"]]}


def main():
    folder, seed, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    for index in range(count):
        path = folder / f"{seed + index}.ulg"
        path.write_bytes(write(random.Random(seed + index)))
        path.with_suffix(".ulg.json").write_text(json.dumps(read(path), allow_nan=False))


if __name__ == "__main__":
    main()
