// The page of `rayfront view`. It displays the server's state and sends requests; all state of the
// rendering lives in the server. Names in scenes may contain anything: insert them as text only.

const TOKEN = new URLSearchParams(location.search).get("token") ?? "";
const CLICK_PX = 4; // a press and release with less movement is a click
const REST_MS = 80; // the pointer must rest this long before its pixel is requested
const HOLD_MS = 700; // a control keeps its value this long, until the server responds
const MOST_SIDE = 4096; // the longest side of the canvas for photons, in pixels
const BRANCHES = 6; // the number of colours for forked paths; see page.css

/** The latest STATE of the server. */
let state = null;

/** The display options, which belong to the page only and need no new rendering. */
const view = { layer: "light", exposure: 0, isAuto: false, tonemap: "Clamp" };

// ---- Small helpers ----

const byId = (id) => document.getElementById(id);
const on = (id, event, action) => byId(id).addEventListener(event, action);

/** An HTML element with children; strings among them become text. */
function element(tag, className = "", ...children) {
  const made = document.createElement(tag);
  made.className = className;
  made.append(...children);
  return made;
}

/** An SVG element with attributes. */
function shape(tag, className, attributes = {}) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  made.setAttribute("class", className);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

/** Formats a number with four significant digits. */
function digits(value) {
  if (!Number.isFinite(value)) return "–";
  return value === 0 ? "0" : value.toPrecision(4);
}

const triple = (values) => values.map(digits).join("  ");
const percent = (share) => `${(100 * share).toFixed(1)} %`;
const count = (value) => Math.round(value).toLocaleString("en");
const isBlack = (values) => values.every((value) => value === 0);

/** Formats a number for little space: 4.1k, 12M. */
function shortCount(value) {
  return new Intl.NumberFormat("en", { notation: "compact", maximumSignificantDigits: 3 }).format(value);
}

/** Formats a power, such as 44.4 µW. */
function watts(value) {
  const units = ["W", "mW", "µW", "nW", "pW"];
  const unit = value > 0 ? Math.max(0, Math.min(units.length - 1, Math.ceil(-Math.log10(value) / 3))) : 0;
  return `${(value * 1000 ** unit).toPrecision(3)} ${units[unit]}`;
}

function duration(seconds) {
  const whole = Math.ceil(seconds);
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  return `${Math.floor(whole / 3600)} h ${Math.floor((whole % 3600) / 60)} min`;
}

let messageTimer = 0;

/** Shows a message for a while. */
function tell(sentence, isBad = false) {
  const message = byId("message");
  message.textContent = sentence;
  message.classList.toggle("is-bad", isBad);
  message.hidden = false;
  clearTimeout(messageTimer);
  messageTimer = setTimeout(() => (message.hidden = true), isBad ? 10_000 : 5_000);
}

async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    tell(`Copied ${what}.`);
  } catch {
    tell(`The browser does not let the page copy. Here it is: ${text}`, true);
  }
}

// ---- Requests to the server ----

/** The server does not respond, which the connection box already reports. */
class Unreachable extends Error {}

function address(path, parameters = {}) {
  return `${path}?${new URLSearchParams({ token: TOKEN, ...parameters })}`;
}

async function request(path, parameters, options) {
  const response = await fetch(address(path, parameters), options).catch(() => {
    throw new Unreachable();
  });
  if (response.ok) return response;
  if (response.status === 403) {
    noticeOtherRun();
    throw new Unreachable();
  }
  const { error } = await response.json().catch(() => ({}));
  throw new Error(error ?? `rayfront answers with status ${response.status}.`);
}

function fail(error) {
  if (error instanceof Unreachable) return;
  tell(error.message, true);
  console.warn(error);
}

/**
 * Runs `work` at most once at a time. Of the calls made meanwhile only the last one counts, so that
 * a slow server gets no outdated requests.
 */
function newestOnly(work) {
  let isBusy = false;
  let next = null;
  return async function ask(argument) {
    next = { argument };
    if (isBusy) return;
    isBusy = true;
    while (next !== null) {
      const { argument } = next;
      next = null;
      await work(argument).catch(fail);
    }
    isBusy = false;
  };
}

const commands = []; // queued behind the one being sent
let isSending = false;

/** Sends a COMMAND after all earlier ones, one at a time. */
async function send(command) {
  const both = commands.length > 0 ? merged(commands.at(-1), command) : null;
  if (both) commands[commands.length - 1] = both;
  else commands.push(command);
  if (isSending) return;
  isSending = true;
  while (commands.length > 0) await sendOne(commands.shift());
  isSending = false;
}

