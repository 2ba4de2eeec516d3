// Drawing: WebGL 2 by three.js, one triangle for each tile; in copies whose triangles are merged, several.

const T = THREE;
// all colours here are those of the screen
T.ColorManagement.enabled = false;
const TEXTURE_WIDTH = 2048;
const stage = element("stage");
/** Whether most triangles are smaller than a pixel, so that drawing them well takes seconds without a graphics card. */
const MANY = facts.tiles > 500000;
let renderer, camera, controls, scene, valueTexture, pickTarget, paintMaterial, pickMaterial;
/** What is drawn before its edges are, and what draws them. */
let plainTarget, edgePass;
const meshes = [];
/** Those of the meshes that are images of the cell, whose triangles they share; and the cell's outline. */
let images = [], cellOutline = null;

const VERTEX = `
precision highp float; precision highp int; precision highp sampler2D;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform sampler2D values, corners;
uniform bool smoothed;
uniform vec3 boxMin, boxSize;
in vec3 position;
in vec4 row0, row1, row2; // of the matrix of the copy
in float first; // tile of the copy
in float tileNumber; // in the copy, from 1; 0 where each triangle is a tile
flat out vec4 tile;
flat out int index;
out vec3 view, inBox;
out vec2 here; // smoothed light on the front and the back
void main() {
  vec4 own = vec4(position, 1.0);
  vec3 place = vec3(dot(row0, own), dot(row1, own), dot(row2, own)) + modelMatrix[3].xyz;
  inBox = (place - boxMin) / boxSize;
  index = int(first) + (tileNumber > 0.0 ? int(tileNumber) - 1 : gl_VertexID / 3);
  tile = texelFetch(values, ivec2(index % ${TEXTURE_WIDTH}, index / ${TEXTURE_WIDTH}), 0);
  here = tile.xy;
  if (smoothed) {
    ivec2 at = ivec2(2 * (index % 1024), index / 1024);
    here = vec2(texelFetch(corners, at, 0)[gl_VertexID % 3], texelFetch(corners, at + ivec2(1, 0), 0)[gl_VertexID % 3]);
  }
  vec4 at = viewMatrix * vec4(place, 1.0);
  view = at.xyz;
  gl_Position = projectionMatrix * at;
  if (mod(tile.w, 2.0) >= 1.0) gl_Position = vec4(0.0, 0.0, 2.0, 1.0); // hidden
}`;

// tile: value of the front, of the back, captor, flags: 1 hidden, 2 front unlit, 4 back unlit, 8 listed
const SEEN = `
precision highp float; precision highp int;
uniform float nearest;
uniform bool seeThrough;
uniform vec3 clipLow, clipHigh;
flat in vec4 tile;
flat in int index;
in vec3 view, inBox;
uniform bool clear;
uniform vec3 eye, captorLow, captorHigh; // in the box
uniform vec4 before; // the plane before the captors, upright and across the view: what is on its side of the eye, above 0
// whether the line of sight goes on to a box, and enters it only farther on
bool isBefore(vec3 low, vec3 high) {
  vec3 ahead = inBox - eye;
  ahead += vec3(lessThan(abs(ahead), vec3(1e-9))) * 1e-9;
  vec3 a = (low - inBox) / ahead, b = (high - inBox) / ahead;
  vec3 enters = min(a, b), leaves = max(a, b);
  float enter = max(max(enters.x, enters.y), enters.z);
  return enter > 0.0 && enter < min(min(leaves.x, leaves.y), leaves.z);
}
// whether it goes on to the box around the captors. On each side this reaches nearly as far as the scene does (not into
// the walls behind), though not below the captors, so that a wall before them is transparent as a whole, not in parts
bool isBefore() {
  float base = captorLow.z, from = 0.04, to = 0.96;
  return isBefore(vec3(captorLow.x, from, base), vec3(captorHigh.x, to, 1.0))
    || isBefore(vec3(from, captorLow.y, base), vec3(to, captorHigh.y, 1.0))
    || isBefore(vec3(from, from, base), vec3(to, to, captorHigh.z))
    || isBefore(captorLow, captorHigh)
    || (inBox.z > base && dot(before, vec4(inBox, 1.0)) > 0.0);
}
bool flag(float bit) { return mod(floor(tile.w / bit), 2.0) >= 1.0; }
void skipUnseen() {
  if (-view.z < nearest) discard;
  if (any(lessThan(inBox, clipLow)) || any(greaterThan(inBox, clipHigh))) discard;
  if (seeThrough && (gl_FrontFacing ? flag(2.0) : flag(4.0))) discard;
}`;

