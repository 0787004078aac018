// The plots of one log: each block measured and modelled, its error beneath; all of them over the same time.

import { complain, desk, get, ofChosen, onDesk, save, saveBlob } from "./act.js";
import { Chart, colourOf, ink, isDark } from "./charts.js";
import { lookOf, nameOf } from "./looks.js";
import { clear, onCursors, place, rangeTable } from "./cursors.js";
import { against } from "./against.js";
import { named } from "./ask.js";
import { onBeside, others } from "./beside.js";
import { details } from "./details.js";
import { drawing, picture } from "./drawing.js";
import { columns } from "./guess.js";
import { button, command, element, fill, lastPart, number, precise, whenLetGo } from "./dom.js";

let middle = null;
let [log, span, channels] = [null, null, []];
let [figures, built, rows] = [[], "", ""];
// What is to be drawn anew, and with the next picture of the screen.
let [isForced, frame] = [false, 0];
const listeners = [];

export const shownLog = () => log;
export const onShown = hear => listeners.push(hear);

const current = () => desk?.logs.find(it => it.id === log && it.state === "open");

// Another log, from its beginning to its end.
export function show(id) {
  if (id === log) return;
  [log, span, channels] = [id, null, []];
  update();
  for (const hear of listeners) hear(desk);
}

export function nextLog() {
  const open = desk.logs.filter(it => it.state === "open");
  if (open.length) show(open[(open.findIndex(it => it.id === log) + 1) % open.length].id);
}

// What is seen of the time, in every plot.
function look(from, to) {
  const ends = current()?.ends_s;
  if (!ends || !(to > from)) return;
  const width = Math.min(to - from, ends[1] - ends[0]);
  const start = Math.min(Math.max(from, ends[0]), ends[1] - width);
  span = [start, start + width];
  refresh();
}

export const all = () => { span = null; refresh(); };
export function zoom(factor) {
  const [from, to] = seen();
  const [middle, half] = [(from + to) / 2, (to - from) * factor / 2];
  look(middle - half, middle + half);
}
export function pan(share) {
  const [from, to] = seen();
  look(from + share * (to - from), to + share * (to - from));
}
export const cursor = name => place(name, seen());
// Where the model that is worked on fails most.
export function worst() {
  const over = block => { const it = ofChosen(block.errors); return block.name === "chain" ? -1 : it.rms / it.noise_floor; };
  const [block] = [...(current()?.compared?.blocks || [])].sort((a, b) => over(b) - over(a));
  const at = block && ofChosen(block.errors).worst_s;
  if (at) look(...at);
}
const seen = () => span || current()?.ends_s || [0, 1];

// The blocks, what the answer names first, then the one farthest over its noise floor; the chain is no block of its own.
function blocks() {
  const over = block => Math.max(...block.errors.map(it => it.rms / it.noise_floor));
  const isNamed = block => block.name !== "sensors" && block.signal.replace(/_\d+(?=_|$)/, "") === named();
  const rank = block => (block.name === "chain" ? -1 : over(block) + (isNamed(block) ? 1e9 : 0));
  return [...(current()?.compared?.blocks || [])].sort((a, b) => rank(b) - rank(a));
}

class Figure {
  // `channel` is drawn of other logs, too.
  constructor(title, query, parts, under, channel) {
    [this.title, this.query, this.channel] = [title, query, channel];
    this.stale = true;
    this.charts = parts.map(part => {
      const host = element("div", { class: "chart" });
      return { part, host, chart: new Chart({ host, height: part.height, unit: part.unit, name: part.name, onWindow: look, onAll: all }) };
    });
    const keep = (name, made) => async () => {
      const figure = await drawn(title);
      if (figure) saveBlob(await made(drawing(figure.charts.map(it => it.chart), `${title}, ${lastPart(current().name)}`, ink)), name);
    };
    const png = button("picture", keep("plot.png", picture), { class: "quiet", "aria-label": "save a picture of " + title });
    const lines = button("SVG", keep("plot.svg", it => it), { class: "quiet", "aria-label": "save a drawing of " + title });
    this.root = element("figure", { "aria-label": title },
      element("figcaption", {}, element("div", { class: "row" }, element("h3", {}, title), png, lines), under), this.charts.map(it => it.host));
    this.range = element("div");
    this.root.append(this.range);
    this.measure();
    new IntersectionObserver(([entry]) => {
      this.visible = entry.isIntersecting;
      if (this.visible && this.stale) this.refresh();
    }, { rootMargin: "200px" }).observe(this.root);
  }

