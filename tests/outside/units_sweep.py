"""Every model of the tests that runs, as units of both versions in both kinds of use: valid, and with the results of `hyd simulate`.

Takes a quarter of an hour, so `tests/outside/run` leaves it out:

    target/outside/python-*/bin/python tests/outside/units_sweep.py target/debug/hyd target/outside/work [WORD...]

WORD: only paths that contain one of them.  Prints a line for each unit that differs, and counts at the end; fails if any does.
"""
import collections
import pathlib
import subprocess
import sys
import time

import units

FOLDERS = ("language", "numerics", "stdlib", "cases")
# Roots of loops that end on the way: no integrator outside can jump.
JUMPS = "loops"
# Models that are wrong.
BAD = "bad_input"
# A model that takes longer (s) tests the patience of FMPy, not the unit.
PATIENCE = 5


def runs(model):
    """True if `hyd simulate` brings the model to its end in time."""
    command = [units.HYD, "simulate", model, "--result", units.WORK / "sweep.csv"]
    try:
        return subprocess.run(command, capture_output=True, timeout=PATIENCE).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def difference(model, name):
    """What is wrong with the units of a model; None if nothing is."""
    try:
        units.check_model(model, name, quiet=True, exchange=JUMPS not in model.parts)
        return None
    except subprocess.CalledProcessError as error:
        return f"not made: {error.stderr or error}"
    except Exception as error:  # whatever the importer says
        return f"{type(error).__name__}: {error}"


def main():
    words = units.ARGUMENTS
    counts = collections.Counter()
    begin = time.perf_counter()
    root = pathlib.Path.cwd()
    small = [model for folder in FOLDERS for model in sorted((root / "tests" / folder).rglob("*.hyd")) if BAD not in model.parts]
    for model in [*small, *units.large()]:
        name = "-".join(model.relative_to(root).with_suffix("").parts[1:])
        if words and not any(word in name for word in words):
            continue
        if not runs(model):
            counts["without a run"] += 1
            continue
        fault = difference(model, name)
        counts["good" if fault is None else "different"] += 1
        if fault is not None:
            print(f"  {name}: {' '.join(fault.split())[:400]}", flush=True)
    print(f"{dict(counts)} in {time.perf_counter() - begin:.0f} s", flush=True)
    sys.exit(1 if counts["different"] else 0)


main()
