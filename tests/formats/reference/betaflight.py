# requires: orangebox==0.4.0
"""Random Betaflight blackbox logs, and what orangebox reads in them.

    betaflight.py FOLDER SEED COUNT

The writer packs as the firmware's encoder does; units are by the firmware's documentation, computed here once more.
"""

import json
import logging
import math
import random
import struct
import sys
from pathlib import Path

from orangebox import Parser

logging.disable(logging.CRITICAL)

SIGNED, UNSIGNED, NEGATIVE14, TAG8_8, TAG2_3, TAG8_4, NOTHING = 0, 1, 3, 6, 7, 8, 9
ZERO, PREVIOUS, STRAIGHT, AVERAGE, MINTHROTTLE, MOTOR_0, INCREMENT, HOME, P1500, VBATREF, LAST_TIME, MINMOTOR = range(12)


def unsigned(number):
    packed = b""
    number &= 0xFFFFFFFF
    while number > 127:
        packed += bytes([number & 127 | 128])
        number >>= 7
    return packed + bytes([number])


def signed(number):
    return unsigned((number << 1) ^ (number >> 31))


def tag2_3(numbers):
    if all(-2 <= n < 2 for n in numbers):
        a, b, c = (n & 3 for n in numbers)
        return bytes([a << 4 | b << 2 | c])
    if all(-8 <= n < 8 for n in numbers):
        a, b, c = (n & 15 for n in numbers)
        return bytes([1 << 6 | a, b << 4 | c])
    if all(-32 <= n < 32 for n in numbers):
        a, b, c = (n & 63 for n in numbers)
        return bytes([2 << 6 | a, b, c])
    sizes, body = 0, b""
    for place, n in enumerate(numbers):
        size = next(size for size in (1, 2, 3, 4) if -(1 << 8 * size - 1) <= n < 1 << 8 * size - 1)
        sizes |= size - 1 << 2 * place
        body += (n & (1 << 8 * size) - 1).to_bytes(size, "little")
    return bytes([3 << 6 | sizes]) + body


def tag8_4(numbers):
    sizes, halves = 0, []
    for place, n in enumerate(numbers):
        size = 0 if n == 0 else 1 if -8 <= n < 8 else 2 if -128 <= n < 128 else 3
        sizes |= size << 2 * place
        count = (0, 1, 2, 4)[size]
        halves += [n >> 4 * (count - 1 - half) & 15 for half in range(count)]
    halves += [0] * (len(halves) % 2)
    return bytes([sizes]) + bytes(high << 4 | low for high, low in zip(halves[::2], halves[1::2]))


def tag8_8(numbers):
    if len(numbers) == 1:
        return signed(numbers[0])
    present = sum(1 << place for place, n in enumerate(numbers) if n)
    return bytes([present]) + b"".join(signed(n) for n in numbers if n)


class Field:
    def __init__(self, name, sign, intra, inter, low, high, step):
        self.name, self.sign, self.intra, self.inter = name, sign, intra, inter
        self.low, self.high, self.step = low, high, step


