
// ---- Forms: the values of settings, materials, lights, cameras, shapes and transforms ----

let targets = []; // the things that have a form: {statement, kind, name}
let formOf = null; // the statement of the thing that is shown
let formText = ""; // the form as it was drawn
let formsGeneration = -1; // the generation that they were requested for
let isTyping = false; // true while a control of the form is typed into or dragged
let picked = null; // the name of the entity with an outline

/** Sends a command whose answer is data. */
async function askServer(command) {
  const options = { method: "POST", body: JSON.stringify(command), headers: { "Content-Type": "application/json" } };
  return JSON.parse((await (await request("/do", {}, options)).json()).said);
}

const KINDS = { settings: "Settings", material: "Materials", light: "Lights", camera: "Cameras", shape: "Shapes", transform: "Places" };

/** Takes the things that have a form, and lists them. */
function takeTargets(found) {
  if (JSON.stringify(found) === JSON.stringify(targets)) return;
  targets = found;
  const group = (kind) => {
    const options = targets.filter((it) => it.kind === kind).map((it) => new Option(it.name, it.statement));
    return Object.assign(element("optgroup", "", ...options), { label: KINDS[kind] });
  };
  byId("form-of").replaceChildren(...Object.keys(KINDS).map(group).filter((it) => it.children.length > 0));
}

/** Requests the list and the form again after each change, as long as the panel is open. */
const refreshForms = newestOnly(async () => {
  if (!byId("edit-panel").open || !state || formsGeneration === state.generation) return;
  const generation = state.generation;
  takeTargets(await askServer({ forms: true }));
  if (!targets.some((it) => it.statement === formOf)) formOf = targets.find((it) => it.kind !== "settings")?.statement ?? "settings";
  byId("form-of").value = formOf;
  const form = await askServer({ form: formOf });
  // Meanwhile a click may have chosen another form, which is requested next.
  if (form.statement !== formOf) return;
  formsGeneration = generation;
  showForm(form);
});

function showForm(form) {
  const text = JSON.stringify(form);
  if (text === formText) return;
  const focused = byId("form").contains(document.activeElement) ? document.activeElement : null;
  const isSame = formText !== "" && JSON.parse(formText).statement === form.statement;
  // What is being typed or dragged stays; the form is drawn again when that ends.
  if (isSame && isTyping) return;
  formText = text;
  byId("form-name").textContent = form.form;
  byId("form").replaceChildren(...form.fields.map((field) => fieldRow(form.statement, field)));
  if (isSame && focused) (byId(focused.id) ?? byId(focused.id.replace(/-texture$/, "")))?.focus();
}

/** Draws the form again as the last changes have made it. */
function redrawForm() {
  isTyping = false;
  formsGeneration = -1;
  refreshForms();
}

function chooseForm(statement) {
  formOf = statement;
  formText = "";
  redrawForm();
}

/** A field: its name, its control, and its unit and range. */
function fieldRow(statement, field) {
  const id = `field-${field.path}`;
  const label = element("label", "", field.name);
  Object.assign(label, { htmlFor: id, title: field.doc });
  const set = (value) => send({ set: `${statement}.${field.path} = ${value}` });
  const control = CONTROLS[field.kind](field, set, id);
  const isIdle = field.without_effect !== null;
  const facts = isIdle ? `does nothing ${field.without_effect}` : [field.unit, field.range].filter((it) => it).join(", ");
  const fact = element("span", "fact", facts);
  if (field.textures) fact.append(textureSelect(field, set, `${id}-texture`));
  const row = element("div", isIdle ? "field is-idle" : "field", label, control, fact);
  if (isIdle) greyOut(row, field);
  const inner = (field.fields ?? []).map((part) => fieldRow(statement, part));
  return inner.length > 0 ? element("div", "part", row, ...inner) : row;
}

/** Disables the controls of a field that does nothing; the reason stands below them. */
function greyOut(row, { name, without_effect }) {
  const controls = row.querySelectorAll("input, select, button");
  for (const control of controls) {
    control.disabled = true;
    control.setAttribute("aria-description", `${name} does nothing ${without_effect}`);
  }
}

// The value comes last: a slider rounds it to its step.
const input = (id, type, value, facts = {}) => Object.assign(element("input"), { id, type, ...facts, value: value ?? "" });

const ROOM = 8; // the characters of a number that fit beside a slider or a unit
const ROOM_OF_COLORS = 7; // those that fit beside two other numbers and a colour

/** The shortest number that is the same 32-bit float, such as 0.1. */
const shortest = (value) => [6, 7, 8, 9].map((to) => rounded(value, to)).find((it) => Math.fround(it) === Math.fround(value)) ?? value;

/** A number in at most `room` characters, as exact as they allow. */
function fitted(value, room) {
  const plain = [9, 8, 7, 6, 5, 4, 3].map((to) => String(rounded(value, to)));
  const short = [2, 1, 0].map((to) => value.toExponential(to));
  return [...plain, ...short].find((text) => text.length <= room) ?? short[2];
}

