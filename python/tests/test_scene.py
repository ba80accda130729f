"""Scenes: loading, changes, checks, and errors."""

import pickle
import random

import numpy as np
import pytest

import jointplay as jp
from jointplay._link import link_of


def test_every_scene_of_the_program_loads(program):
    named = [line.split()[0] for line in program("scenes").splitlines()]
    assert jp.Scene.names() == named
    for name in named:
        assert jp.Scene.load(name).name == name


def test_a_changed_scene_is_another_one():
    scene = jp.Scene.load("four-bar")
    loose = scene.set(clearance="0.5 mm", friction=0.1)
    assert scene["contact.clearance"] == 1e-4 and scene.changes == {}
    assert loose["contact.clearance"] == 5e-4 and loose["contact.friction"] == 0.1
    assert loose != scene and loose.set(clearance=None, friction=None) == scene
    one = loose.set({"joint.A.clearance": 2e-4, "solver.method": "radau5"})
    assert (one["joint.A.clearance"], one["joint.B.clearance"], one["solver.method"]) == (2e-4, 5e-4, "radau5")


def test_numbers_of_numpy_are_numbers():
    scene = jp.Scene.load("chain")
    for number in [np.float64(0.25), np.float32(0.25), np.int64(0), 0]:
        assert scene.set(friction=number)["contact.friction"] == number
    assert scene.set({"chain.links": np.int64(4)})["chain.links"] == 4


def test_a_number_reaches_the_scene_with_all_its_bits():
    scene = jp.Scene.load("pendulum")
    for clearance in np.random.default_rng(1).uniform(1e-5, 1e-3, 50):
        assert scene.set(clearance=clearance)["contact.clearance"] == clearance


def test_values_that_fit_only_together_are_set_together():
    scene = jp.Scene.load("pendulum")
    radius = scene["contact.ball_radius"]
    changes = {"contact.clearance": 2 * radius, "contact.ball_radius": 10 * radius}
    assert scene.set(changes)["contact.clearance"] == 2 * radius


def test_parameters_are_described():
    parameters = jp.Scene.load("four-bar").parameters
    clearance = parameters["contact.clearance"]
    assert clearance.label == "Clearance" and clearance.text == "0.1 mm" and clearance.value == 1e-4
    assert "ball radius" in clearance.allowed and clearance.range[0] == 0.0 and not clearance.words
    assert "radau5" in parameters["solver.method"].words
    assert {"joint.A.clearance", "joint.B.friction"} <= set(parameters)
    assert all(parameter.help for parameter in parameters.values())


def test_a_scene_survives_pickling(falling):
    for scene in [jp.Scene.load("four-bar").set(clearance="0.5 mm"), jp.Scene.from_toml(falling).set(friction=0.3)]:
        again = pickle.loads(pickle.dumps(scene))
        assert again == scene and again.changes == scene.changes


def test_a_changed_scene_is_saved_with_its_changes(falling, tmp_path):
    for scene in [
        jp.Scene.load("four-bar").set({"joint.A.clearance": 0.37e-3, "contact.friction": 0.11}),
        jp.Scene.from_toml(falling),
    ]:
        file = tmp_path / "folder" / f"{scene.name}.toml"
        scene.save(file)
        saved = jp.Scene.load(file)
        assert file.read_text() == scene.toml == saved.toml and saved.changes == {}
        expected = scene.run("5 ms").hash
        assert saved.run("5 ms").hash == expected == jp.Scene.from_dict(scene.to_dict()).run("5 ms").hash
        assert all(saved[key] == scene[key] for key in scene.parameters)
    assert jp.Scene.load("four-bar").to_dict()["body"][0]["name"] == "crank"
    # Saved again, it replaces the file.
    jp.Scene.from_toml(falling).set(friction=0.2).save(file)
    assert jp.Scene.load(file)["contact.friction"] == 0.2 and jp.Scene.load(file).to_dict()["contact"]["friction"] == 0.2


def test_the_files_that_a_scene_names_are_saved_beside_it(falling, tmp_path):
    mesh = b"solid tetrahedron\n"
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    for face in [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]:
        rows = "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners[list(face)])
        mesh += f"facet normal 0 0 0\nouter loop\n{rows}endloop\nendfacet\n".encode()
    mesh += b"endsolid\n"
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "bob.stl").write_bytes(mesh)
    text = falling.replace("[[joint]]", '[[body.shapes]]\nform = "mesh"\nfile = "parts/bob.stl"\nunit = "mm"\n[[joint]]', 1)
    scene = jp.Scene.from_toml(text, folder=tmp_path)
    scene.set(friction=0.3).save(tmp_path / "copy" / "bob.toml")
    assert (tmp_path / "copy" / "parts" / "bob.stl").read_bytes() == mesh
    again = jp.Scene.load(tmp_path / "copy" / "bob.toml")
    (shape,) = again.geometry()
    assert (shape.body, shape.kind, shape.dimensions) == ("bob", "mesh", {})
    assert np.allclose(shape.vertices[shape.faces].reshape(-1, 3).max(axis=0), 1e-3, rtol=1e-6)
    (tmp_path / "copy" / "parts" / "bob.stl").write_bytes(b"another")
    with pytest.raises(jp.OptionError, match="bob.stl exists already"):
        scene.save(tmp_path / "copy" / "bob.toml")
    assert again["contact.friction"] == 0.3


