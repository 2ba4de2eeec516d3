// Photons: soft round points on the surfaces that they arrived on, and their flight from the lamps.

const PHOTON_COLOURS = ["bounce", "power", "band", "lamp", "surface"];
/** Colours that tell kinds apart, also for most of those who see few colours (Okabe and Ito 2008). */
const KINDS = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [213, 94, 0], [86, 180, 233], [122, 88, 40], [128, 62, 190]];
const OTHERS = [120, 124, 130];
/** The photons' colours as what they stand for. */
let legend = [];
let points;

const POINT_VERTEX = `
precision highp float;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform vec2 bounces;
uniform float nearest, pixels, largest, scale, time, glow;
uniform vec3 clipLow, clipHigh;
in vec3 position, start; // where it arrived, and where it flew from
in vec3 normal; // of the face that it arrived on
in vec3 paint;
in vec2 times; // when it leaves and when it arrives
in float bounce, radius; // without a radius it lies on what is hidden
out vec3 tint;
out vec4 facing; // normal of the face to the eye, and radius over the radius of the point
void main() {
  tint = paint;
  bool flies = time >= 0.0 && time < times.y;
  float done = flies ? clamp((time - times.x) / max(times.y - times.x, 1e-6), 0.0, 1.0) : 1.0;
  vec3 place = mix(start, position, done);
  vec4 at = viewMatrix * modelMatrix * vec4(place, 1.0);
  gl_Position = projectionMatrix * at;
  // in flight it is a ball that is seen well
  float own = scale * (flies ? max(radius, glow) : radius);
  float size = clamp(2.0 * own * pixels / -at.z, flies ? 4.0 : 2.0, largest);
  gl_PointSize = size + 2.0;
  // a point has one depth: that of the edge of its disc which is nearest to the eye, or its face would hide half of it
  vec4 edge = projectionMatrix * vec4(0.0, 0.0, at.z * (1.0 - 0.5 * size / pixels), 1.0);
  if (!flies) gl_Position.z = edge.z / edge.w * gl_Position.w;
  vec3 turned = (viewMatrix * vec4(normal, 0.0)).xyz;
  facing = vec4(flies ? vec3(0.0, 0.0, 1.0) : turned, (size + 2.0) / size);
  bool behind = !flies && (radius <= 0.0 || dot(turned, at.xyz) > 0.0);
  bool clipped = any(lessThan(place, clipLow)) || any(greaterThan(place, clipHigh));
  bool waits = time >= 0.0 && time < times.x;
  if (waits || clipped || behind || bounce < bounces.x || bounce > bounces.y || -at.z < nearest) gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
}`;

// a disc that lies on its face, with a soft edge
const POINT_COLOUR = `
precision highp float;
uniform mat4 projectionMatrix;
in vec3 tint;
in vec4 facing;
out vec4 colour;
void main() {
  vec2 off = (2.0 * gl_PointCoord - 1.0) * vec2(facing.w, -facing.w);
  float steep = max(abs(facing.z), 0.25);
  float deep = dot(facing.xy, off) / steep;
  float distance2 = dot(off, off) + deep * deep;
  float soft = 1.0 - smoothstep(0.35, 1.0, distance2);
  if (soft < 0.02) discard;
  colour = vec4(tint, 0.9 * soft);
}`;

/** Returns the places from which photons flew: of the arrival before, or of its own. */
function photonStarts() {
  const { places, links, starts, count } = photons;
  const from = new Uint16Array(3 * count);
  for (let i = 0, own = 0; i < count; i++) {
    from.set(links[i] ? places.subarray(3 * i - 3, 3 * i) : starts.subarray(3 * own, 3 * own + 3), 3 * i);
    if (!links[i]) own++;
  }
  return from;
}

/** Seconds from the first photon that leaves its lamp to the last, and that a photon takes to cross the scene. */
const LEAVING = 6, CROSSING = 2.5;
let lastTime = 0;

/** Returns when each photon leaves the place before and when it arrives, s. Those of a path follow each other at one speed,
 *  and paths begin one after the other. */
