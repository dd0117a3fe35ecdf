// Drive a crash: its records, each question of the case, what follows while a value moves, the run.
//
//   node test/crash.mjs ADDRESS SHOTS [RECORD OTHERS…]
//
// RECORD is chosen; OTHERS are files that it refers to. Without them: the studio's own sample.

import assert from "node:assert/strict";
import { basename } from "node:path";
import { answerAll, open } from "./drive.mjs";

const [address, shots, ...files] = process.argv.slice(2);
const { page, look, click, see, done, expect, run } = await open(address, shots);

await run(async () => {
  await page.goto(address);
  if (files.length) {
    await page.locator("input[type=file]").setInputFiles(files);
    await page.locator(".sending").waitFor({ state: "detached" });
    for (const box of await page.getByRole("checkbox").all()) await box.uncheck();
    await page.getByRole("checkbox", { name: new RegExp(basename(files[0]).replaceAll(".", "\\.")) }).check();
  } else {
    await click("A simulated crash");
    await page.getByRole("checkbox", { checked: true }).first().waitFor();
  }
  await click(/^Look into/);
  // Its channels are drawn, those of all its files under one cursor.
  await see("The traces");
  await page.locator(".plot canvas").first().waitFor();
  const panels = await page.locator(".paneltitle").allInnerTexts();
  assert.ok(panels.some((text) => /Acceleration/.test(text) && /m\/s²/.test(text)), panels.join("; "));
  if (!files.length) assert.ok(panels.length === 3 && panels.some((text) => /Angular rate/.test(text)), panels.join("; "));
  await page.locator(".panels").focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("Shift+ArrowRight");
  const read = await page.locator(".readout").innerText();
  assert.match(read, /m\/s²/, "the cursor reads the channels");
  await page.keyboard.press("m");
  await page.getByRole("button", { name: "Remove the mark 1" }).waitFor();
  assert.equal(await page.getByText("The part to use").count(), 0, "a case takes its records whole");
  await look("crash-0-look");
  await page.getByRole("link", { name: "Choose what to find out" }).click();
  await page.getByRole("button", { name: "Crash", exact: true }).click();
  const text = page.getByRole("textbox", { name: "The configuration in TOML" });
  await text.waitFor();
  await page.waitForTimeout(1500);
  await look("crash-1-questions");
  // Pressed too early, the button says why beside itself, and the focus is there.
  await click("Run it");
  await page.waitForFunction(() => document.activeElement?.matches(".notice[role=alert]"));
  assert.match(await page.evaluate(() => document.activeElement.textContent), /questions? to answer first/);
  const [button, told] = [await page.getByRole("button", { name: "Run it" }).boundingBox(), await page.locator(".notice:focus").boundingBox()];
  assert.ok(Math.abs(told.y - button.y) < 200, "beside the button");
  await look("crash-1-refused");
  await click("Go to the first");
  assert.ok(await page.evaluate(() => Boolean(document.activeElement.closest(".ask"))), "to the question");
  // An answer that cannot be is refused where it is given, while others are open.
  const mass = page.locator(".ask", { hasText: /^Mass/ });
  if (await mass.count()) {
    await mass.getByText("For example: 1450.").waitFor();
    await mass.getByRole("textbox").fill("-5");
    await mass.getByRole("button", { name: "Answer" }).click();
    await mass.getByRole("alert").getByText(/-5 is out of range/).waitFor();
    await look("crash-1-range");
  }
  const asked = await answerAll(page);
  await page.locator("summary", { hasText: `${asked} questions answered` }).click();
  await page.getByRole("button", { name: /^Ask again: mass/ }).click();
  await mass.waitFor();
  assert.equal(await answerAll(page), 1, "an answer is taken back");
  await see("Vehicle: Length");
  await look("crash-1-assumed");
  assert.ok(!(await text.inputValue()).match(/= "\?"|\["\?"/), "nothing is open");
  done(`${asked} questions answered`);
  await see(/up is forward of the vehicle at the entry/);
  assert.equal(await page.getByText("north up").count(), 0, "no heading is known");
  const face = page.getByRole("img", { name: /^Direction of force/ });
  await face.waitFor();
  const before = await face.getAttribute("aria-label");
  await look("crash-2-preview");
  const slider = page.getByRole("slider", { name: "Mounting heading" });
  const times = [];
  for (let i = 0; i < 20; i++) {
    const asking = page.waitForResponse(/crash\/quick/);
    const began = Date.now();
    await slider.press("ArrowRight");
    await asking;
    times.push(Date.now() - began);
  }
  await page.waitForFunction((old) => document.querySelector("svg.clock").getAttribute("aria-label") !== old, before);
  times.sort((a, b) => a - b);
  done(`from a key to the answer: median ${times[10]} ms, most ${times[19]} ms`);
  await look("crash-3-moved");
  await click("Write into the case");
  await page.waitForFunction(() => /angles_deg = \[0(\.0)?, 0(\.0)?, 2(\.0)?\]/.test(document.querySelector("textarea").value));
  await see("in step with the form");
  // As it was, after writing too; then the same once more.
  await click("As it was");
  await page.waitForFunction(() => /angles_deg = \[0(\.0)?, 0(\.0)?, 0(\.0)?\]/.test(document.querySelector("textarea").value));
  await see("in step with the form");
  for (let i = 0; i < 20; i++) await slider.press("ArrowRight");
  await click("Write into the case");
  await page.waitForFunction(() => /angles_deg = \[0(\.0)?, 0(\.0)?, 2(\.0)?\]/.test(document.querySelector("textarea").value));
  await see("in step with the form");
  // A name that cannot be one is said where it is written, and is the only fault; a good one clears it.
  const name = page.getByRole("textbox", { name: "Name of the result" }), own = await name.inputValue();
  await name.fill("../x");
  await page.locator("#reason.fault").getByText(/'\.\.\/x' cannot be a name here/).waitFor();
  await see("in step with the form");
  await name.fill(own);
  await page.locator("#reason.fault").waitFor({ state: "detached" });
  // What is wrong leaves the preview as it was, which says so.
  const whole = await text.inputValue();
  // The form may find the fault before the preview asks for it.
  page.on("response", (answer) => answer.url().endsWith("crash/quick") && answer.status() === 400 && expect());
  await text.fill(whole.replace(/^mass_kg = .*$/m, "mass_kg = -5"));
  await see(/^This is of the case before/);
  await text.fill(whole);
  await page.getByText(/^This is of the case before/).waitFor({ state: "detached" });
  // A decimal comma is one; what may be a thousand is asked again.
  await page.getByRole("searchbox", { name: "Find a setting" }).fill("mass_kg");
  const field = page.locator(".formside").getByRole("textbox", { name: "Mass", exact: true });
  await field.fill("1450,5");
  await field.press("Enter");
  await page.waitForFunction(() => /^mass_kg = 1450\.5/m.test(document.querySelector("textarea").value));
  await field.fill("1,450");
  await field.press("Enter");
  await see(/^This has to be a number/);
  await field.fill("1450,5");
  await field.press("Enter");
  await text.fill(whole);
  await see("in step with the form");
  await page.waitForTimeout(800);
  await click("Run it");
  await page.getByRole("link", { name: "See the result" }).waitFor({ timeout: 600_000 });
  await page.getByRole("link", { name: "See the result" }).click();
  await page.frameLocator("iframe.report").locator("h1").first().waitFor();
  await see("The motion");
  await page.getByText("Path, along the vehicle at the entry").first().waitFor();
  await page.getByRole("img", { name: /^Plan of the track, up is forward/ }).waitFor();
  await see(/the entry \(± [\d.]+°\), nose .* \(± [\d.]+°\), .* \(± [\d.]+°\)\./);
  await look("crash-4-result");
  done("crash");
});