const COLOUR = `${SEEN}
uniform sampler2D colours;
uniform float low, high, hovered;
uniform bool logarithmic;
in vec2 here;
out vec4 colour;
void main() {
  skipUnseen();
  float value = gl_FrontFacing ? here.x : here.y;
  vec3 paint = vec3(0.87);
  if (value >= 0.0) {
    float f = logarithmic ? log(max(value, 1e-30) / low) / log(high / low) : (value - low) / (high - low);
    paint = texture(colours, vec2(clamp(f, 0.0, 1.0) * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
  }
  // only what has no value is shaded: on a colour, shade would look like less light
  if (value < 0.0) {
    vec3 normal = normalize(cross(dFdx(view), dFdy(view)));
    paint *= 0.62 + 0.38 * abs(dot(normal, normalize(view)));
  }
  if (flag(8.0)) paint = mix(paint, vec3(0.9, 0.1, 0.5), 0.45);
  if (hovered >= 0.0 && tile.z == hovered) paint = mix(paint, vec3(1.0), 0.4);
  bool isVeil = clear && isBefore();
  // a veil in the colour of light would change the colours behind it
  if (isVeil) paint = vec3(0.6);
  ${MANY ? "if (isVeil) discard;" : ""}
  colour = vec4(paint, isVeil ? 0.25 : 1.0);
}`;

// the tile under the mouse, as a colour
const PICK = `${SEEN}
out vec4 colour;
void main() {
  skipUnseen();
  if (clear && isBefore()) discard;
  int id = index + 1;
  colour = vec4(id & 255, (id >> 8) & 255, (id >> 16) & 255, (id >> 24) & 255) / 255.0;
}`;

const MARK_VERTEX = `
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;

const MARK_COLOUR = `
precision highp float;
out vec4 colour;
void main() { colour = vec4(0.9, 0.1, 0.55, 0.3); }`;

const EDGE_VERTEX = `
in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;

// lines where surfaces end or bend, over the picture of their colours. The depth is an affine function of 1/z, which is
// affine on the screen along a plane: what is left of its second difference tells edges, in units of the slope
const EDGE_COLOUR = `
precision highp float;
uniform sampler2D plain, depths;
uniform bool lines;
uniform float near, far, pixel, opacity; // of the camera, m; angle of a pixel; of the lines
uniform vec3 ink;
out vec4 colour;
ivec2 last;
float nearness(ivec2 at) {
  return (1.0 - texelFetch(depths, clamp(at, ivec2(0), last), 0).r * (far - near) / far) / near;
}
float bend(ivec2 at, ivec2 step) {
  float here = nearness(at);
  float bend = (nearness(at - step) + nearness(at + step) - 2.0 * here) / (here * pixel);
  // behind the end of a nearer surface there is no second line
  return bend < 0.0 ? -bend : bend * (1.0 - smoothstep(4.0, 8.0, bend));
}
float edge(ivec2 at) { return max(bend(at, ivec2(1, 0)), bend(at, ivec2(0, 1))); }
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  last = textureSize(depths, 0) - 1;
  colour = vec4(texelFetch(plain, at, 0).rgb, 1.0);
  if (!lines) return;
  float strength = smoothstep(0.8, 2.5, edge(at));
  if (strength <= 0.0) return;
  // among many small leaves there would be nothing but lines
  float around = 0.0;
  for (int i = 0; i < 8; i++) {
    float turn = 0.785398 * float(i);
    around += smoothstep(0.8, 2.5, edge(at + ivec2(round(4.0 * vec2(cos(turn), sin(turn))))));
  }
  strength *= 1.0 - smoothstep(2.5, 6.0, around);
  colour.rgb = mix(colour.rgb, ink, opacity * strength);
}`;

function makeRenderer() {
  const canvas = document.createElement("canvas");
  // what is transparent shows the scene behind it, not the page
  const context = canvas.getContext("webgl2", { alpha: false, antialias: false });
  renderer = new T.WebGLRenderer({ canvas, ...(context && { context }) });
  renderer.outputColorSpace = "srgb-linear";
  // more would take a phone's memory, and no eye sees it
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.domElement.tabIndex = 0;
  renderer.domElement.setAttribute("role", "application");
  renderer.domElement.setAttribute("aria-label", "the scene in the colours of its light: arrows turn it, plus and minus zoom, Enter lists what is in the middle");
  stage.prepend(renderer.domElement);
  scene = new T.Scene();
  pickTarget = new T.WebGLRenderTarget(1, 1);
  plainTarget = new T.WebGLRenderTarget(1, 1, {
    samples: MANY ? 0 : 4, depthTexture: new T.DepthTexture(1, 1, T.UnsignedIntType),
    minFilter: T.NearestFilter, magFilter: T.NearestFilter,
  });
  edgePass = new T.Scene();
  const triangle = new T.BufferGeometry();
  triangle.setAttribute("position", new T.BufferAttribute(Float32Array.of(-1, -1, 0, 3, -1, 0, -1, 3, 0), 3));
  const whole = new T.Mesh(triangle, new T.RawShaderMaterial({
    glslVersion: T.GLSL3, vertexShader: EDGE_VERTEX, fragmentShader: EDGE_COLOUR, depthTest: false, depthWrite: false,
    uniforms: {
      plain: { value: plainTarget.texture }, depths: { value: plainTarget.depthTexture }, lines: { value: true },
      near: { value: 1 }, far: { value: 1 }, pixel: { value: 1 }, opacity: { value: 0.5 }, ink: { value: new T.Vector3() },
    },
  }));
  whole.frustumCulled = false;
  edgePass.add(whole);

  const size = new T.Vector3(...facts.size);
  camera = new T.PerspectiveCamera(40, 1, 1, 10);
  camera.up.set(0, 0, 1);
  controls = new T.OrbitControls(camera, renderer.domElement);
  controls.zoomToCursor = true;
  controls.addEventListener("change", draw);
  const radius = Math.max(size.length() / 2, 1e-6);
  [controls.minDistance, controls.maxDistance] = [1e-4 * radius, 20 * radius];
}

