// "What is missing?": the search, its progress, its answer, and what may be added.

import { act, desk, ofChosen, onDesk } from "./act.js";
import { card } from "./card.js";
import { button, command, count, element, fill, lastPart, number, precise, table } from "./dom.js";
import { progressOf } from "./progress.js";

const SHOWN = 6;
const [head, body] = [element("div"), element("div")];
const progress = progressOf(["identify", "diagnose", "extend", "try", "recalibrate"]);

const isSearching = () => desk.tick.search?.state === "running";

// A button that does nothing while a search runs, and keeps the focus: one that is disabled loses it.
export const idle = (text, act, properties) => button(text, () => isSearching() || act(), { ...properties, "aria-disabled": isSearching() && "true" });

export function add(effects, text) {
  return idle(text || `Add ${effects.join(" + ")}`, () => act("add", { effects }), { class: "primary", "data-add": effects.join("+") });
}

// The model that a bench of one's own begins with.
export const identify = properties => idle("Identify this bench", () => act("identify"), {
  title: "make a model of this bench from the logs that are fitted on", ...properties, disabled: !ready() });

// The channel whose error the answer's effects bring down, without unit and rotor; none where nothing is named.
export const named = () => (desk?.answered?.is_current && desk.answered.fall?.channel.split(" ")[0].replace(/_\d+(?=_|$)/, "")) || null;

// Block by block, since errors of different channels are not to be compared: that of the named effects first, what is named on top.
function ranked(answer) {
  const tried = answer.candidates.filter(it => it.validate !== null);
  const isNamed = it => answer.effects.includes(it.effect);
  const channels = [...new Set([...tried.filter(isNamed), ...tried].map(it => it.channel))];
  return channels.map(channel => [channel, tried.filter(it => it.channel === channel)
    .sort((a, b) => isNamed(b) - isNamed(a) || a.validate - b.validate)]);
}

function candidates(answer) {
  const row = it => [
    card(answer.cards[it.effect], it.effect),
    precise(it.validate, 4),
    it.chance === null ? "–" : number(it.chance, 2),
    element("span", {}, idle("try", () => act("try", { effects: [it.effect] }), { "aria-label": "try " + it.effect, title: "fit it and draw it, without adding it" }),
      idle("add", () => act("add", { effects: [it.effect] }), { "aria-label": "add " + it.effect })),
  ];
  const heading = ["effect alone", "held-out error", "by chance", ""];
  const [refused, unnamed] = [it => it.why, it => it.not_named].map(why => answer.candidates.filter(why));
  return [
    element("h3", {}, "Candidates"), ranked(answer).map(([channel, tried]) => [
      element("p", { class: "soft" }, channel), table(heading, tried.slice(0, SHOWN).map(row), { class: "candidates" }),
      tried.length > SHOWN && element("details", { "data-key": "more candidates " + channel }, element("summary", {}, `${tried.length - SHOWN} more`),
        table(heading, tried.slice(SHOWN).map(row), { class: "candidates" }))]),
    unnamed.length && element("details", { "data-key": "not named" }, element("summary", {}, `${unnamed.length} tried and not named, and why`),
      element("ul", {}, unnamed.map(it => element("li", {}, element("b", {}, it.effect), ": " + it.not_named)))),
    refused.length && element("details", { "data-key": "refused" }, element("summary", {}, `${refused.length} not tried or refused, and why`),
      element("ul", {}, refused.map(it => element("li", {}, element("b", {}, it.effect), ": " + it.why)))),
  ];
}

// How far the error falls.
export function errors(error, unit) {
  const rows = [["as it is", error.base], ["its own numbers refitted", error.recalibrated], ["extended", error.extended]];
  return [element("p", { class: "soft" }, error.measure), table(["model", `fitted on [${unit}]`, `held out [${unit}]`], [
    ...rows.map(([name, it]) => [name, precise(it.train, 4), precise(it.validate, 4)]),
    ["noise floor", "", precise(error.noise_floor, 4)]])];
}

// Of another model or other logs: it is kept, and not in the way of what is.
export function now(answer, key, whole) {
  if (answer.is_current) return whole;
  return element("details", { "data-key": key }, element("summary", {}, `what was found of ${answer.model || "a model that is gone"} before`), whole);
}

