// The page that `phylux view` writes: surfaces and captors in tiles, coloured by their light. First the
// data, which stand in script elements of the page (view.rs writes them), and what the user has chosen.
"use strict";

// --- the data ---

const element = (id) => document.getElementById(id);

function bytes(id) {
  const text = element(id).textContent;
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  element(id).remove(); // the text is no longer needed
  return bytes;
}

const facts = JSON.parse(element("facts").textContent);
const corners = new Uint16Array(bytes("corners").buffer);
const parts = readParts(new Int32Array(bytes("parts").buffer));
const local = facts.local && new Uint16Array(bytes("local").buffer);
const captorValues = new Float32Array(bytes("captors").buffer);
const groupValues = new Float32Array(bytes("groups").buffer);
const shares = bytes("shares");
const byLight = element("byLight") && new Float32Array(bytes("byLight").buffer);
const colours = Uint8Array.from(atob(facts.colours), (c) => c.charCodeAt(0));
const photons = facts.photons && {
  ...facts.photons,
  places: new Uint16Array(bytes("photonPlaces").buffer),
  powers: new Uint16Array(bytes("photonPowers").buffer),
  normals: new Int8Array(bytes("photonNormals").buffer),
  bounces: new Uint16Array(bytes("photonBounces").buffer),
};

const [FRONT, BACK, ABSORBED] = [0, 1, 2];
const UNKNOWN = -1;
const traced = facts.bands.filter((band) => !band.sum).length;
const surfaceTiles = local ? local.length / (3 * traced) : 0;

/** Runs of tiles of one object, material and captor; -1 is none. */
function readParts(numbers) {
  const parts = [];
  for (let i = 0; i < numbers.length; i += 4) {
    const [object, material, captor, first] = numbers.subarray(i, i + 4);
    parts.push({ object, material, captor, first });
  }
  parts.forEach((part, i) => (part.end = i + 1 < parts.length ? parts[i + 1].first : facts.tiles));
  return parts;
}

/** The part that a tile is in. */
function partOf(tile) {
  let [low, high] = [0, parts.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (parts[middle].first <= tile) low = middle;
    else high = middle;
  }
  return parts[low];
}

/** The values of the 16-bit logarithmic scale that ends at `most`. */
function levels(most) {
  const span = 18;
  return Float32Array.from({ length: 65536 }, (_, i) => i && most * Math.exp(span * ((i - 1) / 65534 - 1)));
}
const localLevels = local && levels(facts.local.most);

/** The light at the place of a tile that arrives on a face in a traced band, with the lamps as they are set. */
function arriving(tile, face, b) {
  const all = localLevels[local[(face * traced + b) * surfaceTiles + tile]];
  if (!dimmed) return all;
  const lamps = facts.lamps.length;
  let [lit, shone] = [0, 0];
  for (let l = 0; l < lamps; l++) {
    const share = shares[((tile * 2 + face) * lamps + l) * traced + b];
    lit += share;
    shone += share * state.lamps[l];
  }
  return lit ? (all * shone) / lit : 0;
}

/** Light at the place of a tile, per area; `UNKNOWN` where it is not known. */
function localValue(tile, channel, band) {
  if (tile >= surfaceTiles || (dimmed && !shares.length)) return UNKNOWN;
  let sum = 0;
  for (const b of facts.bands[band].of) {
    if (channel !== ABSORBED || !dimmed) {
      sum += channel === ABSORBED ? localLevels[local[(channel * traced + b) * surfaceTiles + tile]] : arriving(tile, channel, b);
      continue;
    }
    // as what arrives on both faces
    const at = (face) => localLevels[local[(face * traced + b) * surfaceTiles + tile]];
    const all = at(FRONT) + at(BACK);
    const absorbed = localLevels[local[(ABSORBED * traced + b) * surfaceTiles + tile]];
    sum += all ? (absorbed * (arriving(tile, FRONT, b) + arriving(tile, BACK, b))) / all : 0;
  }
  return sum;
}

/** What a captor received per area: value and standard error, NaN where they are not known. */
function captorValue(captor, channel, band) {
  return received(captorValues, captor, captor, channel, band);
}

/** The same of a group of captors. */
function groupValue(group, channel, band) {
  return received(groupValues, group, facts.captors.length + group, channel, band);
}

/** With the lamps as they are set: light is linear in their powers, and each has photons of its own. */
function received(values, row, rowByLight, channel, band) {
  const at = 2 * ((row * 3 + channel) * facts.bands.length + band);
  if (!dimmed || Number.isNaN(values[at])) return { value: values[at], error: values[at + 1] };
  if (!byLight) return { value: NaN, error: NaN };
  const lamps = facts.lamps.length;
  const first = 2 * ((rowByLight * 3 + channel) * facts.bands.length + band) * lamps;
  let [value, variance] = [0, 0];
  for (let l = 0; l < lamps; l++) {
    value += state.lamps[l] * byLight[first + 2 * l];
    variance += (state.lamps[l] * (byLight[first + 2 * l + 1] || 0)) ** 2;
  }
  return { value, error: variance > 0 ? Math.sqrt(variance) : NaN };
}

/** The value that a tile is coloured by. */
function shownValue(part, tile, channel, band) {
  const here = localValue(tile, channel, band);
  if (part.captor < 0 || (state.values === "local" && here !== UNKNOWN)) return here;
  const { value } = captorValue(part.captor, channel, band);
  return Number.isNaN(value) ? UNKNOWN : value;
}

// --- what the user has chosen ---

const state = {
  quantity: "irradiance", band: Math.max(facts.bands.findIndex((band) => band.sum), 0), values: local ? "local" : "captor",
  low: 0, high: 1, log: false, cut: 0, dark: true, shade: true,
  photons: false, photonColour: "bounce", bounces: [0, 0],
  hidden: { object: new Set(), material: new Set() },
  listed: [], found: -1, clip: [0, 1, 0, 1, 0, 1], theme: "", lamps: facts.lamps.map(() => 1),
};
/** Whether some lamp is set to another power than it has in the scene. */
let dimmed = false;

/** Whether each face of a part is as good as unlit, while the other is lit. */
function findDarkSides() {
  for (const part of parts) {
    const sums = [0, 0];
    for (let tile = part.first; tile < part.end; tile++) {
      for (const face of [FRONT, BACK]) {
        for (let band = 0; band < traced; band++) {
          let value = localValue(tile, face, band);
          if (value === UNKNOWN && part.captor >= 0) ({ value } = captorValue(part.captor, face, band));
          if (value > 0) sums[face] += value;
        }
      }
    }
    const isSurface = part.material >= 0;
    part.dark = [FRONT, BACK].map((face) => isSurface && sums[face] < 1e-4 * sums[1 - face]);
  }
}
