"""Frames through python-can and cantools: nanoseconds for each, as JSON."""
import json
import random
import sys
import time

import can
import cantools

database = cantools.database.load_file(sys.argv[1])
generator = random.Random(2)
FRAMES, BATCHES = 512, 21
status = [
    can.Message(arbitration_id=65, is_extended_id=False, data=generator.randbytes(8)) for _ in range(FRAMES)
]
commands = [
    {"counter": k & 255, "state": 2, "rotor_1": generator.uniform(0.3, 0.6), "rotor_2": generator.uniform(0.3, 0.6)}
    for k in range(FRAMES)
]


def decode():
    for message in status:
        database.decode_message(message.arbitration_id, message.data)


def encode():
    for values in commands:
        can.Message(arbitration_id=16, is_extended_id=False, data=database.encode_message(16, values))


def nanoseconds(work):
    times = []
    for _ in range(BATCHES):
        start = time.perf_counter_ns()
        work()
        times.append((time.perf_counter_ns() - start) / FRAMES)
    return sorted(times)[BATCHES // 2]


print(json.dumps({"decode_ns": nanoseconds(decode), "encode_ns": nanoseconds(encode)}))
