// What may be off in the shots of a study, as sliders: parameters within their tolerances, measuring chains, and what is of one shot alone.

// In the units of its slider: factors are deviations in percent.
const PERCENT = { factor: true, gain: true };
function shownOff(own, value) {
  return PERCENT[own.kind] && !own.plain ? Number((100 * (value - 1)).toPrecision(12)) : value;
}
function fromShown(own, shown) {
  return PERCENT[own.kind] && !own.plain ? 1 + shown / 100 : shown;
}
function unitOff(own) {
  return PERCENT[own.kind] && !own.plain ? "%" : own.unit;
}

// What a number is now.
function nowOff(own) {
  if (!own.plain) return entry(runs.off, own.name) ?? own.expected;
  const set = entry(runs.set, own.plain), known = byName.get(own.plain);
  if (set !== undefined) return Number(set);
  return known && known.p && DATA.model.parameters.length > known.p[0] ? DATA.model.parameters[known.p[0]] * known.p[1] : own.expected;
}

// The value of a parameter in the chosen shot, where something that is off moves it; else null.
function movedTo(name) {
  let value = null;
  for (const own of DATA.shots.slack) {
    const number = entry(runs.off, own.name), found = own.parameters.find(([known]) => known === name);
    if (number === undefined || !found || (own.shot !== null && own.shot !== bench.chosen)) continue;
    const before = value ?? found[1][bench.chosen];
    value = own.kind === "factor" ? before * number : own.kind === "later" ? before + number : number;
  }
  return value;
}

// The sliders, in groups.
function laySlack() {
  const { slack } = DATA.shots, place = document.getElementById("slack");
  place.hidden = !slack.length || !canRun;
  if (place.hidden) return;
  const isChain = (own) => own.channel !== null, shot = chosenShot();
  const groups = [
    ["parameters", "Parameters", slack.filter((own) => own.shot === null && !isChain(own))],
    ["chains", "Measuring chains", slack.filter((own) => own.shot === null && isChain(own))],
    ["shot", "Shot " + shot.number + " alone", slack.filter((own) => own.shot === bench.chosen)],
  ].filter(([, , all]) => all.length);
  const before = new Map([...place.querySelectorAll("details")].map((own) => [own.dataset.group, own.open]));
  const scrolled = new Map([...place.querySelectorAll("details")].map((own) => [own.dataset.group, own.querySelector(".many").scrollTop]));
  const focused = place.contains(document.activeElement) ? document.activeElement.id || document.activeElement.getAttribute("aria-label") : null;
  const made = groups.map(([group, words, all], k) => {
    const node = element("details", { "data-group": group }, element("summary", {}, words + " (" + all.length + ")"), element("div", { class: "many" }, ...all.map(slackRow)));
    node.open = before.get(group) ?? k === 0;
    return node;
  });
  const reset = element("p", {}, element("button", { type: "button", onclick: resetParameters }, "all as expected"));
  const about = element("p", { class: "pale" }, "Each as far as the study and the set say that it may be off: three standard deviations to each side. The table above follows.");
  place.replaceChildren(element("h3", {}, "What may be off"), about, ...made, reset);
  for (const node of made) node.querySelector(".many").scrollTop = scrolled.get(node.dataset.group) || 0;
  if (focused !== null) {
    const again = [...place.querySelectorAll("input")].find((own) => own.id === focused || own.getAttribute("aria-label") === focused);
    if (again) again.focus();
  }
}

// One of them: what it is, what is expected, and how far it is off.
function slackRow(own) {
  const unit = unitOff(own), shown = (value) => shownOff(own, value), isPercent = unit === "%" && PERCENT[own.kind];
  const digits = (value) => (isPercent ? short(value) + " %" : withUnit(value, unit));
  const tolerance = isPercent ? 100 * own.tolerance : own.tolerance, ratio = own.tolerance / Math.abs(own.expected);
  // Relative tolerances are known as such.
  const about = own.kind === "factor" && own.plain ? short(100 * ratio, 3) + " %" : digits(tolerance);
  const names = own.parameters.map(([name]) => name).filter((name) => name !== own.name), where = names.length ? names.join(", ") + ", " : "";
  const expected = own.kind === "factor" && !own.plain ? "as noted in each shot" : isPercent || own.kind === "later" || own.kind === "late" || own.kind === "offset" ? "0" : digits(own.expected);
  const away = element("small", {});
  const tell = (value) => {
    const off = (value - own.expected) / own.tolerance;
    away.textContent = Math.abs(off) < 0.005 ? "" : short(Math.abs(off), 2) + " \u03c3 " + (off > 0 ? "above" : "below");
  };
  const id = "o-" + own.name, now = nowOff(own);
  const name = element("label", { class: "name", for: id }, own.name, element("small", {}, where + "expected " + expected + " \u00b1 " + about), away);
  const box = element("div", { class: "parameter" }, name);
  const change = (value) => {
    const raw = fromShown(own, value);
    if (own.plain) runs.set[own.plain] = String(raw); else runs.off[own.name] = raw;
    box.classList.add("changed");
    tell(raw);
    runModel();
    runShots();
  };
  box.classList.toggle("changed", own.plain ? entry(runs.set, own.plain) !== undefined : entry(runs.off, own.name) !== undefined);
  tell(now);
  const words = (value) => { const off = (fromShown(own, value) - own.expected) / own.tolerance; return digits(value) + ", " + short(off, 2) + " standard deviations from what is expected"; };
  const ends = ([low, high]) => [Math.min(shown(low), shown(now)), Math.max(shown(high), shown(now))];
  const { field, slider } = sliding({ id, label: own.name + ", what may be off, by slider", range: ends(own.range), limits: ends(own.limits), value: shown(now), isWhole: false, words, change, follow: () => layParameters(lists.path) });
  box.append(field, element("span", { class: "unit" }, unit && unit !== "1" ? unit : ""), slider);
  return box;
}
