// Puts the panels together.

import { act, begin, complain, desk, onDesk, onTick, save } from "./act.js";
import { button, element, fill } from "./dom.js";
import * as ask from "./ask.js";
import * as beside from "./beside.js";
import * as drop from "./drop.js";
import * as follow from "./follow.js";
import * as keys from "./keys.js";
import * as ladder from "./ladder.js";
import * as law from "./law.js";
import * as live from "./live.js";
import * as logs from "./logs.js";
import * as models from "./models.js";
import * as plots from "./plots.js";
import * as shell from "./shell.js";

const at = id => document.getElementById(id);

function doing(tick) {
  if (!tick) return "The server does not answer.";
  if (tick.search?.state === "running") return "Searching ...";
  return tick.looking ? "Reading and comparing " + tick.looking : "";
}

let complaints = [];
let noticed = "";
function notices() {
  // Many plots may have the same to say.
  const all = [...new Set([...(desk?.notices || []), ...complaints])];
  // What stands there already is not said once more with every change of the desk.
  if (JSON.stringify(all) === noticed) return;
  noticed = JSON.stringify(all);
  const dismiss = button("dismiss", () => {
    complaints = [];
    if (desk?.notices.length) act("read");
    notices();
  }, { "aria-label": "dismiss the notices" });
  fill(at("notices"), all.length && element("div", { class: "notice" }, element("ul", {}, all.map(it => element("li", {}, it))), dismiss));
}

document.addEventListener("complaint", event => {
  if (!complaints.includes(event.detail)) complaints.push(event.detail);
  notices();
});

for (const panel of [logs, models, plots, ask, law, ladder, shell, live, follow, beside]) panel.build(at);
onDesk(notices);
onTick(tick => {
  at("doing").textContent = doing(tick);
  document.documentElement.classList.toggle("gone", !tick);
});
at("save").addEventListener("click", () => save({ what: "session" }));
at("help").addEventListener("click", keys.show);
keys.build(at);
drop.build();
begin().catch(error => complain(error.message));