function photonTimes(from) {
  const { places, count, links, bounces } = photons;
  const times = new Float32Array(2 * count);
  const speed = new T.Vector3(...facts.size).length() / CROSSING;
  let [path, now] = [0, 0];
  for (let i = 0; i < count; i++) {
    const isFirst = !links[i] && (i === 0 || bounces[i] <= bounces[i - 1]) && photons.materials[i] === 0xffffffff;
    // the golden ratio spreads beginnings evenly
    if (isFirst) now = LEAVING * ((path++ * 0.6180339887) % 1);
    const way = [0, 1, 2].map((axis) => ((places[3 * i + axis] - from[3 * i + axis]) / 65535) * facts.size[axis]);
    times[2 * i] = now;
    now += Math.max(Math.hypot(...way) / speed, 1e-3);
    times[2 * i + 1] = now;
    lastTime = Math.max(lastTime, now);
  }
  return times;
}

/** Returns the radius of each photon's point, m: such that points just do not cover each other, which makes them small where
 *  photons lie close together. */
function photonRadii() {
  const { places, count } = photons;
  const radii = new Float32Array(count);
  const whole = Math.max(...facts.size);
  const ENOUGH = 12;
  // from the finest cells to the coarsest: the first in which a photon has enough neighbours
  for (let level = 9; level >= 0; level--) {
    const cells = new Map();
    const side = whole / 2 ** level;
    const cell = (i) => {
      const at = (axis) => Math.min(Math.floor(((places[3 * i + axis] / 65535) * facts.size[axis]) / side), 2 ** level - 1);
      return at(0) + 1024 * (at(1) + 1024 * at(2));
    };
    const own = new Uint32Array(count);
    for (let i = 0; i < count; i++) {
      own[i] = cell(i);
      cells.set(own[i], (cells.get(own[i]) ?? 0) + 1);
    }
    for (let i = 0; i < count; i++) {
      const near = cells.get(own[i]);
      if (!radii[i] && (near >= ENOUGH || level === 0)) radii[i] = (0.42 * side) / Math.sqrt(near);
    }
  }
  return radii.map((radius) => Math.min(radius, 0.012 * whole));
}

/** The radii of all photons, also of those that lie on what is hidden. */
let allRadii;

/** Leaves out the photons that lie on hidden materials; they would hang in the air. */
function hidePhotons() {
  const radius = points.geometry.getAttribute("radius");
  for (let i = 0; i < photons.count; i++) radius.array[i] = state.hidden.material.has(photons.surfaces[i]) ? 0 : allRadii[i];
  radius.needsUpdate = true;
}

function makePhotons() {
  allRadii = photonRadii();
  const geometry = new T.BufferGeometry();
  const from = photonStarts();
  geometry.setAttribute("position", new T.BufferAttribute(photons.places, 3, true));
  geometry.setAttribute("start", new T.BufferAttribute(from, 3, true));
  geometry.setAttribute("normal", new T.BufferAttribute(photons.normals, 3, true));
  geometry.setAttribute("times", new T.BufferAttribute(photonTimes(from), 2));
  geometry.setAttribute("bounce", new T.BufferAttribute(Float32Array.from(photons.bounces), 1));
  geometry.setAttribute("radius", new T.BufferAttribute(allRadii.slice(), 1));
  geometry.setAttribute("paint", new T.BufferAttribute(new Uint8Array(3 * photons.count), 3, true));
  const { nearest, clipLow, clipHigh } = paintMaterial.uniforms;
  points = new T.Points(geometry, new T.RawShaderMaterial({
    glslVersion: T.GLSL3, vertexShader: POINT_VERTEX, fragmentShader: POINT_COLOUR, transparent: true, depthWrite: false,
    uniforms: {
      nearest, clipLow, clipHigh, bounces: { value: new T.Vector2() }, pixels: { value: 1 }, largest: { value: 24 },
      scale: { value: 1 }, time: { value: -1 }, glow: { value: 0.0035 * Math.hypot(...facts.size) },
    },
  }));
  points.visible = false;
  place(points);
  hidePhotons();
}

/** Tells the shader how large points are on the canvas. */
function setPointSizes() {
  const { pixels, largest, scale } = points.material.uniforms;
  const ratio = renderer.getPixelRatio();
  pixels.value = (stage.clientHeight * ratio) / (2 * Math.tan((camera.fov * Math.PI) / 360));
  largest.value = 26 * ratio;
  scale.value = state.photonSize;
}

