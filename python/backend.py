"""Builds the package: maturin's build backend, and beforehand the programs that stand beside the extension in `hyd/bin`.

These are the launcher, of which executables of `hyd build` are copies, and the library of units for other tools. They are built with the profile of
the extension; HYD_LAUNCHER and HYD_UNIT name files that are taken instead.
"""
import json
import os
import pathlib
import shlex
import shutil
import subprocess
import sys

import maturin
from maturin import build_sdist, get_requires_for_build_sdist, get_requires_for_build_wheel, prepare_metadata_for_build_wheel  # noqa: F401

HERE = pathlib.Path(__file__).resolve().parent
#: Package, file, and the variable that names another file.
PROGRAMS = [
    ("hyd-launcher", "hyd-launcher.exe" if os.name == "nt" else "hyd-launcher", "HYD_LAUNCHER"),
    ("hyd-unit", {"win32": "hyd_unit.dll", "darwin": "libhyd_unit.dylib"}.get(sys.platform, "libhyd_unit.so"), "HYD_UNIT"),
]


def profile():
    """The profile that maturin builds with."""
    words = shlex.split(os.environ.get("MATURIN_PEP517_ARGS", ""))
    for k, word in enumerate(words):
        if word == "--profile" and k + 1 < len(words):
            return words[k + 1]
        if word.startswith("--profile="):
            return word.partition("=")[2]
    return "release"


def programs():
    """Puts the programs into `hyd/bin`."""
    place = HERE / "hyd" / "bin"
    place.mkdir(exist_ok=True)
    wanted = profile()
    missing = [package for package, _, variable in PROGRAMS if not os.environ.get(variable)]
    folder = None
    if missing:
        chosen = [word for package in missing for word in ("-p", package)]
        subprocess.run(["cargo", "build", "--locked", "--profile", wanted, *chosen], cwd=HERE, check=True)
        told = subprocess.run(["cargo", "metadata", "--format-version=1", "--no-deps"], cwd=HERE, check=True, stdout=subprocess.PIPE)
        folder = pathlib.Path(json.loads(told.stdout)["target_directory"]) / ("debug" if wanted == "dev" else wanted)
    for _, file, variable in PROGRAMS:
        named = os.environ.get(variable)
        shutil.copy2(pathlib.Path(named) if named else folder / file, place / file)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    programs()
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    programs()
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)


get_requires_for_build_editable = maturin.get_requires_for_build_editable
prepare_metadata_for_build_editable = maturin.prepare_metadata_for_build_editable
