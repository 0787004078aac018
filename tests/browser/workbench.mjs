// The workbench in a real browser: the whole circle, clicked; each number beside what the commands by hand say.
//
//     node tests/browser/workbench.mjs PROGRAM CHROMIUM PICTURES
//
// `tools/browser` calls it with all three. It waits for states of the page, never for times.

import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { createRequire } from "node:module";

const [program, chromium, pictures] = process.argv.slice(2);
const { chromium: driver } = createRequire(join(process.env.PLAYWRIGHT, "package.json"))("playwright-core");
const PATIENCE = 120_000;
const folder = mkdtempSync(join(tmpdir(), "rotorbench-browser-"));
const complaints = [];
let running = null;

function check(holds, what) {
  if (!holds) throw new Error(what);
}
const step = text => console.log("browser: " + text);

// A workbench with these arguments, and its address.
const start = (...given) => begin(["--no-open", ...given], process.env);
async function begin(given, env) {
  await page.goto("about:blank");
  running?.kill("SIGINT");
  running = spawn(program, ["workbench", ...given], { cwd: folder, env, stdio: ["ignore", "pipe", "inherit"] });
  return await new Promise((found, failed) => {
    let said = "";
    running.stdout.on("data", bytes => { said += bytes; if (said.includes("\n")) found(said.trim()); });
    running.on("exit", code => failed(new Error("the workbench ended with " + code)));
  });
}

const options = process.getuid() === 0 ? ["--no-sandbox"] : [];
const browser = await driver.launch({ executablePath: chromium, args: options });
const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, permissions: ["clipboard-read", "clipboard-write"], acceptDownloads: true });
context.setDefaultTimeout(PATIENCE);
const page = await context.newPage();
page.on("console", message => { if (["error", "warning"].includes(message.type())) complaints.push(`console: ${message.text()} ${message.location().url}`); });
page.on("pageerror", error => complaints.push("page: " + error.message));
page.on("request", request => { if (!/^(about:|http:\/\/127\.0\.0\.1:|data:|blob:)/.test(request.url()) && !request.url().startsWith("file://" + folder)) complaints.push("asked for " + request.url()); });

const picture = name => page.screenshot({ path: join(pictures, name + ".png") });
const drawn = () => page.locator("figure[data-block=body][data-drawn]").first().waitFor();
const texts = selector => page.locator(selector).allTextContents();

// The file that a click lets the browser save.
async function saved(click, name) {
  const [download] = await Promise.all([page.waitForEvent("download"), click()]);
  check(download.suggestedFilename() === name, `saved as ${download.suggestedFilename()}, not ${name}`);
  return readFileSync(await download.path());
}

