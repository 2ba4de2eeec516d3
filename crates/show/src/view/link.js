// The view as part of the page's link.

/** Returns the view as text that follows the `#` of a link. */
function linkText() {
  const list = (numbers) => [...numbers].map((n) => Number(n.toPrecision(6))).join(",");
  const off = (kind) => [...state.hidden[kind]].join(",");
  return new URLSearchParams({
    quantity: state.quantity, band: facts.bands[state.band].name, values: state.values,
    range: list([state.low, state.high]), log: Number(state.log), cut: state.cut, clear: Number(state.clear), planes: Number(state.planes),
    ...(facts.periods && { images: Number(state.images) }), clip: list(state.clip),
    unlit: Number(state.dark), shading: Number(state.shade), smooth: Number(state.smooth), objects: off("object"), materials: off("material"),
    eye: list(camera.position), at: list(controls.target),
    ...(facts.year && { time: timeText() || "all" }),
    ...(state.photons && { photons: state.photonColour }),
    ...(dimmed && { lamps: list(state.lamps) }), ...(state.theme && { theme: state.theme }),
    ...(state.found >= 0 && { find: facts.captors[state.found] }),
  }).toString();
}

let saving = 0;
/** Writes the view into the link, a little after the last change: browsers refuse many changes at once. */
function saveLink() {
  clearTimeout(saving);
  saving = setTimeout(() => history.replaceState(null, "", `#${linkText()}`), 250);
}

/** Applies the settings of the link that this scene has, and returns whether they include a range. */
function readLink() {
  const link = new URLSearchParams(location.hash.slice(1));
  const numbers = (key, count) => {
    const found = (link.get(key) ?? "").split(",").map(Number);
    return link.get(key) && found.length === count && found.every(Number.isFinite) ? found : null;
  };
  const flag = (key, old) => (link.has(key) ? link.get(key) === "1" : old);
  const chosen = (key, all, old) => (all.includes(link.get(key)) ? link.get(key) : old);
  state.quantity = chosen("quantity", ["irradiance", "absorbed", "none"], state.quantity);
  state.values = local ? chosen("values", ["local", "captor"], state.values) : "captor";
  state.theme = chosen("theme", ["dark", "light"], state.theme);
  const band = facts.bands.findIndex((band) => band.name === link.get("band"));
  if (band >= 0) state.band = band;
  state.log = flag("log", state.log);
  state.clear = flag("clear", state.clear);
  state.planes = flag("planes", state.planes);
  if (facts.periods) state.images = flag("images", state.images);
  state.dark = flag("unlit", state.dark);
  state.shade = flag("shading", state.shade);
  state.smooth = flag("smooth", state.smooth);
  const inside = (n) => Math.min(Math.max(n, 0), 1);
  state.cut = inside(numbers("cut", 1)?.[0] ?? 0);
  state.clip = (numbers("clip", 6) ?? state.clip).map(inside);
  state.lamps = (numbers("lamps", facts.lamps.length) ?? state.lamps).map((factor) => Math.max(factor, 0));
  dimmed = state.lamps.some((factor) => factor !== 1);
  for (const [key, kind] of [["objects", "object"], ["materials", "material"]]) {
    if (link.has(key)) state.hidden[kind] = new Set(link.get(key).split(",").filter((n) => n).map(Number).filter(Number.isInteger));
  }
  if (facts.year && link.has("time")) readTime(link.get("time"));
  state.photons = Boolean(photons) && link.has("photons");
  if (state.photons) state.photonColour = chosen("photons", PHOTON_COLOURS, state.photonColour);
  state.found = facts.captors.indexOf(link.get("find"));
  const [eye, at] = [numbers("eye", 3), numbers("at", 3)];
  if (eye && at) {
    camera.position.set(...eye);
    controls.target.set(...at);
    controls.update();
  }
  const range = numbers("range", 2);
  const fits = range && range[0] < range[1] && (!state.log || range[0] > 0);
  if (fits) [state.low, state.high] = range;
  return Boolean(fits);
}