  // What the curves are between the cursors.
  measure() {
    rangeTable(this.range, { log, ...this.query }, nameOf).catch(error => complain(error.message));
  }

  refresh(unseen) {
    if (this.visible || unseen) this.asking = this.ask();
  }

  // Whether it was drawn. What was asked for before is called off.
  async ask() {
    this.stale = false;
    this.call?.abort();
    const { signal } = this.call = new AbortController();
    const [from, to] = seen();
    // What is there already moves with the hand, however long the answer takes.
    for (const { chart } of this.charts) chart.move(from, to);
    try {
      const { pixels } = this.charts[0].chart;
      const [answer, beside] = await Promise.all([get("api/plot", { log, from, to, pixels, ...this.query }, signal), this.channel ? others(log, this.channel, [from, to], pixels, signal) : []]);
      if (signal.aborted) return false;
      for (const { part, chart } of this.charts) {
        const own = answer.curves.filter(it => part.kinds.includes(it.kind)).map((it, index) => ({ ...it, ...lookOf(it, index) }));
        const curves = part === this.charts[0].part ? [...own, ...beside] : own;
        chart.draw({ x: answer.x, curves, bands: answer.bands, levels: part.levels, from, to });
      }
      this.root.dataset.drawn = `${from} ${to}`;
      this.root.dataset.scheme = isDark() ? "dark" : "light";
      return true;
    } catch (error) {
      this.stale ||= !signal.aborted;
      if (!signal.aborted) complain(error.message);
      return false;
    }
  }

  destroy() {
    this.call?.abort();
    for (const { chart } of this.charts) chart.destroy();
  }
}

// The plots of this name, drawn: just come into view, or moved on, they may not be yet, and new ones may take their place meanwhile.
async function drawn(title) {
  let [figure, asking, isDrawn] = [null, null, false];
  while (figure !== figures.find(it => it.title === title) || asking !== figure?.asking) {
    figure = figures.find(it => it.title === title);
    if (figure?.stale) figure.refresh(true);
    isDrawn = await (asking = figure?.asking);
  }
  return isDrawn ? figure : null;
}

function errors(block) {
  return element("ul", { class: "errors" }, block.errors.map(it => {
    const model = desk.models.find(model => model.id === it.model);
    return element("li", { "data-error-of": model?.name },
      element("span", { class: "swatch " + colourOf(it.model), "aria-hidden": "true" }), (model?.name || "") + ": ", precise(it.rms, 4),
      ` ${block.unit} rms`, it.fit_percent === null ? "" : `, fit ${number(it.fit_percent, 3)} %`,
      it.is_noise ? element("strong", { class: "good" }, " at the noise floor") : `, noise ${number(it.noise_floor, 3)}`);
  }));
}

function blockFigure(block) {
  const { noise_floor } = ofChosen(block.errors);
  const levels = [{ label: "noise floor", value: noise_floor }, { label: "", value: -noise_floor }];
  const parts = [
    { kinds: ["measured", "modelled"], name: block.signal, unit: block.unit, height: 200 },
    { kinds: ["error"], name: "error", unit: block.unit, height: 120, levels },
  ];
  const figure = new Figure(`${block.name}: ${block.signal}`, { block: block.name, signal: block.signal }, parts,
    [element("p", { class: "soft" }, `Driven by ${block.driven_by.join(", ")}; ${block.run}.`), errors(block)],
    block.name === "sensors" ? null : block.signal);
  figure.root.dataset.block = block.name;
  figure.root.append(details(log, block), against(log, figure.query, "error", current().channels));
  return figure;
}

function makeFigures(it) {
  const made = blocks().map(blockFigure);
  const torque = it.compared?.unknown_torque || [];
  if (torque.length) {
    const figure = new Figure("Unknown torque", { block: "unknown_torque", signal: "torque" },
      [{ kinds: ["lower", "upper", "torque"], name: "torque", unit: "N m", height: 170 }],
      element("p", { class: "soft" }, "The torque that would make each model right, with its standard error to both sides."));
    figure.root.append(against(log, figure.query, "unknown torque", it.channels));
    made.push(figure);
  }
  const plain = channels.length ? channels : made.length ? ["command_1", "command_2"] : it.channels.slice(0, 6).map(channel => channel.name);
  for (const name of plain) {
    const channel = it.channels.find(it => it.name === name);
    if (channel) made.push(new Figure(name, { channel: name }, [{ kinds: ["channel"], name, unit: channel.unit || "-", height: 140 }], element("p", { class: "soft" }, channel.meaning), name));
  }
  return made;
}

