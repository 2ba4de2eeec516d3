// The colour bar, the panel and the mouse.

// --- the colour bar ---

/** Returns round numbers between the ends of the scale. */
function tickValues() {
  const { low, high } = state;
  if (state.log) {
    const decades = Math.log10(high / low);
    const ticks = [];
    for (let exponent = Math.floor(Math.log10(low)); exponent <= Math.log10(high); exponent++) {
      if (decades > 6 && exponent % Math.ceil(decades / 5)) continue;
      for (const digit of decades > 2 ? [1] : decades > 1 ? [1, 3] : [1, 2, 5]) ticks.push(digit * 10 ** exponent);
    }
    return ticks.filter((value) => value >= low * 0.9999 && value <= high * 1.0001);
  }
  const step = tickStep(high - low);
  const first = Math.ceil(low / step - 1e-6);
  return Array.from({ length: Math.floor(high / step + 1e-6) - first + 1 }, (_, i) => (first + i) * step);
}

/** Returns the step between some five ticks of a linear scale of this length. */
function tickStep(length) {
  const rough = length / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 2.5, 5, 10].find((digit) => digit * power >= 0.999 * rough);
}

function showScale() {
  const bar = element("bar").getContext("2d");
  const image = bar.createImageData(256, 1);
  for (let i = 0; i < 256; i++) image.data.set([...colours.subarray(3 * i, 3 * i + 3), 255], 4 * i);
  bar.putImageData(image, 0, 0);
  const ticks = element("ticks");
  ticks.replaceChildren();
  for (const value of tickValues()) {
    const { low, high } = state;
    const f = state.log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    const tick = document.createElement("span");
    tick.style.left = `${100 * f}%`;
    tick.textContent = String(Number(value.toPrecision(6)));
    ticks.append(tick);
  }
  const names = { irradiance: "irradiance", absorbed: "absorbed per area", none: "" };
  element("unit").textContent =
    state.quantity === "none" ? "" : [names[state.quantity], facts.bands[state.band].name, unitOf(state.band).irradiance, timeText()].filter((text) => text).join(", ");
  element("scale").style.opacity = state.quantity === "none" ? 0.35 : 1;
  element("low").value = state.low;
  element("high").value = state.high;
}

/** Updates everything that depends on quantity and band; if `fit`, also chooses a range that fits. */
function repaint(fit) {
  paintTiles();
  if (fit) chooseRange();
  showScale();
  showFound();
  showTables();
  if (points) paintPhotons();
  draw();
}

function paintPhotons() {
  const fraction = points.geometry.getAttribute("fraction");
  const scale = levelValues({ ...photons.levels, most: 1 });
  const power = (i) => facts.bands[state.band].of.reduce((sum, b, place) => sum + weightOf(state.band, place) * scale[photons.powers[i * traced + b]], 0);
  const value = state.photonColour === "bounce" ? (i) => photons.bounces[i] : power;
  const values = Float32Array.from({ length: photons.count }, (_, i) => value(i));
  // otherwise a few long paths would leave all others dark
  const most = values.toSorted()[Math.floor(0.99 * (photons.count - 1))] || 1;
  values.forEach((value, i) => (fraction.array[i] = value / most));
  fraction.needsUpdate = true;
}

// --- the panel ---

function option(select, value, text) {
  const option = document.createElement("option");
  option.value = value;
  option.textContent = text;
  element(select).append(option);
}

function on(id, event, act) {
  element(id).addEventListener(event, act);
}

