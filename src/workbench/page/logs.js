// The logs: what each is for, and what screening found.

import { act, onDesk, save } from "./act.js";
import { button, count, element, fill, lastPart, number } from "./dom.js";
import { colourOfLog, isBeside, onBeside, putBeside } from "./beside.js";
import { choose } from "./files.js";
import { partOf } from "./part.js";
import { follow, isFollowed, onFollowed } from "./follow.js";
import * as view from "./plots.js";

const ROLES = [["fit", "fit"], ["held_out", "held out"], ["look", "look"]];

function roles(log) {
  const choice = ([role, text]) => button(text, () => act("role", { log: log.id, role }), {
    "aria-pressed": String(log.role === role),
    "aria-label": `${text}: ${log.name}`,
    title: { fit: "models are fitted on it", held_out: "errors are judged on it", look: "it is looked at only" }[role],
  });
  return element("div", { class: "choice", role: "group", "aria-label": "What " + log.name + " is for" }, ROLES.map(choice));
}

// A file with several logs: one of them is chosen.
function parts(log) {
  const length = ({ seconds }) => (seconds === null ? "" : `, ${number(seconds, 3)} s`);
  return [element("p", {}, `It holds ${log.parts.length} logs: choose one.`),
    element("ol", { class: "parts" }, log.parts.map(it => element("li", {}, button(`log ${it.part}${length(it)}`, () => act("open_part", { log: log.id, part: it.part }), {
      "aria-label": `open log ${it.part} of ${log.name}`, disabled: it.seconds === 0, title: it.seconds === 0 ? "it has no rows" : undefined }))))];
}

// Which part of it counts, where not all of it does.
function chosen({ rotors, from_s, to_s }) {
  const time = from_s === undefined && to_s === undefined ? "" : `${from_s === undefined ? "" : `from ${from_s} s `}${to_s === undefined ? "" : `to ${to_s} s`}`.trim();
  const said = [rotors && `rotor${rotors.length > 1 ? "s" : ""} ${rotors.join(", ")}`, time].filter(Boolean).join("; ");
  return said && element("p", { class: "soft" }, "Only " + said);
}

function about(log) {
  if (log.state === "opening") return element("p", { class: "soft" }, "being read ...");
  const again = log.mapping && [
    button("its columns ...", () => act("ask_again", { log: log.id }), { class: "quiet", "aria-label": "the columns of " + log.name }),
    button("save mapping", () => save({ what: "mapping", id: log.id }), { class: "quiet", "aria-label": "save the mapping of " + log.name })];
  if (log.state === "failed") return [element("p", { class: "bad" }, log.why), again];
  if (log.state === "parts") return parts(log);
  if (log.state === "guessed") return element("p", { class: "bad" }, "What its columns mean is a guess: confirm it.");
  const [from, to] = log.ends_s;
  const grow = element("div", { class: "row" },
    button("read again", () => act("reread", { log: log.id }), { class: "quiet", "aria-label": "read again: " + log.name, title: "where the file is being written: read what is there by now" }),
    element("label", { class: "soft", title: "read again every two seconds" }, element("input", {
      type: "checkbox", checked: isFollowed(log.id), "data-key": "follow " + log.id, "aria-label": "follow " + log.name,
      onchange: event => follow(log.id, event.target.checked),
    }), " follow"),
    view.shownLog() !== log.id && element("label", { class: "soft", title: "draw it over the log that is shown, as if both had begun together" }, element("input", {
      type: "checkbox", checked: isBeside(log.id), "data-key": "beside " + log.id, "aria-label": "draw over the log that is shown: " + log.name,
      onchange: event => putBeside(log.id, event.target.checked),
    }), " over"), again,
    log.others && button("other logs of the file ...", () => act("open_log", { path: log.others, choice: log.choice }), { class: "quiet", "aria-label": "other logs of " + log.others }));
  const notes = log.notes.length && element("details", { "data-key": "notes " + log.id },
    element("summary", {}, count(log.notes.length, "finding")),
    element("ul", {}, log.notes.map(note => element("li", {}, note))));
  return [element("p", { class: "soft" }, `${log.rows.toLocaleString("en")} rows, ${(to - from).toFixed(1)} s, ${log.format}`), chosen(log.choice), log.stuck && element("p", { class: "bad" }, "It could not be read again: " + log.stuck), notes, grow];
}

function entry(log) {
  const name = button(lastPart(log.name), () => view.show(log.id), {
    class: "name", title: log.name, "aria-pressed": String(view.shownLog() === log.id), "aria-label": "show " + log.name,
    disabled: !["open", "guessed"].includes(log.state),
  });
  const close = button("×", () => act("close_log", { log: log.id }), { class: "quiet", "aria-label": "close " + log.name });
  // The one that is shown is what was measured; another one has the colour that it is drawn in over that.
  const tone = view.shownLog() === log.id ? "measured" : colourOfLog(log.id);
  const swatch = element("span", { class: "swatch " + tone, "aria-hidden": "true" });
  return element("li", { "data-log": log.id }, element("div", { class: "row" }, swatch, name, close), about(log), roles(log));
}

function openLog() {
  const part = partOf();
  choose("Open a log", path => {
    const choice = part.read();
    if (choice) act("open_log", { path, choice });
  }, part.root);
}

export function build(at) {
  const draw = desk => fill(at("logs"),
    element("div", { class: "row" }, element("h2", {}, "Logs"),
      button("Open ...", openLog, { "aria-label": "open a log" })),
    desk.logs.length ? element("ul", { class: "cards" }, desk.logs.map(entry)) : element("p", { class: "soft" }, "Open a log to begin, or drag one in."));
  onDesk(draw);
  view.onShown(draw);
  onFollowed(draw);
  onBeside(draw);
}
