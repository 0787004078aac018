// The keyboard.

import { act, desk } from "./act.js";
import { button, element, fill } from "./dom.js";
import { clear } from "./cursors.js";
import * as plots from "./plots.js";

const KEYS = [
  ["?", "these keys", () => show()],
  ["w", "show the worst ten seconds", () => plots.worst()],
  ["a", "show all of the log", () => plots.all()],
  ["+", "zoom in", () => plots.zoom(0.5)],
  ["-", "zoom out", () => plots.zoom(2)],
  ["ArrowLeft", "earlier", () => plots.pan(-0.25)],
  ["ArrowRight", "later", () => plots.pan(0.25)],
  ["1", "cursor A at the pointer", () => plots.cursor("A")],
  ["2", "cursor B at the pointer", () => plots.cursor("B")],
  ["0", "both cursors off", () => clear()],
  ["n", "the next log", () => plots.nextLog()],
  ["i", "identify the bench", () => act("identify")],
  ["m", "ask what is missing", () => act("diagnose")],
  ["l", "look for the law itself", () => act("discover")],
  ["c", "cancel the search", () => act("cancel")],
  ["b", "step back", () => desk && act("step_back")],
];

export function show() {
  const dialog = document.getElementById("keys");
  fill(dialog, element("h2", { id: "keys-title" }, "Keys"),
    element("dl", {}, KEYS.map(([key, text]) => [element("dt", {}, element("kbd", {}, key.replace("Arrow", ""))), element("dd", {}, text)])),
    element("p", { class: "soft" }, "In a plot: drag to zoom, hold shift and drag to pan, double-click for all."),
    button("Close", () => dialog.close()));
  if (!dialog.open) dialog.showModal();
}

export function build() {
  addEventListener("keydown", event => {
    // A dialog that was just closed may keep the focus for a moment.
    const typing = event.target.closest("input:not([type=checkbox]), select, textarea, dialog[open]");
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const key = KEYS.find(([name]) => name === event.key);
    // What is not seen is not acted on.
    if (!key || (key[0] !== "?" && document.querySelector("main").hidden)) return;
    event.preventDefault();
    key[2]();
  });
}