/** Returns whether the page is dark: as the user has chosen, or as the system is. */
function isDark() {
  return state.theme ? state.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

/** Returns the colour of the background. */
function paper() {
  return isDark() ? 0x16181c : 0xffffff;
}

function showTheme() {
  document.documentElement.dataset.theme = isDark() ? "dark" : "light";
  element("theme").textContent = isDark() ? "Light" : "Dark";
  renderer.setClearColor(paper(), 1);
  outlines?.material.color.set(isDark() ? 0xd0d4da : 0x444444);
  showScale();
  showCourse();
  draw();
}

/** Returns a box around the tiles of the parts chosen, as its middle and half of its sides; null if there are none. */
function boxAround(chosen) {
  const [low, high] = [new T.Vector3(), new T.Vector3()].map((end, i) => end.setScalar(i ? -Infinity : Infinity));
  const place = new T.Vector3();
  for (const shape of shapes) {
    const { corner, first, tiles, copies, places } = shape;
    for (let copy = 0; copy < copies; copy++) {
      const m = places.subarray(12 * copy, 12 * copy + 12);
      const rows = [0, 4, 8].map((row) => [...m.subarray(row, row + 4)]);
      const [from, to] = [first + copy * tiles, first + (copy + 1) * tiles];
      for (let tile = from, end; tile < to; tile = end) {
        const part = partOf(tile);
        end = Math.min(part.end, to);
        if (!chosen(part)) continue;
        for (let i = 9 * (corner + startOf(shape, tile - from)); i < 9 * (corner + startOf(shape, end - from)); i += 3) {
          const [x, y, z] = [corners[i] / 65535, corners[i + 1] / 65535, corners[i + 2] / 65535];
          place.set(...rows.map(([a, b, c, d]) => a * x + b * y + c * z + d));
          low.min(place);
          high.max(place);
        }
      }
    }
  }
  if (low.x > high.x) return null;
  return { middle: low.clone().add(high).multiplyScalar(0.5), half: high.sub(low).multiplyScalar(0.5) };
}

/** Returns a box around the whole scene. */
function wholeScene() {
  const half = new T.Vector3(...facts.size).multiplyScalar(0.5);
  return { middle: new T.Vector3(...facts.min).add(half), half };
}

/** Returns a box around all that is shown: the whole scene, with its images if they are. */
function boxShown() {
  const box = wholeScene();
  if (state.images) shifts().forEach((shift) => box.half.max(new T.Vector3(...shift.map(Math.abs)).add(wholeScene().half)));
  return box;
}

/** Returns the ways from the cell of a scene that repeats to the cells around it, m. */
function shifts() {
  const steps = facts.periods.map((period) => (period ? [-1, 0, 1] : [0]));
  const along = (axis, step) => {
    const { length, rise } = facts.periods[axis] ?? { length: 0, rise: 0 };
    return [step * length, step * rise];
  };
  const all = steps[0].flatMap((i) => steps[1].map((j) => {
    const [[x, up], [y, more]] = [along(0, i), along(1, j)];
    return [x, y, up + more];
  }));
  return all.filter(([x, y]) => x || y);
}

/** Returns a box around the captors and the objects that they belong to. Sensors alone have too little around them
 *  to be recognised, and so their box is at least a quarter of the scene. */
function boxOfCaptors() {
  const own = parts.filter((part) => part.captor >= 0);
  const objects = new Set(own.filter((part) => part.material >= 0).map((part) => part.object));
  const whole = wholeScene();
  const box = boxAround((part) => part.captor >= 0 || objects.has(part.object)) ?? whole;
  if (!objects.size) box.half.max(whole.half.clone().multiplyScalar(0.25));
  return box;
}

/** Returns the captors' box, with the lamps where that makes it at most 1.4 times as large. */
function boxWithLamps() {
  const { middle, half } = captorBox;
  const [low, high] = [middle.clone().sub(half), middle.clone().add(half)];
  for (const { min, max } of facts.lights) {
    low.min(new T.Vector3(...min));
    high.max(new T.Vector3(...max));
  }
  const wider = high.clone().sub(low).multiplyScalar(0.5);
  return wider.length() > 1.4 * half.length() ? captorBox : { middle: low.add(wider), half: wider };
}

/** Looks at a box from a direction, as near as possible. */
function lookAt({ middle, half }, away) {
  const right = new T.Vector3(0, 0, 1).cross(away).normalize();
  const up = away.clone().cross(right);
  const slope = Math.tan((camera.fov * Math.PI) / 360);
  let distance = Math.max(1e-3 * half.length(), 1e-6);
  for (let i = 0; i < 8; i++) {
    const corner = new T.Vector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1).multiply(half);
    const across = Math.max(Math.abs(corner.dot(right)) / camera.aspect, Math.abs(corner.dot(up))) / slope;
    distance = Math.max(distance, corner.dot(away) + 1.06 * across);
  }
  controls.target.copy(middle);
  camera.position.copy(middle).addScaledVector(away, distance);
  controls.update();
}

