// A browser without a window, and the server of what it looks at.

import { spawn } from "node:child_process";
import { createInterface } from "node:readline";
import puppeteer from "puppeteer-core";

export const serve = async (store) => {
  const server = spawn(process.env.STRANDLINE, ["view", store, "--no-open", "--for", "10min"], { stdio: ["ignore", "pipe", "inherit"] });
  const lines = createInterface({ input: server.stdout });
  for await (const line of lines) return { server, url: line.trim() };
  throw new Error(`strandline view ${store} said nothing`);
};

export const launch = (defaultViewport) =>
  puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
    defaultViewport,
  });