class Firmware:
    """What a firmware calls its fields, and writes of itself."""

    def __init__(self, rng):
        self.rng = rng
        self.kind = rng.choice(["dshot", "pulses", "inav", "old"])
        self.fine = self.kind == "dshot" and rng.random() < 0.3
        self.poles = rng.choice([12, 14, 22])
        self.lowest = {"dshot": rng.choice([48, 158]), "pulses": 1070, "inav": 1050, "old": 1150}[self.kind]
        self.volts = rng.randrange(1200, 1700)
        self.reference = self.volts if self.kind != "pulses" else self.volts // 10
        self.gravity = rng.choice([512, 2048])
        self.block = rng.choice([32, 64, 256])
        self.every = rng.choice(["1/1", "1/2", "1", "2", "2/3", "1/16"])

    def header(self):
        name, kind = {
            "dshot": ("Betaflight 4.5.1 (77d01ba3b) STM32H743", "Betaflight"),
            "pulses": ("Betaflight 3.5.7 (2be1b1c42) OMNIBUSF4", "Cleanflight"),
            "inav": ("INAV 7.1.0 (4e1e59eb) MATEKF405", "Cleanflight"),
            "old": ("c49bd40", "Cleanflight"),
        }[self.kind]
        lines = [
            ("Firmware type", kind), ("Firmware revision", name), ("Craft name", "bench"),
            ("I interval", self.block), ("P interval", self.every),
            ("gyro_scale" if self.kind != "old" else "gyro.scale", hex(struct.unpack("<I", struct.pack("<f", self.gyro()))[0])),
            ("acc_1G", self.gravity), ("vbatref", self.reference), ("vbat_scale" if self.kind != "old" else "vbatscale", 110),
            ("currentMeter", "12,400"), ("looptime", 500),
        ]
        if self.kind == "dshot":
            lines += [("motorOutput", f"{self.lowest},2047"), ("motor_poles", self.poles),
                      ("blackbox_high_resolution", int(self.fine))]
        elif self.kind == "pulses":
            lines += [("minthrottle", 1070), ("motorOutput", "1070,2000")]
        else:
            lines += [("minthrottle", self.lowest), ("maxthrottle", 2000)]
        return lines

    def gyro(self):
        return {"dshot": 1.0, "pulses": 1 / 16.4, "inav": 1.0, "old": 1e-9}[self.kind]

    def value(self, name, number):
        """In the unit of the second of what it returns."""
        stem = self.renamed(name).split("[")[0]
        fine = 10 if self.fine else 1
        if stem == "motor":
            return ((number - 48) / 1999 if self.kind == "dshot" else (number - 1000) / 1000), "-"
        if stem == "eRPM":
            return number * 100 / (self.poles / 2), "rpm"
        if stem in ("gyroADC", "gyroUnfilt", "gyroRaw"):
            scale = struct.unpack("<f", struct.pack("<f", self.gyro()))[0]
            return (math.degrees(number * scale * 1e6) if self.kind == "old" else number * scale / fine), "deg/s"
        if stem == "accSmooth":
            return number / self.gravity / fine, "g"
        if name in ("setpoint[0]", "setpoint[1]", "setpoint[2]"):
            return number / fine, "deg/s"
        if stem == "attitude":
            return number / 10, "deg"
        if stem in ("baroAlt", "BaroAlt"):
            return number, "cm"
        if stem == "vbatLatest":
            return {"dshot": number / 100, "pulses": number / 10, "inav": number / 100,
                    "old": number / 4095 * 3.3 * 11}[self.kind], "V"
        if stem == "amperageLatest":
            return ((number * 3300 / 4095 - 12) / 40 if self.kind == "old" else number / 100), "A"
        return number, None

    def renamed(self, name):
        return {"vbat": "vbatLatest", "amperage": "amperageLatest"}.get(name, name.replace("gyroData[", "gyroADC["))

    def fields(self):
        rng, fields = self.rng, []

        def block(name, count, sign, intra, inter, low, high, step):
            for index in range(count):
                fields.append(Field(f"{name}[{index}]" if count > 1 else name, sign, intra, inter, low, high, step))

        one = [(PREVIOUS, SIGNED), (AVERAGE, SIGNED), (STRAIGHT, SIGNED)]
        block("axisP", 3, 1, (ZERO, SIGNED), rng.choice(one), -900, 900, 60)
        block("axisI", 3, 1, (ZERO, SIGNED), (PREVIOUS, TAG2_3), -8_000_000, 8_000_000, rng.choice([1, 6, 25, 3000, 2_000_000]))
        if rng.random() < 0.7:
            block("axisD", 2, 1, (ZERO, SIGNED), rng.choice(one), -900, 900, 200)
        for name in ["rcCommand", "setpoint"][: rng.randrange(3)]:
            block(name, 4, 1, (ZERO, SIGNED), (PREVIOUS, TAG8_4), -20000, 20000, rng.choice([0, 5, 90, 9000]))
        inav = self.kind == "inav"
        block("vbat" if inav else "vbatLatest", 1, 0, (VBATREF, NEGATIVE14), (PREVIOUS, TAG8_8), self.reference - 300, self.reference + 9, 3)
        block("amperage" if inav else "amperageLatest", 1, 1, (ZERO, SIGNED), (PREVIOUS, TAG8_8), -20, 9000, 70)
        block("BaroAlt" if inav else "baroAlt", 1, 1, (ZERO, SIGNED), (PREVIOUS, TAG8_8), -900, 30000, rng.choice([0, 5]))
        block("rssi", 1, 0, (ZERO, UNSIGNED), (PREVIOUS, TAG8_8), 0, 1023, 9)
        block("gyroData" if self.kind == "old" else "gyroADC", 3, 1, (ZERO, SIGNED), (AVERAGE, SIGNED), -32768, 32767, 900)
        if rng.random() < 0.5:
            block("gyroRaw" if inav else "gyroUnfilt", 3, 1, (ZERO, SIGNED), (AVERAGE, SIGNED), -32768, 32767, 900)
        if rng.random() < 0.6:
            block("accSmooth", 3, 1, (ZERO, SIGNED), (AVERAGE, SIGNED), -32768, 32767, 500)
        if inav:
            block("attitude", 3, 1, (ZERO, SIGNED), (AVERAGE, SIGNED), -1800, 3600, 7)
        block("debug", rng.choice([4, 8]), 1, (ZERO, SIGNED), (AVERAGE, SIGNED), -32768, 32767, 20000)
        motors, top = rng.choice([2, 4, 8]), 2047 if self.kind == "dshot" else 2000
        for index in range(motors):
            first = (MINMOTOR if self.kind in ("dshot", "pulses") else MINTHROTTLE, UNSIGNED)
            # The reference reader takes a first motor below the lowest output for one of 4 billion.
            low = self.lowest if index == 0 else self.lowest - 40
            fields.append(Field(f"motor[{index}]", 0, first if index == 0 else (MOTOR_0, SIGNED), (AVERAGE, SIGNED), low, top, 150))
        if rng.random() < 0.5:
            block("servo", 8, 0, (P1500, TAG8_8), (PREVIOUS, TAG8_8), 900, 2100, rng.choice([0, 3]))
        if self.kind == "dshot":
            block("eRPM", motors, 0, (ZERO, UNSIGNED), (PREVIOUS, SIGNED), 0, 4000, 90)
        return fields