/** Makes check boxes that hide objects or materials. */
function makeList(id, kind, names, isHidden) {
  const MOST = 300;
  const counts = new Map();
  for (const part of parts) counts.set(part[kind], (counts.get(part[kind]) ?? 0) + part.end - part.first);
  const keys = [...counts.keys()].filter((key) => key >= 0 || kind === "object").sort((a, b) => a - b);
  for (const key of keys.slice(0, MOST)) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = !isHidden(key);
    box.dataset.key = key;
    box.addEventListener("change", () => {
      state.hidden[kind][box.checked ? "delete" : "add"](key);
      paintTiles();
      draw();
    });
    const name = document.createElement("span");
    name.textContent = key < 0 ? "sensors and planes" : names[key];
    label.append(box, name);
    element(id).append(label);
  }
  if (keys.length > MOST) element(id).append(`and ${keys.length - MOST} more`);
}

/** Returns the captor of this name, or else the first whose name contains it; -1 if there is none. */
function named(text) {
  const exact = facts.captors.indexOf(text);
  if (exact >= 0 || !text.trim()) return exact;
  return facts.captors.findIndex((id) => id.toLowerCase().includes(text.trim().toLowerCase()));
}

/** Marks a captor, shows it if it was hidden, shows its numbers, and looks at its front from near by. */
function find(text) {
  const captor = named(text);
  const own = parts.filter((part) => part.captor === captor);
  state.found = captor;
  if (captor < 0 || !own.length) {
    element("found").textContent = text.trim() ? "no captor has this in its name" : "";
    markFound();
    draw();
    return;
  }
  for (const { object, material } of own) {
    for (const [kind, key] of [["object", object], ["material", material]]) {
      if (!state.hidden[kind].delete(key)) continue;
      const box = element(`${kind}s`).querySelector(`[data-key="${key}"]`);
      if (box) box.checked = true;
    }
  }
  showFound();
  markFound();
  repaint(false);
  const [middle, normal] = [new T.Vector3(), new T.Vector3()];
  let area = 0;
  for (const part of own) {
    for (const triangle of tilesOf(part).flatMap(trianglesOf)) {
      const [a, b, c] = triangle.map((corner) => new T.Vector3(...corner));
      const cross = b.clone().sub(a).cross(c.clone().sub(a));
      const centre = a.clone().add(b).add(c).divideScalar(3);
      middle.addScaledVector(centre, cross.length());
      normal.add(cross);
      area += cross.length();
    }
  }
  if (area > 0) middle.divideScalar(area);
  if (normal.length() < 1e-6 * area) normal.set(0.45, -1, 0.55);
  // OrbitControls cannot look straight down
  normal.normalize().add(new T.Vector3(0.01, -0.1, 0)).normalize();
  controls.target.copy(middle);
  camera.position.copy(middle).addScaledVector(normal, 4 * Math.sqrt(area));
  controls.update();
  draw();
}

function markFound() {
  markTiles(parts.filter((part) => part.captor === state.found && state.found >= 0).flatMap(tilesOf));
}

/** Shows the values of the captor that was found. */
function showFound() {
  const part = parts.find((part) => part.captor === state.found && state.found >= 0);
  if (!part) return;
  const line = (name, channel, factor, unit) => {
    const { value, error } = captorValue(part.captor, channel, state.band);
    return Number.isNaN(value) ? [] : [`${name} ${withError({ value: factor * value, error: factor * error })} ${unit}`];
  };
  const { irradiance, flux } = unitOf(state.band);
  const lines = [
    nameOf(part), ...line("front", FRONT, 1, irradiance), ...line("back", BACK, 1, irradiance),
    ...line("absorbed", ABSORBED, facts.areas[part.captor], flux),
  ];
  element("found").textContent = lines.join("\n");
}

/** Returns the hour that is shown, as text. */
function timeText() {
  if (state.hour < 0) return "";
  const count = hours.clocks.length;
  return `${hours.days[Math.floor(state.hour / count)]} ${hours.clocks[state.hour % count]}`;
}

