// ---- The explanation of a pixel ----

let wanted = null; // {pixel, sample} of the last request; null: no explanation is shown
let told = null; // the EXPLANATION that is shown

function explain(pixel, sample) {
  const isNew = wanted === null;
  wanted = { pixel, sample };
  byId("explanation").hidden = false;
  byId("explanation").setAttribute("aria-busy", "true");
  byId("explanation-title").textContent = `Pixel ${pixel.join(", ")}`;
  byId("explanation-sample").textContent = "following …";
  byId("overlay").classList.add("is-stale");
  if (isNew) byId("side").scrollTop = 0;
  askForExplanation(wanted);
}

const askForExplanation = newestOnly(async (asked) => {
  const { pixel, sample } = asked;
  try {
    const answer = await (await request("/explain", { x: pixel[0], y: pixel[1], sample })).json();
    if (wanted === asked) showExplanation(answer);
  } catch (error) {
    if (wanted === asked) closeExplanation();
    throw error;
  }
});

function closeExplanation() {
  wanted = told = null;
  byId("explanation").hidden = true;
  drawOverlay();
}

/** The number of samples to choose from; it grows while the rendering continues. */
const samplesToExplain = () => Math.max(told.samples, state.samples);

function stepSample(by) {
  if (!told) return;
  const sample = wanted.sample + by; // relative to the request, so that several steps add up before its response
  if (sample >= 0 && sample < samplesToExplain()) explain(wanted.pixel, sample);
}

function showExplanation(explanation) {
  told = explanation;
  byId("explanation").removeAttribute("aria-busy");
  byId("explanation-title").textContent = `Pixel ${told.pixel.join(", ")}`;
  byId("explanation-radiance").textContent = triple(told.radiance);
  byId("explanation-radiance").title = "What this sample adds to the pixel";
  showDrawnPhotons();
  showStepper();
  showAgreement();
  setStale(false);
  const isAlone = told.paths.length === 1;
  byId("paths").replaceChildren(...told.paths.flatMap((path, number) => pathItems(path, number, isAlone)));
  byId("command").textContent = told.command;
  drawOverlay();
}

/** Shows photons that belong to no path: those that end where the camera sees them. */
function showDrawnPhotons() {
  const { count: number, radiance } = told.photons;
  const line = byId("explanation-photons");
  line.hidden = number === 0;
  const photons = number === 1 ? "1 photon that it sees directly brings " : `${count(number)} photons that it sees directly bring `;
  line.replaceChildren(photons, element("span", "number", triple(radiance)));
}

/** Shows the sample's number, counted from 0 as in the command below. */
function showStepper() {
  byId("explanation-sample").textContent = `sample ${told.sample} of 0–${samplesToExplain() - 1}`;
  byId("previous-sample").disabled = told.sample === 0;
  byId("next-sample").disabled = told.sample + 1 >= samplesToExplain();
}

/** Nine digits distinguish any two 32-bit floats. */
const exact = (values) => values.map((value) => rounded(value, 9)).join(", ");

function showAgreement() {
  const { wavefront, recursive } = told.schedules;
  const agreement = byId("agreement");
  agreement.classList.toggle("is-bad", !told.agrees);
  agreement.textContent = told.agrees
    ? "Both schedules: the same bits."
    : `THE SCHEDULES DIFFER. That is an error in rayfront.\nwavefront: ${exact(wavefront)}\nrecursive: ${exact(recursive)}`;
}

/** Marks the explanation as outdated if the image has restarted since. */
function noticeNewPicture() {
  if (!told || byId("explanation").hasAttribute("aria-busy")) return;
  showStepper();
  if (told.generation !== state.generation) setStale(true);
}

function setStale(isStale) {
  byId("explanation-stale").hidden = !isStale;
  byId("overlay").classList.toggle("is-stale", isStale);
}

function pathItems(path, number, isAlone) {
  const { forked_off_path, forked_off_bounce } = path;
  const from = forked_off_path === null ? "from the camera" : `forked off path ${forked_off_path} at bounce ${forked_off_bounce}`;
  const list = element("ol", "", ...path.steps.map((step, index) => stepItem(step, number, `${number}-${index}`)));
  const end = element("p", "end", `It ends: ${path.end.replace(/\.$/, "")}.`);
  const shared = path.shares === null ? [] : [element("p", "end", sharesText(path.shares))];
  if (isAlone) return [list, end, ...shared];
  const brings = element("p", "end", "It brings ", element("span", "number", triple(path.radiance)));
  return [element("h3", "", `Path ${number}, ${from}`), list, end, ...shared, brings];
}

/** Describes the path reuse: the light from the path itself and from others of its group. */
function sharesText({ before, own, shared, vertices }) {
  const group = vertices === 1 ? "1 second vertex" : `${vertices} second vertices`;
  return (
    `Up to the first vertex it finds ${triple(before)}, beyond that by its own path alone ${triple(own)}, ` +
    `and from ${group} of its group ${triple(shared)}.`
  );
}

/** A vertex in the list. Hovering over it marks it in the image. */
function stepItem(step, pathNumber, key) {
  const badge = element("span", `badge branch-${pathNumber % BRANCHES}`, step.vertex ? String(step.bounce) : "–");
  const item = element("li", "step", badge, stepFacts(step));
  item.tabIndex = 0;
  for (const event of ["mouseenter", "focus"]) item.addEventListener(event, () => mark(key));
  for (const event of ["mouseleave", "blur"]) item.addEventListener(event, () => mark(null));
  return item;
}

