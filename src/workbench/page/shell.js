// The commands that do by hand what was done here, in their order.

import { onDesk } from "./act.js";
import { button, command, element, fill } from "./dom.js";

export function build(at) {
  onDesk(desk => {
    const all = () => navigator.clipboard.writeText(desk.done.join("\n") + "\n");
    fill(at("shell"), element("div", { class: "row" }, element("h2", {}, "The same by hand"),
      desk.done.length > 1 && button("copy all", all, { class: "quiet" })),
      element("p", { class: "soft" }, "These commands, in this order, do what was done here and say the same numbers."),
      desk.done.length ? element("ol", { class: "commands" }, desk.done.map(it => element("li", {}, command(it)))) : element("p", {}, "Nothing yet."));
  });
}