// The commands of the page, by hand in a folder of their own; `more` is added to the last one, whose standard output it returns.
function byHand(commands, own, more) {
  let said = "";
  commands.forEach((command, index) => {
    const last = index === commands.length - 1 ? " " + more : "";
    try {
      said = execFileSync("sh", ["-c", command.replace(/^rotorbench /, `exec "${program}" `) + last], { cwd: own, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
    } catch (error) {
      // 1: found wanting, as it should be.
      if (error.status !== 1) throw new Error(`${command}: ${error.stderr}`);
      said = error.stdout;
    }
  });
  return said;
}

async function demo() {
  step("the demonstration: the error by name");
  const began = Date.now();
  await page.goto(await start());
  await page.locator("figure[data-drawn]").first().waitFor();
  step(`first plot after ${Date.now() - began} ms, the demonstration's flights among them`);
  check(!page.url().includes("token"), "the token stays in the address");
  await drawn();
  const first = page.locator("figure[data-block]").first();
  const error = Number(await first.locator("[data-error-of=paper] .number").getAttribute("data-value"));
  check(error > 0, "an error in view");
  const wide = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
  check(!wide, "at 1280 x 720 the page is wider than the window");
  await picture("1-error");
}

async function opened() {
  step("opened by the desktop: nothing that leads in is seen by others");
  mkdirSync(join(folder, "bin"));
  const said = join(folder, "bin", "said");
  writeFileSync(join(folder, "bin", "xdg-open"), `#!/bin/sh\nprintf '%s\\n' "$@" >'${said}.new'\nmv '${said}.new' '${said}'\n`, { mode: 0o755 });
  const address = await begin([], { ...process.env, HOME: folder, PATH: join(folder, "bin") + ":" + process.env.PATH });
  while (!existsSync(said)) await page.waitForTimeout(20);
  const [file, ...more] = readFileSync(said, "utf8").trimEnd().split("\n");
  const token = address.split("token=")[1];
  check(more.length === 0 && !file.includes(token), "the token is among the browser's arguments: " + file);
  check(file.startsWith(folder) && (statSync(file).mode & 0o777) === 0o600 && (statSync(dirname(file)).mode & 0o777) === 0o700, file + " is its user's alone");
  await context.clearCookies();
  await page.goto("file://" + file);
  await page.locator("figure[data-drawn]").first().waitFor();
  check(!page.url().includes("token"), "the token stays in the address");
  check(!existsSync(dirname(file)), "it is gone when it was used");
  await drawn();
}

async function names() {
  step("names of all controls, and the keys");
  const bare = await page.evaluate(() => [...document.querySelectorAll("button, select, input, summary")]
    .filter(it => !(it.getAttribute("aria-label") || it.textContent.trim())).map(it => it.outerHTML));
  check(bare.length === 0, "controls without a name: " + bare.join(" "));
  const [rate, error] = await page.locator("figure[data-block=body] canvas").evaluateAll(all => all.map(it => `${it.getAttribute("role")}: ${it.getAttribute("aria-label")}`));
  check(/^img: body_rate_rad_s \[rad\/s\] from 0 to [0-9.]+ s\. measured: mean .*, 999 samples\. paper: mean/.test(rate), "a plot in words: " + rate);
  check(/^img: error \[rad\/s\] .*paper: mean/.test(error), "its error in words: " + error);
  const low = await page.locator(".chart").evaluateAll(all => all.filter(it => !(parseFloat(getComputedStyle(it).minHeight) > 100)).length);
  check(low === 0, `${low} plots have no room before they are drawn`);
  const fold = page.locator("#models summary").first();
  for (const is of ["true", "false"]) {
    await fold.click();
    await page.locator("#models summary").first().and(page.locator(`[aria-expanded=${is}]`)).waitFor();
  }
  await page.keyboard.press("?");
  await page.locator("dialog#keys[open]").waitFor();
  await picture("2-keys");
  await page.keyboard.press("Escape");
  await page.locator("dialog#keys").waitFor({ state: "hidden" });
  const whole = await page.locator("figure").first().getAttribute("data-drawn");
  await page.keyboard.press("w");
  await page.waitForFunction(before => document.querySelector("figure").dataset.drawn !== before, whole);
  await page.keyboard.press("a");
  await page.waitForFunction(before => document.querySelector("figure").dataset.drawn === before, whole);
}

async function looks() {
  step("the error over time and frequency, the unknown torque over a channel, another log over this one");
  // The first log that was open is shown: on a busy machine that may be either.
  await page.getByLabel("show rotorbench-demo/held_out.csv", { exact: true }).click();
  const body = page.locator("figure[data-block=body]").first();
  await body.getByText("by time, frequency and operating point").click();
  await body.getByRole("img", { name: /^Error over time/ }).waitFor();
  await body.getByRole("img", { name: /^Error over frequency/ }).waitFor();
  await picture("2-where");
  const torque = page.locator("figure", { has: page.getByRole("heading", { name: "Unknown torque" }) });
  await torque.getByLabel(/against a channel/).selectOption("body_angle_rad");
  const drawing = torque.getByRole("img", { name: /over body_angle_rad/ });
  await drawing.waitFor();
  // Its mean and both edges of its band, over twenty parts of the channel or so.
  const points = await drawing.locator("polyline").evaluateAll(all => all.map(it => it.getAttribute("points").split(" ").length));
  check(points.length === 3 && points.every(it => it > 15), "unknown torque over a channel: " + points);
  await torque.scrollIntoViewIfNeeded();
  await picture("2-torque-over-angle");
  await page.getByLabel("draw over the log that is shown: rotorbench-demo/train.csv").check();
  // Only what is seen is drawn.
  await body.evaluate(it => it.scrollIntoView());
  await body.locator(".u-legend").first().getByText("train.csv").waitFor();
  await picture("2-two-logs");
  await page.getByLabel("draw over the log that is shown: rotorbench-demo/train.csv").uncheck();
  await body.locator(".u-legend").first().getByText("train.csv").waitFor({ state: "detached" });
}

async function ask() {
  step("what is missing");
  // What was fitted so far is shown while it searches, and gone with the answer.
  await page.evaluate(() => new MutationObserver(() => {
    window.saw ||= document.querySelector("#ask .tried")?.rows.length;
    window.told = [...new Set([...(window.told || []), document.querySelector("#ask [role=status]").textContent])];
  })
    .observe(document.querySelector("#ask"), { childList: true, subtree: true }));
  await page.getByRole("button", { name: "What is missing?" }).click();
  await page.locator("#verdict[data-verdict=missing_effect]").waitFor();
  check(await page.evaluate(() => window.saw) > 1, "candidates are shown as they are fitted");
  const told = (await page.evaluate(() => window.told)).filter(Boolean);
  check(told[0] === "Searching for what is missing" && told.at(-1).endsWith("done."), "what a screen reader is told: " + told);
  await picture("3-answer");
  const fall = await page.locator("#fall [data-is]").evaluateAll(all => all.map(it => Number(it.dataset.value)));
  check(fall[1] < fall[0] / 2 && fall[2] > 50 && fall[2] <= 100, "the fall of the error beside the verdict: " + fall);
  const next = await page.locator(".next code").first().textContent();
  check(/^rotorbench extend .* -o extended\.toml$/.test(next), "what to do next: " + next);
  step("the card of a candidate");
  const named = page.locator(".candidates summary").first();
  // A card goes when its list moves, and the last of a scroll is heard a frame later.
  await named.scrollIntoViewIfNeeded();
  await page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));
  await named.hover();
  const card = page.getByRole("tooltip");
  await card.waitFor();
  check((await card.textContent()).includes(await named.textContent()), "the card is of another effect");
  await picture("3-card");
  await page.mouse.move(500, 300);
  await card.waitFor({ state: "hidden" });
  const effect = await page.locator("button[data-add]").first().getAttribute("data-add");
  step("tried before it is added: " + effect);
  await page.getByRole("button", { name: "try " + effect }).click();
  await page.getByText("(tried)").waitFor();
  await page.locator("[data-error-of=step-1]").first().waitFor();
  check(await page.locator("[data-rung]").count() === 0, "what is tried is not added");
  return effect;
}

