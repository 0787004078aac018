# requires: numpy pandas pyarrow
"""Random Parquet files, and what pyarrow reads in them.

    parquet.py FOLDER SEED COUNT
"""

import json
import math
import random
import sys
from datetime import date, time
from decimal import Decimal
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

INTEGERS = [pa.int8(), pa.int16(), pa.int32(), pa.int64(), pa.uint8(), pa.uint16(), pa.uint32(), pa.uint64()]
PER_SECOND = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}


def integers(rng, kind, count):
    bits, signed = kind.bit_width, pa.types.is_signed_integer(kind)
    low, high = (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if signed else (0, (1 << bits) - 1)
    style = rng.random()
    if style < 0.3:
        return [rng.randrange(low, high + 1) for _ in range(count)]
    if style < 0.6:
        # A counter with small steps.
        return [min(high, 3 * row + rng.randrange(3)) for row in range(count)]
    few = [rng.randrange(low, high + 1) for _ in range(rng.randrange(1, 6))]
    return [rng.choice(few) for _ in range(count)]


def floats(rng, count):
    style = rng.random()
    if style < 0.4:
        return [rng.choice([rng.gauss(0, 1), rng.gauss(0, 1e9), math.nan, math.inf, -0.0]) for _ in range(count)]
    if style < 0.7:
        return [round(math.sin(row / 50), 2) for row in range(count)]
    return [rng.choice([1.5, -2.25])] * count


def column(rng, count):
    """A type, and values of it."""
    choice = rng.randrange(11)
    if choice < 3:
        kind = rng.choice(INTEGERS)
        return kind, integers(rng, kind, count)
    if choice < 6:
        kind = rng.choice([pa.float32(), pa.float64(), pa.float64()])
        return kind, floats(rng, count)
    if choice == 6:
        return pa.float16(), [np.float16(max(-6e4, min(6e4, it))) for it in floats(rng, count)]
    if choice == 7:
        return pa.bool_(), [rng.random() < 0.3 for _ in range(count)]
    if choice == 8:
        unit = rng.choice(list(PER_SECOND))
        start = 1_700_000_000 * PER_SECOND[unit]
        return pa.timestamp(unit, rng.choice([None, "UTC"])), [start + row * PER_SECOND[unit] // 1000 for row in range(count)]
    if choice == 9:
        kind = rng.choice([pa.date32(), pa.time32("ms"), pa.time64("us"), pa.duration("us")])
        if pa.types.is_date(kind):
            return kind, [date(2024, 1, 1 + row % 28) for row in range(count)]
        if pa.types.is_time(kind):
            return kind, [time(row % 24, row % 60, 5, 250_000) for row in range(count)]
        return kind, list(range(count))
    precision = rng.choice([5, 12, 25])
    return pa.decimal128(precision, 3), [Decimal(rng.randrange(-99_999, 99_999)).scaleb(-3) for _ in range(count)]


def table(rng):
    count = rng.choice([1, 7, 100, 1000])
    names, arrays = [], []
    if rng.random() < 0.5:
        names.append("time_s")
        arrays.append(pa.array([row / 1000 for row in range(count)], pa.float64()))
    for index in range(rng.randrange(1, 8)):
        kind, values = column(rng, count)
        if rng.random() < 0.5:
            share = rng.choice([0.02, 0.5, 1.0])
            values = [None if rng.random() < share else it for it in values]
        names.append(f"column_{index}")
        arrays.append(pa.array(values, kind))
    if rng.random() < 0.3:
        names.append("text")
        arrays.append(pa.array([rng.choice(["hover", "climb"]) for _ in range(count)]))
    if rng.random() < 0.3:
        names.append("list")
        arrays.append(pa.array([[1.0, 2.0]] * count))
    if rng.random() < 0.3:
        names.append("motor")
        values = [rng.choice([None, {"rate": 1.5 * row, "on": True}, {"rate": None, "on": False}]) for row in range(count)]
        arrays.append(pa.array(values, pa.struct([("rate", pa.float64()), ("on", pa.bool_())])))
    return pa.table(arrays, names=names)


def write(rng, path):
    data = table(rng)
    if rng.random() < 0.15:
        data.to_pandas().to_parquet(path)
        return
    options = {"use_dictionary": rng.random() < 0.5}
    if not options["use_dictionary"] and rng.random() < 0.7:
        encodings = {}
        for field in data.schema:
            if field.type in (pa.int32(), pa.int64(), pa.uint32(), pa.uint64()) or pa.types.is_timestamp(field.type):
                encodings[field.name] = rng.choice(["PLAIN", "DELTA_BINARY_PACKED", "BYTE_STREAM_SPLIT"])
            elif field.type in (pa.float16(), pa.float32(), pa.float64()):
                encodings[field.name] = rng.choice(["PLAIN", "BYTE_STREAM_SPLIT"])
            elif pa.types.is_boolean(field.type):
                encodings[field.name] = rng.choice(["PLAIN", "RLE"])
        options["column_encoding"] = encodings
    if rng.random() < 0.2 and "column_encoding" not in options:
        options["use_deprecated_int96_timestamps"] = True
    pq.write_table(
        data, path,
        compression=rng.choice(["none", "snappy", "snappy", "gzip", "zstd", "zstd", "lz4"]),
        data_page_version=rng.choice(["1.0", "2.0"]),
        version=rng.choice(["1.0", "2.4", "2.6"]),
        row_group_size=rng.choice([None, 50, 333]),
        data_page_size=rng.choice([None, 64, 1000]),
        write_page_checksum=rng.random() < 0.3,
        store_decimal_as_integer=rng.random() < 0.5,
        **options,
    )


def numbers(array, kind):
    """Values as our reader should give them, and whether they are a stamp; `None` for what is no number."""
    per_second = None
    if pa.types.is_timestamp(kind) or pa.types.is_time(kind):
        per_second = PER_SECOND[kind.unit]
        array = array.cast(pa.int32() if pa.types.is_time32(kind) else pa.int64())
    elif pa.types.is_date(kind):
        array = array.cast(pa.int32())
    elif pa.types.is_duration(kind):
        array = array.cast(pa.int64())
    elif not (pa.types.is_null(kind) or pa.types.is_boolean(kind) or pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
        return None
    values = array.to_pylist()
    if per_second:
        return [math.nan if it is None else it / per_second for it in values], True
    return [math.nan if it is None else float(it) for it in values], False


def read(path):
    data = pq.read_table(path)
    columns, clock = [], None
    while any(pa.types.is_struct(field.type) for field in data.schema):
        data = data.flatten()
    for name, array in zip(data.column_names, data.columns):
        found = numbers(array, array.type)
        if found is None:
            continue
        values, is_stamp = found
        columns.append({"name": name, "unit": "s" if is_stamp else "", "values": values})
        if name == "time_s":
            clock = values
    plain = lambda values: [it if math.isfinite(it) else str(it) for it in values]
    for it in columns:
        it["values"] = plain(it["values"])
    return {"tables": [{"name": "", "time": plain(clock or []), "columns": columns}]}


def main():
    folder, seed, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    for index in range(count):
        path = folder / f"{seed + index}.parquet"
        write(random.Random(seed + index), path)
        path.with_suffix(".parquet.json").write_text(json.dumps(read(path), allow_nan=False))


if __name__ == "__main__":
    main()