/** Returns the direction that is so many degrees to the right of the front and so many above it. */
function direction(across, up) {
  const [a, b] = [across, up].map((angle) => (angle * Math.PI) / 180);
  return new T.Vector3(Math.sin(a) * Math.cos(b), -Math.cos(a) * Math.cos(b), Math.sin(b));
}

const [ACROSS, UP] = [24, 27];

function lookAtAll() {
  lookAt(boxShown(), direction(ACROSS, UP));
}

let captorBox, framed, fitted;
/** Looks at the captors from the side where most of them is seen, which is the front unless another side is clearly
 *  better, and makes what stands before them transparent if more of them is seen then. */
function lookAtCaptors() {
  captorBox = boxOfCaptors();
  framed = boxWithLamps();
  let best = { score: 0, about: ACROSS, up: UP, clear: false };
  // with very many tiles the box decides: on an upright screen, what is long is seen from one of its ends
  if (MANY && camera.aspect < 1 && captorBox.half.x > captorBox.half.y) best.about = 90 + ACROSS / 2;
  const sides = facts.captors.length && !MANY ? [0, 90, 270, 180] : [];
  // from higher up a scene that is wide fills more of an upright screen
  const [low, high] = camera.aspect < 1 ? [42, 60] : [UP, 42];
  const tryAll = (views) => captorPixels(views.map(({ about, up }) => direction(about, up))).forEach(([plain, clear], i) => {
    // what is seen only through something counts half
    const score = (plain + clear) / 2;
    if (score > 1.15 * best.score) best = { ...views[i], score, clear: clear > 1.05 * plain };
  });
  tryAll(sides.flatMap((side) => [ACROSS, -ACROSS].map((across) => ({ about: side + across, up: low }))));
  if (sides.length) tryAll([{ about: best.about, up: high }]);
  const away = direction(best.about, best.up);
  state.clear = best.clear;
  lookAt(framed, away);
  fitted = { away, eye: camera.position.clone() };
}

/** Returns the lengths of the sides of the scene's box, m. */
function sides() {
  return new T.Vector3(...facts.size.map((side) => Math.max(side, 1e-30)));
}

/** Adds an object to the scene whose coordinates are 16-bit steps of the scene's box. */
function place(object) {
  object.position.set(...facts.min);
  object.scale.copy(sides());
  object.frustumCulled = false;
  scene.add(object);
}

