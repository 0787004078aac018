// "Look for the law itself": where no effect of the catalogue explains what is missing, what does.

import { act, desk, onDesk } from "./act.js";
import { add, errors, idle, now, ready } from "./ask.js";
import { drawing } from "./details.js";
import { command, count, element, fill, number, precise, table } from "./dom.js";
import { progressOf } from "./progress.js";

const progress = progressOf(["discover"]);
const PLACES = 5;

function formula(found, is_law) {
  if (!found.expression) return null;
  const rows = Object.entries(found.parameters).map(([name, it]) => [
    name, precise(it.value, 5), it.standard_error === null ? "" : "± " + number(it.standard_error, 2), it.unit]);
  return [element("p", { class: "formula", id: "law-formula" }, (is_law ? "+ " : "nearest: + ") + found.expression),
    table(["number", "value", "error", "unit"], rows)];
}

// About its mean: a constant is the base's own numbers' to take up.
function centred(values) {
  const known = values.filter(it => isFinite(it));
  const mean = known.reduce((sum, it) => sum + it, 0) / (known.length || 1);
  return values.map(it => it - mean);
}

// What looks at which way its channel went has two curves.
function byDirection(shape) {
  const way = direction => shape.points.filter(it => it.direction === direction).map(it => [it.at[0], it.value]);
  return [drawing(`What is added [${shape.unit}] over ${shape.channels[0]}, and which way it went`, [
    { tone: "measured", points: way("rising") }, { tone: "model", points: way("falling") }]),
  element("p", { class: "soft" }, element("span", { class: "key measured" }, "on the way up"), " ", element("span", { class: "key model" }, "on the way down"))];
}

// Of two channels along the first, at the middle of the second.
function shape(found) {
  const { shape } = found;
  if (!shape) return null;
  if (shape.by_direction) return byDirection(shape);
  const second = shape.points[Math.floor(shape.points.length / 2)].at[1];
  const shown = shape.points.filter(it => it.at[1] === second);
  const value = centred(shown.map(it => it.value));
  const wide = shown.map(it => (it.standard_error === null ? NaN : 2 * it.standard_error));
  const law = centred(shown.map(it => (it.formula === null ? NaN : it.formula)));
  const curve = (tone, values) => ({ tone, points: shown.map((it, index) => [it.at[0], values[index]]) });
  const title = `What is added [${shape.unit}] over ${shape.channels[0]}` + (second === undefined ? "" : `, at ${shape.channels[1]} ${number(second, 3)}`);
  const has_band = wide.some(it => isFinite(it));
  return [drawing(title, [curve("edge", value.map((it, index) => it - wide[index])), curve("edge", value.map((it, index) => it + wide[index])),
    curve("measured", value), curve("model", law)]),
    element("p", { class: "soft" }, element("span", { class: "key measured" }, has_band ? "smooth function with its 95 % band" : "smooth function, which does not explain all: without a band"), " ",
      law.some(it => isFinite(it)) && element("span", { class: "key model" }, "formula"))];
}

function places(found) {
  if (!found.where.length) return null;
  return element("details", { "data-key": "law places" }, element("summary", {}, "where it may act"),
    table(["smooth function of", "acts on", "explains"], found.where.slice(0, PLACES).map(it => [it.channels.join(", ") + (it.by_direction ? " and its direction" : ""), it.site.replaceAll("_", " "), number(100 * it.explained, 3) + " %"])));
}

function answered(answer) {
  const { found, verdict } = answer;
  if (!found) return element("p", { class: "bad" }, answer.why);
  const is_law = verdict === "law";
  const whole = [
    element("p", { class: "verdict " + verdict, id: "law-verdict", "data-verdict": verdict }, answer.sentence),
    formula(found, is_law),
    is_law && answer.is_current && element("div", { class: "row" }, idle("Add the law", () => act("add_law"), { class: "primary" }),
      idle("try", () => act("try_law"), { "aria-label": "try the law", title: "draw it, without adding it" })),
    verdict === "catalogue" && answer.is_current && add(found.effects),
    verdict === "parameters_changed" && answer.is_current && idle("Take the new numbers over", () => act("recalibrate"), { class: "primary" }),
    shape(found), element("ul", { class: "beneath" }, answer.beneath.map(it => element("li", {}, it))),
    errors(found.error, answer.unit), places(found),
    found.warnings.length > 0 && element("details", { "data-key": "law findings" }, element("summary", {}, count(found.warnings.length, "finding")), element("ul", {}, found.warnings.map(it => element("li", {}, it)))),
    element("details", { "data-key": "law by hand" }, element("summary", {}, "the same by hand"), command(answer.by_hand)),
  ];
  return now(answer, "law before", whole);
}

export function build(at) {
  const [head, body] = [element("div"), element("div")];
  at("law").append(head, ...progress, body);
  onDesk(() => {
    // Behind the catalogue's answer: what that explains is not looked for.
    at("law").hidden = !desk.answered && !desk.discovered && desk.tick.search?.kind !== "discover";
    const open = desk.answered?.is_current && desk.answered.verdict === "unknown" && !desk.discovered?.is_current;
    fill(head, element("h2", {}, "The law itself"),
      element("p", { class: "soft" }, "Where no effect of the catalogue explains what is missing: where it acts, its shape, and a formula."),
      idle("Look for the law itself", () => act("discover"), { disabled: !ready(), class: open ? "primary" : null }));
    fill(body, desk.discovered && answered(desk.discovered),
      !desk.discovered && desk.by_hand.discover && element("details", { "data-key": "law to be by hand" }, element("summary", {}, "the same by hand"), command(desk.by_hand.discover)));
  });
}