async function add(effect) {
  step("added, and beside the commands by hand");
  await page.locator(`button[data-add="${effect}"]`).first().click();
  const rung = page.locator(`[data-rung="${effect}"]`);
  await rung.waitFor();
  await page.locator("[data-error-of=step-1]").first().waitFor();
  await drawn();
  // These two are shown to newcomers: the block with its errors in the middle, the verdict beside it.
  for (const id of ["#middle", "#right"]) await page.locator(id).evaluate(it => { it.scrollTop = 0; });
  await picture("4-added-light");
  await page.emulateMedia({ colorScheme: "dark" });
  await page.locator("figure[data-block=body][data-scheme=dark]").first().waitFor();
  await picture("4-added-dark");
  await page.emulateMedia({ colorScheme: "light" });
  await page.locator("figure[data-block=body][data-scheme=light]").first().waitFor();
  check(await rung.locator("table .number").count() > 0, "the rung has its numbers beside it");
  const after = rung.locator("[data-is=after]");
  const [shown, text] = [await after.getAttribute("data-value"), await after.textContent()];
  const commands = await texts("#shell .commands code");
  const own = join(folder, "by hand");
  execFileSync("mkdir", ["-p", join(own, "rotorbench-demo")]);
  const said = JSON.parse(byHand(commands, own, "--json"));
  check(shown === String(said.error.extended.validate), `the page says ${shown}, extend --json ${said.error.extended.validate}`);
  check(text === String(Number(said.error.extended.validate.toPrecision(4))), `${text} is not its rounding`);
  check(said.error.extended.validate < said.error.base.validate / 2, "the error has fallen");
  for (const log of ["train.csv", "held_out.csv"]) {
    check(readFileSync(join(folder, "rotorbench-demo", log)).equals(readFileSync(join(own, "rotorbench-demo", log))), log + " is another by hand");
  }
  const model = await saved(() => page.getByRole("button", { name: "save model step-1" }).click(), "step-1.toml");
  check(model.equals(readFileSync(join(own, "step-1.toml"))), "the model's file is another by hand");
  const errors = page.locator("figure[data-block]").first().locator(".errors .number");
  const [from, to] = await errors.evaluateAll(all => all.map(it => Number(it.dataset.value)));
  check(to < from / 2, `in view the error falls from ${from} to ${to}`);
  step("margins of the controller");
  const fold = page.locator("li[data-model]", { hasText: "step-1" }).locator("details", { hasText: "margins of the controller" }).first();
  await fold.locator("summary").click();
  const bandwidth = await fold.locator("tr", { hasText: "bandwidth" }).locator(".number").getAttribute("data-value");
  const { margins } = JSON.parse(execFileSync(program, ["design", "--model", "step-1.toml", "--json"], { cwd: own }));
  check(bandwidth === String(margins.bandwidth_rad_s), `the page says a bandwidth of ${bandwidth}, design --json ${margins.bandwidth_rad_s}`);
  await picture("4-margins");
}

async function exported() {
  step("report, signals and picture");
  const report = await saved(() => page.getByRole("button", { name: /save the report/ }).click(), "held_out.html");
  check(report.includes("step-1"), "the report names the model");
  const signals = await saved(() => page.getByRole("button", { name: /save the signals/ }).click(), "held_out_signals.csv");
  // Both models are drawn, and each has columns of its own.
  for (const model of ["paper", "step-1"]) check(signals.includes(model + ".modelled_body"), "the signals have those of " + model);
  const rowsOf = text => String(text).trimEnd().split("\n").length - 1;
  await page.keyboard.press("+");
  const seen = await saved(() => page.getByRole("button", { name: /save the signals/ }).click(), "held_out_signals.csv");
  check(Math.abs(rowsOf(seen) / rowsOf(signals) - 0.5) < 0.01, `of half of the time ${rowsOf(seen)} of ${rowsOf(signals)} rows`);
  await page.keyboard.press("a");
  step("failure tables of the model that is worked on");
  const fold = page.locator("figure[data-block=body]").first();
  // What was open stays open when the plots are made anew.
  await fold.locator("details", { hasText: "by time, frequency" }).first().evaluate(it => { it.open = true; });
  await fold.locator("[data-table-of=step-1]").waitFor();
  await page.getByRole("button", { name: "work on paper" }).click();
  await page.getByText("Ladder of paper").waitFor();
  await fold.locator("[data-table-of=paper]").waitFor();
  await picture("4-failure-of-paper");
  await page.getByRole("button", { name: "work on step-1" }).click();
  await page.getByText("Ladder of step-1").waitFor();
  const drawn = await saved(() => page.getByRole("button", { name: /save a picture/ }).first().click(), "plot.png");
  check(drawn.subarray(1, 4).toString() === "PNG", "a picture");
  writeFileSync(join(pictures, "plot.png"), drawn);
  const lines = String(await saved(() => page.getByRole("button", { name: /save a drawing/ }).first().click(), "plot.svg"));
  writeFileSync(join(pictures, "plot.svg"), lines);
  check(lines.startsWith("<svg") && !/NaN|undefined|Infinity/.test(lines), "a drawing without a hole in its numbers");
  const [points, unit] = [(lines.match(/L-?[0-9]/g) || []).length, /rad\/s\]/.test(lines)];
  check(points > 500 && unit && lines.includes("measured"), `a drawing of ${points} points, with its unit and legend`);
  check(lines.split("time [s]").length === 3 && lines.includes("error [rad/s]"), "both plots of it, with the names of their axes");
  // The picture is that drawing, twice as wide and high.
  const size = ["width", "height"].map(name => 2 * Math.round(Number(new RegExp(` ${name}="([0-9.]+)"`).exec(lines)[1])));
  check(drawn.readUInt32BE(16) === size[0] && drawn.readUInt32BE(20) === size[1], `a picture of ${drawn.readUInt32BE(16)} x ${drawn.readUInt32BE(20)}, not ${size}`);
}

