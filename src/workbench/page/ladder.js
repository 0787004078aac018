// The ladder of the model that is worked on: what was added, and how far the error fell with each step.

import { act, onDesk } from "./act.js";
import { ready } from "./ask.js";
import { button, element, fill, number, precise } from "./dom.js";

// A bar as long as the error is, beside the largest of the ladder.
function bar(value, most, kind) {
  const it = element("span", { class: "bar-of " + kind, "aria-hidden": "true" });
  it.style.width = `${Math.max(100 * value / most, 0.5)}%`;
  return it;
}

function rung(step, index, most) {
  const { error } = step;
  return element("li", { "data-rung": step.added.join("+") },
    element("p", {}, element("b", {}, step.title)),
    element("p", {}, "held out: ", precise(error.validate_before, 4, { "data-is": "before" }), " → ", precise(error.validate_after, 4, { "data-is": "after" }), element("span", { class: "soft" }, ` (noise ${number(error.noise_floor, 3)})`)),
    bar(error.validate_before, most, "before"), bar(error.validate_after, most, "after"), bar(error.noise_floor, most, "floor"));
}

export function build(at) {
  onDesk(desk => {
    const model = desk.models.find(it => it.id === desk.chosen);
    const steps = model?.ladder || [];
    const running = desk.tick.search?.state === "running";
    const most = Math.max(...steps.flatMap(it => [it.error.validate_before, it.error.validate_after, it.error.noise_floor]), Number.MIN_VALUE);
    fill(at("ladder"), element("h2", {}, `Ladder of ${model?.name || ""}`),
      steps.length ? element("ol", { class: "ladder" }, steps.map((it, index) => rung(it, index, most))) : element("p", { class: "soft" }, "Nothing was added to it."),
      steps.length > 0 && element("p", { class: "soft" }, steps.at(-1).error.measure),
      element("div", { class: "row" },
        button("Step back", () => act("step_back"), { disabled: running || !steps.length }),
        button("Refit its own numbers", () => act("recalibrate"), { disabled: running || !ready() })));
  });
}
