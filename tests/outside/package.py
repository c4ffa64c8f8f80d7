"""The Python package as it is installed from its wheel: guide and docstrings typed through, and what they promise compared with other libraries."""
import _thread
import doctest
import importlib
import json
import multiprocessing
import os
import pathlib
import pickle
import pkgutil
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import warnings

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
from scipy.optimize import least_squares

import hyd

HYD, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
DRIVE = "models/single_acting_drive/drive.hyd"
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
#: A pendulum that runs for a long time.
LONG = """model Long
  Real x(start = 1, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(x) = v;
  der(v) = -sin(x);
end Long;"""


def check_documentation():
    """Every example of the guide and of the docstrings."""
    failed, tried = doctest.testfile(str(pathlib.Path("docs/guides/python.md").resolve()), False, optionflags=FLAGS)
    assert tried > 30 and failed == 0, f"{failed} of {tried} examples of the guide"
    names = {"hyd": hyd, "model": hyd.load(DRIVE)}
    modules = [hyd] + [importlib.import_module(f"hyd.{own.name}") for own in pkgutil.iter_modules(hyd.__path__) if own.name != "__main__"]
    counts = [doctest.testmod(module, extraglobs=names, optionflags=FLAGS) for module in modules]
    assert sum(own.attempted for own in counts) > 20, counts
    assert sum(own.failed for own in counts) == 0, counts


def check_same_digits():
    """The numbers of the package are those of the command, to the last bit, through a text that keeps them all."""
    file = WORK / "package.csv"
    subprocess.run([HYD, "simulate", DRIVE, "--set", "p0=15e6", "--stop", "0.02", "--result", file], check=True, stdout=subprocess.DEVNULL)
    table = pd.read_csv(file, dtype=str).astype(float)
    run = hyd.load(DRIVE).simulate(p0=15e6, stop=0.02)
    assert np.array_equal(table["time"], run.time)
    assert list(table.columns[1:]) == run.names
    for name in run:
        assert np.array_equal(table[name], run[name], equal_nan=True), name
    # The wheel's own command writes the same file.
    other = WORK / "package2.csv"
    hyd.command("simulate", DRIVE, "--set", "p0=15e6", "--stop", "0.02", "--result", other)
    assert file.read_bytes() == other.read_bytes()
    measures = ["max(y)", "when(y > 4e-3)", "mean(p_R)/2", "when(y > 1)"]
    swept = hyd.load(DRIVE).sweep({"p0": hyd.grid(8e6, 20e6, 7)}, stop=0.02, variables="^(y|p_R)$", measure=measures)
    folder = WORK / "package_sweep"
    asked = [word for measure in measures for word in ("--measure", measure)]
    subprocess.run([HYD, "sweep", DRIVE, "--vary", "p0=8e6:20e6:7", "--stop", "0.02", "--variables", "^(y|p_R)$", *asked, "--result", folder], check=True, stdout=subprocess.DEVNULL)
    members = pd.read_parquet(folder / "members.parquet")
    assert list(members.columns) == list(swept)
    for name in ("p0", "y", "p_R", *measures):
        assert np.array_equal(members[name], swept[name], equal_nan=True), name
    assert (swept["max(y)"] > 0.004).all() and np.isnan(swept["when(y > 1)"]).all() and swept.units["max(y)"] == "m"


def check_conversions():
    """All ways out hold the same numbers, and those that can share memory do."""
    run = hyd.load(DRIVE).simulate(stop=0.02)
    frame, polars, arrow, dataset = run.to_pandas(), run.to_polars(), run.to_arrow(), run.to_xarray()
    assert pl.DataFrame(run).columns == pa.table(run).column_names == arrow.column_names
    assert list(frame.columns) == run.names == list(run.keys()) and polars.columns == ["time", *run.names] == arrow.column_names
    assert np.array_equal(frame.index, run.time)
    for name in run:
        for other in (frame[name].to_numpy(), polars[name].to_numpy(), arrow[name].to_numpy(), dataset[name].values):
            assert np.array_equal(run[name], other, equal_nan=True), name
    assert arrow.field("y").metadata[b"unit"] == b"m" and dataset["y"].attrs["units"] == "m"
    address = run["y"].__array_interface__["data"][0]
    assert run["y"].__array_interface__["data"][0] == address, "a view, every time"
    assert arrow["y"].chunk(0).buffers()[1].address == address, "Arrow reads the memory of the run"
    assert np.shares_memory(frame["y"].to_numpy(), run["y"]), "pandas reads the memory of the run"
    assert polars["y"].to_numpy().__array_interface__["data"][0] == address, "polars reads the memory of the run"
    assert np.shares_memory(dataset["y"].values, run["y"]), "xarray reads the memory of the run"
    kept = run["y"]
    first = kept.copy()
    del run, frame, polars, arrow, dataset
    hyd.load(DRIVE).simulate(stop=0.02)
    assert np.array_equal(kept, first), "a view keeps its memory"


