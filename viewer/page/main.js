// The page of `strandline view`: neuroglancer laid out as the server's state says, and kept up with what lies on the disk.
//
// `state.json` is a state of neuroglancer; sources in it that begin with a slash lie on this server. `live.json` says what the page is of,
// which store of which it shows, where its reports are, what is running and how far it is, a number that grows with every shard (when it does, what was read of
// the store is read again), one that is another when there are other layers, and one for each store that is another when another store
// lies in its place.

import "neuroglancer/unstable/util/polyfills.js";
import "neuroglancer/unstable/layer/enabled_frontend_modules.js";
import "neuroglancer/unstable/datasource/enabled_frontend_modules.js";
import "neuroglancer/unstable/kvstore/enabled_frontend_modules.js";
import { initializeLayerFromSpec, makeLayer } from "neuroglancer/unstable/layer/index.js";
import { setupDefaultViewer } from "neuroglancer/unstable/ui/default_viewer_setup.js";

// Seconds between two looks at a store that is written, and at one that is whole.
const PATIENCE = 2;
const PATIENCE_OF_WHOLE = 5;

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

// The store that the page shows: what its address asks for, then what the server gave, also where others come before that later.
let store = new URLSearchParams(location.search).get("store");
const asking = (name) => `?store=${encodeURIComponent(name)}`;

const load = async (name) => (await fetch(store === null ? name : name + asking(store), { cache: "no-store" })).json();

const element = (id) => document.getElementById(id);

// Reads again what was read of the chunks; layers, position and colours stay.
const readAgain = (viewer) => {
  for (const source of viewer.chunkManager.memoize.map.values()) source.invalidateCache?.();
};

// Layers as the server gave them, by their names, and whether an image was among them at any time.
let given = new Map();
let hasLooked = false;

// Puts in layers that are new, at their places, gives others what is new of them, and takes out those that are gone; all else stays as it
// is. The world is held meanwhile: with its last layer neuroglancer would forget its axes and where the page looks.
const followLayers = async (viewer) => {
  const state = withSources(await load("state.json"));
  const now = byName(state);
  // The first image is what there is to look at, after a surface that still moved before it.
  if (given.size === 0 || (!hasLooked && hasImage(now))) return open(viewer, state);
  // A document that is written just then says nothing.
  if (now.size === 0) return;
  const { layerManager, layerSpecification } = viewer;
  const release = layerSpecification.coordinateSpaceCombiner.retain();
  try {
    let place = 0;
    for (const [name, layer] of now) {
      const there = layerManager.getLayerByName(name);
      if (there === undefined) layerSpecification.add(makeLayer(layerSpecification, name, layer), place);
      else update(there, given.get(name), layer);
      place = 1 + layerManager.managedLayers.findIndex((other) => other.name === name);
    }
    for (const name of given.keys()) {
      const gone = now.has(name) ? undefined : layerManager.getLayerByName(name);
      if (gone !== undefined) layerManager.removeManagedLayer(gone);
    }
  } finally {
    release();
  }
  given = now;
};

// Gives a layer what is another than before, and leaves it what was set on the page.
const update = (there, before, layer) => {
  const isNew = ([key, value]) => JSON.stringify(value) !== JSON.stringify(before?.[key]);
  const changed = Object.entries(layer).filter(isNew);
  if (changed.length === 0) return;
  const { visible } = there;
  initializeLayerFromSpec(there, { ...there.toJSON(), ...Object.fromEntries(changed), visible });
};

// Notes that the line has room for; the others are a click away.
const MOST_NOTES = 3;

// What the page is of, the stores that there are, links to reports, and what is to be said of it.
const introduce = ({ name, store, choices, reports, notes, text }) => {
  const linkTo = ({ title, address }) => make("a", { href: address, textContent: title, target: "_blank", rel: "noopener" });
  element("name").textContent = name;
  offer(choices, store);
  element("reports").replaceChildren(...reports.map(linkTo));
  element("status").textContent = text;
  tell(notes);
};

