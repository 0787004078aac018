// "What is missing?": the search, its progress, its answer, and what may be added.

import { act, desk, onDesk, onTick } from "./act.js";
import { button, command, element, fill, lastPart, number, precise, table } from "./dom.js";

const SHOWN = 6;
let host = null;
let progress = null;

const QUESTS = { diagnose: "Searching for what is missing", extend: "Fitting the extended model", try: "Fitting it, to be looked at", recalibrate: "Refitting the model's own numbers" };

function state(search) {
  if (!search) return null;
  const seconds = search.seconds.toFixed(1) + " s";
  const leading = search.leading.length ? `, leading: ${search.leading.join(" + ")}` : "";
  const said = `${QUESTS[search.quest]}: ${search.fitted} fitted${leading}, ${seconds}`;
  switch (search.state) {
    case "running": return [
      element("progress", { "aria-label": "search" }), element("p", { id: "progress" }, said), button("Cancel", () => act("cancel"))];
    case "cancelled": return element("p", { id: "progress" }, `Cancelled after ${seconds}; nothing has changed.`);
    case "failed": return element("p", { id: "progress", class: "bad" }, search.why);
    default: return element("p", { id: "progress", class: "soft" }, `Done in ${seconds}.`);
  }
}

function tick(it) {
  if (!it || !progress) return;
  const made = state(it.search);
  // A button that is put anew between press and release is not pressed: while it runs only the words change.
  const words = it.search?.state === "running" && progress.querySelector("progress") && progress.querySelector("p");
  if (words) words.textContent = made[1].textContent;
  else fill(progress, made);
}

function card(it, id) {
  if (!it) return id;
  const more = [it.report?.join(" "), it.residual && "How it shows: " + it.residual, it.source && "Source: " + it.source, it.experiment && "Experiment: " + it.experiment];
  return element("details", { class: "card", "data-key": "card " + id, title: `${it.meaning}\n${it.equation}\n${it.report?.join(" ") || ""}` },
    element("summary", {}, id), element("p", {}, it.meaning), element("p", { class: "formula" }, it.equation), more.filter(Boolean).map(text => element("p", {}, text)));
}

function add(effects, text) {
  return button(text || `Add ${effects.join(" + ")}`, () => act("add", { effects }), { class: "primary", "data-add": effects.join("+") });
}

function candidates(answer) {
  const tried = answer.candidates.filter(it => it.validate !== null).sort((a, b) => a.validate - b.validate);
  const row = it => [
    card(answer.cards[it.effect], it.effect),
    precise(it.validate, 4),
    it.chance === null ? "–" : number(it.chance, 2),
    element("span", {}, button("try", () => act("try", { effects: [it.effect] }), { "aria-label": "try " + it.effect, title: "fit it and draw it, without adding it" }),
      button("add", () => act("add", { effects: [it.effect] }), { "aria-label": "add " + it.effect })),
  ];
  const heading = ["effect alone", "held-out error", "by chance", ""];
  const [refused, unnamed] = [it => it.why, it => it.not_named].map(why => answer.candidates.filter(why));
  return [
    element("h3", {}, "Candidates"), table(heading, tried.slice(0, SHOWN).map(row), { class: "candidates" }),
    tried.length > SHOWN && element("details", { "data-key": "more candidates" }, element("summary", {}, `${tried.length - SHOWN} more`), table(heading, tried.slice(SHOWN).map(row), { class: "candidates" })),
    unnamed.length && element("details", { "data-key": "not named" }, element("summary", {}, `${unnamed.length} tried and not named, and why`),
      element("ul", {}, unnamed.map(it => element("li", {}, element("b", {}, it.effect), ": " + it.not_named)))),
    refused.length && element("details", { "data-key": "refused" }, element("summary", {}, `${refused.length} not tried or refused, and why`),
      element("ul", {}, refused.map(it => element("li", {}, element("b", {}, it.effect), ": " + it.why)))),
  ];
}

function answered(answer) {
  const { error, unit } = answer;
  const rows = [["as it is", error.base], ["its own numbers refitted", error.recalibrated], ["extended", error.extended]];
  const errors = table(["model", `fitted on [${unit}]`, `held out [${unit}]`], [
    ...rows.map(([name, it]) => [name, precise(it.train, 4), precise(it.validate, 4)]),
    ["noise floor", "", precise(error.noise_floor, 4)]]);
  const whole = [
    element("p", { class: "verdict " + answer.verdict, id: "verdict", "data-verdict": answer.verdict }, answer.sentence),
    answer.effects.length && answer.is_current ? add(answer.effects) : null,
    answer.verdict === "parameters_changed" && answer.is_current && button("Take the new numbers over", () => act("recalibrate"), { class: "primary" }),
    answer.alternatives.length > 0 && element("div", {}, element("p", {}, "These data cannot tell it from:"), answer.alternatives.map(it => add(it))),
    element("p", { class: "soft" }, error.measure), errors, candidates(answer),
    answer.findings.length > 0 && element("details", { "data-key": "answer findings" }, element("summary", {}, `${answer.findings.length} findings`), element("ul", {}, answer.findings.map(it => element("li", {}, it)))),
    element("h3", {}, "What to do next"), element("ul", {}, answer.next.map(it => element("li", {}, it.replaceAll("`", "")))),
  ];
  if (answer.is_current) return whole;
  // Of another model or other logs: it is kept, and not in the way of what is.
  return element("details", { "data-key": "answer before" }, element("summary", {}, `what was found of ${answer.model || "a model that is gone"} before`), whole);
}

const names = role => desk.logs.filter(it => it.role === role).map(it => lastPart(it.name)).join(", ");

function draw() {
  const model = desk.models.find(it => it.id === desk.chosen);
  const running = desk.tick.search?.state === "running";
  const held = names("held_out");
  // It stays the same element: a search that goes on keeps its button.
  progress ||= element("div", { class: "progress" });
  fill(host, element("h2", {}, "What is missing?"),
    element("p", { class: "soft" }, `Model ${model?.name}, fitted on ${names("fit") || "no log"}${held ? ", held out " + held : ""}.`),
    button("What is missing?", () => act("diagnose"), { class: "primary", disabled: running || !names("fit"), id: "ask-button" }),
    progress, desk.answered && answered(desk.answered), desk.diagnose_by_hand && element("details", { "data-key": "ask by hand" }, element("summary", {}, "the same by hand"), command(desk.diagnose_by_hand)));
  tick(desk.tick);
}

export function build(at) {
  host = at("ask");
  onDesk(draw);
  onTick(tick);
}
