
// ---- The boxes of the tree at one level, over the image ----

const KINDS_OF_BOX = ["node", "leaf"];

let boxes = null; // the BOXES that are shown

const boxesChanged = () => boxes !== null && boxes.generation !== state.generation;

function setBoxes(areShown) {
  byId("show-boxes").checked = areShown;
  if (areShown) return askForBoxes();
  boxes = null;
  showBoxes();
}

const askForBoxes = newestOnly(async () => {
  const level = byId("boxes-level");
  if (level.valueAsNumber > Number(level.max)) level.value = level.max;
  if (!byId("show-boxes").checked || level.value === "" || !level.checkValidity()) return;
  const answer = await (await request("/boxes", { level: level.value })).json();
  if (!byId("show-boxes").checked) return;
  boxes = answer;
  showBoxes();
});

function hideOldBoxes() {
  byId("boxes").style.visibility = boxesChanged() ? "hidden" : "";
}

/** Requests the boxes again after a restart: scene or camera may have changed. */
function followBoxes() {
  hideOldBoxes();
  if (boxesChanged()) askForBoxes();
}

function showBoxes() {
  byId("boxes-state").textContent = boxes === null ? "" : boxesText(boxes);
  byId("boxes-state").title = boxes === null ? "" : "Solid: boxes that hold boxes; dashed: boxes that hold triangles or spheres";
  if (boxes) {
    const level = byId("boxes-level");
    level.max = boxes.last;
    if (level.valueAsNumber > boxes.last) level.value = boxes.level;
  }
  drawBoxes();
  hideOldBoxes();
}

function boxesText({ level, last, count: all, is_complete, is_limited, boxes: drawn }) {
  const number = `${is_complete ? "" : "at least "}${count(all)} ${all === 1 ? "box" : "boxes"}`;
  const some = drawn.length === 0
    ? ": the image shows none of their edges"
    : is_limited
      ? `, ${count(drawn.length)} of those seen are drawn`
      : drawn.length < all
        ? `, ${count(drawn.length)} seen`
        : "";
  return `level ${level} of ${last}: ${number}${some}`;
}

/** The path of a line whose columns and rows follow each other. */
const linePath = (line) => line.map((at, index) => `${index === 0 ? "M" : index % 2 ? " " : "L"}${at}`).join("");

/** Lines with a dark outline, so that they are visible on a bright ground; those of leaves are dashed. */
function drawBoxes() {
  const svg = byId("boxes");
  svg.replaceChildren();
  if (boxes === null) return;
  svg.setAttribute("viewBox", `0 0 ${state.size.join(" ")}`);
  for (const [kind, name] of KINDS_OF_BOX.entries()) {
    const lines = boxes.boxes.filter(([own]) => own === kind).flatMap(([, lines]) => lines);
    const d = lines.map(linePath).join("");
    if (d) svg.append(shape("path", "box-outline", { d }), shape("path", `box-${name}`, { d }));
  }
}

function connectBoxes() {
  on("show-boxes", "change", (event) => setBoxes(event.target.checked));
  on("boxes-level", "input", () => setBoxes(true));
}