class Flight:
    """A flight under way."""

    def __init__(self, rng, firmware):
        self.rng, self.firmware, self.fields = rng, firmware, firmware.fields()
        self.bytes = self.header()
        self.numbers = [rng.randint(max(it.low, -1000), min(it.high, 1500)) if it.low < 1500 else it.low for it in self.fields]
        self.numbers = [min(max(n, it.low), it.high) for n, it in zip(self.numbers, self.fields)]
        self.history, self.time, self.flags = None, rng.randrange(1, 10**8), 0
        self.home, self.gps_times = None, []
        above, _, below = firmware.every.partition("/") if "/" in firmware.every else ("1", "", firmware.every)
        self.above, self.below = int(above), int(below)

    def header(self):
        line = lambda values: ",".join(str(value) for value in values)
        text = "H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\n"
        names = ["loopIteration", "time"] + [field.name for field in self.fields]
        signs = [0, 0] + [field.sign for field in self.fields]
        intra = [(ZERO, UNSIGNED), (ZERO, UNSIGNED)] + [field.intra for field in self.fields]
        inter = [(INCREMENT, NOTHING), (STRAIGHT, SIGNED)] + [field.inter for field in self.fields]
        text += f"H Field I name:{line(names)}\nH Field I signed:{line(signs)}\n"
        for kind, packing in (("I", intra), ("P", inter)):
            text += f"H Field {kind} predictor:{line(p for p, _ in packing)}\nH Field {kind} encoding:{line(e for _, e in packing)}\n"
        text += "H Field H name:GPS_home[0],GPS_home[1]\nH Field H signed:1,1\nH Field H predictor:0,0\nH Field H encoding:0,0\n"
        text += ("H Field G name:time,GPS_numSat,GPS_coord[0],GPS_coord[1],GPS_altitude\nH Field G signed:0,0,1,1,0\n"
                 "H Field G predictor:10,0,7,7,0\nH Field G encoding:1,1,0,0,1\n")
        text += ("H Field S name:flightModeFlags,stateFlags,failsafePhase,rxSignalReceived,rxFlightChannelsValid\n"
                 "H Field S signed:0,0,0,0,0\nH Field S predictor:0,0,0,0,0\nH Field S encoding:1,1,7,7,7\n")
        return (text + "".join(f"H {key}:{value}\n" for key, value in self.firmware.header())).encode()

    def pack(self, letter, turn):
        """A main frame of the numbers as they are."""
        self.bytes += letter
        now = [turn, self.time] + self.numbers
        if letter == b"I":
            self.bytes += unsigned(turn) + unsigned(self.time)
        else:
            self.bytes += signed(self.time - 2 * self.history[0][1] + self.history[1][1])
        motor = next(place for place, field in enumerate(self.fields) if field.name == "motor[0]")
        lowest = self.firmware.lowest
        left = []
        for place, field in enumerate(self.fields):
            predictor, encoding = field.intra if letter == b"I" else field.inter
            before, earlier = (self.history[0][place + 2], self.history[1][place + 2]) if letter == b"P" else (0, 0)
            predicted = {ZERO: 0, PREVIOUS: before, STRAIGHT: 2 * before - earlier, AVERAGE: int((before + earlier) / 2),
                         MINTHROTTLE: lowest, MINMOTOR: lowest, MOTOR_0: self.numbers[motor], P1500: 1500,
                         VBATREF: self.firmware.reference}[predictor]
            left.append((encoding, self.numbers[place] - predicted))
        while left:
            encoding = left[0][0]
            alike = next((place for place, it in enumerate(left) if it[0] != encoding), len(left))
            count = {TAG8_8: min(alike, 8), TAG2_3: 3, TAG8_4: 4}.get(encoding, 1)
            group, left = [number for _, number in left[:count]], left[count:]
            self.bytes += {SIGNED: lambda: signed(group[0]), UNSIGNED: lambda: unsigned(group[0]),
                           NEGATIVE14: lambda: unsigned(-group[0] & 0x3FFF), TAG8_8: lambda: tag8_8(group),
                           TAG2_3: lambda: tag2_3(group), TAG8_4: lambda: tag8_4(group)}[encoding]()
        self.history = (now, now) if letter == b"I" else (now, self.history[0])

    def slow(self):
        self.flags += self.rng.randrange(1, 2**20)
        self.bytes += b"S" + unsigned(self.flags) + unsigned(self.rng.randrange(32)) + tag2_3([self.rng.randrange(2) for _ in range(3)])

    def gps(self):
        if self.home is None or self.rng.random() < 0.1:
            self.home = [self.rng.randrange(-9 * 10**8, 9 * 10**8), self.rng.randrange(-9 * 10**8, 9 * 10**8)]
            self.bytes += b"H" + signed(self.home[0]) + signed(self.home[1])
        late = self.rng.randrange(300)
        self.gps_times.append(self.history[0][1] + late)
        self.bytes += b"G" + unsigned(late) + unsigned(len(self.gps_times)) + signed(self.rng.randrange(-9999, 9999)) \
            + signed(self.rng.randrange(-9999, 9999)) + unsigned(self.rng.randrange(9999))

    def event(self):
        self.bytes += b"E" + self.rng.choice([
            b"\x00" + unsigned(self.time), b"\x0f" + unsigned(3), b"\x1e" + unsigned(77) + unsigned(1),
            b"\x0d\x05" + signed(-7), b"\x0d\x85" + struct.pack("<f", 1.5),
        ])

    def fly(self, frames):
        turn, block = 0, self.firmware.block
        while frames > 0:
            self.time += 500 + self.rng.randrange(-3, 4)
            if turn > 0 and turn % block == 0 and self.rng.random() < 0.1:
                # Logging was switched off for a while.
                turn += 40_000 * block
                self.time += 12_000_000
                # Orangebox 0.4 does not read what this event holds, and would take its letters for frames.
                while set(unsigned(turn) + unsigned(self.time)) & set(b"IPGHSE"):
                    turn, self.time = turn + block, self.time + 500
                self.bytes += b"E\x0e" + unsigned(turn) + unsigned(self.time)
            logged = (turn % block + self.above - 1) % self.below < self.above
            if turn % block == 0 or logged:
                self.numbers = [min(max(n + self.rng.randint(-it.step, it.step), it.low), it.high)
                                for n, it in zip(self.numbers, self.fields)]
                if turn % block:
                    if self.rng.random() < 0.1:
                        self.slow()
                    if self.rng.random() < 0.05:
                        self.event()
                # The reference reader has no row for a position behind the last main frame.
                if self.history and self.rng.random() < 0.05:
                    self.gps()
                self.pack(b"P" if turn % block else b"I", turn)
                frames -= 1
            turn += 1
        self.bytes += b"E\xffEnd of log\0"


