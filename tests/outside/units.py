"""Units of `hyd build --fmu` in FMPy: valid by its checks and the schemas, and with the results of `hyd simulate` in both kinds of use."""
import ctypes
import json
import math
import pathlib
import shutil
import subprocess
import sys
import time
import zipfile

import fmpy
import fmpy.sundials
import numpy as np
import pandas as pd
from lxml import etree
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmpy.validation import validate_fmu

HYD, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
ARGUMENTS = sys.argv[3:]
ONLY = set(ARGUMENTS)
OWN = sorted(pathlib.Path("tests/outside/units").resolve().glob("*.hyd"))
MODELS = pathlib.Path("models").resolve()
VERSIONS = ("2.0", "3.0")
# `failing` and `ended` do not come to their end; they have checks of their own.
WITHOUT_END = {"failing", "ended"}
# What takes CVODE more than ten seconds.
SLOW = {"stoppedline", "fourcylinderhead"}
POINTS = 200
# Problems of the literature; exponentials of the amplifier overflow at trial points that are far from the last accepted one, and the pendulum has other states
# on its way.
NUMERICS = [pathlib.Path("tests/numerics").resolve() / f"{name}.hyd" for name in ("hires", "pendulum", "robertson", "transistor_amplifier", "van_der_pol")]
TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"


def build(model, version, name):
    path = WORK / f"{name}-{version}.fmu"
    command = [HYD, "build", model, "--fmu", version, "-o", path, "--json"]
    made = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return path, json.loads(made.stdout)


