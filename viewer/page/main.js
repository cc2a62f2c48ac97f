// The page of `strandline view`: neuroglancer laid out as the server's state says, and kept up with a store that is still written.
//
// `state.json` is a state of neuroglancer; sources in it that begin with a slash lie on this server. `live.json` says what is
// running, how far it is, and a number that grows with every shard; when it does, what was read of the store is read again.

import "neuroglancer/unstable/util/polyfills.js";
import "neuroglancer/unstable/layer/enabled_frontend_modules.js";
import "neuroglancer/unstable/datasource/enabled_frontend_modules.js";
import "neuroglancer/unstable/kvstore/enabled_frontend_modules.js";
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
  for (const { layer } of viewer.layerManager.managedLayers) {
    for (const data of layer?.dataSources ?? []) {
      for (const loaded of data.loadState?.subsources ?? []) {
        loaded.subsourceEntry.subsource.volume?.rpc && invalidate(loaded.subsourceEntry.subsource.volume);
      }
    }
  }
};

const invalidate = (volume) => {
  for (const scales of volume.getSources({ displayRank: 3, multiscaleToViewTransform: new Float32Array(9), modelChannelDimensionIndices: [] })) {
    for (const { chunkSource } of scales) chunkSource.invalidateCache();
  }
};

const follow = async (viewer, before) => {
  const live = await load("live.json").catch(() => undefined);
  if (live === undefined) {
    status.textContent = "the server has ended";
    return;
  }
  status.textContent = live.text;
  if (before !== undefined && live.written !== before) readAgain(viewer);
  if (live.running) setTimeout(() => follow(viewer, live.written), 1000 * PATIENCE);
};

const viewer = setupDefaultViewer();
if (location.hash.length < 3) viewer.state.restoreState(withSources(await load("state.json")));
follow(viewer, undefined);
