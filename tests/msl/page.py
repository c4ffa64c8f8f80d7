"""The page of the examples of the Modelica Standard Library: rows in, text out, and what an earlier page called verified."""

import re
from collections import Counter

VERDICTS = {
    "verified": "every signal of the reference lies in its tube",
    "explained": "a signal leaves the tube for a reason that is not ours, which is given",
    "ran": "ran to the end; there was no reference to compare with, or not every signal is recorded",
    "wrong": "ran to the end, and a signal leaves the tube",
    "failed": "translated, and the run ended early with a message",
    "stopped": "took longer than the limit of time",
    "crashed": "a signal or a panic",
    "refused": "not translated",
}

HEAD = """# The Modelica Standard Library

Written by `tests/msl/run`, from version 4.1.0 of the library and the results that the Modelica Association publishes beside it
(`modelica/MAP-LIB_ReferenceResults`, made by another program). A model is run over the time of its reference; every signal named there is compared with the
reference in a tube of 0.002 of its range and of the time. Seconds are of the processor, for the whole command: reading the library, translating, running and writing.
"""


def area(name):
    """The part of the library, such as `Electrical.Analog`."""
    parts = name.split(".")[1:]
    deep = parts[0] in ["Electrical", "Magnetic", "Mechanics"]
    return ".".join(parts[: 2 if deep else 1])


def cell(text):
    """A text that fits a cell of a table."""
    text = re.sub(r"\s+", " ", text).replace("|", "\\|")
    return text if len(text) <= 160 else text[:157] + "..."


def general(why):
    """A message without its names and numbers, so that equal causes are counted together."""
    return re.sub(r"[-+]?\b\d[\d.e+-]*", "N", re.sub(r"`[^`]*`", "`...`", why))


def page(rows, seconds):
    """The whole text."""
    lines = [HEAD, f"{len(rows)} examples, {seconds / 60:.0f} minutes, one at a time.", ""]
    lines += ["| | examples | what it means |", "|---|---:|---|"]
    counts = Counter(row["verdict"] for row in rows)
    lines += [f"| {verdict} | {counts[verdict]} | {meaning} |" for verdict, meaning in VERDICTS.items()]
    lines += ["", "## Parts of the library", "", "| part | examples | verified | ran | wrong | failed, stopped | refused |", "|---|---:|---:|---:|---:|---:|---:|"]
    for part in sorted({area(row["name"]) for row in rows}):
        own = Counter(row["verdict"] for row in rows if area(row["name"]) == part)
        early = own["failed"] + own["stopped"] + own["crashed"]
        lines.append(f"| {part} | {sum(own.values())} | {own['verified']} | {own['ran']} | {own['wrong']} | {early} | {own['refused']} |")
    causes = Counter(general(row["why"]) for row in rows if row["verdict"] in ["refused", "failed", "crashed"])
    lines += ["", "## What stands in the way", "", "First messages, names left out, by the number of examples that begin with them.", "", "| examples | message |", "|---:|---|"]
    lines += [f"| {count} | {cell(cause)} |" for cause, count in sorted(causes.items(), key=lambda item: (-item[1], item[0]))]
    lines += ["", "## Examples", "", "| example | | s | MB | |", "|---|---|---:|---:|---|"]
    for row in rows:
        lines.append(f"| {row['name'].removeprefix('Modelica.')} | {row['verdict']} | {row['seconds']:.1f} | {row['memory']:.0f} | {cell(row['why'])} |")
    return "\n".join(lines) + "\n"


def verified_before(path):
    """Full names of what the page at `path` calls verified; none where there is no page."""
    try:
        with open(path, encoding="utf-8") as file:
            lines = file.read().splitlines()
    except FileNotFoundError:
        return set()
    cells = [[part.strip() for part in line.split("|")] for line in lines if line.startswith("| ")]
    return {"Modelica." + row[1] for row in cells if len(row) > 3 and row[2] == "verified"}
