// Drive a live session: listen, let a synthetic phone send as Sensor Logger does, see its attitude.
//
//   node test/live.mjs ADDRESS SHOTS

import assert from "node:assert/strict";
import { open } from "./drive.mjs";

const [address, shots] = process.argv.slice(2);
const { page, look, click, see, done, run } = await open(address, shots);

/** Half a second of a phone that lies flat and turns about its z by 20 deg a second. */
function message(number) {
  const payload = [];
  for (let i = 0; i < 50; i++) {
    const time = 1.7e18 + (number * 0.5 + i * 0.01) * 1e9;
    payload.push({ name: "gyroscope", time, accuracy: 3, values: { x: 0, y: 0, z: (20 * Math.PI) / 180 } });
    payload.push({ name: "totalacceleration", time, accuracy: 3, values: { x: 0, y: 0, z: 9.80665 } });
  }
  return JSON.stringify({ messageId: number, sessionId: "walk", deviceId: "phone-1", payload });
}

await run(async () => {
  await page.goto(`${address}#/live`);
  await see("Start listening");
  // What a phone cannot reach is said before it listens, and what it can is one click away.
  await see(/A phone cannot reach 127\.0\.0\.1:8437/);
  await page.getByRole("radio", { name: /^Phones in the same network/ }).check();
  await see(/is reached from the network/);
  assert.equal(await page.getByRole("textbox", { name: "Address" }).inputValue(), "0.0.0.0:8437");
  assert.equal(await page.getByText("A phone cannot reach").count(), 0);
  await page.getByRole("textbox", { name: "Address" }).fill("127.0.0.1:0");
  await page.getByRole("textbox", { name: "Address" }).press("Enter");
  await page.getByRole("combobox", { name: "Phone" }).selectOption("android");
  await look("live-1-begin");
  await click("Listen");
  const shown = page.locator(".pairing code").first();
  await shown.waitFor();
  // Of this computer alone: a code would lead a phone nowhere.
  await see(/Only programs on this computer reach this address/);
  assert.equal(await page.getByRole("img", { name: /^Code to scan/ }).count(), 0);
  const target = await shown.innerText();
  const send = async (from, to) => {
    for (let i = from; i < to; i++) {
      const answer = await fetch(target, { method: "POST", body: message(i), headers: { "Content-Type": "application/json" } });
      assert.equal(answer.status, 200);
      await new Promise((resolve) => setTimeout(resolve, 500));
    }
  };
  await send(0, 24);
  const words = page.locator(".attitude figcaption");
  // Without a magnetometer a heading is from the start: 20 deg a second to the left, for 11.9 s. Each angle has its bound.
  await words.getByText(/Facing 1[12]\d\.\d° to the right of the direction at the start \(±.[\d.]+°\), nose .*\(±.*level across \(±/).waitFor();
  const first = await words.innerText();
  done(`seen: ${first}`);
  await look("live-2-receiving");
  // A phone that sends no more is silent, and what is shown is of then.
  await see(/^Silent for/);
  await see(/Nothing has come for .*: what is shown is of 1[12]\.\d+ s/);
  // It goes on after a pause, over which no curve is drawn.
  await send(40, 46);
  await see("Receiving");
  await look("live-3-after-a-pause");
  await see(/^Silent for/);
  await page.reload();
  // The states before the reload are there again, and how long it has been silent.
  await see(/^Silent for/);
  await see(/^0\.\d+ to 2[23]\.\d+ s$/);
  await click("Stop listening");
  await page.getByText("Stop listening").waitFor({ state: "detached" });
  await look("live-4-ended");
  // What was received is a log like any other.
  await click("Look into phone-1");
  await see("The traces");
  await page.locator(".plot canvas").first().waitFor();
  await look("live-5-log");
  done("live");
});
