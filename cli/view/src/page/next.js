// The shots to make next: under which conditions, what each would decide, and the map of what a shot is worth over the conditions.

// Which conditions the map shows: across and upwards.
const chart = { x: 0, y: 0 };

function beginNext() {
  const { next } = DATA;
  if (!next) return;
  document.getElementById("next").hidden = false;
  const models = next.models || [];
  const aims = { "tell apart": "To tell apart: " + models.join(", "), reveal: "To show what could have hidden: " + models.slice(1).join(", "), narrow: "To know better how large it is: " + models.join(", ") };
  const about = next.nothing || aims[next.aim] || "";
  document.getElementById("next-about").textContent = about ? about[0].toUpperCase() + about.slice(1) + "." : "";
  document.getElementById("next-shots").replaceChildren(...next.shots.map(plannedShot));
  const words = [
    ...(next.never || []).map((own) => "Within these ranges " + own + "."),
    ...(next.models_left_out ? [next.models_left_out + " more rivals are left out, whose costs are larger."] : []),
    ...((next.not_run || []).length ? ["The model does not run at the typical size of " + next.not_run.join(", ") + "."] : []),
    ...(next.failed && next.failed.points ? [next.failed.points + " points cannot be run by every model; the first: " + next.failed.why] : []),
    ...(next.beyond ? ["At " + next.beyond + " points a channel would leave what it may show."] : []),
    ...(next.forbidden ? [next.forbidden + " points are forbidden by the limits of the study."] : []),
  ];
  document.getElementById("next-beside").replaceChildren(...words.map((own) => element("li", {}, own)));
  document.getElementById("next-beside").hidden = !words.length;
  if (!(next.points || []).length || !(next.vary || []).length) return;
  document.getElementById("next-map").hidden = false;
  [chart.x, chart.y] = telling();
  layAxes();
  layMap();
}

// The two conditions on which the worth depends the most: by how much its mean differs between slices of the range.
const SLICES = 6;
function telling() {
  const { vary, points } = DATA.next;
  const told = vary.map((axis, k) => {
    const slices = Array.from({ length: SLICES }, () => [0, 0]);
    for (const own of points) {
      const slice = slices[Math.min(SLICES - 1, Math.max(0, Math.floor(SLICES * (own.values[k] - axis.low) / (axis.high - axis.low) || 0)))];
      slice[0] += 1; slice[1] += own.worth || 0;
    }
    const means = slices.filter((own) => own[0]).map((own) => own[1] / own[0]), middle = means.reduce((sum, own) => sum + own, 0) / means.length;
    return means.reduce((sum, own) => sum + (own - middle) ** 2, 0) / means.length;
  });
  // Alike ones stay in the order of the study.
  const order = vary.map((_, k) => k).sort((a, b) => told[b] - told[a] || a - b);
  return [order[0], order[Math.min(1, order.length - 1)]];
}

// A shot: its conditions as a lab sets them, and what it would decide.
function plannedShot(shot, k) {
  const settings = shot.settings.map((own) => {
    const cut = own.indexOf(" = "), value = own.slice(cut + 3);
    // With a prefix where there is one: the plain number stands in next.json.
    return element("li", {}, element("b", {}, (/\((.*)\)$/.exec(value) || [])[1] || value), " ", own.slice(0, cut));
  });
  const title = "Shot " + (k + 1) + ", like shot " + shot.like + " in all else" + (shot.cost === 1 || shot.cost === undefined ? "" : ", cost " + short(shot.cost));
  const said = [...(shot.evidence || []).map(decided), ...(shot.narrows || []).map(narrowed)];
  return element("div", {}, element("h3", {}, title), element("ul", { class: "settings" }, ...settings),
    ...(k ? [element("p", { class: "pale" }, "Together with the shots before it:")] : []), element("ul", { class: "decides" }, ...said));
}

function bar(part) {
  const inner = element("i", {});
  inner.style.width = 100 * Math.min(1, Math.max(0, part)) + "%";
  return element("span", { class: "heat", "aria-hidden": "true" }, inner);
}

// What a pair of rivals would come to.
function decided(own) {
  const isFitted = own.fitted !== null && own.fitted !== undefined, grows = (isFitted ? "" : "about ") + short(isFitted ? own.fitted : own.expected, 3), sure = Math.round(100 * own.decides) + " %";
  const size = own.size === null || own.size === undefined ? "" : " of size " + short(own.size, 3);
  const shows = own.shows ? "; they differ the most in " + own.shows.channel + ", by " + short(own.shows.deviations, 3) + " \u03c3 at " + withUnit(own.shows.time, "s") : "";
  const words = DATA.next.aim === "reveal" ? "if there is " + own.if + size + ", it is seen with " + sure + " (the cost drops by " + grows + ")"
    : "if it is " + own.if + ", " + own.against + " is refuted with " + sure + " (its cost grows by " + grows + ")";
  return element("li", {}, bar(own.decides), words + shows);
}

function narrowed(own) {
  const times = own.interval_times;
  return element("li", {}, bar(1 - times), "the interval of " + own.size + " becomes " + short(times, 2) + " times as wide");
}

