"use strict";
// The sections of the report of a fit: the gap, the values with their intervals, the curves, and how far it can be trusted.

const F = DATA.fit, S = DATA.report;

function begin() {
  const held = S.shots.heldout.length ? `, ${S.shots.heldout.join(", ")} held out` : "";
  const title = S.title || F.set;
  document.title = title + ": fit";
  document.getElementById("sentence").textContent = `${title}: the fitted model leaves ${fixed(F.misfit, 3)} times what noise alone would`;
  document.getElementById("about").textContent = `Set ${F.set}, shots ${S.shots.train.join(", ")} fitted${held}. ` +
    `${F.simulations} runs of one shot, ${fixed(F.seconds, 1)} s.` +
    (F.converged ? "" : " The fit has not converged: the values are where it was given up, and their errors mean little.") +
    (S.stated_fault ? ` The model as stated could not be compared: ${S.stated_fault}.` : "") +
    (F.whole_loops ? ` ${F.whole_loops} runs were done again with whole loops, because one variable after the other they could not be solved.` : "");
}

function gaps() {
  const rows = [{ name: "all", bold: true }, ...S.channels.map((own) => ({ name: own.name, words: own.words }))];
  const of = (gap, row) => (row.bold ? gap : gap.channels[row.name]);
  const columns = [["channel", (r) => (r.bold ? "all" : `<a data-channel="${safe(r.name)}">${safe(r.name)}</a> ${safe(r.words)}`)],
    ["as stated", (r) => fixed(of(S.gap.train, r).before), true], ["as fitted", (r) => fixed(of(S.gap.train, r).after), true]];
  if (S.gap.heldout) {
    columns.push(["held out, as stated", (r) => fixed(of(S.gap.heldout, r).before), true],
      ["held out, as fitted", (r) => fixed(of(S.gap.heldout, r).after), true]);
  }
  section("The gap", table(rows, columns, (r) => r.bold), {
    note: "Root of the mean square of the residuals in standard deviations of the noise; 1.00 is noise." });
}

// An interval without its ends where the measurement does not bound it.
function interval(ends, unit) {
  const end = (value) => (value === null ? "open" : short(Number(value.toPrecision(4))));
  return `${end(ends[0])} to ${end(ends[1])}${unit && unit !== "1" ? " " + safe(unit) : ""}`;
}

function values() {
  const rows = F.unknowns.filter((own) => own.fitted);
  const inUnits = (r) => r.in_units && measured(r.in_units);
  const columns = [["what may be off", (r) => `<code>${safe(r.name)}</code>${r.in_units && r.in_units.parameter !== r.name ? "<br><code>" + safe(r.in_units.parameter) + "</code>" : ""}`],
    ["value", (r) => inUnits(r) || short(Number(r.value.toPrecision(6))), true],
    ["95 % interval", (r) => (r.in_units ? interval(r.in_units.interval, r.in_units.unit) : interval(r.interval)), true],
    ["expected", (r) => (r.in_units ? measured({ ...r.in_units, value: r.in_units.expected, stderr: r.in_units.expected_sd }) : ""), true],
    ["pull", (r) => fixed(r.sd) + (r.at_limit ? " (limit)" : ""), true]];
  section("Values", table(rows, columns, (r) => Math.abs(r.sd) > 2), { wide: true,
    note: "Without a unit: factor or gain times the stated value, or what is added in units of the table. Intervals are those of profiles where they were asked for (<code>--profile</code>), " +
      "else of the standard error. Pull: distance from what was expected in its standard deviations; bold above 2; nothing may go farther than 12 (limit)." });
}

function record() {
  const columns = [["start", (r) => safe(r.start)], ["misfit", (r) => fixed(r.misfit, 3), true], ["steps", (r) => r.steps, true],
    ["", (r) => (r.converged ? "converged" : "not converged")]];
  section("Attempts", table(F.attempts, columns), { note: "Misfit: sum of squares over that of noise alone. Ends far apart say that the minimum is not the only one." });
  const noise = Object.entries(S.noise).map(([name, own]) => ({ name, ...own, masked: S.masked[name] }));
  const sized = (row, value) => (value === null || value === undefined ? "-" : safe(withUnit(value, (S.channels.find((own) => own.name === row.name) || {}).unit)));
  section("Noise and masks", table(noise, [["channel", (r) => safe(r.name)], ["noise used", (r) => sized(r, r.used), true],
    ["before the trigger", (r) => sized(r, r.before_trigger), true], ["samples", (r) => r.samples, true],
    ["correlation", (r) => fixed(r.correlation), true], ["left out", (r) => fixed(100 * r.masked, 1) + " %", true]]));
}

begin();
values();
const overlay = section("Measured and simulated", '<div class="curves"></div>', { wide: true });
const view = DATA.shots.length ? curveView(overlay.querySelector(".curves"), DATA.shots, S.channels, firstView(S.gap), true,
  { base: ["model as stated", "as stated"], more: ["model as fitted", "as fitted"] }) : null;
gaps();
record();
document.addEventListener("click", (event) => {
  const link = event.target.closest("a[data-channel]");
  if (!link || !view) return;
  const shot = DATA.shots.findIndex((own) => own.channels.some((channel) => channel.name === link.dataset.channel));
  if (shot >= 0) { view.show(shot, link.dataset.channel); overlay.scrollIntoView({ block: "nearest", behavior: "smooth" }); }
});
