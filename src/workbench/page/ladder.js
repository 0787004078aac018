// The ladder of the model that is worked on: what was added, and how far the error fell with each step.

import { act, onDesk } from "./act.js";
import { idle, ready } from "./ask.js";
import { button, element, fill, number, precise, table } from "./dom.js";

// A bar as long as the error is, beside the largest of the ladder.
function bar(value, most, kind) {
  const it = element("span", { class: "bar-of " + kind, "aria-hidden": "true" });
  it.style.width = `${Math.max(100 * value / most, 0.5)}%`;
  return it;
}

// The numbers that came with a step, as they are now.
function numbers(step, model) {
  const own = model.parameters.filter(it => step.added.some(id => it.name.startsWith(id + ".")));
  const row = it => [element("span", { title: it.meaning }, it.name.split(".").slice(1).join(".")), precise(it.value, 5), it.standard_error === null ? "" : "± " + number(it.standard_error, 2), it.unit];
  return own.length > 0 && table(["number", "value", "error", "unit"], own.map(row));
}

function rung(step, index, most, model) {
  const { error } = step;
  // A fit of its own stands before what `identify` has added: its error is not of free runs.
  const which = error.measure.includes("free run") ? "as it was" : "fitted without it";
  const look = index + 1 < model.ladder.length && button("look at it", () => act("rung", { steps: index + 1 }), {
    class: "quiet", "aria-label": "look at rung " + (index + 1), title: "the model as it was after this step" });
  return element("li", { "data-rung": step.added.join("+") },
    element("p", {}, element("b", {}, step.title), " ", look),
    element("p", {}, "held out: ", precise(error.validate_before, 4, { "data-is": "before" }), ` (${which}) → `, precise(error.validate_after, 4, { "data-is": "after" }), element("span", { class: "soft" }, ` (noise ${number(error.noise_floor, 3)})`)),
    bar(error.validate_before, most, "before"), bar(error.validate_after, most, "after"), bar(error.noise_floor, most, "floor"), numbers(step, model));
}

export function build(at) {
  onDesk(desk => {
    const model = desk.models.find(it => it.id === desk.chosen);
    const steps = model?.ladder || [];
    const most = Math.max(...steps.flatMap(it => [it.error.validate_before, it.error.validate_after, it.error.noise_floor]), Number.MIN_VALUE);
    fill(at("ladder"), element("h2", {}, `Ladder of ${model?.name || ""}`),
      steps.length ? element("ol", { class: "ladder" }, steps.map((it, index) => rung(it, index, most, model))) : element("p", { class: "soft" }, "Nothing was added to it."),
      steps.length > 0 && element("p", { class: "soft" }, steps.at(-1).error.measure),
      element("div", { class: "row" },
        idle("Step back", () => act("step_back"), { disabled: !steps.length }),
        idle("Refit its own numbers", () => act("recalibrate"), { disabled: !ready() })));
  });
}
