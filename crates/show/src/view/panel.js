// The panel: its controls, and finding captors.

/** Updates everything that depends on quantity and band; if `fit`, also chooses a range that fits. */
function repaint(fit) {
  paintTiles();
  if (fit) chooseRange();
  showScale();
  showFound();
  showTables();
  showListed();
  showInputs();
  if (points && state.photons) paintPhotons();
  draw();
}

let speaking = 0;
/** Tells those who hear the page what has changed, once it stays so for a moment. */
function say(text) {
  clearTimeout(speaking);
  speaking = setTimeout(() => (element("say").textContent = text), 300);
}

/** Says what the colours stand for now. */
function sayScale() {
  say(state.quantity === "none" ? "no colours of light" : `${scaleText()}: from ${tickText(state.low)} to ${tickText(state.high)}`);
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
      if (points) hidePhotons();
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
    element("listFound").hidden = true;
    say(element("found").textContent);
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
  element("listFound").hidden = false;
  say(element("found").textContent);
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
  showWays();
  showInputs();
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
    const tell = () => (text.textContent = `${name} × ${short(state.lamps[l], 2)}`);
    Object.assign(slider, { type: "range", min: 0, max: 2, step: 0.05, value: state.lamps[l] });
    slider.addEventListener("input", () => {
      state.lamps[l] = Number(slider.value);
      tell();
      relight();
    });
    tell();
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
    const name = document.createElement("span");
    name.textContent = axis;
    row.prepend(name);
    element("clip").append(row);
  });
}

function makePanel() {
  for (const title of ["name", "caption"]) element(title).textContent = facts.scene;
  element("source").textContent = `${facts.source ? facts.source + " · " : ""}phylux ${facts.phylux}`;
  option("quantity", "irradiance", facts.light === "PFD" ? "photon flux density (PFD)" : facts.light);
  option("quantity", "absorbed", "absorbed per area");
  option("quantity", "none", "none (grey)");
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
    button.setAttribute("aria-expanded", "false");
    button.addEventListener("click", () => openTable(tables.of === kind ? "" : kind));
    element("tableButtons").append(button);
  });
  element("findLabel").hidden = !facts.captors.length;
  element("tableSection").hidden = !kinds.length && !facts.captors.length;
  on("copyTable", "click", () => copyText(tableCsv(), "copyTable"));
  on("closeTable", "click", () => openTable(""));
  on("picture", "click", savePicture);
  on("theme", "click", () => { state.theme = isDark() ? "light" : "dark"; showTheme(); });
  on("menu", "click", () => showMenu(!document.body.classList.contains("open")));

  const rescale = (fit) => {
    repaint(fit);
    sayScale();
  };
  on("quantity", "change", (e) => { state.quantity = e.target.value; rescale(true); });
  on("band", "change", (e) => { state.band = Number(e.target.value); rescale(true); });
  on("values", "change", (e) => { state.values = e.target.value; rescale(true); });
  on("auto", "click", () => rescale(true));
  on("sensors", "click", () => {
    chooseRangeOfSensors();
    rescale(false);
  });
  on("log", "change", (e) => { state.log = e.target.checked; rescale(true); });
  const end = (which) => (e) => {
    const value = Number(e.target.value.replace(",", "."));
    const changed = { ...state, [which]: value };
    const fits = Number.isFinite(value) && changed.low < changed.high && (!state.log || changed.low > 0);
    if (fits) state[which] = value;
    showScale();
    if (fits) sayScale();
    else say(`${e.target.value} does not fit: the scale stays from ${tickText(state.low)} to ${tickText(state.high)}`);
    draw();
  };
  on("low", "change", end("low"));
  on("high", "change", end("high"));
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
  on("clearListed", "click", clearListed);
  on("listFound", "click", () => list(parts.find((part) => part.captor === state.found).first));
  watchCourse();
  watchWays();
  watchInputs();

  element("photonSection").hidden = !photons;
  if (photons) makePhotonPanel();
}

/** Opens or closes the settings of a phone. */
function showMenu(open) {
  document.body.classList.toggle("open", open);
  element("menu").setAttribute("aria-expanded", String(open));
  element("menu").textContent = open ? "✕" : "☰";
  element("menu").setAttribute("aria-label", open ? "close the settings" : "settings");
}

function clearListed() {
  state.listed = [];
  relist();
  say("nothing is listed");
  renderer.domElement.focus();
}