def tables(path, part, firmware, gps_times):
    """What the reference reader finds, in units."""
    parser = Parser.load(str(path), part)
    names = parser.field_names
    rows = [frame.data for frame in parser.frames()]
    main = [place for place, name in enumerate(names) if place < names.index("flightModeFlags")]
    slow = [place for place, name in enumerate(names) if name in (
        "flightModeFlags", "stateFlags", "failsafePhase", "rxSignalReceived", "rxFlightChannelsValid")]
    gps = [place for place, name in enumerate(names) if name.startswith("GPS_")]
    time = [row[names.index("time")] / 1e6 for row in rows]

    def column(place, rows):
        name = firmware.renamed(names[place])
        values = [firmware.value(names[place], row[place]) for row in rows]
        unit = firmware.value(names[place], 0)[1]
        return {"name": name, "unit": unit or "", "values": [float(value) for value, _ in values]}

    found = [{"name": "", "time": time, "columns": [column(place, rows) for place in main if names[place] != "time"]}]
    # It repeats the last slow frame and position in every row.
    for name, places in (("slow", slow), ("gps", gps)):
        changed = [index for index, row in enumerate(rows) if row[places[0]] != ""
                   and rows[index - 1][places[0]] != row[places[0]]]
        if changed:
            # Of a position it leaves the time out: the writer's own.
            times = [it / 1e6 for it in gps_times] if name == "gps" else [time[index - 1] for index in changed]
            found.append({"name": name, "time": times,
                          "columns": [column(place, [rows[index] for index in changed]) for place in places]})
    return found


def main():
    folder, seed, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    frames = cells = 0
    for index in range(count):
        rng = random.Random(seed * 1_000 + index)
        firmware = Firmware(rng)
        flights = [Flight(rng, firmware) for _ in range(rng.choice([1, 1, 2, 3]))]
        for flight in flights:
            flight.fly(rng.randrange(80, 160))
        part = rng.randrange(len(flights)) + 1
        path = folder / f"betaflight_{seed}_{index}.bbl"
        path.write_bytes(b"".join(flight.bytes for flight in flights))
        found = tables(path, part, firmware, flights[part - 1].gps_times)
        frames += sum(len(table["time"]) for table in found)
        cells += sum(len(table["time"]) * len(table["columns"]) for table in found)
        path.with_name(path.name + ".json").write_text(json.dumps({"part": part, "tables": found}).replace("NaN", "null"))
    print(f"betaflight: {count} logs, {frames} rows, {cells} cells by orangebox")


if __name__ == "__main__":
    main()
