# requires: pymavlink
"""Random ArduPilot DataFlash logs, and what pymavlink reads in them.

    dataflash.py FOLDER SEED COUNT
"""

import json
import math
import os
import random
import struct
import sys
from pathlib import Path

os.environ["PYMAVLINK_FAST_INDEX"] = "0"
from pymavlink import DFReader

LETTERS = {"b": "b", "B": "B", "h": "h", "H": "H", "i": "i", "I": "I", "q": "q", "Q": "Q", "f": "f", "d": "d", "g": "e",
           "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B", "n": "4s", "N": "16s", "Z": "64s", "a": "32h"}
OWN = {"c": 100, "C": 100, "e": 100, "E": 100, "L": 1e7}
UNITS = {"-": "", "A": "A", "d": "deg", "k": "deg/s", "E": "rad/s", "h": "degheading", "O": "degC", "%": "%", "s": "s", "q": "rpm",
         "r": "rad", "v": "V", "Y": "us", "z": "Hz", "m": "m", "n": "m/s", "o": "m/s/s", "P": "Pa", "G": "Gauss", "#": "instance"}
OURS = {"degheading": "deg", "m/s/s": "m/s^2", "Pa": "", "Gauss": "", "instance": ""}
MULTIPLIERS = {"-": 0, "?": 1, "2": 1e2, "0": 1, "A": 1e-1, "B": 1e-2, "C": 1e-3, "F": 1e-6, "G": 1e-7, "!": 3.6, "/": 3600}


def number(rng, letter):
    code = LETTERS[letter]
    if letter == "a":
        return [rng.randrange(-32768, 32768) for _ in range(32)]
    if code.endswith("s"):
        return rng.choice([b"text", b"", b"\xc3\xa9"])
    if code in "fd":
        value = rng.choice([rng.gauss(0, 1), rng.gauss(0, 1e6), math.nan, 0.0])
        return struct.unpack(code, struct.pack(code, value))[0]
    if code == "e":
        return rng.choice([1.5, -0.25, 65504.0, 6e-8, 0.0])
    # The reference reader takes the flight mode for a number with a sign.
    bits = 7 if letter == "M" else 8 * struct.calcsize(code)
    return rng.getrandbits(bits) - (0 if code.isupper() else 1 << bits - 1)


class Log:
    def __init__(self, rng):
        self.rng, self.bytes, self.kinds, self.now = rng, b"", {}, rng.randrange(10**8)
        self.define(0x80, "FMT", "BBnNZ", ["Type", "Length", "Name", "Format", "Columns"])
        self.define(0x90, "FMTU", "QBNN", ["TimeUS", "FmtType", "UnitIds", "MultIds"])
        self.define(0x91, "UNIT", "QbZ", ["TimeUS", "Id", "Label"])
        self.define(0x92, "MULT", "Qbd", ["TimeUS", "Id", "Mult"])
        self.define(0x93, "PARM", "QNff", ["TimeUS", "Name", "Value", "Default"])
        self.define(0x94, "MSG", "QZ", ["TimeUS", "Message"])
        for letter, label in UNITS.items():
            self.write(0x91, self.now, ord(letter), label.encode())
        for letter, value in MULTIPLIERS.items():
            # As the firmware, which holds them as numbers of 32 bits.
            self.write(0x92, self.now, ord(letter), struct.unpack("f", struct.pack("f", value))[0])

    def write(self, kind, *values):
        flat = [part for value in values for part in (value if isinstance(value, list) else [value])]
        code = "<" + "".join(LETTERS[letter] for letter in self.kinds[kind]["letters"])
        self.bytes += bytes([0xA3, 0x95, kind]) + struct.pack(code, *flat)

    def define(self, kind, name, letters, columns, units="", multipliers=""):
        self.kinds[kind] = {"name": name, "letters": letters, "columns": columns, "units": units, "multipliers": multipliers}
        length = 3 + struct.calcsize("<" + "".join(LETTERS[letter] for letter in letters))
        self.bytes += bytes([0xA3, 0x95, 0x80]) + struct.pack("<BB4s16s64s", kind, length, name.encode(), letters.encode(),
                                                               ",".join(columns).encode())
        if units:
            self.write(0x90, self.now, kind, units.encode(), multipliers.encode())

    def row(self, kind, instances):
        self.now += self.rng.randrange(1, 9_000)
        it = self.kinds[kind]
        values = [number(self.rng, letter) for letter in it["letters"]]
        values[0] = self.now
        if it["units"][1:2] == "#":
            values[1] = self.rng.randrange(instances)
        if it["name"] == "RCOU":
            values[1:] = [self.rng.randrange(1000, 2001) for _ in values[1:]]
        self.write(kind, *values)