function texture(data, width, height, type, format) {
  const texture = new T.DataTexture(data, width, height, format, type);
  texture.minFilter = texture.magFilter = T.NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

/** Makes a mesh for each shape, which draws all of its copies at once. */
function makeMeshes() {
  const rows = Math.max(1, Math.ceil(facts.tiles / TEXTURE_WIDTH));
  valueTexture = texture(new Float32Array(4 * TEXTURE_WIDTH * rows), TEXTURE_WIDTH, rows, T.FloatType, T.RGBAFormat);
  const rgba = new Uint8Array(1024);
  for (let i = 0; i < 256; i++) rgba.set([...colours.subarray(3 * i, 3 * i + 3), 255], 4 * i);
  const colourTexture = texture(rgba, 256, 1, T.UnsignedByteType, T.RGBAFormat);

  const uniforms = {
    boxMin: { value: new T.Vector3(...facts.min) }, boxSize: { value: sides() },
    values: { value: valueTexture }, corners: { value: cornerTexture }, smoothed: { value: false }, colours: { value: colourTexture },
    low: { value: 0 }, high: { value: 1 }, logarithmic: { value: false },
    nearest: { value: 0 }, seeThrough: { value: true }, hovered: { value: -1 },
    clipLow: { value: new T.Vector3() }, clipHigh: { value: new T.Vector3() },
    clear: { value: false }, eye: { value: null }, captorLow: { value: null }, captorHigh: { value: null },
    before: { value: [0, 0, 0, 0] },
  };
  const material = (fragmentShader) => new T.RawShaderMaterial({
    glslVersion: T.GLSL3, vertexShader: VERTEX, fragmentShader, uniforms, side: T.DoubleSide,
    polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, // photons and outlines lie in front
  });
  [paintMaterial, pickMaterial] = [material(COLOUR), material(PICK)];
  paintMaterial.alphaToCoverage = true; // transparency that needs no order
  for (const { corner, first, tiles, triangles, starts, copies, places } of shapes) {
    const geometry = new T.InstancedBufferGeometry();
    geometry.instanceCount = copies;
    geometry.setAttribute("position", new T.BufferAttribute(corners.subarray(9 * corner, 9 * (corner + triangles)), 3, true));
    if (starts) {
      const tileAt = new Float32Array(3 * triangles);
      for (let own = 0; own < tiles; own++) tileAt.fill(own + 1, 3 * starts[own], 3 * starts[own + 1]);
      geometry.setAttribute("tileNumber", new T.BufferAttribute(tileAt, 1));
    }
    const ofCopies = (name, width, value) => {
      const array = Float32Array.from({ length: width * copies }, (_, i) => value(Math.floor(i / width), i % width));
      geometry.setAttribute(name, new T.InstancedBufferAttribute(array, width));
    };
    [0, 1, 2].forEach((row) => ofCopies(`row${row}`, 4, (copy, i) => places[12 * copy + 4 * row + i]));
    ofCopies("first", 1, (copy) => first + copy * tiles);
    const mesh = new T.Mesh(geometry, paintMaterial);
    mesh.frustumCulled = false;
    meshes.push(mesh);
    scene.add(mesh);
  }
  makeImages();
}

/** Makes the images of a scene that repeats, in the cells around its own, and an outline of its own cell. */
function makeImages() {
  if (!facts.periods) return;
  images = shifts().flatMap((shift) => meshes.map(({ geometry }) => {
    const image = new T.Mesh(geometry, paintMaterial);
    image.frustumCulled = image.visible = false;
    image.position.set(...shift);
    return image;
  }));
  meshes.push(...images);
  const [low, high] = [facts.min, facts.min.map((min, i) => min + facts.size[i])];
  const range = [0, 1].map((axis) => {
    const period = facts.periods[axis];
    return period ? [period.from, period.from + period.length] : [low[axis], high[axis]];
  });
  // the corners follow the slope of the ground, around the middle of the scene
  const rise = (x, y) => [x, y].reduce((sum, at, axis) => {
    const period = facts.periods[axis];
    return sum + (period ? (period.rise * (at - (range[axis][0] + range[axis][1]) / 2)) / period.length : 0);
  }, 0);
  const corner = (i) => {
    const [x, y] = [range[0][i & 1], range[1][(i >> 1) & 1]];
    return [x, y, (i & 4 ? high[2] : low[2]) + rise(x, y)];
  };
  const geometry = new T.BufferGeometry();
  geometry.setAttribute("position", new T.BufferAttribute(Float32Array.from(edgesOfBox(corner)), 3));
  // plants do not hide it, and no colour of light is like it
  const seen = { color: 0xff5722, depthTest: false, transparent: true, opacity: 0.75 };
  cellOutline = new T.LineSegments(geometry, new T.LineBasicMaterial(seen));
  cellOutline.frustumCulled = false;
  scene.add(cellOutline, ...images);
}

/** Returns the coordinates of the ends of a box's edges; the bits of a corner's number say at which end of each axis it is. */
function edgesOfBox(corner) {
  const ends = [];
  for (let i = 0; i < 8; i++) {
    for (const bit of [1, 2, 4]) if (!(i & bit)) ends.push(...corner(i), ...corner(i | bit));
  }
  return ends;
}

/** Draws lamps as boxes of lines. */
function makeLights() {
  const ends = [];
  const smallest = 0.006 * new T.Vector3(...facts.size).length();
  for (const light of facts.lights) {
    const [min, max] = [[...light.min], [...light.max]];
    for (let axis = 0; axis < 3; axis++) {
      const lack = (smallest - (max[axis] - min[axis])) / 2;
      if (lack > 0) [min[axis], max[axis]] = [min[axis] - lack, max[axis] + lack];
    }
    ends.push(...edgesOfBox((i) => [0, 1, 2].map((axis) => (i & (1 << axis) ? max : min)[axis])));
  }
  const geometry = new T.BufferGeometry();
  geometry.setAttribute("position", new T.BufferAttribute(Float32Array.from(ends), 3));
  const lines = new T.LineSegments(geometry, new T.LineBasicMaterial({ color: 0xd97700, depthWrite: false }));
  lines.frustumCulled = false;
  scene.add(lines);
}

/** Number of times that tiles were painted: each time other tiles may be hidden. */
let paints = 0;
/** The least and the greatest value that are shown. */
let shownRange = { least: Infinity, most: 0 };

/** Returns the edges that are not shared by two of the tiles, as pairs of corners. */
function edgesAround(triangles) {
  const edges = new Map();
  for (const corners of triangles) {
    for (const [p, q] of [[0, 1], [1, 2], [2, 0]]) {
      const ends = [corners[p], corners[q]].map(String).sort().join(" ");
      // an edge that two tiles share is inside
      if (!edges.delete(ends)) edges.set(ends, [corners[p], corners[q]]);
    }
  }
  return [...edges.values()];
}

function tilesOf(part) {
  return Array.from({ length: part.end - part.first }, (_, i) => part.first + i);
}

let outlines = null;
/** Draws large planes as outlines, which leave in view what is behind them. */
function makeOutlines() {
  const ends = parts.filter((part) => part.large).flatMap((part) => edgesAround(tilesOf(part).map(cornersOf)));
  const geometry = new T.BufferGeometry();
  geometry.setAttribute("position", new T.BufferAttribute(Float32Array.from(ends.flat(2)), 3));
  outlines = new T.LineSegments(geometry, new T.LineBasicMaterial({ depthWrite: false }));
  outlines.frustumCulled = false;
  scene.add(outlines);
  makeGlass();
}

/** The most tiles of glass and water whose edges are drawn. */
const MOST_GLASS = 50000;
let glass = [];
/** Draws the edges of what is transparent, and hidden at first: a beaker is seen where its light is. */
function makeGlass() {
  const clear = parts.filter((part) => facts.materials[part.material]?.clear);
  if (clear.reduce((sum, part) => sum + part.end - part.first, 0) > MOST_GLASS) return;
  for (const object of new Set(clear.map((part) => part.object))) {
    const own = clear.filter((part) => part.object === object);
    const ends = creases(own.flatMap((part) => tilesOf(part).flatMap(trianglesOf)));
    const geometry = new T.BufferGeometry();
    geometry.setAttribute("position", new T.BufferAttribute(Float32Array.from(ends.flat(2)), 3));
    const lines = new T.LineSegments(geometry, outlines.material);
    lines.frustumCulled = false;
    lines.userData.object = object;
    glass.push(lines);
    scene.add(lines);
  }
}

/** Returns the edges where surfaces end or bend by more than 30 degrees, as pairs of corners. */
function creases(triangles) {
  const edges = new Map();
  const [a, b] = [new T.Vector3(), new T.Vector3()];
  for (const corners of triangles) {
    const [p, q, r] = corners.map((corner) => new T.Vector3(...corner));
    const normal = a.subVectors(q, p).cross(b.subVectors(r, p)).normalize().clone();
    for (const [i, j] of [[0, 1], [1, 2], [2, 0]]) {
      const ends = [corners[i], corners[j]];
      const name = ends.map(String).sort().join(" ");
      const other = edges.get(name);
      if (other && Math.abs(other.normal.dot(normal)) > Math.cos(Math.PI / 6)) edges.delete(name);
      else edges.set(name, { ends, normal });
    }
  }
  return [...edges.values()].map(({ ends }) => ends);
}

let mark = null;
/** Marks tiles with a veil and an outline that nothing hides. */
function markTiles(tiles) {
  mark?.forEach((object) => { scene.remove(object); object.geometry.dispose(); object.material.dispose(); });
  const triangles = tiles.flatMap(trianglesOf);
  const geometry = (points) => {
    const geometry = new T.BufferGeometry();
    return geometry.setAttribute("position", new T.BufferAttribute(Float32Array.from(points.flat(2)), 3));
  };
  const seen = { depthTest: false, transparent: true };
  const veil = new T.RawShaderMaterial({ glslVersion: T.GLSL3, vertexShader: MARK_VERTEX, fragmentShader: MARK_COLOUR, side: T.DoubleSide, ...seen });
  const line = new T.LineBasicMaterial({ color: 0xe6198c, ...seen });
  mark = [new T.Mesh(geometry(triangles), veil), new T.LineSegments(geometry(edgesAround(triangles)), line)];
  mark.forEach((object) => { object.frustumCulled = false; scene.add(object); });
}

/** Fills in the value and the flags of every tile. */
function paintTiles() {
  paints++;
  const data = valueTexture.image.data;
  const listed = new Set(state.listed.filter((row) => row.captor >= 0).map((row) => row.captor));
  const channels = state.quantity === "absorbed" ? [ABSORBED, ABSORBED] : [FRONT, BACK];
  let [least, most] = [Infinity, 0];
  for (const part of parts) {
    const isOutline = part.large && !state.planes;
    const hidden = isOutline || state.hidden.object.has(part.object) || state.hidden.material.has(part.material);
    const flags = Number(hidden) + 2 * part.dark[FRONT] + 4 * part.dark[BACK] + 8 * (part.captor >= 0 && listed.has(part.captor));
    for (let tile = part.first; tile < part.end; tile++) {
      for (const face of [FRONT, BACK]) {
        const value = state.quantity === "none" ? UNKNOWN : shownValue(part, tile, channels[face], state.band);
        data[4 * tile + face] = value;
        // a face without light has no place below a logarithmic scale
        if (hidden || value < 0 || (state.log && value === 0)) continue;
        if (value < least) least = value;
        if (value > most) most = value;
      }
      data[4 * tile + 2] = part.captor;
      data[4 * tile + 3] = flags;
    }
  }
  shownRange = { least, most };
  valueTexture.needsUpdate = true;
  if (isSmooth()) paintCorners();
  outlines.visible = !state.planes && !state.hidden.object.has(-1);
  glass.forEach((lines) => (lines.visible = !state.hidden.object.has(lines.userData.object)));
}

/** Returns the sensors' values of the quantity shown, sorted; the values of all captors if there are few sensors. */
function sensorValues() {
  const channel = state.quantity === "absorbed" ? ABSORBED : FRONT;
  const of = (chosen) => {
    const captors = new Set(chosen.filter((part) => part.captor >= 0).map((part) => part.captor));
    const values = [...captors].map((captor) => captorValue(captor, channel, state.band).value);
    return values.filter((value) => value > 0).sort((a, b) => a - b);
  };
  const shown = parts.filter((p) => !state.hidden.object.has(p.object) && !state.hidden.material.has(p.material));
  const sensors = of(shown.filter((part) => part.material < 0));
  return sensors.length >= 4 ? sensors : of(shown);
}

/** Chooses a range for what is shown, so that each surface has a colour of its own: from 0 to what 98 % of the lit area lies
 *  below, and 90 % of the light if that is at most twice as high, as where glass gathers light on a small place (higher are
 *  reflectors close to a lamp); further, but at most three times as far, for four fifths of the captors' area, as they are what is
 *  asked for; with a logarithmic scale from what 2 % of the area lies below, at most four decades. */
function chooseRange() {
  const data = valueTexture.image.data;
  const lit = [];
  const step = Math.max(1, Math.floor(facts.tiles / 100000));
  for (let tile = 0; tile < facts.tiles; tile += step) {
    const values = data.slice(4 * tile, 4 * tile + 2);
    if (data[4 * tile + 3] & 1 || !values.some((value) => value > 0)) continue;
    const [area, isCaptor] = [areaOf(tile), data[4 * tile + 2] >= 0];
    for (const value of values) if (value > 0) lit.push({ value, area, light: value * area, captor: isCaptor * area });
  }
  lit.sort((a, b) => a.value - b.value);
  const at = (share, of) => {
    let rest = share * lit.reduce((sum, tile) => sum + tile[of], 0);
    return lit.find((tile) => (rest -= tile[of]) <= 0)?.value ?? lit.at(-1)?.value ?? 1;
  };
  // the end of a linear scale is a tick
  const [usual, gathered] = [at(0.98, "area"), at(0.9, "light")];
  const all = gathered > usual && gathered <= 2 * usual ? gathered : usual;
  const most = Math.max(all, Math.min(at(0.8, "captor"), 3 * all));
  const tick = tickStep(most);
  const high = state.log ? roundUp(most, most) : Number((Math.ceil(most / tick - 1e-9) * tick).toPrecision(8));
  const low = Math.max(at(0.02, "area"), high / 1e4);
  [state.low, state.high] = [state.log ? -roundUp(-low, low) : 0, high];
}

/** Chooses the range that most sensors are in: all but the lowest and the highest 2 %, and none that lies further from the
 *  middle half than 1.7 times its width, as a sensor close to a lamp does. */
function chooseRangeOfSensors() {
  const sensors = sensorValues();
  if (!sensors.length) return;
  const at = (share) => sensors[Math.round(share * (sensors.length - 1))];
  const reach = 1.7 * (at(0.75) - at(0.25));
  let [low, high] = [Math.max(at(0.02), at(0.25) - reach), Math.min(at(0.98), at(0.75) + reach)];
  // a single value lies in the middle
  if (low >= high) [low, high] = [0.9 * low, 1.1 * high];
  // in steps that tell sensors with nearly the same light apart
  [state.low, state.high] = [-roundUp(-low, high - low), roundUp(high, high - low)];
  if (state.log && state.low <= 0) state.low = low;
}

/** Returns the next number from `value` upwards in steps of the second digit of `size`. */
function roundUp(value, size) {
  const step = 10 ** (Math.floor(Math.log10(size)) - 1);
  return Number((Math.ceil(value / step - 1e-9) * step).toPrecision(8));
}

/** Tells the shaders what was chosen, and sets the nearest and the farthest distance that are drawn. */
function setUniforms() {
  const uniforms = paintMaterial.uniforms;
  uniforms.low.value = state.low;
  uniforms.high.value = state.high;
  uniforms.logarithmic.value = state.log;
  uniforms.smoothed.value = isSmooth();
  uniforms.seeThrough.value = state.dark;
  // things in the faces of the box, and images beyond them, stay visible
  uniforms.clipLow.value.set(...[0, 2, 4].map((i) => (state.clip[i] > 0 ? state.clip[i] : -1e30)));
  uniforms.clipHigh.value.set(...[1, 3, 5].map((i) => (state.clip[i] < 1 ? state.clip[i] : 1e30)));
  const { middle, half } = boxShown();
  const radius = half.length();
  const distance = camera.position.distanceTo(middle);
  camera.near = Math.max(distance - 1.1 * radius, 1e-3 * Math.min(radius, camera.position.distanceTo(controls.target)));
  camera.far = distance + 1.1 * radius;
  camera.updateProjectionMatrix();
  const front = Math.max(distance - radius, 0);
  uniforms.nearest.value = state.cut && front + state.cut * (distance + radius - front);
  const inBox = (place) => place.sub(uniforms.boxMin.value).divide(uniforms.boxSize.value);
  const reach = captorBox.half.clone().multiplyScalar(1.02);
  uniforms.clear.value = state.clear;
  uniforms.eye.value = inBox(camera.position.clone());
  uniforms.captorLow.value = inBox(captorBox.middle.clone().sub(reach));
  uniforms.captorHigh.value = inBox(captorBox.middle.clone().add(reach));
  uniforms.before.value = planeBefore();
}

/** Returns the upright plane across the view that touches the captors' box from the side of the eye, for places in the
 *  scene's box: factors of x, y, z and a constant, above 0 on the side of the eye. */
function planeBefore() {
  const back = camera.position.clone().sub(controls.target).setZ(0).normalize();
  const { middle, half } = captorBox;
  const nearest = back.dot(middle) + 1.02 * (Math.abs(back.x) * half.x + Math.abs(back.y) * half.y);
  const [size, low] = [sides(), new T.Vector3(...facts.min)];
  return [...back.clone().multiply(size).toArray(), back.dot(low) - nearest];
}

let waiting = false;
/** Schedules drawing, once for all changes until then. */
function draw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    // while the page starts, there is nothing to draw yet
    if (!captorBox) return;
    render();
    saveLink();
  });
}

