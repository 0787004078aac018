// A file that is dragged into the page. A browser says its name and its length, not where it lies: it is looked for below the folders
// that were named when the workbench was opened.

import { act, complain, get } from "./act.js";
import { lastPart } from "./dom.js";
import { OTHER_FOLDER } from "./files.js";

// Folders that are looked through; what lies deeper is opened from the list. Of several files so many are named.
const MOST_FOLDERS = 300;
const MOST_NAMED = 4;

// Where files of this name and length lie, and the folders that were named.
async function places(file) {
  const found = new Set();
  // A link may lead to a folder above.
  const seen = new Set();
  const waiting = [undefined];
  let named = [];
  for (let looked = 0; waiting.length && looked < MOST_FOLDERS; looked += 1) {
    const { folder, folders, files } = await get("api/files", { folder: waiting.shift() });
    if (seen.has(folder)) continue;
    seen.add(folder);
    if (folder === "") named = folders;
    for (const it of files) if (lastPart(it.path) === file.name && it.bytes === file.size) found.add(it.path);
    waiting.push(...folders);
  }
  return { found: [...found], named };
}

async function open(file) {
  try {
    const { found, named } = await places(file);
    if (found.length === 1) {
      const [path] = found;
      return await (path.endsWith(".toml") ? act("open_model", { path }) : act("open_log", { path }));
    }
    const several = `There are ${found.length} files ${file.name} of this length: ${found.slice(0, MOST_NAMED).join(", ")}${found.length > MOST_NAMED ? ", ..." : ""}. Open the one that is meant from the list.`;
    const none = `${file.name} is not below what this workbench may open (${named.join(", ") || "no folder"}). ${OTHER_FOLDER}`;
    complain(found.length ? several : none);
  } catch (error) {
    complain(error.message);
  }
}

export function build() {
  const over = is => document.documentElement.classList.toggle("dropping", is);
  const holdsFiles = event => event.dataTransfer?.types.includes("Files");
  addEventListener("dragover", event => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    over(true);
  });
  addEventListener("dragleave", event => { if (!event.relatedTarget) over(false); });
  // A browser would leave the page, and show the file itself.
  addEventListener("drop", async event => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    over(false);
    for (const file of [...event.dataTransfer.files]) await open(file);
  });
}
