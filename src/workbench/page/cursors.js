// Two cursors, A and B, over all plots: what each curve is there, their difference, and all of its samples between them.

import { get } from "./act.js";
import { element, number, precise, table } from "./dom.js";

const at = { A: null, B: null };
const listeners = [];
// Where the pointer is over a plot [s].
let pointer = null;

export const onCursors = hear => listeners.push(hear);
export const hover = seconds => { pointer = seconds; };
export const cursors = () => Object.entries(at).filter(([, seconds]) => seconds !== null).map(([label, seconds]) => ({ label, at: seconds }));

// A cursor at the pointer; without one, at a share of what is seen.
export function place(name, [from, to]) {
  const share = name === "A" ? 1 / 3 : 2 / 3;
  at[name] = pointer !== null && pointer >= from && pointer <= to ? pointer : from + share * (to - from);
  for (const hear of listeners) hear();
}

export function clear() {
  [at.A, at.B] = [null, null];
  for (const hear of listeners) hear();
}

// From the one to the other, the earlier first; `null` where one is missing.
const between = () => (at.A === null || at.B === null ? null : [Math.min(at.A, at.B), Math.max(at.A, at.B)]);

// The table of a figure: `query` is that of its plot, `name` names a curve.
export async function rangeTable(host, query, name) {
  const span = between();
  if (!span) return host.replaceChildren();
  const [from, to] = span;
  const { curves } = await get("api/plot", { ...query, from, to, pixels: 1 });
  // Meanwhile they were moved.
  if (JSON.stringify(span) !== JSON.stringify(between())) return;
  const cell = value => (value === null ? "–" : precise(value, 5));
  const rows = curves.map((curve, index) => {
    const { samples, first, last, least, greatest, mean, rms } = curve.range;
    const change = first === null ? null : last - first;
    return [name(curve, index), cell(first), cell(last), cell(change), cell(mean), cell(rms), cell(least), cell(greatest), String(samples)];
  });
  const unit = curves[0] ? ` [${curves[0].unit || "-"}]` : "";
  const caption = `From ${number(from, 7)} to ${number(to, 7)} s (${number(to - from, 5)} s): first and last sample, and all between`;
  host.replaceChildren(element("p", { class: "soft" }, caption),
    table(["curve" + unit, "first", "last", "change", "mean", "rms", "least", "greatest", "samples"], rows, { class: "range" }));
}
