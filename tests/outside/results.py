"""Result files of `hyd simulate` read back by the programs that people use: every number must be the same in all formats."""
import json
import pathlib
import subprocess
import sys

import DyMat
import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow
import pyarrow.parquet as parquet
import scipy.io

HYD, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
MODELS = pathlib.Path("models").resolve()
CASES = ["single_acting_drive/drive.hyd", "single_acting_drive/rlclocked.hyd", "hydraulic_line/line.hyd"]


def simulate(model, result, *options):
    command = [HYD, "simulate", MODELS / model, "--result", result, *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def check_mat(path, table):
    mat = DyMat.DyMatFile(str(path))
    names = set(mat.names())
    for name in table.columns[1:]:
        if name not in names:  # protected variables are left out
            continue
        values = mat.data(name)
        if mat.block(name) == 2:
            assert np.array_equal(values, table[name].to_numpy()), f"{path}: {name}"
        else:
            assert np.all(values[0] == table[name]), f"{path}: {name}"
    assert len(names) > 0.9 * len(table.columns), f"{path}: {len(names)} names"
    raw = scipy.io.loadmat(path)
    assert raw["Aclass"][3].strip() == "binTrans"
    assert np.array_equal(raw["data_2"][0], table["time"]), "the time is the first row of data_2"
    assert list(raw["data_1"][0]) == [table["time"].iloc[0], table["time"].iloc[-1]], "start and stop in data_1"
    # Names are stored by columns: the k-th letters of all names make one string.
    by_column = {"".join(letters).strip() for letters in zip(*raw["name"])}
    assert all(len(letters) == raw["dataInfo"].shape[1] for letters in raw["name"])
    assert names <= by_column, f"{path}: DyMat and scipy read different names"
    # Aliases are stored once: fewer rows than names.
    assert raw["data_1"].shape[0] + raw["data_2"].shape[0] < raw["dataInfo"].shape[1] + 2


def check_parquet(path, table):
    by_pandas, by_polars = pd.read_parquet(path), pl.read_parquet(path)
    assert list(by_pandas.columns) == list(table.columns) == by_polars.columns
    assert np.array_equal(by_pandas.to_numpy(), table.to_numpy(), equal_nan=True)
    assert np.array_equal(by_polars.to_numpy(), table.to_numpy(), equal_nan=True)
    by_duckdb = duckdb.sql(f"select * from read_parquet('{path}')").fetchnumpy()
    assert all(np.array_equal(by_duckdb[name], table[name].to_numpy()) for name in table.columns)
    # A column alone, and some whose pages are shared, each by its own way of reading.
    some = [table.columns[k] for k in (0, len(table.columns) // 2, -1)]
    for names in ([name] for name in some):
        assert np.array_equal(pd.read_parquet(path, columns=names).to_numpy(), table[names].to_numpy())
        assert np.array_equal(pl.scan_parquet(path).select(names).collect().to_numpy(), table[names].to_numpy())
    for options in ({"pre_buffer": True}, {"pre_buffer": False, "use_threads": False}):
        assert parquet.read_table(path, **options).column_names == list(table.columns)
    about = parquet.read_metadata(path)
    for key in (b"units", b"descriptions", b"parameters"):
        assert isinstance(json.loads(about.metadata[key]), dict)
    chunks = [about.row_group(0).column(k) for k in range(about.num_columns)]
    assert {chunk.compression for chunk in chunks} == {"ZSTD"}
    assert {chunk.encodings for chunk in chunks} == {("BYTE_STREAM_SPLIT",)}
    # Aliases are stored once.
    assert len({chunk.data_page_offset for chunk in chunks}) < about.num_columns


def check_sizes(parquet_file, csv_file):
    text = pyarrow.compress(csv_file.read_bytes(), codec="zstd", asbytes=True)
    size = parquet_file.stat().st_size
    print(f"{parquet_file.name}: {size} bytes, the text compressed by zstd {len(text)}")
    assert size < len(text), f"{parquet_file} is larger than the text compressed by zstd"


def check_linear(model, time):
    """The linear model by scipy, and its eigenvalues by numpy's own solver."""
    paths = [WORK / f"linear.{kind}" for kind in ("json", "mat")]
    for path in paths:
        command = [HYD, "linearize", MODELS / model, "--at", str(time), "--result", path]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    linear, mat = json.loads(paths[0].read_text()), scipy.io.loadmat(paths[1])
    for name in ("A", "eigenvalues"):
        assert np.array_equal(mat[name], np.array(linear[name])), name
    assert [name.strip() for name in mat["xName"]] == linear["states"]
    ours = np.array([complex(re, im) for re, im in linear["eigenvalues"]])
    theirs = list(np.linalg.eigvals(mat["A"]))
    for value in ours:
        k = int(np.argmin(np.abs(np.array(theirs) - value)))
        assert abs(theirs.pop(k) - value) <= 1e-8 * max(abs(value), np.abs(ours).max() * 1e-6), f"{model}: {value}"
    print(f"{model}: {len(ours)} eigenvalues at {time} s agree with numpy")


def check_sweep():
    """Rows and members of a sweep with their units; what was measured is what the rows show."""
    folder = WORK / "swept"
    model = MODELS / "single_acting_drive/drive.hyd"
    command = [HYD, "sweep", model, "--vary", "p0=8e6:20e6:4", "--variables", "^(y|p_R|i)$", "--rows", "--stop", "0.02", "--result", folder]
    measures = ["max(y)", "min(i)", "when(y > 2e-3)"]
    subprocess.run([*command, *(part for text in measures for part in ("--measure", text))], check=True, stdout=subprocess.DEVNULL)
    members, rows = (pd.read_parquet(folder / f"{name}.parquet") for name in ("members", "rows"))
    assert list(pl.read_parquet(folder / "members.parquet").columns) == list(members.columns)
    units = json.loads(parquet.read_metadata(folder / "rows.parquet").metadata[b"units"])
    assert units == {"y": "m", "p_R": "Pa", "i": "A"}, units
    by_member = rows.groupby("member")
    # Rows stand at output points only, so what is measured within the steps lies at most a little further out.
    for name, extreme in (("max(y)", by_member["y"].max()), ("min(i)", by_member["i"].min())):
        span = by_member[name[4]].max() - by_member[name[4]].min()
        beyond = np.abs(members[name] - extreme) / span
        assert np.all(beyond < 2e-3), f"{name}: {beyond.tolist()}"
    for member, group in by_member:
        t, y = group["time"].to_numpy(), group["y"].to_numpy()
        k = int(np.argmax(y > 2e-3))
        first = t[k - 1] + (2e-3 - y[k - 1]) / (y[k] - y[k - 1]) * (t[k] - t[k - 1])
        assert abs(members["when(y > 2e-3)"][member] - first) < 0.1 * (t[k] - t[k - 1])
    print("sweep: rows, members and measures read by pandas and polars agree")


def main():
    check_sweep()
    check_linear("single_acting_drive/drive.hyd", 0.004)
    check_linear("servo_drive/drive.hyd", 0.05)
    for model in CASES:
        files = {kind: WORK / f"{pathlib.Path(model).stem}.{kind}" for kind in ("csv", "mat", "parquet")}
        for path in files.values():
            simulate(model, path)
        table = pd.read_csv(files["csv"])
        check_mat(files["mat"], table)
        check_parquet(files["parquet"], table)
        check_sizes(files["parquet"], files["csv"])
        print(f"{model}: {len(table)} rows of {len(table.columns)} columns agree in csv, mat and parquet")


main()
