// The light of a year: which hour, day or month is shown, how it plays, and the course of a captor.

const STEPS = { all: "the whole period", hours: "an hour", days: "a day (integral)", months: "a month (mean day)" };
/** The steps that this page has. */
const steps = ["all", ...["hours", "days", "months"].filter((step) => facts.year?.[step])];
/** The time that each step shows when it is chosen: at first the brightest. */
const lastTimes = {};

/** Chooses an hour, or a day where the page has no hours of captors, as what is shown at first. */
function chooseFirstTime() {
  for (const step of steps.slice(1)) lastTimes[step] = brightest(year[step]);
  // rather one that has all captors: hours may be those of groups alone
  const first = steps.slice(1).find((step) => !year[step].rows) ?? steps[1];
  if (first) [state.step, state.hour] = [first, lastTimes[first]];
}

/** Returns the time of a table as text, such as `2025-06-21 12:00`. */
function textOfTime({ days, clocks }, slot) {
  return `${days[Math.floor(slot / clocks.length)]} ${clocks[slot % clocks.length]}`.trim();
}

/** Returns the time that is shown, as text. */
function timeText() {
  return state.hour < 0 ? "" : textOfTime(series(), state.hour);
}

/** Chooses the time that a text names, if the page has it. */
function readTime(text) {
  if (text === "all") [state.step, state.hour] = ["all", -1];
  const [day, clock = ""] = text.split(" ");
  for (const step of steps.slice(1)) {
    const [d, c] = [year[step].days.indexOf(day), year[step].clocks.indexOf(clock)];
    if (d >= 0 && c >= 0) [state.step, state.hour] = [step, d * year[step].clocks.length + c];
  }
}

/** Makes what chooses the time and plays it. */
function makeTime() {
  element("timeSection").hidden = !facts.year;
  if (!facts.year) return;
  steps.forEach((step) => option("step", step, STEPS[step]));
  on("step", "change", (e) => {
    stopYear();
    state.step = e.target.value;
    state.hour = lastTimes[state.step] ?? -1;
    showTime(true);
  });
  const choose = (day, clock) => {
    const count = series().clocks.length;
    state.hour = (day ?? Math.floor(state.hour / count)) * count + (clock ?? state.hour % count);
    showTime(false);
  };
  on("day", "input", (e) => choose(Number(e.target.value), null));
  on("clock", "input", (e) => choose(null, Number(e.target.value)));
  on("play", "click", playYear);
  on("speed", "change", () => { if (playing) { stopYear(); playYear(); } });
  showTime();
}

/** Shows the controls for the time that is chosen; unless `fit` is undefined also its light, and if it is true on a scale
 *  that fits. */
function showTime(fit) {
  const isAll = state.hour < 0;
  if (!isAll) lastTimes[state.step] = state.hour;
  element("step").value = state.step;
  element("timeOptions").hidden = element("play").hidden = isAll;
  element("valuesLabel").hidden = !isAll || !local || !facts.captors.length;
  // in a year lamps follow the control of that year
  element("lampSection").hidden = !isAll || !facts.lamps.length;
  if (!isAll) {
    const { days, clocks } = series();
    const [day, clock] = [Math.floor(state.hour / clocks.length), state.hour % clocks.length];
    [element("day").max, element("clock").max] = [days.length - 1, clocks.length - 1];
    [element("day").value, element("clock").value] = [day, clock];
    [element("dayText").textContent, element("clockText").textContent] = [days[day], clocks[clock]];
    element("day").setAttribute("aria-valuetext", days[day]);
    element("clock").setAttribute("aria-valuetext", clocks[clock]);
    element("day").setAttribute("aria-label", state.step === "months" ? "month" : "day");
    element("dayLabel").hidden = days.length < 2;
    element("clockLabel").hidden = clocks.length < 2;
  }
  if (fit === undefined) return;
  repaint(fit);
  if (!playing) say(timeText() || "the whole period");
}

// --- playing ---

/** Milliseconds that each time is shown for at normal speed. */
const PACE = { hours: 220, days: 160, months: 900 };
let playing = null;

/** Plays the year from the time that is shown, or stops it. Hours that are dark everywhere are left out. */
function playYear() {
  if (playing) return stopYear();
  const pace = PACE[state.step] / Number(element("speed").value);
  element("play").textContent = "❚❚ Pause";
  element("play").setAttribute("aria-pressed", "true");
  const next = () => {
    const { slots } = series();
    const place = slots.findIndex((slot) => slot > state.hour);
    if (slots.length) state.hour = slots[Math.max(place, 0)];
    showTime(false);
    playing = setTimeout(() => requestAnimationFrame(() => playing && next()), pace);
  };
  playing = -1;
  next();
}

function stopYear() {
  if (!playing) return;
  clearTimeout(playing);
  playing = null;
  element("play").textContent = "▶ Play the year";
  element("play").setAttribute("aria-pressed", "false");
  say(timeText());
}

// --- the course of a captor ---

/** Returns the captor whose course is shown: the one that was listed last; -1 if there is none. */
function courseCaptor() {
  return state.listed.findLast(({ captor }) => captor >= 0)?.captor ?? -1;
}

