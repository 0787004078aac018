// The server: what the page asks of it, and the desk as it last said it.

const listeners = [];
const progress = [];
const underWay = new Map();
const GONE = "The server does not answer: has rotorbench workbench ended?";
let revision = -1;
let heardLast = null;
let reading = Promise.resolve();
export let desk = null;

// Of what was found of each model, that of the one that is worked on; where it is not drawn, the first one's.
export const ofChosen = each => each.find(it => it.model === desk?.chosen) ?? each[0];

// `hear` is called with each new desk.
export function onDesk(hear) {
  listeners.push(hear);
}

// `hear` is called while something goes on.
export function onTick(hear) {
  progress.push(hear);
}

// Whatever breaks on the way, nobody answers: each browser has other words for it.
async function reached(asked) {
  try {
    return await asked;
  } catch {
    throw new Error(GONE);
  }
}

async function answered(asked) {
  const response = await reached(asked);
  if (!response.ok) throw new Error((await reached(response.json())).error);
  return response;
}

// `signal` calls it off.
export async function get(path, query = {}, signal) {
  const said = new URLSearchParams(Object.entries(query).filter(([, value]) => value !== undefined));
  return await reached((await answered(fetch(path + "?" + said, { signal }))).json());
}

// Asks for a change; what is refused is shown. It ends when the desk shows the change; the same that is asked for meanwhile is
// not asked for twice.
export function act(name, fields = {}) {
  const body = JSON.stringify({ act: name, ...fields });
  if (!underWay.has(body)) underWay.set(body, change(body).finally(() => underWay.delete(body)));
  return underWay.get(body);
}

async function change(body) {
  try {
    await answered(fetch("api/act", { method: "POST", body }));
    await read();
    return true;
  } catch (error) {
    complain(error.message);
    return false;
  }
}

export function complain(text) {
  document.dispatchEvent(new CustomEvent("complaint", { detail: text }));
}

// Lets the browser save what the server makes.
export async function save(query) {
  try {
    const response = await answered(fetch("api/export?" + new URLSearchParams(query)));
    const name = /filename="([^"]*)"/.exec(response.headers.get("content-disposition"))[1];
    saveBlob(await reached(response.blob()), name);
  } catch (error) {
    complain(error.message);
  }
}

export function saveBlob(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

// A panel that cannot be drawn is no reason to leave the others as they were.
function tell(all, said) {
  for (const hear of all) {
    try { hear(said); } catch (error) { reportError(error); }
  }
}

// A button that is pressed before the desk is read again does what the page shows: its search has ended, or has begun.
function catchUp() {
  if (heardLast?.revision > desk.tick.revision) desk.tick.search = heardLast.search;
}

// One after the other: an older desk never takes the place of a newer one.
function read() {
  reading = reading.catch(() => {}).then(async () => {
    desk = await get("api/desk");
    revision = desk.tick.revision;
    catchUp();
    tell(listeners, desk);
    tell(progress, desk.tick);
  });
  return reading;
}

// Hears of changes while the page is seen: a browser has six connections to a server for all tabs together, and this holds one.
// When the server has gone the browser tries again by itself.
export async function begin() {
  await read();
  let [events, newest, isReading] = [null, -1, false];
  const heard = async message => {
    const tick = JSON.parse(message.data);
    heardLast = tick;
    catchUp();
    tell(progress, tick);
    newest = tick.revision;
    if (isReading) return;
    isReading = true;
    // What changed while the desk was on its way is read too: nobody says it a second time.
    try {
      while (newest > revision) await read();
    } catch {
      tell(progress, null);
    } finally {
      isReading = false;
    }
  };
  const listen = () => {
    events?.close();
    events = document.hidden ? null : new EventSource("api/events");
    if (!events) return;
    events.onmessage = heard;
    events.onerror = () => tell(progress, null);
  };
  document.addEventListener("visibilitychange", () => {
    // What was not heard meanwhile: the first message has the desk read.
    revision = -1;
    listen();
  });
  listen();
}