async function sendOne(command) {
  try {
    const options = { method: "POST", body: JSON.stringify(command), headers: { "Content-Type": "application/json" } };
    const answer = await (await request("/do", {}, options)).json();
    if (answer.said && !isMovement(command)) tell(answer.said);
  } catch (error) {
    fail(error);
  }
}

/** True for movements, whose messages are not shown: there are many per second. */
const isMovement = (command) => ["orbit", "pan", "zoom", "set", "time_s"].some((kind) => kind in command);

/** Merges two commands of the same kind; null if they differ. So a long drag does not flood the server. */
function merged(earlier, later) {
  const [kind] = Object.keys(earlier);
  if (!(kind in later)) return null;
  const [a, b] = [earlier[kind], later[kind]];
  if (kind === "orbit" || kind === "pan") return { [kind]: [a[0] + b[0], a[1] + b[1]] };
  if (kind === "zoom") return { zoom: a * b };
  if (kind === "set" && a.split(" = ")[0] !== b.split(" = ")[0]) return null;
  if (kind === "settings") return { settings: { ...a, ...b } };
  return later;
}

/** Listens to the server's events, and reconnects if the browser gives up. */
function listen() {
  const events = new EventSource(address("/events"));
  events.onopen = () => {
    byId("connection").hidden = true;
    shown.serial = -1; // requests for images may have failed meanwhile
  };
  events.onmessage = (event) => takeState(JSON.parse(event.data));
  events.onerror = () => {
    byId("connection").hidden = false;
    if (events.readyState === EventSource.CLOSED) reconnect();
  };
}

async function reconnect() {
  // A request that is refused shows that this page is of an earlier run: then there is no point in another attempt.
  await request("/status").catch(() => {});
  if (!isOfEarlierRun) setTimeout(listen, 2_000);
}

let isOfEarlierRun = false;

/** Tells that the program was started again: each run has its own token. */
function noticeOtherRun() {
  isOfEarlierRun = true;
  byId("connection").textContent =
    "rayfront was started again, and this page shows what an earlier run rendered. Open the address that the program has printed.";
  byId("connection").hidden = false;
}

function takeState(next) {
  const previous = state;
  state = next;
  adoptLook(previous);
  showName();
  showStatus(previous);
  showError();
  showFindings(previous);
  showControls();
  showLights();
  showQueues();
  showPhotons();
  showEdits();
  showTime();
  showMagnification();
  noticeNewPicture();
  if (state.serial !== previous?.serial) {
    askForImage();
    refreshReadout();
    followPhotons();
    followBoxes();
    followSteps();
    followOutline();
    refreshForms();
    refreshOther();
  }
}

// ---- The image ----

/** The image on the canvas. */
const shown = { serial: -1, look: "" };

/** The parameters of the image that the controls describe. */
function lookWanted() {
  const look = { layer: view.layer, exposure: view.isAuto ? "auto" : view.exposure, tonemap: view.tonemap };
  if (mix.some(({ factor, color }) => factor !== 1 || color !== WHITE)) look.mix = JSON.stringify(mix.map(lightFactor));
  return look;
}

const askForImage = newestOnly(async () => {
  if (!state) return;
  const look = lookWanted();
  const isThere = shown.serial >= state.serial && shown.look === JSON.stringify(look);
  if (isThere) return;
  const asked = state.serial;
  const isOtherLook = shown.look !== JSON.stringify(look);
  if (look.layer === "denoised") byId("layer-state").textContent = "removing the noise …";
  if (isOtherLook && WORK.includes(look.layer)) byId("layer-state").textContent = "counting …";
  const pixels = await fetchImage(look, (headers) => {
    const header = (name) => Number(headers.get(name));
    // The image may be newer than the serial in the state.
    shown.serial = Math.max(asked, header("X-Serial"));
    shown.look = JSON.stringify(look);
    if (view.isAuto) showExposure(header("X-Exposure"));
    showBar(JSON.parse(headers.get("X-Bar")));
    showLayerState(look.layer, headers);
  });
  if (pixels) draw(pixels);
  if (isOtherLook) refreshOther();
});

/** The pixels of an image; null before the first one. `see` is called with the headers. */
async function fetchImage(look, see = () => {}, path = "/image") {
  const response = await request(path, look);
  if (response.status === 204) return null;
  const [width, height] = ["X-Width", "X-Height"].map((name) => Number(response.headers.get(name)));
  const bytes = new Uint8ClampedArray(await response.arrayBuffer());
  see(response.headers);
  return new ImageData(bytes, width, height);
}

function draw(pixels) {
  const { width, height } = pixels;
  const canvas = byId("image");
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  canvas.getContext("2d").putImageData(pixels, 0, 0);
  chooseScaling();
  noticeFullImage(pixels);
  askForNumbers();
}

