// How light reaches a captor: some of the histories that bring it as lines, and a list of their lamps and last surfaces.

/** The lines of all captors that the page follows, as `readData` reads them. */
let ways;
/** What is drawn of them now, and the captor and the group that it is of; -1 stands for all groups. */
let wayLines = null;
const shownWays = { captor: -1, group: -1, off: false };

/** Reads the lines: for each captor where its lines begin, of each line where its places begin. */
async function readWays() {
  if (!facts.histories) return;
  const [places, sizes, groups] = [
    await unpack("historyPlaces", Uint16Array), await unpack("historySizes", Uint16Array), await unpack("historyGroups", Uint8Array),
  ];
  const starts = new Uint32Array(sizes.length + 1);
  sizes.forEach((size, i) => (starts[i + 1] = starts[i] + size));
  const of = new Map();
  let line = 0;
  for (const own of facts.histories.captors) {
    of.set(own.captor, { ...own, first: line });
    line += own.lines;
  }
  ways = { places, starts, groups, of };
}

/** Returns the captor that was clicked last or, if none is listed, the one that was found; -1 without any. */
function wayCaptor() {
  const listed = state.listed.filter(({ captor }) => captor >= 0).at(-1);
  return listed ? listed.captor : state.found;
}

/** Returns the colour of a group, bytes. */
function wayColour(group) {
  return KINDS[group] ?? OTHERS;
}

/** Draws the lines of the captor and the group that are chosen. */
function drawWays() {
  if (wayLines) {
    scene.remove(wayLines);
    wayLines.geometry.dispose();
    wayLines.material.dispose();
    wayLines = null;
  }
  const own = shownWays.off ? null : ways?.of.get(shownWays.captor);
  if (!own) return;
  const [ends, paint] = [[], []];
  for (let line = own.first; line < own.first + own.lines; line++) {
    const group = ways.groups[line];
    if (shownWays.group >= 0 && group !== shownWays.group) continue;
    for (let i = ways.starts[line]; i + 1 < ways.starts[line + 1]; i++) {
      ends.push(...ways.places.subarray(3 * i, 3 * i + 6));
      paint.push(...wayColour(group), ...wayColour(group));
    }
  }
  const geometry = new T.BufferGeometry();
  geometry.setAttribute("position", new T.BufferAttribute(Uint16Array.from(ends), 3, true));
  geometry.setAttribute("color", new T.BufferAttribute(Uint8Array.from(paint), 3, true));
  // what stands before them does not hide them: most of the way of light is inside plants and rooms
  const material = new T.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.75, depthTest: false, depthWrite: false });
  wayLines = new T.LineSegments(geometry, material);
  wayLines.position.set(...facts.histories.min);
  wayLines.scale.set(...facts.histories.size.map((side) => Math.max(side, 1e-30)));
  wayLines.frustumCulled = false;
  wayLines.renderOrder = 2;
  scene.add(wayLines);
}

/** Returns the name of a last surface. */
function wayName({ object, material }) {
  if (material === null) return "direct";
  const name = facts.materials[material].name;
  const whole = object >= 0 ? facts.objects[object] : "surfaces";
  return whole === name ? name : `${whole} (${name})`;
}

/** Returns a share in percent with its error. */
function wayShare(group, band) {
  const [value, error] = [group.share[band], group.error[band]];
  return withError({ value: value === null ? NaN : 100 * value, error: 100 * (error ?? 0) });
}

/** Shows the lines and the list of the captor that was clicked or found last. */
function showWays() {
  const captor = wayCaptor();
  if (captor !== shownWays.captor) Object.assign(shownWays, { captor, group: -1, off: false });
  const isShown = Boolean(ways) && captor >= 0 && !shownWays.off;
  element("ways").hidden = !isShown;
  drawWays();
  if (!isShown) return;
  const own = ways.of.get(captor);
  element("wayName").textContent = `How light reaches ${facts.captors[captor]}`;
  const table = element("wayTable");
  table.replaceChildren();
  if (!own) {
    element("wayText").textContent = "this page does not follow its light: make it with `phylux view --to` and its name";
    return;
  }
  if (!own.histories) {
    element("wayText").textContent = `no light has come here in ${own.photons.toLocaleString("en")} photons`;
    return;
  }
  heading(table, ["lamp", "last surface", `share of ${facts.bands[state.band].name}, %`]);
  const body = table.createTBody();
  own.groups.forEach((group, i) => {
    const row = body.insertRow();
    row.className = shownWays.group === i ? "chosen" : "";
    cell(row, "");
    const [button, spot] = [document.createElement("button"), document.createElement("i")];
    spot.style.background = `rgb(${wayColour(i).join()})`;
    button.append(spot, group.light);
    button.title = "show the lines of this group alone, or of all again";
    button.setAttribute("aria-pressed", String(shownWays.group === i));
    row.cells[0].append(button);
    row.addEventListener("click", () => {
      shownWays.group = shownWays.group === i ? -1 : i;
      showWays();
      element("wayTable").tBodies[0].rows[i].querySelector("button").focus();
      say(shownWays.group < 0 ? "lines of all groups" : `lines of ${group.light}, ${wayName(group)}`);
      draw();
    });
    cell(row, wayName(group));
    cell(row, wayShare(group, state.band));
  });
  const drawn = `${own.lines} of ${own.histories.toLocaleString("en")} histories, drawn in proportion to their ${facts.bands[facts.histories.band].name}`;
  const more = own.more ? `; ${own.more} more groups with less light` : "";
  const notes = [dimmed && "with all lamps as in the scene", state.hour >= 0 && "in the mean of the whole period"].filter(Boolean);
  element("wayText").textContent = drawn + more + (notes.length ? `; ${notes.join(", ")}` : "");
}

function watchWays() {
  on("closeWays", "click", () => { shownWays.off = true; showWays(); draw(); });
}
