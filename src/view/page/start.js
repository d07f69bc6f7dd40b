// ---- Start ----

connectLook();
connectLights();
connectControls();
connectPointer();
connectExplanation();
connectPhotons();
connectBoxes();
connectSteps();
connectZoom();
connectCompare();
connectForms();
connectTime();
document.addEventListener("keydown", pressKey);
new ResizeObserver(() => {
  chooseScaling();
  showMagnification();
  askForNumbers();
  drawOverlay();
  if (state) drawLandings();
}).observe(byId("frame"));
new ResizeObserver(showZoom).observe(byId("stage"));
point(null);
listen();
