"""Falling balls: Ball_drops_data.xls (an OOXML workbook in spite of its name) to one table for each drop.

Usage: balls.py BARE_GIT_DIRECTORY   (of briandesilva/discovery-of-physics-from-data; needs openpyxl)

Times and heights are copied; the velocities of the workbook are differences of its heights and left out.  Weight and circumference
of balls.txt become mass and diameter (1 oz = 0.028349523 kg).  The volleyball, whose weight is unknown, is left out; so is the drop of the orange
perforated ball whose first 0.3 s disagree with every fall (its height falls by 0.24 m in each frame from the second on).
"""

import io
import math
import os
import sys

from openpyxl import load_workbook

from common import blob, noise, rounded, table, write_set

REVISION = "b79c34317f049c9b47aaf2cc4c54c5ec7219f3d7"
OUNCE = 0.028349523
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "balls")
# Sheet, name in balls.txt, name of the file.
BALLS = [
    ("Baseball", "baseball", "baseball"),
    ("Blue Basketball", "bluebasketball", "basketball_blue"),
    ("Green Basketball", "greenbasketball", "basketball_green"),
    ("Bowling Ball", "bowlingball", "bowling_ball"),
    ("Golf Ball", "golfball", "golf_ball"),
    ("Tennis Ball", "tennisball", "tennis_ball"),
    ("Whiffle Ball 1", "wiffleball1", "perforated_1"),
    ("Whiffle Ball 2", "wiffleball2", "perforated_2"),
    ("Yellow Whiffle Ball", "yellowWiffle", "perforated_yellow"),
    ("Orange Whiffle Ball", "orangeWiffle", "perforated_orange"),
]
LEFT_OUT = {("Orange Whiffle Ball", 1)}

sizes = {}
for line in blob(sys.argv[1], REVISION, "data/balls.txt").decode().splitlines()[1:]:
    name, weight, circumference = line.split()
    sizes[name] = (weight, circumference)
book = load_workbook(io.BytesIO(blob(sys.argv[1], REVISION, "data/Ball_drops_data.xls")), data_only=True)
experiments, heights = [], []
for sheet, ball, file in BALLS:
    weight, circumference = (float(word) for word in sizes[ball])
    for drop in (1, 2):
        if (sheet, drop) in LEFT_OUT:
            continue
        rows = [row[1:3] for row in book[sheet].iter_rows(min_row=2, values_only=True) if row[0] == drop]
        name = f"data/{file}_{drop}.csv"
        table(os.path.join(HERE, name), ["time_s", "h_m"], [(f"{t:.6f}", f"{h:.6f}") for t, h in rows])
        heights.append([h for _, h in rows])
        experiments.append(
            {
                "file": name,
                "shot": len(experiments) + 1,
                "m_kg": rounded(weight * OUNCE, 5),
                "d_m": rounded(circumference / 100 / math.pi, 5),
                "h0_m": rounded(rows[0][1], 6),
            }
        )
sigma = noise(heights)
write_set(
    os.path.join(HERE, "set.json"),
    {
        "set": "falling balls",
        "base_model": "balls",
        "sampling_Hz": 15.0,
        "channels": ["h_m"],
        "noise_std": {"h_m": rounded(sigma)},
        "experiments": experiments,
    },
)
print("noise of h_m:", sigma, "m;", len(experiments), "drops")
