// Plots as a drawing (SVG), one beneath the other: what uPlot has drawn, as lines and text that can be enlarged and edited.

import { ROOM } from "./charts.js";
import { cursors } from "./cursors.js";

const SVG = "http://www.w3.org/2000/svg";
const FONT = "system-ui, sans-serif";
// Room for a legend above each plot, and for the name of its axis beneath.
const [LEGEND, NAME] = [20, 12];
// From one row of a legend to the next, and from one name to the next in it.
const [ROW, APART] = [16, 14];
const pen = document.createElement("canvas").getContext("2d");

// Text goes in as text, never as markup.
function node(name, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) if (value !== undefined) made.setAttribute(key, value);
  made.append(...children.flat());
  return made;
}

const line = (x1, y1, x2, y2, stroke, more = {}) => node("line", { x1, y1, x2, y2, stroke, ...more });
const label = (x, y, said, fill, more = {}) => node("text", { x, y, fill, "font-size": 11, ...more }, said);
const short = value => Number(value.toFixed(2));

// A curve's points; one that is `undefined` is drawn through, `null` is a gap.
function path(u, index) {
  const [x, y] = [u.data[0], u.data[index]];
  let [said, pen] = ["", "M"];
  for (let slot = 0; slot < x.length; slot++) {
    if (y[slot] === null) pen = "M";
    if (y[slot] === null || y[slot] === undefined) continue;
    said += `${pen}${short(u.valToPos(x[slot], "x"))} ${short(u.valToPos(y[slot], "y"))}`;
    pen = "L";
  }
  return said;
}

// Where both edges of a band are known.
function area(u, [upper, lower]) {
  const x = u.data[0];
  const slots = [...x.keys()].filter(slot => Number.isFinite(u.data[upper][slot]) && Number.isFinite(u.data[lower][slot]));
  const at = (slot, index) => `${short(u.valToPos(x[slot], "x"))},${short(u.valToPos(u.data[index][slot], "y"))}`;
  return [...slots.map(slot => at(slot, upper)), ...slots.reverse().map(slot => at(slot, lower))].join(" ");
}

const strokeOf = series => series._stroke || series.stroke();

function axes(u, ink, width, height) {
  const [across, up] = u.axes;
  const parts = [];
  across._splits.forEach((value, index) => {
    const x = short(u.valToPos(value, "x"));
    parts.push(line(x, 0, x, height, ink("line")), label(x, height + 15, across._values[index] ?? "", ink("soft"), { "text-anchor": "middle" }));
  });
  up._splits.forEach((value, index) => {
    const y = short(u.valToPos(value, "y"));
    parts.push(line(0, y, width, y, ink("line")), label(-6, y + 4, up._values[index] ?? "", ink("soft"), { "text-anchor": "end" }));
  });
  parts.push(label(0, 0, up.label, ink("soft"), { "text-anchor": "middle", transform: `translate(-52 ${height / 2}) rotate(-90)` }));
  // Beneath its end, where no tick stands.
  parts.push(label(width, height + 28, "time [s]", ink("soft"), { "text-anchor": "end" }));
  return parts;
}

// The named curves in rows, each no wider than the plot.
function rowsOf(u) {
  pen.font = "11px " + FONT;
  const rows = [[]];
  let x = 0;
  for (const series of u.series.slice(1).filter(it => it.label && it.width >= 1)) {
    const wide = 20 + pen.measureText(series.label).width;
    if (x > 0 && x + wide > u.over.clientWidth) {
      rows.push([]);
      x = 0;
    }
    rows.at(-1).push({ series, x });
    x += wide + APART;
  }
  return rows;
}

function legend(rows, ink) {
  return rows.flatMap((row, index) => row.flatMap(({ series, x }) => {
    const y = -10 - ROW * (rows.length - 1 - index);
    return [line(x, y, x + 16, y, strokeOf(series), { "stroke-width": 2, "stroke-dasharray": series.dash?.join(" ") }), label(x + 20, y + 4, series.label, ink("ink"))];
  }));
}

function marks(u, { bands, levels }, ink, width, height) {
  const parts = [];
  for (const { code, from, to } of bands) {
    const [left, right] = [from, to].map(at => Math.min(Math.max(u.valToPos(at, "x"), 0), width));
    if (right <= left && (right === 0 || left === width)) continue;
    parts.push(node("rect", { x: short(left), y: 0, width: short(Math.max(right - left, 1.5)), height, fill: ink("warning"), "fill-opacity": 0.22 },
      node("title", {}, code.replaceAll("_", " "))));
  }
  for (const { label: said, value } of levels) {
    const y = short(u.valToPos(value, "y"));
    parts.push(line(0, y, width, y, ink("soft"), { "stroke-dasharray": "5 4" }), label(width - 4, y > ROOM ? y - 4 : y + 12, said || "", ink("soft"), { "text-anchor": "end", stroke: ink("paper"), "stroke-width": 3, "paint-order": "stroke" }));
  }
  for (const { label: said, at } of cursors()) {
    const x = short(u.valToPos(at, "x"));
    if (x >= 0 && x <= width) parts.push(line(x, 0, x, height, ink("ink")), label(x + 3, height - 4, said, ink("ink"), { "font-weight": "bold" }));
  }
  return parts;
}

// One plot, its upper left corner at `top`, beneath the rows of its legend.
function one(chart, rows, ink, top, number) {
  const u = chart.plot;
  const { clientWidth: width, clientHeight: height, offsetLeft, offsetTop } = u.over;
  const curves = u.series.slice(1).map((series, index) => node("path", {
    d: path(u, index + 1), fill: "none", stroke: strokeOf(series), "stroke-width": series.width, "stroke-dasharray": series.dash?.join(" "),
  }));
  const between = (u.bands || []).map(band => node("polygon", { points: area(u, band.series), fill: typeof band.fill === "function" ? band.fill(u) : band.fill }));
  const clip = node("clipPath", { id: "plot-" + number }, node("rect", { width, height }));
  return node("g", { transform: `translate(${offsetLeft || 60} ${top + (offsetTop || 0)})` }, clip, axes(u, ink, width, height), legend(rows, ink),
    node("g", { "clip-path": `url(#plot-${number})` }, between, curves, marks(u, chart, ink, width, height)));
}

// The plots of a figure, `title` above them; `ink` names the page's colours.
export function drawing(charts, title, ink) {
  const seen = charts.filter(chart => chart.plot);
  const width = Math.max(...seen.map(chart => chart.plot.width));
  let top = 24;
  const plots = seen.map((chart, number) => {
    const rows = rowsOf(chart.plot);
    top += LEGEND + ROW * (rows.length - 1);
    const made = one(chart, rows, ink, top, number);
    top += chart.plot.height + NAME;
    return made;
  });
  const root = node("svg", { width, height: top, viewBox: `0 0 ${width} ${top}`, "font-family": FONT },
    node("title", {}, title), node("rect", { width, height: top, fill: ink("paper") }), label(8, 16, title, ink("ink"), { "font-size": 13, "font-weight": "bold" }), plots);
  return new Blob([new XMLSerializer().serializeToString(root)], { type: "image/svg+xml" });
}

// The same as a picture (PNG) of twice as many points as it is wide.
export async function picture(lines) {
  const image = new Image();
  image.src = URL.createObjectURL(lines);
  await image.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [2 * image.width, 2 * image.height];
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  URL.revokeObjectURL(image.src);
  return await new Promise(done => canvas.toBlob(done, "image/png"));
}