/** A control that shows a number in little room, and all of its digits while it has the focus. */
function numberInput(id, value, room, facts, isDouble = false) {
  const control = Object.assign(input(id, "number", null, facts), { room, digitsOf: isDouble ? Number : shortest });
  setNumber(control, value);
  control.addEventListener("focus", () => {
    if (control.value === control.shown) control.value = control.exact;
  });
  control.addEventListener("blur", () => {
    if (control.value !== "" && control.checkValidity()) setNumber(control, Number(written(control)));
  });
  return control;
}

function setNumber(control, value) {
  control.exact = value === null ? "" : String(control.digitsOf(value));
  control.value = control.shown = value === null ? "" : fitted(control.digitsOf(value), control.room);
  control.title = control.exact === control.shown ? "" : control.exact;
}

/** A number as in a scene file, not as rounded for display; an empty control is no number. */
function written(control) {
  if (control.value === "") return "None";
  return control.value === control.shown ? control.exact : String(control.digitsOf(control.valueAsNumber));
}

const CONTROLS = {
  flag(field, set, id) {
    const box = input(id, "checkbox", "", { checked: field.value });
    box.addEventListener("change", () => set(box.checked));
    return box;
  },
  number(field, set, id) {
    const limits = { min: field.min ?? "", max: field.max ?? "", step: field.step ?? "any" };
    const isBare = field.min == null || field.max == null || field.value === null || field.max - field.min > 1000;
    const number = numberInput(id, field.value, isBare ? 2 * ROOM : ROOM, limits);
    number.addEventListener("change", () => (number.checkValidity() ? set(written(number)) : tell(`${field.name}: ${field.range}.`, true)));
    if (isBare) return number;
    const slider = input(`${id}-slider`, "range", field.value, { ...limits, step: field.step ?? (field.max - field.min) / 500, ariaLabel: field.name });
    slider.addEventListener("input", () => {
      setNumber(number, rounded(slider.valueAsNumber, 4));
      set(written(number));
    });
    return element("span", "with-slider", slider, number);
  },
  color(field, set, id) {
    const parts = field.value.map((value, channel) => {
      const name = ["red", "green", "blue"][channel];
      const facts = { min: 0, step: "any", ariaLabel: `${field.name}, ${name}` };
      return numberInput(channel ? `${id}-${name}` : id, value, ROOM_OF_COLORS, facts);
    });
    // Brighter colours than a screen has keep their brightness.
    const scale = Math.max(1, ...field.value);
    const color = input(`${id}-color`, "color", hexOf(field.value.map((value) => value / scale)), { ariaLabel: `${field.name}: colour`, title: "Colour" });
    const send = () => set(`(${parts.map(written).join(", ")})`);
    for (const part of parts) part.addEventListener("change", send);
    color.addEventListener("input", () => {
      lightFactor({ factor: scale, color: color.value }).forEach((value, channel) => setNumber(parts[channel], rounded(value, 4)));
      send();
    });
    return element("span", "with-color rgb", ...parts, color);
  },
  vector(field, set, id) {
    const parts = field.value.map((value, axis) => {
      const facts = { step: "any", ariaLabel: `${field.name}, ${"xyz"[axis]}` };
      return numberInput(axis ? `${id}-${axis}` : id, value, ROOM, facts, field.is_double);
    });
    const send = () => {
      if (parts.every((part) => part.value !== "" && part.checkValidity())) set(`(${parts.map(written).join(", ")})`);
      else tell(`${field.name}: a number for each axis.`, true);
    };
    for (const part of parts) part.addEventListener("change", send);
    return element("span", "vector", ...parts);
  },
  texture(field, set, id) {
    const select = element("select");
    select.id = id;
    const others = field.constant === null ? [] : [field.constant === "None" ? "None" : "constant"];
    const names = field.value === "None" ? ["None", ...field.names] : [...field.names, ...others];
    select.append(...names.map((name) => new Option(name, name)));
    select.value = field.value;
    const text = (name) => (field.template ?? "{}").replace("{}", `${name}()`);
    select.addEventListener("change", () => {
      if (select.value === field.value) return;
      set(["None", "constant"].includes(select.value) ? field.constant : text(select.value));
    });
    return select;
  },
  choice(field, set, id) {
    const select = element("select");
    select.id = id;
    select.append(...field.names.map((name) => new Option(name, name)));
    select.value = field.value;
    select.addEventListener("change", () => set(select.value));
    return select;
  },
  text(field, set, id) {
    const text = input(id, "text", field.value, { spellcheck: false, title: field.value ?? "" });
    text.addEventListener("change", () => set(text.value));
    return text;
  },
  part(field, set, id) {
    if (!field.is_removable) return element("span", "fact", field.value ?? "");
    const button = element("button", "", "Remove");
    Object.assign(button, { id, type: "button" });
    button.addEventListener("click", () => set("None"));
    return button;
  },
  absent(field, set, id) {
    const button = element("button", "", "Add");
    Object.assign(button, { id, type: "button" });
    button.addEventListener("click", () => set("()"));
    return button;
  },
  fixed(field, set, id) {
    return input(id, "text", field.why, { disabled: true, title: field.why });
  },
};

