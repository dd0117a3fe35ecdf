// Drive the studio in a browser as a person would: from two files to two results and what differs.
//
//   node test/flow.mjs ADDRESS SHOTS LOG FIXES
//
// ADDRESS is what `strapdown studio` prints; SHOTS a folder for pictures of every step at 1300 and
// 390 pixels, light and dark. Fails at an error in the console, a request to elsewhere, a page that
// scrolls sideways, a control without a name, text of too little contrast, and a step that does
// not do what it should.

import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { basename } from "node:path";
import { chromium } from "playwright-core";

const [address, shots, ...files] = process.argv.slice(2);
mkdirSync(shots, { recursive: true });
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
});
const page = await (await browser.newContext({ viewport: { width: 1300, height: 900 }, permissions: ["clipboard-read", "clipboard-write"] })).newPage();
page.setDefaultTimeout(60_000);
const faults = [];
let expected = 0;
page.on("console", (message) => { if (["error", "warning"].includes(message.type())) faults.push(`${message.text()} (${message.location().url})`); });
page.on("pageerror", (error) => faults.push(`uncaught: ${error.message}`));
page.on("request", (request) => {
  const at = new URL(request.url());
  if (!["blob:", "data:"].includes(at.protocol) && at.host !== new URL(address).host) faults.push(`asked another host: ${request.url()}`);
});

