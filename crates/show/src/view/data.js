// The page that `phylux view` writes: surfaces and captors in tiles, coloured by their light. This file
// reads the data, which view.rs writes into script elements of the page, and holds the user's choices.
// Then come draw.js, smooth.js, photons.js, histories.js, dependence.js, table.js, bar.js, year.js, link.js, panel.js, keys.js and start.js.
"use strict";

// --- the data ---

const element = (id) => document.getElementById(id);

const facts = JSON.parse(element("facts").textContent);
const [FRONT, BACK, ABSORBED] = [0, 1, 2];
const UNKNOWN = -1;
/** Up to this many triangles the images of a scene that repeats are shown at first. */
const MOST_OF_IMAGES = 1e6;
const traced = facts.bands.filter((band) => !band.sum).length;
const colours = Uint8Array.from(atob(facts.colours), (c) => c.charCodeAt(0));

/** The data that `readData` reads: corners of the tiles of each shape, its copies, runs of tiles, light, photons. */
let corners, shapes, parts, local, localLevels, keptLevels, surfaceTiles, captorValues, groupValues, shares, byLight, photons;

/** The light of a year by its steps: hours, days and months, as far as the page has them. */
const year = {};

let unpacked = 0;
/** Shows how much is done, and lets the browser draw it. */
function reached(share, words) {
  showLoading(share, words);
  return new Promise((go) => setTimeout(go, 0));
}

/** Returns the numbers of a script element, stored deflated in base64; null if there is no such element. */
async function unpack(id, Kind) {
  const text = element(id)?.textContent;
  if (text === undefined) return null;
  element(id).remove(); // no longer needed
  unpacked += text.length;
  await reached(0.5 + (0.3 * unpacked) / (facts.bytes || 1), "reading the light");
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  const whole = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Kind(await new Response(whole).arrayBuffer());
}

async function readData() {
  const kind = ({ last }) => (last > 255 ? Uint16Array : Uint8Array);
  const [runs, places] = await Promise.all([unpack("parts", Int32Array), unpack("placements", Float32Array)]);
  parts = readParts(runs);
  shapes = readShapes(places, await unpack("starts", Uint32Array));
  [corners, captorValues, groupValues, shares, byLight] = await Promise.all([
    unpack("corners", Uint16Array), unpack("captors", Float32Array), unpack("groups", Float32Array),
    unpack("shares", Uint8Array), unpack("byLight", Float32Array),
  ]);
  local = facts.local && await unpack("local", kind(facts.local));
  localLevels = local && levelValues(facts.local);
  keptLevels = levelValues(facts.kept);
  surfaceTiles = local ? local.length / (3 * traced) : 0;
  for (const [step, id] of [["hours", "hour"], ["days", "day"], ["months", "month"]]) {
    if (!facts.year?.[step]) continue;
    const slots = await unpack(`${id}Slots`, Uint32Array);
    year[step] = readSeries(facts.year[step], slots, await unpack(`${id}Values`, Uint16Array), await unpack(`${id}Errors`, Uint8Array));
  }
  await readWays();
  photons = facts.photons && {
    ...facts.photons,
    places: await unpack("photonPlaces", Uint16Array),
    powers: await unpack("photonPowers", Uint16Array),
    normals: await unpack("photonNormals", Int8Array),
    bounces: await unpack("photonBounces", Uint16Array),
    links: await unpack("photonLinks", Uint8Array),
    starts: await unpack("photonStarts", Uint16Array),
    lightOf: await unpack("photonLights", Uint32Array),
    materials: await unpack("photonMaterials", Uint32Array), // that it came from
    surfaces: await unpack("photonSurfaces", Uint32Array), // material that it arrived on
  };
}

/** Reads the shapes: runs of tiles that are drawn once for each of their copies. A shape has the place of the first
 *  copy's triangles in `corners`, and for each copy the matrix from coordinates in [0, 1] to metres. Where a tile has
 *  several triangles, `starts` has the first of each tile, and at last their number. */
function readShapes(places, allStarts) {
  let [corner, first, place, start] = [0, 0, 0, 0];
  return facts.shapes.map(({ tiles, copies, triangles }) => {
    const starts = triangles ? allStarts.subarray(start, start + tiles + 1) : null;
    const shape = { corner, first, tiles, copies, starts, triangles: triangles ?? tiles, places: places.subarray(12 * place, 12 * (place + copies)) };
    [corner, first, place] = [corner + shape.triangles, first + tiles * copies, place + copies];
    if (starts) start += tiles + 1;
    return shape;
  });
}