// What the named effects do to the held-out error, in figures: without them the better of the model as it is and refitted.
function fall({ channel, before, after, floor, explained }, { base }) {
  const which = before < base.validate ? "its own numbers refitted" : "as it is";
  return element("p", { id: "fall" }, `Held-out error of ${channel}: `, precise(before, 4, { "data-is": "before" }), ` (${which}) → `, precise(after, 4, { "data-is": "after" }),
    ", noise floor ", precise(floor, 3), "; ", precise(100 * explained, 3, { "data-is": "explained" }), " % of the squared error above the noise is explained.");
}

// A step in words, its command beneath; a session may hold one that is words alone.
function step(it) {
  const { words, command: typed } = it.words === undefined ? { words: it } : it;
  return element("li", {}, words.replaceAll("`", ""), typed && command(typed));
}

function answered(answer) {
  const set = effects => element("div", { class: "row" }, add(effects),
    effects.length > 1 && idle("try", () => act("try", { effects }), { "aria-label": "try " + effects.join(" + "), title: "fit them and draw it, without adding them" }));
  const whole = [
    element("p", { class: "verdict " + answer.verdict, id: "verdict", "data-verdict": answer.verdict }, answer.sentence),
    answer.fall && fall(answer.fall, answer.error),
    answer.is_of_other_bench && answer.is_current && identify({ class: "primary" }),
    answer.effects.length && answer.is_current ? set(answer.effects) : null,
    answer.verdict === "parameters_changed" && answer.is_current && idle("Take the new numbers over", () => act("recalibrate"), { class: "primary" }),
    answer.alternatives.length > 0 && element("div", {}, element("p", {}, "These data cannot tell it from:"), answer.alternatives.map(set), answer.common && element("p", {}, answer.common)),
    errors(answer.error, answer.unit), candidates(answer),
    answer.findings.length > 0 && element("details", { "data-key": "answer findings" }, element("summary", {}, count(answer.findings.length, "finding")), element("ul", {}, answer.findings.map(it => element("li", {}, it)))),
    element("h3", {}, "What to do next"), element("ul", { class: "next" }, answer.next.map(step)),
  ];
  return now(answer, "answer before", whole);
}

// Whether there is something to fit on, and all of it has been read.
export function ready() {
  const fitted = desk.logs.filter(it => it.role !== "look");
  return fitted.some(it => it.role === "fit") && fitted.every(it => it.state === "open");
}

// Whether the rotors of some log are further off the model than their rates vary.
function isFarOff() {
  const rotors = desk.logs.flatMap(it => it.compared?.blocks || []).filter(it => it.name.startsWith("actuator"));
  return rotors.map(it => ofChosen(it.errors)).some(it => it?.model === desk.chosen && it.fit_percent < 0 && !it.is_noise);
}

const names = role => desk.logs.filter(it => it.role === role).map(it => lastPart(it.name)).join(", ");

// Why nothing can be asked yet.
function why() {
  const fitted = desk.logs.filter(it => it.role !== "look");
  const of = state => fitted.filter(it => it.state === state).map(it => lastPart(it.name)).join(", ");
  const bad = text => element("p", { class: "bad" }, text);
  if (of("guessed")) return bad("Confirm first what the columns of the logs mean.");
  if (of("failed")) return bad(`${of("failed")} could not be read: choose "look" for it, or close it.`);
  if (of("parts")) return bad(`${of("parts")} holds several logs: open one of them, or close it.`);
  if (of("opening")) return element("p", { class: "soft" }, `${of("opening")} is being read.`);
  return !fitted.some(it => it.role === "fit") && element("p", { class: "soft" }, 'Choose "fit" for at least one log.');
}

function draw() {
  const model = desk.models.find(it => it.id === desk.chosen);
  const held = names("held_out");
  fill(head, element("h2", {}, "What is missing?"),
    element("p", { class: "soft" }, `Model ${model?.name}, fitted on ${names("fit") || "no log"}${held ? ", held out " + held : ""}.`),
    isFarOff() && ready() && element("p", { class: "bad" }, "The rotors are further off this model than their rates vary. If it is another bench's, begin with ", identify()),
    idle("What is missing?", () => act("diagnose"), { class: "primary", disabled: !ready(), id: "ask-button" }),
    why());
  fill(body, desk.answered && answered(desk.answered),
    desk.by_hand.diagnose && element("details", { "data-key": "ask by hand" }, element("summary", {}, "the same by hand"), command(desk.by_hand.diagnose)));
}

export function build(at) {
  // The progress stays where it is: a press of its button is not lost when the desk changes.
  at("ask").append(head, ...progress, body);
  onDesk(draw);
}
