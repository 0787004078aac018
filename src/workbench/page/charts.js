// One plot: curves that the server has drawn for its width, bands behind them, levels across. uPlot draws.

import { desk } from "./act.js";
import { cursors, hover } from "./cursors.js";
import { number } from "./dom.js";

export const ink = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
export const isDark = () => matchMedia("(prefers-color-scheme: dark)").matches;
// [pixel] of a legend of one line.
const LEGEND = 19;
const FONT = "12px system-ui, sans-serif";
// [pixel] that the name of a level needs above its line.
export const ROOM = 15;

// The name of a model's colour; the same in lists and plots, and the same when another model is closed.
const colours = new Map();
export function colourOf(model) {
  for (const id of colours.keys()) if (!desk.models.some(it => it.id === id)) colours.delete(id);
  if (!colours.has(model)) {
    const taken = new Set(colours.values());
    let free = 0;
    while (taken.has(free)) free += 1;
    colours.set(model, free);
  }
  return "next-" + (colours.get(model) % 8);
}

// A slot without a sample is `undefined`, which uPlot draws through; a gap is `null`, which it does not.
function values(curve) {
  const y = curve.y.map(value => (value === null ? undefined : value));
  for (const slot of curve.gaps) y[slot] = null;
  return y;
}

// Of one number alone no scale can be read: then the step is halved.
function ticks(u, index, low, high, step) {
  const of = size => {
    const count = Math.floor(high / size) - Math.ceil(low / size) + 1;
    return Array.from({ length: Math.max(count, 0) }, (_, at) => Number(((Math.ceil(low / size) + at) * size).toPrecision(12)));
  };
  return [1, 2, 4, 8].map(part => of(step / part)).find(it => it.length > 1) || of(step);
}

function axis(side, label) {
  const grid = { stroke: ink("line"), width: 1 };
  return {
    side, label, stroke: ink("soft"), grid, ticks: { ...grid, size: 4 }, font: FONT, labelFont: FONT, labelGap: 0,
    space: side === 3 ? 22 : 50, size: side === 3 ? 60 : 30, labelSize: side === 3 ? 18 : 0,
    splits: side === 3 ? ticks : undefined,
    values: (_, ticks) => ticks.map(tick => (tick === null ? "" : number(tick, 6))),
  };
}

// What a plot shows, in words and numbers.
function described({ title, name, unit }, curves, from, to) {
  const of = ({ label, range }) => (range.samples ? `${label}: mean ${number(range.mean, 3)}, rms ${number(range.rms, 3)}, from ${number(range.least, 3)} to ${number(range.greatest, 3)}, ${range.samples} samples` : `${label}: no sample`);
  const seen = curves.filter(it => it.range && !it.edge).map(of);
  return [`${title || name} [${unit}] from ${number(from, 5)} to ${number(to, 5)} s`, ...seen].join(". ");
}

const labels = u => [...u.root.querySelectorAll(".u-legend .u-series > th")];

// The entries of a legend, each of which shows its curve or hides it, by the keyboard as by a click.
function legend(u) {
  labels(u).forEach((label, index) => {
    if (index === 0) return;
    label.tabIndex = 0;
    label.setAttribute("role", "button");
    label.title = "shows the curve, or hides it";
    label.addEventListener("keydown", event => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      event.stopPropagation();
      u.setSeries(index, { show: !u.series[index].show });
    });
  });
  said(u);
}

// Whether the curve of an entry is shown.
function said(u) {
  labels(u).forEach((label, index) => { if (index > 0) label.setAttribute("aria-pressed", String(u.series[index].show)); });
}

// spec: { host, height, unit, name (of the axis), title (where that has none), onWindow(from, to), onAll() }
export class Chart {
  constructor(spec) {
    this.spec = spec;
    this.signature = "";
    this.bands = [];
    this.levels = [];
    this.plot = null;
    // Which curves are drawn, and which of them the user has hidden.
    this.keys = [];
    this.hidden = new Set();
    // With room for its legend: what stands beneath does not jump when it is drawn.
    spec.host.style.minHeight = `${spec.height + LEGEND}px`;
  }

