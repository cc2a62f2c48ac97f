// Opens stores with `strandline view` in Chromium and looks at what is drawn.
//
//     STRANDLINE=PATH KEEP=FOLDER node look.mjs STORE WHAT,WHAT,... [STORE WHAT,...]...
//
// WHAT of a store that is still written: what is to be seen now, a slash, and what is to be seen on the same page when it is complete.
// WHAT: image (greys that differ from pixel to pixel), labels (a coloured tint over a section), surface (colour in the view of space), marks (points of
// their own yellow). Pictures go to KEEP. Ends with 1 where something is missing, a request failed or the page had an error, where the page
// of a store that is still written does not stay where it was moved to, or where one of another does not say that the store was taken away,
// that it is there again, or that the server has ended.

import { renameSync } from "node:fs";
import { basename, join } from "node:path";
import { PNG } from "pngjs";
import { launch, serve } from "./browser.mjs";

const WIDTH = 1280;
const HEIGHT = 800;
// Pixels of a picture that have to show what is looked for; the frame around data has some at its edges that are no pure yellow.
const ENOUGH = 2000;
// Bytes a second, few enough for pictures to be taken while a page loads.
const SLOW = { offline: false, latency: 1, downloadThroughput: 2e6, uploadThroughput: -1 };
// The part of a section that is there which has one colour, at most.
const MOST_OF_ONE = 0.2;
// Seconds until a page on a busy machine has drawn everything.
const PATIENCE = 120;

// Section panels are the left half and the upper right quarter, below the bars; the lower right quarter is the view of space.
const isSpace = (x, y) => x > WIDTH / 2 + 4 && y > HEIGHT / 2 + 30 && y < HEIGHT - 30;
const isSection = (x, y) => y > 60 && (x < WIDTH / 2 - 4 || y < HEIGHT / 2 - 4);

const saturation = ([r, g, b]) => Math.max(r, g, b) - Math.min(r, g, b);
const isMark = ([r, g, b]) => Math.abs(r - 255) < 25 && Math.abs(g - 225) < 25 && Math.abs(b - 77) < 40;
// The frame that is drawn around data is pure yellow.
const isFrame = ([r, g, b]) => r > 200 && g > 200 && b < 40;

const isGrey = ([x, y, c]) => isSection(x, y) && saturation(c) < 12;
const differ = (one, other) => isGrey(one) && isGrey(other) && one[2][0] !== other[2][0];
// Pixels of an image differ from the next one almost everywhere; those of words and buttons, which a page has in any case, are few.
const WORDS = 5;

const LOOKS = {
  image: (pixels) => Math.floor(pixels.filter((pixel, n) => n > 0 && differ(pixels[n - 1], pixel)).length / WORDS),
  labels: (pixels) => pixels.filter(([x, y, c]) => isSection(x, y) && saturation(c) > 25 && !isMark(c) && !isFrame(c)).length,
  surface: (pixels) => pixels.filter(([x, y, c]) => isSpace(x, y) && saturation(c) > 25 && !isMark(c) && !isFrame(c)).length,
  marks: (pixels) => pixels.filter(([, y, c]) => y > 60 && isMark(c)).length,
};

const pixelsOf = (picture) => {
  const { width, data } = PNG.sync.read(Buffer.from(picture));
  return Array.from({ length: data.length / 4 }, (_, n) => [n % width, Math.floor(n / width), data.subarray(4 * n, 4 * n + 3)]);
};

// Bytes that were loaded when the middle of the section in the upper left was first to be seen: no colour, such as
// that of labels over nothing, covers more than a part of it.
const firstSeen = async (page, bytes) => {
  const [width, height] = [WIDTH / 4, HEIGHT / 4];
  const clip = { x: WIDTH / 4 - width / 2, y: HEIGHT / 4 - height / 2 + 30, width, height };
  for (const until = Date.now() + 1000 * PATIENCE; Date.now() < until; await new Promise((after) => setTimeout(after, 20))) {
    const counts = new Map();
    for (const [, , colour] of pixelsOf(await page.screenshot({ clip }))) counts.set(colour.join(), (counts.get(colour.join()) ?? 0) + 1);
    if (Math.max(...counts.values()) < MOST_OF_ONE * width * height) return bytes();
  }
};

const said = (page) => page.evaluate(() => document.getElementById("status").textContent);

// The run has ended, and the page has heard of it and drawn what there is.
const completed = async (page) => {
  const over = async () => (await (await fetch("live.json")).json()).text === "" && document.getElementById("status").textContent === "";
  await page.waitForFunction(over, { timeout: 1000 * PATIENCE, polling: 1000 });
  await new Promise((after) => setTimeout(after, 5000));
  await page.waitForFunction(() => window.viewer.isReady(), { timeout: 1000 * PATIENCE, polling: 500 });
};

// Moves a page as somebody would who looks at it, to other slices with marks.
const moveAbout = () => (window.viewer.position.value = window.viewer.position.value.map((at) => at + 10));
// What of a page has to stay while layers come and go.
const whereabouts = () => {
  const { viewer } = window;
  const [first] = viewer.layerManager.managedLayers;
  return JSON.stringify({
    axes: viewer.coordinateSpace.value.names,
    position: [...viewer.position.value],
    layout: viewer.state.toJSON().layout,
    first: [first.name, first.visible],
  });
};