/** Reads the hours, days or months of a year; those that are dark everywhere are left out. */
function readSeries({ days, clocks, count, rows, bands, values: valueScale, errors: errorScale }, slots, values, errors) {
  const of = new Map([...slots].map((slot, i) => [slot, i]));
  const each = slots.length ? values.length / slots.length : 0;
  return { days, clocks, count, rows, bands, each, values, errors, of, slots, valueLevels: levelValues(valueScale), errorLevels: levelValues(errorScale) };
}

/** Returns the table of the chosen step of the year; undefined for the mean over the whole period. */
function series() {
  return year[state.step];
}

/** Returns the time with the most light, of those that a table has. */
function brightest({ slots, values, each }) {
  let best = [0, -1];
  slots.forEach((slot, i) => {
    const sum = values.subarray(i * each, (i + 1) * each).reduce((a, b) => a + b, 0);
    if (sum > best[1]) best = [slot, sum];
  });
  return best[0];
}

/** Returns the first triangle of a tile of a copy, counted within the copy; `own` may be the number of tiles. */
function startOf({ starts }, own) {
  return starts ? starts[own] : own;
}

/** Returns the triangles of a tile, of each the corners, m. */
function trianglesOf(tile) {
  const shape = shapes.findLast(({ first }) => first <= tile);
  const [copy, own] = [Math.floor((tile - shape.first) / shape.tiles), (tile - shape.first) % shape.tiles];
  const m = shape.places.subarray(12 * copy, 12 * copy + 12);
  const [from, to] = [startOf(shape, own), startOf(shape, own + 1)];
  return Array.from({ length: to - from }, (_, triangle) => [0, 1, 2].map((i) => {
    const at = 9 * (shape.corner + from + triangle) + 3 * i;
    const [x, y, z] = [corners[at] / 65535, corners[at + 1] / 65535, corners[at + 2] / 65535];
    return [0, 4, 8].map((row) => m[row] * x + m[row + 1] * y + m[row + 2] * z + m[row + 3]);
  }));
}

/** Returns the corners of a tile, m; of its first triangle if it has several. */
function cornersOf(tile) {
  return trianglesOf(tile)[0];
}

/** Returns the area of a tile, m2. */
function areaOf(tile) {
  return trianglesOf(tile).reduce((sum, [a, b, c]) => {
    const [p, q] = [b, c].map((end) => end.map((x, i) => x - a[i]));
    return sum + Math.hypot(p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]) / 2;
  }, 0);
}

/** Reads the parts: runs of tiles of one object, material and captor; -1 stands for none. */
function readParts(numbers) {
  const parts = [];
  for (let i = 0; i < numbers.length; i += 4) {
    const [object, material, captor, first] = numbers.subarray(i, i + 4);
    parts.push({ object, material, captor, first });
  }
  parts.forEach((part, i) => (part.end = i + 1 < parts.length ? parts[i + 1].first : facts.tiles));
  return parts;
}

/** Returns the part that a tile belongs to. */
function partOf(tile) {
  let [low, high] = [0, parts.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (parts[middle].first <= tile) low = middle;
    else high = middle;
  }
  return parts[low];
}

/** Returns the values of a logarithmic scale, level by level. */
function levelValues({ most, span, last }) {
  return Float32Array.from({ length: last + 1 }, (_, i) => i && most * Math.exp(span * ((i - 1) / (last - 1) - 1)));
}

/** Returns the irradiance on a face at the place of a tile in a traced band, with the lamps as they are set. */
function arriving(tile, face, b) {
  const all = localLevels[local[(face * traced + b) * surfaceTiles + tile]];
  if (!dimmed) return all;
  const lamps = facts.lamps.length;
  let [lit, shone] = [0, 0];
  for (let l = 0; l < lamps; l++) {
    const share = shares[((l * 2 + face) * traced + b) * surfaceTiles + tile];
    lit += share;
    shone += share * state.lamps[l];
  }
  return lit ? (all * shone) / lit : 0;
}

/** Returns what the band at a place in a sum counts there. */
function weightOf(band, place) {
  const { weights } = facts.bands[band];
  return weights ? weights[place] : 1;
}

