"use strict";
// Where the time of a run went: parts, components, and who kept its steps short.

const P = DATA.profile, main = document.getElementById("main");
const ESCAPES = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
const safe = (text) => String(text ?? "").replace(/[&<>"]/g, (c) => ESCAPES[c]);
const many = (count) => Number(count).toLocaleString("en").replaceAll(",", "\u202f");
const number = (value) => String(Number(Number(value).toPrecision(5)));
const millis = (seconds) => `${(1e3 * seconds).toPrecision(3).replace(/e\+?.*/, "")} ms`;
const ms = (seconds) => (1e3 * seconds >= 1000 ? `${many(Math.round(1e3 * seconds))} ms` : millis(seconds));
const percent = (part) => `${(100 * part).toFixed(1)} %`;
const counted = (count, one, several) => `${many(count)} ${Number(count) === 1 ? one : several}`;

function section(title, note, wide = false) {
  const part = document.createElement("section");
  if (wide) part.className = "wide";
  part.innerHTML = `<h2>${safe(title)}</h2>${note ? `<p>${safe(note)}</p>` : ""}`;
  main.append(part);
  return part;
}

function head() {
  document.title = `Profile of ${DATA.model}`;
  document.getElementById("sentence").textContent = `Where the time of ${DATA.model} went`;
  const steps = counted(DATA.counters.steps ?? P.steps, "step", "steps");
  document.getElementById("about").textContent = `${number(DATA.start)} s to ${number(DATA.time)} s of the model in ${ms(P.total_s)} on the wall clock: ${steps}, ` +
    `${counted(DATA.unknowns, "unknown", "unknowns")} (${counted(DATA.states, "state", "states")}), solver ${DATA.solver}, tolerance ${number(DATA.tolerance)}.`;
  if (DATA.message && !["done", "terminated"].includes(DATA.status)) {
    const wrong = document.createElement("p");
    wrong.id = "wrong";
    wrong.textContent = DATA.message;
    document.querySelector("header").append(wrong);
  }
}

function parts() {
  const rest = Math.max(P.total_s - P.start_s - P.steps_s - P.events_s, 0);
  const all = [["initial values", P.start_s, "--c3"], ["steps", P.steps_s, "--c0"], ["events", P.events_s, "--c2"], ["output, looking for events, the rest", rest, "--c5"]];
  const total = Math.max(P.total_s, 1e-12);
  const bar = all.map(([name, seconds, colour]) => `<i style="width:${(100 * seconds) / total}%;background:var(${colour})" title="${safe(name)}"></i>`).join("");
  const row = ([name, seconds, colour]) => `<tr><td><span class="key" style="background:var(${colour})"></span>${safe(name)}</td><td class="n">${ms(seconds)}</td><td class="n">${percent(seconds / total)}</td></tr>`;
  const within = [["of all this, residuals", P.residuals_s], ["of all this, Jacobians", P.jacobians_s], ["of all this, linear algebra, step control and the rest", Math.max(P.total_s - P.residuals_s - P.jacobians_s, 0)]];
  const inner = ([name, seconds]) => `<tr><td class="pale">${safe(name)}</td><td class="n">${ms(seconds)}</td><td class="n">${percent(seconds / total)}</td></tr>`;
  section("Parts of the run", "", true).insertAdjacentHTML("beforeend",
    `<div class="parts" role="img" aria-label="${safe(all.map(([name, seconds]) => `${name} ${percent(seconds / total)}`).join(", "))}">${bar}</div>` +
    `<div class="scroll" tabindex="0"><table><tbody>${all.map(row).join("")}${within.map(inner).join("")}</tbody></table></div>`);
}

// The columns of the table of components; each may be the order.
const COLUMNS = [["limited", "steps limited"], ["rejected", "rejected"], ["unconverged", "Newton failed"], ["events", "events"], ["operations", "code"]];

function components() {
  const all = new Map();
  const own = (name) => {
    const key = name || "(the model itself)";
    if (!all.has(key)) all.set(key, { name: key, limited: 0, rejected: 0, unconverged: 0, events: 0, operations: 0 });
    return all.get(key);
  };
  const of = { limited: P.limited_by_component, rejected: P.rejected_by_component, unconverged: P.unconverged_by_component, events: P.events_by_component };
  for (const [column, shares] of Object.entries(of)) for (const share of shares ?? []) own(share.name)[column] += share.count;
  let operations = 0;
  for (const block of DATA.code) {
    operations += block.operations;
    if (block.component !== null) own(block.component).operations += block.operations;
  }
  const rows = [...all.values()];
  if (!rows.length) return;
  const part = section("Components", "Accepted steps whose largest error was theirs, attempts rejected for it, attempts in which Newton's method failed, events, and their share of the operations of all equations.", true);
  const table = document.createElement("div");
  table.className = "scroll";
  part.append(table);
  const shown = COLUMNS.filter(([key]) => rows.some((row) => row[key] > 0));
  let order = shown.length ? shown[0][0] : "limited";
  const cell = (row, key) => (key === "operations" ? percent(row[key] / Math.max(operations, 1)) : many(row[key]));
  const draw = () => {
    rows.sort((a, b) => b[order] - a[order] || (a.name < b.name ? -1 : 1));
    const most = Math.max(...rows.map((row) => row[order]), 1);
    const heads = shown.map(([key, title]) => `<th class="n"><button aria-pressed="${key === order}" data-key="${key}">${safe(title)}</button></th>`).join("");
    table.innerHTML = `<table><thead><tr><th>component</th>${heads}</tr></thead><tbody>${rows.map((row) =>
      `<tr><td><code>${safe(row.name)}</code><span class="heat"><i style="width:${(100 * row[order]) / most}%"></i></span></td>${shown.map(([key]) => `<td class="n">${cell(row, key)}</td>`).join("")}</tr>`).join("")}</tbody></table>`;
    for (const button of table.querySelectorAll("button")) button.onclick = () => {
      order = button.dataset.key;
      draw();
      table.querySelector(`[data-key="${order}"]`).focus();
    };
  };
  draw();
}

function list(title, note, shares, whole) {
  if (!(shares ?? []).length) return;
  const most = Math.max(...shares.map((share) => share.count));
  const row = (share) => `<tr><td><code>${safe(share.name)}</code>${share.place ? `<small>${safe(share.place)}</small>` : ""}<span class="heat"><i style="width:${(100 * share.count) / most}%"></i></span></td>` +
    `<td class="n">${many(share.count)}</td>${whole ? `<td class="n">${percent(share.count / Math.max(whole, 1))}</td>` : ""}</tr>`;
  section(title, note).insertAdjacentHTML("beforeend", `<div class="scroll" tabindex="0"><table><tbody>${shares.map(row).join("")}</tbody></table></div>`);
}

function code() {
  if (!DATA.code.length) return;
  const all = DATA.code.reduce((sum, block) => sum + block.operations, 0);
  const row = (block) => `<tr><td><code>${safe(block.text)}</code><small>${safe([block.place, block.component].filter(Boolean).join(" in "))}</small></td>` +
    `<td class="n">${many(block.equations)}</td><td class="n">${many(block.operations)}</td><td class="n">${percent(block.operations / all)}</td><td class="n">${ms((P.residuals_s * block.operations) / all)}</td></tr>`;
  section("Cost of the code", "Counted in operations of the text as additions (a division counts 4, a function 20, a power 40); the time is that share of what residuals took.", true)
    .insertAdjacentHTML("beforeend", `<div class="scroll" tabindex="0"><table><thead><tr><th>equation</th><th class="n">equations</th><th class="n">operations</th><th class="n">share</th><th class="n">time</th></tr></thead><tbody>${DATA.code.map(row).join("")}</tbody></table></div>`);
}

head();
parts();
components();
list("Steps limited by the error of", "The variable whose error was the largest of an accepted step.", P.limited_by, P.steps);
list("Steps rejected for the error of", "Attempts that were done again with a smaller step.", P.rejected_by);
list("Newton's method failed, worst in", "The variable that still moved most.", P.unconverged_by);
list("Newton's method failed, in the equations", "The equation that was off most.", P.unconverged_in);
list("Events by relation", "How often a relation changed.", P.events_by);
code();