def check_jacobians():
    """Exact Jacobians against differences, and a fit that uses them against one that does not."""
    model = hyd.load(DRIVE)
    function = model.function(["y", "p_R"], ["p0", "C"], at=np.linspace(0.002, 0.02, 10), tolerance=1e-9)
    p = function.start
    values, jacobian = function.value_and_jacobian(p)
    run = model.simulate(stop=0.02, intervals=10, tolerance=1e-9)
    expected = [run[name][np.argmin(abs(run.time - t))] for t in function.at for name in ("y", "p_R")]
    assert np.allclose(values, expected, rtol=1e-5), "a function is a run"
    for k, step in enumerate(1e-4 * p):
        near = [function(p + sign * step * np.eye(2)[k]) for sign in (1, -1)]
        differences = (near[0] - near[1]) / (2 * step)
        scale = np.abs(function.unflatten(differences)).max(axis=0)
        error = np.abs(function.unflatten(jacobian[:, k] - differences)) / scale
        assert error.max() < 2e-3, f"{function.parameters[k]}: {error.max()}"
    target = np.array([12e6, 1.03e-3])
    problem = function.for_scipy(function(target), sigma=[1e-5, 1e4] * 10)
    exact = least_squares(problem.fun, p, jac=problem.jac, x_scale=p)
    plain = least_squares(problem.fun, p, x_scale=p, diff_step=1e-5)
    assert np.allclose(exact.x, target, rtol=1e-4), exact.x
    assert np.allclose(plain.x, target, rtol=1e-2), plain.x
    assert exact.nfev <= plain.nfev + 2, (exact.nfev, plain.nfev)


def check_errors():
    """Code, place and excerpt; warnings; a run that fails keeps what it has."""
    try:
        hyd.load(text="model A\n  Real x;\nequation\n  der(x) = -k*x;\nend A;", name="a.hyd")
        raise AssertionError("an undeclared name")
    except hyd.ModelError as error:
        assert (error.code, error.file, error.line) == ("E0201", "a.hyd", 4), vars(error)
        assert "der(x) = -k*x" in error.excerpt and "`k`" in error.message
        again = pickle.loads(pickle.dumps(error))
        assert (again.code, again.line, again.excerpt) == (error.code, error.line, error.excerpt)
    model = hyd.load(text="model B Real x(start = 1, fixed = true); equation der(x) = x^2; end B;")
    try:
        model.simulate(stop=2)
        raise AssertionError("a solution that is not there")
    except hyd.RunError as error:
        # The solution 1/(1 - t) ends at 1.
        assert 0.9 < error.run.time[-1] <= 1.0 and error.run["x"][-1] > 10
        assert np.allclose(error.run["x"][:200], 1 / (1 - error.run.time[:200]), rtol=1e-4)
    for wrong in (dict(solver="euler"), dict(tolerance=-1), dict(intervals=-3), dict(variables="("), dict(p9=1), dict(variables="^nothing$")):
        try:
            model.simulate(**wrong)
            raise AssertionError(wrong)
        except hyd.UsageError as error:
            assert error.message, wrong
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fed = hyd.load(text="model C input Real u; Real x(start = 0, fixed = true); equation der(x) = u - x; end C;")
        fed.simulate(inputs={"time": [0, 1], "u": [1, 1]}, stop=1)
        assert not caught, "the input has values"
        fed.simulate(stop=1)
    assert "nothing gives the input `u` a value" in str(caught[0].message)
    assert any(issubclass(own.category, hyd.HydWarning) and own.filename == __file__ for own in caught), caught


