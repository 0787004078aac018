// The models: which are drawn, and which one is diagnosed and extended.

import { act, onDesk, save } from "./act.js";
import { button, count, element, fill, number, precise, table } from "./dom.js";
import { choose } from "./files.js";
import { identify } from "./ask.js";
import { colourOf } from "./charts.js";
import { margins } from "./margins.js";

function parameters(model) {
  const row = it => [
    element("span", { title: it.meaning || it.name }, it.name),
    precise(it.value, 5),
    it.standard_error === null ? "" : "± " + number(it.standard_error, 2),
    it.unit,
  ];
  return element("details", { "data-key": "numbers " + model.id },
    element("summary", {}, "its numbers"),
    table(["number", "value", "error", "unit"], model.parameters.map(row)));
}

function entry(model, desk) {
  const isChosen = desk.chosen === model.id;
  const swatch = element("span", { class: "swatch " + colourOf(model.id), "aria-hidden": "true" });
  const shown = element("input", {
    type: "checkbox", checked: model.shown, "aria-label": "draw " + model.name, "data-key": "draw " + model.name,
    onchange: event => act("show", { model: model.id, shown: event.target.checked }),
  });
  const name = button(model.name + (model.is_tried ? " (tried)" : ""), () => act("choose", { model: model.id }), {
    class: "name", "aria-pressed": String(isChosen), "aria-label": "work on " + model.name, title: "work on this model",
  });
  const keep = button("save", () => save({ what: "model", id: model.id }), { class: "quiet", "aria-label": "save model " + model.name });
  // The paper's stays: everything starts from it.
  const close = !isChosen && model.file !== "paper" && button("×", () => act("close_model", { model: model.id }), { class: "quiet", "aria-label": "close " + model.name });
  const effects = model.effects.map(it => it.id).join(" + ") || "no effects added";
  return element("li", { "data-model": model.id }, element("div", { class: "row" }, shown, swatch, name, keep, close),
    element("p", { class: "soft" }, effects),
    model.notes.length ? element("details", { "data-key": "model notes " + model.id }, element("summary", {}, count(model.notes.length, "finding")),
      element("ul", {}, model.notes.map(note => element("li", {}, note)))) : null,
    parameters(model), margins(model));
}

export function build(at) {
  onDesk(desk => fill(at("models"),
    element("div", { class: "row" }, element("h2", {}, "Models"),
      button("Open ...", () => choose("Open a model", path => act("open_model", { path })), { "aria-label": "open a model" })),
    identify({ class: null }),
    element("ul", { class: "cards" }, desk.models.map(model => entry(model, desk)))));
}
