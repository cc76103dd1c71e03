"""The notebook of the documentation: its cells run, and no machine is named in it."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import pytest


def test_the_cells_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = os.environ.get("OUTCROP_NOTEBOOK")
    if not name:
        pytest.skip("OUTCROP_NOTEBOOK, the path of the notebook, is not set")
    text = Path(name).read_text()
    assert len(text) < 300_000
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    shown = json.dumps([{**cell, "outputs": [without_pictures(o) for o in cell["outputs"]]} for cell in cells])
    assert not re.search(r"/(tmp|home|root|work|usr)\b", shown)
    assert all(cell["execution_count"] == n for n, cell in enumerate(cells, 1))
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for cell in cells:
        exec("".join(cell["source"]), names)
    assert names["verdict"]["manifold"]


def executed(cells: list[str], folder: Path) -> list[dict[str, Any]]:
    """What the cells show in a kernel of Jupyter."""
    nbclient = pytest.importorskip("nbclient")
    nbformat: Any = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")

    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    client = nbclient.NotebookClient(book, timeout=300, resources={"metadata": {"path": str(folder)}})
    client.execute()
    return [output for cell in book.cells for output in cell.outputs]


def test_the_cells_run_in_jupyter(tmp_path: Path) -> None:
    name = os.environ.get("OUTCROP_NOTEBOOK")
    if not name:
        pytest.skip("OUTCROP_NOTEBOOK, the path of the notebook, is not set")
    cells = [cell for cell in json.loads(Path(name).read_text())["cells"] if cell["cell_type"] == "code"]
    outputs = executed(["".join(cell["source"]) for cell in cells], tmp_path)
    assert any("base64," in text for o in outputs for text in [str(o.get("data", {}).get("text/html"))])


CELLS = [
    "import sys, outcrop, numpy as np; random = np.random.default_rng(1)",
    "points = random.normal(size=(5000, 3)); points /= np.linalg.norm(points, axis=1, keepdims=True)",
]


@pytest.mark.parametrize("widgets", [True, False])
def test_notebooks_show_progress_by_default(tmp_path: Path, widgets: bool) -> None:
    if widgets:
        pytest.importorskip("ipywidgets")
    pytest.importorskip("tqdm")
    first = "pass" if widgets else "import sys; sys.modules['ipywidgets'] = None"
    quiet = executed([first, *CELLS, "m = outcrop.reconstruct(points, memory='256MiB', quiet=True)"], tmp_path)
    assert quiet == []
    shown = executed([first, *CELLS, "m = outcrop.reconstruct(points, memory='256MiB')"], tmp_path)
    if widgets:
        bars = [o for o in shown if "application/vnd.jupyter.widget-view+json" in o.get("data", {})]
        # Each stage has a bar, as text where there is no browser.
        assert any("cells" in str(o["data"]["text/plain"]) for o in bars), shown
    else:
        text = "".join(o.get("text", "") for o in shown)
        assert "cells" in text and "Warning" not in text, text


def without_pictures(output: dict[str, Any]) -> dict[str, Any]:
    data = output.get("data", {})
    return {**output, "data": {kind: re.sub("base64,[^\"]*", "", str(text)) for kind, text in data.items()}}