def reference(model, name, tolerance):
    """Results of `hyd simulate` at the points of the units, and far more exact ones at ten times as many points."""
    tables = []
    for part, points in ((1, POINTS), (100, 10 * POINTS)):
        path = WORK / f"{name}.csv"
        command = [HYD, "simulate", model, "--result", path, "--tolerance", str(tolerance / part), "--intervals", str(points)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        tables.append(pd.read_csv(path))
    return tables


def distances(times, values, own_times, own):
    """How far values are from those of the reference at nearly the same time: beside a jump or a kink a value lies between its neighbours."""
    far = np.abs(np.interp(own_times, times, values) - own)
    width = 1.5 * (times[-1] - times[0]) / (10 * POINTS)
    begins = np.searchsorted(times, own_times - width)
    ends = np.searchsorted(times, own_times + width, side="right")
    for k in np.flatnonzero(far > 1e-12 * np.max(np.abs(values))):
        near = values[begins[k]:ends[k]]
        far[k] = min(far[k], max(near.min() - own[k], own[k] - near.max(), 0))
    return far


def check_against(tables, result, tolerance, where):
    """Every value within ten times the tolerance of the exact one, beside its size; where `hyd simulate` itself is not as exact (a small
    difference of large numbers), within twenty times its error."""
    plain, exact = tables
    times = exact.iloc[:, 0].to_numpy()
    compared = 0
    for name in result.dtype.names[1:]:
        values = exact[name].to_numpy(dtype=float)
        size = np.max(np.abs(values))
        usual = np.max(distances(times, values, plain.iloc[:, 0].to_numpy(), plain[name].to_numpy(dtype=float)))
        allowed = max(10 * tolerance * size, 20 * usual) + 1e-12
        far = distances(times, values, result["time"], np.asarray(result[name], dtype=float))
        # One point in a hundred may lie in a contact that lasts shorter than points are apart, or behind an event at the very end.
        worst = np.argsort(far)[::-1][:1 + len(far) // 100]
        k = int(worst[-1])
        assert far[k] <= allowed, f"{where}: {name} at {result['time'][k]} is off by {far[k]:.2e} of {size:.2e}; usual is {usual:.2e}"
        compared += 1
    return compared


def compared_names(description, table):
    names = [v.name for v in description.modelVariables if v.name in table.columns and not v.dimensions]
    # Enough to see everything move, and not so much that recording takes longer than solving.
    return names[:: max(1, len(names) // 60)]


def check_model(model, name, versions=VERSIONS, quiet=False, exchange=True):
    told, tables = [], None
    for version in versions:
        begin = time.perf_counter()
        path, made = build(model, version, name)
        seconds = time.perf_counter() - begin
        problems = validate_fmu(str(path))
        assert not problems, f"{name} {version}: {problems[:5]}"
        check_terminals(path, name)
        if name in WITHOUT_END:
            continue
        description = read_model_description(str(path))
        experiment = description.defaultExperiment
        tolerance = float(experiment.tolerance)
        tables = tables or reference(model, name, tolerance)
        # The model may end the run itself.
        stop = tables[1].iloc[-1, 0]
        names = compared_names(description, tables[1])
        options = dict(start_time=float(experiment.startTime), stop_time=float(experiment.stopTime), output_interval=float(experiment.stopTime) / POINTS, output=names, validate=False)
        kinds = ["CoSimulation"] + (["ModelExchange"] if made["model_exchange"] and exchange else [])
        assert (description.modelExchange is not None) == made["model_exchange"]
        for kind in kinds:
            begin = time.perf_counter()
            # An integrator of others gets a finer tolerance: what it makes of it is its own.
            used = tolerance if kind == "CoSimulation" else tolerance / 100
            result = simulate_fmu(str(path), fmi_type=kind, solver="CVode", relative_tolerance=used, **options)
            assert abs(result["time"][-1] - stop) <= 1e-6 * stop, f"{name} {version} {kind}: ends at {result['time'][-1]}"
            check_against(tables, result, tolerance, f"{name} {version} {kind}")
            told.append(f"{version} {kind} {time.perf_counter() - begin:.2f} s")
    if not quiet:
        print(f"  {name}: {', '.join(told)}; built in {seconds:.2f} s, {made['bytes'] >> 10} kB", flush=True)


def check_terminals(path, name):
    """The list of connectors follows its schema, which FMPy ships but does not look at, and names variables of the unit."""
    with zipfile.ZipFile(path) as archive:
        if TERMINALS not in archive.namelist():
            return 0
        document = etree.fromstring(archive.read(TERMINALS))
    schema = pathlib.Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"
    etree.XMLSchema(etree.parse(str(schema))).assertValid(document)
    variables = {v.name: v for v in read_model_description(str(path)).modelVariables}
    terminals = document.findall("Terminals/Terminal")
    names = [terminal.get("name") for terminal in terminals]
    assert names and len(set(names)) == len(names), f"{name}: {names}"
    for terminal in terminals:
        members = terminal.findall("TerminalMemberVariable")
        own = [member.get("memberName") for member in members]
        assert members and len(set(own)) == len(own), f"{name}: {terminal.get('name')} has the members {own}"
        for member in members:
            variable = variables[member.get("variableName")]
            is_open = variable.causality in ("input", "output", "parameter", "calculatedParameter")
            # The kinds of the standard are for these alone.
            assert is_open or member.get("variableKind") not in ("signal", "inflow", "outflow"), f"{name}: {member.attrib}"
    return len(terminals)


def instance(path, kind, **options):
    description = read_model_description(str(path))
    folder = extract(str(path))
    classes = {("2.0", "ME"): FMU2Model, ("2.0", "CS"): FMU2Slave, ("3.0", "ME"): FMU3Model, ("3.0", "CS"): FMU3Slave}
    made = classes[description.fmiVersion[:3], kind]
    interface = description.modelExchange if kind == "ME" else description.coSimulation
    begin = time.perf_counter()
    unit = made(guid=description.guid, unzipDirectory=folder, modelIdentifier=interface.modelIdentifier, instanceName="one")
    unit.instantiate(**options)
    unit.begin = begin
    return unit, description, folder


def start(unit, version, stop, event_mode=False, kind="ME"):
    if version == "2.0":
        unit.setupExperiment(startTime=0.0, stopTime=stop, tolerance=1e-8)
        unit.enterInitializationMode()
    else:
        unit.enterInitializationMode(startTime=0.0, stopTime=stop, tolerance=1e-8)
    unit.exitInitializationMode()
    if kind == "ME":
        update(unit, version)
        unit.enterContinuousTimeMode()


def update(unit, version):
    return unit.newDiscreteStates() if version == "2.0" else unit.updateDiscreteStates()


def reals(unit, version, references):
    return unit.getReal(references) if version == "2.0" else unit.getFloat64(references)


def vector(count):
    array = np.zeros(count)
    return array, array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class Patient(fmpy.sundials.CVodeSolver):
    """FMPy's integrator without its limit of 500 steps from one point to the next, which contacts at fine tolerances need."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, maxNumSteps=100_000, **options)


fmpy.sundials.CVodeSolver = Patient


class Explicit:
    """An integrator of fixed step that looks at the event indicators: the same calls give the same bits."""

    def __init__(self, unit, version, states, indicators):
        self.unit, self.version = unit, version
        (self.x, self.px), (self.dx, self.pdx), (self.z, self.pz) = vector(states), vector(states), vector(indicators)
        self.nx, self.nz = states, indicators

    def rates(self):
        get = self.unit.getDerivatives if self.version == "2.0" else self.unit.getContinuousStateDerivatives
        get(self.pdx, self.nx)
        return self.dx.copy()

    def step(self, t, h):
        unit = self.unit
        unit.getContinuousStates(self.px, self.nx)
        unit.getEventIndicators(self.pz, self.nz)
        signs = self.z > 0
        self.x += h * self.rates()
        unit.setTime(t + h)
        unit.setContinuousStates(self.px, self.nx)
        unit.completedIntegratorStep()
        unit.getEventIndicators(self.pz, self.nz)
        if np.any((self.z > 0) != signs):
            unit.enterEventMode()
            update(unit, self.version)
            unit.enterContinuousTimeMode()
        unit.getContinuousStates(self.px, self.nx)
        return self.x.copy()

    def run(self, t, h, steps):
        rows = []
        for k in range(steps):
            rows.append(self.step(t + k * h, h))
        return np.array(rows), t + steps * h


def check_states_exchange(path, version):
    """A state kept, written and read in the middle of a bounce gives the same bits."""
    unit, description, folder = instance(path, "ME")
    nx = len(description.derivatives)
    nz = description.numberOfEventIndicators if version == "2.0" else len(description.eventIndicators)
    start(unit, version, 1.8)
    solver = Explicit(unit, version, nx, nz)
    _, t = solver.run(0.0, 1e-3, 449)
    kept = unit.getFMUState()
    first, _ = solver.run(t, 1e-3, 600)
    unit.setFMUState(kept)
    second, _ = solver.run(t, 1e-3, 600)
    assert np.array_equal(first, second), "a state that was kept gives other bits"
    written = unit.serializeFMUState(kept)
    unit.freeFMUState(kept)
    other, _, other_folder = instance(path, "ME")
    start(other, version, 1.8)
    other.setFMUState(other.deserializeFMUState(written))
    third, _ = Explicit(other, version, nx, nz).run(t, 1e-3, 600)
    assert np.array_equal(first, third), "a state that was written gives other bits"
    assert np.ptp(first[:, 0]) > 0.3, "the ball has hardly moved"
    unit.freeInstance()
    other.freeInstance()
    shutil.rmtree(folder)
    shutil.rmtree(other_folder)


def check_states_stepping(path, version):
    """Roll-back of a co-simulation, and steps of other lengths that lead to the same end."""
    unit, description, folder = instance(path, "CS")
    start(unit, version, 1.8, kind="CS")
    names = {v.name: v.valueReference for v in description.modelVariables}
    wanted = [names["h"], names["v"]]

    def run(t, h, steps):
        rows = []
        for k in range(steps):
            unit.doStep(t + k * h, h)
            rows.append(reals(unit, version, wanted))
        return np.array(rows)

    run(0.0, 0.01, 44)
    kept = unit.getFMUState()
    first = run(0.44, 0.01, 100)
    unit.setFMUState(kept)
    second = run(0.44, 0.01, 100)
    assert np.array_equal(first, second), "roll-back gives other bits"
    unit.setFMUState(kept)
    other = run(0.44, 0.25, 4)
    assert np.allclose(other[-1], first[-1], rtol=1e-6), "other steps lead elsewhere"
    written = unit.serializeFMUState(kept)
    fresh, _, fresh_folder = instance(path, "CS")
    fresh.setFMUState(fresh.deserializeFMUState(written))
    unit, own = fresh, unit
    third = run(0.44, 0.01, 100)
    assert np.array_equal(first, third), "a state that was written gives other bits"
    unit.freeInstance()
    shutil.rmtree(fresh_folder)
    unit = own
    unit.setFMUState(kept)
    run(0.44, 0.25, 4)
    # A step of zero is a step.
    unit.doStep(1.44, 0.0)
    unit.freeFMUState(kept)
    unit.freeInstance()
    shutil.rmtree(folder)


def check_derivatives(path, version):
    """Directional derivatives against central differences of the rates and outputs."""
    unit, description, folder = instance(path, "ME")
    start(unit, version, 2.0)
    rates = [u.variable for u in description.derivatives]
    states = [v.derivative for v in rates]
    inputs = [v for v in description.modelVariables if v.causality == "input"]
    outputs = [u.variable for u in description.outputs if u.variable.type in {"Real", "Float64"}]
    count = sum(size(v) for v in states)
    solver = Explicit(unit, version, count, 0)
    x0, p = vector(count)
    unit.getContinuousStates(p, count)
    x0 += 0.1 + 0.01 * np.arange(count)
    unit.setContinuousStates(p, count)
    unknowns = rates + outputs

    def values():
        return np.concatenate([np.atleast_1d(read(unit, version, v)) for v in unknowns])

    base = x0.copy()
    at = 0
    for known in states + inputs:
        for element in range(size(known)):
            seed = np.zeros(size(known))
            seed[element] = 1.0
            found = directional(unit, version, unknowns, [known], seed)
            sides = []
            for sign in (1, -1):
                if known in states:
                    x0[:] = base
                    x0[at + element] += sign * 1e-4
                    unit.setContinuousStates(p, count)
                    sides.append(values())
                    x0[:] = base
                    unit.setContinuousStates(p, count)
                else:
                    old = np.atleast_1d(read(unit, version, known)).astype(float)
                    new = old.copy()
                    new[element] += sign * 1e-4
                    write(unit, version, known, new)
                    sides.append(values())
                    write(unit, version, known, old)
            differences = (sides[0] - sides[1]) / 2e-4
            assert np.allclose(found, differences, rtol=1e-6, atol=1e-6 * (1 + np.max(np.abs(differences)))), (
                f"d/d {known.name}: {found}, differences {differences}")
        if known in states:
            at += size(known)
    unit.freeInstance()
    shutil.rmtree(folder)


def size(variable):
    return math.prod(int(d.start) for d in variable.dimensions) if variable.dimensions else 1


def read(unit, version, variable):
    if version == "2.0":
        return unit.getReal([variable.valueReference])
    return unit.getFloat64([variable.valueReference], nValues=size(variable))


def write(unit, version, variable, values):
    if version == "2.0":
        unit.setReal([variable.valueReference], list(values))
    else:
        unit.setFloat64([variable.valueReference], list(values))


def directional(unit, version, unknowns, knowns, seed):
    references = [v.valueReference for v in unknowns], [v.valueReference for v in knowns]
    if version == "2.0":
        return np.array(unit.getDirectionalDerivative(*references, list(seed)))
    count = sum(size(v) for v in unknowns)
    sensitivity = (ctypes.c_double * count)()
    arrays = [(ctypes.c_uint32 * len(r))(*r) for r in references]
    given = (ctypes.c_double * len(seed))(*seed)
    unit.fmi3GetDirectionalDerivative(unit.component, arrays[0], len(arrays[0]), arrays[1], len(arrays[1]), given, len(seed), sensitivity, count)
    return np.array(sensitivity)


def check_several(path, version):
    """Instances beside each other know nothing of each other, and may go in any order."""
    made = [instance(path, "CS") for _ in range(3)]
    for unit, _, _ in made:
        start(unit, version, 1.8, kind="CS")
    names = {v.name: v.valueReference for v in made[0][1].modelVariables}
    for k, (unit, _, _) in enumerate(made):
        for j in range(k + 1):
            unit.doStep(0.1 * j, 0.1)
    heights = [reals(unit, version, [names["h"]])[0] for unit, _, _ in made]
    expected = [1 - 9.81 / 2 * (0.1 * (k + 1)) ** 2 for k in range(3)]
    assert np.allclose(heights, expected, rtol=1e-7), heights
    for k in (1, 0, 2):
        made[k][0].freeInstance()
        shutil.rmtree(made[k][2])


def check_texts(version):
    """Strings are constants with the values of the text."""
    path, _ = build(OWN[0].parent / "texts.hyd", version, "texts")
    unit, description, folder = instance(path, "CS")
    expected = {"file": 'a & "b" <c>.txt', "names[1]": "Öl", "names[2]": "", "part.note": "two\nlines"}
    texts = {v.name: v for v in description.modelVariables if v.type == "String"}
    assert {name: v.start for name, v in texts.items()} == expected, {name: v.start for name, v in texts.items()}
    references = [texts[name].valueReference for name in expected]
    read = [text.decode() if isinstance(text, bytes) else text for text in unit.getString(references)]
    assert read == list(expected.values()), read
    unit.freeInstance()
    shutil.rmtree(folder)


def check_wrong_calls(path, version):
    """Calls that do not fit end in an error and a message, and where nothing is lost the instance goes on."""
    messages = []
    unit, description, folder = instance(path, "CS")
    names = {v.name: v for v in description.modelVariables}
    for call in (
        lambda: unit.doStep(0.0, 0.1),
        lambda: unit.exitInitializationMode(),
        lambda: reals(unit, version, [10**9]),
        lambda: write(unit, version, names["energy"], [2.0]),
        lambda: write(unit, version, names["g"], [math.nan]),
    ):
        try:
            call()
        except Exception as error:
            messages.append(str(error))
        else:
            raise AssertionError("a wrong call was taken")
    write(unit, version, names["g"], [1.62])
    start(unit, version, 1.8, kind="CS")
    unit.doStep(0.0, 0.5)
    assert abs(reals(unit, version, [names["h"].valueReference])[0] - (1 - 0.81 * 0.25)) < 1e-7
    try:
        unit.doStep(0.1, 0.1)
    except Exception:
        pass
    else:
        raise AssertionError("a step from another time was taken")
    unit.reset()
    start(unit, version, 1.8, kind="CS")
    unit.doStep(0.0, 0.1)
    assert abs(reals(unit, version, [names["h"].valueReference])[0] - (1 - 9.81 / 2 * 0.01)) < 1e-7, "reset keeps what was set"
    unit.freeInstance()
    shutil.rmtree(folder)


def check_ends(version):
    path, _ = build(OWN[0].parent / "ended.hyd", version, "ended")
    result = simulate_fmu(str(path), fmi_type="ModelExchange", stop_time=2, output=["x"], relative_tolerance=1e-8)
    assert abs(result["x"][-1] - 0.8) < 1e-6, f"the run ends at {result['x'][-1]}"
    unit, description, folder = instance(path, "CS")
    start(unit, version, 2.0, kind="CS")
    unit.doStep(0.0, 0.5)
    try:
        flags = unit.doStep(0.5, 0.5)
        assert version == "3.0" and flags[1], f"terminate is not told: {flags}"
    except Exception:
        assert version == "2.0", "a run that the model ends is no error in version 3.0"
        assert unit.getBooleanStatus(3) if hasattr(unit, "getBooleanStatus") else True
    unit.freeInstance()
    shutil.rmtree(folder)
    path, _ = build(OWN[0].parent / "failing.hyd", version, "failing")
    for kind in ("ModelExchange", "CoSimulation"):
        try:
            simulate_fmu(str(path), fmi_type=kind, stop_time=2)
        except Exception as error:
            assert "failed" in str(error) or "Discard" in str(error) or "rror" in str(error), error
        else:
            raise AssertionError(f"{kind}: an assertion that does not hold is not told")


def check_commands(version):
    """Inputs that are not real numbers, switched by FMPy in the middle of a run, and a start that FMPy sets: m v' = +-6 f - ..., without friction."""
    path, _ = build(OWN[0].parent / "commands.hyd", version, "commands")
    # Value, then the same until the switch: FMPy takes the discrete inputs of a row from its time on.
    rows = [(0.0, True, 2), (0.5, False, 2), (1.0, True, 3), (1.5, True, 3)]
    signal = np.array(rows, dtype=[("time", np.float64), ("forward", bool), ("notch", np.int32)])
    for kind in ("ModelExchange", "CoSimulation"):
        result = simulate_fmu(
            str(path), fmi_type=kind, input=signal, stop_time=1.5, output_interval=0.01, relative_tolerance=1e-8, record_events=False,
            start_values={"drag": 0.0, "v": 1.0}, output=["v", "turns"],
        )
        # a = notch*full/2/m = 1.5, -1.5, 2.25 m/s2; FMPy's rows lag by a step where it hands over what a row says.
        assert abs(result["v"][-1] - (1 + 0.5 * (1.5 - 1.5 + 2.25))) < 0.04, f"{kind}: {result['v'][-1]}"
        assert result["turns"][-1] == 2, f"{kind}: {result['turns'][-1]} turns"


def check_inputs(version):
    """A force that is a table, in both kinds of use, against the recorded input of `hyd simulate`."""
    model = OWN[0].parent / "inputs.hyd"
    path, _ = build(model, version, "inputs")
    times = np.linspace(0, 2, 81)
    signal = np.array([(t, 3 + 2 * math.sin(4 * t)) for t in times], dtype=[("time", np.float64), ("force", np.float64)])
    recorded = WORK / "force.csv"
    pd.DataFrame({"time": times, "force": signal["force"]}).to_csv(recorded, index=False)
    result = WORK / "inputs-recorded.csv"
    command = [HYD, "simulate", model, "--input", recorded, "--result", result, "--tolerance", "1e-9", "--intervals", "2000"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    table = pd.read_csv(result)
    for kind, allowed in (("ModelExchange", 1e-3), ("CoSimulation", 2e-2)):
        # Inputs are held over each step of the co-simulation, and by FMPy over each step of its integrator (it sets them for its root
        # function alone).
        found = simulate_fmu(str(path), fmi_type=kind, input=signal, stop_time=2, output=["v", "x"], output_interval=0.025, relative_tolerance=1e-8)
        for name in ("v", "x"):
            expected = np.interp(found["time"], table.iloc[:, 0], table[name])
            error = np.max(np.abs(found[name] - expected)) / np.max(np.abs(expected))
            assert error < allowed, f"inputs {version} {kind}: {name} is off by {error:.1e}"
    found = runge_kutta(path, version, lambda t: np.interp(t, times, signal["force"]), 800)
    expected = [np.interp(2, table.iloc[:, 0], table[name]) for name in ("x", "v")]
    assert np.allclose(found, expected, rtol=1e-6), f"inputs at every stage: {found}, not {expected}"
    if version == "2.0":
        found = with_slopes(path, signal)
        assert np.allclose(found, expected, rtol=1e-6), f"inputs with slopes: {found}, not {expected}"


def with_slopes(path, signal):
    """States `x`, `v` at 2 s by co-simulation of version 2.0 with slopes of the input (FMPy's own option for them fails)."""
    unit, description, folder = instance(path, "CS")
    names = {v.name: v.valueReference for v in description.modelVariables}
    start(unit, "2.0", 2.0, kind="CS")
    for (t, value), (after, next_value) in zip(signal[:-1], signal[1:]):
        unit.setReal([names["force"]], [value])
        unit.setRealInputDerivatives([names["force"]], [1], [(next_value - value) / (after - t)])
        unit.doStep(t, after - t)
    found = unit.getReal([names["x"], names["v"]])
    unit.freeInstance()
    shutil.rmtree(folder)
    return found


def runge_kutta(path, version, force, steps):
    """States `x`, `v` at 2 s by the classical method, with the input set at each of its stages."""
    unit, description, folder = instance(path, "ME")
    names = {v.name: v for v in description.modelVariables}
    write(unit, version, names["force"], [force(0)])
    start(unit, version, 2.0)
    solver = Explicit(unit, version, 2, 0)
    order = [v.derivative.name for v in (u.variable for u in description.derivatives)]
    unit.getContinuousStates(solver.px, 2)

    def rates(t, x):
        unit.setTime(t)
        solver.x[:] = x
        unit.setContinuousStates(solver.px, 2)
        write(unit, version, names["force"], [force(t)])
        return solver.rates()

    x, h = solver.x.copy(), 2 / steps
    for k in range(steps):
        t = k * h
        a = rates(t, x)
        b = rates(t + h / 2, x + h / 2 * a)
        c = rates(t + h / 2, x + h / 2 * b)
        d = rates(t + h, x + h * c)
        x = x + h / 6 * (a + 2 * b + 2 * c + d)
        rates(t + h, x)
        unit.completedIntegratorStep()
    unit.freeInstance()
    shutil.rmtree(folder)
    return [x[order.index(name)] for name in ("x", "v")]


def check_size_and_start():
    """The drive's unit is small, and ready to run in no time."""
    path, made = build(MODELS / "single_acting_drive" / "drive.hyd", "3.0", "drive")
    assert made["bytes"] < 8 << 20, f"the unit of the drive has {made['bytes']} bytes"
    seconds = []
    for _ in range(5):
        unit, _, folder = instance(path, "CS")
        start(unit, "3.0", 0.02, kind="CS")
        seconds.append(time.perf_counter() - unit.begin)
        unit.freeInstance()
        shutil.rmtree(folder)
    # The quickest: others may use the machine, too.
    assert min(seconds) < 0.02, f"the start of the drive takes {min(seconds):.3f} s"
    print(f"  the drive: {made['bytes'] >> 10} kB, {1000 * min(seconds):.1f} ms from its library to its start", flush=True)


def check_c_client():
    """The importer of `client.c`, below valgrind where that is at hand."""
    if shutil.which("gcc") is None:
        print("  no gcc: the importer in C is left out", flush=True)
        return
    path, _ = build(OWN[0].parent / "bounce.hyd", "3.0", "bounce")
    description = read_model_description(str(path))
    folder = pathlib.Path(extract(str(path)))
    names = {v.name: v.valueReference for v in description.modelVariables}
    headers = pathlib.Path(fmpy.__file__).parent / "c-code"
    program = WORK / "client"
    sources = [pathlib.Path("tests/outside/client.c"), "-o", program, "-I", headers, "-ldl", "-lpthread", "-lm"]
    subprocess.run(["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-O1", "-g", *sources], check=True)
    library = next((folder / "binaries").rglob("*.so"))
    arguments = [program, library, folder / "resources", description.guid, str(names["h"]), str(names["v"])]
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
    if shutil.which("valgrind") is not None:
        watch = ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=definite"]
        subprocess.run([*watch, *arguments], check=True, stdout=subprocess.DEVNULL)
    shutil.rmtree(folder)


def check_guide():
    """The program in the guide, as it stands there."""
    lines = pathlib.Path("docs/guides/fmu.md").read_text().split("## In FMPy")[1].split("\n## ")[0].splitlines()
    program = "\n".join(line[4:] for line in lines if line.startswith("    "))
    assert "simulate_fmu" in program
    text = pathlib.Path("docs/guides/fmu.md").read_text().split("```modelica mass.hyd\n")[1].split("```")[0]
    (WORK / "mass.hyd").write_text(text)
    subprocess.run([HYD, "build", "mass.hyd", "--fmu", "3.0", "-o", "mass.fmu"], check=True, cwd=WORK, stdout=subprocess.DEVNULL)
    printed = subprocess.run([sys.executable, "-c", program], check=True, cwd=WORK, stdout=subprocess.PIPE, text=True).stdout.split()
    stepping, exchange = map(float, printed[-2:])
    assert abs(stepping - exchange) < 0.01 * exchange, printed


def main():
    print(f"units in FMPy {fmpy.__version__}", flush=True)
    for version in VERSIONS:
        path, _ = build(OWN[0].parent / "bounce.hyd", version, "bounce")
        for check in (check_states_exchange, check_states_stepping, check_several, check_wrong_calls):
            check(path, version)
        for name in ("inputs", "arrays", "implicit", "nameless"):
            path, _ = build(OWN[0].parent / f"{name}.hyd", version, name)
            check_derivatives(path, version)
        check_ends(version)
        check_inputs(version)
        check_commands(version)
        check_texts(version)
        print(f"  states, instances, calls, derivatives, ends, inputs: {version}", flush=True)
    path, _ = build(MODELS / "single_acting_drive" / "drive.hyd", "3.0", "drive")
    print(f"  connectors of the drive by their schema: {check_terminals(path, 'drive')}", flush=True)
    check_guide()
    check_c_client()
    check_size_and_start()
    for model in [*OWN, *NUMERICS]:
        if not ONLY or model.stem in ONLY:
            check_model(model, model.stem)
    # Each of the large models in one version, to save time; `units_sweep.py` has all of both.
    for k, model in enumerate(large()):
        name = "-".join(model.relative_to(MODELS).with_suffix("").parts)
        if (not ONLY or name in ONLY) and model.stem not in SLOW:
            check_model(model, name, VERSIONS[k % 2:k % 2 + 1])


def large():
    """The models of machines that say how they are to be run."""
    return [path for path in sorted(MODELS.rglob("*.hyd")) if "annotation(experiment" in path.read_text().replace(" ", "")]


if __name__ == "__main__":
    main()
