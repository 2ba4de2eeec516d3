// Numbers of what the mouse is over, and of what was clicked.

/** A number to so many significant digits. */
function short(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
  if (size < -4 || size > 5) return value.toExponential(digits - 1);
  return value.toFixed(Math.max(0, digits - 1 - size));
}

/** Value ± standard error, to two digits of the error. */
function withError({ value, error }) {
  if (Number.isNaN(value)) return "–";
  if (!(error > 0)) return short(value, 4);
  const last = Math.floor(Math.log10(error)) - 1;
  if (last < -6 || last > 2) return `${short(value, 4)} ± ${short(error, 2)}`;
  const digits = Math.max(0, -last);
  return `${value.toFixed(digits)} ± ${error.toFixed(digits)}`;
}

/** A line of a table: what it is, with a value for each band. */
function linesOf(part, tile) {
  const { captor } = part;
  const lines = [];
  const each = (of) => facts.bands.map((_, band) => of(band));
  const { irradiance, flux } = facts.unit;
  if (captor >= 0) {
    const line = (name, channel, factor, unit, quantity, face) => {
      const values = each((band) => {
        const { value, error } = captorValue(captor, channel, band);
        return { value: factor * value, error: factor * error };
      });
      if (!values.every(({ value }) => Number.isNaN(value))) lines.push({ name, values, unit, quantity, face });
    };
    line("front", FRONT, 1, irradiance, "irradiance", "front");
    line("back", BACK, 1, irradiance, "irradiance", "back");
    line("absorbed", ABSORBED, facts.areas[captor], flux, "absorbed", "");
  }
  if (tile < surfaceTiles) {
    const line = (name, channel, quantity, face) => {
      const values = each((band) => ({ value: localValue(tile, channel, band), error: NaN }));
      lines.push({ name, values, unit: irradiance, quantity, face });
    };
    line("here, front", FRONT, "local_irradiance", "front");
    line("here, back", BACK, "local_irradiance", "back");
    line("here, absorbed", ABSORBED, "local_absorbed", "");
  }
  return lines;
}

function nameOf(part) {
  if (part.captor >= 0) return facts.captors[part.captor];
  return part.object >= 0 ? facts.objects[part.object] : "surface";
}

function descriptionOf(part) {
  if (part.material < 0) return `virtual captor, ${short(facts.areas[part.captor])} m²`;
  const material = facts.materials[part.material].name;
  return part.captor >= 0 ? `captor of ${material}, ${short(facts.areas[part.captor])} m²` : material;
}

function cell(row, text, kind = "td") {
  const cell = document.createElement(kind);
  cell.textContent = text;
  row.append(cell);
}

function heading(table, names) {
  const row = document.createElement("tr");
  names.forEach((name) => cell(row, name, "th"));
  table.createTHead().append(row);
}

/** All bands, or the chosen one and the sums where there are many; the table of clicked ones has all. */
function bandsOfTip() {
  const all = facts.bands.map((_, band) => band);
  if (all.length <= 5) return all;
  return all.filter((band) => band === state.band || facts.bands[band].sum).slice(0, 5);
}

function showTip(tile, x, y) {
  const tip = element("tip");
  const part = tile >= 0 && tile < facts.tiles ? partOf(tile) : null;
  const hovered = part ? part.captor : -1;
  if (mesh.material.uniforms.hovered.value !== hovered) {
    mesh.material.uniforms.hovered.value = hovered;
    draw();
  }
  tip.style.display = part ? "block" : "none";
  if (!part) return;
  tip.replaceChildren();
  const title = document.createElement("h2");
  title.textContent = nameOf(part);
  const kind = document.createElement("p");
  kind.textContent = descriptionOf(part);
  const table = document.createElement("table");
  const bands = bandsOfTip();
  heading(table, ["", ...bands.map((band) => facts.bands[band].name), ""]);
  const body = table.createTBody();
  for (const line of linesOf(part, tile)) {
    const row = body.insertRow();
    cell(row, line.name);
    bands.forEach((band) => cell(row, withError(line.values[band])));
    cell(row, line.unit);
  }
  tip.append(title, kind, table);
  if (facts.fewPaths.includes(part.captor)) {
    const warning = document.createElement("p");
    warning.textContent = "few paths found the light here: value and error may be far too small";
    tip.append(warning);
  }
  const box = stage.getBoundingClientRect();
  const left = Math.min(x - box.left + 16, box.width - tip.offsetWidth - 6);
  const below = y - box.top + 16;
  const above = y - box.top - tip.offsetHeight - 12;
  tip.style.left = `${Math.max(left, 4)}px`;
  tip.style.top = `${below + tip.offsetHeight > box.height ? Math.max(above, 4) : below}px`;
}

function list(tile) {
  const part = partOf(tile);
  const same = (row) => (part.captor >= 0 ? row.captor === part.captor : row.tile === tile);
  if (state.listed.some(same)) state.listed = state.listed.filter((row) => !same(row));
  else state.listed.push({ tile, part, captor: part.captor });
  showListed();
}

function showListed() {
  const table = element("table");
  table.replaceChildren();
  element("listed").style.display = state.listed.length ? "block" : "none";
  heading(table, ["captor", "", ...facts.bands.map((band) => band.name), ""]);
  const body = table.createTBody();
  for (const { part, tile } of state.listed) {
    linesOf(part, tile).forEach((line, i) => {
      const row = body.insertRow();
      cell(row, i ? "" : nameOf(part));
      cell(row, line.name);
      line.values.forEach((value) => cell(row, withError(value)));
      cell(row, line.unit);
    });
  }
  paintTiles();
  draw();
}

/** The listed values as `phylux run --csv` writes them. */
function csv() {
  const rows = [["captor", "face", "band", "quantity", "value", "standard_error"]];
  for (const { part, tile } of state.listed) {
    for (const { values, quantity, face } of linesOf(part, tile)) {
      values.forEach(({ value, error }, band) => {
        const number = (n) => (Number.isFinite(n) ? String(Number(n.toPrecision(7))) : "");
        rows.push([nameOf(part), face, facts.bands[band].name, quantity, number(value), number(error)]);
      });
    }
  }
  const quoted = (text) => (/[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  return rows.map((row) => row.map(quoted).join(",") + "\n").join("");
}

async function copyCsv() {
  const text = csv();
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // browsers without a clipboard for pages from the disk
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  element("copy").textContent = "copied";
  setTimeout(() => (element("copy").textContent = "copy as CSV"), 1200);
}