// Which conditions the axes are, where more than two vary.
function layAxes() {
  const { vary } = DATA.next, sides = vary.length > 2 ? [["x", "across"], ["y", "upwards"]] : [];
  document.getElementById("next-axes").replaceChildren(...sides.map(([side, words]) => {
    const field = element("select", { onchange: (event) => { chart[side] = Number(event.target.value); layMap(); } }, ...vary.map((axis, k) => element("option", { value: k }, axis.condition)));
    field.value = chart[side];
    return element("label", {}, words + " ", field);
  }));
}

function drawn(name, attributes, ...inner) {
  const own = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) own.setAttribute(key, value);
  own.append(...inner);
  return own;
}

// Every point was run; rings are the proposed shots, crosses those that were made.
function layMap() {
  const { vary, points, shots, made } = DATA.next, isOne = vary.length === 1;
  const best = Math.max(...points.map((own) => own.worth || 0), 1e-12), share = (worth) => Math.max(0, worth || 0) / best;
  const box = { x0: 70, x1: 546, y0: 12, y1: 326 }, X = vary[chart.x], Y = isOne ? { condition: "worth", low: 0, high: best } : vary[chart.y];
  // Shots that were made may lie beyond what may be set.
  const known = (made || []).map((own) => ({ ...own, at: [own.values[chart.x], isOne ? 0 : own.values[chart.y]] })).filter((own) => own.at.every((value) => Number.isFinite(value)));
  const ends = (axis, k) => { const all = [axis.low, axis.high, ...known.map((own) => own.at[k])], low = Math.min(...all), high = Math.max(...all); return high > low ? [low, high] : [low - 1, high + 1]; };
  const [xs, ys] = [ends(X, 0), ends(Y, 1)], pad = 10;
  const px = (value) => box.x0 + pad + (box.x1 - box.x0 - 2 * pad) * (value - xs[0]) / (xs[1] - xs[0]);
  const py = (value) => box.y1 - pad - (box.y1 - box.y0 - 2 * pad) * (value - ys[0]) / (ys[1] - ys[0]);
  const place = (values, worth) => [px(values[chart.x]), py(isOne ? worth || 0 : values[chart.y])];
  const told = (own) => vary.map((axis, k) => axis.condition + " = " + short(own.values[k])).join(", ") + ": " + Math.round(100 * share(own.worth)) + " % of the best point";
  const dots = [...points].sort((a, b) => (a.worth || 0) - (b.worth || 0)).map((own) => {
    const [cx, cy] = place(own.values, own.worth), dot = drawn("circle", { class: "dot", cx, cy, r: 6 }, drawn("title", {}, told(own)));
    dot.style.setProperty("--share", share(own.worth).toFixed(3));
    dot.addEventListener("pointerenter", () => { document.getElementById("next-point").textContent = told(own); });
    return dot;
  });
  const crosses = known.map((own) => {
    const [x, y] = [px(own.at[0]), py(own.at[1])];
    return drawn("path", { class: "made", d: `M${x - 5} ${y - 5}l10 10m0 -10l-10 10` }, drawn("title", {}, "shot " + own.number + ", which was made"));
  });
  const rings = shots.map((shot, k) => {
    const values = vary.map((axis) => shot.conditions[axis.condition]), same = points.find((own) => own.values.every((value, n) => value === values[n]));
    const [cx, cy] = place(values, same && same.worth), isRight = cx > box.x1 - 40;
    return [drawn("circle", { class: "ring", cx, cy, r: 11 }, drawn("title", {}, "shot " + (k + 1) + " of those proposed")),
      drawn("text", { class: "number", x: isRight ? cx - 15 : cx + 15, y: cy + 4, "text-anchor": isRight ? "end" : "start" }, String(k + 1))];
  });
  const label = (x, y, anchor, words, more = {}) => drawn("text", { x, y, "text-anchor": anchor, ...more }, words);
  const middle = (box.y0 + box.y1) / 2, width = box.x1 - box.x0, height = box.y1 - box.y0;
  const proposed = shots.map((shot, k) => "shot " + (k + 1) + " at " + vary.map((axis) => axis.condition + " = " + short(shot.conditions[axis.condition])).join(", "));
  const svg = drawn("svg", { class: "map", viewBox: "0 0 560 370", role: "img", "aria-label": "Map of the worth of a shot over " + (isOne ? X.condition : X.condition + " and " + Y.condition) + ", " + points.length + " points; proposed: " + proposed.join("; ") },
    drawn("rect", { class: "frame", x: box.x0, y: box.y0, width, height }), ...dots, ...crosses, ...rings.flat(),
    label(px(xs[0]), box.y1 + 16, "middle", short(xs[0])), label(px(xs[1]), box.y1 + 16, "end", short(xs[1])),
    label((box.x0 + box.x1) / 2, box.y1 + 34, "middle", X.condition),
    label(box.x0 - 6, py(ys[0]) + 4, "end", short(ys[0])), label(box.x0 - 6, py(ys[1]) + 4, "end", short(ys[1])),
    label(0, 0, "middle", Y.condition, { transform: `translate(16 ${middle}) rotate(-90)` }));
  document.querySelector("#next-map .place").replaceChildren(svg);
  const key = known.length ? ", crosses the shots that were made" : "";
  document.getElementById("next-point").textContent = "Every point was run with every model; the stronger the colour, the more it is worth. Rings are the proposed shots" + key + ".";
}
