// The numbers of the tile under the mouse, and of those that were clicked.

/** Formats a number with this many significant digits. */
function short(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
  if (size < -4 || size > 5) return value.toExponential(digits - 1);
  return value.toFixed(Math.max(0, digits - 1 - size));
}

/** Formats value ± standard error, to two digits of the error. */
function withError({ value, error }) {
  if (Number.isNaN(value)) return "–";
  if (!(error > 0)) return short(value, 4);
  const last = Math.floor(Math.log10(error)) - 1;
  if (last < -6 || last > 2) return `${short(value, 4)} ± ${short(error, 2)}`;
  const digits = Math.max(0, -last);
  return `${value.toFixed(digits)} ± ${error.toFixed(digits)}`;
}

/** Returns the name of a band or sum, with its units where they are not those of the lines. */
function headOf(band) {
  const { name, unit } = facts.bands[band];
  return unit ? `${name} (${unit.irradiance}; absorbed: ${unit.flux})` : name;
}

/** Returns the lines of a table for a tile: each has a name and a value for each band. */
function linesOf(part, tile) {
  const { captor } = part;
  const lines = [];
  const each = (of) => facts.bands.map((_, band) => of(band));
  const { flux } = facts.unit;
  const irradiance = isDaily() ? facts.year.unit : facts.unit.irradiance;
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
  // the light at a place is that of the whole period
  if (tile < surfaceTiles && state.hour < 0) {
    const line = (name, channel, quantity, face) => {
      const values = each((band) => {
        const value = localValue(tile, channel, band);
        return { value, error: value > 0 ? value * facts.localError : NaN };
      });
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
  if (kind === "th") cell.scope = "col";
  row.append(cell);
}

function heading(table, names) {
  const row = document.createElement("tr");
  names.forEach((name) => cell(row, name, "th"));
  table.createTHead().append(row);
}

/** Returns all bands or, of more than five, the chosen one and the sums; on a phone only the chosen one. The table of clicked
 *  tiles has all. */
function bandsOfTip() {
  if (stage.clientWidth < 640) return [state.band];
  const all = facts.bands.map((_, band) => band);
  if (all.length <= 5) return all;
  return all.filter((band) => band === state.band || facts.bands[band].sum).slice(0, 5);
}

function showTip(tile, x, y) {
  const tip = element("tip");
  const part = tile >= 0 && tile < facts.tiles ? partOf(tile) : null;
  const hovered = part ? part.captor : -1;
  if (paintMaterial.uniforms.hovered.value !== hovered) {
    paintMaterial.uniforms.hovered.value = hovered;
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
  const lines = linesOf(part, tile);
  if (lines.length) heading(table, ["", ...bands.map(headOf), ""]);
  const body = table.createTBody();
  for (const line of lines) {
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
  placeTip(tip, box, aroundTiles(part.captor >= 0 ? tilesOf(part) : [tile], x - box.left, y - box.top, box));
}

/** Returns the rectangle of the stage that tiles take there, with the mouse in it. */
function aroundTiles(tiles, x, y, { width, height }) {
  const around = { left: x, right: x, top: y, bottom: y };
  const corner = new T.Vector3();
  // the outline of a leaf is known well enough from some of its tiles
  const step = Math.ceil(tiles.length / 500);
  for (let i = 0; i < tiles.length; i += step) {
    for (const place of cornersOf(tiles[i])) {
      const { x, y, z } = corner.set(...place).project(camera);
      if (Math.abs(z) > 1) continue;
      const [across, down] = [((1 + x) / 2) * width, ((1 - y) / 2) * height];
      around.left = Math.min(around.left, Math.max(across, 0));
      around.right = Math.max(around.right, Math.min(across, width));
      around.top = Math.min(around.top, Math.max(down, 0));
      around.bottom = Math.max(around.bottom, Math.min(down, height));
    }
  }
  return around;
}

/** Places the tip beside what it tells of; if there is no room, where it covers least of it. */
function placeTip(tip, stage, { left, right, top, bottom }) {
  const [width, height, GAP] = [tip.offsetWidth, tip.offsetHeight, 12];
  const [middle, centre] = [(left + right - width) / 2, (top + bottom - height) / 2];
  const [farRight, farDown] = [stage.width - width - 4, stage.height - height - 4];
  const inside = ([x, y]) => [Math.max(Math.min(x, farRight), 4), Math.max(Math.min(y, farDown), 4)];
  const covers = ([x, y]) => {
    const across = Math.min(x + width, right) - Math.max(x, left);
    const down = Math.min(y + height, bottom) - Math.max(y, top);
    return Math.max(across + GAP / 2, 0) * Math.max(down + GAP / 2, 0);
  };
  const places = [
    [right + GAP, centre], [left - GAP - width, centre], [middle, bottom + GAP], [middle, top - GAP - height],
    [farRight, 4], [farRight, farDown], [4, 4], [4, farDown],
  ].map(inside);
  const [x, y] = places.reduce((best, place) => (covers(place) < covers(best) ? place : best));
  [tip.style.left, tip.style.top] = [`${x}px`, `${y}px`];
}

function list(tile) {
  const part = partOf(tile);
  const same = (row) => (part.captor >= 0 ? row.captor === part.captor : row.tile === tile);
  if (state.listed.some(same)) state.listed = state.listed.filter((row) => !same(row));
  else state.listed.push({ tile, part, captor: part.captor });
  courseOff = shownWays.off = false;
  say(`${nameOf(part)} ${state.listed.some(same) ? "is listed" : "is no longer listed"}`);
  relist();
}

function showListed() {
  const table = element("table");
  table.replaceChildren();
  element("listed").hidden = !state.listed.length;
  // on a phone the chosen band; the CSV has all
  const bands = stage.clientWidth < 640 ? [state.band] : facts.bands.map((_, band) => band);
  heading(table, ["captor", "", ...bands.map(headOf), ""]);
  const body = table.createTBody();
  for (const { part, tile } of state.listed) {
    linesOf(part, tile).forEach((line, i) => {
      const row = body.insertRow();
      cell(row, i ? "" : nameOf(part));
      cell(row, line.name);
      bands.forEach((band) => cell(row, withError(line.values[band])));
      cell(row, line.unit);
    });
  }
  showCourse();
  showWays();
  showInputs();
}

/** Lists or takes away, and marks what is listed. */
function relist() {
  showListed();
  paintTiles();
  draw();
}

/** Returns the listed values as `phylux run --csv` writes them. */
function csv() {
  return csvOf(state.listed.map(({ part, tile }) => ({ name: nameOf(part), lines: linesOf(part, tile) })));
}

/** Returns lines of names with values in each band. */
function csvOf(entries) {
  const number = (n) => (Number.isFinite(n) ? String(Number(n.toPrecision(7))) : "");
  // a spreadsheet would run such a text as a formula
  const plain = (text) => (/^[=+\-@\t\r\n'\uff1d\uff0b\uff0d\uff20]/.test(text) ? `'${text}` : text);
  const quoted = (text) => (/[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const rows = [["captor", "face", "band", "quantity", "value", "standard_error"]];
  for (const { name, lines } of entries) {
    for (const { values, quantity, face } of lines) {
      values.forEach(({ value, error }, band) => {
        rows.push([plain(name), face, plain(facts.bands[band].name), quantity, number(value), number(error)]);
      });
    }
  }
  return rows.map((row) => row.map(quoted).join(",") + "\n").join("");
}

async function copyText(text, button) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // some browsers have no clipboard for pages from the disk
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  element(button).textContent = "Copied";
  say("copied");
  setTimeout(() => (element(button).textContent = "Copy as CSV"), 1200);
}

// --- tables of groups, plants and captors ---

const MOST_ROWS = 1000;
const tables = { of: "", column: 0, down: false };

/** Opens a table, or closes it with the empty name; what had the focus before gets it back. */
function openTable(kind) {
  const opened = tables.of;
  tables.of = kind;
  showTables();
  const button = (name) => [...element("tableButtons").children].find(({ textContent }) => textContent === name);
  for (const other of element("tableButtons").children) other.setAttribute("aria-expanded", other.textContent === kind);
  if (kind) element("copyTable").focus();
  else button(opened)?.focus();
}

/** Returns the rows of a table of captors, groups or plants; an instance of an object counts as a plant. */
function rowsOf(kind) {
  if (kind === "captors") {
    return facts.captors.map((name, i) => ({ name, area: facts.areas[i], captor: i, value: (c, b) => captorValue(i, c, b) }));
  }
  const rows = facts.groups.map((group, i) => ({ ...group, captor: -1, value: (c, b) => groupValue(i, c, b) }));
  return rows.filter(({ name }) => /#\d+$/.test(name) === (kind === "plants"));
}

/** Returns the columns of a table: a name, a number to sort by, and its text. */
function columnsOf(rows) {
  const columns = [
    { name: "name", sort: (row) => row.name, text: (row) => row.name },
    { name: "area, m²", sort: (row) => row.area, text: (row) => short(row.area) },
  ];
  const add = (name, quantity, channel, factor) => facts.bands.forEach((band, b) => {
    const at = (row) => {
      const { value, error } = row.value(channel, b);
      return { value: factor(row) * value, error: factor(row) * error };
    };
    if (rows.every((row) => Number.isNaN(at(row).value))) return;
    columns.push({ name: `${name} ${band.name}, ${unitOf(b)[quantity]}`, sort: (row) => at(row).value, text: (row) => withError(at(row)) });
  });
  add("front", "irradiance", FRONT, () => 1);
  add("absorbed", "flux", ABSORBED, (row) => row.area);
  return columns;
}

function showTables() {
  const box = element("tables");
  box.hidden = !tables.of;
  if (!tables.of) return;
  element("tableName").textContent = tables.of;
  const rows = rowsOf(tables.of);
  const columns = columnsOf(rows);
  const key = columns[Math.min(tables.column, columns.length - 1)].sort;
  const keys = new Map(rows.map((row) => [row, key(row)]));
  const order = (a, b) => {
    const [x, y] = [keys.get(a), keys.get(b)];
    if (typeof x === "string") return x.localeCompare(y, "en", { numeric: true });
    return (Number.isNaN(x) ? -Infinity : x) - (Number.isNaN(y) ? -Infinity : y);
  };
  rows.sort((a, b) => (tables.down ? order(b, a) : order(a, b)));
  const table = element("groupTable");
  table.replaceChildren();
  heading(table, columns.map((column) => column.name));
  [...table.tHead.rows[0].cells].forEach((cell, i) => {
    const button = document.createElement("button");
    button.textContent = cell.textContent + (i === tables.column ? (tables.down ? " ▾" : " ▴") : "");
    button.addEventListener("click", () => {
      // numbers are sorted from the largest
      tables.down = i === tables.column ? !tables.down : i > 0;
      tables.column = i;
      showTables();
      table.tHead.rows[0].cells[i].firstChild.focus();
    });
    cell.replaceChildren(button);
    cell.setAttribute("aria-sort", i === tables.column ? (tables.down ? "descending" : "ascending") : "none");
  });
  const body = table.createTBody();
  for (const row of rows.slice(0, MOST_ROWS)) {
    const line = body.insertRow();
    columns.forEach((column) => cell(line, column.text(row)));
    if (row.captor < 0 && !facts.dependence) continue;
    const button = document.createElement("button");
    button.textContent = row.name;
    button.title = row.captor < 0 ? "show what it depends on" : "find it in the picture";
    line.cells[0].replaceChildren(button);
    line.addEventListener("click", () => (row.captor < 0 ? chooseGroupOfInputs(row.name) : find(row.name)));
  }
  const left = rows.length - MOST_ROWS;
  element("tableNote").textContent = left > 0 ? `and ${left} more, which CSV has` : "";
}

/** Returns all rows of the table as CSV, in its order, with back faces. */
function tableCsv() {
  const lines = (row) => {
    const line = (quantity, face, channel, factor) => ({
      quantity, face, values: facts.bands.map((_, b) => {
        const { value, error } = row.value(channel, b);
        return { value: factor * value, error: factor * error };
      }),
    });
    const all = [
      line("irradiance", "front", FRONT, 1), line("irradiance", "back", BACK, 1), line("absorbed", "", ABSORBED, row.area),
    ];
    return all.filter(({ values }) => !values.every(({ value }) => Number.isNaN(value)));
  };
  const rows = rowsOf(tables.of);
  const columns = columnsOf(rows);
  const key = columns[Math.min(tables.column, columns.length - 1)].sort;
  rows.sort((a, b) => {
    const [x, y] = [key(a), key(b)];
    const order = typeof x === "string" ? x.localeCompare(y, "en", { numeric: true }) : (x || 0) - (y || 0);
    return tables.down ? -order : order;
  });
  return csvOf(rows.map((row) => ({ name: row.name, lines: lines(row) })));
}
