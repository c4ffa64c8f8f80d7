// Shots of a bench: how far the model is from what was measured, shot by shot, and the curves of one of them beside its samples.

const bench = {
  // The shot whose curves are shown, and whether the model runs under its conditions.
  chosen: 0, isRun: false,
  // How far each channel of each shot is, and the curves of the chosen shot by channel.
  deviations: [], messages: [], curves: new Map(),
  flying: null, waiting: false, panels: [],
  took: [],
};

function chosenShot() {
  return DATA.shots ? DATA.shots.all[bench.chosen] : null;
}

// The number of the shot under whose conditions the model runs, if it does.
function conditions() {
  return DATA.shots && bench.isRun ? bench.chosen : undefined;
}

// What the shot makes of a parameter, as text; none where it leaves it as it is.
function inShot(name) {
  const shot = bench.isRun && chosenShot();
  const own = shot && shot.set.find(([known]) => known === name), moved = shot ? movedTo(name) : null;
  return moved !== null ? String(moved) : own ? own[1] : null;
}

function beginShots() {
  const { shots } = DATA;
  if (!shots) return;
  bench.isRun = canRun;
  bench.chosen = shots.all[address.left.shot] ? address.left.shot : 0;
  bench.deviations = shots.all.map((shot) => shot.deviations);
  bench.messages = shots.all.map((shot) => shot.message);
  takeFirst();
  document.getElementById("shots").hidden = false;
  layShots();
}

// The curves of a shot as they were before anything was changed.
function takeFirst() {
  bench.curves = new Map(chosenShot().traces.map((trace, k) => [k, trace && trace.now]).filter(([, now]) => now));
}

function layShots() {
  const { all } = DATA.shots, hasFound = all.some((shot) => shot.traces.some((trace) => trace && trace.found !== null));
  const about = "How far the model is from what was measured: root of the mean square, in standard deviations of the noise; 1 is noise" +
    (hasFound ? ". In brackets: of the base model as fitted." : ".");
  document.getElementById("shots-about").textContent = about;
  laySizes();
  layDeviations();
  laySlack();
  layShot();
}

// How large what was found is, as sliders.
function laySizes() {
  const { sizes } = DATA.shots, place = document.getElementById("sizes");
  const known = sizes.map((own) => [own, byName.get(own.name)]).filter(([, variable]) => variable && variable.p);
  place.replaceChildren(...known.flatMap(([own, variable]) => {
    const value = DATA.model.parameters[variable.p[0]] * variable.p[1];
    return [element("p", { class: "pale" }, own.words), parameter({ ...variable, last: own.name }, value, "s-")];
  }));
  if (known.length && canRun) place.append(element("p", {}, element("button", { type: "button", onclick: resetParameters }, "as it was found")));
}

// The table of how far each channel of each shot is.
function layDeviations() {
  const { channels, all } = DATA.shots;
  const cells = (k) => channels.map((channel, c) => {
    const now = bench.deviations[k][c], trace = all[k].traces[c];
    if (!trace) return element("td", {}, "");
    const before = trace.before === null || trace.before === undefined ? "" : " (" + short(trace.before, 3) + ")";
    const bar = element("i", {});
    // From noise to ten times as much on a scale of ratios.
    bar.style.width = (now > 1 ? Math.min(100, 100 * Math.log10(now)) : 0) + "%";
    return element("td", {}, element("span", { class: "heat" }, bar), now === null || now === undefined ? "–" : short(now, 3), element("span", { class: "pale" }, before));
  });
  const row = (shot, k) => {
    const button = element("button", { type: "button", "aria-pressed": String(k === bench.chosen), onclick: () => chooseShot(k) }, "shot " + shot.number);
    return element("tr", {}, element("th", { scope: "row" }, button, shot.heldout ? element("small", {}, " held out") : ""), ...cells(k));
  };
  const head = element("tr", {}, element("th", { scope: "col" }, "shot"), ...channels.map((own) => element("th", { scope: "col", title: own.words }, own.name)));
  const focused = document.activeElement && document.activeElement.closest && document.activeElement.closest("#deviations");
  document.getElementById("deviations").replaceChildren(element("caption", { class: "hidden" }, "Deviation of each channel in each shot"), element("thead", {}, head), element("tbody", {}, ...all.map(row)));
  if (focused) document.querySelector("#deviations button[aria-pressed='true']").focus();
}

