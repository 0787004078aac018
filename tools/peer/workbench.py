"""The workbench over rows: times, page and memory, as a page meets them; Markdown on standard output.

workbench.py PROGRAM FOLDER ROWS...
"""
import http.client
import json
import re
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path
from urllib.parse import urlencode

from long_logs import recorded

program, folder, all_rows = sys.argv[1], Path(sys.argv[2]), [int(word) for word in sys.argv[3:]]
PIXELS = 1200
PATIENCE_S = 900
# Shares of the log that are looked at, from where: all of it, zoomed in step by step, then panned.
WINDOWS = [(0, 1), (0, 0.5), (0.25, 0.25), (0.3, 0.1), (0.31, 0.03), (0.4, 0.03), (0.6, 0.01), (0.9, 0.01), (0.2, 0.2), (0.8, 0.2)]
ROUNDS = 5
# How long a search has gone on when it is cancelled [s]: within its first fits, and in the middle of it.
SEARCHED_S = [0.2, 1, 3, 8]
# [-] The same, of how long it takes.
SHARES = [0.1 * tenth for tenth in range(1, 10)]


class Page:
    """What the page asks, over a connection that stays."""

    def __init__(self, log):
        self.began = time.perf_counter()
        self.server = subprocess.Popen([program, "workbench", "--no-open", log], stdout=subprocess.PIPE, text=True)
        address = self.server.stdout.readline().strip()
        host, self.place, token = re.fullmatch(r"http://([0-9.:]+)(/\w+)/\?token=(\w+)", address).groups()
        self.connection = http.client.HTTPConnection(host, timeout=PATIENCE_S)
        self.cookie = f"rotorbench_{host.split(':')[1]}={token}"

    def since(self):
        return time.perf_counter() - self.began

    def get(self, path, **query):
        self.connection.request("GET", self.place + path + ("?" + urlencode(query) if query else ""), headers={"Cookie": self.cookie})
        answer = self.connection.getresponse()
        text = answer.read()
        if answer.status != 200:
            sys.exit(f"{path}: {answer.status} {text[:200]}")
        return text

    def act(self, name, **fields):
        origin = f"http://{self.connection.host}:{self.connection.port}"
        self.connection.request("POST", self.place + "/api/act", json.dumps({"act": name, **fields}), {"Cookie": self.cookie, "Origin": origin})
        answer = self.connection.getresponse()
        text = answer.read()
        if answer.status != 200:
            sys.exit(f"{name}: {answer.status} {text[:200]}")

    def log(self):
        return json.loads(self.get("/api/desk"))["logs"][0]

    def wait(self, holds):
        while not holds(log := self.log()):
            if log["state"] == "failed" or self.since() > PATIENCE_S:
                sys.exit(f"{log['name']}: {log}")
            time.sleep(0.02)
        return log

    def memory_mb(self):
        status = Path(f"/proc/{self.server.pid}/status").read_text()
        return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) * 1.024 / 1000  # "kB" there are KiB

    def end(self):
        self.server.send_signal(signal.SIGINT)
        self.server.wait()


def bytes_of_page(page):
    """Every file that the page loads."""
    sizes, waiting = {}, ["/"]
    while waiting:
        path = waiting.pop()
        if path in sizes:
            continue
        text = page.get(path).decode()
        sizes[path] = len(text.encode())
        waiting += ["/" + name for name in re.findall(r'(?:src="|href="|from ")(?:\./)?(\w+\.\w+)"', text)]
    return len(sizes), sum(sizes.values())


def line(rows, what, measured, unit, most=None):
    promise = "" if most is None else f"{most} {unit}" + (", not reached" if float(measured) > most else "")
    print(f"| {rows:,} | {what} | {measured} {unit} | {promise} |", flush=True)


def looked_at(page, log, query):
    """[ms] of each answer, over all windows."""
    start, end = log["ends_s"]
    taken = []
    for _ in range(ROUNDS):
        for begin, width in WINDOWS:
            shown = {"from": start + begin * (end - start), "to": start + (begin + width) * (end - start)}
            before = time.perf_counter()
            page.get("/api/plot", log=log["id"], pixels=PIXELS, **shown, **query)
            taken.append(1e3 * (time.perf_counter() - before))
    return taken


def searching(page):
    return json.loads(page.get("/api/desk"))["tick"]["search"]["state"] == "running"


def searched(page, name, **fields):
    """[s] that a search takes."""
    before = time.perf_counter()
    page.act(name, **fields)
    while searching(page):
        time.sleep(0.05)
    return time.perf_counter() - before


def cancelled(page, moments, name, **fields):
    """[s] from the wish to end a search until it has ended, slowest of several moments [s] of it."""
    taken = []
    for after in moments:
        page.act(name, **fields)
        began = time.perf_counter()
        # The server lets go of a connection on which nobody asks.
        while time.perf_counter() - began < after and searching(page):
            time.sleep(min(0.05, after))
        before = time.perf_counter()
        page.act("cancel")
        while searching(page):
            time.sleep(0.005)
        taken.append(time.perf_counter() - before)
    return max(taken)


def table(rows):
    page = Page(recorded(program, folder, rows, 1))
    count, size = bytes_of_page(page)
    log = page.wait(lambda log: log["state"] == "open")
    channel = log["channels"][1]["name"]
    page.get("/api/plot", log=log["id"], pixels=PIXELS, channel=channel)
    most = 1 if rows <= 12_000 else 8
    line(rows, "start to the first plot", f"{page.since():.2f}", "s", most)
    log = page.wait(lambda log: "compared" in log)
    if "why" in log["compared"]:
        sys.exit(log["compared"]["why"])
    line(rows, "start to the model beside it, compared", f"{page.since():.2f}", "s")
    block = next(it for it in log["compared"]["blocks"] if it["name"] == "body")
    for what, query in [("a channel", {"channel": channel}), ("measured, modelled, error", {"block": "body", "signal": block["signal"]})]:
        taken = looked_at(page, log, query)
        line(rows, f"pan or zoom, {what}: median", f"{statistics.median(taken):.1f}", "ms", 50)
        line(rows, f"pan or zoom, {what}: slowest", f"{max(taken):.1f}", "ms", 50)
    line(rows, f"page, {count} files", f"{size / 1000:.0f}", "kB", 400)
    line(rows, "memory of the server, greatest, until a model is compared", f"{page.memory_mb():.0f}", "MB", 1000)
    line(rows, "*What is missing?* cancelled: until it has ended, slowest", f"{cancelled(page, SEARCHED_S, 'diagnose'):.2f}", "s", 1)
    model = json.loads(page.get("/api/desk"))["chosen"]
    added = {"effects": ["gravity_pendulum"]}
    takes = searched(page, "add", **added)
    page.wait(lambda log: log.get("is_compared") and len(log["compared"]["models"]) == 2)
    line(rows, "memory, greatest, an effect added and both models compared", f"{page.memory_mb():.0f}", "MB")
    page.act("choose", model=model)
    moments = [share * takes for share in SHARES]
    line(rows, "*Add* cancelled, at a tenth of it, two tenths, ...: slowest", f"{cancelled(page, moments, 'add', **added):.2f}", "s", 1)
    takes = searched(page, "identify")
    page.act("choose", model=model)
    moments = [share * takes for share in SHARES]
    line(rows, "*identify* cancelled, at the same shares: slowest", f"{cancelled(page, moments, 'identify'):.2f}", "s", 1)
    page.end()


print("| rows | what | measured | at most |")
print("|---|---|---|---|")
for rows in all_rows:
    print(f"tools/workbench: {rows} rows", file=sys.stderr)
    table(rows)