def check_interrupt():
    """Ctrl-C ends a run, and what it has is kept."""
    model = hyd.load(text=LONG)
    threading.Timer(0.5, _thread.interrupt_main).start()
    begin = time.perf_counter()
    try:
        model.simulate(stop=1e7, intervals=1_000_000, tolerance=1e-10)
        raise AssertionError("nobody waits for this")
    except KeyboardInterrupt as error:
        assert isinstance(error, hyd.Interrupted)
        assert time.perf_counter() - begin < 3.0, "at the next step"
        assert len(error.run.time) > 10 and error.run.status == "interrupted"
        energy = error.run["v"] ** 2 / 2 - np.cos(error.run["x"])
        assert np.allclose(energy, energy[0], atol=1e-3)
    drive = hyd.load(DRIVE)
    values = {"p0": hyd.grid(8e6, 20e6, 500)}
    folder = WORK / "interrupted_sweep"
    shutil.rmtree(folder, ignore_errors=True)
    told = []

    def interrupted(now, of):
        if now > 25 and not told:
            told.append(now)
            _thread.interrupt_main()

    try:
        drive.sweep(values, stop=0.02, variables="^y$", result=folder, progress=interrupted)
        raise AssertionError("five hundred runs in the time of a few")
    except KeyboardInterrupt as error:
        assert isinstance(error, hyd.Interrupted)
    done = len(list((folder / "parts").glob("members-*.parquet")))
    assert 0 < done < 100, f"{done} of 100 chunks"
    seen = []
    again = drive.sweep(values, stop=0.02, variables="^y$", result=folder, progress=lambda now, of: seen.append((now, of)))
    assert seen[-1] == (500, 500) and seen[0][0] > 0
    assert np.array_equal(again["y"][:1], drive.sweep({"p0": [8e6]}, stop=0.02, variables="^y$")["y"])


def check_threads():
    """Others run while the solver works."""
    model = hyd.load(text=LONG)
    turns = 0
    done = threading.Event()

    def work():
        model.simulate(stop=20_000, tolerance=1e-9, intervals=100)
        done.set()

    threading.Thread(target=work).start()
    while not done.wait(0.001):
        turns += 1
    assert turns > 20, f"{turns} turns of the interpreter during a run"
    results = {}
    drive = hyd.load(DRIVE)
    pressures = [8e6, 10e6, 12e6, 14e6] * 3

    def one(k):
        results[k] = drive.simulate(p0=pressures[k], stop=0.02)["y"]

    threads = [threading.Thread(target=one, args=(k,)) for k in range(len(pressures))]
    [own.start() for own in threads]
    [own.join() for own in threads]
    for k, pressure in enumerate(pressures):
        assert np.array_equal(results[k], drive.simulate(p0=pressure, stop=0.02)["y"])


def lift(model):
    return model.simulate(stop=0.02)["y"].max()


def check_processes():
    """Pickles need no files, and a forked process goes on with a model."""
    drive = hyd.load(DRIVE)
    expected = lift(drive)
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "model.pickle"
        file.write_bytes(pickle.dumps(drive))
        script = "import pickle, sys; print(repr(pickle.load(open(sys.argv[1], 'rb')).simulate(stop=0.02)['y'].max().item()))"
        printed = subprocess.run([sys.executable, "-c", script, str(file)], cwd=folder, check=True, capture_output=True, text=True).stdout
        assert float(printed) == expected
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map(lift, [drive] * 4) == [expected] * 4
    run = drive.simulate(stop=0.02)
    again = pickle.loads(pickle.dumps(run))
    assert again.names == run.names and again.units == run.units and again.summary == run.summary
    assert all(np.array_equal(run[name], again[name], equal_nan=True) for name in run)
    assert again.parameters == run.parameters


def check_inputs():
    """Recorded inputs from arrays and frames are those of a file."""
    text = "model F input Real u; Real x(start = 0, fixed = true); equation der(x) = u - x; end F;"
    model = hyd.load(text=text)
    assert model.inputs == ["u"]
    times = np.linspace(0, 2, 21)
    table = pd.DataFrame({"time": times, "u": np.sin(times)})
    table.to_csv(WORK / "inputs.csv", index=False)
    runs = [model.simulate(inputs=own, stop=2) for own in (WORK / "inputs.csv", table, table.set_index("time"), {"time": times, "u": np.sin(times)}, pl.from_pandas(table))]
    for run in runs:
        assert np.array_equal(run["x"], runs[0]["x"])
    held = model.simulate(inputs=table, hold="zero", stop=2)
    assert not np.array_equal(held["x"], runs[0]["x"])


