"""The Python package where calls are unusual: limits, folders that change, signals, tables of other libraries, warnings as errors, names and words."""
import json
import multiprocessing
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings

import numpy as np
import pandas as pd
import pyarrow as pa
import xarray as xr

import hyd

HYD, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
DRIVE = str(pathlib.Path("models/single_acting_drive/drive.hyd").resolve())
LIMITED = """model Limited
  parameter Real k(min = 0, max = 3) = 1;
  parameter Real twice(max = 4) = 2*k;
  Real x(start = 1, fixed = true);
equation
  der(x) = -k*x;
end Limited;"""
FED = "model Fed input Real u; output Real x(start = 0, fixed = true); equation der(x) = u - x; end Fed;"
LONG = "model Long parameter Real w = 1; Real x(start = 1, fixed = true); Real v(start = 0, fixed = true); equation der(x) = v; der(v) = -w*sin(x); end Long;"


def refused(kind, call, *words):
    """The exception, whose message has these words."""
    try:
        call()
    except kind as error:
        for word in words:
            assert word in str(error), f"{word!r} in {error}"
        return error
    raise AssertionError(f"not refused: {words}")


def check_limits():
    """Limits hold for values that are set at run time and for what follows from them."""
    model = hyd.load(text=LIMITED)
    file = WORK / "limited.mo"
    file.write_text(LIMITED)
    for value, name in ((5, "k"), (-1, "k"), (2.5, "twice")):
        said = subprocess.run([HYD, "simulate", file, "--set", f"k={value}"], capture_output=True, text=True)
        assert said.returncode == 1 and "E0217" in said.stderr
        for call in (lambda: model.simulate(k=value), lambda: model.linearize(at=1, inputs=["k"], k=value), lambda: model.function(["x"], ["x"], k=value)):
            error = refused(hyd.ModelError, call, f"`{name}`")
            assert error.line == (2 if name == "k" else 3)
            assert error.code == "E0217" and error.message in said.stderr, (error.message, said.stderr)
    assert model.simulate(k=2).status == "done"


def check_changed_folder():
    """A translation after `os.chdir`, or with another environment, takes the classes of the first."""
    sized = "model Sized parameter Integer n = 1; Lib.Part part[n]; end Sized;"
    part = "within Lib; model Part Real x(start = {}, fixed = true); equation der(x) = -x; end Part;"
    before = os.getcwd(), os.environ.get("HYD_LIBRARY")
    with tempfile.TemporaryDirectory() as place:
        for folder, start in (("one", 1), ("two", 7)):
            library = pathlib.Path(place) / folder / "libraries" / "Lib"
            library.mkdir(parents=True)
            (library / "package.mo").write_text("package Lib end Lib;")
            (library / "Part.mo").write_text(part.format(start))
            (library / "Other.mo").write_text(part.replace("Part", "Other").format(start))
            (library.parent.parent / "sized.mo").write_text(sized.replace("end Sized", "Lib.Other other if n > 1; end Sized"))
        try:
            os.chdir(pathlib.Path(place) / "one")
            given = hyd.load("sized.mo", library="libraries")
            os.environ["HYD_LIBRARY"] = "libraries"
            found = hyd.load("sized.mo")
            state = pickle.dumps(given)
            os.chdir(pathlib.Path(place) / "two")
            for model in (given, found):
                assert model.file == "sized.mo"
                run = model.simulate(n=3)
                assert run["part[3].x"][0] == 1 and run["other.x"][0] == 1, "the classes of the first folder"
            os.rename(pathlib.Path(place) / "one", pathlib.Path(place) / "gone")
            travelled = pickle.loads(state)
            assert travelled.simulate()["part[1].x"][0] == 1, "texts travel along"
            refused(hyd.ModelError, lambda: travelled.simulate(n=2), "there is no library folder", "one")
        finally:
            os.chdir(before[0])
            os.environ.pop("HYD_LIBRARY")
            if before[1] is not None:
                os.environ["HYD_LIBRARY"] = before[1]


def no_rows(_):
    hyd.load(text="model N Real x(start = 0, fixed = true); Real y; equation der(x) = 1; y = if time >= 0 then sqrt(x - 1) else 1; end N;").simulate()


def check_runs_without_rows():
    """A run that failed before its first row travels between processes."""
    error = refused(hyd.RunError, lambda: no_rows(0))
    assert len(error.run.time) == 0 and error.run.names == ["x", "y", "der(x)"]
    again = pickle.loads(pickle.dumps(error))
    assert again.run.names == error.run.names and len(again.run["x"]) == 0
    refused(hyd.UsageError, lambda: again.run.at(0), "no rows")
    assert len(again.run.to_pandas()) == len(again.run.to_polars()) == len(again.run.to_arrow()) == 0 and "failed" in again.run._repr_html_()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        told = pool.map_async(no_rows, [0])
        assert refused(hyd.RunError, lambda: told.get(60)).run.names == error.run.names


