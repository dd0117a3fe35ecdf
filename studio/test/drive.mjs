// What the flows share: a browser, and what has to hold on every page.

import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { chromium } from "playwright-core";

/**
 * Open a browser at ADDRESS. `look(name)` takes pictures at two widths, light and dark, and fails at
 * a page that scrolls sideways, text of too little contrast and a control without a name; `end`
 * fails at an error in the console that was not `expect`ed, and at a request to elsewhere.
 */
export async function open(address, shots) {
  mkdirSync(shots, { recursive: true });
  const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
  });
  const page = await (await browser.newContext({ viewport: { width: 1300, height: 900 }, permissions: ["clipboard-read", "clipboard-write"] })).newPage();
  page.setDefaultTimeout(90_000);
  const faults = [];
  const begun = Date.now();
  let expected = 0;
  page.on("console", (message) => { if (["error", "warning"].includes(message.type()) && !message.text().includes("GPU stall")) faults.push(`${message.text()} (${message.location().url})`); });
  page.on("requestfailed", (request) => { if (request.failure()?.errorText !== "net::ERR_ABORTED") faults.push(`failed: ${request.url()} ${request.failure()?.errorText}`); });
  page.on("pageerror", (error) => faults.push(`uncaught: ${error.message}`));
  page.on("request", (request) => {
    const at = new URL(request.url());
    if (!["blob:", "data:"].includes(at.protocol) && at.host !== new URL(address).host) faults.push(`asked another host: ${request.url()}`);
  });

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
    assert.deepEqual(await nameless(page), [], `${name}: controls without a name`);
    await page.setViewportSize({ width: 1300, height: 900 });
    await page.emulateMedia({ colorScheme: "light" });
  }

  return {
    page, look,
    click: (name, options = {}) => page.getByRole("button", { name, ...options }).first().click(),
    see: (text) => page.getByText(text).first().waitFor(),
    done: (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1).padStart(6)} s  ${what}`),
    /** A refusal by the server, which the browser writes into the console. */
    expect: () => { expected += 1; },
    async run(steps) {
      try {
        await steps();
        const refused = faults.filter((fault) => /status of (400|404|409|422)/.test(fault));
        assert.equal(refused.length, expected, `refusals: ${refused.join("\n")}`);
        assert.deepEqual(faults.filter((fault) => !refused.includes(fault)), [], "console");
        console.log("no error in the console, no request to elsewhere");
      } catch (error) {
        await page.screenshot({ path: `${shots}/failed.png`, fullPage: true });
        console.log(faults.join("\n"));
        throw error;
      } finally {
        await browser.close();
      }
    },
  };
}

/** An answer to a question by what it asks for, or the example that it gives. */
function answer(text, example) {
  if (/unit of/i.test(text)) return /gyr|omega|rate/i.test(text) ? "rad/s" : "m/s2";
  if (/^samples a second/i.test(text)) return "500";
  if (/\bsits\b|position/i.test(text)) return "-1.0, 0.4, 0.2";
  if (/\bspeed\b|how fast/i.test(text)) return "50";
  if (/^heading/i.test(text)) return "0";
  if (/title|called/i.test(text)) return "A frontal impact";
  if (/\bweigh|\bmass\b(?! may| along)/i.test(text)) return "1500";
  if (/why/i.test(text)) return "centric impact, no turn in the film";
  return example ?? "2";
}

/** Answer what only a person can, one question after the other; how many there were. */
export async function answerAll(page) {
  let asked = 0;
  for (const questions = page.getByRole("region", { name: /only you can answer$/ }).locator(".ask"); await questions.count(); asked++) {
    assert.ok(asked < 60, "every answer closes its question");
    const first = questions.first(), said = await first.locator("p").first().innerText();
    const open = await page.locator(".ask").count();
    if (await first.getByRole("combobox").count()) await first.getByRole("combobox").selectOption({ index: 1 });
    else if (await first.getByRole("textbox").count()) {
      await first.getByRole("textbox").fill(answer(said, /such as ([-\d., ]+)\.$/m.exec(await first.innerText())?.[1]));
      await first.getByRole("button", { name: "Answer" }).click();
    } else await first.getByRole("button").first().click();
    await page.waitForFunction((old) => document.querySelectorAll(".ask").length < old, open).catch((error) => { throw new Error(`${said}: ${error.message}`); });
  }
  return asked;
}

/** Controls that a screen reader could not name. */
async function nameless(page) {
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