/** Draws the scene, and over its colours the edges of surfaces. */
function render() {
  setUniforms();
  images.forEach((image) => (image.visible = state.images));
  if (cellOutline) cellOutline.visible = state.images;
  if (points) {
    points.visible = state.photons;
    points.material.uniforms.bounces.value.set(...state.bounces);
    setPointSizes();
  }
  const size = renderer.getDrawingBufferSize(new T.Vector2());
  plainTarget.setSize(Math.max(size.x, 1), Math.max(size.y, 1));
  renderer.setRenderTarget(plainTarget);
  renderer.render(scene, camera);
  renderer.setRenderTarget(null);
  const { lines, near, far, pixel, opacity, ink } = edgePass.children[0].material.uniforms;
  [lines.value, near.value, far.value] = [state.shade, camera.near, camera.far];
  pixel.value = (2 * Math.tan((camera.fov * Math.PI) / 360)) / Math.max(size.y, 1);
  // light lines on a dark ground are weaker, or many of them would look like light
  opacity.value = isDark() ? 0.25 : 0.5;
  ink.value.setScalar(isDark() ? 0.85 : 0.05);
  renderer.render(edgePass, camera);
}

function resize() {
  const { width, height } = renderer.getSize(new T.Vector2());
  if (width === stage.clientWidth && height === stage.clientHeight) return;
  renderer.setSize(stage.clientWidth, stage.clientHeight, false);
  camera.aspect = stage.clientWidth / Math.max(stage.clientHeight, 1);
  // a view that was not touched fits again
  if (fitted?.eye.equals(camera.position)) {
    lookAt(framed, fitted.away);
    fitted.eye.copy(camera.position);
  }
  if (document.documentElement.dataset.ready) showScale();
  draw();
}

