// The server: what the page asks of it, and the desk as it last said it.

const listeners = [];
const progress = [];
let revision = -1;
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

export async function get(path, query = {}) {
  const said = new URLSearchParams(Object.entries(query).filter(([, value]) => value !== undefined));
  const response = await fetch(path + "?" + said);
  const answer = await response.json();
  if (!response.ok) throw new Error(answer.error);
  return answer;
}

// Asks for a change; what is refused is shown.
export async function act(name, fields = {}) {
  try {
    const response = await fetch("/api/act", { method: "POST", body: JSON.stringify({ act: name, ...fields }) });
    if (response.ok) return true;
    complain((await response.json()).error);
  } catch {
    complain("The server does not answer: has rotorbench workbench ended?");
  }
  return false;
}

export function complain(text) {
  document.dispatchEvent(new CustomEvent("complaint", { detail: text }));
}

// Lets the browser save what the server makes.
export async function save(query) {
  const response = await fetch("/api/export?" + new URLSearchParams(query));
  if (!response.ok) return complain((await response.json()).error);
  const name = /filename="([^"]*)"/.exec(response.headers.get("content-disposition"))[1];
  saveBlob(await response.blob(), name);
}

export function saveBlob(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

async function read() {
  const fresh = await get("/api/desk");
  revision = fresh.tick.revision;
  desk = fresh;
  for (const hear of listeners) hear(desk);
  for (const hear of progress) hear(desk.tick);
}

// Hears of changes until the page is closed. When the server has gone the browser tries again by itself.
export async function begin() {
  await read();
  const events = new EventSource("/api/events");
  let [newest, isReading] = [-1, false];
  events.onmessage = async message => {
    const tick = JSON.parse(message.data);
    for (const hear of progress) hear(tick);
    newest = tick.revision;
    if (isReading) return;
    isReading = true;
    // What changed while the desk was on its way is read too: nobody says it a second time.
    try { while (newest > revision) await read(); } finally { isReading = false; }
  };
  events.onerror = () => { for (const hear of progress) hear(null); };
}