VOLUMES = {
    "box": lambda d: np.prod(d["size"]),
    "sphere": lambda d: 4 / 3 * np.pi * d["radius"] ** 3,
    "cylinder": lambda d: np.pi * d["radius"] ** 2 * np.linalg.norm(d["to"] - d["from"]),
    "cone": lambda d: np.pi / 3 * d["radius"] ** 2 * np.linalg.norm(d["to"] - d["from"]),
    "capsule": lambda d: np.pi * d["radius"] ** 2 * (np.linalg.norm(d["to"] - d["from"]) + 4 / 3 * d["radius"]),
}


def test_shapes_are_closed_surfaces_of_their_dimensions():
    kinds = set()
    for name in ["spcmm", "governor", "excavator"]:
        scene = jp.Scene.load(name)
        for shape in scene.geometry():
            kinds.add(shape.kind)
            assert shape.body == "world" or shape.body in scene.bodies
            edges = [tuple(face[[i, (i + 1) % 3]].tolist()) for face in shape.faces for i in range(3)]
            assert len(set(edges)) == len(edges) and {(j, i) for i, j in edges} == set(edges), shape
            a, b, c = shape.vertices[shape.faces].transpose(1, 0, 2)
            volume = (a * np.cross(b, c)).sum() / 6
            if shape.kind == "plate":
                corners, thickness = shape.dimensions["corners"], shape.dimensions["thickness"]
                first = corners - corners[0]
                expected = 0.5 * thickness * np.linalg.norm(np.cross(first[1:-1], first[2:]).sum(axis=0))
            else:
                expected = VOLUMES[shape.kind](shape.dimensions)
            # A prism of 16 sides fills 97.4 % of its cylinder; a ball of such rings 94 %.
            assert (0.93 if shape.kind not in ("box", "plate") else 1 - 1e-9) * expected < volume < (1 + 1e-9) * expected, shape
    assert kinds == {"box", "sphere", "cylinder", "cone", "capsule", "plate"}


def test_a_body_without_shapes_has_bars_to_its_joints(hung):
    shapes = [shape for shape in jp.Scene.from_toml(hung).geometry() if shape.body == "link1"]
    assert [shape.kind for shape in shapes] == ["capsule", "capsule", "sphere"]
    assert {tuple(shape.dimensions["to"]) for shape in shapes[:2]} == {(0.0, 0.0, 0.05), (0.0, 0.0, -0.05)}


def test_the_check_counts_bodies_joints_and_degrees_of_freedom():
    check = jp.Scene.load("four-bar").check()
    assert (check.bodies, check.degrees_of_freedom, check.contacts, check.ideal_joints) == (3, 7, 2, 0)
    assert check.warnings == [] and check.doubts == []
    warned = jp.Scene.load("four-bar").set({"solver.method": "rk4", "solver.step": "1 ms"}).check()
    assert warned.warnings


def test_the_check_has_the_warnings_of_the_program(program, tmp_path):
    text = jp.Scene.load("slider-crank").toml
    moved = 'start = "ideal"\n' + text.replace('position = "200 mm"', 'position = "230 mm"')
    file = tmp_path / "moved.toml"
    file.write_text(moved)
    lines = program("check", file).splitlines()
    expected = [line.removeprefix("Warning").strip() for line in lines if line.startswith("Warning")]
    check = jp.Scene.load(file).check()
    assert sorted(check.warnings) == sorted(expected) and any("moved bodies far" in warning for warning in expected)
    assert check.not_unique is None


def test_an_error_in_a_file_names_line_key_and_range(falling):
    text = falling.replace('"0.2 mm"', '"-3 mm"')
    with pytest.raises(jp.SceneError) as caught:
        jp.Scene.from_toml(text, file="falling.toml")
    error = caught.value
    assert isinstance(error, ValueError) and isinstance(error, jp.JointplayError)
    line = text.splitlines().index('clearance = "-3 mm"') + 1
    assert (error.file, error.line, error.key) == ("falling.toml", line, "contact.clearance")
    assert "0 mm to below the ball radius" in error.allowed
    assert str(error).startswith(f"falling.toml:{line}:") and "-3 mm" in error.value
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.line, again.allowed) == (str(error), error.line, error.allowed)


@pytest.mark.parametrize(
    "change, key, message",
    [
        ({"contact.clearence": 1e-4}, "contact.clearence", "did you mean `contact.clearance`?"),
        ({"contact.clearance": "5 kg"}, "contact.clearance", "mm"),
        ({"contact.clearance": -1.0}, "contact.clearance", "allowed 0 mm"),
        ({"joint.A.friction": 99.0}, "joint.A.friction", "allowed"),
    ],
)
def test_a_refused_change_names_key_and_range(change, key, message):
    scene = jp.Scene.load("four-bar")
    with pytest.raises(jp.SceneError) as caught:
        scene.set(change)
    assert caught.value.key == key and message in str(caught.value) and caught.value.line is None
    if "clearence" not in key:
        assert caught.value.allowed.startswith("allowed ")
    assert scene.changes == {}


