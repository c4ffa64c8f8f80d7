"""What a call from Python costs beside the run itself: medians over many calls, in milliseconds.

The run itself is what the solver's own clock says (`simulate_s`, CPU time of the process); a call is CPU time, too, from keywords to a numpy array of one variable, so that
what else the machine does is not counted.  Beside it `scipy.integrate.solve_ivp`
on the same equations (Robertson's reaction and a pendulum, both in numpy-free Python functions), from its call to the array.
"""
import statistics
import time

import numpy as np
from scipy.integrate import solve_ivp

import hyd

CALLS = 200
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


def timed(call, calls=CALLS):
    """Median CPU time of a call in ms, and what the last one gave."""
    times, result = [], None
    for _ in range(calls):
        begin = time.process_time()
        result = call()
        times.append(1e3 * (time.process_time() - begin))
    return statistics.median(times), result


def beside(name, model, variable, **options):
    """A call of a model, and the part of it that is not the run."""
    runs, calls = [], []
    for k in range(CALLS):
        begin = time.process_time()
        run = model.simulate(**options)
        values = run[variable]
        calls.append(1e3 * (time.process_time() - begin))
        runs.append(1e3 * run.summary["simulate_s"])
        assert len(values) > 1
    own = statistics.median(call - run for call, run in zip(calls, runs))
    print(f"{name:40} call {statistics.median(calls):8.3f} ms   run {statistics.median(runs):8.3f} ms   beside it {own:7.3f} ms", flush=True)
    return statistics.median(calls)


def robertson(t, y):
    a, b, c = y
    return [-0.04 * a + 1e4 * b * c, 0.04 * a - 1e4 * b * c - 3e7 * b * b, 3e7 * b * b]


if __name__ == "__main__":
    drive = hyd.load(DRIVE)
    beside("drive, 20 ms, 500 rows", drive, "y", p0=15e6, stop=0.02)
    beside("drive, 20 ms, y and p_R", drive, "y", p0=15e6, stop=0.02, variables="^(y|p_R)$")
    function = drive.function(["y", "p_R"], ["p0", "C"], at=np.linspace(0.002, 0.02, 10))
    call, _ = timed(lambda: function(function.start))
    both, _ = timed(lambda: function.value_and_jacobian(function.start))
    print(f"{'function of p0 and C at 10 times':40} values {call:6.3f} ms   values and Jacobian {both:8.3f} ms")
    own = beside("Robertson to 4e5 s, 1e-6", hyd.load(text=ROBERTSON), "a", stop=4e5, tolerance=1e-6)
    points = np.linspace(0, 4e5, 501)
    for method in ("BDF", "Radau", "LSODA"):
        other, _ = timed(lambda: solve_ivp(robertson, (0, 4e5), [1, 0, 0], method=method, rtol=1e-6, atol=1e-10, t_eval=points).y[0], 20)
        print(f"{'  scipy ' + method:40} call {other:8.3f} ms   {other / own:.0f} times as long")
    own = beside("pendulum, 100 s, 1e-8", hyd.load(text=PENDULUM), "x", stop=100, tolerance=1e-8)
    points = np.linspace(0, 100, 501)
    for method in ("DOP853", "LSODA"):
        other, _ = timed(lambda: solve_ivp(lambda t, y: [y[1], -np.sin(y[0])], (0, 100), [1, 0], method=method, rtol=1e-8, atol=1e-8, t_eval=points).y[0], 20)
        print(f"{'  scipy ' + method:40} call {other:8.3f} ms   {other / own:.0f} times as long")
