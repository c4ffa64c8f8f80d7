"use strict";
// The sections of the report: what was found, where the gap lies, what was tried, and how far it can be trusted.

const R = DATA.report;
const hasText = (file) => DATA.texts.some((own) => own.name === file);
const place = (own) => hasText(own.file)
  ? `<a data-file="${safe(own.file)}" data-line="${own.line}">${safe(own.file)}:${own.line}</a>` : `${safe(own.file)}:${own.line}`;

function begin() {
  document.title = (R.title ? R.title + ": " : "") + R.status;
  document.getElementById("sentence").textContent = R.sentence.charAt(0).toUpperCase() + R.sentence.slice(1);
  const held = R.shots.heldout.length ? `, ${R.shots.heldout.join(", ")} held out` : "";
  document.getElementById("about").textContent =
    `${R.title ? R.title + ". " : ""}Model ${R.model}, set ${R.set}, shots ${R.shots.train.join(", ")} fitted${held}. ` +
    `${R.simulations} runs of one shot, ${fixed(R.seconds, 1)} s, seed ${R.seed}.` + (R.whole_loops ? ` ${R.whole_loops} of them were done again with whole loops, because one variable after the other they could not be solved.` : "") +
    (R.reason ? ` ${R.unfitted ? "Not adequate" : "No name"}, because ${R.reason}.` : "") + (R.no_law ? ` No law, because ${R.no_law}.` : "") +
    R.exact.map((own) => ` ${own.words.replaceAll("`", "")}.`).join("") +
    R.units.map((own) => ` ${own.words.charAt(0).toUpperCase() + own.words.slice(1)}.`).join("");
}

// The law that was written, term by term, and what else was fitted.
function law() {
  const L = R.law;
  if (!L) return "";
  const terms = L.terms.map((own) => `<li><code>${safe(own.shape)}</code> times ${measured({ ...own, value: own.coefficient })}</li>`);
  const M = L.memory;
  const memory = !M ? "" : `<p>with ${M.equations.map((own) => `<code>${safe(own)}</code>`).join(", ")} and</p><ul>` +
    M.numbers.map((own) => `<li>${safe(own.what)}: <code>${safe(own.name)} = ${measured(own)}</code></li>`).join("") + "</ul>";
  const rivals = L.rivals.map((own) => `<li><code>${safe(own.shape)}</code>${own.equation ? ` in <code>${safe(own.equation)}</code>` : ""}: ${fixed(own.behind, 0)}</li>`);
  return `<p><code>${safe(L.equation)}</code>, ${place(L)}, lacks</p><ul>${terms.join("")}</ul>${memory}<p><code>${safe(L.text)}</code> is an effect for a library.</p>` +
    (rivals.length ? `<p>By how much the cost is larger with other terms or effects:</p><ul>${rivals.join("")}</ul>` : "");
}

function answer() {
  // Where nothing was named there is no model but the base.
  const both = (own) => fixed(own.before) + (R.change ? ` &rarr; ${fixed(own.after)}` : "");
  const gap = (name, own) => own ? `<div><b>${both(own)}</b><span>${name}</span></div>` : "";
  const figures = `<div class="figures">${gap("gap on fitted shots", R.gap.train)}${gap("gap on shots held out", R.gap.heldout)}` +
    `<div><b>1.00</b><span>noise</span></div></div>`;
  const effects = R.effects.map((own) => {
    const sizes = Object.entries(own.parameters).map(([name, p]) => `<code>${safe(name)} = ${measured(p)}</code>${interval(p)}`);
    return `<p><b>${safe(own.id)}</b> (${safe(own.equation)}) at <code>${safe(own.component)}</code>, ${place(own)}<br>${sizes.join("<br>")}</p>`;
  });
  const terms = R.proposed.map((own) =>
    `<p>a term <code>${short(own.coefficient)}*${safe(own.shape)}</code> ${safe(own.unit || "")} (&plusmn; ${short(own.stderr)}) in <code>${safe(own.equation)}</code>` +
    ` of <code>${safe(own.component || "the model")}</code>, ${place(own)}, would bring the misfit to ${fixed(own.misfit)}</p>`);
  const telling = R.further.filter((own) => own.apart >= 1);
  const nothing = R.further.length && !telling.length
    ? [`<p>No other condition of a shot and no other channel of this study tells ${safe(R.further[0].effects[0])} from ${safe(R.further[0].effects[1])}.</p>`]
    : [];
  const further = nothing.concat(telling.slice(0, 4).map((own) =>
    `<p>To tell ${safe(own.effects[0])} from ${safe(own.effects[1])}: ${safe(own.measurement)}; they would differ by ${short(own.apart)} (sum of squares in standard deviations).</p>`));
  section("What was found", figures + effects.join("") + law() + terms.join("") + further.join(""));
}

// What disturbs the bench beside the noise that was stated, and how much is left after what was named.
function disturbed() {
  const lines = R.disturbed.sentences.map((own) => `<li>${safe(own)}</li>`);
  const left = R.remaining;
  if (left) {
    const at = left.first_place ? `, first of all at <code>${safe(left.first_place)}</code>` : "";
    lines.unshift(`<li>${safe(left.sentence)}${at}</li>`);
  }
  lines.push(...[...R.refuted, ...R.alike].map((own) => `<li>${safe(own.sentence)}</li>`));
  if (lines.length) section("Beside the machine and its noise", `<ul>${lines.join("")}</ul>`, { wide: true });
}

// What an answer without a name still knows: effects that earlier passes put into the model, and the best candidates of the last one.
function cameNearest() {
  const rows = [...R.found_before.map((own) => ({ ...own, before: true })), ...R.nearest];
  if (!rows.length) return;
  const sizes = (own) => Object.entries(own.parameters).map(([name, p]) =>
    `<code>${safe(name.slice(name.indexOf(".") + 1))} = ${measured(p)}</code>${interval(p)}`).join("<br>");
  const why = (own) => own.before ? "found in an earlier pass and kept in the model; the residuals need more than that" : own.criterion;
  const columns = [["effect", (r) => `<code>${safe(r.effect)}</code><br>${safe(r.words)}`],
    ["place", (r) => `<code>${safe(r.component)}</code>`], ["size", sizes], ["misfit", (r) => fixed(r.misfit), true],
    ["drop of the cost", (r) => (r.before ? "" : fixed(r.cost_drop, 1)), true], ["size / error", (r) => (r.before ? "" : fixed(r.size_in_errors, 1)), true],
    ["why it is not the answer", (r) => safe(why(r))]];
  const part = section("What came nearest", table(rows, columns), {
    wide: true, note: "Misfit: mean square of the residuals with this effect in the model; 1.00 is noise. Drop of the cost: by a fit of all unknowns." +
      (R.resembles && !R.unfitted ? ` What is missing resembles <b>${safe(R.resembles)}</b> most.` : "") });
  part.classList.add("sizes");
}

// What the likeliest equation lacks over time, or that of a law, shot by shot, with a band of two standard errors.
function missing() {
  const M = R.missing;
  if (!M || !M.shots.length) return;
  const width = 420, height = 170, left = 62, right = 10, top = 22, bottom = 30;
  const panel = (own) => {
    const law = own.law || [];
    const low = Math.min(0, ...law, ...own.value.map((v, k) => v - 2 * own.stderr[k])), high = Math.max(0, ...law, ...own.value.map((v, k) => v + 2 * own.stderr[k]));
    const first = own.time[0], last = own.time[own.time.length - 1];
    const x = (t) => left + (width - left - right) * (t - first) / (last - first || 1);
    const y = (v) => height - bottom - (height - top - bottom) * (v - low) / (high - low || 1);
    const at = (t, v) => `${x(t).toFixed(1)},${y(v).toFixed(1)}`;
    const line = own.time.map((t, k) => at(t, own.value[k])).join(" ");
    const band = own.time.map((t, k) => at(t, own.value[k] + 2 * own.stderr[k])).join(" ") + " " +
      own.time.map((t, k) => at(t, own.value[k] - 2 * own.stderr[k])).reverse().join(" ");
    const text = (px, py, words, anchor) => `<text x="${px}" y="${py}" font-size="11" fill="var(--pale)" text-anchor="${anchor}">${safe(words)}</text>`;
    const marks = [low, 0, high].filter((v, k, all) => all.indexOf(v) === k && (v === 0 || Math.abs(y(v) - y(0)) > 12));
    return `<svg viewBox="0 0 ${width} ${height}" style="width:100%;max-width:${width}px" role="img" aria-label="shot ${own.shot}">` +
      `<polygon points="${band}" fill="var(--span)"></polygon><line x1="${left}" x2="${width - right}" y1="${y(0)}" y2="${y(0)}" stroke="var(--seen)"></line>` +
      `<polyline points="${line}" fill="none" stroke="var(--more)" stroke-width="1.6"></polyline>` +
      (own.law ? `<polyline points="${own.time.map((t, k) => at(t, own.law[k])).join(" ")}" fill="none" stroke="var(--ink)" stroke-width="1.6" stroke-dasharray="5 3"></polyline>` : "") +
      marks.map((v) => text(left - 5, y(v) + 4, short(v), "end")).join("") + text(left, 13, `shot ${own.shot}${M.unit ? ", " + M.unit : ""}`, "start") +
      text(left, height - 12, short(first) + " s", "start") + text(width - right, height - 12, short(last) + " s", "end") + "</svg>";
  };
  section("What is missing over time", M.shots.map(panel).join(""), { wide: true,
    note: `What would have to be added to the right side of <code>${safe(M.equation)}</code>, ${place(M)}, as smooth as the records allow, with a band of two standard errors` +
      (R.law ? "; dashed what the law adds." : ".") });
}

function phases() {
  const P = R.phases;
  if (!P) return;
  const cell = (list, phase, channel) => (list && list[phase] ? fixed(list[phase][channel]) : "");
  const rows = [];
  P.channels.forEach((name, channel) => P.names.forEach((phase, k) => rows.push({ name, channel, phase, k })));
  const columns = [["channel", (r) => (r.k === 0 ? `<a data-channel="${safe(r.name)}">${safe(r.name)}</a>` : "")], ["phase", (r) => safe(r.phase)],
    ...[["as designed", "raw"], ["base fitted", "before"], ["extended", "after"], ["held out, base", "heldout_before"],
      ["held out, extended", "heldout_after"]].filter(([, key]) => P[key]).map(([title, key]) => [title, (r) => cell(P[key], r.k, r.channel), true])];
  const far = (r) => P.before && P.before[r.k][r.channel] > 1.2;
  section("Where the gap lies", table(rows, columns, far), {
    note: "Root of the mean square of the residuals in standard deviations of the noise; 1.00 is noise. " +
      (P.of ? `Phases are those of ${safe(P.of)}.` : "Phases are thirds of the record.") });
}

function structure() {
  const top = R.location.length ? Math.max(...R.location.map((own) => own.score || 0)) : 0;
  const root = { name: "the model", inside: new Map(), own: [] };
  for (const own of R.location) {
    // What passes between two places is said at both.
    for (const path of own.components || [own.component || ""]) {
      let node = root;
      for (const part of path.split(".").filter(Boolean)) {
        if (!node.inside.has(part)) node.inside.set(part, { name: part, inside: new Map(), own: [] });
        node = node.inside.get(part);
      }
      node.own.push(own);
    }
  }
  const best = R.location[0];
  const heat = (score) => `<span class="heat"><i style="width:${top > 0 ? Math.max(1, 100 * Math.max(0, score) / top) : 0}%"></i></span>`;
  const strength = (node) => Math.max(0, ...node.own.map((own) => own.score || 0), ...[...node.inside.values()].map(strength));
  const print = (node) => [...node.inside.values()].sort((a, b) => strength(b) - strength(a)).map((child) => {
    const here = best && child.own.includes(best);
    const equations = child.own.slice(0, 2).map((own) => `<code>${safe(own.equation)}</code>${own.effect ? " (" + safe(own.effect) + ")" : ""} ${place(own)}`);
    return `<li>${heat(strength(child))}<b${here ? ' style="background:var(--mark)"' : ""}>${safe(child.name)}</b> ${equations.join("; ")}` +
      (child.inside.size ? `<ul>${print(child)}</ul>` : "") + "</li>";
  }).join("");
  const own = root.own.slice(0, 2).map((eq) => `<code>${safe(eq.equation)}</code> ${place(eq)}`).join("; ");
  section("The structure, and where something seems to be missing",
    `<div class="tree scroll" tabindex="0"><ul><li>${own}<ul>${print(root)}</ul></li></ul></div>`,
    { note: "Bars: by how much the cost would drop with the best term of an equation, or the best effect of a place. Marked: the likeliest." });
}

function text() {
  if (!DATA.texts.length) return;
  const options = DATA.texts.map((own) => `<option>${safe(own.name)}</option>`).join("");
  const part = section("Text", `<div class="bar"><select aria-label="file">${options}</select></div><pre class="scroll" tabindex="0"></pre>`);
  const select = part.querySelector("select"), pre = part.querySelector("pre");
  const show = (file, line) => {
    select.value = file;
    const own = DATA.texts.find((candidate) => candidate.name === file);
    pre.innerHTML = own.text.split("\n").map((row, k) =>
      `<div class="${k + 1 === line ? "mark" : ""}"><span class="n">${k + 1}</span>${safe(row)}</div>`).join("");
    const marked = pre.querySelector(".mark");
    if (marked) pre.scrollTop = marked.offsetTop - pre.offsetTop - 120;
  };
  select.onchange = () => show(select.value, 0);
  document.addEventListener("click", (event) => {
    const link = event.target.closest("a[data-file]");
    if (link) { show(link.dataset.file, Number(link.dataset.line)); part.scrollIntoView({ block: "nearest", behavior: "smooth" }); }
  });
  const best = R.law || R.effects[0] || R.proposed[0] || R.location[0];
  if (best && hasText(best.file)) show(best.file, best.line); else show(DATA.texts[0].name, 0);
}

function change() {
  if (!R.change) return;
  const lines = R.change.trimEnd().split("\n").map((line) => `<div class="added">+ ${safe(line)}</div>`).join("");
  section("What was added to the model", `<pre tabindex="0">${lines}</pre>`,
    { wide: true, note: "The whole model stands in <code>discovered.hyd</code> and runs by itself." });
}

function candidates() {
  const several = R.candidates.some((own) => own.pass > 1);
  const columns = [["effect or term", (r) => `<code>${safe(r.effect)}</code>`], ["promise", (r) => fixed(r.promise, 1), true],
    ["drop of the cost", (r) => (r.fitted ? fixed(r.cost_drop, 1) : ""), true], ["size / error", (r) => (r.fitted ? fixed(r.size_in_errors, 1) : ""), true],
    ["misfit", (r) => fixed(r.misfit, 3), true], ["why not", (r) => safe(r.verdict)]];
  if (several) columns.unshift(["pass", (r) => r.pass, true]);
  section("Candidates", table(R.candidates, columns, (r) => r.fitted && !r.verdict), { wide: true,
    note: "Promise: drop of the cost that the signature explains without a fit (screening). Drop of the cost: by a fit of all unknowns. A name needs a drop of " + fixed(R.needed, 0) + ", " +
      "a size of four standard errors and a lead of 10." });
}

function parameters() {
  const columns = [["what may be off", (r) => safe(r.name)], ["base", (r) => (r.before ? short(r.before.value) : ""), true],
    ["pull", (r) => (r.before ? fixed(r.before.pull) : ""), true], ["last fit", (r) => short(r.after.value), true],
    ["&plusmn;", (r) => (r.after.stderr > 0 ? short(Number(r.after.stderr.toPrecision(2))) : short(r.after.stderr)), true], ["pull", (r) => fixed(r.after.pull) + (r.after.at_limit ? " (limit)" : ""), true]];
  columns[4][0] = "\u00b1";
  section("What may be off", table(R.parameters, columns, (r) => Math.abs(r.after.pull) > 2), {
    note: "Pull: distance from the value before the measurement in its standard deviations; bold above 2; nothing may go farther than 12 (limit). Factors, gains: times the stated value." });
}

function power() {
  const columns = [["effect", (r) => `<code>${safe(r.effect)}</code>`], ["typical size", (r) => short(r.typical), true],
    ["drop to expect", (r) => fixed(r.cost_drop, 0), true], ["left by nuisances", (r) => fixed(100 * r.left_by_nuisances, 0) + " %", true],
    ["seen in", (r) => fixed(100 * r.chance, 0) + " %", true], ["smallest visible", (r) => short(r.smallest_visible), true]];
  section("What these shots could have shown", table(R.power, columns), {
    note: "For effects that are not in the last model. Smallest visible: seen in 95 of 100 sets. The figures are linear, so optimistic where nuisances are not." });
  const pairs = [["effects", (r) => `<code>${safe(r.effects[0])}</code>, <code>${safe(r.effects[1])}</code>`],
    ["cosine", (r) => fixed(r.cosine), true], ["told apart by", (r) => fixed(r.apart, 0), true],
    ["", (r) => (r.apart > 45 ? "told apart" : "may be taken for each other")]];
  section("Effects that look alike", R.confusions.length ? table(R.confusions, pairs) : "<p>None.</p>",
    { note: "Cosine of the signatures after the nuisances have taken their share; a difference of 45 tells two apart." });
}

function record() {
  const rows = R.attempts.flatMap((pass, k) => pass.map((own) => ({ pass: k + 1, ...own })));
  const columns = [["pass", (r) => r.pass, true], ["start", (r) => safe(r.start)], ["misfit", (r) => fixed(r.misfit, 3), true],
    ["cost", (r) => fixed(r.cost, 1), true], ["steps", (r) => r.steps, true], ["", (r) => (r.converged ? "converged" : "not converged")]];
  section("Fits of the model without", table(rows, columns), { note: "No effect is named if the attempts end far apart." });
  const noise = Object.entries(R.noise).map(([name, own]) => ({ name, ...own, masked: R.masked[name] }));
  const sized = (row, value) => (value === null || value === undefined ? "-" : safe(withUnit(value, (R.channels.find((own) => own.name === row.name) || {}).unit)));
  const names = [["channel", (r) => safe(r.name)], ["noise used", (r) => sized(r, r.used), true], ["before the trigger", (r) => sized(r, r.before_trigger), true],
    ["samples", (r) => r.samples, true], ["correlation", (r) => fixed(r.correlation), true], ["left out", (r) => fixed(100 * r.masked, 1) + " %", true]];
  section("Noise and masks", table(noise, names));
}

begin();
answer();
phases();
disturbed();
cameNearest();
missing();
const overlay = section("Measured and simulated", '<div class="curves"></div>', { wide: true });
const view = DATA.shots.length ? curveView(overlay.querySelector(".curves"), DATA.shots, R.channels, firstView(R.gap), Boolean(R.change)) : null;
structure();
text();
change();
candidates();
parameters();
power();
record();
document.addEventListener("click", (event) => {
  const link = event.target.closest("a[data-channel]");
  if (!link || !view) return;
  const shot = DATA.shots.findIndex((own) => own.channels.some((channel) => channel.name === link.dataset.channel));
  if (shot >= 0) { view.show(shot, link.dataset.channel); overlay.scrollIntoView({ block: "nearest", behavior: "smooth" }); }
});
