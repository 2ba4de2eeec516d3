// Light from few photons is blotchy. Here it is smoothed for the eye, along surfaces without edges and between places that
// differ by no more than their errors do. At last, what is left of the steps between tiles becomes slopes. Numbers stay as
// they are.

/** Rounds of smoothing among neighbours: fewer where there are so many tiles that each takes long. */
const ROUNDS = facts.tiles > 150000 ? 3 : 8;
/** Standard errors of the estimates by which two places may differ as if they had the same light. */
const ALIKE = 2.5;
/** Where there are very many tiles, shapes that have more than this with all their copies stay as they are; a page of more
 *  tiles than the second number is not smoothed at all. */
const MOST_OF_A_SHAPE = 50000, MOST_OF_A_PAGE = 1500000;
/** Texels in a row of the texture of corners. A tile has two, for the fronts and the backs of its three corners. */
const CORNER_WIDTH = 2 * 1024;

/** For each tile its area and, corner by corner, where the list of the tiles that meet there begins in `meeting`. */
let areas, meetings, meeting, cornerTexture;

/** Finds the tiles that meet at each corner and continue the surface smoothly. */
function makeSmooth() {
  const canSmooth = Boolean(local) && facts.tiles < MOST_OF_A_PAGE && facts.localError > 0 && !isMerged;
  const rows = canSmooth ? Math.max(1, Math.ceil(facts.tiles / 1024)) : 1;
  cornerTexture = texture(new Float32Array(4 * CORNER_WIDTH * rows), CORNER_WIDTH, rows, T.FloatType, T.RGBAFormat);
  if (!canSmooth) return;
  areas = new Float32Array(facts.tiles);
  meetings = new Uint32Array(3 * facts.tiles + 1);
  const [lists, normals] = [[], new Float32Array(3 * facts.tiles)];
  for (const { corner, first, tiles, copies } of shapes) {
    if (MANY && tiles * copies > MOST_OF_A_SHAPE) {
      meetings.fill(lists.length, 3 * first, 3 * (first + tiles * copies));
      continue;
    }
    const tilesAt = new Map();
    for (let own = 0; own < tiles; own++) {
      const [a, b, c] = cornersOf(first + own).map((place) => new T.Vector3(...place));
      const normal = b.sub(a).cross(c.sub(a));
      areas.fill(normal.length() / 2, first + own, first + own + 1);
      normals.set(normal.normalize().toArray(), 3 * (first + own));
      for (let i = 0; i < 3; i++) {
        const key = cornerKey(corner + own, i);
        if (!tilesAt.has(key)) tilesAt.set(key, []);
        tilesAt.get(key).push(own);
      }
    }
    const continues = (own, other) => [0, 1, 2].reduce((sum, i) => sum + normals[3 * (first + own) + i] * normals[3 * (first + other) + i], 0) > 0.9;
    const around = Array.from({ length: 3 * tiles }, (_, i) => {
      const own = Math.floor(i / 3);
      return tilesAt.get(cornerKey(corner + own, i % 3)).filter((other) => continues(own, other));
    });
    for (let copy = 0; copy < copies; copy++) {
      const from = first + copy * tiles;
      areas.copyWithin(from, first, first + tiles);
      around.forEach((list, i) => {
        meetings[3 * from + i] = lists.length;
        for (const other of list) lists.push(from + other);
      });
    }
  }
  meetings[3 * facts.tiles] = lists.length;
  meeting = Uint32Array.from(lists);
}

/** Returns a number that tells corners at different places of a shape apart. */
function cornerKey(tile, i) {
  const [x, y, z] = corners.subarray(9 * tile + 3 * i, 9 * tile + 3 * i + 3);
  return x + 65536 * (y + 65536 * z);
}

/** Returns the mean of a face's values where tiles meet, from the first list to the last, of those that are like `value`:
 *  those that differ from it by no more than about this fraction. */
function meanAlike(values, face, value, reach, first, last) {
  let [sum, weight] = [0, 0];
  for (let i = meetings[first]; i < meetings[last]; i++) {
    const tile = meeting[i];
    const other = values[2 * tile + face];
    if (!(other >= 0)) continue;
    const off = (other - value) / (reach * Math.max(other, value, 1e-30));
    const share = areas[tile] * Math.exp(-off * off);
    sum += share * other;
    weight += share;
  }
  return weight > 0 ? sum / weight : value;
}

/** Fills in the light at the corners of all tiles, smoothed. */
function paintCorners() {
  const raw = valueTexture.image.data;
  const reach = ALIKE * facts.localError;
  let values = new Float32Array(2 * facts.tiles);
  for (let i = 0; i < values.length; i++) values[i] = raw[4 * (i >> 1) + (i & 1)];
  for (let round = 0; round < ROUNDS; round++) {
    const next = values.slice();
    for (let tile = 0; tile < surfaceTiles; tile++) {
      for (const face of [FRONT, BACK]) {
        const value = values[2 * tile + face];
        if (value > 0) next[2 * tile + face] = meanAlike(values, face, value, reach, 3 * tile, 3 * tile + 3);
      }
    }
    values = next;
  }
  const data = cornerTexture.image.data;
  for (let tile = 0; tile < facts.tiles; tile++) {
    for (const face of [FRONT, BACK]) {
      const value = values[2 * tile + face];
      for (let i = 0; i < 3; i++) {
        const at = 3 * tile + i;
        data[8 * tile + 4 * face + i] = value >= 0 && tile < surfaceTiles ? meanAlike(values, face, value, Infinity, at, at + 1) : value;
      }
    }
  }
  cornerTexture.needsUpdate = true;
}

/** Returns whether the light is smoothed now. */
function isSmooth() {
  return Boolean(meeting) && state.smooth && state.values === "local" && state.quantity !== "none" && state.hour < 0;
}
