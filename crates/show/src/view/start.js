// Starts the page.

function start() {
  makeRenderer();
  resize();
  // glass would hide what is behind it
  facts.materials.forEach((material, key) => material.clear && state.hidden.material.add(key));
  findDarkSides();
  if (hours) state.hour = brightestHour();
  findLargePlanes();
  makeSmooth();
  makeMeshes();
  makeOutlines();
  paintTiles();
  lookAtCaptors();
  const ranged = readLink();
  makeLights();
  if (photons) makePhotons();
  makePanel();
  showTheme();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", showTheme);
  markFound();
  repaint(!ranged);
  watchMouse();
  watchKeys();
  new ResizeObserver(resize).observe(stage);
  document.documentElement.dataset.ready = "yes";
}

element("message").textContent = "reading the light …";
readData().then(start).then(() => (element("message").textContent = ""), (error) => {
  element("message").textContent = `This page needs a browser of 2023 or later with WebGL 2: ${error.message}`;
  console.error(error);
});
