// The dialog that finds a file below the folders that were named when the workbench was opened.

import { complain, get } from "./act.js";
import { button, element, fill, lastPart } from "./dom.js";

// How more than what was named is opened.
export const OTHER_FOLDER = "Another folder: end the workbench, and name it: rotorbench workbench FOLDER or FILE";

const size = bytes => (bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`);

// Calls `open` with the path of the file that is chosen; `more` stands above the list.
export async function choose(title, open, more) {
  const dialog = document.getElementById("files");
  const go = async folder => {
    let listing;
    try {
      listing = await get("api/files", { folder });
    } catch (error) {
      return complain(error.message);
    }
    const up = listing.folder !== "" && button("← " + (listing.above ? lastPart(listing.above) : "all folders"), () => go(listing.above || undefined));
    const pick = path => {
      dialog.close();
      open(path);
    };
    const name = path => (listing.folder === "" ? path : lastPart(path));
    fill(dialog,
      element("h2", { id: "files-title" }, title),
      element("p", { class: "soft" }, listing.folder || "Folders that were named when the workbench was opened:"),
      more,
      element("p", { class: "soft" }, OTHER_FOLDER),
      element("div", { class: "files" }, up,
        listing.folders.map(path => button(name(path) + "/", () => go(path))),
        listing.files.map(file => button(`${name(file.path)}  (${size(file.bytes)})`, () => pick(file.path), { "data-path": file.path }))),
      listing.has_more && element("p", { class: "soft" }, "There are more files than are listed here."),
      button("Close", () => dialog.close()));
    if (!dialog.open) dialog.showModal();
  };
  await go(undefined);
}