async function back() {
  step("a step back, and the session again");
  await page.getByRole("button", { name: "Step back" }).click();
  await page.getByText("Nothing was added to it.").waitFor();
  await page.locator("[data-error-of=step-2]").first().waitFor();
  await drawn();
  await picture("5-step-back");
  await page.getByRole("button", { name: "work on step-1" }).click();
  await page.locator("[data-rung]").first().waitFor();
  const session = await saved(() => page.getByRole("button", { name: "Save session" }).click(), "session.toml");
  writeFileSync(join(folder, "session.toml"), session);
  const commands = await texts("#shell .commands code");
  await page.goto(await start("--session", "session.toml"));
  await page.locator("[data-rung]").first().waitFor();
  await page.locator("[data-error-of=step-1]").first().waitFor();
  check(JSON.stringify(await texts("#shell .commands code")) === JSON.stringify(commands), "what was done is remembered");
  check(await page.locator(".notice").count() === 0, "nothing is said of logs that are as they were");
}

async function second() {
  step("a second tab sees the same, and is closed");
  const other = await context.newPage();
  await other.goto(new URL("./", page.url()).href);
  await other.locator("[data-rung]").first().waitFor();
  await other.getByRole("button", { name: "work on paper" }).click();
  await page.getByText("Ladder of paper").waitFor();
  await other.close();
  await page.getByRole("button", { name: "work on step-1" }).click();
  await page.getByText("Ladder of step-1").waitFor();
}

async function cancelled() {
  step("a search is cancelled");
  await page.getByRole("button", { name: "work on paper" }).click();
  await page.getByRole("button", { name: "What is missing?" }).click();
  // The desk that says so is on its way, and what is pressed before it comes is not lost.
  const held = [];
  let isHeld = true;
  await page.route("**/api/desk?*", route => isHeld ? void held.push(route) : route.continue());
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.getByText(/^Cancelled after/).waitFor();
  await page.locator("#ask-button").dispatchEvent("click");
  await page.locator("#progress", { hasText: "Searching" }).waitFor();
  isHeld = false;
  await Promise.all(held.map(route => route.continue()));
  await page.unrouteAll({ behavior: "wait" });
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.getByText(/^Cancelled after/).waitFor();
  await canBeAsked();
}

// What is said of a search comes before the desk that its buttons are drawn of.
async function canBeAsked() {
  await page.locator("#ask-button:enabled:not([aria-disabled=true])").waitFor();
}

async function broken() {
  step("a search that ended by a mistake of the program is said, and can be asked again");
  // No input brings that about: the server's word for it is put into what it says (its own tests have it say so).
  const why = "this went wrong inside rotorbench";
  let tick = {};
  await page.route("**/api/desk?*", async route => {
    const response = await route.fetch();
    const desk = await response.json();
    tick = Object.assign(desk.tick, { search: { ...desk.tick.search, state: "failed", why } });
    await route.fulfill({ response, json: desk });
  });
  await page.route("**/api/events", route =>
    route.fulfill({ contentType: "text/event-stream", body: `retry: 3600000\ndata: ${JSON.stringify(tick)}\n\n` }));
  await page.reload();
  await page.locator("#progress.bad", { hasText: why }).waitFor();
  await canBeAsked();
  await picture("5-broken");
  await page.unrouteAll();
  await page.reload();
  await page.getByText(/^Cancelled after/).waitFor();
}

async function wicked() {
  step("a log with markup for a name, and a long one");
  const mark = "<img src=x onerror=window.wicked=1>";
  const rows = [["time_s", mark, "command_1"].join(",")];
  for (let row = 0; row < 300_000; row++) rows.push(`${row / 1000},${Math.sin(row / 3000).toFixed(4)},${row === 123_456 ? 1 : 0.4}`);
  writeFileSync(join(folder, mark + ".csv"), rows.join("\n") + "\n");
  await page.goto(await start(mark + ".csv"));
  await page.locator("figure[data-drawn]").first().waitFor();
  await page.getByRole("button", { name: "add a channel" }).count();
  check(await page.locator("main img").count() === 0 && !(await page.evaluate(() => window.wicked)), "markup in a name has become an element");
  check((await texts("figure h3")).includes(mark), "its name is shown as it is");
  const time = () => page.locator("figure").first().getAttribute("data-drawn");
  for (const key of ["+", "+", "+", "ArrowRight", "ArrowLeft", "ArrowRight"]) {
    const before = await time();
    await page.keyboard.press(key);
    await page.waitForFunction(was => document.querySelector("figure").dataset.drawn !== was, before);
  }
  await picture("6-long-log");
  step("from cursor A to cursor B");
  await page.keyboard.press("a");
  await page.keyboard.press("1");
  await page.keyboard.press("2");
  const wave = page.locator("figure", { hasText: mark }).locator("table.range");
  await wave.waitFor();
  await picture("7-cursors");
  // By thirds of what is seen: 100 s to 200 s of 300 s, every row counted.
  const cells = await wave.locator("tbody tr").first().locator("td").allTextContents();
  check(Math.abs(Number(cells.at(-1)) - 100_000) < 3, "samples between the cursors: " + cells.at(-1));
  const value = async index => Number(await wave.locator("tbody tr td:nth-child(" + index + ") .number").getAttribute("data-value"));
  const [first, last, change, mean] = [await value(2), await value(3), await value(4), await value(5)];
  check(Math.abs(first - Math.sin(100 / 3)) < 1e-3 && Math.abs(last - Math.sin(200 / 3)) < 1e-3, `at the cursors: ${first}, ${last}`);
  check(change === last - first, `their difference: ${change}`);
  check(Math.abs(mean - (3 / 100) * (Math.cos(100 / 3) - Math.cos(200 / 3))) < 1e-4, `mean: ${mean}`);
  await page.keyboard.press("0");
  await wave.waitFor({ state: "detached" });
}

