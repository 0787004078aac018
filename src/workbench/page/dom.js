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

// Puts new content in place of the old, and the focus back to where it was by its `data-key`.
export function fill(host, ...children) {
  const key = host.contains(document.activeElement) ? document.activeElement.dataset.key : undefined;
  const opened = new Set([...host.querySelectorAll("details[data-key]")].filter(it => it.open).map(it => it.dataset.key));
  host.replaceChildren(...children.flat(Infinity).filter(Boolean));
  for (const it of host.querySelectorAll("details[data-key]")) if (opened.has(it.dataset.key)) it.open = true;
  if (key) [...host.querySelectorAll("[data-key]")].find(it => it.dataset.key === key)?.focus();
}

export function button(text, act, properties = {}) {
  return element("button", { type: "button", onclick: act, "data-key": properties["aria-label"] || text, ...properties }, text);
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
