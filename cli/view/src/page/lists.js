// Lists: what a component is, its parameters as sliders, its variables; and the tree of all variables.

const lists = {
  // The component whose parameters and variables are shown.
  path: "",
  // Names of the variables whose values are shown, with where.
  rows: [], treeRows: [],
  parameters: [],
};
const MOST_ROWS = 200;
const STEPS = 1000;

// Elements directly in a component, in the order of the text.
const childrenOf = new Map();
const componentsIn = new Map();

// `a.b[1].c` and `der(a.b[1].c)` stand in `a.b[1]`, called `c` and `der(c)`.
function parted(name) {
  let plain = name, orders = 0;
  for (let found; (found = /^der\((.*)\)$/.exec(plain)); orders += 1) plain = found[1];
  let depth = 0, cut = -1;
  for (let k = 0; k < plain.length; k += 1) {
    if (plain[k] === "[" || plain[k] === "(") depth += 1;
    else if (plain[k] === "]" || plain[k] === ")") depth -= 1;
    else if (plain[k] === "." && depth === 0) cut = k;
  }
  const last = plain.slice(cut + 1);
  return [cut < 0 ? "" : plain.slice(0, cut), "der(".repeat(orders) + last + ")".repeat(orders)];
}

function beginLists() {
  for (const own of DATA.variables) {
    const [path, last] = parted(own.n);
    own.path = path; own.last = last;
    if (!childrenOf.has(path)) childrenOf.set(path, []);
    childrenOf.get(path).push(own);
    for (let inner = path; inner; ) {
      const [outer] = parted(inner);
      if (!componentsIn.has(outer)) componentsIn.set(outer, new Set());
      if (componentsIn.get(outer).has(inner)) break;
      componentsIn.get(outer).add(inner);
      inner = outer;
    }
  }
  document.getElementById("filter").oninput = layTree;
  document.getElementById("with-protected").onchange = () => { layTree(); select(lists.path); };
  document.getElementById("variables").hidden = !DATA.variables.length;
  document.getElementById("plots").hidden = !DATA.variables.length;
  layTree();
}

function isListed(own) {
  return !own.x || document.getElementById("with-protected").checked;
}

// A variable with a box to draw it and its value.
function row(own, label, into) {
  const value = element("span", { class: "v" });
  const box = element("input", { type: "checkbox", "data-draw": own.n, onchange: (event) => choose(own.n, event.target.checked) });
  box.checked = plots.chosen.includes(own.n);
  into.push({ own, value });
  const parts = [element("label", {}, box, " " + label), value];
  if (own.d) parts.push(element("span", { class: "d" }, own.d));
  return element("li", {}, ...parts);
}

function rowsOf(variables, label, into) {
  const list = element("ul", { class: "rows" }, ...variables.slice(0, MOST_ROWS).map((own) => row(own, label(own), into)));
  if (variables.length > MOST_ROWS) list.append(element("li", { class: "more" }, variables.length - MOST_ROWS + " more; the filter finds them"));
  return list;
}

// The tree, or what the filter finds.
function layTree() {
  const words = document.getElementById("filter").value.trim().toLowerCase().split(/\s+/).filter(Boolean);
  const place = document.getElementById("tree"), found = document.getElementById("found");
  lists.treeRows = [];
  if (words.length) {
    const fits = (own) => words.every((word) => own.n.toLowerCase().includes(word) || (own.d || "").toLowerCase().includes(word) || (own.u || "").toLowerCase() === word);
    const matching = DATA.variables.filter((own) => isListed(own) && fits(own));
    place.replaceChildren(rowsOf(matching, (own) => own.n, lists.treeRows));
    found.textContent = matching.length === 1 ? "1 variable" : matching.length + " variables";
  } else {
    place.replaceChildren(...branch(""));
    found.textContent = DATA.leftOut ? DATA.leftOut + " variables are left out of this page" : "";
  }
  fillIn();
  redraw();
}

// What is in a component: its variables, and the components in it, which fill themselves when they are opened.
function branch(path) {
  const own = (childrenOf.get(path) || []).filter(isListed), parts = [];
  for (const inner of componentsIn.get(path) || []) {
    const box = element("div", { class: "inner" }), node = element("details", {}, element("summary", {}, parted(inner)[1]), box);
    node.addEventListener("toggle", () => {
      if (!node.open || box.firstChild) return;
      box.append(...branch(inner));
      fillIn();
      redraw();
    });
    parts.push(node);
  }
  if (own.length) parts.push(rowsOf(own, (one) => one.last, lists.treeRows));
  return parts;
}