  // curves: [{ label, tone, dashed, dotted, y, gaps, lower, x }], a band's lower edge directly before its upper one.
  draw({ x, curves, bands, levels, from, to }) {
    this.bands = bands;
    this.levels = levels || [];
    const signature = curves.map(it => it.label + it.tone + it.dashed + it.dotted).join("|") + isDark();
    // Those of other logs have a time of their own, and come last.
    const [own, others] = [curves.filter(it => !it.x), curves.filter(it => it.x)];
    const table = [x, ...own.map(values)];
    const data = others.length ? uPlot.join([table, ...others.map(it => [it.x, values(it)])]) : table;
    if (signature !== this.signature) this.make(curves, data);
    this.signature = signature;
    this.plot.batch(() => {
      this.plot.setData(data, false);
      this.plot.setScale("x", { min: from, max: to });
    });
    const { canvas } = this.plot.ctx;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", described(this.spec, curves, from, to));
  }

  // What is drawn, over other times.
  move(from, to) {
    this.plot?.setScale("x", { min: from, max: to });
  }

  make(curves, data) {
    const focused = this.plot && this.keys[labels(this.plot).indexOf(document.activeElement)];
    this.plot?.destroy();
    // As many as series, of which the first is the time.
    this.keys = [null, ...curves.map(it => `${it.label}|${it.tone}`)];
    const { host, height, unit, name } = this.spec;
    const series = [{ label: "time [s]", value: (_, value) => number(value, 7) }];
    const bands = [];
    for (const curve of curves) {
      const stroke = ink(curve.tone);
      if (curve.upper) bands.push({ series: [series.length, series.length - 1], fill: stroke + "2e" });
      series.push({
        label: curve.label, show: !this.hidden.has(this.keys[series.length]), stroke: curve.edge ? stroke + "55" : stroke, width: curve.edge ? 0.6 : 1.4,
        dash: curve.dashed ? [6, 4] : curve.dotted ? [2, 2] : undefined, points: { show: false }, value: (_, value) => number(value, 5),
      });
    }
    this.plot = new uPlot({
      width: Math.max(host.clientWidth, 100), height, series, bands,
      scales: { x: { time: false }, y: { range: (u, low, high) => this.range(low, high) } },
      axes: [axis(2), axis(3, `${name} [${unit}]`)],
      cursor: { sync: { key: "time", scales: ["x", null] }, drag: { x: true, y: false, setScale: false }, hover: { skip: [undefined] }, points: { size: 5 } },
      legend: { markers: { width: 0, fill: (u, index) => u.series[index]._stroke || u.series[index].stroke() } },
      hooks: {
        draw: [u => this.marks(u), u => this.cursorLines(u)],
        setCursor: [u => { if (u.cursor.left >= 0) hover(u.posToVal(u.cursor.left, "x")); }],
        setSelect: [u => this.selected(u)],
        setSeries: [u => this.chosen(u)],
      },
    }, data, host);
    legend(this.plot);
    // Made anew, it is as the user left it: what is hidden, and where the keyboard is.
    if (focused) labels(this.plot)[this.keys.indexOf(focused)]?.focus({ preventScroll: true });
    const over = this.plot.over;
    over.addEventListener("dblclick", event => { event.stopImmediatePropagation(); this.spec.onAll(); }, true);
    over.addEventListener("mousedown", event => this.pan(event), true);
  }

  chosen(u) {
    this.keys.forEach((key, index) => {
      if (!key) return;
      if (u.series[index].show) this.hidden.delete(key);
      else this.hidden.add(key);
    });
    said(u);
  }