function stepFacts({ bounce, queue, throughput, lamps, to, vertex }) {
  const met = vertex ? [vertex.entity, element("span", "of", ` of ${vertex.material}`)] : ["meets nothing"];
  const facts = element("div", "facts", element("span", "what", ...met));
  const length = vertex ? `, ${digits(vertex.t)} m` : "";
  fact(facts, "ray", `bounce ${bounce}, ${queue}${length}`);
  fact(facts, "throughput", triple(throughput), "number");
  for (const { light, found } of lamps) fact(facts, `finds ${light}`, triple(found), "number");
  if (vertex) vertexFacts(facts, vertex, to);
  return facts;
}

function vertexFacts(facts, { gives_off, photons, lobe, lights, position, normal }, to) {
  if (!isBlack(gives_off)) fact(facts, "gives off", triple(gives_off), "number");
  if (!isBlack(photons)) fact(facts, "photons", triple(photons), "number");
  for (const rays of byLight(lights)) lightFact(facts, rays);
  if (lobe !== null) fact(facts, "goes on by", lobe);
  if (!isInImage(to)) fact(facts, "lies", to === null ? "behind the camera" : "outside the image");
  facts.title = `at ${triple(position)}\nnormal ${triple(normal)}`;
}

const isInImage = (place) => place !== null && place.every((value, axis) => value >= 0 && value < state.size[axis]);

function fact(facts, term, value, className = "") {
  facts.append(element("span", "term", term), element("span", className, value));
}

/** The rays to lights, those to one light together: an area light may get several. */
function byLight(lights) {
  const groups = new Map();
  for (const ray of lights) groups.set(ray.light, [...(groups.get(ray.light) ?? []), ray]);
  return [...groups.values()];
}

/** The light that rays to a light bring, in one line. */
function lightFact(facts, rays) {
  const sum = (values) => [0, 1, 2].map((channel) => values.reduce((sum, value) => sum + value[channel], 0));
  const open = rays.filter(({ blocked }) => !blocked);
  const arrived = sum(open.map((ray) => ray.arrived));
  const isBlocked = open.length === 0;
  const whole = sum((isBlocked ? rays : open).map((ray) => ray.contribution));
  const isWhole = arrived.every((value, channel) => value === whole[channel]);
  const brings = isBlocked ? `blocked; would bring\n${triple(whole)}` : isWhole ? triple(whole) : `${triple(arrived)}\nof ${triple(whole)}`;
  const counts = rays.length === 1 ? "" : `\n${rays.length} rays${isBlocked || open.length === rays.length ? "" : `, ${rays.length - open.length} blocked`}`;
  const term = element("span", "term is-light", rays[0].light);
  const value = element("span", "number", brings + counts);
  for (const part of [term, value]) part.classList.toggle("is-blocked", isBlocked);
  const each = ({ distance, weight }) => {
    const away = distance === null ? "" : `, ${digits(distance)} m away`;
    return `A ray to this light${away}. This way to find it counts ${digits(weight)}.`;
  };
  term.title = value.title = rays.map(each).join("\n");
  facts.append(term, value);
}

function connectExplanation() {
  on("close-explanation", "click", closeExplanation);
  on("previous-sample", "click", () => stepSample(-1));
  on("next-sample", "click", () => stepSample(1));
  on("copy-command", "click", () => told && copy(told.command, "the command"));
}

// The paths over the image.

/** The overlay's units are CSS pixels, so that dots and lines have the same size on all screens. */
function drawOverlay() {
  const overlay = byId("overlay");
  overlay.replaceChildren();
  if (!told) return;
  const scale = byId("image").clientWidth / state.size[0];
  const place = (point) => point.map((value) => value * scale);
  const steps = told.paths.flatMap((path, number) => path.steps.map((step, index) => ({ step, number, key: `${number}-${index}` })));
  for (const { step, number, key } of steps) overlay.append(stepLines(step, number, key, place));
  // Dots lie above all lines; the camera's vertex, drawn last, above all dots.
  for (const { step, number, key } of steps.reverse()) {
    if (step.vertex && step.to) overlay.append(stepDot(step, number, key, place(step.to)));
  }
  overlay.append(pixelFrame(place));
}

/** The ray to a vertex, and those from it to the lights. Points behind the camera are null. */
function stepLines(step, pathNumber, key, place) {
  const group = shape("g", `step-lines branch-${pathNumber % BRANCHES}`);
  group.dataset.key = key;
  const draw = (className, lines) => {
    const d = lines.map((line) => linePath(place(line))).join("");
    if (d) group.append(shape("path", className, { d }));
  };
  for (const light of step.vertex?.lights ?? []) draw(`light-ray${light.blocked ? " is-blocked" : ""}`, light.lines);
  draw(step.vertex ? "ray" : "ray escaped", step.lines);
  return group;
}

function stepDot(step, pathNumber, key, [x, y]) {
  const dot = shape("g", `dot branch-${pathNumber % BRANCHES}`, { transform: `translate(${x} ${y})` });
  dot.dataset.key = key;
  const number = shape("text", "", { y: 0.5 });
  number.textContent = step.bounce;
  dot.append(shape("circle", "", { r: 8 }), number);
  return dot;
}

/** A frame around the explained pixel, large enough to be visible. */
function pixelFrame(place) {
  const [x, y] = place([told.pixel[0] + 0.5, told.pixel[1] + 0.5]);
  const side = Math.max(place([1])[0], 24);
  return shape("rect", "pixel", { x: x - side / 2, y: y - side / 2, width: side, height: side });
}

function mark(key) {
  const overlay = byId("overlay");
  overlay.classList.toggle("has-marked", key !== null);
  for (const part of overlay.querySelectorAll("[data-key]")) {
    const isMarked = part.classList.toggle("is-marked", part.dataset.key === key);
    if (isMarked && part.matches(".dot")) overlay.append(part); // above its neighbours
  }
}