/** Makes sliders for the day and the time of day. */
function makeTime() {
  element("timeSection").hidden = !hours;
  if (!hours) return;
  const count = hours.clocks.length;
  let last = state.hour >= 0 ? state.hour : brightestHour();
  const show = (fit) => {
    if (state.hour >= 0) last = state.hour;
    const [day, clock] = [Math.floor(last / count), last % count];
    element("byHour").checked = state.hour >= 0;
    element("timeOptions").hidden = state.hour < 0;
    element("valuesLabel").hidden = state.hour >= 0 || !local || !facts.captors.length;
    // in the hours of a year lamps follow the control of that year
    element("lampSection").hidden = state.hour >= 0 || !facts.lamps.length;
    [element("day").value, element("clock").value] = [day, clock];
    [element("dayText").textContent, element("clockText").textContent] = [hours.days[day], hours.clocks[clock]];
    if (fit !== undefined) repaint(fit);
  };
  element("day").max = hours.days.length - 1;
  element("clock").max = count - 1;
  on("byHour", "change", (e) => { state.hour = e.target.checked ? last : -1; show(true); });
  on("day", "input", (e) => { state.hour = Number(e.target.value) * count + (state.hour % count); show(false); });
  on("clock", "input", (e) => { state.hour += Number(e.target.value) - (state.hour % count); show(false); });
  show();
}

/** Makes a slider for the power of each lamp. */
function makeLamps() {
  element("lampSection").hidden = !facts.lamps.length;
  makeLampSliders();
  on("allLamps", "click", () => {
    state.lamps.fill(1);
    makeLampSliders();
    relight();
  });
}

function makeLampSliders() {
  element("lamps").replaceChildren();
  facts.lamps.forEach((name, l) => {
    const label = document.createElement("label");
    const [text, slider] = [document.createElement("span"), document.createElement("input")];
    const say = () => (text.textContent = `${name} × ${short(state.lamps[l], 2)}`);
    Object.assign(slider, { type: "range", min: 0, max: 2, step: 0.05, value: state.lamps[l] });
    slider.addEventListener("input", () => {
      state.lamps[l] = Number(slider.value);
      say();
      relight();
    });
    say();
    label.append(text, slider);
    element("lamps").append(label);
  });
}

/** Updates all colours and numbers for the lamps as they are set, on the present scale. */
function relight() {
  dimmed = state.lamps.some((factor) => factor !== 1);
  repaint(false);
}

/** Makes two sliders for each axis. */
function makeClip() {
  ["x", "y", "z"].forEach((axis, i) => {
    const row = document.createElement("div");
    row.className = "row";
    [0, 1].forEach((end) => {
      const slider = document.createElement("input");
      Object.assign(slider, { type: "range", min: 0, max: 1, step: 0.005, value: state.clip[2 * i + end] });
      slider.setAttribute("aria-label", `${axis} ${end ? "to" : "from"}`);
      slider.addEventListener("input", () => {
        state.clip[2 * i + end] = Number(slider.value);
        draw();
      });
      row.append(slider);
    });
    row.prepend(axis);
    element("clip").append(row);
  });
}

