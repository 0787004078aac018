// A search while it runs, and how it ended.

import { act, desk, onTick } from "./act.js";
import { button, element, fill, number, table, teller } from "./dom.js";

const KINDS = {
  identify: "Identifying the bench",
  diagnose: "Searching for what is missing", extend: "Fitting the extended model", try: "Fitting it, to be looked at",
  recalibrate: "Refitting the model's own numbers", discover: "Looking for the law itself",
};

// What was fitted so far, the best first.
function tried(search) {
  if (!search.tried.length) return null;
  return table(["fitted so far", "error, in noise"], search.tried.map(([effects, over]) => [effects.join(" + "), number(over, 4)]), { class: "tried" });
}

function state(search) {
  const seconds = search.seconds.toFixed(1) + " s";
  const leading = search.leading.length ? `, leading: ${search.leading.join(" + ")}` : "";
  const said = `${KINDS[search.kind]}: ${search.fitted ? `${search.fitted} fitted${leading}, ` : ""}${seconds}`;
  switch (search.state) {
    case "running": return [
      element("progress", { "aria-label": "search" }), element("p", { id: "progress" }, said), button("Cancel", () => act("cancel")), element("div", {}, tried(search))];
    case "cancelled": return element("p", { id: "progress" }, `Cancelled after ${seconds}; nothing has changed.`);
    case "failed": return element("p", { id: "progress", class: "bad" }, search.why);
    default: return element("p", { id: "progress", class: "soft" }, `Done in ${seconds}.`);
  }
}

// The same for the ear: not each tenth of a second.
function words(search) {
  switch (search.state) {
    case "running": return KINDS[search.kind] + (search.leading.length ? `, leading: ${search.leading.join(" + ")}` : "");
    case "cancelled": return "Cancelled; nothing has changed.";
    case "failed": return search.why;
    default: return KINDS[search.kind] + ": done.";
  }
}

// Elements that show and say the newest search, where it is one of these kinds. They stay the same: a search that goes on keeps
// its button.
export function progressOf(kinds) {
  const host = element("div", { class: "progress" });
  const announced = teller();
  const hear = tick => {
    if (!tick) return;
    const search = kinds.includes(tick.search?.kind) ? tick.search : null;
    const made = search && state(search);
    announced.tell(search ? words(search) : "");
    // Its bar would begin anew with each tenth of a second: while it runs only the words change.
    const shown = search?.state === "running" && host.querySelector("progress") && host.querySelector("p");
    if (shown) {
      shown.textContent = made[1].textContent;
      host.lastElementChild.replaceWith(made.at(-1));
    } else fill(host, made);
  };
  onTick(hear);
  if (desk) hear(desk.tick);
  return [announced.host, host];
}
