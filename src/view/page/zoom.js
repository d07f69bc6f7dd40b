
// ---- Magnifying the image, as tev does ----

const PIXEL_PX = 128; // the largest size of a pixel on the page
const NUMBERS_PX = 72; // from this size on, pixels show their numbers

/** The magnification, and the distance of the image's centre from that of the stage in CSS pixels. */
const zoom = { factor: 1, x: 0, y: 0 };

/** Magnifies the image by a factor; the point of it at `[x, y]` in the window stays where it is. */
function magnify(by, [x, y]) {
  const stage = byId("stage").getBoundingClientRect();
  const before = zoom.factor;
  zoom.factor = Math.max(1, Math.min(before * by, mostZoom()));
  const growth = zoom.factor / before - 1;
  zoom.x -= (x - stage.left - stage.width / 2 - zoom.x) * growth;
  zoom.y -= (y - stage.top - stage.height / 2 - zoom.y) * growth;
  showZoom();
}

function mostZoom() {
  const fitted = byId("image").clientWidth / zoom.factor;
  return state ? Math.max(1, (PIXEL_PX * state.size[0]) / fitted) : 1;
}

/** Magnifies about the pointer if it is over the image, or else about the centre. */
function magnifyByKey(by) {
  const area = byId("image").getBoundingClientRect();
  const stage = byId("stage").getBoundingClientRect();
  const centre = [stage.left + stage.width / 2, stage.top + stage.height / 2];
  const at = pointed && pointed.map((value, axis) => (value + 0.5) / state.size[axis]);
  magnify(by, at ? [area.left + at[0] * area.width, area.top + at[1] * area.height] : centre);
}

function slide(x, y) {
  zoom.x += x;
  zoom.y += y;
  showZoom();
}

function fitImage() {
  Object.assign(zoom, { factor: 1, x: 0, y: 0 });
  showZoom();
}

/** Moves and sizes the image; it covers the stage as far as it can. */
function showZoom() {
  const { clientWidth, clientHeight } = byId("stage");
  const style = byId("frame").style;
  style.setProperty("--zoom", zoom.factor);
  const image = byId("image");
  for (const [axis, room, side] of [["x", clientWidth, image.clientWidth], ["y", clientHeight, image.clientHeight]]) {
    const most = Math.max(0, (side - room) / 2 + (zoom.factor > 1 ? 16 : 0));
    zoom[axis] = Math.max(-most, Math.min(zoom[axis], most));
    style.setProperty(`--${axis}`, `${zoom[axis]}px`);
  }
  byId("frame").classList.toggle("is-zoomed", zoom.factor > 1);
  showMagnification();
  askForNumbers();
}

/** Shows the size of an image's pixel on the screen. */
function showMagnification() {
  if (!state) return;
  const scale = (byId("image").clientWidth * devicePixelRatio) / state.size[0];
  byId("fit").textContent = `${Math.round(100 * scale)} %`;
  byId("fit").disabled = zoom.factor === 1;
}

// The numbers of pixels, written over them.

const askForNumbers = newestOnly(async () => {
  const region = visiblePixels();
  if (!region) return byId("numbers").replaceChildren();
  const [x0, y0, x1, y1] = region;
  const response = await request("/values", { layer: view.layer, x0, y0, x1, y1 });
  drawNumbers(response.status === 204 ? null : await response.json());
});

/** The pixels in the stage; null if they are too small for numbers. */
function visiblePixels() {
  const canvas = byId("image");
  const side = canvas.clientWidth / canvas.width;
  if (!state || side < NUMBERS_PX) return null;
  const [area, stage] = [canvas, byId("stage")].map((box) => box.getBoundingClientRect());
  const within = (value, most) => Math.max(0, Math.min(value, most));
  return [
    within(Math.floor((stage.left - area.left) / side), canvas.width),
    within(Math.floor((stage.top - area.top) / side), canvas.height),
    within(Math.ceil((stage.right - area.left) / side), canvas.width),
    within(Math.ceil((stage.bottom - area.top) / side), canvas.height),
  ];
}

function drawNumbers(found) {
  const layer = byId("numbers");
  layer.replaceChildren();
  if (!found) return;
  const [x0, y0, x1] = found.region;
  const side = byId("image").clientWidth / found.size[0];
  found.values.forEach((values, index) => {
    const [x, y] = [x0 + (index % (x1 - x0)) + 0.5, y0 + Math.floor(index / (x1 - x0)) + 0.5];
    values.forEach((value, row) => {
      const place = { x: x * side, y: y * side + 14 * (row - (values.length - 1) / 2) };
      const text = shape("text", values.length === 3 ? `channel-${row}` : "", place);
      text.textContent = value === null ? "∞" : rounded(value, 5);
      layer.append(text);
    });
  });
}

function connectZoom() {
  on("fit", "click", fitImage);
}
