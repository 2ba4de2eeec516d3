// The colour bar: on the page, and in pictures of it.

/** Width of a pointed end of the bar, as a share of its height. */
const POINT = 0.7;

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

/** Returns where a value lies on the scale, 0 to 1 between its ends. */
function shareOnScale(value) {
  const { low, high } = state;
  return state.log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
}

/** Returns the text at a tick. */
function tickText(value) {
  return String(Number(value.toPrecision(6)));
}

/** Returns a colour of the scale, from 0 to 255, as CSS text. */
function colourText(i) {
  return `rgb(${colours.subarray(3 * i, 3 * i + 3).join()})`;
}

/** Returns whether values that are shown lie below and above the scale. */
function beyondScale() {
  const { low, high } = state;
  return [shownRange.least < low - 1e-6 * Math.abs(low), shownRange.most > high * (1 + 1e-6)];
}

/** Draws the bar in a rectangle, of which the ends are left free for points. An end beyond which there are values is pointed. */
function drawBar(pen, left, top, width, height, edge) {
  const point = POINT * height;
  const [from, to] = [left + point, left + width - point];
  const [below, above] = beyondScale();
  const outline = new Path2D();
  outline.moveTo(from, top);
  outline.lineTo(to, top);
  if (above) outline.lineTo(to + point, top + height / 2);
  outline.lineTo(to, top + height);
  outline.lineTo(from, top + height);
  if (below) outline.lineTo(from - point, top + height / 2);
  outline.closePath();
  pen.save();
  pen.clip(outline);
  pen.fillStyle = colourText(0);
  pen.fillRect(left, top, width, height);
  for (let i = 0; i < 256; i++) {
    pen.fillStyle = colourText(i);
    pen.fillRect(from + ((to - from) * i) / 256, top, left + width, height);
  }
  pen.restore();
  pen.strokeStyle = edge;
  pen.lineWidth = Math.max(height / 18, 1);
  pen.stroke(outline);
}

function showScale() {
  const canvas = element("bar");
  const ratio = window.devicePixelRatio;
  const [width, height] = [canvas.clientWidth || 244, canvas.clientHeight || 18];
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  drawBar(pen, 1, 1, width - 2, height - 2, isDark() ? "#8a929c" : "#6b727b");
  const ticks = element("ticks");
  ticks.style.margin = `0 ${1 + POINT * (height - 2)}px`;
  ticks.replaceChildren(...tickValues().map((value) => {
    const tick = document.createElement("span");
    tick.style.left = `${100 * shareOnScale(value)}%`;
    tick.textContent = tickText(value);
    return tick;
  }));
  const [text, time] = [scaleText(), document.createElement("span")];
  // no line ends within the time
  time.textContent = text.endsWith(timeText()) ? timeText() : "";
  element("unit").replaceChildren(text.slice(0, text.length - time.textContent.length), time);
  for (const id of ["bar", "ticks", "unit"]) element(id).hidden = state.quantity === "none";
  element("low").value = state.low;
  element("high").value = state.high;
}

/** Returns what the bar is of: quantity, band, unit and time. */
function scaleText() {
  if (state.quantity === "none") return "";
  const { name, light } = facts.bands[state.band];
  if (isDaily() && series().bands[state.band] < 0) return `${name} has no daily light integral`;
  const names = { irradiance: isDaily() ? `daily light integral, ${name}` : light, absorbed: `absorbed per area, ${name}` };
  return [names[state.quantity], unitOf(state.band).irradiance, timeText()].filter((text) => text).join(", ");
}

/** Returns the picture as a canvas: what is seen, its title above it, and its colour bar below it on the page's ground. */
function picture() {
  render();
  const from = renderer.domElement;
  const canvas = document.createElement("canvas");
  const em = Math.max(Math.min(from.width / 60, 22 * window.devicePixelRatio), 10 * window.devicePixelRatio);
  const [above, below] = [2.4 * em, state.quantity === "none" && !state.photons ? 0 : 4.6 * em];
  [canvas.width, canvas.height] = [from.width, Math.round(above + from.height + below)];
  const pen = canvas.getContext("2d");
  const [ground, ink] = isDark() ? ["#16181c", "#f2f3f5"] : ["#ffffff", "#1c2024"];
  pen.fillStyle = ground;
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(from, 0, Math.round(above));
  pen.fillStyle = ink;
  pen.font = `600 ${1.2 * em}px system-ui, sans-serif`;
  pen.fillText(facts.scene, em, 1.6 * em, canvas.width - 2 * em);
  pen.font = `${em}px system-ui, sans-serif`;
  const top = above + from.height;
  if (state.quantity === "none") {
    if (state.photons) drawLegend(pen, em, top + 0.8 * em, canvas.width - 2 * em, em, ink);
    return canvas;
  }
  const width = Math.min(30 * em, canvas.width - 2 * em);
  const left = (canvas.width - width) / 2;
  pen.textAlign = "center";
  pen.fillText(scaleText(), left + width / 2, top + 1.2 * em, canvas.width - 2 * em);
  drawBar(pen, left, top + 1.7 * em, width, 1.1 * em, ink);
  const point = POINT * 1.1 * em;
  pen.fillStyle = ink;
  for (const value of tickValues()) {
    const x = left + point + shareOnScale(value) * (width - 2 * point);
    pen.fillRect(x - em / 24, top + 2.8 * em, em / 12, 0.3 * em);
    pen.fillText(tickText(value), x, top + 4.1 * em);
  }
  return canvas;
}

/** Saves the picture as a file. */
function savePicture() {
  picture().toBlob((blob) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${facts.scene.replace(/[^\p{L}\p{N}._-]+/gu, "-") || "scene"}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    say("picture saved");
  });
}
