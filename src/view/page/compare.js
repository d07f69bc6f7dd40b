
// ---- Another image beside the image, and files of both ----

/** Images to compare with, as pixels: what was kept, a file, the image before the last change. */
const others = { kept: null, file: null, previous: null };

let full = null; // {generation, pixels}: the last image of full size
let split = 0.5; // the place of the slider, as a fraction of the image's width
let denoisedAt = 0; // the time of the last request for a denoised image to compare with

/** Remembers what the image was before it changed. */
function noticeFullImage(pixels) {
  if (view.layer !== "light" || pixels.width !== state.size[0]) return;
  if (full && full.generation !== state.generation) others.previous = full.pixels;
  full = { generation: state.generation, pixels };
  if (byId("compare").value === "previous") showOther();
}

const askForOther = newestOnly(async () => {
  const which = byId("compare").value;
  if (which === "file" && others.file?.isLinear) {
    const { exposure, tonemap } = lookWanted();
    return drawOther(await fetchImage({ exposure, tonemap }, undefined, "/reference"));
  }
  if (which !== "denoised") return drawOther(others[which] ?? null);
  denoisedAt = performance.now();
  byId("compare-state").textContent = "Removing the noise …";
  let isDenoised = false;
  const see = (headers) => (isDenoised = headers.get("X-Denoised") === "true");
  const pixels = await fetchImage({ ...lookWanted(), layer: "denoised" }, see);
  if (byId("compare").value !== "denoised") return;
  if (pixels) drawOther(pixels);
  byId("compare-state").textContent = isDenoised ? "Right of the line: without noise." : "With noise until all pixels have samples.";
});

function showOther() {
  const which = byId("compare").value;
  const text = {
    off: "",
    previous: others.previous ? "Right of the line: before the last change." : "Nothing has changed yet.",
    kept: others.kept ? "Right of the line: what was kept." : "Nothing is kept yet: press Keep.",
    file: others.file ? `Right of the line: ${others.file.name}.` : "No file is chosen.",
  }[which];
  byId("compare-state").textContent = text ?? "";
  if (which === "off") drawOther(null);
  else askForOther();
}

/** Denoising takes its time, so not every image is denoised. */
function refreshOther() {
  if (byId("compare").value === "file" && others.file?.isLinear) askForOther();
  if (byId("compare").value === "denoised" && (state.is_done || performance.now() - denoisedAt > 3000)) askForOther();
}

function drawOther(other) {
  const canvas = byId("other");
  canvas.hidden = byId("divider").hidden = other === null;
  if (!other) return;
  const { pixels = other } = other;
  Object.assign(canvas, { width: pixels.width, height: pixels.height });
  const context = canvas.getContext("2d");
  if (pixels instanceof ImageData) context.putImageData(pixels, 0, 0);
  else context.drawImage(pixels, 0, 0);
  chooseScaling();
  setSplit(split);
}

function setSplit(to) {
  split = Math.max(0, Math.min(1, to));
  byId("frame").style.setProperty("--split", `${100 * split}%`);
  byId("divider").setAttribute("aria-valuenow", Math.round(100 * split));
}

function keepImage() {
  const canvas = byId("image");
  others.kept = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  byId("compare").value = "kept";
  showOther();
}

async function readFile(file) {
  if (!file) return;
  const { name } = file;
  try {
    // Files with radiance are exposed like the image.
    const isLinear = /\.(exr|hdr)$/i.test(name);
    if (isLinear) await request("/reference", { name }, { method: "POST", body: file });
    others.file = isLinear ? { name, isLinear } : { name, pixels: await createImageBitmap(file) };
  } catch (error) {
    return tell(error instanceof DOMException ? `${name} is no picture that the browser can read.` : error.message, true);
  }
  byId("compare").value = "file";
  showOther();
}

function chooseComparison() {
  if (byId("compare").value === "file") byId("compare-file").click();
  showOther();
}

/** Hands bytes to the browser's downloads. */
function download(blob, name) {
  const link = element("a");
  Object.assign(link, { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

const fileStem = () => state.name.replace(/\.[^.]*$/, "");

/** The PNG has the bytes of the canvas, which are those that are shown. */
function savePng() {
  byId("image").toBlob((blob) => download(blob, `${fileStem()}${view.layer === "light" ? "" : `-${view.layer}`}.png`), "image/png");
}

async function saveExr() {
  try {
    const { layer, mix } = lookWanted();
    const parts = { layer: layer === "denoised" ? layer : "light", ...(mix && { mix }) };
    download(await (await request("/image.exr", parts)).blob(), `${fileStem()}.exr`);
  } catch (error) {
    fail(error);
  }
}

async function copyRender() {
  try {
    const look = lookWanted();
    const { command } = await (await request("/command", look)).json();
    copy(command, look.mix ? "the commands that render the finished image and mix its lights" : "the command that renders the finished image");
  } catch (error) {
    fail(error);
  }
}

function connectCompare() {
  on("compare", "change", chooseComparison);
  on("keep", "click", keepImage);
  on("compare-file", "change", (event) => readFile(event.target.files[0]));
  on("save-png", "click", savePng);
  on("save-exr", "click", saveExr);
  on("copy-render", "click", copyRender);
  const divider = byId("divider");
  divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
  divider.addEventListener("pointermove", (event) => {
    const area = byId("image").getBoundingClientRect();
    if (event.buttons) setSplit((event.clientX - area.left) / area.width);
  });
  divider.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (!by) return;
    event.stopPropagation();
    event.preventDefault();
    setSplit(split + by);
  });
}
