"""Every notebook runs from top to bottom, and its assertions hold."""

import ast
import json
from pathlib import Path

import matplotlib
import pytest

matplotlib.use("agg")
from matplotlib import pyplot  # noqa: E402

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"


@pytest.mark.parametrize("notebook", sorted(FOLDER.glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs(notebook, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    book = json.loads(notebook.read_text())
    cells = ["".join(cell["source"]) for cell in book["cells"] if cell["cell_type"] == "code"]
    names = {}
    for number, source in enumerate(cells):
        tree = ast.parse(source)
        # A notebook shows the value of the last expression of a cell.
        shown = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        place = f"{notebook.name}, cell {number}"
        exec(compile(tree, place, "exec"), names)
        if shown is not None:
            value = eval(compile(ast.Expression(shown.value), place, "eval"), names)
            assert value is None or (value._repr_html_() if hasattr(value, "_repr_html_") else repr(value))
    # Each notebook asserts its statements about the results, and plots them.
    assert any("assert " in source for source in cells)
    assert pyplot.get_fignums()
    pyplot.close("all")


def test_notebooks_are_stored_without_outputs():
    assert len(list(FOLDER.glob("*.ipynb"))) >= 5
    # Stored outputs could be those of another version.
    for notebook in FOLDER.glob("*.ipynb"):
        assert all(not cell.get("outputs") for cell in json.loads(notebook.read_text())["cells"]), notebook.name
