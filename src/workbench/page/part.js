// Which part of a log is opened: the fields of the dialog, as `--rotors`, `--from-s` and `--to-s` say it.

import { complain } from "./act.js";
import { element } from "./dom.js";

const field = (name, hint) => element("input", { type: "text", "aria-label": name, placeholder: hint, size: "8", "data-key": name });

// Numbers between commas; nothing where one of them is no number.
function numbers(text, isOne) {
  const found = text.split(",").map(it => it.trim()).filter(Boolean);
  return found.every(it => isOne(Number(it))) ? found.map(Number) : null;
}

// The fields, and `read()` for what they say; `null`, and a complaint, where that cannot be.
export function partOf() {
  const [rotors, from, to] = [field("only these rotors", "all"), field("only from this time [s]", "begin"), field("only to this time [s]", "end")];
  const read = () => {
    const chosen = numbers(rotors.value, it => Number.isInteger(it) && it > 0);
    const [begin, end] = [from, to].map(it => numbers(it.value, Number.isFinite));
    if (!chosen || [begin, end].some(it => !it || it.length > 1)) {
      complain("Rotors are numbers from 1, such as 3 or 2,4; times are seconds.");
      return null;
    }
    return { ...(chosen.length ? { rotors: chosen } : {}), ...(begin.length ? { from_s: begin[0] } : {}), ...(end.length ? { to_s: end[0] } : {}) };
  };
  const root = element("p", { class: "part row" }, "Rotors ", rotors, " from ", from, " to ", to, " s");
  return { root, read };
}
