
// ---- A wave, one stage after another ----

/** A stage in the order of the wave's loop, and the sentence about a STEP of it. */
const STAGES = {
  generate: ({ entering, turn }) =>
    turn === 0
      ? `${items(entering, "sample begins", "samples begin")}: rays of the camera fill the wave.`
      : `${items(entering, "new sample takes the place", "new samples take the places")} of paths that have ended.`,
  intersect: ({ entering, leaving }) => `${items(entering, "ray is", "rays are")} traced; ${count(leaving)} hit something.`,
  retire: ({ entering, leaving }) =>
    entering === leaving ? "All rays have hit something: none leaves the wave." : `${items(entering - leaving, "miss leaves", "misses leave")} the wave, and the hits close up.`,
  shade: (step) => (isSorted() || step.entering === 0 ? sortedText(step) : `${items(step.entering, "hit is", "hits are")} shaded as they come: under Whitted's transport, one code serves all materials.`),
  light: ({ leaving }) => `${items(leaving, "ray", "rays")} to lights made.`,
  shadow: ({ entering, leaving }) => `${items(entering, "ray", "rays")} to lights traced; ${count(entering - leaving)} blocked.`,
  connect: ({ entering, leaving }) =>
    `${items(entering, "ray", "rays")} from first vertices to second ones of neighbours traced (path reuse); ${count(entering - leaving)} blocked.`,
  advance: ({ ended, queues }) => {
    const waiting = queues.waiting === 0 ? "" : `; ${items(queues.waiting, "fork waits", "forks wait")} for a place`;
    return `${items(ended, "path has", "paths have")} ended and ${ended === 1 ? "goes" : "go"} to the film; ${count(queues.wave)} go on${waiting}.`;
  },
};

const QUEUES = { wave: "wave", shadow: "to lights", next: "going on", forks: "forks", waiting: "waiting" };
const CELL = 9; // side of a lane's cell, in CSS pixels

let steps = null; // the STEPS that are shown
let stepNumber = 0;
let stepsPixel = null; // the pixel whose block is followed; null: the middle

const items = (number, one, many) => `${count(number)} ${number === 1 ? one : many}`;
const isSorted = () => steps.transport === "Path";

function toggleSteps() {
  const panel = byId("steps-panel");
  panel.open = !panel.open; // which tells stepsToggled
}

function stepsToggled() {
  if (byId("steps-panel").open) {
    closeExplanation(); // whose lines would lie over those of the wave
    return askForSteps();
  }
  steps = null;
  drawSteps();
}

const askForSteps = newestOnly(async () => {
  if (!byId("steps-panel").open || !state) return;
  const [x, y] = stepsPixel ?? state.size.map((side) => Math.floor(side / 2));
  const answer = await (await request("/steps", { x, y })).json();
  if (!byId("steps-panel").open) return;
  const isFirst = steps === null;
  steps = answer;
  showStep(stepNumber);
  if (isFirst) byId("steps-panel").scrollIntoView({ block: "start" });
});

/** Requests the steps again after a restart. */
function followSteps() {
  if (!byId("steps-panel").open) return;
  drawSteps();
  if (steps?.generation !== state.generation) askForSteps();
}

function chooseWave(pixel) {
  [stepsPixel, stepNumber] = [pixel, 0];
  askForSteps();
}

function stepWave(by) {
  if (steps) showStep(stepNumber + by);
}

function showStep(number) {
  const last = steps.steps.length - 1;
  stepNumber = Math.max(0, Math.min(last, number));
  const step = steps.steps[stepNumber];
  Object.assign(byId("step-number"), { max: last, value: stepNumber });
  byId("previous-step").disabled = stepNumber === 0;
  byId("next-step").disabled = stepNumber >= last;
  byId("steps-region").textContent = regionText(steps);
  if (!step) return drawSteps();
  const said = `Turn ${step.turn + 1}, ${step.stage}`;
  byId("step-number").setAttribute("aria-valuetext", `${said}: step ${stepNumber + 1} of ${last + 1}`);
  byId("step-name").textContent = said;
  byId("step-text").textContent = STAGES[step.stage](step);
  showStepStages(step);
  showStepLanes(step);
  showStepQueues(step);
  drawSteps();
}

function regionText({ region: [x0, y0, x1, y1], is_complete, steps: all }) {
  const some = is_complete ? "" : ` The first ${count(all.length)} steps.`;
  return `A wave renders a sample of each of the pixels ${x0}–${x1 - 1}, ${y0}–${y1 - 1}. A click on the image chooses others.${some}`;
}

function showStepStages(step) {
  const known = new Set(steps.steps.map(({ stage }) => stage));
  const chip = (stage) => element("li", stage === step.stage ? "is-current" : "", stage);
  byId("step-stages").replaceChildren(...Object.keys(STAGES).filter((stage) => known.has(stage)).map(chip));
}

/** The lanes that do work, as a part of those of so many groups. */
const lanesUsed = ({ entering }, groups) => (groups === 0 ? 1 : entering / (groups * steps.width));

function sortedText(step) {
  const { entering, items: hits, sorted, unsorted } = step;
  if (entering === 0) return "No hit is left to shade.";
  const materials = new Set(hits).size;
  const kinds = `${items(entering, "hit", "hits")} of ${items(materials, "material", "materials")}`;
  if (steps.width === 1) return `${kinds} shaded one by one: without SIMD, nothing depends on their order.`;
  const use = (groups) => `${items(groups, "group", "groups")} of ${steps.width} lanes (${percent(lanesUsed(step, groups))} full)`;
  return `${kinds}. As they come, code for one material after another would run over ${use(unsorted)}; sorted by material, over ${use(sorted.length)}.`;
}