// Opens a page that is told of the first layer alone, as that of a run which has just begun, then of another alone, as where a document is
// written just then, then of nothing, and then of all, the first one with another window; what of the page does not stay as it was.
const arriving = async (browser, url) => {
  const page = await browser.newPage();
  await page.evaluateOnNewDocument(() => {
    const ask = window.fetch;
    window.step = 0;
    window.fetch = async (name, how) => {
      const answer = await ask(name, how);
      const [asked] = String(name).split("?");
      if (asked !== "state.json" && asked !== "live.json") return answer;
      const told = await answer.json();
      const [image, labels] = told.layers ?? [];
      if (asked === "live.json") Object.assign(told, { running: true, shown: String(window.step) });
      else told.layers = [[{ ...image, shaderControls: {} }], [labels], [], told.layers][window.step];
      return new Response(JSON.stringify(told));
    };
  });
  await page.goto(url);
  const has = (names) => window.viewer?.layerManager.managedLayers.map((layer) => layer.name).join() === names && window.viewer.isReady();
  const wait = (names) => page.waitForFunction(has, { timeout: 1000 * PATIENCE, polling: 500 }, names.join());
  const { layers } = await (await fetch(`${url}state.json`)).json();
  const names = layers.map((layer) => layer.name);
  await wait(names.slice(0, 1));
  // The page has asked once how far the run is.
  await new Promise((after) => setTimeout(after, 3000));
  await page.evaluate(moveAbout);
  const before = await page.evaluate(whereabouts);
  const step = (n) => page.evaluate((n) => (window.step = n), n);
  await step(1);
  await wait(names.slice(1, 2));
  await step(2);
  await new Promise((after) => setTimeout(after, 3000));
  await step(3);
  await wait(names);
  const after = await page.evaluate(whereabouts);
  await page.close();
  return after === before ? [] : [`while layers came the page went from ${before} to ${after}`];
};

// Takes the store away and brings it back, and ends the server; what the page does not say of that.
const vanishing = async (page, store, server) => {
  const silent = [];
  const expect = async (text) => {
    const says = (text) => document.getElementById("status").textContent === text;
    await page.waitForFunction(says, { timeout: 20000 }, text).catch(() => silent.push(`the page does not say ${JSON.stringify(text)}`));
  };
  renameSync(store, `${store}.away`);
  await expect(`${basename(store)} is gone`);
  renameSync(`${store}.away`, store);
  await expect("");
  server.kill("SIGINT");
  await expect("the server has ended");
  return silent;
};

const look = async (browser, store, wanted) => {
  const { server, url } = await serve(store);
  const faults = [];
  let bytes = 0;
  try {
    const page = await browser.newPage();
    page.on("pageerror", (error) => faults.push(`page error: ${error.message}`));
    page.on("response", (answer) => answer.status() >= 500 && faults.push(`${answer.status()} ${answer.url()}`));
    page.on("request", (request) => !request.url().startsWith(url) && !/^(data|blob):/.test(request.url()) && faults.push(`leaves: ${request.url()}`));
    const session = await page.createCDPSession();
    await session.send("Network.enable");
    await session.send("Network.emulateNetworkConditions", SLOW);
    session.on("Network.loadingFinished", (event) => (bytes += event.encodedDataLength));
    // Chunks are fetched by workers.
    page.on("workercreated", (worker) => {
      worker.client.on("Network.loadingFinished", (event) => (bytes += event.encodedDataLength));
      worker.client.send("Network.enable").catch(() => {});
      worker.client.send("Network.emulateNetworkConditions", SLOW).catch(() => {});
    });
    await page.goto(url);
    const firstLook = await firstSeen(page, () => bytes);
    if (firstLook !== undefined) console.log(`${store}: ${(firstLook / 1e6).toFixed(2)} MB loaded until the middle slice was to be seen`);
    await page.waitForFunction(() => window.viewer?.layerManager.managedLayers.length > 0 && window.viewer.isReady(), {
      timeout: 1000 * PATIENCE,
      polling: 500,
    });
    let stayed;
    for (const [n, whats] of wanted.split("/").entries()) {
      if (n > 0) {
        await page.evaluate(moveAbout);
        stayed = await page.evaluate(whereabouts);
        await completed(page);
        const now = await page.evaluate(whereabouts);
        console.log(`${store}: the page is at ${now}`);
        if (now !== stayed) faults.push(`the page was at ${stayed} and is at ${now}`);
      }
      await new Promise((after) => setTimeout(after, 1500));
      const picture = await page.screenshot({ path: join(process.env.KEEP, `${store.replace(/\W/g, "-")}${n > 0 ? "-complete" : ""}.png`) });
      const pixels = pixelsOf(picture);
      for (const what of whats.split(",")) {
        const seen = LOOKS[what](pixels);
        console.log(`${store}: ${what} ${seen} (${ENOUGH} asked); the page says ${JSON.stringify(await said(page))}`);
        if (seen < ENOUGH) faults.push(`${what} is not to be seen`);
      }
    }
    console.log(`${store}: ${(bytes / 1e6).toFixed(2)} MB loaded`);
    const about = await page.evaluate(() => [document.title, document.getElementById("name").textContent, document.querySelector("#reports a")?.href]);
    const report = `${url}data/${encodeURIComponent(basename(store))}/report.html`;
    if (about.join() !== [`${basename(store)} - strandline`, basename(store), report].join()) faults.push(`the page calls itself ${about}`);
    if (stayed === undefined) faults.push(...(await arriving(browser, url)), ...(await vanishing(page, store, server)));
    await page.close();
  } finally {
    server.kill("SIGINT");
  }
  faults.forEach((fault) => console.error(`${store}: ${fault}`));
  return faults.length === 0;
};

const browser = await launch({ width: WIDTH, height: HEIGHT });
let good = true;
const given = process.argv.slice(2);
for (let n = 0; n + 1 < given.length; n += 2) good = (await look(browser, given[n], given[n + 1])) && good;
await browser.close();
process.exit(good ? 0 : 1);
