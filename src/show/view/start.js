// The start.

try {
  makeRenderer();
  resize();
  lookAtAll();
  // glass is in the way
  facts.materials.forEach((material, key) => material.clear && state.hidden.material.add(key));
  const ranged = readLink();
  findDarkSides();
  makeMesh();
  makeLights();
  if (photons) makePhotons();
  makePanel();
  showTheme();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", showTheme);
  repaint(!ranged);
  watchMouse();
  watchKeys();
  new ResizeObserver(resize).observe(stage);
  document.documentElement.dataset.ready = "yes";
} catch (error) {
  element("message").textContent = `This page needs WebGL 2, which this browser does not give: ${error.message}`;
  console.error(error);
}