/** Magnified pixels stay sharp squares; an image that is scaled down must not lose rows. */
function chooseScaling() {
  for (const canvas of [byId("image"), byId("other"), byId("outline")]) {
    const factor = (canvas.clientWidth * devicePixelRatio) / canvas.width;
    canvas.classList.toggle("is-magnified", factor >= 1.5);
  }
}

/** Shows the numbers that the colours of a layer stand for. */
function showBar(bar) {
  byId("bar").hidden = bar === null;
  if (bar === null) return;
  const colors = bar.colors.map((color) => `rgb(${color.join(" ")})`);
  byId("bar-colors").style.setProperty("background", `linear-gradient(to right, ${colors.join(", ")})`);
  byId("bar-low").textContent = rounded(bar.low, 4);
  byId("bar-high").textContent = rounded(bar.high, 4);
  byId("bar-unit").textContent = bar.unit;
}

/** The layers of work, which are coarse until the image is finished. */
const WORK = ["nodes", "tests", "path-length", "time"];

function showLayerState(layer, headers) {
  const samples = Number(headers.get("X-Samples"));
  const isCoarse = Number(headers.get("X-Width")) < state.size[0];
  const isDenoised = headers.get("X-Denoised") === "true";
  byId("layer-state").textContent = WORK.includes(layer)
    ? isCoarse ? "coarse until all samples are done" : ""
    : layer !== "denoised" ? ""
    : isDenoised ? `without noise, from ${rounded(samples, 3)} samples` : "with noise until all pixels have samples";
}

// Layer, exposure, tone curve.

/** Adopts the scene's exposure and tone curve at first, and whenever an edit changes them. */
function adoptLook(previous) {
  const changed = (name) => state[name] !== previous?.[name];
  if (changed("exposure_ev") || changed("auto_exposure")) {
    view.exposure = state.exposure_ev;
    view.isAuto = state.auto_exposure;
    showExposure(view.exposure);
  }
  if (changed("tonemap")) byId("tonemap").value = view.tonemap = state.tonemap;
}

function showExposure(stops) {
  byId("auto-exposure").checked = view.isAuto;
  byId("exposure").value = stops;
  if (document.activeElement !== byId("exposure-number")) byId("exposure-number").value = Number(stops.toFixed(2));
}

/** An exposure set by hand turns off the automatic one. */
function setExposure(stops) {
  if (!Number.isFinite(stops)) return;
  view.exposure = stops;
  view.isAuto = false;
  showExposure(stops);
  askForImage();
}

/** Turning off the automatic exposure keeps its last value. */
function setAutoExposure(isAuto) {
  view.isAuto = isAuto;
  if (!isAuto) view.exposure = Number(byId("exposure-number").value);
  showExposure(view.exposure);
  askForImage();
}

function setLayer(layer) {
  byId("layer").value = view.layer = layer;
  showLookReasons();
  askForImage();
  askForNumbers();
}

/** Greys out what has no effect on the layer. */
function showLookReasons() {
  const isLight = ["light", "denoised"].includes(view.layer);
  for (const id of ["exposure", "exposure-number", "auto-exposure", "tonemap"]) {
    enable(id, isLight, `${byId("layer").selectedOptions[0].text} has no exposure and no tone curve: only Light has`, "");
  }
}

function connectLook() {
  on("layer", "change", (event) => setLayer(event.target.value));
  on("tonemap", "change", (event) => {
    view.tonemap = event.target.value;
    askForImage();
  });
  for (const id of ["exposure", "exposure-number"]) on(id, "input", (event) => setExposure(event.target.valueAsNumber));
  on("auto-exposure", "change", (event) => setAutoExposure(event.target.checked));
}

// ---- Light groups, which the page mixes without rendering ----

const WHITE = "#ffffff";
let mix = []; // for each light group {name, factor, color}

