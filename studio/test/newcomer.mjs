// A newcomer with the samples: the crash by the case that comes with it, and two recorders of one
// crash, mounted in two ways, whose questions are answered one by one.
//
//   node test/newcomer.mjs ADDRESS SHOTS ONE OTHER
//
// ONE and OTHER are logs of two recorders.

import assert from "node:assert/strict";
import { basename } from "node:path";
import { open } from "./drive.mjs";

const [address, shots, ...files] = process.argv.slice(2);
const { page, look, click, see, done, run } = await open(address, shots);

await run(async () => {
  await page.goto(address);
  await click("A simulated crash");
  await page.getByRole("checkbox", { checked: true }).first().waitFor();
  await click(/^Look into/);
  await see("The traces");
  await page.getByRole("link", { name: "Choose what to find out" }).click();
  await page.getByRole("button", { name: "Crash", exact: true }).click();
  await see(/is a configuration for these files/);
  await see(/The truth is a delta-V of 63\.1 km\/h/);
  await look("newcomer-0-offered");
  await click("Use sample-crash/case.toml");
  await page.locator(".ask").first().waitFor({ state: "detached" });
  await see("in step with the form");
  await see(/^This is sample-crash\/case\.toml of the folder\./);
  assert.equal(await page.getByText("What was found while proposing it").count(), 0);
  await look("newcomer-0-used");
  await click("Run it");
  await page.getByRole("link", { name: "See the result" }).waitFor({ timeout: 600_000 });
  await page.getByRole("link", { name: "See the result" }).click();
  const dial = page.getByRole("img", { name: /^Direction of force on a clock about the vehicle/ });
  await dial.waitFor();
  for (const one of await page.locator(".drawings img").all()) await one.scrollIntoViewIfNeeded();
  await page.waitForFunction(() => [...document.querySelectorAll(".drawings img")].every((one) => one.complete && one.naturalWidth > 0));
  const drawn = await page.locator(".drawings figcaption").allInnerTexts();
  assert.ok(["Direction of force", "Path from above", "Severity"].every((one) => drawn.includes(one)), drawn.join(", "));
  await see(/^63\.\d/);
  await look("newcomer-1-result");
  done("a result of the sample");

  await page.getByRole("navigation").getByRole("link", { name: "Files" }).first().click();
  // All of the folder by the keyboard, and no configuration among what can be ticked.
  const ticks = page.getByRole("group", { name: "Choose those of one recording" });
  await page.getByRole("button", { name: "Choose none" }).press("Enter");
  assert.equal(await ticks.getByRole("checkbox", { checked: true }).count(), 0);
  await page.getByRole("button", { name: "Choose all" }).press("Enter");
  assert.equal(await ticks.locator("> .item input:not(:checked)").count(), 0);
  assert.equal(await ticks.getByText(/\.toml/).count(), 0);
  done("all of the folder by the keyboard");
  // A folder, and then a file of it: not both, but by a click.
  await page.getByRole("button", { name: "Choose none" }).click();
  const [folder, record] = ["sample-crash", "sample-crash/imu1_gyro.csv"].map((name) => ticks.locator(".item", { has: page.getByText(name, { exact: true }) }).getByRole("checkbox"));
  await folder.check();
  await ticks.locator("details:not([open]) > summary").click();
  await record.check();
  assert.equal(await folder.isChecked(), false, "what was chosen before is not");
  await click("Choose this, too");
  assert.ok(await folder.isChecked() && await record.isChecked());
  await page.locator("input[type=file]").setInputFiles(files);
  await page.locator(".sending").waitFor({ state: "detached" });
  await click(/^Look into 2/);
  await see("Is this right?");
  const names = files.map((one) => basename(one));
  const ask = (name) => page.locator(".ask", { hasText: name });
  for (const name of names) await ask(name).waitFor();
  await look("newcomer-2-two-recorders");
  await ask(names[0]).getByRole("button", { name: "x forward, y left, z up" }).click();
  await ask(names[0]).waitFor({ state: "detached" });
  await page.getByRole("button", { name: `Take back: ${names[0]} axes: forward-left-up` }).click();
  await ask(names[0]).getByRole("button", { name: "x forward, y left, z up" }).click();
  await ask(names[0]).waitFor({ state: "detached" });
  await ask(names[1]).getByRole("button", { name: /^x right, y forward, z up/ }).click();
  await ask(names[1]).waitFor({ state: "detached" });
  await page.getByRole("link", { name: "Choose what to find out" }).click();
  await page.getByRole("button", { name: "Crash", exact: true }).click();
  const text = page.getByRole("textbox", { name: "The configuration in TOML" });
  await text.waitFor();
  const toml = await text.inputValue();
  assert.match(toml, /angles_deg = \[180(\.0)?, 0(\.0)?, 0(\.0)?\]/);
  assert.match(toml, /angles_deg = \[180(\.0)?, 0(\.0)?, 90(\.0)?\]/);
  await see(new RegExp(`${names[0]} axes: forward-left-up`));
  await look("newcomer-3-case-of-two");
  done("two recorders");
});