def test_a_preset_and_a_method_take_the_place_of_each_other_but_do_not_go_together():
    scene = jp.Scene.load("four-bar").set({"solver.preset": "reference"})
    tighter = scene.set({"solver.tolerance": 1e-12})
    assert tighter.changes == {"solver.method": "dopri5", "solver.tolerance": "1e-12"}
    assert tighter.set({"solver.preset": "reference"}).changes == scene.changes
    with pytest.raises(jp.SceneError, match="give a preset, or a method with its number"):
        scene.set({"solver.preset": "accurate", "solver.tolerance": 1e-9})


@pytest.mark.parametrize("value", [True, [1], {}, float("nan"), float("inf"), b"1", object()])
def test_a_value_that_is_no_number_is_refused(value):
    with pytest.raises(jp.OptionError, match="contact.friction"):
        jp.Scene.load("four-bar").set(friction=value)


def test_a_keyword_that_several_parameters_have_is_refused(falling):
    own = '[[parameter]]\nname = "friction"\nlabel = "Own"\nvalue = "1"\nrange = ["0", "2"]\nhelp = "A number."\n'
    scene = jp.Scene.from_toml(f"{falling}\n{own}")
    with pytest.raises(jp.OptionError, match="contact.friction, parameter.friction"):
        scene.set(friction=0.1)
    assert scene.set({"parameter.friction": 0.5})["parameter.friction"] == 0.5


def test_files_that_cannot_be_read_are_named(tmp_path):
    for name in ["fourbar", str(tmp_path / "none.toml"), f"{tmp_path}/"]:
        with pytest.raises(jp.SceneError) as caught:
            jp.Scene.load(name)
        assert name.strip("/") in str(caught.value)


def test_a_machine_that_does_not_close_is_refused_where_it_is_described(falling):
    far = falling.replace('clearance = "0.2 mm"', 'clearance = "0 mm"').replace('"0 0 0 mm" }\nball', '"0 0 90 mm" }\nball')
    with pytest.raises(jp.SceneError) as caught:
        jp.Scene.from_toml(far, file="far.toml").run("1 ms")
    assert caught.value.line == far[: far.index("[[ball_joint]]")].count("\n") + 1


def test_a_scene_shows_its_parameters_or_the_page(monkeypatch):
    scene = jp.Scene.load("four-bar").set(clearance="0.5 mm")
    monkeypatch.delenv("JOINTPLAY_PAGE", raising=False)
    assert "<td>0.5 mm</td>" in scene._repr_html_()
    monkeypatch.setenv("JOINTPLAY_PAGE", "https://example.org/lab/")
    assert 'src="https://example.org/lab/#scene=four-bar&amp;contact.clearance=0.5+mm&amp;embed=controls"' in scene._repr_html_()


def test_a_link_opens_the_same_scene_in_the_program(falling, summary):
    for scene in [jp.Scene.load("four-bar").set(clearance="0.5 mm"), jp.Scene.from_toml(falling).set(friction=0.3)]:
        expected = summary("run", "--link", f"?{link_of(scene.native)}", "--duration", "5ms")
        assert expected["state_hash"] == scene.run("5 ms").hash
        expected = summary("run", "--link", f"?{link_of(scene.native, 0.005)}")
        assert expected["time_s"] >= 0.005


def test_runs_and_simulations_show_the_page_at_their_end(monkeypatch):
    scene = jp.Scene.load("four-bar")
    run, simulation = scene.run("2 ms"), jp.Simulation(scene)
    simulation.step_until("1 ms")
    monkeypatch.delenv("JOINTPLAY_PAGE", raising=False)
    assert "iframe" not in run._repr_html_() + simulation._repr_html_()
    monkeypatch.setenv("JOINTPLAY_PAGE", "https://example.org/")
    assert "#scene=four-bar&amp;t=0.002s&amp;" in run._repr_html_()
    assert "#scene=four-bar&amp;t=0.001s&amp;" in simulation._repr_html_()
    simulation.set("contact.friction", 0.3)
    assert "iframe" not in simulation._repr_html_()


def test_any_malformed_text_raises_only_errors_of_the_package(falling):
    chance = random.Random(3)
    refused = 0
    for _ in range(400):
        text = list(falling)
        for _ in range(chance.randint(1, 3)):
            at = chance.randrange(len(text))
            text[at : at + chance.randint(0, 2)] = chance.choice('"=[]{}.-0e9 \nµ\0x')
        try:
            jp.Scene.from_toml("".join(text)).run("1 ms", every="1 ms", warn=False)
        except jp.SceneError as error:
            refused += 1
            assert str(error)
        except (jp.Stopped, jp.OptionError):
            pass
    assert refused > 100
