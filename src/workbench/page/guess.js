// What the columns of a foreign log mean: the guess, mended by hand, and nothing read before it is confirmed.

import { act, save } from "./act.js";
import { button, element, lastPart, number, table } from "./dom.js";

const LEFT_OUT = "-";
const ELECTRICAL = "erpm/";
const COMMANDS = { "-": "0 to 1", "%": "percent", us: "pulses in µs", ms: "pulses in ms", dshot: "DShot, 48 to 2047", "8bit": "8 bits, 0 to 255" };

function select(label, options, chosen, choose) {
  return element("select", { "aria-label": label, "data-key": label, onchange: event => choose(event.target.value) },
    options.map(([value, text]) => element("option", { value, selected: value === chosen }, text)));
}

function row(log, guess, it) {
  const mend = (signal, unit) => act("mend", { log: log.id, column: it.column, signal, unit });
  const known = guess.signals.includes(it.signal);
  const signals = [...guess.signals.map(name => [name, name]), [it.own, `carried along: ${it.own}`], [LEFT_OUT, "left out"]];
  const chosen = it.is_read ? (known ? it.signal : it.own) : LEFT_OUT;
  const electrical = unit => `eRPM, ${unit.slice(ELECTRICAL.length)} pole pairs`;
  const name = unit => (it.signal.startsWith("command_") ? COMMANDS[unit] : unit.startsWith(ELECTRICAL) ? electrical(unit) : unit);
  return [
    element("b", {}, it.column),
    select("what " + it.column + " becomes", signals, chosen, signal => mend(signal)),
    it.is_read && it.units.length ? select("unit of " + it.column, it.units.map(unit => [unit, name(unit)]), it.unit, unit => mend(it.signal, unit)) : "",
    element("span", { class: it.certainty === "named" || it.certainty === "said" ? "soft" : "unsure" }, it.how_sure),
    element("span", { class: "soft" }, it.samples.map(value => number(value, 5)).join(", ")),
  ];
}

// The panel of a log whose columns are to be confirmed.
export function columns(log) {
  const { guess } = log;
  const like = [guess.shipped, ...guess.like].filter(Boolean);
  return [
    element("h2", {}, `What do the columns of ${lastPart(log.name)} mean?`),
    element("p", { class: "soft" }, "A guess from names, units and values. Nothing is read or fitted on it: look at each line, above all at the units, mend what is wrong, and confirm it."),
    like.length > 0 && element("p", {}, "These columns are known already: ", like.map(name => button(`Read it by ${name}`, () => act("confirm", { log: log.id, like: name }), { class: "primary" }))),
    table(["column", "becomes", "in", "how sure", "first values"], guess.columns.map(it => row(log, guess, it)), { class: "columns" }),
    !guess.has_time && element("p", { class: "bad" }, "No column is the time yet: choose time_s for one."),
    element("div", { class: "row confirm" },
      button("Confirm, and read it", () => act("confirm", { log: log.id }), { class: like.length ? null : "primary", disabled: !guess.has_time, id: "confirm" }),
      button("save the mapping", () => save({ what: "mapping", id: log.id }), { class: "quiet" })),
  ];
}