/** Draws all tiles with their numbers as colours, into `pickTarget`: once, or once into each of these rectangles after
 *  its `ready` was called. */
function drawNumbers(width, height, pictures = [{ x: 0, y: 0, width, height, ready: () => {} }]) {
  pickTarget.setSize(width, height);
  const others = scene.children.filter((child) => !meshes.includes(child) && child.visible);
  others.forEach((child) => (child.visible = false));
  meshes.forEach((mesh) => (mesh.material = pickMaterial));
  renderer.setRenderTarget(pickTarget);
  renderer.setClearColor(0, 0);
  renderer.clear();
  renderer.autoClear = false;
  for (const picture of pictures) {
    picture.ready();
    setUniforms();
    pickTarget.viewport.set(picture.x, picture.y, picture.width, picture.height);
    renderer.setRenderTarget(pickTarget);
    renderer.render(scene, camera);
  }
  renderer.autoClear = true;
  renderer.setRenderTarget(null);
  renderer.setClearColor(paper(), 1);
  meshes.forEach((mesh) => (mesh.material = paintMaterial));
  others.forEach((child) => (child.visible = true));
}

/** Returns the tiles in a rectangle of what `drawNumbers` has drawn; -1 where there is none. */
function numbersAt(x, y, width, height) {
  const pixels = new Uint8Array(4 * width * height);
  renderer.readRenderTargetPixels(pickTarget, x, y, width, height, pixels);
  return new Uint32Array(pixels.buffer).map((id) => id - 1);
}

