// The page of `strandline view`: neuroglancer laid out as the server's state says, and kept up with a store that is still written.
//
// `state.json` is a state of neuroglancer; sources in it that begin with a slash lie on this server. `live.json` says what is
// running, how far it is, a number that grows with every shard (when it does, what was read of the store is read again), and one
// that is another when there are other layers.

import "neuroglancer/unstable/util/polyfills.js";
import "neuroglancer/unstable/layer/enabled_frontend_modules.js";
import "neuroglancer/unstable/datasource/enabled_frontend_modules.js";
import "neuroglancer/unstable/kvstore/enabled_frontend_modules.js";
import { makeLayer } from "neuroglancer/unstable/layer/index.js";
import { setupDefaultViewer } from "neuroglancer/unstable/ui/default_viewer_setup.js";

// Seconds between two looks at a store that is written.
const PATIENCE = 2;

const onThisServer = (value) => {
  if (typeof value === "string") return value.replace(/^((?:[a-z]+:\/\/)?)(\/(?!\/))/, (_, scheme, path) => scheme + location.origin + path);
  if (Array.isArray(value)) return value.map(onThisServer);
  return value;
};

const withSources = (state) => ({
  ...state,
  layers: state.layers.map((layer) => ({
    ...layer,
    source: Array.isArray(layer.source) ? layer.source.map(withUrl) : withUrl(layer.source),
  })),
});

const withUrl = (source) => (source && source.url ? { ...source, url: onThisServer(source.url) } : onThisServer(source));

const load = async (name) => (await fetch(name, { cache: "no-store" })).json();

const status = document.getElementById("status");

// Reads again what was read of the chunks; layers, position and colours stay.
const readAgain = (viewer) => {
  for (const source of viewer.chunkManager.memoize.map.values()) source.invalidateCache?.();
};

// Layers as the server gave them, by their names.
let given = new Map();

// Puts in layers that are new or have another source, takes out those that are gone; leaves all others as they are.
const followLayers = async (viewer) => {
  const state = withSources(await load("state.json"));
  if (given.size === 0) return open(viewer, state);
  const now = byName(state);
  for (const name of given.keys()) {
    if (!now.has(name)) remove(viewer, name);
  }
  for (const [name, layer] of now) {
    const before = given.get(name);
    const there = viewer.layerManager.getLayerByName(name);
    if (there !== undefined && (before === undefined || JSON.stringify(before) === JSON.stringify(layer))) continue;
    const visible = there?.visible ?? layer.visible ?? true;
    remove(viewer, name);
    viewer.layerSpecification.add(makeLayer(viewer.layerSpecification, name, { ...layer, visible }));
  }
  given = now;
};

const remove = (viewer, name) => {
  const layer = viewer.layerManager.getLayerByName(name);
  if (layer !== undefined) viewer.layerManager.removeManagedLayer(layer);
};

const follow = async (viewer, before) => {
  const live = await load("live.json").catch(() => undefined);
  if (live === undefined) {
    status.textContent = "the server has ended";
    return;
  }
  status.textContent = live.text;
  if (before !== undefined && live.shown !== before.shown) await followLayers(viewer);
  if (before !== undefined && live.written !== before.written) readAgain(viewer);
  // Once more when it is complete: the last shards have come since.
  if (live.running || before?.running) setTimeout(() => follow(viewer, live), 1000 * PATIENCE);
};

// Lays out all that there is; nothing of a store that was just begun.
const open = (viewer, state) => {
  given = byName(state);
  if (given.size > 0) viewer.state.restoreState(state);
};

const byName = (state) => new Map(state.layers.map((layer) => [layer.name, layer]));

// A store that was just begun has nothing to show yet, and nobody is to be asked for a layer then.
const viewer = setupDefaultViewer({ showLayerDialog: false, resetStateWhenEmpty: false });
// Who opens a link to a place of the page finds that. Asked before the page writes its own place there.
const isLink = location.hash.length >= 3;
const first = withSources(await load("state.json"));
if (isLink) given = byName(first);
else open(viewer, first);
follow(viewer, undefined);
