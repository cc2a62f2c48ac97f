// Opens the reports of stores in Chromium, with every request blocked and counted, and looks at how they lie on the page.
//
//     KEEP=FOLDER node read.mjs STORE PICTURES,PLOTS [STORE PICTURES,PLOTS]...
//
// STORE may be a page itself, such as the summary of a batch. Each is opened 1280 and 390 pixels wide, light and dark. Pictures of the pages go to KEEP. Ends with 1 where a request would
// have left, the page said anything to the console, a picture is missing, or something is wider than the page.

import { basename, join } from "node:path";
import { pathToFileURL } from "node:url";
import puppeteer from "puppeteer-core";

const WIDTHS = [1280, 390];

// What the page holds, and what of it lies outside of its width or has no size.
const measure = () => {
  const width = window.innerWidth;
  const outside = [...document.querySelectorAll("main *")].filter((node) => {
    const box = node.getBoundingClientRect();
    return box.width > 0 && (box.right > width + 0.5 || box.left < -0.5) && !node.closest("svg");
  });
  const pictures = [...document.images];
  const plots = [...document.querySelectorAll("svg")];
  const hidden = [...pictures, ...plots].filter((node) => node.getBoundingClientRect().width < 90 || node.getBoundingClientRect().height < 60);
  return {
    scroll: document.documentElement.scrollWidth,
    outside: outside.map((node) => `${node.tagName} ${node.textContent.slice(0, 40)}`),
    empty: pictures.filter((picture) => picture.naturalWidth === 0).length,
    hidden: hidden.length,
    figures: [pictures.length, plots.length],
    small: Math.min(...plots.flatMap((plot) => [...plot.querySelectorAll("text")]).map((text) => text.getBoundingClientRect().height), 99),
  };
};

const read = async (browser, store, expected, width, scheme) => {
  const faults = [];
  const url = pathToFileURL(store.endsWith(".html") ? store : join(store, "report.html")).href;
  const page = await browser.newPage();
  await page.setViewport({ width, height: 900 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
  await page.setRequestInterception(true);
  page.on("request", (request) => {
    if (request.url() === url || request.url().startsWith("data:")) return request.continue();
    faults.push(`asks for ${request.url()}`);
    return request.abort();
  });
  page.on("console", (message) => faults.push(`says ${message.text()}`));
  page.on("pageerror", (error) => faults.push(`fails with ${error.message}`));
  page.on("dialog", (dialog) => faults.push(`opens ${dialog.message()}`) && dialog.dismiss());
  await page.goto(url, { waitUntil: "networkidle0" });
  const found = await page.evaluate(measure);
  if (found.scroll > width) faults.push(`is ${found.scroll} pixels wide`);
  found.outside.forEach((what) => faults.push(`has outside of its width: ${what}`));
  if (found.empty > 0 || found.hidden > 0) faults.push(`${found.empty} pictures are empty, ${found.hidden} figures are too small`);
  if (found.figures.join() !== expected) faults.push(`has ${found.figures.join()} pictures and plots, not ${expected}`);
  if (found.small < 8) faults.push(`has letters in a plot ${found.small.toFixed(1)} pixels high`);
  await page.screenshot({ path: join(process.env.KEEP, `${basename(store).replace(/\W/g, "-")}-${width}-${scheme}.png`), fullPage: true });
  await page.close();
  console.log(`${basename(store)}, ${width} pixels, ${scheme}: ${faults.length === 0 ? "good" : faults.join("; ")}`);
  return faults.length === 0;
};

const browser = await puppeteer.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] });
let good = true;
const given = process.argv.slice(2);
for (let n = 0; n + 1 < given.length; n += 2) {
  for (const width of WIDTHS) {
    for (const scheme of ["light", "dark"]) good = (await read(browser, given[n], given[n + 1], width, scheme)) && good;
  }
}
await browser.close();
process.exit(good ? 0 : 1);
