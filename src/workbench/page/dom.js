// Elements. Whatever comes from a log, a model or a file name goes in as text, never as markup.

// Children that are not there (null, false, 0, an empty text) are left out:
// element("button", { class: "quiet", onclick: act }, "text", child, ...)
export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked" || name === "disabled") made[name] = value;
    else made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.flat(Infinity).filter(Boolean));
  if (tag === "details") made.querySelector(":scope > summary")?.setAttribute("aria-expanded", "false");
  return made;
}

// A fold says whether it is open, however it was opened: `toggle` does not bubble, and is heard on its way down.
document.addEventListener("toggle", event => {
  if (event.target.tagName === "DETAILS") event.target.querySelector(":scope > summary")?.setAttribute("aria-expanded", String(event.target.open));
}, true);

// What a screen reader says when it changes, and nobody sees. Words that are the same again are not said again.
export function teller() {
  const host = element("p", { class: "said", role: "status", "aria-live": "polite" });
  const tell = words => { if (host.textContent !== words) host.textContent = words; };
  return { host, tell };
}

// What is pressed must still be there when it is let go, or the click is lost: until then a panel stays as it is. The list of a
// `select` swallows the release, and is no click.
let pressed = null;
const waiting = new Map();

// Calls `draw`, which draws in `host` anew: now, or when nothing in it is pressed any more. Of several the last is called.
export function whenLetGo(host, draw) {
  if (pressed && host.contains(pressed)) {
    waiting.set(host, draw);
    return;
  }
  waiting.delete(host);
  draw();
}

function letGo() {
  pressed = null;
  // After the click that the release makes.
  if (waiting.size) setTimeout(() => { for (const [host, draw] of [...waiting]) whenLetGo(host, draw); });
}

addEventListener("pointerdown", event => { pressed = event.target.closest("select") ? null : event.target; }, true);
for (const name of ["pointerup", "pointercancel", "dragend"]) addEventListener(name, letGo, true);
// Let go where nobody saw it: in another window, on a scroll bar.
addEventListener("blur", letGo);
addEventListener("pointermove", event => { if (pressed && !event.buttons) letGo(); }, true);

// Puts new content in place of the old, and the focus back to where it was by its `data-key`, or that of its fold.
export function fill(host, ...children) {
  whenLetGo(host, () => put(host, children));
}

function put(host, children) {
  const focused = host.contains(document.activeElement) && document.activeElement;
  const key = focused && focused.closest("[data-key]")?.dataset.key;
  const opened = new Set([...host.querySelectorAll("details[data-key]")].filter(it => it.open).map(it => it.dataset.key));
  host.replaceChildren(...children.flat(Infinity).filter(Boolean));
  for (const it of host.querySelectorAll("details[data-key]")) if (opened.has(it.dataset.key)) it.open = true;
  if (!focused) return;
  const again = key && [...host.querySelectorAll("[data-key]")].find(it => it.dataset.key === key);
  // Where it is gone the next Tab goes on from here, and not from the beginning of the page.
  if (!again) host.tabIndex = -1;
  (again?.querySelector(":scope > summary") || again || host).focus({ preventScroll: true });
}

// The second click of a double click does nothing: it was meant for what stood there at the first. One that `repeats` may be
// pressed in quick succession.
export function button(text, act, { repeats, ...properties } = {}) {
  const onclick = event => { if (repeats || event.detail < 2) act(event); };
  return element("button", { type: "button", onclick, "data-key": properties["aria-label"] || text, ...properties }, text);
}

// A number as the reports round it.
export function number(value, digits = 4) {
  if (value === null || value === undefined || !isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e6)) return value.toExponential(digits - 1);
  return String(Number(value.toPrecision(digits)));
}

// The same as an element, with all digits where the pointer rests.
export function precise(value, digits = 4, properties = {}) {
  return element("span", { title: String(value), "data-value": String(value), class: "number", ...properties }, number(value, digits));
}

// How many of what: 1 finding, 2 findings.
export function count(many, what) {
  return `${many} ${what}${many === 1 ? "" : "s"}`;
}

export function table(headings, rows, properties = {}) {
  return element("table", properties,
    element("thead", {}, element("tr", {}, headings.map(it => element("th", { scope: "col" }, it)))),
    element("tbody", {}, rows.map(cells => element("tr", {}, cells.map(it => element("td", {}, it))))));
}

// A command with a button that copies it.
export function command(text) {
  const copy = button("copy", async event => {
    await navigator.clipboard.writeText(text);
    event.target.textContent = "copied";
  }, { "aria-label": "copy " + text, class: "quiet" });
  return element("div", { class: "command" }, element("code", {}, text), copy);
}

export function lastPart(path) {
  return path.split("/").pop();
}
