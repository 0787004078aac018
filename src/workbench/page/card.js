// The card of an effect: what it is, its formula, how it shows. It stands beside the list while a candidate is pointed at or
// has the focus.

import { onDesk } from "./act.js";
import { element, fill } from "./dom.js";

const host = element("aside", { id: "card", role: "tooltip", hidden: true });
document.body.append(host);

function lines(it) {
  const more = [it.report?.join(" "), it.residual && "How it shows: " + it.residual, it.source && "Source: " + it.source, it.experiment && "Experiment: " + it.experiment];
  return [element("p", {}, it.meaning), element("p", { class: "formula" }, it.equation), more.filter(Boolean).map(text => element("p", {}, text))];
}

function show(it, id, beside) {
  fill(host, element("h3", {}, id), lines(it));
  host.hidden = false;
  const list = beside.closest("section")?.getBoundingClientRect();
  host.style.right = `${innerWidth - (list?.left ?? innerWidth) + 8}px`;
  const top = beside.getBoundingClientRect().top - 8;
  host.style.top = `${Math.max(Math.min(top, innerHeight - host.offsetHeight - 8), 8)}px`;
}

const hide = () => { host.hidden = true; };
addEventListener("keydown", event => { if (event.key === "Escape") hide(); });
addEventListener("scroll", hide, true);
// The list that it stands beside is made anew.
onDesk(hide);

// The name of a candidate, which shows its card and holds it as a fold.
export function card(it, id) {
  if (!it) return id;
  const shown = () => show(it, id, name);
  const name = element("summary", { onmouseenter: shown, onmouseleave: hide, onfocus: shown, onblur: hide, onclick: hide }, id);
  return element("details", { class: "card", "data-key": "card " + id }, name, lines(it));
}