const make = (kind, properties) => Object.assign(document.createElement(kind), properties);

// A choice that somebody has open stays as it is while it says the same.
const offer = (choices, store) => {
  const select = element("choice");
  const told = JSON.stringify(choices);
  if (select.dataset.told !== told) {
    select.dataset.told = told;
    select.replaceChildren(...choices.map((name, n) => make("option", { value: name, textContent: `${n + 1} of ${choices.length}: ${name}` })));
  }
  select.hidden = choices.length === 0;
  select.value = store;
};

const tell = (notes) => {
  const place = element("notes");
  const told = JSON.stringify(notes);
  if (place.dataset.told === told) return;
  place.dataset.told = told;
  const few = notes.length > MOST_NOTES ? notes.slice(0, MOST_NOTES - 1) : notes;
  const rest = notes.slice(few.length);
  place.replaceChildren(few.join("; "));
  if (rest.length === 0) return;
  const more = make("details", { id: "more" });
  const list = make("ul", {});
  list.append(...rest.map((note) => make("li", { textContent: note })));
  more.append(make("summary", { textContent: `${rest.length} more notes` }), list);
  place.append("; ", more);
};

// Whether another store lies in the place of one that was shown, of which the page may know shapes that are not those any more.
const isReplaced = (live, before) => {
  const isOther = ([name, number]) => live.stores[name] !== undefined && live.stores[name] !== number;
  return live.name !== before.name || (live.shown !== before.shown && Object.entries(before.stores).some(isOther));
};

const startAnew = () => {
  history.replaceState(null, "", location.pathname + (element("choice").hidden ? location.search : asking(store)));
  location.reload();
};

// Another store is another page: nothing of what was set on this one stays.
const show = (name) => location.assign(location.pathname + asking(name));

const follow = async (viewer, before) => {
  let known = before;
  const live = await load("live.json").catch(() => undefined);
  if (live === undefined) {
    element("status").textContent = "the server has ended";
  } else {
    try {
      if (isReplaced(live, before)) return startAnew();
      if (live.store !== before.store && !live.gone) {
        // The one that is shown is not there any more: it may come back, and others are there to be chosen.
        offer(live.choices.length > 0 ? live.choices : [live.store], "");
        element("status").textContent = `${before.store} is gone`;
      } else {
        introduce(live);
        if (live.shown !== before.shown) await followLayers(viewer);
        const isOther = live.written !== before.written || JSON.stringify(live.stores) !== JSON.stringify(before.stores);
        if (isOther || live.gone !== before.gone) readAgain(viewer);
        known = live;
      }
    } catch (error) {
      // It is tried again at the next look.
      console.warn(error);
    }
  }
  setTimeout(() => follow(viewer, known), 1000 * (known.running ? PATIENCE : PATIENCE_OF_WHOLE));
};

// Lays out all that there is; nothing of a store that was just begun.
const open = (viewer, state) => {
  given = byName(state);
  hasLooked = hasImage(given);
  if (given.size > 0) viewer.state.restoreState(state);
};

const hasImage = (layers) => [...layers.values()].some((layer) => layer.type === "image");
const byName = (state) => new Map(state.layers.map((layer) => [layer.name, layer]));

// What is said before it is looked for: what comes in between is seen at the next look.
const begun = await load("live.json");
introduce(begun);
element("choice").addEventListener("change", (event) => show(event.target.value));
// A store that has no images yet may be another one's turn.
if (begun.store !== "") store = begun.store;
// A store that was just begun has nothing to show yet, and nobody is to be asked for a layer then.
const viewer = setupDefaultViewer({ showLayerDialog: false, resetStateWhenEmpty: false });
viewer.title.value = begun.name;
// Who opens a link to a place of the page finds that. Asked before the page writes its own place there.
const isLink = location.hash.length >= 3;
const first = withSources(await load("state.json"));
if (isLink) [given, hasLooked] = [byName(first), true];
else open(viewer, first);
setTimeout(() => follow(viewer, begun), 1000 * PATIENCE);