class Alarm(Exception):
    pass


def check_patterns():
    """One pattern of names after the other has its own variables, also where one between them is refused."""
    model = hyd.load(DRIVE)
    for _ in range(2):
        for name in ("y", "p_R"):
            assert model.simulate(variables=f"^{name}$", stop=1e-4).names == [name]
        try:
            model.simulate(variables="(", stop=1e-4)
        except hyd.UsageError as error:
            assert "unclosed group" in str(error), error
        else:
            raise AssertionError("a pattern that is none was taken")


def check_forks():
    """A process that is forked while threads run a model and its function goes on with both."""
    model = hyd.load(DRIVE)
    function = model.function("y", "p0", at=[1e-5])
    expected = function([10e6])
    ended = threading.Event()

    def work(k):
        n = 0
        while not ended.is_set():
            n += 1
            # Patterns that take long, and that no other thread has.
            model.simulate(variables=rf"^y$|\w{{{160 + 8 * (n % 2) + k}}}z", stop=1e-5)
            function([10e6])

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    try:
        for _ in range(60):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DeprecationWarning)
                child = os.fork()
            if child == 0:
                run = model.simulate(variables="^y$", stop=1e-5)
                os._exit(0 if run.names == ["y"] and function([10e6]) == expected else 1)
            begin, ending = time.monotonic(), (0, 0)
            while ending[0] == 0 and time.monotonic() - begin < 20:
                time.sleep(0.002)
                ending = os.waitpid(child, os.WNOHANG)
            if ending[0] == 0:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
            assert ending == (child, 0), "hangs" if ending[0] == 0 else f"ends with {ending[1]}"
    finally:
        ended.set()
        for thread in threads:
            thread.join()


def check_kept_values():
    """Arrays, tables and copies of a run that is gone stay as they were, although later runs of the model use the memory of earlier ones."""
    model = hyd.load(text=LIMITED)

    def made(k):
        run = model.simulate(k=k, stop=1, intervals=100)
        return run["x"], run.to_pandas(), pa.table(run), run.time

    kept = [(k, *made(k)) for k in (0.5, 1.0, 1.5)]
    values = [(x.copy(), time.copy()) for _, x, _, _, time in kept]
    for turn in range(40):
        assert model.simulate(k=1.6 + turn / 100, stop=1, intervals=100)["x"][-1] < 0.21
    for (k, x, frame, table, time), (before, times) in zip(kept, values):
        assert np.array_equal(x, before) and np.array_equal(time, times)
        assert np.allclose(x, np.exp(-k * time), atol=1e-4), k
        assert np.array_equal(frame["x"].to_numpy(), before) and np.array_equal(table["x"].to_numpy(), before)


def check_other_signals():
    """What a handler of a signal raises comes out of the work that it stops."""

    def handle(number, frame):
        raise Alarm

    model = hyd.load(text=LONG)
    function = model.function("x", "w", at=[1e7], tolerance=1e-10)
    before = signal.signal(signal.SIGALRM, handle)
    try:
        for work in (lambda: model.simulate(stop=1e7, tolerance=1e-10), lambda: model.linearize(at=1e7, tolerance=1e-10), lambda: function([1.0])):
            signal.setitimer(signal.ITIMER_REAL, 0.2)
            refused(Alarm, work)
    finally:
        signal.signal(signal.SIGALRM, before)


def check_tables():
    """Recorded inputs of other libraries are those of plain columns."""
    model = hyd.load(text=FED)
    # Eighths of a second are whole numbers of nanoseconds, in which pandas counts.
    times = np.linspace(0, 2, 17)
    values = np.sin(times)
    plain = model.simulate(inputs={"time": times, "u": values}, stop=2)["x"]
    frame = pd.DataFrame({"u": values}, index=pd.to_timedelta(times, unit="s"))
    named = pd.DataFrame({"time": pd.to_timedelta(times, unit="s"), "u": values})
    tables = [frame, frame.rename_axis("time"), named, pa.table({"time": times, "u": values}), xr.Dataset({"u": ("time", values)}, {"time": times})]
    for table in tables:
        assert np.allclose(model.simulate(inputs=table, stop=2)["x"], plain, rtol=1e-9, atol=1e-12), type(table)
    one = model.simulate(inputs={"time": [0, 2], "u": 1.0}, stop=2)
    assert np.allclose(one["x"], 1 - np.exp(-one.time), atol=1e-5)
    source = hyd.load(text="model S Real u; equation u = if time < 1 then 0 else 1; end S;").simulate(stop=2)
    assert abs(model.simulate(inputs=source, stop=2)["x"][-1] - (1 - np.exp(-1))) < 1e-3
    dated = frame.set_axis(pd.Timestamp("2024-01-01") + frame.index)
    for table, words in (
        (dated, "dates"),
        ([1, 2], "list"),
        ({"time": times, "u": values[:3]}, "3 values"),
        ({"time": times, "u": np.zeros((21, 2))}, "2 dimensions"),
        ({"time": times, "u": ["a"] * 21}, "not a number"),
        ({"u": values}, "`time`"),
    ):
        refused(hyd.UsageError, lambda: model.simulate(inputs=table, stop=2), words)