// --- colours ---

/** Returns the colour of a band, bytes: as the eye sees its wavelengths, or one of its own. */
function bandColour(b) {
  const nm = facts.bands[b].nm;
  if (!nm) return KINDS[b % KINDS.length];
  const middle = (nm[0] + nm[1]) / 2;
  const seen = [[400, [126, 60, 190]], [440, [90, 70, 210]], [480, [40, 110, 220]], [510, [0, 160, 130]], [550, [60, 170, 50]], [580, [225, 175, 0]],
    [610, [235, 110, 10]], [650, [215, 40, 40]], [700, [160, 20, 50]], [760, [110, 15, 60]], [900, [90, 60, 60]]];
  const next = seen.findIndex(([end]) => end >= middle);
  if (next <= 0) return next < 0 ? seen.at(-1)[1] : seen[0][1];
  const [[a, from], [b2, to]] = [seen[next - 1], seen[next]];
  return from.map((c, i) => Math.round(c + ((to[i] - c) * (middle - a)) / (b2 - a)));
}

/** Gives each kind a colour, the most frequent first; all after the eighth are others. Returns the colour of each photon. */
function coloursOfKinds(kindOf, nameOfKind) {
  const counts = new Map();
  for (let i = 0; i < photons.count; i++) counts.set(kindOf(i), (counts.get(kindOf(i)) ?? 0) + 1);
  const kinds = [...counts.keys()].sort((a, b) => counts.get(b) - counts.get(a) || a - b);
  const colourOf = new Map(kinds.map((kind, i) => [kind, KINDS[i] ?? OTHERS]));
  legend = kinds.slice(0, KINDS.length).map((kind) => ({ colour: colourOf.get(kind), name: nameOfKind(kind) }));
  if (kinds.length > KINDS.length) legend.push({ colour: OTHERS, name: `${kinds.length - KINDS.length} others` });
  return (i) => colourOf.get(kindOf(i));
}

/** Returns the colour of each photon, bytes, for the choice of the panel. */
function photonColours() {
  const scale = levelValues({ ...photons.levels, most: 1 });
  const power = (i, b) => scale[photons.powers[i * traced + b]];
  const ramp = (share) => colours.subarray(3 * Math.round(255 * Math.min(share, 1)), 3 * Math.round(255 * Math.min(share, 1)) + 3);
  switch (state.photonColour) {
    case "lamp":
      return coloursOfKinds((i) => photons.lightOf[i], (light) => photons.lights[light]);
    case "surface": {
      const name = (material) => (material === 0xffffffff ? "straight from its lamp" : facts.materials[material].name);
      return coloursOfKinds((i) => photons.materials[i], name);
    }
    case "band": {
      const own = Array.from({ length: traced }, (_, b) => bandColour(b));
      legend = own.map((colour, b) => ({ colour, name: facts.bands[b].name }));
      // a photon carries all bands: it is shown in one of them, drawn in proportion to its powers
      return (i) => {
        const powers = own.map((_, b) => power(i, b));
        let rest = ((i * 0.6180339887) % 1) * powers.reduce((sum, p) => sum + p, 0);
        const drawn = powers.findIndex((p) => p > 0 && (rest -= p) <= 0);
        return own[Math.max(drawn, 0)];
      };
    }
    default: {
      const isBounce = state.photonColour === "bounce";
      const inBand = (i) => facts.bands[state.band].of.reduce((sum, b, at) => sum + weightOf(state.band, at) * power(i, b), 0);
      const values = Float32Array.from({ length: photons.count }, (_, i) => (isBounce ? photons.bounces[i] : inBand(i)));
      // otherwise a few long paths would leave all others dark
      const most = [...values].sort((a, b) => a - b)[Math.floor(0.99 * (photons.count - 1))] || 1;
      const at = (share) => [...ramp(share)];
      const steps = isBounce ? Math.min(most, 6) : 4;
      legend = Array.from({ length: steps + 1 }, (_, i) => {
        const share = i / steps;
        const name = isBounce ? `${Math.round(share * most)}${i === steps ? " or more" : ""}` : `${Math.round(100 * share)} % of the greatest power`;
        return { colour: at(share), name };
      });
      return (i) => ramp(values[i] / most);
    }
  }
}