function bar(it) {
  const pick = element("select", {
    "aria-label": "add a channel", "data-key": "add a channel",
    onchange: event => { channels = [...new Set([...channels, event.target.value])]; update(true); },
  }, element("option", { value: "" }, "add a channel ..."), it.channels.map(channel => element("option", { value: channel.name }, channel.name)));
  return element("div", { class: "bar row" }, element("h2", {}, lastPart(it.name)),
    button("worst 10 s", worst), button("all", all), button("+", () => zoom(0.5), { "aria-label": "zoom in", repeats: true }), button("−", () => zoom(2), { "aria-label": "zoom out", repeats: true }),
    button("◀", () => pan(-0.25), { "aria-label": "earlier", repeats: true }), button("▶", () => pan(0.25), { "aria-label": "later", repeats: true }),
    button("A", () => cursor("A"), { "aria-label": "cursor A" }), button("B", () => cursor("B"), { "aria-label": "cursor B" }),
    button("A B off", clear, { "aria-label": "cursors off" }), pick,
    button("report", () => save({ what: "report", id: it.id }), { class: "quiet", "aria-label": "save the report of " + it.name }),
    button("CSV", () => save({ what: "signals", id: it.id, ...(span ? { from: span[0], to: span[1] } : {}) }), {
      class: "quiet", "aria-label": "save the signals of " + it.name, title: "what is seen: these times, every channel and every model that is drawn" }));
}

// Not while one of the plots is dragged along.
function update(force) {
  isForced ||= force === true;
  whenLetGo(middle, redraw);
}

// Draws anew what has changed: other blocks or models are other plots.
function redraw() {
  const force = isForced;
  isForced = false;
  const it = current();
  const none = () => {
    for (const figure of figures) figure.destroy();
    [figures, built] = [[], ""];
  };
  const asked = desk?.logs.find(it => it.id === log && it.state === "guessed");
  if (asked) {
    none();
    return fill(middle, columns(asked));
  }
  if (!it) {
    const next = desk?.logs.findLast(log => log.state === "guessed") || desk?.logs.findLast(log => log.state === "open");
    // One that was just confirmed is waited for.
    if (next && !desk.logs.some(it => it.id === log && it.state === "opening")) return show(next.id);
    none();
    const waits = state => desk?.logs.some(it => it.state === state);
    return fill(middle, element("p", { class: "soft" }, waits("opening") ? "Being read ..." : waits("parts") ? "Choose one of the logs of the file." : "Open a log to see it here."));
  }
  const signature = JSON.stringify([log, it.compared?.models, it.compared?.blocks, it.compared?.why, channels, desk.chosen, named(), desk.models.map(it => [it.id, it.name, it.is_tried])]);
  if (signature === built && !force) {
    // More of it was read.
    if (rows !== it.sha256) refresh();
    rows = it.sha256;
    return;
  }
  [built, rows] = [signature, it.sha256];
  const top = middle.scrollTop;
  for (const figure of figures) figure.destroy();
  figures = makeFigures(it);
  const why = it.compared?.why && element("p", { class: "bad" }, it.compared.why);
  fill(middle, bar(it), why, !it.compared && element("p", { class: "soft" }, "The models are being compared with it ..."),
    figures.map(figure => figure.root), it.by_hand && it.compared && element("div", { class: "by-hand" }, element("p", { class: "soft" }, "The same by hand:"), command(it.by_hand)));
  middle.scrollTop = top;
}

// However often it is called: each plot is asked for once in a picture of the screen, as it was wanted last.
function refresh() {
  for (const figure of figures) figure.stale = true;
  frame ||= requestAnimationFrame(() => {
    frame = 0;
    for (const figure of figures) if (figure.stale) figure.refresh();
  });
}

export function build(at) {
  middle = at("middle");
  onDesk(() => update());
  onBeside(refresh);
  onCursors(() => {
    for (const figure of figures) {
      figure.charts.forEach(({ chart }) => chart.redraw());
      figure.measure();
    }
  });
  let wide = 0;
  new ResizeObserver(() => {
    // A notice that comes or goes changes the height alone.
    if (wide === middle.clientWidth) return;
    wide = middle.clientWidth;
    for (const figure of figures) figure.charts.forEach(({ chart }) => chart.resize());
    refresh();
  }).observe(middle);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => update(true));
}