def check_warnings():
    """Warnings are true, all are given, and as errors they lose no work."""
    model = hyd.load(text=FED)
    file = WORK / "fed.mo"
    file.write_text(FED)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert refused(hyd.HydWarning, model.simulate, "input `u`")
        model.simulate(u=1)
        model.sweep({"u": [1, 2]})
        model.linearize(at=1, inputs="u", outputs="x", u=1)
        model.function("x", "u", at=[1])
        extra = {"time": [0, 1], "u": [1, 1], "w": [0, 0]}
        warning = refused(hyd.HydWarning, lambda: model.simulate(inputs=extra, stop=1), "`w`")
        assert warning.result.status == "done" and len(warning.result["x"]) > 2
        drive = hyd.load(DRIVE)
        # Jumps are notes, which are no reason to end.
        assert drive.simulate(stop=0.02).status == "done"
    said = subprocess.run([HYD, "sweep", WORK / "fed.mo", "--vary", "u=1,2", "--result", WORK / "fed_sweep"], check=True, capture_output=True, text=True)
    assert "nothing gives" not in said.stderr, said.stderr
    bad = "model W input Real u; Real x(start = 1, fixed = true); equation der(x) = x^2 + u; end W;"
    with warnings.catch_warnings(record=True):
        warnings.simplefilter("always")
        error = refused(hyd.RunError, lambda: hyd.load(text=bad).simulate(inputs={"time": [0, 3], "u": [0, 0], "w": [0, 0]}, stop=3))
    assert [own["severity"] for own in error.messages] == ["warning", "error"] and "`w`" in error.excerpt
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        hyd.command("simulate", file)
    assert any("input `u`" in str(own.message) for own in caught), caught
    # A module of this name beside the caller is not the command.
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "hyd.py").write_text("raise SystemExit('another module')")
        script = "import os, sys, hyd; os.chdir(sys.argv[1]); print(hyd.command('explain', 'E0402'))"
        environment = {**os.environ, "PYTHONPATH": os.path.dirname(os.path.dirname(hyd.__file__))}
        environment.pop("PYTHONSAFEPATH", None)
        assert "E0402" in subprocess.run([sys.executable, "-c", script, folder], check=True, capture_output=True, text=True, env=environment).stdout


def check_function():
    """Values at an event are those after it; what is wrong with numbers is said; threads see their own values."""
    jump = hyd.load(text="model J parameter Real a = 1; discrete Real y(start = 0, fixed = true); Real x(start = 0, fixed = true); equation der(x) = a; when time >= 0.5 then y = 2*a; end when; end J;")
    values = jump.function(["y", "x"], ["a"], at=[0.25, 0.5, 1])
    assert np.allclose(values.unflatten(values([1])), [[0, 0.25], [2, 0.5], [2, 1]], atol=1e-6), values([1])
    assert np.allclose(values.jacobian([1]).ravel(), [0, 0.25, 2, 0.5, 2, 1], atol=1e-5)
    assert jump.simulate(stop=1).at(0.5)["y"] == 2
    function = hyd.load(text=LIMITED).function("x", "k", at=[0.5, 1])
    again = pickle.loads(pickle.dumps(function))
    assert np.array_equal(again([1.5]), function([1.5])) and again.parameters == ["k"]
    refused(hyd.UsageError, lambda: function.for_scipy([1, 2, 3]), "measured: 3 values")
    refused(hyd.UsageError, lambda: function.for_scipy([1, 2], sigma=[1, 2, 3]), "sigma: 3 values")
    refused(hyd.UsageError, lambda: function([1, 2]), "2 values for 1 parameter")
    refused(hyd.UsageError, lambda: function.for_scipy([1, 2], sigma=0), "greater than 0")
    model = hyd.load(text=LIMITED)
    refused(hyd.UsageError, lambda: model.function([], ["k"]), "outputs")
    refused(hyd.UsageError, lambda: model.function("x", "k", k=2), "`k`", "set")
    problem, wrong = function.for_scipy([0, 0]), []

    def work(k):
        for _ in range(150):
            if not np.allclose(problem.fun(np.array([k])), np.exp(-k * function.at), rtol=1e-3):
                wrong.append(k)

    threads = [threading.Thread(target=work, args=(k,)) for k in (0.5, 1.0, 1.5, 2.0)]
    [own.start() for own in threads]
    [own.join() for own in threads]
    assert not wrong


