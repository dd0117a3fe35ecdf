// Drive the studio in a browser as a person would: from two files to two results and what differs.
//
//   node test/flow.mjs ADDRESS SHOTS LOG FIXES
//
// ADDRESS is what `strapdown studio` prints, of an empty folder; SHOTS a folder for pictures.

import assert from "node:assert/strict";
import { basename } from "node:path";
import { open } from "./drive.mjs";

const [address, shots, ...files] = process.argv.slice(2);
const { page, look, click, see, done, expect, run } = await open(address, shots);

await run(async () => {
  const policy = (await page.goto(address)).headers()["content-security-policy"];
  assert.match(policy, /default-src 'none'/);
  assert.doesNotMatch(policy, /unsafe|\*|http/, "nothing inline, nothing from elsewhere");
  await see("What did you record?");
  await look("1-empty");
  await page.locator("input[type=file]").setInputFiles(files);
  for (const file of files) await page.getByRole("checkbox", { name: new RegExp(basename(file).replace(/[.]/g, "\\.")) }).waitFor();
  // A second time: it asks before it replaces.
  await page.locator("input[type=file]").setInputFiles(files[0]);
  await click("Replace it");
  expect();
  await page.getByRole("button", { name: "Replace it" }).waitFor({ state: "detached" });
  // What was brought is what is chosen, and nothing else of the folder.
  const ticked = () => page.locator(".list .item:has(input:checked) .name").allInnerTexts();
  assert.deepEqual((await ticked()).sort(), [basename(files[0])], "what was brought last is chosen");
  await page.locator("input[type=file]").setInputFiles(files);
  for (const file of files) { await page.getByRole("button", { name: "Use the one that is there" }).first().click(); expect(); }
  await page.locator(".sending li").first().waitFor({ state: "detached" });
  assert.deepEqual((await ticked()).sort(), files.map((file) => basename(file)).sort(), "what was brought is chosen");
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
  if (await page.getByRole("button", { name: "Map", exact: true }).count()) {
    await page.locator(".maplibregl-canvas").waitFor();
    done("map");
  }
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
  // A part that cannot be says so where it was written, and what to do.
  await from.fill("1e6");
  await from.press("Enter");
  const why = page.locator(".triminput .fault").first();
  await why.getByText(/cannot begin at .* it ends at .* Move its end first/).waitFor();
  await from.fill("soon");
  await from.press("Enter");
  await why.getByText(/is no number of seconds/).waitFor();
  assert.equal(await from.getAttribute("aria-invalid"), "true");
  await look("3-refused");
  await from.fill("-5");
  await from.press("Enter");
  await page.getByText(/The log begins at/).waitFor();
  assert.equal(Number(await from.inputValue()), first);
  await page.getByRole("slider", { name: "End of the part to use" }).press("ArrowLeft");
  await page.getByRole("button", { name: "Use all" }).click();
  assert.equal(Number(await from.inputValue()), first);
  await page.getByRole("button", { name: /^Antenna: forward .* right/ }).press("Shift+ArrowRight");
  await see(/The antenna is/);
  const names = await page.locator(".place text").evaluateAll((all) => all.map((name) => name.getBoundingClientRect().toJSON()));
  assert.equal(names.length, 4, "two points in two views");
  assert.ok(names.every((a, i) => names.slice(i + 1).every((b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top)), "no name covers another");
  await look("3-look");
  done("looked at");

  await page.getByRole("link", { name: "Choose what to find out" }).click();
  await see("What do you want to find out?");
  await page.getByRole("button", { name: "Navigation", exact: true }).waitFor();
  await page.locator(".kinds .verdict").first().waitFor();
  const kinds = await page.locator(".kinds > li").evaluateAll((all) => all.map((one) => ({ kind: one.querySelector("h2").textContent, verdict: one.querySelector(".verdict")?.textContent, filled: one.querySelector("button.main") !== null })));
  assert.ok(kinds.every((one) => one.verdict), "each says whether the log suffices");
  assert.ok(kinds.some((one) => one.filled) && new Set(kinds.filter((one) => one.filled).map((one) => one.verdict)).size === 1, "the best stand out");
  assert.match(kinds.find((one) => /^Calibration/.test(one.kind)).verdict, /Not known|does not suffice/);
  await look("4-choose");
  await page.getByRole("button", { name: "Navigation", exact: true }).click();

  const text = page.getByRole("textbox", { name: "The configuration in TOML" });
  await text.waitFor();
  await see("in step with the form");
  assert.match(await text.inputValue(), /lever_arm_m = \[0\.1, 0(\.0)?, 0(\.0)?\]/, "the drawing went into the configuration");
  assert.match(await text.inputValue(), /\[truth\]\npath = "reference\.csv"/, "the reference is used");
  const before = await text.inputValue();
  await page.getByRole("searchbox").fill("step_s");
  await page.locator(".formside .field input").first().fill("0.2");
  await page.keyboard.press("Enter");
  await page.waitForFunction((old) => document.querySelector("textarea").value !== old, before);
  assert.match(await text.inputValue(), /step_s = 0\.2/, "the form writes into the text");
  assert.ok((await text.inputValue()).split("\n").filter((l) => l.startsWith("#")).length > 10, "comments are kept");
  await page.getByRole("searchbox").fill("");
  // A choice that is a key of the configuration goes into it, and out again.
  const smooth = page.getByRole("checkbox", { name: /^Smooth/ });
  for (const wanted of [true, false]) {
    await smooth.click();
    await page.waitForFunction((has) => document.querySelector("textarea").value.includes('kind = "rts"') === has, wanted);
    await see("in step with the form");
  }
  await look("5-configure");
  const right = await text.inputValue();
  await text.fill(right.replace(/^path = .*$/m, "path = 3"));
  await page.locator(".toml .findings .bad").first().waitFor();
  assert.equal(await page.locator(".gutter .wrong").count() > 0, true, "the line of the error is shown");
  await page.getByRole("button", { name: "Run it" }).click();
  await page.waitForFunction(() => document.activeElement?.matches(".notice[role=alert]"));
  assert.match(await page.evaluate(() => document.activeElement.textContent), /1 error to correct first/);
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
  await page.locator(".plan .legend").getByText("reference").waitFor();
  await page.getByRole("slider", { name: "Instant" }).press("End");
  await page.getByRole("slider", { name: "Instant" }).press("PageDown");
  await page.locator(".attitude figcaption").getByText(/Heading/).waitFor();
  await page.locator("iframe.report").scrollIntoViewIfNeeded();
  await page.frameLocator("iframe.report").locator("h1").first().waitFor();
  for (const [at, command] of [/^strapdown verify first$/, /^strapdown navigate first\.toml .*--out first-again/].entries()) {
    await page.getByRole("button", { name: "Copy" }).nth(at).click();
    assert.match(await page.evaluate(() => navigator.clipboard.readText()), command);
  }
  await look("7-result");
  const [zip] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: /\.zip/ }).click()]);
  assert.equal(await zip.failure(), null, "the result is downloaded");
  done("result");

  await page.goto(`${address}#/configure`);
  await see("in step with the form");
  await name.fill("second");
  await page.getByRole("checkbox", { name: /^Smooth/ }).click();
  await page.waitForFunction(() => document.querySelector("textarea").value.includes('kind = "rts"'));
  await see("in step with the form");
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
  if (await page.getByText("does not listen itself").count()) expect();
  await look("9-live");
  await page.goto(`${address}#/result/none`);
  await page.getByRole("alert").waitFor();
  expect();
});