/** The factor of a group's light: linear red, green and blue. */
function lightFactor({ factor, color }) {
  const bytes = [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16) / 255);
  return bytes.map((part) => factor * (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
}

function showLights() {
  const names = state.light_groups;
  byId("lights-panel").hidden = names.length === 0;
  if (names.length === mix.length && names.every((name, index) => mix[index].name === name)) return;
  const before = new Map(mix.map((group) => [group.name, group]));
  mix = names.map((name) => before.get(name) ?? { name, factor: 1, color: WHITE });
  byId("lights").replaceChildren(...mix.flatMap(lightRow));
}

/** A label, a slider, and the same as a number beside a colour. */
function lightRow(group, index) {
  const label = element("label", "", group.name);
  label.htmlFor = `light-${index}`;
  label.title = group.name;
  const input = (id, type, value, facts) => Object.assign(element("input"), { id: `${id}-${index}`, type, value, ...facts });
  const slider = input("light", "range", group.factor, { min: 0, max: 4, step: "any" });
  const number = input("light-number", "number", group.factor, { min: 0, step: "any", ariaLabel: `${group.name}: factor` });
  const color = input("light-color", "color", group.color, { ariaLabel: `${group.name}: colour`, title: "Colour" });
  slider.addEventListener("input", () => setLight(group, { factor: rounded(slider.valueAsNumber, 3) }, number));
  number.addEventListener("input", () => setLight(group, { factor: Math.max(0, number.valueAsNumber || 0) }, slider));
  color.addEventListener("input", () => setLight(group, { color: color.value }));
  return [label, slider, element("span", "with-color", number, color)];
}

function setLight(group, change, shown = null) {
  Object.assign(group, change);
  if (shown) shown.value = group.factor;
  askForImage();
}

function resetLights() {
  for (const group of mix) Object.assign(group, { factor: 1, color: WHITE });
  byId("lights").replaceChildren(...mix.flatMap(lightRow));
  askForImage();
}

function connectLights() {
  on("reset-lights", "click", resetLights);
  on("copy-mix", "click", copyRender);
}

// ---- The server's state: name, status, error, findings ----

function showName() {
  byId("name").textContent = byId("name").title = state.name;
  document.title = `${state.samples}/${state.wanted} ${state.name} – rayfront`;
  document.documentElement.style.setProperty("--aspect", state.size[0] / state.size[1]);
}

function showStatus(previous) {
  const { samples, wanted, noise, rays, seconds, size } = state;
  const speed = state.rays_per_second || (seconds > 0 ? rays / seconds : 0); // the current speed, or the average when idle
  byId("progress").value = wanted > 0 ? samples / wanted : 0;
  byId("samples").textContent = `${count(samples)} of ${count(wanted)} samples`;
  byId("noise").textContent = noise === null ? "" : `${(100 * noise).toPrecision(3)} % noise`;
  byId("rays").textContent = speed > 0 ? `${(speed / 1e6).toPrecision(3)} M rays/s` : "";
  byId("rays").title = `${count(rays)} rays in ${seconds.toFixed(1)} s`;
  byId("time-left").textContent = timeLeft();
  const preview = state.shown[0] < size[0] ? `, now ${state.shown.join(" × ")}` : "";
  byId("size").textContent = `${size.join(" × ")}${preview}`;
  byId("pause").textContent = state.is_paused ? "Go on" : "Pause";
  enable("pause", !state.is_done, "All samples are done", "Pause or go on (Space)");
  announce(previous);
}

function timeLeft() {
  if (state.is_done) return "done";
  if (state.is_paused) return "paused";
  return state.seconds_left === null ? "" : `${duration(state.seconds_left)} left`;
}

/** For screen readers: the status changes ten times a second, so only quarters are announced. */
function announce(previous) {
  const quarter = (of) => (of ? Math.floor((4 * of.samples) / of.wanted) : 0);
  if (quarter(state) === quarter(previous) || quarter(state) === 0) return;
  byId("announcement").textContent = state.is_done ? "The image is done." : `${25 * quarter(state)} % of the samples are done.`;
}

function showError() {
  byId("error").hidden = !state.error;
  byId("error-text").textContent = state.error ?? "";
}

function showFindings(previous) {
  const { findings } = state;
  // Rebuilding the list would take the focus away from its buttons.
  if (previous && JSON.stringify(findings) === JSON.stringify(previous.findings)) return;
  byId("findings-panel").hidden = findings.length === 0;
  byId("findings-count").textContent = findings.length;
  byId("findings").replaceChildren(...findings.map(finding));
}

function finding({ about, what, remedy }) {
  const item = element("li", "", element("p", "", about === null ? what : `${about}: ${what}`));
  if (remedy !== null) item.append(copyable(remedy, "the remedy"));
  return item;
}

function copyable(text, what) {
  const button = element("button", "", "Copy");
  button.addEventListener("click", () => copy(text, what));
  return element("div", "copyable", element("code", "", text), button);
}

// ---- Controls that show the server's settings ----

/** The controls in use, and the timers that release them. */
const held = new Map();

/** Protects a control from updates by the server while the user types or drags. */
function hold(control) {
  clearTimeout(held.get(control));
  held.set(control, 0);
}

function letGo(control) {
  if (!held.has(control)) return;
  clearTimeout(held.get(control));
  const end = () => {
    held.delete(control);
    if (state) showControls();
  };
  held.set(control, setTimeout(end, HOLD_MS));
}

function show(id, value) {
  const control = byId(id);
  if (!held.has(control) && control.value !== String(value)) control.value = value;
}

function showControls() {
  showCamera();
  for (const name of ["schedule", "transport", "sampler", "wave", "depth", "spp"]) show(name, state.settings[name]);
  const idle = state.settings.sampler_without_effect;
  enable("sampler", idle === null, `It does nothing ${idle}`, "");
  const hasWaves = state.settings.schedule === "wavefront";
  enable("wave", hasWaves, "The recursive schedule has no waves", "How many paths go through the stages together");
}

function showCamera() {
  const { camera, cameras } = state;
  showCameraNames(cameras, camera.name);
  for (const id of ["fov", "fov-number"]) {
    // As for a parallel projection.
    enable(id, camera.fov_deg !== null, "This camera has no such angle: its own values are below, under Values", "");
    show(id, camera.fov_deg === null ? "" : fitted(camera.fov_deg, ROOM));
  }
  const lens = camera.lens_radius_m ?? 0; // a pinhole camera has no lens, but may get one
  // Scenes have all sizes, so the slider's range depends on the distance.
  byId("lens").max = Math.max(lens, rounded((camera.focus_m ?? 1) / 20, 1));
  show("lens", rounded(lens));
  show("lens-number", fitted(lens, ROOM));
  byId("focus-distance").textContent = camera.focus_m === null ? "all distances" : `${digits(camera.focus_m)} m`;
  byId("camera-origin").textContent = triple(camera.origin);
  byId("camera-target").textContent = triple(camera.target);
  const cannot = camera.is_moved ? "The file does not say where this camera is, or something moves it: copy its line" : "The camera is where its file says";
  enable("save-camera", state.can_save && camera.is_moved, cannot, "Write the camera into the scene's file");
  enable("reset", camera.is_moved, "The camera is where its file says", "The scene's camera again (0)");
}

/** Rounds the server's 32-bit floats, which cannot represent numbers such as 0.1. */
const rounded = (value, to = 6) => Number(value.toPrecision(to));

function showCameraNames(names, chosen) {
  const select = byId("camera");
  const isSame = select.options.length === names.length && names.every((name, index) => select.options[index].value === name);
  if (!isSame) select.replaceChildren(...names.map((name) => new Option(name, name)));
  enable("camera", names.length > 1, "The scene has no other camera", "");
  if (chosen !== undefined) show("camera", chosen);
}

function connectControls() {
  document.addEventListener("input", (event) => hold(event.target));
  document.addEventListener("change", (event) => letGo(event.target));
  document.addEventListener("focusout", (event) => letGo(event.target));
  connectPair("fov", "fov-number", "fov_deg");
  connectPair("lens", "lens-number", "lens_radius_m");
  for (const name of ["schedule", "transport", "sampler"]) {
    on(name, "change", (event) => send({ settings: { [name]: event.target.value } }));
  }
  for (const name of ["wave", "depth", "spp"]) {
    on(name, "change", (event) => sendNumber(event.target, (value) => ({ settings: { [name]: value } })));
  }
  on("camera", "change", (event) => send({ camera: event.target.value }));
  on("reset", "click", () => send({ reset: true }));
  on("save-camera", "click", () => send({ save_camera: true }));
  on("copy-line", "click", copyLine);
  on("focus", "click", () => setFocusing(!isFocusing));
  on("pause", "click", togglePause);
  on("restart", "click", () => send({ restart: true }));
}

/** A slider acts while it is dragged, the number beside it when the input is complete. */
function connectPair(sliderId, numberId, command) {
  const [slider, number] = [byId(sliderId), byId(numberId)];
  slider.addEventListener("input", () => {
    hold(number);
    number.value = rounded(slider.valueAsNumber, 4);
    send({ [command]: number.valueAsNumber });
  });
  slider.addEventListener("change", () => letGo(number));
  number.addEventListener("change", () => sendNumber(number, (value) => ({ [command]: value })));
}

function sendNumber(input, command) {
  if (input.value === "" || !input.checkValidity()) return tell(`${input.value || "Nothing"} is not a number that fits here.`, true);
  send(command(input.valueAsNumber));
}

function togglePause() {
  if (state && !state.is_done) send({ pause: !state.is_paused });
}

function copyLine() {
  if (state) copy(state.camera.line, "the camera's line");
}

// ---- The pointer ----

let drag = null; // {kind, button, start, last, hasMoved} while a button is down
let pointed = null; // the pixel under the pointer
let isFocusing = false; // the next click sets the focus

/** The pixel of the full image under an event, or null outside. */
function pixelAt(event) {
  if (!state) return null;
  const area = byId("image").getBoundingClientRect();
  const x = Math.floor(((event.clientX - area.left) / area.width) * state.size[0]);
  const y = Math.floor(((event.clientY - area.top) / area.height) * state.size[1]);
  return x >= 0 && y >= 0 && x < state.size[0] && y < state.size[1] ? [x, y] : null;
}

function connectPointer() {
  on("image", "pointerdown", beginDrag);
  on("image", "pointermove", movePointer);
  on("image", "pointerup", endDrag);
  on("image", "pointercancel", endDrag);
  on("image", "pointerleave", () => point(null));
  on("image", "contextmenu", (event) => event.preventDefault());
  on("image", "mousedown", (event) => event.button === 1 && event.preventDefault()); // it would scroll
  byId("image").addEventListener("wheel", zoomByWheel, { passive: false }); // it must not scroll the page
}

function beginDrag(event) {
  if (drag) return;
  const place = [event.clientX, event.clientY];
  const slides = event.button === 1 || event.ctrlKey;
  const kind = slides ? "slide" : event.button === 2 || event.shiftKey ? "pan" : "orbit";
  drag = { kind, button: event.button, start: place, last: place, hasMoved: false };
  event.target.setPointerCapture(event.pointerId);
}

function movePointer(event) {
  if (!drag) return point(pixelAt(event));
  const place = [event.clientX, event.clientY];
  drag.hasMoved ||= Math.hypot(place[0] - drag.start[0], place[1] - drag.start[1]) >= CLICK_PX;
  if (!drag.hasMoved) return;
  byId("image").classList.add("is-dragged");
  const way = [place[0] - drag.last[0], place[1] - drag.last[1]];
  const height = byId("image").clientHeight;
  if (drag.kind === "slide") slide(...way);
  else send({ [drag.kind]: way.map((pixels) => pixels / height) });
  drag.last = place;
}

function endDrag(event) {
  if (!drag) return;
  const isClick = event.type === "pointerup" && !drag.hasMoved && drag.button === 0;
  drag = null;
  byId("image").classList.remove("is-dragged");
  const pixel = pixelAt(event);
  if (isClick && pixel) click(pixel, event.altKey);
}

function click(pixel, isAlt) {
  if (isAlt || isFocusing) {
    send({ focus: pixel });
    setFocusing(false);
  } else {
    if (steps) chooseWave(pixel);
    else explain(pixel, 0);
    pick(pixel);
  }
}

function setFocusing(to) {
  isFocusing = to;
  byId("focus").setAttribute("aria-pressed", to);
  byId("image").classList.toggle("is-focusing", to);
  if (to) tell("Click what shall be sharp. Escape cancels.");
}

/** The wheel magnifies the image, and with Alt moves the camera. */
function zoomByWheel(event) {
  event.preventDefault();
  const pixels = event.deltaY * [1, 16, 400][event.deltaMode]; // in pixels, lines or pages
  const by = Math.exp(-Math.max(-200, Math.min(200, pixels)) / (event.altKey ? 600 : 300));
  if (event.altKey) send({ zoom: by });
  else magnify(by, [event.clientX, event.clientY]);
}

// The readout.

let restTimer = 0;
let readAt = 0; // the time of the last request

function point(pixel) {
  pointed = pixel;
  clearTimeout(restTimer);
  restTimer = 0;
  byId("readout-pixel").textContent = pixel ? pixel.join(", ") : "–";
  if (pixel) restTimer = setTimeout(askForPixel, REST_MS);
  else showReadout(null);
}

/** Repeats the request, because the values change while the image converges. */
function refreshReadout() {
  if (pointed && performance.now() - readAt > 500) askForPixel();
}

const askForPixel = newestOnly(async () => {
  if (!pointed) return;
  readAt = performance.now();
  const [x, y] = pointed;
  const known = await (await request("/pixel", { x, y })).json();
  if (pointed && pointed[0] === x && pointed[1] === y) showReadout(known);
});

function showReadout(known) {
  const set = (name, text) => (byId(`readout-${name}`).textContent = byId(`readout-${name}`).title = text ?? "–");
  set("radiance", known && known.radiance.map((value) => rounded(value, 6)).join("  "));
  set("depth", known && known.depth_m !== null ? `${digits(known.depth_m)} m` : null);
  set("entity", known?.entity);
  set("material", known?.material);
}

// ---- Queues of the wavefront ----

function showQueues() {
  const { queues } = state;
  byId("queues").hidden = queues === null;
  byId("no-queues").hidden = queues !== null || state.settings.schedule !== "recursive";
  if (queues === null) return;
  const stageRows = barRows(byId("stages"), queues.stages.length, [["full"], ["lanes"], ["active"]]);
  queues.stages.forEach((stage, index) => showStage(stageRows[index], stage));
  const bounceRows = barRows(byId("bounces"), queues.bounces.length, [["hits", "misses"], ["arrived", "blocked"], ["ends"]]);
  const most = Math.max(1, ...queues.bounces.flatMap(({ rays, shadow }) => [rays, shadow]));
  queues.bounces.forEach((bounce, index) => showBounce(bounceRows[index], bounce, most));
}

/** Sets the number of rows. Existing rows stay, so that a hovering title does not vanish. */
function barRows(container, wanted, bars) {
  while (container.children.length > wanted) container.lastChild.remove();
  while (container.children.length < wanted) container.append(barRow(bars));
  return container.children;
}

/** A row of a label, bars made of parts with these classes, and a number. */
function barRow(bars) {
  const drawn = bars.map((parts) => element("span", "bar", ...parts.map((part) => element("span", part))));
  return element("div", "bar-row", element("span"), element("span", "bars", ...drawn), element("span", "number"));
}

function fillRow(row, label, number, title, shares) {
  row.firstChild.textContent = label;
  row.lastChild.textContent = number;
  row.title = title;
  for (const [part, share] of Object.entries(shares)) {
    row.querySelector(`.${part}`).style.width = `${100 * Math.min(1, Math.max(0, share))}%`;
  }
}

function showStage(row, { name, calls, entering, leaving, room, lanes, active }) {
  const full = room > 0 ? entering / room : 0;
  const rooms = room > 0 ? `; room for ${count(room)}: ${percent(full)} full` : "";
  const shares =
    lanes > 0 ? ` Lanes that held an item: ${percent(lanes)}; whose item went on: ${percent(active)}.` : "";
  const title =
    `${name}: ran ${count(calls)} times; ${count(entering)} items came, ${count(leaving)} went on${rooms}.${shares}`;
  fillRow(row, name, room > 0 ? percent(full) : shortCount(entering), title, { full, lanes, active });
}

function showBounce(row, { bounce, rays, hits, shadow, blocked, ends }, most) {
  const title =
    `Bounce ${bounce}: ${count(rays)} rays, ${count(hits)} hit, ${count(rays - hits)} missed; ` +
    `${count(shadow)} shadow rays, ${count(shadow - blocked)} arrived, ${count(blocked)} were blocked; ` +
    `${count(ends)} paths ended.`;
  const amounts = { hits, misses: rays - hits, arrived: shadow - blocked, blocked, ends };
  const shares = Object.fromEntries(Object.entries(amounts).map(([part, amount]) => [part, amount / most]));
  fillRow(row, `bounce ${bounce}`, shortCount(rays), title, shares);
}

// ---- The end points of a sample's photons ----

const POINT = 1.8; // radius of a point, in CSS pixels

let landings = null; // the LANDINGS that are shown
let photonSample = 0;

/** Shows what the state contains: the number of photons, or why there are none. */
function showPhotons() {
  const { photons } = state;
  const there = photons && photons.none === null;
  byId("photons-state").textContent =
    photons === null ? "Not known yet." : there ? `${count(photons.a_sample)} for each sample.` : `None: ${photons.none}.`;
  byId("photons-shown").hidden = photons !== null && !there;
  byId("photons-sample").textContent = `sample ${photonSample}`;
  byId("previous-photons").disabled = photonSample === 0;
  byId("next-photons").disabled = photonSample + 1 >= state.wanted;
  // Photons of another image must not lie over this one.
  byId("landings").hidden = landings === null || landings.generation !== state.generation;
}

function setPhotons(areShown) {
  byId("show-photons").checked = areShown;
  if (areShown) return askForPhotons();
  landings = null;
  showLandings();
}

function stepPhotons(by) {
  photonSample = Math.max(0, Math.min(state.wanted - 1, photonSample + by));
  setPhotons(true);
  showPhotons();
}

const askForPhotons = newestOnly(async () => {
  if (!byId("show-photons").checked) return;
  const answer = await (await request("/photons", { sample: photonSample })).json();
  if (!byId("show-photons").checked) return;
  landings = answer;
  showLandings();
});

/** Requests the photons again after a restart; more samples do not change them. */
function followPhotons() {
  if (landings && landings.generation !== state.generation) askForPhotons();
}

function showLandings() {
  byId("photons-count").hidden = landings === null || landings.none !== null;
  if (landings) byId("photons-count").textContent = landingsText(landings);
  showPhotons();
  drawLandings();
}

function landingsText({ emitted, landed, in_picture, seen, points, white_w }) {
  const some = points.length < in_picture ? `The first ${count(points.length)} are shown, ` : "They are shown, ";
  return (
    `Of ${count(emitted)}, ${count(landed)} end on a surface, ${count(in_picture)} of them within the picture. ` +
    `${some}as dots those that the camera sees directly (${count(seen)}), as rings those that lie behind something: ` +
    `paths gather them. White is ${watts(white_w)}.`
  );
}

function drawLandings() {
  const canvas = byId("landings");
  const { clientWidth, clientHeight } = byId("image");
  // Of a strongly magnified image, not all pixels of the screen can be had.
  const density = Math.min(devicePixelRatio, MOST_SIDE / Math.max(clientWidth, clientHeight, 1));
  Object.assign(canvas, { width: clientWidth * density, height: clientHeight * density }); // clears it
  if (!landings) return;
  const context = canvas.getContext("2d");
  const scale = canvas.width / state.size[0];
  // Rings first: dots lie above them.
  for (const kind of [0, 1]) {
    for (const [x, y, r, g, b, isSeen] of landings.points) {
      if (isSeen === kind) drawLanding(context, [x * scale, y * scale], `rgb(${r} ${g} ${b})`, isSeen);
    }
  }
}

/** Draws a point with a dark outline, so that it is visible on a bright background. */
function drawLanding(context, [x, y], color, isSeen) {
  context.beginPath();
  context.arc(x, y, POINT * devicePixelRatio, 0, 2 * Math.PI);
  context.lineWidth = (isSeen ? 1.5 : 2.5) * devicePixelRatio;
  context.strokeStyle = "#000000b0";
  context.stroke();
  if (isSeen) {
    context.fillStyle = color;
    context.fill();
  } else {
    context.lineWidth = devicePixelRatio;
    context.strokeStyle = color;
    context.stroke();
  }
}

function connectPhotons() {
  on("show-photons", "change", (event) => setPhotons(event.target.checked));
  on("previous-photons", "click", () => stepPhotons(-1));
  on("next-photons", "click", () => stepPhotons(1));
}

// ---- The keyboard ----

const STEP = 0.05; // the step of an arrow key, relative to the image's height

/** The four arrow keys; they act only where they do not scroll or move a slider. */
const ARROWS = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP] };