def check_words():
    """Calls that make no sense end in a sentence of this package."""
    model = hyd.load(text=LIMITED)
    for call, words in (
        (lambda: model.simulate(intervals=2.0), "intervals: 2.0 is not an integer"),
        (lambda: model.simulate(stop="1"), "stop: '1' is not a number"),
        (lambda: model.simulate(solver=1), "solver: 1"),
        (lambda: model.simulate(every_step=3), "every_step: 3"),
        (lambda: model.sweep({"k": [1, 2]}, threads=0), "threads: 0"),
        (lambda: model.sweep({"k": [1, 2]}, seed=-1), "seed: -1"),
        (lambda: model.sweep({"k": [1, 2]}, solver="bdf"), "sweep has no option `solver`"),
        (lambda: model.linearize(at=1, intervals=3), "linearize has no option `intervals`"),
        (lambda: model.linearize(at="a"), "at: 'a'"),
        (lambda: model.sweep({"k": [1, 2]}, k=1), "`k` is varied and set"),
        (lambda: model.sweep({"k": b"12"}), "b'12'"),
        (lambda: model.sweep({"k": {1: 2}}), "{1: 2}"),
        (lambda: model.sweep(), "vary: is missing"),
        (lambda: model.simulate(k=b"1"), "b'1'"),
        (lambda: model.simulate({"k": 1}, k=2), "`k` is set twice"),
        (lambda: model.sweep({"k": [1, 2]}, progress=3), "progress: 3"),
        (lambda: hyd.grid(1, 2, 2.7), "count: 2.7 is not an integer"),
        (lambda: model.simulate(variables="^nothing$"), "nothing"),
    ):
        error = refused(hyd.UsageError, call, words)
        assert "--" not in error.message, error.message
    said = subprocess.run([HYD, "sweep", WORK / "limited.mo", "--vary", "k=1,2", "--set", "k=1", "--result", WORK / "none"], capture_output=True, text=True)
    assert said.returncode == 2 and "`k` is varied and set" in said.stderr, said.stderr
    assert list(hyd.load(text=LIMITED, parameters={"k": 2}).sweep({"k": [1, 1.5]}, stop=1)["k"]) == [1, 1.5]
    assert model.simulate(parameters={"k": 2})["x"][-1] == model.simulate(k=2)["x"][-1]
    assert len(model.sweep(vary={"k": 2})["x"]) == 1
    assert model.sensitivity(by="k").derivative("x", "k")[-1] < 0
    assert model.function(outputs="x", parameters="k")([1]).shape == (1,)
    linear = model.linearize(at=1, inputs="k", outputs="x")
    assert repr(linear) == "<hyd.LinearModel of Limited at 1 s: 1 state, 1 input, 1 output>"
    assert linear.inputs == ["k"] and linear.outputs == ["x"]
    run = model.simulate()
    assert run.units["time"] == "s" and repr(hyd.plot(run, names="x")) == "<hyd.Picture of x>"
    refused(hyd.UsageError, lambda: hyd.plot(run, run, names="x", labels=["a"]), "1 label for 2 runs")
    refused(hyd.UsageError, lambda: hyd.plot(names="x"), "no run")
    swept = model.sweep({"k": [1, 2]}, result=os.path.relpath(WORK / "edges_sweep"))
    assert (swept["x"][swept["status"] == "done"] > 0).all() and (swept["status"] == "done").sum() == 2
    assert os.path.isabs(swept.path)


def check_names_of_files():
    """A folder whose name is no Unicode text."""
    with tempfile.TemporaryDirectory() as place:
        folder = os.path.join(os.fsencode(place), b"\xff")
        try:
            os.mkdir(folder)
        except OSError:
            print("this file system has only names in Unicode")
            return
        file = os.path.join(folder, b"limited.mo")
        with open(file, "w") as stream:
            stream.write(LIMITED)
        model = hyd.load(os.fsdecode(file))
        assert pickle.loads(pickle.dumps(model)).simulate(k=2).status == "done"
        assert "Limited" in hyd.command("check", os.fsdecode(file)) + "Limited"