  range(low, high) {
    const all = [low, high, ...this.levels.map(it => it.value)].filter(it => it !== null && isFinite(it));
    if (!all.length) return [0, 1];
    const [least, most] = [Math.min(...all), Math.max(...all)];
    const margin = (most - least || Math.abs(most) || 1) * 0.06;
    return [least - margin, most + margin];
  }

  selected(u) {
    if (u.select.width < 4) return;
    const [from, to] = [u.select.left, u.select.left + u.select.width].map(at => u.posToVal(at, "x"));
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    this.spec.onWindow(from, to);
  }

  // With shift the time is dragged along.
  pan(event) {
    if (!event.shiftKey || event.button !== 0) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    const { min, max } = this.plot.scales.x;
    const perPixel = (max - min) / this.plot.over.clientWidth;
    const begun = event.clientX;
    const move = at => this.spec.onWindow(min - (at.clientX - begun) * perPixel, max - (at.clientX - begun) * perPixel);
    const end = () => {
      removeEventListener("mousemove", move);
      removeEventListener("mouseup", end);
    };
    addEventListener("mousemove", move);
    addEventListener("mouseup", end);
  }

  marks(u) {
    const { ctx, bbox } = u;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.font = 11 * ratio + "px system-ui, sans-serif";
    ctx.textAlign = "left";
    let said = -Infinity;
    for (const { code, from, to } of this.bands) {
      const left = u.valToPos(from, "x", true);
      const width = Math.max(u.valToPos(to, "x", true) - left, 1.5 * ratio);
      if (left + width < bbox.left || left > bbox.left + bbox.width) continue;
      ctx.fillStyle = ink("warning") + "38";
      ctx.fillRect(left, bbox.top, width, bbox.height);
      const at = Math.max(left, bbox.left) + 3 * ratio;
      if (at < said) continue;
      ctx.fillStyle = ink("soft");
      ctx.fillText(code.replaceAll("_", " "), at, bbox.top + 12 * ratio);
      said = at + ctx.measureText(code).width + 8 * ratio;
    }
    ctx.fillStyle = ink("soft");
    ctx.textAlign = "right";
    for (const { label, value } of this.levels) {
      const y = u.valToPos(value, "y", true);
      ctx.strokeStyle = ink("soft");
      ctx.lineWidth = ratio;
      ctx.setLineDash([5 * ratio, 4 * ratio]);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
      if (!label) continue;
      // Beneath its line where there is no room above; readable over a curve, too.
      const above = y - bbox.top > ROOM * ratio;
      const place = [label, bbox.left + bbox.width - 4 * ratio, above ? y - 4 * ratio : y + 12 * ratio];
      ctx.setLineDash([]);
      ctx.lineWidth = 3 * ratio;
      ctx.strokeStyle = ink("paper");
      ctx.strokeText(...place);
      ctx.fillText(...place);
    }
    ctx.restore();
  }

  cursorLines(u) {
    const { ctx, bbox } = u;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.font = "bold " + 11 * ratio + "px system-ui, sans-serif";
    [ctx.strokeStyle, ctx.fillStyle, ctx.lineWidth, ctx.textAlign] = [ink("ink"), ink("ink"), ratio, "left"];
    for (const { label, at } of cursors()) {
      const left = u.valToPos(at, "x", true);
      if (left < bbox.left || left > bbox.left + bbox.width) continue;
      ctx.beginPath();
      ctx.moveTo(left, bbox.top);
      ctx.lineTo(left, bbox.top + bbox.height);
      ctx.stroke();
      ctx.fillText(label, left + 3 * ratio, bbox.top + bbox.height - 4 * ratio);
    }
    ctx.restore();
  }

  redraw() {
    this.plot?.redraw(false);
  }

  resize() {
    if (this.plot && this.spec.host.clientWidth) this.plot.setSize({ width: this.spec.host.clientWidth, height: this.spec.height });
  }

  get pixels() {
    return Math.max(Math.round(this.spec.host.clientWidth - 80), 50);
  }

  destroy() {
    this.plot?.destroy();
  }
}
