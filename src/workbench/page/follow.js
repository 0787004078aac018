// Logs that are being written: read again every two seconds, as long as the page is looked at.

import { act, desk, onDesk } from "./act.js";

const EVERY_MS = 2000;
const followed = new Set();
const listeners = [];

export const isFollowed = id => followed.has(id);
export const onFollowed = hear => listeners.push(hear);

export function follow(id, wanted) {
  if (wanted) followed.add(id);
  else followed.delete(id);
  for (const hear of listeners) hear(desk);
}

async function look() {
  if (document.hidden) return;
  for (const id of [...followed]) {
    // A server that has gone is said once.
    if (!(await act("reread", { log: id }))) follow(id, false);
  }
}

export function build() {
  onDesk(() => { for (const id of followed) if (!desk.logs.some(it => it.id === id)) followed.delete(id); });
  setInterval(look, EVERY_MS);
}
