// The running bench, over the last minute. It is looked at; nothing here can speak to it.

import { get } from "./act.js";
import { Chart } from "./charts.js";
import { button, element, fill, number, table } from "./dom.js";

const PERIOD_MS = 250;
const PLOTS = [["Body rate", /^body_rate/], ["Body angle", /^body_angle/], ["Rotor rates", /^propeller_rate/], ["Left for the rotors", /^applied/], ["Disturbance torque", /^disturbance/], ["Battery", /^battery_voltage/]];
// Of sensors that few benches have: drawn where one of them has a value.
const RARE = [["Thrusts", /^thrust/], ["Currents", /^current/], ["Temperatures", /temperature/]];

let host = null;
let timer = null;
let since = 0;
let moments = [];
let charts = [];
let made = "";
let head = null;
let foot = null;

// Which columns are drawn together: by the names of the plots, and of any other that has a value by its unit.
function plotsOf(columns) {
  const every = columns.map((it, index) => ({ ...it, index }));
  const isKnown = ({ index }) => moments.some(([, values]) => values[index] !== null);
  const of = plots => plots.map(([title, pattern]) => [title, every.filter(it => pattern.test(it.name))]);
  const rare = of(RARE).map(([title, own]) => [title, own.filter(isKnown)]);
  const rest = every.filter(it => ![...PLOTS, ...RARE].some(([, pattern]) => pattern.test(it.name)) && isKnown(it));
  const others = [...new Set(rest.map(it => it.unit))].map(unit => [`Others [${unit}]`, rest.filter(it => it.unit === unit)]);
  return [...of(PLOTS), ...rare, ...others].filter(([, own]) => own.length);
}

function plot([title, own]) {
  const root = element("figure", { "aria-label": title }, element("h3", {}, title));
  const place = element("div", { class: "chart" });
  root.append(place);
  const chart = new Chart({ host: place, height: 130, name: "", title, unit: own[0].unit, onWindow: () => {}, onAll: () => {} });
  return { own, root, chart };
}

// Where other columns have values than before, the plots are others.
function makePlots(columns) {
  const plots = plotsOf(columns);
  const names = JSON.stringify(plots.map(([title, own]) => [title, own.map(it => it.name)]));
  if (names === made) return;
  made = names;
  charts.forEach(({ chart }) => chart.destroy());
  charts = plots.map(plot);
  fill(host,
    element("h2", {}, "The running bench"),
    element("p", { class: "soft" }, "The last minute. The page only listens: nothing on it can command, arm or stop."),
    state, head, element("div", { class: "live" }, charts.map(it => it.root)), foot);
}

// How the bench is: a live region, read out when it changes and not with every look.
const state = element("p", { id: "live-state", role: "status", "aria-live": "polite" });
function tell(words, kind, code) {
  if (state.textContent !== words) state.textContent = words;
  state.className = kind;
  if (code) state.dataset.state = code;
  else delete state.dataset.state;
}

function said(answer) {
  const { now } = answer;
  if (answer.why) return tell(answer.why, "bad");
  if (!now?.is_running) return tell(`No process of bench ${answer.bench} gives a sign of life: start it, and it shows here.`, "soft");
  tell(`Bench ${answer.bench}: ${now.state}`, "verdict", now.state);
  return table(["process", "per second", "late [µs]", "answered in [µs]", "skipped", "overruns"], now.processes.map(it => [it.role, number(it.rate_hz, 3), number(it.lateness_us, 3), number(it.response_us, 3), String(it.skipped), String(it.overruns)]));
}

// Of a curve's values, as the server says it of those of a log.
function rangeOf(y) {
  const known = y.filter(it => it !== null && isFinite(it));
  const mean = of => known.reduce((sum, it) => sum + of(it), 0) / known.length;
  return { samples: known.length, mean: mean(it => it), rms: Math.sqrt(mean(it => it * it)), least: Math.min(...known), greatest: Math.max(...known) };
}

// Where nothing is known: no curve leads across it.
const unknown = y => y.flatMap((value, slot) => (value === null ? [slot] : []));

async function look() {
  try {
    const answer = await get("api/live", { since });
    // A server that has begun anew counts from the beginning.
    if (answer.count < since) moments = [];
    since = answer.count;
    moments.push(...answer.moments);
    const end = moments.at(-1)?.[0] ?? 0;
    moments = moments.filter(([at]) => end - at <= answer.kept_s);
    makePlots(answer.columns);
    fill(head, said(answer));
    fill(foot, answer.events.length && [element("h3", {}, "The guard, newest first"), element("ul", {}, answer.events.map(it => element("li", {}, it)))]);
    const x = moments.map(([at]) => at - end);
    for (const { own, chart } of charts) {
      const curves = own.map((it, index) => {
        const y = moments.map(([, values]) => values[it.index]);
        return { label: it.name, tone: "next-" + (index % 8), y, gaps: unknown(y), range: rangeOf(y) };
      });
      if (x.length > 1) chart.draw({ x, curves, bands: [], levels: [], from: -answer.kept_s, to: 0 });
    }
  } catch {
    tell("The server does not answer.", "bad");
  }
  if (!host.hidden) timer = setTimeout(look, PERIOD_MS);
}

export function build(at) {
  host = at("live");
  head = element("div", {});
  foot = element("div", {});
  const toggle = button("Live", () => {
    const live = host.hidden;
    host.hidden = !live;
    document.querySelector("main").hidden = live;
    toggle.setAttribute("aria-pressed", String(live));
    clearTimeout(timer);
    if (live) look();
    // What was drawn while hidden had no width.
    dispatchEvent(new Event("resize"));
  }, { "aria-pressed": "false", title: "the running bench" });
  addEventListener("resize", () => charts.forEach(({ chart }) => chart.resize()));
  at("save").before(toggle);
}
