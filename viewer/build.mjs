// Bundles the page: `page/main.js` with neuroglancer, its two workers, and what these load, each packed with gzip, into FOLDER.
//
//     node build.mjs FOLDER
//
// Of neuroglancer only what strandline writes is taken in: zarr, precomputed meshes and annotations that the state holds itself.

import { build } from "esbuild";
import { copyFileSync, existsSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { basename, dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const here = dirname(fileURLToPath(import.meta.url));
const out = resolve(process.argv[2]);
const library = join(here, "node_modules", "neuroglancer");

// What no store of ours needs, and which would be a third of the page.
const LEFT_OUT = new Set(["jxl_decoder.wasm"]);

// What is another here than in neuroglancer: files, the words in them, and what takes their place.
const CHANGES = [
  // A shard that was not there may be there when it is asked for again: a store that lives fills while it is looked at. What is found
  // missing is therefore not remembered.
  ["codec/sharding_indexed/decode.js", "if (shardIndex === void 0) {", (words) => `${words} this.indexCache.chunks.get(this.indexCache.encodeKeyFunction(key.base))?.freeSystemMemory();`],
  // What is of a unit that is not known is drawn without one; the state says what is known of others' spellings.
  ["datasource/zarr/ome.js", "throw new Error(`Unsupported unit: ${JSON.stringify(unit)}`);", () => 'return { unit: "", scale: 1 };'],
  // Labels are often of 64 bits with a sign, as Zarr 2 may have them here, and masks of truth values, which take a byte.
  [
    "zarr/metadata/parse.js",
    "verifyEnumString(x, DataType, /^[a-z0-9]+$/)",
    () => 'verifyEnumString({ int64: "uint64", bool: "uint8" }[x] ?? x, DataType, /^[a-z0-9]+$/)',
  ],
  ["zarr/metadata/parse.js", "function parseFillValue(dataType, value) {", (words) => `${words} if (typeof value === "boolean") value = Number(value);`],
  ["util/numpy_dtype.js", 'supportedDataTypes.set("|i1", {', (words) => `supportedDataTypes.set("|b1", { endianness: Endianness.LITTLE, dataType: DataType.UINT8 });\n${words}`],
  // The page's title tells whose page it is.
  ["ui/title.js", "${value} - neuroglancer", () => "${value} - strandline"],
  ["ui/title.js", 'document.title = "neuroglancer"', () => 'document.title = "strandline"'],
];
const changed = (path, source) => {
  const own = CHANGES.filter(([file]) => path.endsWith(file));
  return own.reduce((text, [file, words, other]) => {
    if (text.split(words).length !== 2) throw new Error(`${file} has changed: look again at ${JSON.stringify(words)}`);
    return text.replace(words, () => other(words));
  }, source);
};

// Files beside a module are named relative to it; in the bundle all lie in one folder.
const flat = {
  name: "flat",
  setup(bundling) {
    bundling.onLoad({ filter: /neuroglancer\/lib\/.*\.js$/ }, ({ path }) => {
      const source = changed(path, readFileSync(path, "utf8"));
      const contents = source.replace(/new URL\(\s*"([^"]+)",\s*import\.meta\.url/g, (_, file) => {
        if (file.endsWith(".wasm") && !LEFT_OUT.has(basename(file))) copyFileSync(join(dirname(path), file), join(out, basename(file)));
        return `new URL("./${basename(file)}", import.meta.url`;
      });
      return { contents, loader: "js" };
    });
    bundling.onResolve({ filter: /\.svg\?raw$/ }, async ({ path, resolveDir }) => {
      const found = await bundling.resolve(path.replace("?raw", ""), { resolveDir, kind: "import-statement" });
      return { path: found.path, namespace: "raw" };
    });
    bundling.onLoad({ filter: /.*/, namespace: "raw" }, ({ path }) => ({ contents: readFileSync(path, "utf8"), loader: "text" }));
  },
};

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
const { metafile } = await build({
  entryPoints: {
    main: join(here, "page", "main.js"),
    "chunk_worker.bundle": join(library, "lib", "chunk_worker.bundle.js"),
    "async_computation.bundle": join(library, "lib", "async_computation.bundle.js"),
  },
  outdir: out,
  bundle: true,
  metafile: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "none",
  conditions: [
    "neuroglancer/datasource:none_by_default",
    "neuroglancer/datasource/zarr:enabled",
    "neuroglancer/datasource/precomputed:enabled",
    "neuroglancer/kvstore:none_by_default",
    "neuroglancer/kvstore/http:enabled",
  ],
  loader: { ".html": "text", ".svg": "dataurl" },
  plugins: [flat],
});

// The licence of every package that is in the bundle.
const packages = new Set(Object.keys(metafile.inputs).map((path) => /.*node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(path)?.[1]).filter(Boolean));
packages.delete("ikonate"); // Ours.
const licences = [...packages].sort().map((name) => {
  const folder = join(here, "node_modules", name);
  const { version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const file = ["LICENSE", "LICENSE.md", "LICENSE.txt"].map((file) => join(folder, file)).find(existsSync);
  const changed = name === "neuroglancer" ? "Changed here: shards that are not there are asked for again, units that are not known are none, truth values and signed numbers of 64 bits are read, modules lie in one folder, titles end in strandline.\n\n" : "";
  return `${name} ${version}, ${license}\n\n${changed}${readFileSync(file, "utf8").trim()}\n`;
});
writeFileSync(join(out, "LICENSES"), licences.join(`\n${"-".repeat(80)}\n\n`));
copyFileSync(join(here, "page", "index.html"), join(out, "index.html"));
for (const file of readdirSync(out).filter((file) => file !== "LICENSES")) {
  const path = join(out, file);
  // No time and no name inside: the same sources give the same bytes.
  writeFileSync(`${path}.gz`, gzipSync(readFileSync(path), { level: 9 }));
  rmSync(path);
}
