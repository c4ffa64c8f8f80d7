"""Silverbox: SNLS80mV.csv to a training record and a test record.

Usage: silverbox.py BARE_GIT_DIRECTORY   (of biaslab/nsi-silverbox; standard library only)

Numbers are copied as they stand.  The test record is the noise whose size grows (the "arrow", samples 1 to 40,000), the training record 16,384 samples of the
multisines behind it.  Sample k is at the time k/610.35 s (10 MHz over 2^14).

The position swings with a period of nine samples, which third differences do not leave out; tenth ones leave 0.4 mV, still more the signal than the
noise.  `hyd bench import` finds the same, and says that it is at most that.
"""

import csv
import io
import math
import os
import sys

from common import blob, rounded, table, write_set

REVISION = "728f07e4539d4f7da76a4778b52a756260b488ac"
RATE = 1e7 / 2**14
TEST = range(0, 40000)
TRAIN = range(40576, 40576 + 16384)
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "silverbox")

text = blob(sys.argv[1], REVISION, "data/Silverbox/SNLS80mV.csv").decode()
rows = [(row["V1"], row["V2"]) for row in csv.DictReader(io.StringIO(text)) if row["V1"]]
assert len(rows) == 131072
header = ["u_V", "y_V"]
table(os.path.join(HERE, "data", "train.csv"), header, [rows[k] for k in TRAIN])
table(os.path.join(HERE, "data", "test.csv"), header, [rows[k] for k in TEST])
ORDER = 10
rest = [float(rows[k][1]) for k in TRAIN]
for _ in range(ORDER):
    rest = [after - before for before, after in zip(rest, rest[1:])]
# White noise of standard deviation s has differences of this order of s times the root of a binomial coefficient.
sigma = math.sqrt(sum(d * d for d in rest) / len(rest) / math.comb(2 * ORDER, ORDER))
write_set(
    os.path.join(HERE, "set.json"),
    {
        "set": "silverbox",
        "base_model": "silverbox",
        "sampling_Hz": RATE,
        "channels": ["y_V"],
        "noise_std": {"y_V": rounded(sigma)},
        "experiments": [{"file": "data/train.csv"}],
    },
)
print("noise of y_V:", sigma, "V")