// A run of the emulated bench with these further options.
function fly(name, seed, ...more) {
  execFileSync(program, ["experiment", "prbs", "--lockstep", "--closed-loop", "--amplitude", "0.03", "--seed", seed, "--sequence", seed, "-o", name, ...more],
    { cwd: folder, stdio: ["ignore", "ignore", "inherit"] });
}

// The body's plot, drawn, where others stand before it.
async function inView() {
  await page.locator("figure[data-block=body]").first().evaluate(it => it.scrollIntoView());
  await drawn();
}

async function rotor() {
  step("an effect of the rotors, named and added; its plots first");
  for (const seed of ["1", "2"]) fly(`dead_${seed}.csv`, seed, "--duration", "20", "--hide", "command_dead_zone");
  await page.goto(await start("dead_1.csv", "dead_2.csv"));
  await inView();
  await page.getByRole("button", { name: "What is missing?" }).click();
  await page.locator("#verdict[data-verdict=missing_effect]").waitFor();
  const effect = await page.locator("button[data-add]").first().getAttribute("data-add");
  check(effect === "command_dead_zone", "named is " + effect);
  await page.locator("#middle").evaluate(it => { it.scrollTop = 0; });
  await page.locator("figure").first().and(page.locator("[data-block^=actuator][data-drawn]")).waitFor();
  check((await page.locator("#fall").textContent()).includes("propeller_rate_rad_s"), "the error of the rotors beside the verdict");
  await page.locator("button[data-add]").first().click();
  await page.locator("[data-rung=command_dead_zone]").waitFor();
  await page.locator("[data-error-of=step-1]").first().waitFor();
  for (const block of ["actuator_1", "actuator_2"]) {
    const errors = page.locator(`figure[data-block=${block}] .errors .number`);
    const [from, to] = await errors.evaluateAll(all => all.map(it => Number(it.dataset.value)));
    check(to < from / 2, `${block}: in view the error falls from ${from} to ${to}`);
  }
  await page.locator("#middle").evaluate(it => { it.scrollTop = 0; });
  await page.locator("figure").first().and(page.locator("[data-drawn]")).waitFor();
  await picture("13-rotor");
}

async function marked() {
  step("a model with markup for a name");
  const mark = "<img src=x onerror=window.wicked=2>";
  const paper = String(await saved(() => page.getByRole("button", { name: "save model paper" }).click(), "paper.toml"));
  writeFileSync(join(folder, "marked.toml"), paper.replace(/^name = .*$/m, `name = "${mark}"`));
  await page.goto(await start("dead_1.csv", "--model", "marked.toml"));
  await inView();
  check((await texts("li[data-model] .name")).includes(mark), "its name is shown as it is");
  await page.locator(".u-legend").first().getByText(mark).waitFor();
  check((await page.locator("figure canvas").first().getAttribute("aria-label")).includes(mark), "its name is said as it is");
  await page.locator("figure[data-block=body]").first().getByText("by time, frequency and operating point").click();
  await page.locator("figure[data-block=body] [data-table-of]").first().waitFor();
  const lines = String(await saved(() => page.getByRole("button", { name: /save a drawing of body/ }).first().click(), "plot.svg"));
  check(lines.includes("&lt;img src=x") && !lines.includes("<img"), "its name is text in a drawing");
  const report = String(await saved(() => page.getByRole("button", { name: /save the report/ }).click(), "dead_1.html"));
  check(!report.includes("<img src=x"), "its name is text in a report");
  check(await page.locator("img").count() === 0 && !(await page.evaluate(() => window.wicked)), "markup in a model's name has become an element");
  await picture("14-marked");
}

async function hole() {
  step("a log with a hole, whose band is drawn");
  const [head, ...lines] = readFileSync(join(folder, "dead_1.csv"), "utf8").trimEnd().split("\n");
  const kept = lines.filter(line => { const at = Number(line.split(",")[0]); return at < 8 || at > 12; });
  writeFileSync(join(folder, "hole.csv"), [head, ...kept].join("\n") + "\n");
  await page.goto(await start("hole.csv"));
  await inView();
  await picture("15-hole");
  const body = page.locator("figure[data-block=body]").first();
  // The colour of the plot's ground within the band, and beside it.
  const [within, beside] = await body.locator("canvas").first().evaluate(canvas => {
    const over = canvas.parentElement.querySelector(".u-over");
    const [left, top] = [over.offsetLeft, over.offsetTop + 3].map(it => it * devicePixelRatio);
    const { data } = canvas.getContext("2d").getImageData(left, top, over.clientWidth * devicePixelRatio, 1);
    const at = share => { const pixel = 4 * Math.round(share * data.length / 4); return [...data.slice(pixel, pixel + 4)].join(); };
    return [at(10 / 20), at(16 / 20)];
  });
  check(within !== beside, `the ground within a hole: ${within}, beside it: ${beside}`);
  const drawing = String(await saved(() => body.getByRole("button", { name: /save a drawing/ }).click(), "plot.svg"));
  const bands = [...drawing.matchAll(/<rect x="([0-9.]+)" [^>]*width="([0-9.]+)"[^>]*><title>hole<\/title>/g)];
  const whole = Number(/<clipPath[^>]*><rect width="([0-9.]+)"/.exec(drawing)[1]);
  check(bands.length === 2, `${bands.length} bands of a hole, one in each plot`);
  for (const [, from, width] of bands) {
    const [begin, length] = [20 * from / whole, 20 * width / whole];
    check(Math.abs(begin - 8) < 0.1 && Math.abs(length - 4) < 0.1, `a band from ${begin} s, ${length} s long`);
  }
}

