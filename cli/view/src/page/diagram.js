// The diagram: which part is looked at, how large it is, values at connections and parts.

const picture = { shown: null, labels: [], scale: null };
// Letters of names are 13 pixels high at the natural size; much smaller ones nobody reads.
const LEAST_SCALE = 0.85;
const SVG = "http://www.w3.org/2000/svg";

function diagramOf(path) {
  return DATA.model ? DATA.model.diagrams.find((own) => own.path === path) || null : null;
}

// Shows the inside of a component.
function openDiagram(path) {
  const diagram = diagramOf(path);
  if (!diagram) return;
  picture.shown = diagram;
  const place = document.getElementById("drawing");
  // The text is made by hyd, with everything that comes from models escaped.
  place.innerHTML = diagram.svg;
  for (const part of place.querySelectorAll(".part")) {
    const own = diagram.parts[Number(part.dataset.part)];
    part.addEventListener("click", () => select(own.path));
    part.addEventListener("dblclick", () => openDiagram(own.path));
    part.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      select(own.path);
      document.getElementById("component-title").focus();
    });
  }
  colourFinding(diagram, place);
  // Beside all parts: the whole.
  place.querySelector("svg").addEventListener("click", (event) => { if (!event.target.closest(".part")) select(path); });
  for (const port of place.querySelectorAll("[data-name]")) {
    port.addEventListener("pointerenter", () => { document.getElementById("hint").textContent = "connector " + port.dataset.name; });
  }
  picture.labels = labels(diagram, place);
  const names = path ? path.split(/\.(?![^[]*\])/) : [], way = document.getElementById("way");
  const steps = [["", DATA.model.name], ...names.map((name, k) => [names.slice(0, k + 1).join("."), name])];
  way.replaceChildren(...steps.flatMap(([to, name], k) => {
    const isHere = k === steps.length - 1, lead = () => (isHere ? select(to) : openDiagram(to));
    const own = diagramOf(to) ? element("button", { type: "button", "aria-current": isHere ? "location" : null, onclick: lead }, name) : element("span", {}, name);
    return k ? [element("span", { "aria-hidden": "true" }, "›"), own] : [own];
  }));
  const hints = [];
  if (DATA.model.unit && !path) hints.push("A unit of another tool: nobody sees its inside.");
  else if (!diagram.parts.length) hints.push("The model has no components that a diagram could show.");
  else hints.push("Click a part for what it is" + (diagram.parts.some((part) => diagramOf(part.path)) ? ", twice to look inside." : "."));
  if (DATA.model.cut) hints.push("The model has more parts than this page draws.");
  document.getElementById("hint").textContent = hints.join(" ");
  picture.scale = null;
  fit();
  // What would explain the most is seen first.
  const best = place.querySelector(".part.lacking.best");
  place.scrollLeft = 0; place.scrollTop = 0;
  if (best) reveal(best);
  select(path, true);
  fillIn();
  redraw();
}

// Parts are coloured by the most that something in them would explain; small shares are seen, too.  Where nothing explains what a name needs, chance does.
function colourFinding(diagram, place) {
  if (!DATA.finding || !explainsMore(DATA.finding)) return;
  const { places } = DATA.finding, top = Math.max(...places.map((one) => one.score), 0);
  for (const node of place.querySelectorAll(".part")) {
    const own = diagram.parts[Number(node.dataset.part)], most = Math.max(0, ...places.filter((one) => isAt(one, own.path)).map((one) => one.score));
    if (!(most > 0)) continue;
    node.classList.add("lacking");
    node.classList.toggle("best", most === top);
    node.style.setProperty("--share", Math.sqrt(most / top).toFixed(3));
    node.setAttribute("aria-label", node.getAttribute("aria-label") + ", would explain up to " + Math.round(100 * most / top) + " % of what the best place does");
  }
}

// What of a diagram that is larger than its place is in view, as a small picture of its parts under a frame; whoever drags the frame moves the diagram.
// By keys the diagram itself is scrolled, so for others this picture says nothing new.
const overview = { frame: null, of: null };

