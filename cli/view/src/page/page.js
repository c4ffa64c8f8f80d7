// The page: what it shows at a time, and when it draws.

// `wanted`: the time that was chosen, none for the end of the run; `time`: the one that is shown, which no run is too short for.
const view = { time: 0, wanted: null, due: false, after: [], isPlaying: false };

// Names of the variables that are shown somewhere.
function wantedNames() {
  const names = new Set(plots.chosen);
  if (plots.figure) for (const plot of plots.figure.plots) for (const curve of plot.curves) { names.add(curve.y); if (curve.x !== "time") names.add(curve.x); }
  for (const label of picture.labels) label.names.forEach((name) => names.add(name));
  for (const { own, value } of [...lists.rows, ...lists.treeRows]) if (value.isConnected) names.add(own.n);
  return names;
}

// Draws all at the next frame, once.
function redraw(after) {
  if (after) view.after.push(after);
  if (view.due) return;
  view.due = true;
  requestAnimationFrame(() => {
    view.due = false;
    const [from, to] = span();
    view.time = Math.min(to, Math.max(from, view.wanted === null ? to : view.wanted));
    const slider = document.getElementById("time");
    slider.value = to > from ? Math.round((view.time - from) / (to - from) * 1000) : 0;
    const [per, unit] = perSecond(from, to), isEmpty = !allRuns().some((run) => run.times.length);
    const words = isEmpty ? "no rows" : "t = " + short(view.time * per) + " " + unit;
    slider.disabled = document.getElementById("play").disabled = isEmpty;
    document.getElementById("now").textContent = words;
    slider.setAttribute("aria-valuetext", words);
    drawPlots();
    drawShots();
    drawValues();
    drawLists();
    view.after.splice(0).forEach((own) => own());
  });
}

function setTime(time) {
  view.time = view.wanted = time;
  redraw();
}

// Runs through the time in a few seconds.
function play(isOn) {
  const button = document.getElementById("play");
  view.isPlaying = isOn;
  button.textContent = isOn ? "pause" : "play";
  button.setAttribute("aria-pressed", String(isOn));
  if (!isOn) return;
  const LENGTH = 6000;
  let last = performance.now();
  const [from, to] = span();
  if (view.time >= to) view.time = from;
  const step = (now) => {
    if (!view.isPlaying) return;
    const [first, end] = span();
    view.time += (now - last) / LENGTH * (end - first);
    last = now;
    if (view.time >= end) { setTime(end); play(false); return; }
    setTime(view.time);
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}

function begin() {
  const { model } = DATA, about = [];
  if (DATA.failed) {
    document.querySelector("main").hidden = true;
    document.getElementById("clock").hidden = true;
    const about = document.getElementById("about"), set = [...address.set].map(([name, value]) => name + " = " + value).join(", ");
    about.textContent = set ? "The model cannot be translated with " + set + ". " : "It cannot be shown as it is now; load the page again when it is mended.";
    if (set) about.append(element("button", { type: "button", onclick: () => load(new Map(), "") }, "translate it without"));
    say(DATA.failed);
    return;
  }
  if (model) about.push(model.file);
  const own = model && entry(model.classes, model.name);
  if (own && own.description) about.unshift(own.description);
  document.getElementById("about").textContent = about.join(" · ");
  beginRuns();
  beginShots();
  beginNext();
  beginPlots();
  beginDiagram();
  beginLists();
  document.getElementById("time").oninput = (event) => {
    const [from, to] = span();
    play(false);
    setTime(from + Number(event.target.value) / 1000 * (to - from));
  };
  document.getElementById("play").onclick = () => play(!view.isPlaying);
  document.getElementById("clock").hidden = !DATA.variables.length;
  window.addEventListener("resize", () => { picture.scale = null; fit(); redraw(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { colors.clear(); redraw(); });
  if (model) openDiagram(diagramOf(address.left.shown) ? address.left.shown : "");
  if (model && DATA.variables.some((own) => own.path === address.left.path)) select(address.left.path);
  const changed = address.left.field && document.getElementById("p-" + address.left.field);
  if (changed) changed.focus();
  if (model && model.openEnds.length) say("This is a component: it cannot be run by itself, as nothing is connected to " + model.openEnds.join(", ") + ".");
  tellRun();
  if (canRun) runModel(); else fillIn();
  if (isChanged()) runShots();
  redraw();
}

begin();