def check_study():
    """A study travels to other processes and folders."""
    files = "models/single_acting_drive/bench.toml", "tests/data/bench/B02.json"
    study = hyd.study(files[0], bench=files[1], threads=1)
    assert repr(study) == "<hyd.Study of bench.toml and B02.json>"
    before = os.getcwd()
    try:
        os.chdir(WORK)
        assert repr(pickle.loads(pickle.dumps(study))) == repr(study)
    finally:
        os.chdir(before)
    refused(hyd.UsageError, lambda: study.fit(profile=3), "profile: 3")
    refused(hyd.UsageError, lambda: study.discover(calibrate=0), "calibrate: 0")
    refused(hyd.UsageError, lambda: study.next(shots=0), "shots: 0")
    refused(hyd.UsageError, lambda: study.next({"p0": 5e6}), "two ends")
    refused(hyd.ModelError, lambda: study.next({"p1": (5e6, 6e6)}), "no condition `p1`")


def coast(folder):
    """A study of a plain model with a closed form: a mass slowed by a drag that the model lacks."""
    folder.mkdir()
    (folder / "coast.mo").write_text(
        "model Coast\n  parameter Real m(unit = \"kg\") = 2;\n  parameter Real b(unit = \"N.s/m\") = 0.5;\n  parameter Real v0(unit = \"m/s\") = 1;\n"
        "  Real v(unit = \"m/s\", start = v0, fixed = true);\nequation\n  m*der(v) = -b*v;\nend Coast;\n"
    )
    (folder / "study.toml").write_text(
        'file = "coast.mo"\n[models]\ndefault = "Coast"\n[channels]\nv = { variable = "v", noise = 2e-3 }\n'
        '[conditions]\nv0 = "v0_m_s"\n[nuisances]\nm = "m"\nb = "b"\n'
    )
    random = np.random.default_rng(5)
    speeds, times = [1.0, 1.06, 0.95, 1.02], np.linspace(0, 0.2, 201)
    for k, speed in enumerate(speeds):
        e = np.exp(-0.25 * times)
        v = 0.5 * speed * e / (0.5 + 0.2 * speed * (1 - e)) + 2e-3 * random.normal(size=201)
        np.savetxt(folder / f"s{k}.csv", np.column_stack([times, v]), delimiter=",", header="time_s,v", comments="")
    shots = [{"file": f"s{k}.csv", "v0_m_s": speed} for k, speed in enumerate(speeds)]
    (folder / "set.json").write_text(json.dumps({"parameter_tolerance_1sigma": {"m": 0.01, "b": 0.02}, "experiments": shots}))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hyd.HydWarning)
        return hyd.study(folder / "study.toml", bench=folder / "set.json")


def check_next():
    """The shot that makes a size better known."""
    folder = WORK / "next"
    study = coast(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hyd.HydWarning)
        proposal = study.next({"v0": (0.2, 3.0)}, report=folder / "report")
    # A drag shows at speed.
    assert proposal.report["aim"] in ("narrow", "tell apart") and proposal.shots[0]["v0_m_s"] > 2, proposal
    assert "shot 1" in proposal.text and (folder / "report/next.html").stat().st_size > 10_000


def check_search_on_dask():
    """A search by processes that a client of Dask starts has the report of one process; what cannot be shared out is refused."""
    folder = WORK / "search"
    study = coast(folder)
    refused(hyd.UsageError, lambda: study.discover(on="slurm"), "on: report= is needed")
    refused(hyd.UsageError, lambda: study.discover(shards=2), "shards: on= is needed")
    refused(hyd.UsageError, lambda: study.discover(report=folder / "none", on="pbs"), "`pbs` is not an engine")
    refused(hyd.UsageError, lambda: study.discover(report=folder / "none", on="slurm", shards=0), "shards: 0 is not a number of processes")
    try:
        import distributed
    except ImportError:
        print("distributed is not installed; searches on Dask are not tried")
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(WORK / "dask-search"))
        with cluster, distributed.Client(cluster) as client:
            shared = study.discover(report=folder / "shared", on=client, shards=2)
        alone = study.discover(report=folder / "alone")
    for found in (shared, alone):
        assert found.report.pop("seconds") > 0
    assert shared.report == alone.report and alone.report["status"] == "named", alone.report["status"]
    assert not (folder / "shared/search").exists()


if __name__ == "__main__":
    for name, check in list(globals().items()):
        if name.startswith("check_"):
            begin = time.perf_counter()
            check()
            print(f"{name[6:]}: {time.perf_counter() - begin:.1f} s", flush=True)