def check_size():
    """Sixty thousand variables at five hundred times: one copy."""
    count = 60_000
    model = hyd.load(text=f"model Wide parameter Integer n = {count}; Real x[n](each start = 1, each fixed = true); equation for i in 1:n loop der(x[i]) = -x[i]*i/n; end for; end Wide;")

    def resident():
        return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    before = resident()
    run = model.simulate(stop=1, intervals=500, variables=r"^x\[")
    data = 8 * count * len(run.time)
    arrow = pa.table(run)
    [run[name] for name in run]
    grown = resident() - before
    assert np.allclose(run["x[60000]"], np.exp(-run.time), rtol=1e-4)
    assert arrow.num_columns == count + 1
    print(f"{count} variables at {len(run.time)} times: {data / 1e6:.0f} MB of numbers, {grown / 1e6:.0f} MB more memory")
    assert grown < 1.7 * data, "a second copy"


def check_notebook_texts():
    """What a notebook shows is well-formed."""
    from html.parser import HTMLParser

    model = hyd.load(DRIVE)
    for text in (model._repr_html_(), model.simulate(stop=0.01)._repr_html_()):
        HTMLParser().feed(text)
    assert "<td>p0</td>" in model._repr_html_() and "Pa" in model._repr_html_()


def check_structural():
    """A parameter that decides sizes is translated for each value."""
    model = hyd.load(text="model S parameter Integer n = 2; Real x[n](each start = 1, each fixed = true); equation der(x) = -x; end S;")
    assert [len(model.simulate(n=n).names) for n in (1, 3, 2)] == [2, 6, 4]


def check_shell():
    """Completions are understood by bash; a manual page by man, where there is one."""
    script = WORK / "completions.bash"
    script.write_text(hyd.command("completions", "bash"))
    ask = f'source "{script}"; COMP_WORDS=(hyd {{}}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _hyd hyd "${{COMP_WORDS[-1]}}" ""; echo "${{COMPREPLY[@]}}"'

    def completed(words):
        return subprocess.run(["bash", "-c", ask.replace("{}", words)], check=True, capture_output=True, text=True).stdout.split()

    assert completed("sim") == ["simulate"]
    assert "--tolerance" in completed("simulate --tol") and "--sensitivity" in completed("simulate --s")
    pages = WORK / "man"
    hyd.command("man", "-o", pages)
    assert (pages / "hyd.1").exists() and (pages / "hyd-simulate.1").exists() and (pages / "hyd-bench-import.1").exists()
    if shutil.which("man"):
        shown = subprocess.run(["man", "--warnings", "-l", pages / "hyd-simulate.1"], check=True, capture_output=True, text=True, env={**os.environ, "MANPAGER": "cat"})
        assert "--tolerance" in shown.stdout.replace("\u2010", "-").replace("\b", "") and not shown.stderr, shown.stderr


def check_fit():
    """A fit is that of the command, and the parameters that it writes are those of the set's maker."""
    study = hyd.study("models/single_acting_drive/bench.toml", bench="tests/data/bench/B01.json")
    file = WORK / "fitted.toml"
    heard = []
    fit = study.fit(write_parameters=file, report=WORK / "fit", progress=lambda seconds, text: heard.append(text))
    assert heard and (WORK / "fit/fit.html").exists() and (WORK / "fit/fit.toml").read_text() == fit.parameters and fit.folder == str(WORK / "fit")
    assert fit.converged and 0.8 < fit.report["misfit"] < 1.2, fit.report["misfit"]
    told = json.loads(hyd.command("fit", "models/single_acting_drive/bench.toml", "--bench", "tests/data/bench/B01.json", "--json"))
    assert told["misfit"] == fit.report["misfit"] and told["unknowns"] == fit.report["unknowns"]
    assert fit.text.startswith(hyd.command("fit", "models/single_acting_drive/bench.toml", "--bench", "tests/data/bench/B01.json").splitlines()[0])
    assert file.read_text() == fit.parameters
    run = hyd.load(DRIVE, parameters=str(file)).simulate(stop=0.02)
    assert run.status == "done" and repr(fit).startswith("<hyd.Fit of ")