// Shows what a component is.
function select(path, quietly) {
  if (!DATA.model) return;
  lists.path = path;
  const shown = picture.shown, part = shown ? shown.parts.find((own) => own.path === path) : null;
  for (const node of document.querySelectorAll("svg.diagram .part")) {
    const isChosen = shown.parts[Number(node.dataset.part)].path === path;
    node.classList.toggle("chosen", isChosen);
    if (isChosen) reveal(node);
  }
  const diagram = diagramOf(path), className = part ? part.class : diagram ? diagram.class : "", known = entry(DATA.model.classes, className);
  document.getElementById("component-title").textContent = path || DATA.model.name;
  const about = document.getElementById("about-component");
  about.replaceChildren();
  const describe = (part && part.description) || (known && known.description);
  if (describe) about.append(element("p", {}, describe));
  if (className && path) about.append(element("p", { class: "pale" }, (known ? known.kind + " " : "") + className));
  if (diagram && diagram !== shown) about.append(element("p", {}, element("button", { type: "button", onclick: () => { openDiagram(path); document.getElementById("drawing").focus(); } }, "look inside " + path)));
  layAbout(path);
  layFinding(path);
  layParameters(path);
  lists.rows = [];
  const inside = DATA.variables.filter((own) => (own.path === path || isConnectorOf(own, path)) && own.v !== "parameter" && own.v !== "constant" && isListed(own));
  const from = path ? path.length + 1 : 0, labelled = (own) => own.n.replace(/^((?:der\()*)/, "$1\u0000").split("\u0000").map((text, k) => (k ? text.slice(from) : text)).join("");
  document.getElementById("values").replaceChildren(rowsOf(inside, labelled, lists.rows));
  document.getElementById("values-part").hidden = !inside.length;
  layTexts(path, part, known);
  fillIn();
  if (!quietly) redraw();
}

// Where what is said of a component stands below the diagram, as on a narrow screen, a way there and back.
function layAbout(path) {
  const section = document.getElementById("component"), chosen = document.getElementById("chosen"), title = document.getElementById("component-title");
  const isBelow = path && section.getBoundingClientRect().left < chosen.getBoundingClientRect().right;
  const way = (words, to, focused) => element("button", { type: "button", onclick: () => { to.scrollIntoView(); focused.focus({ preventScroll: true }); } }, words);
  chosen.replaceChildren(...(isBelow ? [way("what " + path + " is", title, title)] : []));
  if (isBelow) document.getElementById("about-component").prepend(element("p", {}, way("back to the diagram", document.getElementById("picture"), document.getElementById("drawing"))));
}

// What a search says of a component and of what is in it: what was named, and what the terms and effects at its places would explain.
const MOST_PLACES = 12;
function isWithin(inner, outer) {
  return outer === "" || inner === outer || inner.startsWith(outer + ".") || inner.startsWith(outer + "[");
}

// What passes between two components is a finding at both.
const componentsOf = (one) => one.components || [one.component || ""];
const isAt = (one, path) => componentsOf(one).some((own) => isWithin(own, path));

// True where something is missing: a model that is adequate has places that explain most, too.
const explainsMore = ({ status, needed, places }) => status !== "adequate" && places.some((one) => one.score >= (needed || 0));

function layFinding(path) {
  const box = document.getElementById("finding"), { finding } = DATA;
  box.hidden = !finding;
  if (!finding) return;
  const own = finding.places.filter((one) => isAt(one, path)), top = Math.max(...finding.places.map((one) => one.score), 0);
  const words = explainsMore(finding) ? "What seems to be missing here" : "Nothing seems to be missing here: no place explains more than chance does";
  box.replaceChildren(element("p", {}, element("b", {}, path ? words : finding.sentence)));
  for (const one of finding.named.filter((named) => isAt(named, path))) {
    const sizes = Object.entries(one.parameters).map(([name, size]) => name + " = " + measured(size));
    box.append(element("p", {}, "Named: " + one.words + " at " + one.component + ", " + sizes.join(", ")));
  }
  if (!own.length) { box.append(element("p", { class: "pale" }, "Nothing at this place explains a part of the gap.")); return; }
  const place = (one) => {
    const bar = element("i", {});
    bar.style.width = 100 * Math.max(0, one.score) / top + "%";
    const what = one.effect ? (one.equation ? one.equation + " (" + one.effect + ")" : one.effect) : short(one.coefficient) + "*" + rounded(String(one.shape)) + (one.unit && one.unit !== "1" ? " " + one.unit : "") + " in " + one.equation;
    const names = componentsOf(one).flatMap((own, k) => {
      const where = diagramOf(parted(own)[0]), words = own || DATA.model.name;
      return [...(k ? [" and "] : []), where ? element("button", { type: "button", onclick: () => { openDiagram(where.path); select(own); } }, words) : words];
    });
    return element("li", {}, element("span", { class: "heat" }, bar), ...names, " ", element("code", {}, what), element("span", { class: "pale" }, ", drop of the cost " + short(one.score, 3)));
  };
  box.append(element("ul", {}, ...own.slice(0, MOST_PLACES).map(place)));
  const more = own.slice(MOST_PLACES);
  if (more.length) box.append(element("details", {}, element("summary", {}, more.length + " more places"), element("ul", {}, ...more.map(place))));
}

// Variables of the connectors of a component count as its own: those one level further in that hold no components.
function isConnectorOf(own, path) {
  return path !== "" && own.path !== path && parted(own.path)[0] === path && !componentsIn.has(own.path) && !diagramOf(own.path) && !isPart(own.path, path);
}

// True for what a diagram shows as a part of a component.
function isPart(path, inside) {
  const diagram = diagramOf(inside);
  return Boolean(diagram && diagram.parts.some((part) => part.path === path && !part.connector));
}

function layTexts(path, part, known) {
  const equations = (entry(DATA.model.equations, path) || []), place = document.getElementById("equations");
  place.replaceChildren(...equations.map(([text, file, line]) => element("div", { class: "equation" }, element("code", {}, text), element("small", {}, file + ":" + line))));
  document.getElementById("equations-part").hidden = !equations.length;
  const text = document.getElementById("text");
  text.replaceChildren();
  if (part && part.text) text.append(element("p", { class: "pale" }, "declared in " + part.file + ":" + part.line), element("pre", { tabindex: "0" }, part.text));
  if (known) text.append(element("p", { class: "pale" }, known.file + ":" + known.line), element("pre", { tabindex: "0" }, known.text));
  document.getElementById("text-part").hidden = !text.firstChild;
  const info = document.getElementById("info");
  // Made by hyd of known tags without attributes.
  info.innerHTML = known ? known.info : "";
  document.getElementById("info-part").hidden = !info.firstChild;
}

// From where to where a slider goes: as the text says, else around the value.
function limitsOf(own, value) {
  // Around nothing: as far as a run is long for times, else by one.
  const size = Math.abs(value) || (own.u === "s" ? DATA.model.length / 2 : 0.5);
  let low = own.lo, high = own.hi;
  if (low === undefined || value - low > 100 * size) low = value > 0 ? 0 : -2 * size;
  if (high === undefined || high - value > 100 * size) high = value < 0 && own.hi === undefined ? 0 : 2 * size;
  if (own.lo !== undefined) low = Math.max(low, own.lo);
  if (own.hi !== undefined) high = Math.min(high, own.hi);
  if (!(low < high)) high = low + size;
  if (own.k === "Integer") { low = Math.floor(low); high = Math.ceil(high); }
  return [Math.min(low, value), Math.max(high, value)];
}

function layParameters(path) {
  const place = document.getElementById("parameters"), values = DATA.model.parameters;
  const own = DATA.variables.filter((one) => one.path === path && one.v === "parameter" && isListed(one));
  lists.parameters = [];
  const made = own.slice(0, MOST_ROWS).map((one) => parameter(one, one.p && values.length > one.p[0] ? values[one.p[0]] * one.p[1] : one.c));
  place.replaceChildren(...made);
  if (canRun && own.some((one) => one.s !== undefined)) place.append(element("p", {}, element("button", { type: "button", onclick: resetParameters }, "all as the model says")));
  document.getElementById("parameters-part").hidden = !own.length;
}

// A parameter: its name, a field for its value, and a slider where it is a number that may be set.
function parameter(own, model, prefix = "p-") {
  const id = prefix + own.n, now = entry(runs.set, own.n) ?? null, shot = inShot(own.n);
  const known = { true: 1, false: 0 }, inNumbers = shot === null ? NaN : Array.isArray(own.k) ? own.k.indexOf(shot) + 1 : shot in known ? known[shot] : Number(shot);
  const original = Number.isFinite(inNumbers) && (!Array.isArray(own.k) || inNumbers > 0) ? inNumbers : model;
  const numeric = now === null || own.k === "Boolean" || Array.isArray(own.k) ? original : Number(now);
  const name = element("label", { class: "name", for: id }, own.last, ...(own.d ? [element("small", {}, own.d)] : []), ...(shot !== null ? [element("small", {}, "as in shot " + chosenShot().number)] : []));
  const unit = element("span", { class: "unit" }, own.u && own.u !== "1" ? own.u : "");
  const box = element("div", { class: "parameter" + (now === null ? "" : " changed") }, name);
  const isStructural = isServed && own.s === 0 && original !== undefined;
  if (!isStructural && (!canRun || own.s !== 1 || original === undefined)) {
    // What cannot be set reads as elsewhere, with its unit beside the number.
    unit.textContent = "";
    const fixed = element("output", { id, class: "fixed" }, withUnit(original, own.u, own.k));
    box.append(fixed);
    lists.parameters.push({ own, show: () => { const value = valueAt(mainRun(), own.n, view.time); if (Number.isFinite(value)) fixed.textContent = withUnit(value, own.u, own.k); } });
    return box;
  }
  if (isStructural) {
    name.append(element("small", {}, "decides sizes or structure: the model is translated again"));
    box.classList.toggle("changed", address.set.has(own.n));
  }
  const change = (text) => {
    if (isStructural) { translateAgain(own.n, text); return; }
    runs.set[own.n] = text;
    box.classList.add("changed");
    runModel();
    runShots();
  };
  if (own.k === "Boolean") {
    const field = element("input", { type: "checkbox", id, onchange: (event) => change(String(event.target.checked)) });
    field.checked = now === null ? original > 0.5 : now === "true";
    box.append(field, unit);
    return box;
  }
  if (Array.isArray(own.k)) {
    const field = element("select", { id, onchange: (event) => change(event.target.value) }, ...own.k.map((literal) => element("option", { value: literal }, literal)));
    field.value = now === null ? own.k[Math.round(original) - 1] : now;
    box.append(field, unit);
    return box;
  }
  const isWhole = own.k === "Integer";
  if (isStructural) {
    const field = element("input", { type: "number", id, step: isWhole ? 1 : "any", value: numeric });
    // Not while a number is being typed: a translation may take seconds.
    field.addEventListener("change", () => { if (field.value.trim() !== "" && Number.isFinite(Number(field.value))) change(String(Number(field.value))); });
    box.append(field, unit);
    return box;
  }
  // The same parameter elsewhere on the page follows when the slider is let go.
  const follow = () => { if (prefix === "p-") { if (DATA.shots) { laySizes(); laySlack(); } } else { layParameters(lists.path); laySlack(); } };
  const { field, slider } = sliding({ id, label: own.n + " by slider", range: limitsOf(own, original), value: numeric, isWhole, words: (value) => withUnit(value, own.u, own.k), change: (value) => change(String(value)), follow });
  box.append(field, unit, slider);
  return box;
}

// A field and a slider for one number; both follow each other.  `limits`: what may be typed, where that is not any number.
function sliding({ id, label, range: [low, high], limits, value: first, isWhole, words, change, follow }) {
  const field = element("input", { type: "number", id, step: isWhole ? 1 : "any", min: limits ? limits[0] : null, max: limits ? limits[1] : null, value: typed(first) });
  const slider = element("input", { type: "range", min: 0, max: isWhole ? high - low : STEPS, step: 1, "aria-label": label });
  const count = Number(slider.max), place = (value) => { slider.value = Math.round((value - low) / (high - low) * count); };
  const tell = (value) => slider.setAttribute("aria-valuetext", words(value));
  place(first); tell(first);
  slider.addEventListener("input", () => {
    const value = low + Number(slider.value) / count * (high - low), written = isWhole ? Math.round(value) : Number(value.toPrecision(6));
    field.value = typed(written); tell(written);
    change(written);
  });
  field.addEventListener("input", () => {
    const value = Number(field.value);
    if (field.value.trim() === "" || !Number.isFinite(value) || (limits && !(limits[0] <= value && value <= limits[1]))) return;
    place(value); tell(value);
    change(value);
  });
  slider.addEventListener("change", follow);
  field.addEventListener("change", follow);
  return { field, slider };
}

function resetParameters() {
  runs.set = {};
  runs.off = {};
  if (address.set.size) { load(new Map(), ""); return; }
  layParameters(lists.path);
  if (DATA.shots) layShots();
  runModel();
  runShots();
}

function drawLists() {
  const run = mainRun();
  for (const { own, value } of [...lists.rows, ...lists.treeRows]) {
    if (!value.isConnected) continue;
    const words = withUnit(valueAt(run, own.n, view.time), own.u, own.k);
    if (value.textContent !== words) value.textContent = words;
  }
  for (const one of lists.parameters) one.show();
}
