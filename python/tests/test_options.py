"""Keywords are the options of the command line."""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest

import outcrop
from outcrop import _outcrop, _run

COMMANDS = ["reconstruct", "info", "verify", "compare", "change", "volume", "raster", "simplify", "close", "tiles"]

# Keywords that are no options of these commands: arrays, the display of the progress, and who does the work.
OURS = {"colors", "progress", "executor", "shards"}

# Options that are no keywords: results are not printed but returned.
PRINTED = {"json"}


def keywords(command: str) -> dict[str, Any]:
    parameters = inspect.signature(getattr(outcrop, command)).parameters.values()
    return {p.name: p.default for p in parameters if p.kind is p.KEYWORD_ONLY and p.name not in OURS}


@pytest.mark.parametrize("command", COMMANDS)
def test_keywords_are_the_options(command: str) -> None:
    options = _outcrop.options(command)
    shown = {name.replace("-", "_") for name, _, _, _, hidden, _ in options if not hidden}
    assert set(keywords(command)) == shown - PRINTED


@pytest.mark.parametrize("command", COMMANDS)
def test_keywords_are_in_the_help_of_the_program(command: str, program: Any) -> None:
    text = program(command, "--help").stdout
    shown = set(re.findall(r"^\s+(?:-\w, )?--([a-z-]+)", text, re.MULTILINE)) - {"help"}
    assert {name.replace("-", "_") for name in shown} - PRINTED == set(keywords(command))


@pytest.mark.parametrize("command", COMMANDS)
def test_defaults_are_the_same(command: str) -> None:
    given = keywords(command)
    for name, is_flag, _, default, hidden, _ in _outcrop.options(command):
        if hidden or name in PRINTED:
            continue
        ours = given[name.replace("-", "_")]
        if is_flag:
            assert ours is False, name
        elif default is not None:
            assert str(ours) == default, name
        else:
            assert ours is None or ours is inspect.Parameter.empty, name


@pytest.mark.parametrize("command", COMMANDS)
def test_only_reports_can_be_given_several_times(command: str) -> None:
    repeated = {name for name, _, repeats, *_ in _outcrop.options(command) if repeats}
    assert repeated == ({"report"} if command == "reconstruct" else set())


def test_values_become_words() -> None:
    options: dict[str, object] = {
        "memory": 1 << 30,
        "threads": None,
        "keep_all": False,
        "normals": True,
        "drop_outliers": 5.5,
        "crop": [-1, 0.5, 2, 3],
        "keep_classes": (2, 6),
        "time_limit": 1.5,
        "report": ["a.json", "b.html"],
        "origin": "auto",
        "crs": "EPSG:25832",
    }
    assert _run.words(options) == [
        "--memory=1073741824",
        "--normals",
        "--drop-outliers=5.5",
        "--crop=-1,0.5,2,3",
        "--keep-classes=2,6",
        "--time-limit=1500ms",
        "--report=a.json",
        "--report=b.html",
        "--origin=auto",
        "--crs=EPSG:25832",
    ]
    with pytest.raises(TypeError):
        _run.words({"memory": object()})