def check_programs_of_the_wheel():
    """Executables and units are made from what the wheel brings."""
    environment = {name: value for name, value in os.environ.items() if name not in ("HYD_LAUNCHER", "HYD_UNIT")}
    command = pathlib.Path(sys.executable).with_name("hyd")
    for options, name in (((), "drive_of_wheel"), (("--fmu", "3.0"), "drive_of_wheel.fmu")):
        made = subprocess.run([command, "build", DRIVE, *options, "-o", WORK / name], capture_output=True, text=True, env=environment)
        assert made.returncode == 0, made.stderr
    run = subprocess.run([WORK / "drive_of_wheel", "--stop", "0.01", "--json"], capture_output=True, text=True, check=True, env={})
    assert json.loads(run.stdout)["status"] == "done"


def check_sweep_on_dask():
    """A sweep shared out by a client of Dask is that of one process; what cannot be shared out is refused."""
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        print("distributed is not installed; sweeps on Dask are not tried")
        return
    model = hyd.load(DRIVE)
    options = dict(samples=300, seed=2, stop=0.01, measure=["max(y)"], variables="^y$", rows=True)
    vary = {"p0": hyd.uniform(8e6, 12e6), "C": hyd.normal(1e-3, 4e-4)}
    with warnings.catch_warnings(record=True) as alone_said:
        warnings.simplefilter("always")
        alone = model.sweep(vary, **options)
    folder = WORK / "on_dask"
    shutil.rmtree(folder, ignore_errors=True)
    counts = []
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster, Client(cluster) as client:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            shared = model.sweep(vary, on=client, shards=5, result=folder, progress=lambda done, of: counts.append((done, of)), **options)
        own = lambda list: [str(warning.message) for warning in list if issubclass(warning.category, hyd.HydWarning)]
        assert own(said) == own(alone_said) and shared.failures == alone.failures and shared.failed == alone.failed > 0
        assert list(shared) == list(alone)
        for name in alone:
            assert np.array_equal(shared[name], alone[name], equal_nan=alone[name].dtype != object), name
        for name in alone.rows:
            assert np.array_equal(shared.rows[name], alone.rows[name], equal_nan=True), name
        assert counts[-1] == (300, 300), counts
        again = model.sweep(vary, on=client, shards=5, result=folder, resume=True, **options)
        assert np.array_equal(again["max(y)"], alone["max(y)"], equal_nan=True)
        wrong = [
            (dict(on=client), "result= is needed"),
            (dict(on=client, result=folder), "resume goes on with it"),
            (dict(on=3, result=folder), "on: 3 is neither"),
            (dict(on="pbs", result=folder), "on: `pbs` is not an engine"),
            (dict(shards=3), "shards: on= is needed"),
        ]
        for keywords, words in wrong:
            try:
                model.sweep(vary, **keywords, **options)
            except hyd.Error as error:
                assert words in str(error), error
            else:
                raise AssertionError(keywords)


def check_names_of_classes():
    """Everything says where it comes from."""
    for own in ("Error", "ModelError", "UsageError", "RunError", "Interrupted", "HydWarning", "HydNote"):
        kind = getattr(hyd, own)
        assert (kind.__module__, kind.__qualname__) == ("hyd.errors", own)
    inner = [value for value in vars(hyd._hyd).values() if isinstance(value, type)]
    assert len(inner) >= 7 and all(kind.__module__ == "hyd._hyd" for kind in inner), [kind.__module__ for kind in inner]


def check_runs_that_end_early():
    """A point that the model itself never comes to is the model's affair, whoever asks for it; a solver that gives up is a run's."""
    ended = hyd.load(text="model E parameter Real k = 1; Real x(start = 0, fixed = true); equation der(x) = k; when x > 0.5 then terminate(\"enough\"); end when; end E;")
    gone = hyd.load(text="model G parameter Real k = 1; Real x(start = 1, fixed = true); equation der(x) = k*x^2; end G;")
    calls = [lambda model: model.linearize(at=2, inputs=["k"], outputs=["x"]), lambda model: model.function("x", "k", at=[2])([1]), lambda model: model.function("x", "k", at=[2]).value_and_jacobian([1])]
    for call in calls:
        for model, kind in ((ended, hyd.ModelError), (gone, hyd.RunError)):
            try:
                call(model)
            except hyd.Error as error:
                assert type(error) is kind, (model, error)
            else:
                raise AssertionError(model)


