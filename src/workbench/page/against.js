// An error, or the torque that a model lacks, over any channel: the mean of equally many samples, and a band about it.

import { complain, desk, get } from "./act.js";
import { colourOf } from "./charts.js";
import { drawing } from "./details.js";
import { element, fill } from "./dom.js";

// Which channel was chosen for which plot: plots are made anew when a model is shown.
const chosen = new Map();

function content(found, channel, what) {
  const [first] = found;
  if (!first?.places.length) return element("p", { class: "soft" }, "No sample has both.");
  const line = (it, tone, of) => ({ tone, points: it.places.map(place => [place.at, of(place)]) });
  const curves = found.flatMap(it => {
    const tone = colourOf(it.model);
    return [line(it, tone + " edge", place => place.mean - place.band), line(it, tone + " edge", place => place.mean + place.band), line(it, tone, place => place.mean)];
  });
  const names = found.map(it => [element("span", { class: "swatch " + colourOf(it.model), "aria-hidden": "true" }), desk.models.find(model => model.id === it.model)?.name || "", " "]);
  const unit = first.channel_unit ? ` [${first.channel_unit}]` : "";
  const band = what === "unknown torque" ? "its standard error" : "the standard deviation of its samples";
  return [drawing(`Mean ${what} [${first.unit}] over ${channel}${unit}, and ${band} to both sides`, curves), element("p", { class: "soft" }, names)];
}

// A choice of channel, and what it shows; `what` says what is drawn.
export function against(log, query, what, channels) {
  const host = element("div", { class: "against" });
  const key = JSON.stringify([log, query]);
  const show = async channel => {
    chosen.set(key, channel);
    if (!channel) return host.replaceChildren();
    try {
      fill(host, content(await get("api/against", { log, ...query, channel }), channel, what));
    } catch (error) {
      complain(error.message);
    }
  };
  const label = `${what} of ${query.block} ${query.signal} against a channel`;
  const options = channels.map(it => element("option", { value: it.name, selected: chosen.get(key) === it.name }, it.name));
  const pick = element("select", { "aria-label": label, "data-key": label, onchange: event => show(event.target.value) },
    element("option", { value: "" }, `${what} against ...`), options);
  if (chosen.get(key)) show(chosen.get(key));
  return element("div", {}, pick, host);
}
