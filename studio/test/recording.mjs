// Drive a recording: its files, the questions, a part, each system that it suffices for, results.
//
//   node test/recording.mjs ADDRESS SHOTS PART CHOSEN…
//
// PART: seconds of the log that are used. CHOSEN: what is ticked at once, as a JSON list of names.
// Prints a line `result {…}` for each result: its name, its command, and what makes it again.

import assert from "node:assert/strict";
import { answerAll, open } from "./drive.mjs";

const [address, shots, part, ...sets] = process.argv.slice(2);
const { page, look, click, see, done, expect, run } = await open(address, shots);
const KINDS = ["Navigation", "Attitude", "Crash"];
const POSSIBLE = /This log has it|Possible, with limits/;
// What the preview of a crash cannot compute of such answers it says.
page.on("response", (one) => { if (/crash\/quick/.test(one.url()) && !one.ok()) expect(); });
const alert = page.getByRole("alert").first();
const still = () => page.waitForFunction(() => !document.querySelector("main .busy"), null, { timeout: 400_000 });

/** Click, and wait for what the server answers. */
async function ask(control, path) {
  const [answer] = await Promise.all([page.waitForResponse(path, { timeout: 400_000 }), control.click()]);
  await answer.finished();
  await still();
  return answer.ok();
}

/** A refusal says what is wrong; `name`: of its pictures. */
async function refused(name) {
  expect();
  assert.ok((await alert.innerText()).trim(), "a refusal says why");
  await look(name);
  done(`${name}: ${await alert.innerText()}`);
}

async function tick(files) {
  await page.goto(`${address}#/files`);
  for (const box of await page.locator(".item input:checked").all()) await box.uncheck();
  for (const file of files) {
    const folder = page.locator("details:not([open]) > summary", { hasText: ` in ${file.split("/")[0]} ` });
    if (file.includes("/") && await folder.count()) await folder.click();
    await page.locator(".item", { has: page.getByText(file, { exact: true }) }).getByRole("checkbox").check();
  }
}

/** Look, and answer what is asked by the first choice; false: the log is refused. */
async function looked(title) {
  for (let read = await ask(page.getByRole("button", { name: /^Look into/ }), /api\/look/), i = 0; ; i++) {
    if (!read) { await refused(`${title}-refused`); return false; }
    const questions = page.getByRole("region", { name: /questions? about the log$/ }).locator(".ask");
    if (!await questions.count()) return true;
    if (i === 0) await look(`${title}-asked`);
    assert.ok(i < 9, "the questions end");
    const free = questions.first().getByRole("textbox"), button = questions.first().getByRole("button").first();
    if (await button.innerText() === "Answer") await free.fill("100");
    read = await ask(button, /api\/look/);
  }
}

async function drawn() {
  if (await page.locator(".traces").count()) await page.locator(".plot canvas").first().waitFor();
  await page.waitForLoadState("networkidle");
}

/** Set up and run: what is proposed, with every question answered. */
async function made(kind, name) {
  const setUp = page.getByRole("button", { name: kind, exact: true });
  for (let proposed = await ask(setUp, /api\/propose/); ;) {
    if (!proposed) return refused(`${name}-refused`);
    const choose = page.getByRole("region", { name: /questions? about the files$/ }).locator(".ask").first();
    if (!await choose.count()) break;
    proposed = await ask(choose.getByRole("button").first(), /api\/propose/);
  }
  await see("in step with the form");
  const asked = await answerAll(page);
  await see("in step with the form");
  await page.getByRole("textbox", { name: "Name of the result" }).fill(name);
  await look(`${name}-set-up`);
  await ask(page.getByRole("button", { name: "Run it" }), /api\/jobs$/);
  const link = page.getByRole("link", { name: "See the result" }), failed = page.locator(".progress.failed, .progress.lost");
  await link.or(failed).first().waitFor({ timeout: 600_000 });
  const command = await page.locator(".command code").innerText();
  await look(`${name}-run`);
  if (await failed.count()) return done(`${name}: ${await alert.innerText()}`);
  await link.click();
  await see("Repeat it");
  await drawn();
  await page.locator("iframe.report").scrollIntoViewIfNeeded();
  await page.frameLocator("iframe.report").locator("h1").first().waitFor();
  for (const one of await page.locator(".drawings img").all()) await one.scrollIntoViewIfNeeded();
  await look(`${name}-result`);
  done(`${name}: ${asked} answers`);
  console.log(`result ${JSON.stringify({ name, command, again: await page.locator(".command code").nth(1).innerText() })}`);
}

await run(async () => {
  await page.goto(address);
  await see("Files in the folder");
  for (const [i, set] of sets.entries()) {
    await tick(JSON.parse(set));
    if (i === 0) await look("files");
    if (!await looked(`look-${i}`)) continue;
    await drawn();
    const to = page.getByRole("textbox", { name: /^To/ });
    if (await to.count()) {
      const end = Number(await page.getByRole("textbox", { name: /^From/ }).inputValue()) + Number(part);
      if (end < Number(await to.inputValue())) { await to.fill(String(end)); await to.press("Enter"); }
    }
    await look(`look-${i}`);
    await page.getByRole("link", { name: "Choose what to find out" }).click();
    await page.locator(".kinds .verdict").first().waitFor({ timeout: 400_000 });
    await look(`choose-${i}`);
    const fits = await page.locator(".kinds > li").filter({ has: page.locator(".verdict").getByText(POSSIBLE) }).locator("h2").allInnerTexts();
    for (const kind of fits.filter((one) => KINDS.includes(one))) {
      await page.goto(`${address}#/choose`);
      await made(kind, `${kind.toLowerCase()}-${i}`);
    }
    done(`${set}: ${fits.join(", ")}`);
  }
});