const KEYS = {
  "?": () => byId("help").togglePopover(),
  "+": () => magnifyByKey(1.25),
  "=": () => magnifyByKey(1.25),
  "-": () => magnifyByKey(0.8),
  home: fitImage,
  pageup: () => send({ zoom: 1.1 }),
  pagedown: () => send({ zoom: 1 / 1.1 }),
  k: keepImage,
  s: savePng,
  "[": () => (steps ? stepWave(-1) : stepSample(-1)),
  "]": () => (steps ? stepWave(1) : stepSample(1)),
  ",": () => setExposure(Number(byId("exposure-number").value) - 0.25),
  ".": () => setExposure(Number(byId("exposure-number").value) + 0.25),
  0: () => send({ reset: true }),
  a: () => setAutoExposure(!view.isAuto),
  c: copyLine,
  b: () => setBoxes(!byId("show-boxes").checked),
  p: () => setPhotons(!byId("show-photons").checked),
  f: () => setFocusing(!isFocusing),
  r: () => send({ restart: true }),
  w: toggleSteps,
  escape,
};

function escape() {
  if (byId("help").matches(":popover-open")) return; // the key closes the help only
  if (isFocusing) setFocusing(false);
  else if (wanted) closeExplanation();
  else if (steps) toggleSteps();
  else unpick();
}

function pressKey(event) {
  const { target, key } = event;
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const isField = target.matches("select, input:not([type=checkbox], [type=range])");
  if (isField && key !== "Escape") return;
  const isForPage = key.startsWith("Page") || key === "Home"; // elsewhere, these scroll
  if (isForPage && target !== byId("image") && target !== document.body) return;
  const action = KEYS[key.toLowerCase()] ?? keyInImage(event);
  if (!action) return;
  if (key !== "Escape") event.preventDefault(); // the browser closes the help on Escape
  action();
}

/** Keys with another function on a button or a slider. */
function keyInImage({ target, key, shiftKey }) {
  const canvas = byId("image");
  if (key >= "1" && key <= "9") return () => setLayer(byId("layer").options[key - 1].value);
  if (target !== canvas && target !== document.body) return null;
  if (key in ARROWS) return () => send({ [shiftKey ? "pan" : "orbit"]: ARROWS[key] });
  if (key === " ") return togglePause;
  if (key === "Enter" && state) return () => click(pointed ?? state.size.map((side) => Math.floor(side / 2)), false);
  return null;
}

