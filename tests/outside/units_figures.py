"""Figures of the drive's unit for `docs/guides/fmu.md`: size, start, a call of model exchange, co-simulation beside `hyd simulate`.

Prints, checks nothing; for a release build and a quiet machine:

    target/outside/python-*/bin/python tests/outside/units_figures.py target/release/hyd target/outside/work
"""
import ctypes
import json
import shutil
import subprocess
import time

from units import HYD, MODELS, WORK, build, instance, start, vector

DRIVE = MODELS / "single_acting_drive" / "drive.hyd"
STOP, STEP = 0.05, 1e-4
CALLS, ROUNDS = 20_000, 5


def least(measure, rounds=ROUNDS):
    return min(measure() for _ in range(rounds))


def begin(path):
    unit, _, folder = instance(path, "CS")
    start(unit, "3.0", STOP, kind="CS")
    seconds = time.perf_counter() - unit.begin
    unit.freeInstance()
    shutil.rmtree(folder)
    return seconds


def calls(path):
    """Seconds of CPU time of one call of rates at a new point, and of a call that does all but nothing, both from Python."""
    unit, description, folder = instance(path, "ME")
    start(unit, "3.0", STOP)
    count = len(description.derivatives)
    (x, px), (_, pdx) = vector(count), vector(count)
    unit.getContinuousStates(px, count)
    first = x.copy()
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    functions = {name: getattr(unit.dll, f"fmi3{name}") for name in ("SetTime", "SetContinuousStates", "GetContinuousStateDerivatives")}
    functions["SetTime"].argtypes = [pointer, ctypes.c_double]
    functions["SetContinuousStates"].argtypes = functions["GetContinuousStateDerivatives"].argtypes = [pointer, pointer, size]
    set_time, set_states, rates = functions.values()

    def per_call(work):
        before = time.process_time()
        for k in range(CALLS):
            work(k)
        return (time.process_time() - before) / CALLS

    def move(k):
        x[0] = first[0] * (1 + 1e-9 * (k % 1000))
        set_time(unit.component, 1e-6 * (k % 3))
        set_states(unit.component, px, count)

    def move_and_ask(k):
        move(k)
        rates(unit.component, pdx, count)

    found = least(lambda: per_call(move_and_ask)) - least(lambda: per_call(move)), least(lambda: per_call(lambda k: set_time(unit.component, 0.0)))
    unit.freeInstance()
    shutil.rmtree(folder)
    return found


def stepped(path, tolerance):
    unit, _, folder = instance(path, "CS")
    unit.enterInitializationMode(startTime=0.0, stopTime=STOP, tolerance=tolerance)
    unit.exitInitializationMode()
    before = time.process_time()
    for k in range(round(STOP / STEP)):
        unit.doStep(k * STEP, STEP)
    seconds = time.process_time() - before
    unit.freeInstance()
    shutil.rmtree(folder)
    return seconds


def simulated(tolerance):
    command = [HYD, "simulate", DRIVE, "--tolerance", str(tolerance), "--intervals", str(round(STOP / STEP)), "--result", WORK / "figures.csv", "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["simulate_s"]


def main():
    path, made = build(DRIVE, "3.0", "drive")
    print(f"size: {made['bytes']} bytes; from the library to the start: {1e3 * least(lambda: begin(path), 20):.1f} ms")
    asked, nothing = calls(path)
    print(f"a call of rates at a new point: {1e6 * asked:.2f} us, one that does all but nothing {1e6 * nothing:.2f} us, both from Python")
    for tolerance in (1e-6, 1e-8):
        own, whole = least(lambda: stepped(path, tolerance)), least(lambda: simulated(tolerance))
        print(f"co-simulation by {STEP} s at {tolerance}: {1e3 * own:.1f} ms of CPU time, `hyd simulate` {1e3 * whole:.1f} ms: {own / whole:.2f}")


if __name__ == "__main__":
    main()