let courseOff = false;
/** Returns the times of the course: those of the chosen day, or all days or months, each with its value and error. */
function courseOf(captor) {
  const table = series();
  const count = table.clocks.length;
  const day = Math.floor(state.hour / count);
  const slots = state.step === "hours" ? table.clocks.map((_, i) => day * count + i) : table.days.map((_, i) => i * count);
  return slots.map((slot) => ({ slot, ...lightAt(table, slot, captor, state.band) }));
}

/** Draws the course of the captor that was clicked last: the hours of its day, or the days or months of the year. */
function showCourse() {
  const captor = courseCaptor();
  const isShown = captor >= 0 && state.hour >= 0 && !courseOff;
  element("course").hidden = !isShown;
  if (!isShown) return;
  const course = courseOf(captor);
  const [name, unit] = [facts.captors[captor], unitOf(state.band).irradiance];
  element("courseName").textContent = name;
  const known = course.filter(({ value }) => !Number.isNaN(value));
  const canvas = element("courseChart");
  canvas.hidden = !known.length;
  if (!known.length) {
    element("courseText").textContent = `the year has no light of this captor in ${facts.bands[state.band].name} by ${state.step}`;
    return;
  }
  const now = course.find(({ slot }) => slot === state.hour);
  const day = state.step === "hours" ? `${timeText().split(" ")[0]}, ` : "";
  const top = known.reduce((best, at) => (at.value > best.value ? at : best));
  element("courseText").textContent =
    `${day}${facts.bands[state.band].name}, ${unit}: ${now ? withError(now) : "–"} now, at most ${short(top.value)} (${textOfTime(series(), top.slot).split(" ").at(-1)})`;
  drawCourse(canvas, course);
}

function drawCourse(canvas, course) {
  const ratio = window.devicePixelRatio;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name);
  pen.font = "11px system-ui, sans-serif";
  const most = Math.max(...course.map(({ value, error }) => (value || 0) + (error || 0)), 1e-30);
  const tick = tickStep(most);
  const high = Math.max(Math.ceil(most / tick - 1e-9) * tick, most);
  const [left, right, top, bottom] = [6 + pen.measureText(tickText(high)).width, width - 8, 8, height - 18];
  const x = (i) => left + ((i + 0.5) * (right - left)) / course.length;
  const y = (value) => bottom - (value / high) * (bottom - top);
  pen.textBaseline = "middle";
  pen.textAlign = "right";
  for (let value = 0; value <= high * 1.001; value += tick) {
    pen.fillStyle = colour("--pale");
    pen.fillText(tickText(value), left - 4, y(value));
    pen.fillStyle = colour("--line");
    pen.fillRect(left, y(value), right - left, 1);
  }
  pen.textAlign = "center";
  pen.textBaseline = "bottom";
  pen.fillStyle = colour("--pale");
  const labels = course.map(({ slot }) => textOfTime(series(), slot).split(" ").at(-1));
  const widest = Math.max(...labels.map((label) => pen.measureText(label).width));
  const apart = Math.ceil((course.length * (widest + 16)) / Math.max(right - left, 1));
  labels.forEach((label, i) => {
    const half = pen.measureText(label).width / 2;
    if (i % apart === 0 && x(i) + half < width) pen.fillText(label, Math.max(x(i), half), height - 2);
  });
  // errors as a band, values as a line with a point each where there is room
  const lit = course.map((at, i) => ({ ...at, i })).filter(({ value }) => !Number.isNaN(value));
  pen.fillStyle = colour("--accent");
  pen.globalAlpha = 0.22;
  pen.beginPath();
  lit.forEach(({ value, error, i }) => pen.lineTo(x(i), y(value + (error || 0))));
  [...lit].reverse().forEach(({ value, error, i }) => pen.lineTo(x(i), y(Math.max(value - (error || 0), 0))));
  pen.fill();
  pen.globalAlpha = 1;
  pen.strokeStyle = colour("--accent");
  pen.lineWidth = 2;
  pen.lineJoin = "round";
  pen.beginPath();
  lit.forEach(({ value, i }) => pen.lineTo(x(i), y(value)));
  pen.stroke();
  if (course.length <= 40) {
    lit.forEach(({ value, i }) => { pen.beginPath(); pen.arc(x(i), y(value), 2.5, 0, 7); pen.fill(); });
  }
  const now = lit.find(({ slot }) => slot === state.hour);
  if (!now) return;
  pen.fillStyle = colour("--focus");
  pen.fillRect(x(now.i) - 0.75, top, 1.5, bottom - top);
  pen.beginPath();
  pen.arc(x(now.i), y(now.value), 4.5, 0, 7);
  pen.fill();
  canvas.dataset.left = left;
  canvas.dataset.right = right;
}

/** Lets the mouse or a finger choose a time on the course. */
function watchCourse() {
  const canvas = element("courseChart");
  const choose = (e) => {
    const { left, right } = canvas.dataset;
    const captor = courseCaptor();
    if (captor < 0 || state.hour < 0) return;
    const course = courseOf(captor);
    const share = (e.clientX - canvas.getBoundingClientRect().left - left) / (right - left);
    state.hour = course[Math.min(Math.max(Math.floor(share * course.length), 0), course.length - 1)].slot;
    showTime(false);
  };
  on("courseChart", "pointerdown", (e) => { stopYear(); choose(e); });
  on("courseChart", "pointermove", (e) => { if (e.buttons) choose(e); });
  on("closeCourse", "click", () => { courseOff = true; showCourse(); });
}