def write(rng):
    """The bytes of a log, what it says of its messages, and its parameters."""
    log = Log(rng)
    log.write(0x94, log.now, b"ArduCopter V4.5.1 (d3fc0b6c)")
    outputs = rng.sample(range(1, 9), 4)
    parameters = {f"SERVO{output}_FUNCTION": 33 + motor for motor, output in enumerate(outputs)}
    parameters["MOT_PWM_TYPE"] = rng.choice([0, 6])
    if rng.random() < 0.7:
        parameters |= {"MOT_PWM_MIN": 1100, "MOT_PWM_MAX": 1940}
    for name, value in parameters.items():
        log.write(0x93, log.now, name.encode(), value, math.nan)
    log.define(10, "RCOU", "Q" + "H" * 8, ["TimeUS"] + [f"C{place}" for place in range(1, 9)], "s" + "Y" * 8, "F" + "-" * 8)
    log.define(11, "ESC", "QBffffcfcf", "TimeUS,Instance,RPM,RawRPM,Volt,Curr,Temp,CTot,MotTemp,Err".split(","), "s#qqvAO-O%", "F-00--B-B-")
    log.define(12, "ATT", "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw".split(","), "sddddhh", "FBBBBBB")
    log.define(13, "IMU", "QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz".split(","), "s#EEEooo--O--zz", "F-000000-----00")
    log.define(14, "BAT", "QBfffffcfBBf", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H,SH".split(","), "s#vvAaXOw%-%", "F-000C0?0000")
    kinds = [10, 11, 12, 13, 14]
    for kind in range(20, 20 + rng.randrange(1, 6)):
        letters = "Q" + "".join(rng.choice("bBhHiIqQfdgcCeELMnN") for _ in range(rng.randrange(1, 8))) + rng.choice(["", "", "a", "Z"])
        units = "s" + "".join(rng.choice("-AdkEhO%srvYzmnoPG") for _ in letters[1:])
        if letters[1] == "B" and rng.random() < 0.7:
            units = "s#" + units[2:]
        multipliers = "F" + "".join(rng.choice(list(MULTIPLIERS)) for _ in letters[1:])
        log.define(kind, f"T{kind}", letters, ["TimeUS"] + [f"F{place}" for place in range(1, len(letters))], units, multipliers)
        kinds.append(kind)
    # Of old firmware: milliseconds, no units.
    log.define(40, "OLD", "Ihf", ["TimeMS", "X", "Y"])
    for _ in range(rng.randrange(100, 250)):
        log.row(rng.choice(kinds), 8)
        if rng.random() < 0.05:
            log.write(40, log.now // 1000, 5, 0.5)
    return log, parameters, outputs


def read(path, log, parameters, outputs):
    """The tables that our reader should make."""
    tables = {}
    reader = DFReader.DFReader_binary(str(path))
    kinds = {it["name"]: it for it in log.kinds.values()}
    digital = parameters["MOT_PWM_TYPE"] == 6
    low, high = (parameters.get("MOT_PWM_MIN", 1000), parameters.get("MOT_PWM_MAX", 2000)) if not digital else (1000, 2000)

    def add(name, time, columns):
        found = tables.setdefault(name, {"name": name, "time": [], "columns": [{"name": key, "unit": unit, "values": []} for key, unit, _ in columns]})
        found["time"].append(time)
        for column, (_, _, value) in zip(found["columns"], columns):
            column["values"].append(None if math.isnan(value) else value)

    while (message := reader.recv_msg()) is not None:
        name = message.get_type()
        if name == "FMT":
            continue
        it = kinds[name]
        time = message.TimeUS / 1e6 if "TimeUS" in it["columns"] else message.TimeMS / 1e3
        columns = []
        for place, (key, letter) in enumerate(zip(it["columns"], it["letters"])):
            if key in ("TimeUS", "TimeMS") or LETTERS[letter].endswith("s"):
                continue
            label = UNITS.get(it["units"][place:place + 1], "")
            unit = OURS.get(label, label)
            multiplier = MULTIPLIERS.get(it["multipliers"][place:place + 1], 0)
            value = getattr(message, key)
            if letter == "a":
                columns += [(f"{key}[{index}]", unit, one * (multiplier or 1)) for index, one in enumerate(value)]
            else:
                columns.append((key, unit, float(value) * (1 if letter in OWN else multiplier or 1)))
        if name == "RCOU":
            columns += [(f"motor[{motor}]", "-", (getattr(message, f"C{output}") - low) / (high - low))
                        for motor, output in enumerate(outputs)]
        instance = it["columns"][1] if it["units"][1:2] == "#" else None
        if not instance:
            add(name, time, columns)
            continue
        number = getattr(message, instance)
        add(f"{name}[{number}]", time, columns)
        if name == "ESC" and number + 1 in outputs:
            add(f"motor[{outputs.index(number + 1)}]", time, columns)
    # Texts are no columns.
    return [table for table in tables.values() if table["columns"]]


def main():
    folder, seed, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    rows = cells = 0
    for index in range(count):
        path = folder / f"dataflash_{seed}_{index}.bin"
        log, parameters, outputs = write(random.Random(seed * 1_000 + index))
        path.write_bytes(log.bytes)
        found = read(path, log, parameters, outputs)
        rows += sum(len(it["time"]) for it in found)
        cells += sum(len(it["time"]) * len(it["columns"]) for it in found)
        path.with_name(path.name + ".json").write_text(json.dumps({"tables": found}, allow_nan=False))
    print(f"dataflash: {count} logs, {rows} rows, {cells} cells by pymavlink")


if __name__ == "__main__":
    main()
