// How a curve is drawn, and what it is called.

import { desk } from "./act.js";
import { colourOf } from "./charts.js";

export function lookOf(curve, index) {
  const model = desk.models.find(it => it.id === curve.model);
  const name = model?.name || curve.name;
  switch (curve.kind) {
    case "measured": return { label: "measured", tone: "measured" };
    case "channel": return { label: curve.name, tone: "next-" + (index % 8) };
    case "lower": return { label: name + " -1 s.e.", tone: colourOf(curve.model), edge: true };
    case "upper": return { label: name + " +1 s.e.", tone: colourOf(curve.model), edge: true, upper: true };
    default: return { label: name, tone: colourOf(curve.model), dashed: model?.is_tried };
  }
}

// A curve's name where it stands without its colour.
export function nameOf(curve, index) {
  const { label } = lookOf(curve, index);
  return { error: "error of " + label, modelled: label }[curve.kind] || label;
}