/** Lanes before and after a step that changes their order. */
function showStepLanes(step) {
  const figures = [];
  const rows = (all) => Array.from({ length: Math.ceil(all.length / lanesInRow()) }, (_, row) => all.slice(row * lanesInRow(), (row + 1) * lanesInRow()));
  if (step.items) figures.push(["as they come", rows(step.items)]);
  if (step.stage === "retire") figures.push(["closed up", rows(step.items.filter((material) => material !== null))]);
  if (step.stage === "shade" && isSorted() && steps.width > 1) figures.push(["sorted by material", step.sorted.map(([material, lanes]) => Array(lanes).fill(material))]);
  byId("step-lanes").replaceChildren(...figures.map(([title, rows]) => laneFigure(title, rows)));
  const seen = new Set(step.items ?? []);
  const legend = steps.materials.filter(([material]) => seen.has(material)).map(([, name, color]) => {
    const mark = shape("svg", "swatch", { viewBox: "0 0 1 1" });
    mark.append(shape("rect", "", { width: 1, height: 1, fill: rgb(color) }));
    return element("li", "", mark, name);
  });
  byId("step-materials").replaceChildren(...legend);
}

/** Lanes drawn side by side; without SIMD, there are no lanes that a row could stand for. */
const lanesInRow = () => (steps.width === 1 ? 16 : steps.width);

const rgb = ([r, g, b]) => `rgb(${r} ${g} ${b})`;

const colorOf = (material) => rgb(steps.materials.find(([known]) => known === material)?.[2] ?? [128, 128, 128]);

function laneFigure(title, rows) {
  const [width, height] = [lanesInRow() * CELL, rows.length * CELL];
  const svg = shape("svg", "lanes-drawn", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img" });
  svg.setAttribute("aria-label", `${rows.length} rows of lanes, ${title}`);
  for (const [y, row] of rows.entries()) {
    for (let x = 0; x < lanesInRow(); x++) {
      const material = row[x] ?? null;
      const cell = { x: x * CELL + 0.5, y: y * CELL + 0.5, width: CELL - 1, height: CELL - 1 };
      svg.append(shape("rect", material === null ? "is-empty" : "", material === null ? cell : { ...cell, fill: colorOf(material) }));
    }
  }
  return element("figure", "", element("figcaption", "unit", title), svg);
}

function showStepQueues({ queues, capacity }) {
  const rows = barRows(byId("step-queues"), Object.keys(QUEUES).length, [["full"]]);
  for (const [index, [queue, name]] of Object.entries(QUEUES).entries()) {
    const length = queues[queue];
    fillRow(rows[index], name, count(length), `${name}: ${count(length)}; the wave has room for ${count(capacity)}`, { full: length / capacity });
  }
}

// Over the image.

/** The rays to draw for a step, as lists of lines by class and colour. */
function stepRays(step) {
  if (step.stage === "shadow") return step.rays.map(([isBlocked, lines]) => ["light-ray", isBlocked ? "#e0695a" : "#f2d24a", lines]);
  const ofTurn = steps.steps.find(({ stage, turn }) => stage === "intersect" && turn === step.turn)?.rays ?? [];
  const isShown = {
    generate: ([, depth]) => depth === 0,
    intersect: () => true,
    retire: ([material]) => material !== null,
    shade: ([material]) => material !== null,
    light: ([material]) => material !== null,
  }[step.stage];
  if (!isShown) return [];
  const isColored = step.stage !== "generate";
  return ofTurn.filter(isShown).map(([material, depth, lines]) => {
    const isMiss = material === null && isColored;
    const kind = depth === 0 ? "place" : isMiss ? "escaped" : "ray"; // the camera sees its own rays as points
    return [kind, isMiss ? "#b8b8b8" : isColored ? colorOf(material) : "#ffffff", lines];
  });
}

function drawSteps() {
  const svg = byId("steps");
  svg.replaceChildren();
  const step = steps?.steps[stepNumber];
  if (!step || steps.generation !== state.generation) return;
  svg.setAttribute("viewBox", `0 0 ${state.size.join(" ")}`);
  const byStyle = new Map();
  for (const [kind, color, lines] of stepRays(step)) {
    const style = `${kind} ${color}`;
    byStyle.set(style, [...(byStyle.get(style) ?? []), ...lines.map(linePath)]);
  }
  for (const [style, lines] of byStyle) {
    const [kind, color] = style.split(" ", 1).concat(style.slice(style.indexOf(" ") + 1));
    const d = lines.join("");
    if (d) svg.append(shape("path", `outlined ${kind}`, { d }), shape("path", kind, { d, stroke: color }));
  }
  const [x0, y0, x1, y1] = steps.region;
  svg.append(shape("path", "block", { d: `M${x0} ${y0}H${x1}V${y1}H${x0}Z` }));
}

function connectSteps() {
  on("steps-panel", "toggle", stepsToggled);
  on("step-number", "input", (event) => steps && showStep(event.target.valueAsNumber));
  on("previous-step", "click", () => stepWave(-1));
  on("next-step", "click", () => stepWave(1));
}