/** Returns how much of a small picture captors take from each of these sides, without images, as numbers of pixels: as
 *  they are, and through what stands before them. All pictures are read at once, as reading waits until they are drawn. */
function captorPixels(aways) {
  const [width, height] = [Math.round(160 * Math.sqrt(camera.aspect)), Math.round(160 / Math.sqrt(camera.aspect))];
  images.forEach((image) => (image.visible = false));
  const pictures = aways.flatMap((away, i) => [false, true].map((clear) => {
    const ready = () => {
      lookAt(framed, away);
      state.clear = clear;
    };
    return { x: clear ? width : 0, y: i * height, width, height, ready };
  }));
  const pixels = aways.map(() => [0, 0]);
  if (!pictures.length) return pixels;
  drawNumbers(2 * width, aways.length * height, pictures);
  picked = "";
  numbersAt(0, 0, 2 * width, aways.length * height).forEach((tile, at) => {
    if (tile >= facts.tiles || partOf(tile).captor < 0) return;
    const [column, row] = [at % (2 * width), Math.floor(at / (2 * width))];
    pixels[Math.floor(row / height)][column < width ? 0 : 1]++;
  });
  return pixels;
}

let picked = "";
/** Returns the tile at a place of the page; there is none from `facts.tiles` on. All tiles are drawn with their numbers
 *  whenever something has moved. */
function tileAt(x, y) {
  const box = renderer.domElement.getBoundingClientRect();
  const [width, height] = [Math.max(Math.round(box.width), 1), Math.max(Math.round(box.height), 1)];
  const shown = [width, height, paints, state.cut, state.clear, state.dark, state.images, ...state.clip, ...camera.matrixWorld.elements].join();
  if (shown !== picked) {
    drawNumbers(width, height);
    picked = shown;
  }
  const [tile] = numbersAt(Math.floor(x - box.left), height - 1 - Math.floor(y - box.top), 1, 1);
  return tile < facts.tiles ? tile : -1;
}