async function longSearch() {
  step("a long search is cancelled, and leaves all as it was");
  fly("long.csv", "7", "--duration", "900", "--hide", "command_dead_zone", "--hide", "gravity_pendulum");
  await page.goto(await start("long.csv"));
  await inView();
  await page.getByRole("button", { name: "What is missing?" }).click();
  // It is at work, and not about to begin.
  await page.locator("#ask .tried").waitFor();
  await picture("16-long-search");
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.getByText(/^Cancelled after/).waitFor();
  check(await page.locator("#verdict").count() === 0 && await page.locator("li[data-model]").count() === 1, "a cancelled search has changed something");
  await canBeAsked();
}

// A bench whose pivot has teeth, which no effect of the catalogue is; its logs, in our words and in those of another program.
function teeth() {
  writeFileSync(join(folder, "teeth.toml"), `[emulator.plant]\nclamped = false\n[[emulator.hidden]]\neffect = "teeth"\nsite = "torque"\n` +
    `expression = "k*sin(n*body_angle)"\nparameters = { k = 0.04, n = 30.0 }\n`);
  for (const [name, seed] of [["teeth_1.csv", "5"], ["teeth_2.csv", "6"]]) {
    execFileSync(program, ["experiment", "prbs", "--lockstep", "--closed-loop", "--config", "teeth.toml", "--amplitude", "0.03", "--duration", "20",
      "--seed", seed, "--sequence", seed, "-o", name], { cwd: folder, stdio: ["ignore", "ignore", "inherit"] });
    const lines = readFileSync(join(folder, name), "utf8").trimEnd().split("\n");
    const heads = lines[0].split(",").map(it => ({ time_s: "Time (s)", propeller_rate_1_rad_s: "Spin left", propeller_rate_2_rad_s: "Spin right" })[it] || it);
    writeFileSync(join(folder, name.replace("teeth", "stand")), [heads.join(","), ...lines.slice(1)].join("\n") + "\n");
  }
}

async function law() {
  step("a law that no catalogue has, and beside the commands by hand");
  teeth();
  await page.goto(await start("teeth_1.csv", "teeth_2.csv"));
  await drawn();
  await page.getByRole("button", { name: "What is missing?" }).click();
  await page.locator("#verdict[data-verdict=unknown]").waitFor();
  const look = page.getByRole("button", { name: "Look for the law itself" });
  await look.click();
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.getByText(/^Cancelled after/).waitFor();
  await look.click();
  await page.locator("#law-verdict[data-verdict=law]").waitFor();
  check(/sin\(n\*body_angle\)/.test(await page.locator("#law-formula").textContent()), "its formula");
  await page.locator("#law").evaluate(it => it.scrollIntoView());
  check(await page.evaluate(() => document.documentElement.scrollHeight <= innerHeight), "the page itself scrolls, its header with it");
  await picture("9-law-light");
  await page.emulateMedia({ colorScheme: "dark" });
  await page.locator("figure[data-block=body][data-scheme=dark]").first().waitFor();
  await picture("9-law-dark");
  await page.emulateMedia({ colorScheme: "light" });
  await page.reload();
  await page.locator("#law-verdict[data-verdict=law]").waitFor();
  await page.getByRole("button", { name: "Add the law" }).click();
  await page.locator("[data-rung=discovered_law]").waitFor();
  const own = join(folder, "law by hand");
  execFileSync("mkdir", ["-p", own]);
  for (const log of ["teeth_1.csv", "teeth_2.csv"]) writeFileSync(join(own, log), readFileSync(join(folder, log)));
  const said = JSON.parse(byHand(await texts("#shell .commands code"), own, "--json"));
  const after = await page.locator("[data-rung=discovered_law] [data-is=after]").getAttribute("data-value");
  check(after === String(said.error.extended.validate), `the page says ${after}, discover --json ${said.error.extended.validate}`);
  const name = await page.locator("li[data-model] .name[aria-pressed=true]").textContent();
  const model = await saved(() => page.getByRole("button", { name: "save model " + name }).click(), name + ".toml");
  check(model.equals(readFileSync(join(own, name + ".toml"))), "the model with the law is another by hand");
  step("its answers in a session");
  writeFileSync(join(folder, "law.toml"), await saved(() => page.getByRole("button", { name: "Save session" }).click(), "session.toml"));
  await page.goto(await start("--session", "law.toml"));
  await page.getByRole("button", { name: "work on paper" }).click();
  await page.locator("#verdict[data-verdict=unknown]").waitFor();
  await page.locator("#law-verdict[data-verdict=law]").waitFor();
  check(await page.locator(".notice").count() === 0, "nothing is left out");
}

async function identified() {
  step("a model of the bench from its logs, and beside the command by hand");
  await page.goto(await start("teeth_1.csv", "teeth_2.csv"));
  await drawn();
  await page.getByRole("button", { name: "Identify this bench" }).first().click();
  await page.getByRole("button", { name: "work on identified-1" }).waitFor();
  await page.locator("[data-error-of=identified-1]").first().waitFor();
  await drawn();
  await picture("9-identified");
  const own = join(folder, "identified by hand");
  execFileSync("mkdir", ["-p", own]);
  for (const log of ["teeth_1.csv", "teeth_2.csv"]) writeFileSync(join(own, log), readFileSync(join(folder, log)));
  byHand(await texts("#shell .commands code"), own, "");
  const model = await saved(() => page.getByRole("button", { name: "save model identified-1" }).click(), "identified-1.toml");
  check(model.equals(readFileSync(join(own, "identified-1.toml"))), "the model of the bench is another by hand");
}

