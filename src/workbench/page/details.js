// Where the error of a block lives: at rest and in motion, over frequency, and over the channels that it depends on.

import { complain, desk, get, ofChosen } from "./act.js";
import { colourOf } from "./charts.js";
import { element, fill, number, table } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT, LEFT, BOTTOM] = [440, 150, 52, 20];

function shape(tag, properties, text) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(properties)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

// A small drawing of curves that are few points: [{ tone, points: [[x, y], ...] }].
export function drawing(title, curves, { log = false } = {}) {
  const scale = log ? Math.log10 : value => value;
  const back = log ? value => 10 ** value : value => value;
  const points = curves.map(curve => curve.points.filter(([x, y]) => isFinite(y) && (!log || (x > 0 && y > 0))).map(([x, y]) => [scale(x), scale(y)]));
  const every = points.flat();
  if (!every.length) return null;
  const ends = place => [Math.min(...every.map(it => it[place])), Math.max(...every.map(it => it[place]))];
  const [[left, right], [low, high]] = [ends(0), ends(1)];
  const x = value => LEFT + (value - left) / (right - left || 1) * (WIDTH - LEFT - 8);
  const y = value => HEIGHT - BOTTOM - (value - low) / (high - low || 1) * (HEIGHT - BOTTOM - 8);
  const svg = shape("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": title, class: "drawing" });
  svg.append(shape("text", { x: LEFT, y: HEIGHT - 5 }, number(back(left), 3)), shape("text", { x: WIDTH - 8, y: HEIGHT - 5, class: "end" }, number(back(right), 3)),
    shape("text", { x: LEFT - 4, y: y(low), class: "end" }, number(back(low), 2)), shape("text", { x: LEFT - 4, y: y(high) + 9, class: "end" }, number(back(high), 2)));
  points.forEach((line, index) => svg.append(shape("polyline", { class: "stroke " + curves[index].tone, points: line.map(([a, b]) => `${x(a).toFixed(1)},${y(b).toFixed(1)}`).join(" ") })));
  return element("figure", { class: "small" }, element("figcaption", {}, title), svg);
}

function content(found) {
  const overTime = found.map(it => ({ tone: colourOf(it.model), points: it.over_time }));
  const spectra = found.filter(it => it.spectrum).map(it => ({ tone: colourOf(it.model), points: it.spectrum.density }));
  const first = ofChosen(found);
  const name = desk.models.find(it => it.id === first.model)?.name || "";
  const of = first.dependences.slice(0, 3).map(dependence => {
    const curves = found.map(it => ({ tone: colourOf(it.model), points: it.dependences.find(other => other.on === dependence.on)?.curve || [] }));
    const unit = dependence.unit ? ` [${dependence.unit}]` : "";
    return drawing(`Mean ${first.of} [${first.of_unit}] over ${dependence.on}${unit}: explains ${number(100 * dependence.explained, 2)} % of it`, curves);
  });
  const groups = table(["modelled signal", "samples", `rms [${first.unit}]`, "share of squared error"],
    first.groups.map(it => [it.name, String(it.samples), number(it.rms, 3), number(100 * it.share, 3) + " %"]));
  const swatch = element("span", { class: "swatch " + colourOf(first.model), "aria-hidden": "true" });
  return [
    element("p", { class: "soft", "data-table-of": name }, swatch, name),
    groups,
    drawing(`Error over time [s], rms in ${first.unit}`, overTime),
    spectra.length && drawing(`Error over frequency [Hz], in ${first.unit}/√Hz`, spectra, { log: true }),
    of,
  ];
}

// A fold that asks for it when it is opened.
export function details(log, block) {
  const host = element("div", {});
  const fold = element("details", {
    "data-key": `details ${log} ${block.name} ${block.signal}`,
    ontoggle: async () => {
      if (!fold.open) return;
      try {
        fill(host, content(await get("api/failure", { log, block: block.name, signal: block.signal })));
      } catch (error) {
        complain(error.message);
      }
    },
  }, element("summary", { "aria-label": `${block.name}, ${block.signal}: by time, frequency and operating point` }, "by time, frequency and operating point"), host);
  return fold;
}