// The curves of the chosen shot.
function layShot() {
  const { channels } = DATA.shots, shot = chosenShot(), place = document.getElementById("shot");
  bench.panels = channels.map((channel, k) => ({ channel, k, trace: shot.traces[k], canvas: element("canvas", { role: "img" }) })).filter((panel) => panel.trace);
  const box = element("input", { type: "checkbox", id: "run-shot", onchange: (event) => { bench.isRun = event.target.checked; conditionsChanged(); } });
  box.checked = bench.isRun; box.disabled = Boolean(DATA.model.driven.length);
  const key = (name, words) => element("li", {}, element("span", { class: "key " + name, "aria-hidden": "true" }), words);
  const keys = [key("dots", "measured"), key("now", "the model as its parameters are")];
  if (bench.panels.some((panel) => panel.trace.base)) keys.push(key("base", "the base model as fitted"));
  const failed = bench.messages[bench.chosen];
  place.replaceChildren(
    element("h3", {}, "Shot " + shot.number + (shot.heldout ? ", held out" : "")),
    ...(canRun ? [element("p", {}, element("label", {}, box, " diagram and plots show this shot, too"))] : []),
    ...(!canRun && DATA.model.driven.length ? [element("p", { class: "pale" }, "diagram and plots show shot " + DATA.shots.all[0].number + ", whose inputs were recorded")] : []),
    ...(failed ? [element("p", { class: "failed" }, failed)] : []),
    element("ul", { class: "keys" }, ...keys),
    ...(shot.stride > 1 ? [element("p", { class: "pale" }, "every " + shot.stride + "th sample is drawn; all count")] : []),
    element("div", { id: "channels" }, ...bench.panels.map((panel) => element("figure", {}, element("figcaption", {}, panel.channel.name + (panel.channel.words && panel.channel.words !== panel.channel.name ? ": " + panel.channel.words : "")), panel.canvas))),
  );
}

function chooseShot(k) {
  bench.chosen = k;
  // With other parameters its curves come with the answer.
  if (isChanged()) bench.curves = new Map(); else takeFirst();
  layDeviations();
  laySlack();
  layShot();
  conditionsChanged();
  if (isChanged()) runShots();
}

// The model runs under other conditions: what is set by hand stays.
function conditionsChanged() {
  layParameters(lists.path);
  runModel();
  redraw();
}

// Runs all shots as the parameters are now.
async function runShots() {
  if (!DATA.shots || !canRun) return;
  if (bench.flying) { bench.waiting = true; return; }
  const own = { begin: performance.now(), shot: bench.chosen };
  bench.flying = own;
  try {
    const found = await asked({ set: runs.set, off: runs.off, shot: own.shot }, "/shots");
    if (found.header.status === "done") {
      bench.deviations = found.header.deviations; bench.messages = found.header.messages;
      if (own.shot === bench.chosen) {
        const said = document.querySelector("#shot .failed"), failed = bench.messages[own.shot];
        bench.curves = found.columns;
        if (Boolean(said) !== Boolean(failed) || (said && said.textContent !== failed)) layShot();
      }
      layDeviations();
      redraw(() => bench.took.push({ from: own.begin, to: performance.now(), run: found.header.ms }));
    } else if (found.header.status === "refused") say(found.header.message);
    // Another page has taken its turn.
    else await new Promise((next) => { setTimeout(next, 200 + 200 * Math.random()); bench.waiting = true; });
  } catch (error) { say(isGone(error) ? GONE : String(error.message || error)); }
  bench.flying = null;
  if (bench.waiting) { bench.waiting = false; runShots(); }
}

function drawShots() {
  if (!DATA.shots) return;
  const sizes = bench.panels.map(({ canvas }) => [canvas.clientWidth, canvas.clientHeight]);
  bench.panels.forEach((panel, k) => drawChannel(panel, sizes[k]));
}

// Samples as dots, the base model dashed, the model as it is now.
function drawChannel({ channel, k, trace, canvas }, [width, height]) {
  if (!width) return;
  const { times } = chosenShot(), now = bench.curves.get(k), known = [trace.measured, trace.base, now].filter(Boolean);
  let low = Infinity, high = -Infinity;
  for (const values of known) for (const value of values) if (value !== null && Number.isFinite(value)) { if (value < low) low = value; if (value > high) high = value; }
  if (!(high > low)) { const middle = high === low ? low : 0, pad = Math.abs(middle) * 0.05 || 1; low = middle - pad; high = middle + pad; }
  const pad = 0.05 * (high - low), { pen, px, py, box } = framed(canvas, [width, height], [times[0], times[times.length - 1]], [low - pad, high + pad], channel.unit);
  const draw = (values) => line(pen, { x: { times: true }, y: { column: values.map((value) => (value === null ? NaN : value)), sign: 1 }, times }, px, py, box);
  pen.save(); pen.beginPath(); pen.rect(box.x0, box.y0, box.x1 - box.x0, box.y1 - box.y0); pen.clip();
  pen.fillStyle = color("--pale");
  trace.measured.forEach((value, i) => { if (value !== null) pen.fillRect(px(times[i]) - 1, py(value) - 1, 2, 2); });
  if (trace.base) { pen.strokeStyle = color("--c1"); pen.lineWidth = 1.2; pen.setLineDash([5, 3]); draw(trace.base); pen.setLineDash([]); }
  if (now) { pen.strokeStyle = color("--c0"); pen.lineWidth = 1.6; draw([...now]); }
  pen.restore();
  const away = bench.deviations[bench.chosen][k];
  canvas.setAttribute("aria-label", channel.name + " over time, " + times.length + " samples between " + short(low) + " and " + short(high) + " " + channel.unit + "; the model is " + short(away, 3) + " standard deviations of the noise away");
}
