// Icons of the page, drawn for this project: lines on a field of 24 x 24. Written to FOLDER as the files that neuroglancer asks for.
//
//     node icons.mjs FOLDER

import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const LINES = {
  "arrow-left": "M20 12H4M10 6l-6 6 6 6",
  "arrow-right": "M4 12h16M14 6l6 6-6 6",
  "arrow-up": "M12 20V4M6 10l6-6 6 6",
  bin: "M5 7h14M9 7V4h6v3M7 7l1 13h8l1-13",
  camera: "M4 8h4l2-3h4l2 3h4v11H4zM12 10a3 3 0 1 0 .01 0",
  close: "M6 6l12 12M18 6L6 18",
  "code-alt": "M8 7l-5 5 5 5M16 7l5 5-5 5M14 4l-4 16",
  "controls-alt": "M4 7h9M17 7h3M15 5v4M4 17h3M11 17h9M9 15v4",
  copy: "M9 9h11v11H9zM5 15H4V4h11v1",
  cursor: "M6 4l12 8-6 1-2 6z",
  "eye-crossed": "M2 12s4-6 10-6 10 6 10 6-4 6-10 6-10-6-10-6zM4 20L20 4",
  eye: "M2 12s4-6 10-6 10 6 10 6-4 6-10 6-10-6-10-6zM12 9a3 3 0 1 0 .01 0",
  filter: "M4 5h16l-6 7v6l-4 2v-8z",
  help: "M9 9a3 3 0 1 1 4 3c-1 .5-1 1-1 2M12 18v.5",
  layers: "M12 4l9 5-9 5-9-5zM3 14l9 5 9-5",
  list: "M8 6h12M8 12h12M8 18h12M4 6h.5M4 12h.5M4 18h.5",
  maximise: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  pause: "M8 5v14M16 5v14",
  play: "M7 4l12 8-12 8z",
  plus: "M12 5v14M5 12h14",
  rotate: "M20 12a8 8 0 1 1-3-6M17 2v5h-5",
  search: "M10 4a6 6 0 1 0 .01 0M15 15l5 5",
  settings: "M12 9a3 3 0 1 0 .01 0M12 3v3M12 18v3M3 12h3M18 12h3M6 6l2 2M16 16l2 2M18 6l-2 2M8 16l-2 2",
  star: "M12 3l3 6 6 1-4.500 4.500 1 6.500-5.500-3-5.500 3 1-6.500L3 10l6-1z",
  tool: "M14 6a4 4 0 0 1 5 5l-8 8-4-4 8-8",
  video: "M4 7h11v10H4zM15 11l5-3v8l-5-3",
};

const folder = join(process.argv[2], "icons");
mkdirSync(folder, { recursive: true });
for (const [name, path] of Object.entries(LINES)) {
  const attributes = 'xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2"';
  writeFileSync(join(folder, `${name}.svg`), `<svg ${attributes}><path d="${path}"/></svg>\n`);
}
