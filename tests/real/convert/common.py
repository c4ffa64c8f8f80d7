"""What the converters share: files out of a bare git directory, the lab's noise, tables and sets.

The noise of a channel is estimated from its third differences, which leave out what is smooth: for white noise of standard
deviation s they have the standard deviation s*sqrt(20).  The largest tenth of them (steep flanks) is left out, and the rest is
scaled up by what a normal distribution loses by that.  Rounding is part of the estimate; where the step of rounding is stated in
the set as `quantisation`, its share step^2/12 is taken off again, because hyd adds it.
"""

import json
import math
import statistics
import subprocess

TRIMMED = 0.10


def blob(repository, revision, path):
    """A file of a bare git directory as bytes."""
    return subprocess.run(["git", "-C", repository, "show", f"{revision}:{path}"], check=True, capture_output=True).stdout


def third_differences(values):
    """Third differences of a list of numbers."""
    return [values[k + 3] - 3 * values[k + 2] + 3 * values[k + 1] - values[k] for k in range(len(values) - 3)]


def noise(records, step=0.0):
    """Standard deviation of the noise of one channel over all records (lists of numbers), without that of rounding."""
    differences = []
    for values in records:
        own = third_differences(values)
        middle = statistics.median(own)
        differences += [abs(d - middle) for d in own]
    differences.sort()
    kept = differences[: int(len(differences) * (1 - TRIMMED))]
    normal = statistics.NormalDist()
    cut = normal.inv_cdf(1 - TRIMMED / 2)
    lost = math.sqrt(1 - 2 * cut * normal.pdf(cut) / (1 - TRIMMED))
    square = sum(d * d for d in kept) / len(kept) / 20 / lost**2 - step**2 / 12
    # What rounding alone explains leaves no noise of its own; a hundredth of a step stands for none.
    return math.sqrt(max(square, (step / 100) ** 2))


def table(path, header, rows):
    """A CSV file; None is an empty field."""
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(header) + "\n")
        for row in rows:
            file.write(",".join("" if value is None else f"{value}" for value in row) + "\n")


def write_set(path, content):
    """A set as JSON."""
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        json.dump(content, file, indent=1)
        file.write("\n")


def rounded(value, digits=2):
    """A number with so many significant digits."""
    return float(f"{value:.{digits}g}")