function makePanel() {
  for (const title of ["name", "caption"]) element(title).textContent = facts.scene;
  element("source").textContent = `${facts.source ? facts.source + " · " : ""}phylux ${facts.phylux}`;
  option("quantity", "irradiance", "irradiance");
  option("quantity", "absorbed", "absorbed per area");
  option("quantity", "none", "none (pale)");
  facts.bands.forEach((band, i) => option("band", i, band.name));
  facts.captors.slice(0, 2000).forEach((id) => {
    const option = document.createElement("option");
    option.value = id;
    element("ids").append(option);
  });
  element("band").value = state.band;
  element("values").value = state.values;
  element("valuesLabel").hidden = !local || !facts.captors.length;
  makeList("objects", "object", facts.objects, (key) => state.hidden.object.has(key));
  makeList("materials", "material", facts.materials.map((m) => m.name), (key) => state.hidden.material.has(key));
  for (const [id, value] of [["quantity", state.quantity], ["cut", state.cut]]) element(id).value = value;
  for (const [id, value] of [["log", state.log], ["clear", state.clear], ["planes", state.planes], ["images", state.images], ["dark", state.dark], ["shade", state.shade], ["smooth", state.smooth]]) element(id).checked = value;
  makeLamps();
  makeTime();
  makeClip();
  const kinds = ["groups", "plants", "captors"].filter((kind) => rowsOf(kind).length);
  kinds.forEach((kind) => {
    const button = document.createElement("button");
    button.textContent = kind;
    button.addEventListener("click", () => { tables.of = tables.of === kind ? "" : kind; showTables(); });
    element("tableButtons").append(button);
  });
  element("tableSection").hidden = !kinds.length;
  on("copyTable", "click", () => copyText(tableCsv(), "copyTable"));
  on("closeTable", "click", () => { tables.of = ""; showTables(); });
  on("picture", "click", savePicture);
  on("theme", "click", () => { state.theme = isDark() ? "light" : "dark"; showTheme(); });
  on("menu", "click", () => document.body.classList.toggle("open"));

  on("quantity", "change", (e) => { state.quantity = e.target.value; repaint(true); });
  on("band", "change", (e) => { state.band = Number(e.target.value); repaint(true); });
  on("values", "change", (e) => { state.values = e.target.value; repaint(true); });
  on("auto", "click", () => repaint(true));
  on("sensors", "click", () => {
    chooseRangeOfSensors();
    repaint(false);
  });
  on("log", "change", (e) => { state.log = e.target.checked; repaint(true); });
  for (const end of ["low", "high"]) {
    on(end, "change", (e) => {
      const value = Number(e.target.value.replace(",", "."));
      const changed = { ...state, [end]: value };
      const fits = Number.isFinite(value) && changed.low < changed.high && (!state.log || changed.low > 0);
      if (fits) state[end] = value;
      showScale();
      draw();
    });
  }
  on("cut", "input", (e) => { state.cut = Number(e.target.value); draw(); });
  on("clear", "change", (e) => { state.clear = e.target.checked; draw(); });
  on("dark", "change", (e) => { state.dark = e.target.checked; draw(); });
  element("planesLabel").hidden = !parts.some((part) => part.large);
  on("planes", "change", (e) => { state.planes = e.target.checked; repaint(false); });
  element("imagesLabel").hidden = !facts.periods;
  on("images", "change", (e) => { state.images = e.target.checked; draw(); });
  on("shade", "change", (e) => { state.shade = e.target.checked; draw(); });
  element("smoothLabel").hidden = !meeting;
  on("smooth", "change", (e) => { state.smooth = e.target.checked; repaint(false); });
  on("find", "change", (e) => find(e.target.value));
  on("copy", "click", () => copyText(csv(), "copy"));
  on("clearListed", "click", () => { state.listed = []; showListed(); });

  element("photonSection").hidden = !photons;
  if (photons) makePhotonPanel();
}

function makePhotonPanel() {
  let most = 0;
  for (const bounce of photons.bounces) most = Math.max(most, bounce);
  state.bounces = [0, most];
  element("photonCount").textContent = `${photons.count.toLocaleString("en")} photons`;
  const show = () => {
    const [low, high] = state.bounces;
    element("bounceText").textContent = low === high ? `${low}` : `${low} to ${high}`;
    element("bounceLow").value = low;
    element("bounceHigh").value = high;
    draw();
  };
  const low = (value) => (state.bounces = [value, Math.max(value, state.bounces[1])]);
  const high = (value) => (state.bounces = [Math.min(value, state.bounces[0]), value]);
  for (const [id, set] of [["bounceLow", low], ["bounceHigh", high]]) {
    element(id).max = most;
    on(id, "input", (e) => { set(Number(e.target.value)); show(); });
  }
  const toggle = () => (element("photonOptions").hidden = !state.photons);
  on("photons", "change", (e) => {
    state.photons = e.target.checked;
    // photons stand out on pale surfaces
    state.quantity = state.photons ? "none" : "irradiance";
    element("quantity").value = state.quantity;
    toggle();
    repaint(true);
  });
  on("photonColour", "change", (e) => { state.photonColour = e.target.value; paintPhotons(); draw(); });
  toggle();
  show();
}