/** Returns the units of flux and of light per area in a band or sum; of days and months this is the daily light integral. */
function unitOf(band) {
  const unit = facts.bands[band].unit ?? facts.unit;
  return isDaily() ? { ...unit, irradiance: facts.year.unit } : unit;
}

/** Returns whether daily light integrals are shown. */
function isDaily() {
  return state.step === "days" || state.step === "months";
}

/** Returns the light at the place of a tile, per area; `UNKNOWN` where it is not known. */
function localValue(tile, channel, band) {
  if (tile >= surfaceTiles || state.hour >= 0 || (dimmed && !shares.length)) return UNKNOWN;
  let sum = 0;
  for (const [i, b] of facts.bands[band].of.entries()) {
    const weight = weightOf(band, i);
    if (channel !== ABSORBED) {
      sum += weight * arriving(tile, channel, b);
      continue;
    }
    const kept = keptLevels[local[(ABSORBED * traced + b) * surfaceTiles + tile]];
    sum += weight * kept * (arriving(tile, FRONT, b) + arriving(tile, BACK, b));
  }
  return sum;
}

/** Returns the value of a captor per area and its standard error, NaN where they are not known. */
function captorValue(captor, channel, band) {
  return received(captorValues, captor, captor, channel, band);
}

/** Returns the same for a group of captors. */
function groupValue(group, channel, band) {
  return received(groupValues, group, facts.captors.length + group, channel, band);
}

/** Returns the light on the front of a captor or group at the chosen time. */
function receivedInTime(row, channel, band) {
  return channel === FRONT ? lightAt(series(), state.hour, row, band) : { value: NaN, error: NaN };
}

/** Returns the light on the front of a captor or group at a time of a table; NaN where the table does not have it. */
function lightAt({ rows, bands, of, each, count, values, errors, valueLevels, errorLevels }, slot, row, band) {
  const [own, column] = [rows ? rows[row] : row, bands[band]];
  if (own < 0 || column < 0) return { value: NaN, error: NaN };
  const i = of.get(slot);
  if (i === undefined) return { value: 0, error: NaN };
  const at = i * each + column * count + own;
  const value = valueLevels[values[at]];
  return { value, error: value * errorLevels[errors[at]] || NaN };
}

/** Returns the value with the lamps as they are set: light is linear in their powers, and each has photons of its own. */
function received(values, row, rowByLight, channel, band) {
  if (state.hour >= 0) return receivedInTime(rowByLight, channel, band);
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

/** Returns the value that determines the colour of a tile. */
function shownValue(part, tile, channel, band) {
  const here = localValue(tile, channel, band);
  if (part.captor < 0 || (state.values === "local" && here !== UNKNOWN)) return here;
  const { value } = captorValue(part.captor, channel, band);
  return Number.isNaN(value) ? UNKNOWN : value;
}

// --- the user's choices ---

/** Whether some tiles have several triangles. There are so many then that few photons come to each. */
const isMerged = facts.shapes.some(({ triangles }) => triangles);
const state = {
  quantity: "irradiance", band: Math.max(facts.bands.findIndex((band) => band.sum), 0),
  values: facts.local && !isMerged ? "local" : "captor",
  low: 0, high: 1, log: false, cut: 0, clear: false, planes: false, dark: true, shade: true, smooth: true,
  images: Boolean(facts.periods) && 9 * facts.tiles <= MOST_OF_IMAGES, photons: false, photonColour: "bounce", bounces: [0, 0],
  hidden: { object: new Set(), material: new Set() },
  listed: [], found: -1, clip: [0, 1, 0, 1, 0, 1], theme: "", lamps: facts.lamps.map(() => 1),
  step: "all", // of a year: all of it, or hours, days, months
  hour: -1, // its time: day * times of day + time of day; -1 is the whole period
  photonSize: 1,
};
/** Whether some lamp is set to another power than it has in the scene. */
let dimmed = false;

/** Finds large planes: virtual captors of more than this many times the median area of all captors, which would hide the others. */
const LARGE = 20;
function findLargePlanes() {
  const median = [...facts.areas].sort((a, b) => a - b)[facts.areas.length >> 1];
  for (const part of parts) part.large = part.captor >= 0 && part.material < 0 && facts.areas[part.captor] > LARGE * median;
}

/** Finds for each part the faces that are practically unlit while the other face is lit. */
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