# Last, as both start threads, after which processes are not forked.
def check_jax():
    try:
        import jax
    except ImportError:
        print("jax is not installed; its adapter is not tried")
        return
    jax.config.update("jax_enable_x64", True)
    function = hyd.load(DRIVE).function(["y"], ["p0", "C"], at=[0.005, 0.01])
    own = function.to_jax()
    p = jax.numpy.asarray(function.start)
    values, jacobian = function.value_and_jacobian(function.start)
    assert np.array_equal(own(p), values) and np.array_equal(jax.jit(own)(p), values)
    assert np.allclose(jax.jacfwd(own)(p), jacobian, rtol=1e-12)
    assert np.allclose(jax.jacrev(own)(p), jacobian, rtol=1e-12)
    gradient = jax.grad(lambda x: (own(x) ** 2).sum())(p)
    assert np.allclose(gradient, 2 * values @ jacobian, rtol=1e-12)


def check_torch():
    try:
        import torch
    except ImportError:
        print("torch is not installed; its adapter is not tried")
        return
    function = hyd.load(DRIVE).function(["y"], ["p0", "C"], at=[0.005, 0.01])
    own = function.to_torch()
    p = torch.tensor(function.start, dtype=torch.float64, requires_grad=True)
    values, jacobian = function.value_and_jacobian(function.start)
    result = own(p)
    assert np.array_equal(result.detach().numpy(), values)
    (result**2).sum().backward()
    assert np.allclose(p.grad.numpy(), 2 * values @ jacobian, rtol=1e-12)
    # By PyTorch's own check, against its differences: a model whose solution is known, so that rounding of the run does not matter.
    decay = hyd.load(text="model D Real x(start = s, fixed = true); parameter Real k = 1.5; parameter Real s = 2; equation der(x) = -k*x; end D;")
    exact = decay.function("x", ["k", "s"], at=[0.5, 1], tolerance=1e-11)
    smooth = exact.to_torch()
    at = torch.tensor([1.5, 2.0], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(smooth, (at,), eps=1e-4, atol=1e-6, rtol=1e-6)
    closed = lambda k, s: torch.stack([s * torch.exp(-0.5 * k), s * torch.exp(-k)])
    assert torch.allclose(smooth(at), closed(*at), rtol=1e-9)
    # Through another layer, in a batch of their own, and by an optimiser of PyTorch.
    both = torch.autograd.functional.jacobian(lambda q: smooth(torch.exp(q)), torch.log(at.detach()))
    true = torch.autograd.functional.jacobian(lambda q: closed(*torch.exp(q)), torch.log(at.detach()))
    assert torch.allclose(both, true, rtol=1e-7)
    wanted, guess = closed(torch.tensor(0.7), torch.tensor(1.2)).double(), torch.tensor([1.5, 2.0], dtype=torch.float64, requires_grad=True)
    optimiser = torch.optim.LBFGS([guess], max_iter=60, tolerance_grad=1e-14, tolerance_change=1e-16, line_search_fn="strong_wolfe")

    def loss():
        optimiser.zero_grad()
        value = ((smooth(guess) - wanted) ** 2).sum()
        value.backward()
        return value

    optimiser.step(loss)
    assert torch.allclose(guess.detach(), torch.tensor([0.7, 1.2], dtype=torch.float64), rtol=1e-5), guess
    # Numbers of 32 bits stay so; without a gradient only values are computed; second derivatives are refused.
    single = torch.tensor([1.5, 2.0], dtype=torch.float32, requires_grad=True)
    out = smooth(single)
    assert out.dtype == torch.float32 and torch.allclose(out, closed(*single), rtol=1e-5)
    out.sum().backward()
    assert single.grad.dtype == torch.float32
    with torch.no_grad():
        assert not smooth(at).requires_grad
    (first,) = torch.autograd.grad((smooth(at) ** 2).sum(), at, create_graph=True)
    try:
        first.sum().backward()
        raise AssertionError("a second derivative that is not one")
    except RuntimeError as error:
        assert "once_differentiable" in str(error), error


if __name__ == "__main__":
    for name, check in list(globals().items()):
        if name.startswith("check_"):
            begin = time.perf_counter()
            check()
            print(f"{name[6:]}: {time.perf_counter() - begin:.1f} s", flush=True)
