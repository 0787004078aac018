// The loop of the bench's controller about a model: what `design` says.

import { complain, get } from "./act.js";
import { command, element, fill, precise, table } from "./dom.js";

// What has no end is `null`: no growth of the gain makes the loop unstable.
const endless = value => (value === null ? "any" : precise(value, 4));
const DEGREES = 180 / Math.PI;

function content({ design, command: typed }) {
  const { margins } = design;
  const kind = `${design.controller.toUpperCase()} each ${design.period_s} s`;
  const rows = margins && [
    ["gain may grow by", endless(margins.gain_up), "-"],
    ["gain may fall to", endless(margins.gain_down), "-"],
    ["phase margin", precise(margins.phase_rad * DEGREES, 4), "°"],
    ["further delay", precise(1e3 * margins.delay_s, 4), "ms"],
    ["sensitivity peak", precise(margins.sensitivity_peak, 4), "-"],
    ["bandwidth", precise(margins.bandwidth_rad_s, 4), "rad/s"],
  ];
  const said = [["refused", design.refusal], ["warning", design.warning], ["advice", design.advice]].filter(([, sentence]) => sentence);
  return [
    rows ? table([kind, "", "unit"], rows, { class: "margins" }) : element("p", { class: "bad" }, `${kind}: no stable loop`),
    said.map(([what, sentence]) => element("p", {}, element("b", {}, what + ": "), sentence)),
    command(typed),
  ];
}

// A fold that asks when it is opened.
export function margins(model) {
  const host = element("div", {});
  const fold = element("details", {
    "data-key": "margins " + model.id,
    ontoggle: async () => {
      if (!fold.open) return;
      try {
        fill(host, content(await get("api/margins", { model: model.id })));
      } catch (error) {
        complain(error.message);
      }
    },
  }, element("summary", {}, "margins of the controller"), host);
  return fold;
}
