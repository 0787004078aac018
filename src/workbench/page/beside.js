// Other logs drawn over the one that is shown, as if they had begun with it, each in its own colour.

import { desk, get, onDesk } from "./act.js";
import { lastPart } from "./dom.js";

const beside = new Set();
const listeners = [];

export const isBeside = id => beside.has(id);
export const onBeside = hear => listeners.push(hear);

export function putBeside(id, wanted) {
  if (wanted) beside.add(id);
  else beside.delete(id);
  for (const hear of listeners) hear(desk);
}

// The name of a log's colour where it is drawn over another one, dotted; models have theirs from the other end.
export function colourOfLog(id) {
  const index = desk.logs.findIndex(it => it.id === id);
  return "next-" + (7 - (Math.max(index, 0) % 8));
}

// The curves of a channel of the other logs, over the time of the one that is shown.
export async function others(shown, channel, [from, to], pixels, signal) {
  const begin = desk.logs.find(it => it.id === shown)?.ends_s?.[0] ?? 0;
  const has = log => log.channels?.some(it => it.name === channel);
  const logs = desk.logs.filter(it => it.id !== shown && beside.has(it.id) && it.state === "open" && has(it));
  return await Promise.all(logs.map(async log => {
    const late = log.ends_s[0] - begin;
    const { x, curves } = await get("api/plot", { log: log.id, from: from + late, to: to + late, pixels, channel }, signal);
    return { ...curves[0], x: x.map(at => at - late), label: lastPart(log.name), tone: colourOfLog(log.id), dotted: true };
  }));
}

export function build() {
  onDesk(() => { for (const id of beside) if (!desk.logs.some(it => it.id === id)) beside.delete(id); });
}
