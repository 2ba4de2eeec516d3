// Starts the page.

async function start() {
  makeRenderer();
  resize();
  // glass would hide what is behind it
  facts.materials.forEach((material, key) => material.clear && state.hidden.material.add(key));
  findDarkSides();
  chooseFirstTime();
  findLargePlanes();
  await reached(0.82, "arranging the surfaces");
  makeSmooth();
  makeMeshes();
  makeOutlines();
  await reached(0.9, "colouring the surfaces");
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
  showLoading(1, "");
  element("message").hidden = true;
  document.documentElement.dataset.ready = "yes";
}

clearTimeout(loading.timer);
readData().then(start).catch((error) => {
  element("progress").hidden = true;
  element("message").hidden = false;
  element("progressText").textContent = `This page needs a browser of 2023 or later with WebGL 2: ${error.message}`;
  console.error(error);
});