async function columns() {
  step("a log of another program: its columns mended and confirmed");
  await page.goto(await start("stand_1.csv", "stand_2.csv"));
  await page.getByRole("button", { name: "show stand_1.csv" }).click();
  await page.locator("table.columns").waitFor();
  check(await page.locator("#ask-button").isDisabled(), "nothing is asked before the columns are confirmed");
  for (const [column, signal] of [["Spin left", "propeller_rate_1_rad_s"], ["Spin right", "propeller_rate_2_rad_s"]]) {
    await page.getByLabel(`what ${column} becomes`).selectOption(signal);
    await page.waitForFunction(([label, signal]) => document.querySelector(`select[aria-label="${label}"]`)?.value === signal, [`what ${column} becomes`, signal]);
    await page.getByLabel("unit of " + column).waitFor();
  }
  await picture("10-columns");
  await page.locator("#confirm").click();
  await page.getByRole("button", { name: "show stand_2.csv" }).click();
  await page.getByRole("button", { name: "Read it by stand_1.toml" }).click();
  await drawn();
  const own = join(folder, "columns by hand");
  execFileSync("mkdir", ["-p", own]);
  for (const log of ["stand_1.csv", "stand_2.csv"]) writeFileSync(join(own, log), readFileSync(join(folder, log)));
  byHand(await texts("#shell .commands code"), own, "");
  const mapping = await saved(() => page.getByRole("button", { name: "save the mapping of stand_1.csv" }).click(), "stand_1.toml");
  check(mapping.equals(readFileSync(join(own, "stand_1.toml"))), "the mapping is another by hand");
  const compared = JSON.parse(byHand([await page.locator(".by-hand code").textContent()], own, "--json"));
  const body = compared.comparisons[0].blocks.find(it => it.name === "body");
  const shown = await page.locator("figure[data-block=body] [data-error-of=paper] .number").first().getAttribute("data-value");
  check(shown === String(body.error.rms), `the page says ${shown}, compare --json ${body.error.rms}`);
}

