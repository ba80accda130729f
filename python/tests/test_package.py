"""The installed package: typed, documented, and consistent with its documents."""

import argparse
import ast
import inspect
import os
import re
import subprocess
import sys
from importlib import import_module, metadata
from pathlib import Path

import distributed
import pytest

import jointplay as jp
from jointplay import __main__ as main
from jointplay import _native

ROOT = Path(__file__).resolve().parents[2]
FOLDER = Path(jp.__file__).parent


def test_the_installed_package_is_tested():
    assert FOLDER.parent.name == "site-packages"
    assert (FOLDER / "py.typed").exists()
    wheel = metadata.distribution("jointplay").read_text("WHEEL")
    assert re.search(r"^Tag: cp310-abi3-", wheel, re.MULTILINE), wheel
    version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)
    assert metadata.version("jointplay") == version[1] == jp.__version__


def test_no_graphics_library_is_in_the_wheel():
    library = next(FOLDER.glob("_native*.so")).read_bytes()
    for name in [b"wgpu", b"libvulkan", b"libEGL", b"winit"]:
        assert name not in library, name


def test_stubs_match_the_library():
    tree = ast.parse((FOLDER / "_native.pyi").read_text())

    def public(names):
        return {name for name in names if not name.startswith("_")}

    stubs = [node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))]
    assert public(node.name for node in stubs) == public(vars(_native))
    for node in stubs:
        if isinstance(node, ast.ClassDef):
            methods = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
            assert public(methods) == public(vars(getattr(_native, node.name))), node.name


def test_everything_public_is_documented():
    for name in jp.__all__:
        thing = getattr(jp, name)
        assert inspect.getdoc(thing), name
        if not inspect.isclass(thing):
            continue
        for member, value in vars(thing).items():
            if not member.startswith("_") and (callable(value) or isinstance(value, (property, staticmethod, classmethod))):
                assert inspect.getdoc(getattr(thing, member)), f"{name}.{member}"


def test_every_option_has_a_name():
    # Misspelt options are refused by type checkers, and `help` shows all. `Scene.set` takes the names of parameters.
    functions = [getattr(jp, name) for name in jp.__all__ if callable(getattr(jp, name))]
    methods = [one for thing in functions if inspect.isclass(thing) for one in vars(thing).values() if inspect.isfunction(one)]
    named = [one for one in functions + methods if inspect.isfunction(one) and not one.__name__.startswith("_")]
    assert len(named) > 30
    for one in named:
        kinds = {parameter.kind for parameter in inspect.signature(one).parameters.values()}
        assert inspect.Parameter.VAR_KEYWORD not in kinds or one is jp.Scene.set, one
    assert "duration" in inspect.signature(jp.sweep).parameters
    with pytest.raises(TypeError, match="duraton"):
        jp.sweep(jp.Scene.load("pendulum"), {"contact.clearance": [1e-4]}, duraton="1 ms")


@pytest.mark.parametrize("name", ["sensitivity", "tolerance"])
def test_functions_and_commands_have_the_same_defaults(name):
    parser = argparse.ArgumentParser()
    import_module(f"jointplay._{name}_command").add_arguments(parser)
    defaults = {action.dest: action.default for action in parser._actions}
    shared = [one for one in inspect.signature(getattr(jp, name)).parameters.values() if one.name in defaults]
    shared = [one for one in shared if one.name not in ("scene", "over", "yield_")]
    assert len(shared) >= 6
    for parameter in shared:
        assert parameter.default == defaults[parameter.name], parameter.name


def test_commands_of_the_program_are_named_as_such(program, capsys):
    listed = re.findall(r"^  ([a-z]+) ", program("--help").partition("Commands:")[2].partition("Options:")[0], re.MULTILINE)
    assert set(listed) - {"help"} == set(main.OF_PROGRAM)
    assert not set(main.COMMANDS) & set(main.OF_PROGRAM)
    assert main.main(["sweep", "four-bar"]) == 2
    assert "`sweep` is a command of the program: `./run sweep …` or `jointplay sweep …`" in capsys.readouterr().err


def test_a_missing_library_is_named_with_its_extra(monkeypatch):
    run = jp.Scene.load("pendulum").run("1 ms", every="0.1 ms")
    for name, extra, use in [
        ("pandas", "pandas", run.to_pandas),
        ("pandas", "pandas", run.impacts_to_pandas),
        ("xarray", "xarray", run.to_xarray),
        ("matplotlib", "studies", lambda: run.plot("S1.normal")),
        ("scipy", "studies", lambda: jp.compare(run, dict(run), ["S1.normal"], cutoff=100.0)),
    ]:
        with monkeypatch.context() as lacking:
            for known in [one for one in sys.modules if one == name or one.startswith(f"{name}.")]:
                lacking.setitem(sys.modules, known, None)
            lacking.setitem(sys.modules, name, None)
            with pytest.raises(jp.OptionError, match=rf"needs {name}: pip install 'jointplay\[{extra}\]'"):
                use()


def test_documents_use_commands_and_options_of_the_package_that_exist():
    used = 0
    for document in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        lines = re.findall(r"^(?:\./run lab|python -m jointplay) ([a-z]+)([^#\n]*)", document.read_text(), re.MULTILINE)
        for command, rest in lines:
            words = [sys.executable, "-P", "-m", "jointplay", command, "--help"]
            shown = subprocess.run(words, capture_output=True, text=True, check=False)
            assert shown.returncode == 0, f"{document.name}: {command}"
            for option in re.findall(r"--[a-z-]+", rest):
                assert re.search(rf"{option}\b", shown.stdout), f"{document.name}: {command} {option}"
            used += 1
    assert used > 0


def blocks(document):
    return re.findall(r"^```python\n(.*?)^```", (ROOT / "docs" / document).read_text(), re.MULTILINE | re.DOTALL)


def test_the_examples_of_the_document_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    examples = blocks("python.md")
    assert len(examples) >= 5
    names = {}
    for block in examples:
        exec(compile(block, "docs/python.md", "exec"), names)
    assert "contact.clearance -3 mm allowed 0 mm" in capsys.readouterr().out
    assert os.listdir(tmp_path) == []


def test_the_example_for_clusters_runs(monkeypatch, tmp_path):
    block = blocks("cluster.md")[0]
    # Smaller, and on a local cluster.
    smaller = block.replace('"0.01mm..1mm:200"', '"0.01mm..1mm:3"').replace("periods=100, discard=40", "periods=3, discard=1")
    assert smaller.count(':3"') == 1 and "periods=3" in smaller
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, local_directory=str(tmp_path)
    ) as cluster:
        names = {"cluster": cluster}
        exec(compile(smaller.replace('"scheduler:8786"', "cluster"), "docs/cluster.md", "exec"), names)
    assert names["result"]["status"].tolist() == [0, 0, 0]


def test_no_modules_import_each_other_in_a_circle():
    # Deferred imports and those for types, too.
    imports = {}
    for file in FOLDER.glob("*.py"):
        nodes = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.ImportFrom) and node.level == 1]
        imports[file.stem] = {node.module or alias.name for node in nodes for alias in node.names} - {"_native"}
    while imports:
        leaves = {name for name, used in imports.items() if not used & imports.keys()}
        assert leaves, f"a circle among {sorted(imports)}"
        imports = {name: used for name, used in imports.items() if name not in leaves}
