"""Electro-mechanical positioning system: DATA_EMPS.mat and DATA_EMPS_PULSES.mat to tables and windows.

Usage: positioning.py BARE_GIT_DIRECTORY   (of forgi86/sysid-neural-continuous; needs numpy and scipy)

- The reference position is a piecewise parabola (its acceleration is 0 or +-0.84236 m/s^2, to the last digit), so `reference.csv` holds
  the instants at which its acceleration changes, and by how much; position and speed at the beginning of a window go into the set.
- The voltage of the motor is low-passed and decimated by ten as the benchmark's own processing does it with the force
  (Script_IDIM_LS.m: factor round(0.8*500/40) = 10; Chebyshev filter of order 8, 0.05 dB, 0.8 of the new Nyquist frequency, run forwards and
  backwards).  Its gain at frequency zero, 0.9886, is divided out: there both sides of an equation are filtered, here one.  Of the position every tenth sample is kept.
- The noise of the position is that of third differences of the record of 1 kHz, that of the voltage the same times the square root of the share of the band that the
  filter leaves.
- The training record is cut into five windows; the validation record stays whole, for the script that computes the published errors.
- Instants are those of the record of 1 kHz: k/1000 s, to within 0.2 us.
"""

import io
import os
import sys

import numpy
from scipy.io import loadmat
from scipy.signal import cheby1, decimate, freqz

from common import blob, noise, rounded, table, write_set

REVISION = "956aa7ecd73061b0321c6f6098d74c9e4a7ce67a"
FACTOR = 10
STEP = 1e-3
ACCELERATION = 0.84236
WINDOWS = 5
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "positioning")


def record(name):
    content = loadmat(io.BytesIO(blob(sys.argv[1], REVISION, f"examples/EMPS/data/{name}")))
    return {key: value.ravel().astype(float) for key, value in content.items() if not key.startswith("__")}


train, test = record("DATA_EMPS.mat"), record("DATA_EMPS_PULSES.mat")
reference = train["qg"]
assert numpy.abs(reference - test["qg"]).max() < 1e-12
# The acceleration between samples, in steps of its one size; what is between two steps is where a step falls between samples.
bends = numpy.diff(reference, 2) / STEP**2 / ACCELERATION
# The record begins 16 ms after the reference left its rest.
level = round(float(bends[0]))
before = (2 * reference[0] / ACCELERATION) ** 0.5
changes = [(-before, level * ACCELERATION)]
k = 0
while k + 2 < len(bends):
    if abs(bends[k] - level) < 1e-3:
        k += 1
        continue
    # A step at (k + 1 + part) samples shows in the second differences k and k+1: their sum says where within the interval.
    new = round(float(bends[k + 2]))
    part = 1.5 - (bends[k] + bends[k + 1] - 2 * level) / (new - level)
    changes.append(((k + 1 + part) * STEP, (new - level) * ACCELERATION))
    level = new
    k += 2


_, response = freqz(*cheby1(8, 0.05, 0.8 / FACTOR), worN=8192)
response = numpy.abs(response / response[0]) ** 2
share = float(numpy.mean(response**2))
gain = float(decimate(numpy.ones(20000), FACTOR, ftype="iir", zero_phase=True)[1000])


def filtered(values):
    return decimate(values, FACTOR, ftype="iir", zero_phase=True) / gain


levels = {}
for channel, name, part in (("q_m", "qm", 1.0), ("v_V", "vir", share)):
    levels[channel] = noise([train[name].tolist()]) * part**0.5

# Only changes of the acceleration go into the table; the first sample tells position and speed at its instant.
table(os.path.join(HERE, "data", "reference.csv"), ["time_s", "da_mps2"], [(f"{t:.6f}", f"{a:.5f}") for t, a in changes])
pulses = test["pulses_N"]
edges = numpy.flatnonzero(numpy.diff(pulses)) + 1
table(os.path.join(HERE, "data", "pulses.csv"), ["time_s", "pulse"], [(f"{k * STEP:.3f}", f"{pulses[k] - pulses[k - 1]:.0f}") for k in edges])
columns = ["time_s", "q_m", "v_V"]
tables = {}
for name, source in (("train", train), ("test", test)):
    rows = zip(numpy.arange(len(reference))[::FACTOR] * STEP, source["qm"][::FACTOR], filtered(source["vir"]))
    tables[name] = [(f"{t:.2f}", f"{q:.8f}", f"{v:.5f}") for t, q, v in rows]
    table(os.path.join(HERE, "data", f"{name}.csv"), columns, tables[name])
table(
    os.path.join(HERE, "data", "force_1kHz.csv"),
    ["v_train_V", "v_test_V"],
    [(f"{a:.4f}", f"{b:.4f}") for a, b in zip(train["vir"], test["vir"])],
)

experiments = []
length = len(tables["train"]) // WINDOWS
for w in range(WINDOWS):
    part = tables["train"][w * length : (w + 1) * length]
    table(os.path.join(HERE, "data", f"window_{w + 1}.csv"), columns, part)
    first = w * length * FACTOR
    # Position and speed of the reference at the first sample; the speed is that after the sample.
    after = (reference[first + 1] - reference[first]) / STEP
    earlier = (reference[first] - reference[first - 1]) / STEP if first else after - ACCELERATION * STEP
    q = [float(row[1]) for row in part[:3]]
    experiments.append(
        {
            "file": f"data/window_{w + 1}.csv",
            "shot": w + 1,
            "r0_m": float(f"{reference[first]:.9f}"),
            "dr0_mps": float(f"{(after + earlier) / 2:.9f}"),
            "q0_m": float(f"{q[0]:.8f}"),
            "v0_V": float(part[0][2]),
            "begin_s": round(first * STEP, 3),
        }
    )
write_set(
    os.path.join(HERE, "set.json"),
    {
        "set": "electro-mechanical positioning system",
        "base_model": "positioning",
        "sampling_Hz": 1 / STEP / FACTOR,
        "channels": ["q_m", "v_V"],
        "noise_std": {channel: rounded(value) for channel, value in levels.items()},
        "sensor_offset_1sigma": {"q_m": 1e-7},
        "parameter_tolerance_1sigma": {"M": 0.2, "F_v": 0.5, "g": 0.01},
        "experiments": experiments,
    },
)
print("noise:", levels, "share of the band", share, "gain", gain, "changes", len(changes), changes[:6])
# The reference made from the table again, beside the recorded one.
again = numpy.zeros(len(reference))
t = numpy.arange(len(reference)) * STEP
for instant, change in changes:
    again += 0.5 * change * numpy.clip(t - instant, 0, None) ** 2
print("largest difference of reference and table:", numpy.abs(again - reference).max(), "m")