async function parts() {
  step("a file with several logs, and a part of one of them");
  const flight = readFileSync(new URL("../formats/golden/betaflight_7_1.bbl", import.meta.url));
  writeFileSync(join(folder, "LOG.bbl"), Buffer.concat([flight.subarray(0, flight.length * 3 / 4), flight]));
  await page.goto(await start("LOG.bbl"));
  await page.getByRole("button", { name: "open log 1 of LOG.bbl" }).waitFor();
  await picture("12-parts");
  check(await page.locator("#ask-button").isDisabled(), "nothing is asked before one is chosen");
  await page.getByRole("button", { name: "open log 2 of LOG.bbl" }).click();
  await page.getByRole("button", { name: "show LOG.bbl#2" }).waitFor();
  await page.locator("[data-error-of=paper]").first().waitFor();
  const compared = await page.locator(".by-hand code").textContent();
  check(compared.endsWith("--log 'LOG.bbl#2'"), "its name in a command: " + compared);
  await page.getByRole("button", { name: "open a log", exact: true }).click();
  await page.getByLabel("only these rotors").fill("two");
  const open = async () => {
    await page.locator("dialog#files button", { hasText: /^\// }).first().click();
    await page.locator("dialog#files button", { hasText: "teeth_1.csv" }).click();
  };
  await open();
  await page.locator(".notice", { hasText: "Rotors are numbers" }).waitFor();
  await page.getByRole("button", { name: "dismiss the notices" }).click();
  await page.getByRole("button", { name: "open a log", exact: true }).click();
  await page.getByLabel("only these rotors").fill("2,1");
  await page.getByLabel("only from this time [s]").fill("2.5");
  await open();
  await page.getByText("Only rotors 2, 1; from 2.5 s").waitFor();
  await page.getByRole("button", { name: "show teeth_1.csv" }).click();
  await drawn();
  await picture("12-part");
  const command = await page.locator(".by-hand code").textContent();
  check(command.includes("--from-s 2.5 --rotors 2,1"), "what was chosen is in the command: " + command);
  const said = JSON.parse(byHand([command], folder, "--json"));
  const body = said.comparisons[0].blocks.find(it => it.name === "body");
  const shown = await page.getByRole("figure", { name: `body: ${body.signal}`, exact: true }).locator("[data-error-of=paper] .number").getAttribute("data-value");
  check(shown === String(body.error.rms), `the page says ${shown}, compare --json ${body.error.rms}`);
}

// A file of the folder, let go of over the page, as a file manager does.
async function drop(name, bytes) {
  const held = await page.evaluateHandle(([name, bytes]) => {
    const held = new DataTransfer();
    held.items.add(new File([new Uint8Array(bytes)], name));
    return held;
  }, [name, bytes]);
  await page.dispatchEvent("main", "dragover", { dataTransfer: held });
  check(await page.locator("html.dropping").count() === 1, "a file over the page shows");
  await page.dispatchEvent("main", "drop", { dataTransfer: held });
  check(await page.locator("html.dropping").count() === 0, "a file that was let go of no longer shows");
}

async function dropped() {
  step("a log that is dragged in");
  writeFileSync(join(folder, "dragged.csv"), readFileSync(join(folder, "teeth_2.csv")));
  const { size } = statSync(join(folder, "dragged.csv"));
  await drop("dragged.csv", size);
  await page.getByRole("button", { name: "show dragged.csv" }).waitFor();
  await drop("dragged.csv", size - 1);
  await page.locator(".notice", { hasText: "dragged.csv is not below what this workbench may open" }).waitFor();
  await page.getByRole("button", { name: "dismiss the notices" }).click();
  // Copies of it lie in folders in which commands ran by hand.
  await drop("teeth_2.csv", size);
  await page.locator(".notice", { hasText: "files teeth_2.csv of this length" }).waitFor();
  await page.getByRole("button", { name: "dismiss the notices" }).click();
}

async function grows() {
  step("a log that is being written");
  const lines = readFileSync(join(folder, "teeth_1.csv"), "utf8").trimEnd().split("\n");
  const grown = share => writeFileSync(join(folder, "grows.csv"), lines.slice(0, Math.round(share * lines.length)).join("\n") + "\n");
  grown(0.5);
  await page.goto(await start("grows.csv"));
  await drawn();
  await page.getByLabel("follow grows.csv").check();
  for (const share of [0.75, 1]) {
    const before = await page.locator("li[data-log] p").first().textContent();
    grown(share);
    await page.waitForFunction(was => document.querySelector("li[data-log] p").textContent !== was, before);
  }
  const rows = (lines.length - 1).toLocaleString("en");
  check((await page.locator("li[data-log] p").first().textContent()).startsWith(rows + " rows"), "all of it is read");
  await drawn();
  await picture("11-grows");
}

const onBench = (...given) => spawn(program, [...given, "--config", "bench.toml"], { cwd: folder, stdio: ["ignore", "ignore", "inherit"] });
const exitOf = process => new Promise(done => process.on("exit", done));

// A loop on the emulated bench, until it is ended.
function loop() {
  const emulator = onBench("emulate", "--shm");
  const controller = onBench("control");
  const ended = Promise.all([emulator, controller].map(exitOf));
  return async () => {
    controller.kill("SIGINT");
    emulator.kill("SIGINT");
    await ended;
  };
}

async function live() {
  step("a running bench");
  writeFileSync(join(folder, "bench.toml"), `name = "browser-${process.pid}"\n`);
  const end = loop();
  try {
    await page.goto(await start("--config", "bench.toml"));
    await page.getByRole("button", { name: "Live" }).click();
    await page.locator("#live-state[data-state]").waitFor();
    await page.locator("#live canvas").first().waitFor();
    // The loop at work, for long enough to be seen.
    const armed = await exitOf(onBench("arm"));
    check(armed === 0, "armed");
    await page.locator("#live-state[data-state=armed]").waitFor();
    await page.waitForTimeout(20000);
    await picture("8-live-light");
    await recoloured("dark");
    await picture("8-live-dark");
    await recoloured("light");
    await legends();
    await left();
  } finally {
    await end();
  }
  await page.getByText(/gives a sign of life/).waitFor();
  await again();
}

// The desktop turns to other colours; the plots are made anew with the next look at the bench.
async function recoloured(colorScheme) {
  const before = await page.locator("#live canvas").last().elementHandle();
  await page.emulateMedia({ colorScheme });
  await page.waitForFunction(it => !it.isConnected, before);
}

// A curve is hidden and shown by the keyboard, too; other colours make the plot anew, and leave it hidden and the keyboard where it is.
async function legends() {
  const entry = page.locator("#live .u-legend .u-series:nth-child(2) > th").first();
  await entry.focus();
  for (const [shown, colorScheme] of [["false", "dark"], ["true", "light"]]) {
    await page.keyboard.press("Enter");
    check(await entry.getAttribute("aria-pressed") === shown, `a curve that is shown: ${shown}`);
    await recoloured(colorScheme);
    check(await entry.getAttribute("aria-pressed") === shown, `a curve that is shown in other colours: ${shown}`);
    check(await entry.evaluate(it => it === document.activeElement), "the keyboard is where it was");
  }
}

// Left, and looked at again in a narrower window: every plot is drawn, and as wide as its place.
async function left() {
  const toggle = page.getByRole("button", { name: "Live" });
  await toggle.click();
  await page.locator("main").waitFor();
  await page.setViewportSize({ width: 1000, height: 720 });
  await toggle.click();
  await page.locator("#live-state[data-state=armed]").waitFor();
  await page.waitForFunction(() => [...document.querySelectorAll("#live .chart")].every(it => it.querySelector(".uplot")?.clientWidth === it.clientWidth));
  await picture("8-live-again");
  await page.setViewportSize({ width: 1280, height: 720 });
}

// A bench that has begun anew is shown as it is now, and was not armed by anybody.
async function again() {
  const end = loop();
  try {
    await page.locator("#live-state[data-state=disarmed]").waitFor();
  } finally {
    await end();
  }
}

let failed = null;
try {
  await demo();
  await opened();
  await names();
  await looks();
  const effect = await ask();
  await add(effect);
  await exported();
  await back();
  await second();
  await cancelled();
  await broken();
  await wicked();
  await rotor();
  await marked();
  await hole();
  await longSearch();
  await law();
  await identified();
  await columns();
  await parts();
  await dropped();
  await grows();
  await live();
  check(complaints.length === 0, "the browser complained:\n" + complaints.join("\n"));
} catch (error) {
  failed = error;
  await picture("failed").catch(() => {});
} finally {
  await browser.close();
  running?.removeAllListeners("exit");
  running?.kill("SIGINT");
  rmSync(folder, { recursive: true, force: true });
}
if (failed) {
  console.error("browser: " + failed.message + (complaints.length ? "\n" + complaints.join("\n") : ""));
  process.exit(1);
}
step(`all is as it should be; pictures of each step: ${readdirSync(pictures).join(" ")}`);
