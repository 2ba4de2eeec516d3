// The mouse, fingers and keys.

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
  // whoever turns the picture needs the line no more that says how
  canvas.addEventListener("pointerdown", () => (element("help").open = false));
  canvas.addEventListener("pointerdown", (e) => (pressed = { x: e.clientX, y: e.clientY, tip: element("tip").style.display !== "none" }));
  canvas.addEventListener("pointerup", (e) => {
    // a click, not the end of a drag
    if (e.button !== 0 || !pressed || Math.hypot(e.clientX - pressed.x, e.clientY - pressed.y) > 4) return;
    const tile = tileAt(e.clientX, e.clientY);
    // a finger does not hover: it shows the numbers first, and lists what it taps again
    if (e.pointerType === "touch" && (tile < 0 || !isTipped(tile))) showTip(tile, e.clientX, e.clientY);
    else if (tile >= 0 && tile < facts.tiles) list(tile);
  });
}

/** Returns whether the tip shows the numbers of this tile's captor or of its part. */
function isTipped(tile) {
  return element("tip").style.display === "block" && nameOf(partOf(tile)) === element("tip").firstChild?.textContent;
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

/** Lists what is in the middle of the picture. */
function listMiddle() {
  const box = renderer.domElement.getBoundingClientRect();
  const tile = tileAt(box.left + box.width / 2, box.top + box.height / 2);
  if (tile >= 0) list(tile);
  else say("nothing is in the middle of the picture");
}

/** Closes what was opened last, from the front to the back; returns whether there was anything. */
function closeFront() {
  const tip = element("tip").style.display === "block";
  const open = [
    [tip, () => showTip(-1)],
    [Boolean(tables.of), () => openTable("")],
    [document.body.classList.contains("open"), () => { showMenu(false); element("menu").focus(); }],
    [Boolean(playing), stopYear],
    [Boolean(flying), stopPhotons],
    [!element("course").hidden, () => { courseOff = true; showCourse(); }],
    [!element("inputs").hidden, () => { shownInputs.off = true; showInputs(); }],
    [!element("ways").hidden, () => { shownWays.off = true; showWays(); draw(); }],
    [state.listed.length > 0, clearListed],
    [state.found >= 0, () => { element("find").value = ""; find(""); }],
  ];
  const front = open.find(([isOpen]) => isOpen);
  front?.[1]();
  return Boolean(front);
}

/** Plays the year or, where there is none, lets the photons fly. */
function play() {
  if (flying) stopPhotons();
  else if (state.hour >= 0) playYear();
  else if (photons) flyPhotons();
}

function watchKeys() {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const keys = {
    "+": () => zoom(0.9), "=": () => zoom(0.9), "-": () => zoom(1 / 0.9), Home: () => resetView(false), a: () => resetView(true),
    f: openFind, p: savePicture, t: () => element("tableButtons").firstElementChild?.click(), " ": play, Enter: listMiddle,
    "?": () => (element("help").open = !element("help").open),
  };
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    if (e.key === "Escape") {
      if (closeFront()) e.preventDefault();
      return;
    }
    if (e.target.matches("input, select, textarea, summary, button, [tabindex]:not(canvas)")) return;
    const arrow = arrows[e.key];
    if (arrow) (e.shiftKey ? move(0.05 * arrow[0], 0.05 * arrow[1]) : turn(5 * arrow[0], 5 * arrow[1]));
    else if (keys[e.key]) keys[e.key]();
    else return;
    e.preventDefault();
  });
}

/** Goes to the field that finds captors, which may be folded away. */
function openFind() {
  if (getComputedStyle(element("menu")).display !== "none") showMenu(true);
  element("tableSection").open = true;
  element("find").focus();
}
