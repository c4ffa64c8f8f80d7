"""What a call from Python costs: beside the run itself, and beside other libraries, from keywords to a numpy array.

    python benchmarks/peers/calls.py [--calls 200]

in the root of the repository, with the package `hyd`; FMPy (a unit of the same drive, made by `hyd build --fmu`), CasADi (IDAS, CVODES), diffrax and scipy are
taken where they are installed. Medians over many calls in milliseconds: wall time, and CPU time of the process, which what else the machine does does not change. The
run itself is what the solver's own clock says (CPU time of the process). Before each is measured its result is compared with that of the others.
"""
import argparse
import contextlib
import importlib.metadata
import pathlib
import shutil
import statistics
import tempfile
import time

import numpy as np

import hyd

DRIVE = "models/single_acting_drive/drive.hyd"
ROBERTSON = """model Robertson
  Real a(start = 1, fixed = true);
  Real b(start = 0, fixed = true, nominal = 1e-5);
  Real c(start = 0, fixed = true);
equation
  der(a) = -0.04*a + 1e4*b*c;
  der(b) = 0.04*a - 1e4*b*c - 3e7*b^2;
  der(c) = 3e7*b^2;
end Robertson;"""
PENDULUM = """model Pendulum
  Real x(start = 1, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(x) = v;
  der(v) = -sin(x);
end Pendulum;"""


def timed(call, calls):
    """Medians of wall and CPU time of a call in ms, and what the last one gave."""
    walls, used, result = [], [], None
    call()
    for _ in range(calls):
        wall, cpu = time.perf_counter(), time.process_time()
        result = call()
        walls.append(1e3 * (time.perf_counter() - wall))
        used.append(1e3 * (time.process_time() - cpu))
    return statistics.median(walls), statistics.median(used), result


def line(name, wall, cpu, more=""):
    print(f"| {name} | {wall:.3f} | {cpu:.3f} | {more} |", flush=True)


def head(title):
    print(f"\n{title}\n\n| | wall ms | CPU ms | |\n|---|---:|---:|---|")


def own(name, model, variable, calls, **options):
    """A call of a model, and the part of it that is not the run."""
    beside = []

    def call():
        begin = time.process_time()
        run = model.simulate(**options)
        values = run[variable]
        beside.append(1e3 * (time.process_time() - begin - run.summary["simulate_s"]))
        return values

    wall, cpu, values = timed(call, calls)
    line(name, wall, cpu, f"beside the run {statistics.median(beside):.3f}")
    return wall, values


def other(name, call, calls, expected, limit, first):
    """A call of another library, whose last value must be near ours."""
    wall, cpu, values = timed(call, calls)
    far = np.max(np.abs(np.asarray(values)[-1] - expected[-1])) / max(abs(expected[-1]), 1e-12)
    assert far < limit, f"{name}: {values[-1]} instead of {expected[-1]}"
    line(name, wall, cpu, f"{wall / first:.1f} times as long")


