// Opens a folder of several stores and chooses the last of them, as somebody would; then that is taken away and brought back.
//
//     STRANDLINE=PATH node choose.mjs FOLDER STORE,STORE,...
//
// STORE: the names of the stores in it, in order. Ends with 1 where the choice, the layers that are seen, the report or what is said is not
// that of the store that was chosen.

import { renameSync } from "node:fs";
import { join } from "node:path";
import { launch, serve } from "./browser.mjs";

// Seconds until a page on a busy machine has heard of what is new.
const PATIENCE = 120;

const [folder, list] = process.argv.slice(2);
const stores = list.split(",");
const { server, url } = await serve(folder);
const browser = await launch({ width: 1280, height: 800 });
const faults = [];
try {
  const page = await browser.newPage();
  page.on("pageerror", (error) => faults.push(`page error: ${error.message}`));
  await page.goto(url);
  // Layers that are seen are those of this store, and so is the report; the line says so.
  const shows = async (store, status) => {
    const is = (store, address, status) => {
      const seen = window.viewer?.layerManager.managedLayers.filter((layer) => layer.visible) ?? [];
      const reports = [...document.querySelectorAll("#reports a")].map((link) => link.getAttribute("href"));
      const said = document.getElementById("status").textContent === status;
      return said && seen.length > 0 && seen.every((layer) => layer.name.startsWith(`${store.replace(/\.zarr$/, "")} `)) && reports.includes(address);
    };
    const address = `/data/${encodeURIComponent(store)}/report.html`;
    await page
      .waitForFunction(is, { timeout: 1000 * PATIENCE, polling: 500 }, store, address, status)
      .catch(() => faults.push(`the page does not show ${store} and say ${JSON.stringify(status)}`));
  };
  await shows(stores[0], "");
  const offered = await page.evaluate(() => [...document.querySelectorAll("#choice option")].map((option) => option.value));
  if (offered.join() !== stores.join()) faults.push(`the page offers ${offered}`);
  const last = stores[stores.length - 1];
  await Promise.all([page.waitForNavigation(), page.select("#choice", last)]);
  await shows(last, "");
  renameSync(join(folder, last), `${folder}.away`);
  await shows(last, `${last} is gone`);
  renameSync(`${folder}.away`, join(folder, last));
  await shows(last, "");
} finally {
  server.kill("SIGINT");
  await browser.close();
}
faults.forEach((fault) => console.error(`${folder}: ${fault}`));
if (faults.length === 0) console.log(`${folder}: each of ${stores.length} stores can be chosen`);
process.exit(faults.length === 0 ? 0 : 1);