const click = (name, options = {}) => page.getByRole("button", { name, ...options }).first().click();
const see = (text) => page.getByText(text).first().waitFor();
const done = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1).padStart(6)} s  ${what}`);
const begun = Date.now();

/** Pictures of a step, and what has to hold on every page. */
async function look(name) {
  for (const [width, dark] of [[1300, false], [1300, true], [390, false], [390, true]]) {
    await page.setViewportSize({ width, height: 900 });
    await page.emulateMedia({ colorScheme: dark ? "dark" : "light" });
    await page.waitForTimeout(350);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(wide <= width, `${name}: ${wide} pixels wide at ${width}`);
    assert.deepEqual(await page.evaluate(faintText), [], `${name}: contrast, ${dark ? "dark" : "light"}`);
    await page.screenshot({ path: `${shots}/${name}-${width}-${dark ? "dark" : "light"}.png`, fullPage: true });
  }
  assert.deepEqual(await nameless(), [], `${name}: controls without a name`);
  await page.setViewportSize({ width: 1300, height: 900 });
  await page.emulateMedia({ colorScheme: "light" });
}

/** Controls that a screen reader could not name. */
async function nameless() {
  const session = await page.context().newCDPSession(page);
  const { nodes } = await session.send("Accessibility.getFullAXTree");
  await session.detach();
  const controls = new Set(["button", "link", "textbox", "searchbox", "checkbox", "radio", "combobox", "slider", "spinbutton", "img", "progressbar"]);
  return nodes.filter((n) => !n.ignored && controls.has(n.role?.value) && !n.name?.value).map((n) => `${n.role.value} ${n.nodeId}`);
}

/** Text below the contrast of WCAG AA, 4.5 or 3 where it is large; runs in the page. */
function faintText() {
  const parse = (text) => { const [r, g, b, a = 1] = (text.match(/[\d.]+/g) ?? []).map(Number); return [r, g, b, a]; };
  const over = (top, under) => top.slice(0, 3).map((v, i) => v * top[3] + under[i] * (1 - top[3]));
  const light = (rgb) => rgb.map((v) => v / 255).map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)).reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const ground = (element) => {
    const layers = [];
    for (let e = element; e; e = e.parentElement) layers.push(parse(getComputedStyle(e).backgroundColor));
    return layers.reverse().reduce((under, top) => over(top, under), [255, 255, 255]);
  };
  const found = new Set();
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const element = walk.currentNode.parentElement;
    if (!walk.currentNode.data.trim() || element.closest("svg, noscript, :disabled, .u-wrap") || !element.checkVisibility()) continue;
    const style = getComputedStyle(element), back = ground(element);
    const [a, b] = [light(over(parse(style.color), back)), light(back)].sort((x, y) => y - x);
    const ratio = (a + 0.05) / (b + 0.05), size = parseFloat(style.fontSize);
    if (ratio < (size >= 24 || (size >= 18.6 && style.fontWeight >= 600) ? 3 : 4.5)) found.add(`${walk.currentNode.data.trim().slice(0, 40)}: ${ratio.toFixed(2)}`);
  }
  return [...found];
}

try {
  await page.goto(address);
  await see("What did you record?");
  await look("1-empty");
  await page.locator("input[type=file]").setInputFiles(files);
  for (const file of files) await page.getByRole("checkbox", { name: new RegExp(basename(file).replace(/[.]/g, "\\.")) }).waitFor();
  // A second time: it asks before it replaces.
  await page.locator("input[type=file]").setInputFiles(files[0]);
  await click("Replace it");
  expected += 1;
  await page.getByRole("button", { name: "Replace it" }).waitFor({ state: "detached" });
  for (const box of await page.getByRole("checkbox").all()) await box.check();
  await look("2-files");
  done("files are there");

  await click(/^Look into/);
  await see("The traces");
  await page.locator(".plot canvas").first().waitFor();
  const questions = page.locator(".ask");
  if (await questions.count()) {
    await questions.first().getByRole("button").first().click();
    await page.locator(".plot canvas").first().waitFor();
  }
  await page.getByText("Looking again…").waitFor({ state: "detached" });
  const viewed = () => page.locator(".viewed").innerText();
  const whole = await viewed();
  const over = page.locator(".u-over").first();
  const box = await over.boundingBox();
  await page.mouse.move(box.x + box.width * 0.3, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.6, box.y + 50, { steps: 5 });
  await page.mouse.up();
  assert.notEqual(await viewed(), whole, "a drag zooms");
  const dragged = await viewed();
  await page.locator(".panels").focus();
  await page.keyboard.press("+");
  await page.waitForTimeout(100);
  assert.notEqual(await viewed(), dragged, "+ zooms");
  await page.mouse.move(box.x + box.width * 0.5, box.y + 40);
  await page.mouse.wheel(0, -200);
  await page.waitForTimeout(300);
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("m");
  await page.keyboard.press("0");
  await page.waitForTimeout(300);
  assert.equal(await viewed(), whole, "0 shows all");
  assert.match(await page.locator(".readout").innerText(), /from the beginning/);
  await page.getByRole("button", { name: "Remove the mark 1" }).waitFor();
  const from = page.getByRole("textbox", { name: /^From/ });
  const first = Number(await from.inputValue());
  await page.getByRole("slider", { name: "End of the part to use" }).press("ArrowLeft");
  await page.getByRole("button", { name: "Use all" }).click();
  assert.equal(Number(await from.inputValue()), first);
  await page.getByRole("button", { name: /^Antenna: forward .* right/ }).press("Shift+ArrowRight");
  await see(/The antenna is/);
  await look("3-look");
  done("looked at");

  await page.getByRole("link", { name: "Choose what to find out" }).click();
  await see("What do you want to find out?");
  await page.getByRole("button", { name: "Navigation", exact: true }).waitFor();
  await look("4-choose");
  await page.getByRole("button", { name: "Navigation", exact: true }).click();

  const text = page.getByRole("textbox", { name: "The configuration in TOML" });
  await text.waitFor();
  await see("in step with the form");
  assert.match(await text.inputValue(), /lever_arm_m = \[0\.1, 0(\.0)?, 0(\.0)?\]/, "the drawing went into the configuration");
  const before = await text.inputValue();
  await page.getByRole("searchbox").fill("step_s");
  await page.locator(".formside .field input").first().fill("0.2");
  await page.keyboard.press("Enter");
  await page.waitForFunction((old) => document.querySelector("textarea").value !== old, before);
  assert.match(await text.inputValue(), /step_s = 0\.2/, "the form writes into the text");
  assert.ok((await text.inputValue()).split("\n").filter((l) => l.startsWith("#")).length > 10, "comments are kept");
  await page.getByRole("searchbox").fill("");
  await look("5-configure");
  const right = await text.inputValue();
  await text.fill(right.replace(/^path = .*$/m, "path = 3"));
  await page.locator(".toml .findings .bad").first().waitFor();
  assert.equal(await page.locator(".gutter .wrong").count() > 0, true, "the line of the error is shown");
  await look("5-error");
  await text.fill(right);
  await see("in step with the form");
  done("set up");

  const name = page.getByRole("textbox", { name: "Name of the result" });
  await name.fill("first");
  await click("Run it");
  await page.getByText("The same from a terminal").waitFor();
  await look("6-run");
  await page.reload();
  await page.getByText("The same from a terminal").waitFor();
  await page.getByRole("link", { name: "See the result" }).waitFor({ timeout: 300_000 });
  done("run");
  await page.getByRole("link", { name: "See the result" }).click();
  await see("The motion");
  await page.locator(".plot canvas").first().waitFor();
  await page.getByRole("slider", { name: "Instant" }).press("End");
  await page.getByRole("slider", { name: "Instant" }).press("PageDown");
  await page.locator(".attitude figcaption").getByText(/Heading/).waitFor();
  await page.locator("iframe.report").scrollIntoViewIfNeeded();
  await page.frameLocator("iframe.report").locator("h1").first().waitFor();
  await page.getByRole("button", { name: "Copy" }).first().click();
  assert.match(await page.evaluate(() => navigator.clipboard.readText()), /^strapdown navigate first\.toml/);
  await look("7-result");
  const [zip] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: /\.zip/ }).click()]);
  assert.equal(await zip.failure(), null, "the result is downloaded");
  done("result");

  await page.goto(`${address}#/configure`);
  await see("in step with the form");
  await name.fill("second");
  await page.getByRole("checkbox", { name: /^Smooth/ }).check();
  await click("Run it");
  await page.getByRole("link", { name: "See the result" }).waitFor({ timeout: 300_000 });
  await page.goto(`${address}#/compare?run=first&run=second`);
  await click("Compare 2");
  await page.locator("table").first().waitFor();
  await look("8-compare");
  done("compared");
  await page.goto(`${address}#/live`);
  await see("Start listening");
  await page.waitForTimeout(500);
  await look("9-live");
  await page.goto(`${address}#/result/none`);
  await page.getByRole("alert").waitFor();
  expected += 1;

  // What the steps above were refused on purpose is said by the browser, too.
  const refused = faults.filter((fault) => /status of (404|409)/.test(fault));
  assert.equal(refused.length, expected, `refusals: ${refused.join("\n")}`);
  assert.deepEqual(faults.filter((fault) => !refused.includes(fault)), [], "console");
  done("no error in the console, no request to elsewhere");
} catch (error) {
  await page.screenshot({ path: `${shots}/failed.png`, fullPage: true });
  console.log(faults.join("\n"));
  throw error;
} finally {
  await browser.close();
}