function layOverview() {
  const place = document.getElementById("drawing"), box = document.getElementById("overview"), own = place.querySelector("svg.diagram");
  const isLarge = Boolean(own) && (place.scrollWidth > place.clientWidth + 1 || place.scrollHeight > place.clientHeight + 1);
  box.hidden = !isLarge;
  if (!isLarge) return;
  if (overview.of !== own) {
    overview.of = own;
    const { width, height } = own.viewBox.baseVal, outer = own.getBoundingClientRect(), scale = width / outer.width;
    const parts = [...own.querySelectorAll(".part")].map((part) => {
      const at = part.getBoundingClientRect(), small = document.createElementNS(SVG, "rect");
      const sizes = { x: (at.left - outer.left) * scale, y: (at.top - outer.top) * scale, width: at.width * scale, height: at.height * scale };
      for (const [name, value] of Object.entries(sizes)) small.setAttribute(name, value.toFixed(1));
      small.classList.toggle("lacking", part.classList.contains("lacking"));
      small.style.setProperty("--share", part.style.getPropertyValue("--share") || "0");
      return small;
    });
    const svg = document.createElementNS(SVG, "svg"), frame = document.createElementNS(SVG, "rect");
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.style.height = Math.max(16, Math.min(90, box.clientWidth * height / width)) + "px";
    frame.classList.add("frame");
    svg.append(...parts, frame);
    const move = (event) => {
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      place.scrollLeft = at.x / width * place.scrollWidth - place.clientWidth / 2;
      place.scrollTop = at.y / height * place.scrollHeight - place.clientHeight / 2;
    };
    svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); move(event); });
    svg.addEventListener("pointermove", (event) => { if (event.buttons) move(event); });
    box.replaceChildren(svg);
    overview.frame = frame;
  }
  const { width, height } = own.viewBox.baseVal, part = (from, room, whole, all) => [all * from / whole, all * Math.min(1, room / whole)];
  const [x, across] = part(place.scrollLeft, place.clientWidth, place.scrollWidth, width), [y, down] = part(place.scrollTop, place.clientHeight, place.scrollHeight, height);
  for (const [name, value] of Object.entries({ x, y, width: across, height: down })) overview.frame.setAttribute(name, value.toFixed(1));
}

// Scrolls the diagram to a part that is not wholly in view; the page stays where it is.
function reveal(node) {
  const place = document.getElementById("drawing"), outer = place.getBoundingClientRect(), own = node.getBoundingClientRect();
  if (own.left < outer.left || own.right > outer.left + place.clientWidth) place.scrollLeft += own.left + own.width / 2 - outer.left - place.clientWidth / 2;
  if (own.top < outer.top || own.bottom > outer.top + place.clientHeight) place.scrollTop += own.top + own.height / 2 - outer.top - place.clientHeight / 2;
}

// The size that fits, but not so small that nobody reads it.
function fit() {
  const svg = document.querySelector("svg.diagram"), place = document.getElementById("drawing");
  if (!svg) return;
  const natural = picture.shown.width, room = place.clientWidth - 4;
  if (picture.scale === null) picture.scale = Math.max(Math.min(1, room / natural), LEAST_SCALE);
  svg.style.width = natural * picture.scale + "px";
  layOverview();
}

function resize(factor) {
  const place = document.getElementById("drawing");
  if (factor === null) picture.scale = picture.shown ? Math.min(1.6, (place.clientWidth - 4) / picture.shown.width) : null;
  else picture.scale = Math.min(6, Math.max(0.2, (picture.scale || 1) * factor));
  fit();
}

// Which text shows which variable: of several connections of one place only the first.
function labels(diagram, place) {
  const found = [], taken = new Set();
  for (const text of place.querySelectorAll("text.value")) {
    if (text.dataset.wire !== undefined) {
      const name = diagram.wires[Number(text.dataset.wire)].values.find((own) => byName.has(own) && !byName.get(own).v || (byName.get(own) || {}).v === "discrete");
      const own = name && byName.get(name), key = own && (own.o ? "o" + own.o : name);
      if (!name || taken.has(key)) continue;
      taken.add(key);
      found.push({ text, names: [name], plain: true });
    } else {
      const part = diagram.parts[Number(text.dataset.part)];
      if (part.connector) continue;
      // States of the part itself; what moves deeper inside has a diagram of its own.
      const own = DATA.model.states.filter((name) => byName.has(name) && parted(name)[0] === part.path).slice(0, Number(text.dataset.states));
      if (own.length) found.push({ text, names: own, plain: false, path: part.path });
    }
  }
  return found;
}

function drawValues() {
  const on = document.getElementById("show-values").checked, run = mainRun();
  for (const { text, names, plain, path } of picture.labels) {
    let words = "";
    if (on && run && run.times.length) {
      const one = (name) => {
        const own = byName.get(name), value = withUnit(valueAt(run, name, view.time), own.u, own.k);
        return plain ? value : name.slice(path.length + 1) + " = " + value;
      };
      words = names.map(one).join(", ");
    }
    if (text.textContent !== words) text.textContent = words;
  }
}

function beginDiagram() {
  const section = document.getElementById("picture");
  section.hidden = !DATA.model;
  document.getElementById("component").hidden = !DATA.model;
  if (!DATA.model) return;
  document.getElementById("smaller").onclick = () => resize(1 / 1.25);
  document.getElementById("larger").onclick = () => resize(1.25);
  document.getElementById("whole").onclick = () => resize(null);
  document.getElementById("drawing").addEventListener("scroll", layOverview);
  document.getElementById("show-values").onchange = () => redraw();
}