function paintPhotons() {
  const paint = points.geometry.getAttribute("paint");
  const colourOf = photonColours();
  for (let i = 0; i < photons.count; i++) paint.array.set(colourOf(i), 3 * i);
  paint.needsUpdate = true;
  element("photonLegend").hidden = false;
  element("photonLegend").replaceChildren(...legend.map(({ colour, name }) => {
    const [line, spot] = [document.createElement("div"), document.createElement("i")];
    spot.style.background = `rgb(${colour.join()})`;
    line.append(spot, name);
    return line;
  }));
}

/** Draws the legend of the photons into a picture. */
function drawLegend(pen, left, top, width, em, ink) {
  let [x, y] = [left, top + em];
  for (const { colour, name } of legend) {
    const wide = 1.6 * em + pen.measureText(name).width + 1.4 * em;
    if (x > left && x + wide > left + width) [x, y] = [left, y + 1.4 * em];
    pen.fillStyle = `rgb(${colour.join()})`;
    pen.beginPath();
    pen.arc(x + 0.5 * em, y - 0.35 * em, 0.5 * em, 0, 7);
    pen.fill();
    pen.fillStyle = ink;
    pen.fillText(name, x + 1.4 * em, y);
    x += wide;
  }
}

// --- flight ---

let flying = null;

/** Lets the photons fly from their lamps along their paths, or stops that and shows all of them again. */
function flyPhotons() {
  if (flying) return stopPhotons();
  if (!state.photons) element("photons").click();
  element("fly").textContent = "■ Stop";
  element("fly").setAttribute("aria-pressed", "true");
  const began = performance.now();
  const time = points.material.uniforms.time;
  const step = (now) => {
    if (!flying) return;
    time.value = Math.max((now - began) / 1000, 0);
    draw();
    if (time.value > lastTime) stopPhotons();
    else flying = requestAnimationFrame(step);
  };
  time.value = 0;
  flying = requestAnimationFrame(step);
  say("photons fly");
}

function stopPhotons() {
  if (!flying) return;
  cancelAnimationFrame(flying);
  flying = null;
  points.material.uniforms.time.value = -1;
  element("fly").textContent = "▶ Let photons fly";
  element("fly").setAttribute("aria-pressed", "false");
  draw();
}

function makePhotonPanel() {
  let most = 0;
  for (const bounce of photons.bounces) most = Math.max(most, bounce);
  state.bounces = [0, most];
  element("photonCount").textContent = `${photons.count.toLocaleString("en")} photons`;
  element("photons").checked = state.photons;
  element("photonColour").value = state.photonColour;
  const show = () => {
    const [low, high] = state.bounces;
    element("bounceText").textContent = low === high ? `${low}` : `${low} to ${high}`;
    element("bounceLow").value = low;
    element("bounceHigh").value = high;
    draw();
  };
  const low = (value) => (state.bounces = [value, Math.max(value, state.bounces[1])]);
  const high = (value) => (state.bounces = [Math.min(value, state.bounces[0]), value]);
  element("bounceLow").max = element("bounceHigh").max = most;
  on("bounceLow", "input", (e) => { low(Number(e.target.value)); show(); });
  on("bounceHigh", "input", (e) => { high(Number(e.target.value)); show(); });
  on("photonSize", "input", (e) => { state.photonSize = Number(e.target.value); draw(); });
  on("fly", "click", flyPhotons);
  const toggle = () => ["photonOptions", "photonLegend", "fly"].forEach((id) => (element(id).hidden = !state.photons));
  on("photons", "change", (e) => {
    stopPhotons();
    state.photons = e.target.checked;
    // photons stand out on pale surfaces
    state.quantity = state.photons ? "none" : "irradiance";
    element("quantity").value = state.quantity;
    toggle();
    repaint(true);
  });
  on("photonColour", "change", (e) => {
    state.photonColour = e.target.value;
    paintPhotons();
    say(`photons by ${e.target.selectedOptions[0].textContent}`);
    draw();
  });
  toggle();
  show();
}
