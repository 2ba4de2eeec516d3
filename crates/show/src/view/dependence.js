// What the light of a captor or group depends on: the inputs that matter most, with errors, and how
// uncertain they make it.

const SHOWN_INPUTS = 6;
/** The captor and the group that are shown; the group is that of which a row of the table was clicked last. */
const shownInputs = { captor: -1, group: "", off: false };

/** Returns the captors and groups to show: that of a group that was clicked, or a captor and the groups that it belongs to. */
function placesOfInputs() {
  if (shownInputs.group) return [{ group: shownInputs.group }];
  if (shownInputs.captor < 0) return [];
  const captor = facts.captors[shownInputs.captor];
  // a captor that is a group by itself is told once
  const groups = facts.dependence.groups[shownInputs.captor].filter((group) => group !== captor);
  return [{ captor }, ...groups.map((group) => ({ group }))];
}

/** Shows what a group depends on, of which a row was clicked. */
function chooseGroupOfInputs(group) {
  Object.assign(shownInputs, { group, off: false });
  showInputs();
}

/** Adds the rows of a captor or group; returns whether there are any. */
function addInputs(body, place) {
  const is = (row) => (place.captor ? row.captor === place.captor : row.group === place.group);
  const faces = state.quantity === "absorbed" ? ["absorbed", "front"] : ["front", "absorbed"];
  const pick = (rows) => faces.map((face) => rows.filter((row) => is(row) && row.face === face)).find((found) => found.length) ?? [];
  const title = (face, what) => {
    const row = body.insertRow();
    cell(row, `${place.captor ?? place.group}, ${face === "front" ? "light on the front" : "absorbed light"}`);
    cell(row, what);
    row.className = "place";
  };
  const line = (name, text) => {
    const row = body.insertRow();
    cell(row, name);
    cell(row, text);
  };
  const [face] = pick(facts.dependence.faces);
  const inputs = (face?.inputs ?? []).filter(({ value }) => value[state.band] !== null);
  inputs.sort((a, b) => Math.abs(b.value[state.band]) - Math.abs(a.value[state.band]));
  if (inputs.length) title(face.face, "1 % more of it brings, %");
  for (const { name, value, error } of inputs.slice(0, SHOWN_INPUTS)) {
    line(name, withError({ value: value[state.band], error: error[state.band] ?? 0 }));
  }
  const band = facts.bands[state.band].name;
  const budget = pick(facts.dependence.budget.filter((row) => row.band === band))[0];
  if (budget) {
    const unit = budget.face === "absorbed" ? unitOf(state.band).flux : unitOf(state.band).irradiance;
    title(budget.face, `uncertain by it by, ${unit}`);
    line("all uncertain inputs", short(budget.all, 3));
    for (const { name, value } of budget.inputs) line(name, short(value, 3));
  }
  return inputs.length > 0 || Boolean(budget);
}

/** Shows what the captor depends on that was clicked or found last, or the group. */
function showInputs() {
  if (!facts.dependence) return;
  const captor = wayCaptor();
  if (captor !== shownInputs.captor) Object.assign(shownInputs, { captor, group: "", off: false });
  const places = shownInputs.off ? [] : placesOfInputs();
  const table = element("inputTable");
  table.replaceChildren();
  const body = table.createTBody();
  const any = places.map((place) => addInputs(body, place)).some(Boolean);
  element("inputs").hidden = !any;
  if (!any) return;
  const note = dimmed ? ", with all lamps as in the scene" : "";
  element("inputName").textContent = `What it depends on: ${facts.bands[state.band].name}${note}`;
}

function watchInputs() {
  on("closeInputs", "click", () => { shownInputs.off = true; showInputs(); });
}