def drive(calls):
    head("The drive, 0.02 s, 500 intervals, tolerance 1e-6, one variable")
    model = hyd.load(DRIVE)
    first, values = own("hyd, all 336 variables recorded", model, "y", calls, p0=15e6, stop=0.02)
    own("hyd, y alone recorded", model, "y", calls, p0=15e6, stop=0.02, variables="^y$")
    try:
        import fmpy
    except ImportError:
        return print("FMPy is not installed")
    folder = pathlib.Path(tempfile.mkdtemp())
    try:
        hyd.command("build", DRIVE, "--fmu", "3.0", "-o", folder / "drive.fmu", "--set", "p0=15e6")
        description = fmpy.read_model_description(str(folder / "drive.fmu"))
        place = fmpy.extract(str(folder / "drive.fmu"), unzipdir=str(folder / "unit"))
        options = dict(
            model_description=description, fmi_type="CoSimulation", stop_time=0.02, output_interval=0.02 / 500, output=["y"], relative_tolerance=1e-6,
        )
        other("FMPy, the unit extracted before", lambda: fmpy.simulate_fmu(place, **options)["y"], max(calls // 4, 5), values, 1e-3, first)
        instance = fmpy.instantiate_fmu(place, description, fmi_type="CoSimulation")
        kept = lambda: fmpy.simulate_fmu(place, fmu_instance=instance, terminate=False, **options)["y"]

        def again():
            instance.reset()
            return kept()

        other("FMPy, the instance kept and reset", again, max(calls // 4, 5), values, 1e-3, first)
        with contextlib.suppress(Exception):
            instance.freeInstance()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def robertson(calls):
    head("Robertson's reaction to 4e5 s, tolerance 1e-6, 500 intervals")
    stop, points = 4e5, np.linspace(0, 4e5, 501)
    first, values = own("hyd", hyd.load(text=ROBERTSON), "a", calls, stop=stop, tolerance=1e-6)
    few = max(calls // 10, 3)
    with contextlib.suppress(ImportError):
        from scipy.integrate import solve_ivp

        def rates(t, y):
            a, b, c = y
            return [-0.04 * a + 1e4 * b * c, 0.04 * a - 1e4 * b * c - 3e7 * b * b, 3e7 * b * b]

        for method in ("BDF", "Radau", "LSODA"):
            solve = lambda: solve_ivp(rates, (0, stop), [1, 0, 0], method=method, rtol=1e-6, atol=1e-10, t_eval=points).y[0]
            other(f"scipy, {method}", solve, few, values, 2e-2, first)
    with contextlib.suppress(ImportError):
        import casadi

        x = casadi.SX.sym("x", 3)
        a, b, c = x[0], x[1], x[2]
        rates = casadi.vertcat(-0.04 * a + 1e4 * b * c, 0.04 * a - 1e4 * b * c - 3e7 * b * b, 3e7 * b * b)
        for name in ("idas", "cvodes"):
            options = {"reltol": 1e-6, "abstol": 1e-10, "max_num_steps": 100_000}
            solver = casadi.integrator("r", name, {"x": x, "ode": rates}, 0, list(points[1:]), options)
            solve = lambda: np.concatenate([[1.0], np.asarray(solver(x0=[1, 0, 0])["xf"])[0]])
            other(f"CasADi, {name.upper()}", solve, few, values, 2e-2, first)
    with contextlib.suppress(ImportError):
        import diffrax
        import jax
        import jax.numpy as jnp

        jax.config.update("jax_enable_x64", True)

        def rates(t, y, _):
            a, b, c = y
            return jnp.stack([-0.04 * a + 1e4 * b * c, 0.04 * a - 1e4 * b * c - 3e7 * b * b, 3e7 * b * b])

        times, control = jnp.asarray(points), diffrax.PIDController(rtol=1e-6, atol=1e-10)

        @jax.jit
        def solved(start):
            solution = diffrax.diffeqsolve(
                diffrax.ODETerm(rates), diffrax.Kvaerno5(), 0.0, stop, 1e-4, start, saveat=diffrax.SaveAt(ts=times), stepsize_controller=control, max_steps=100_000,
            )
            return solution.ys[:, 0]

        other("diffrax, Kvaerno5, compiled before", lambda: np.asarray(solved(jnp.asarray([1.0, 0.0, 0.0]))), few, values, 2e-2, first)


def pendulum(calls):
    head("A pendulum, 100 s, tolerance 1e-8, 500 intervals")
    points = np.linspace(0, 100, 501)
    first, values = own("hyd", hyd.load(text=PENDULUM), "x", calls, stop=100, tolerance=1e-8)
    with contextlib.suppress(ImportError):
        from scipy.integrate import solve_ivp

        for method in ("DOP853", "LSODA"):
            solve = lambda: solve_ivp(lambda t, y: [y[1], -np.sin(y[0])], (0, 100), [1, 0], method=method, rtol=1e-8, atol=1e-8, t_eval=points).y[0]
            other(f"scipy, {method}", solve, max(calls // 10, 3), values, 1e-3, first)


def derivatives(calls):
    head("A function of two parameters: two variables of the drive at ten times")
    function = hyd.load(DRIVE).function(["y", "p_R"], ["p0", "C"], at=np.linspace(0.002, 0.02, 10))
    line("values", *timed(lambda: function(function.start), calls)[:2])
    line("values and Jacobian", *timed(lambda: function.value_and_jacobian(function.start), calls)[:2])


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--calls", type=int, default=200)
    calls = parser.parse_args().calls
    names = []
    for package in ("hyd", "numpy", "scipy", "fmpy", "casadi", "diffrax", "jax"):
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            names.append(f"{package} {importlib.metadata.version(package)}")
    print(", ".join(names))
    drive(calls)
    derivatives(calls)
    robertson(calls)
    pendulum(calls)