/** Puts a pattern in the place of a constant. */
function textureSelect(field, set, id) {
  const select = element("select");
  select.id = id;
  select.ariaLabel = `${field.name}: a constant or a pattern`;
  select.append(...["constant", ...field.textures].map((name) => new Option(name, name)));
  select.addEventListener("change", () => {
    if (select.value !== "constant") set(`${select.value}()`);
  });
  return select;
}

/** The nearest colour of a screen, as the browser's control writes it. */
function hexOf(linear) {
  const encoded = linear.map((part) => (part <= 0.0031308 ? 12.92 * part : 1.055 * part ** (1 / 2.4) - 0.055));
  return `#${encoded.map((part) => Math.round(255 * Math.max(0, Math.min(1, part))).toString(16).padStart(2, "0")).join("")}`;
}

/** Shows how many values are changed, and whether they can be saved. */
function showEdits() {
  const number = state.edits.length;
  const why = number === 0 ? "No value was changed here" : "Only .ron files can be changed: copy the command instead";
  byId("edits-state").textContent = number === 0 ? "" : `${number} changed ${number === 1 ? "value" : "values"}, not in the file yet.`;
  byId("edits-state").title = state.edits.join("\n");
  enable("save-edits", number > 0 && state.can_save_edits, why, "Write the changed values into the scene's file; its other text stays as it is");
  for (const id of ["undo", "undo-all"]) enable(id, number > 0, "No value was changed here", "");
}

/** Greys out a control with the reason, or enables it. */
function enable(id, isEnabled, why, title) {
  const control = byId(id);
  control.disabled = !isEnabled;
  control.title = isEnabled ? title : why;
  if (control.closest("label")) control.closest("label").title = control.title;
  control.setAttribute("aria-description", isEnabled ? "" : why);
}

// What is picked: its form, and its outline over the image.

/** Picks what is at a pixel; of several clicks, the last one counts. */
const pick = newestOnly(async ([x, y]) => {
  const { entity, material } = await (await request("/pixel", { x, y })).json();
  picked = entity;
  askForOutline();
  if (entity === null) return;
  byId("picked").textContent = entity;
  showPickedForms([]);
  takeTargets(await askServer({ forms: true }));
  const has = (kind, name) => targets.find((it) => it.kind === kind && it.name === name);
  const found = has("light", entity) ?? has("material", entity) ?? has("material", material) ?? has("shape", entity) ?? has("transform", entity);
  showPickedForms([has("light", entity), has("material", entity) ?? has("material", material), has("shape", entity), has("transform", entity)]);
  byId("picked-fact").textContent = found ? "" : "It has no values to change here.";
  if (found) chooseForm(found.statement);
});

/** A button for each form about what is picked. */
function showPickedForms(forms) {
  const button = ({ kind, statement }) => {
    const made = element("button", "", kind);
    made.type = "button";
    made.addEventListener("click", () => chooseForm(statement));
    return made;
  };
  byId("picked-forms").replaceChildren(...forms.filter((it) => it).map(button));
}

const askForOutline = newestOnly(async () => {
  const canvas = byId("outline");
  canvas.hidden = picked === null;
  byId("picked-row").hidden = picked === null;
  if (picked === null) return;
  const response = await request("/outline", { entity: picked });
  const [width, height] = ["X-Width", "X-Height"].map((name) => Number(response.headers.get(name)));
  const kinds = new Uint8Array(await response.arrayBuffer());
  const pixels = new ImageData(width, height);
  // White inside and black outside, so that it is visible on every ground.
  kinds.forEach((kind, index) => {
    if (kind > 0) pixels.data.set(kind === 1 ? [255, 255, 255, 255] : [0, 0, 0, 200], 4 * index);
  });
  Object.assign(canvas, { width, height });
  canvas.getContext("2d").putImageData(pixels, 0, 0);
  chooseScaling();
});

let outlineKey = "";

/** The outline moves with the camera. */
function followOutline() {
  const key = `${state.generation} ${state.shown[0]}`;
  if (picked !== null && key !== outlineKey) askForOutline();
  outlineKey = key;
}

function unpick() {
  picked = null;
  askForOutline();
}

function connectForms() {
  on("form-of", "change", (event) => chooseForm(event.target.value));
  on("edit-panel", "toggle", refreshForms);
  on("form", "input", () => (isTyping = true));
  on("form", "change", redrawForm);
  on("form", "focusout", redrawForm);
  on("save-edits", "click", () => send({ save_edits: true }));
  on("undo", "click", () => undo("last"));
  on("undo-all", "click", () => undo("all"));
  on("unpick", "click", unpick);
}

function undo(which) {
  formText = "";
  send({ undo: which });
}