// --- the mouse ---

function watchMouse() {
  const canvas = renderer.domElement;
  let at = null, waiting = false, pressed = null;
  const look = () => {
    waiting = false;
    if (at) showTip(tileAt(at.x, at.y), at.x, at.y);
  };
  canvas.addEventListener("pointermove", (e) => {
    at = e.buttons ? null : { x: e.clientX, y: e.clientY };
    if (!at) showTip(-1);
    else if (!waiting) {
      waiting = true;
      requestAnimationFrame(look);
    }
  });
  // a finger that is lifted leaves, too, and what it has asked for stays
  canvas.addEventListener("pointerleave", (e) => {
    if (e.pointerType !== "touch") { at = null; showTip(-1); }
  });
  canvas.addEventListener("pointerdown", (e) => (pressed = { x: e.clientX, y: e.clientY }));
  canvas.addEventListener("pointerup", (e) => {
    // a click, not the end of a drag
    if (e.button !== 0 || !pressed || Math.hypot(e.clientX - pressed.x, e.clientY - pressed.y) > 4) return;
    const tile = tileAt(e.clientX, e.clientY);
    // a finger does not hover
    if (e.pointerType === "touch") showTip(tile, e.clientX, e.clientY);
    else if (tile >= 0 && tile < facts.tiles) list(tile);
  });
}

// --- the keyboard ---

/** Turns the viewpoint around the point that it looks at, by these angles in degrees about the vertical and upwards. */
function turn(across, up) {
  const away = camera.position.clone().sub(controls.target);
  const vertical = new T.Vector3(0, 0, 1);
  away.applyAxisAngle(vertical, (across * Math.PI) / 180);
  const right = vertical.clone().cross(away).normalize();
  const turned = away.clone().applyAxisAngle(right, (-up * Math.PI) / 180);
  // not over the top
  if (Math.abs(turned.z) < 0.998 * turned.length()) away.copy(turned);
  camera.position.copy(controls.target).add(away);
  controls.update();
  draw();
}

/** Moves the viewpoint by fractions of its distance to the point that it looks at. */
function move(right, up) {
  const away = camera.position.clone().sub(controls.target);
  const across = new T.Vector3(0, 0, 1).cross(away).normalize();
  const step = across.clone().multiplyScalar(right * away.length());
  step.addScaledVector(away.clone().normalize().cross(across), up * away.length());
  camera.position.add(step);
  controls.target.add(step);
  controls.update();
  draw();
}

function zoom(factor) {
  const away = camera.position.clone().sub(controls.target);
  camera.position.copy(controls.target).addScaledVector(away, factor);
  controls.update();
  draw();
}

/** Returns to the captors or, with `all`, shows the whole scene. */
function resetView(all) {
  if (all) lookAtAll();
  else lookAtCaptors();
  element("clear").checked = state.clear;
  draw();
}

function watchKeys() {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const keys = {
    "+": () => zoom(0.9), "=": () => zoom(0.9), "-": () => zoom(1 / 0.9), Home: () => resetView(false), a: () => resetView(true),
    f: () => element("find").focus(), p: savePicture, t: () => element("tableButtons").firstElementChild?.click(),
    Escape: () => { tables.of = ""; showTables(); showTip(-1); },
  };
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || e.target.matches("input, select, textarea, summary, button")) return;
    const arrow = arrows[e.key];
    if (arrow) (e.shiftKey ? move(0.05 * arrow[0], 0.05 * arrow[1]) : turn(5 * arrow[0], 5 * arrow[1]));
    else if (keys[e.key]) keys[e.key]();
    else return;
    e.preventDefault();
  });
}
