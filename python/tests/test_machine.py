"""Machines built in code equal their scene files."""

import numpy as np
import pytest

import jointplay as jp


def chain(links, clearance):
    """A hanging chain of 100 mm links joined by balls with clearance, m."""
    bodies = [{"name": f"L{i}", "mass": 0.1, "inertia": [1e-5, 1e-4, 1e-4]} for i in range(links)]
    joints = [
        {"name": f"L{i}", "kind": "free", "child": f"L{i}", "start": {"position": np.array([0, 0, -0.05 - 0.1 * i])}}
        for i in range(links)
    ]
    sockets = [{"body": f"L{i - 1}", "at": (0, 0, -0.05)} if i else {"body": "world"} for i in range(links)]
    balls = [
        {"name": f"S{i}", "socket": socket, "ball": {"body": f"L{i}", "at": (0, 0, 0.05)}} for i, socket in enumerate(sockets)
    ]
    return {
        "name": "links",
        "gravity": {"z": -9.81},
        "contact": {"clearance": clearance, "friction": np.float64(0.1)},
        "body": bodies,
        "joint": joints,
        "ball_joint": balls,
    }


def test_a_machine_in_code_is_its_scene_file():
    scene = jp.Scene.from_dict(chain(3, 2e-4))
    assert scene.ball_joints == ["S0", "S1", "S2"] and scene["contact.clearance"] == 2e-4
    assert "[[body]]" in scene.toml and 'mass = "0.1 kg"' in scene.toml
    run = scene.run("30 ms", channels=["*.normal"], warn=False)
    assert run.hash == jp.Scene.from_toml(scene.toml).run("30 ms", warn=False).hash
    # The chain falls through its play, then hangs.
    assert run["S0.normal"][0] == 0.0 and run["S0.normal"].max() > 3 * 0.1 * 9.81


def test_every_kind_of_number_has_its_unit():
    machine = chain(2, 1e-4)
    machine["parameter"] = [{"name": "pull", "label": "Pull", "value": "2 N", "range": ["0 N", "5 N"], "help": "A force."}]
    machine["spring"] = [
        {"name": "s", "from": {"body": "world", "at": [0.0, 0.1, 0.0]}, "to": {"body": "L1"}, "length": 0.2, "stiffness": 50}
    ]
    machine["load"] = [{"name": "wind", "on": {"body": "L1"}, "force": ["pull", 0, 0]}]
    machine["body"][0]["shapes"] = [{"form": "capsule", "from": (0, 0, -0.05), "to": (0, 0, 0.05), "radius": 0.004}]
    machine["solver"] = {"method": "rk4", "step": 1e-6}
    scene = jp.Scene.from_dict(machine)
    assert scene["solver.step"] == 1e-6 and scene["parameter.pull"] == 2.0
    assert scene["spring.s.stiffness"] == 50.0 and scene["spring.s.length"] == 0.2


def test_a_number_of_a_joint_has_the_unit_of_its_coordinate():
    inertia = [1e-3, 1e-3, 1e-3]
    axes = {"axis": [0, 0, 1]}
    machine = {
        "body": [{"name": name, "mass": 1.0, "inertia": inertia} for name in ("arm", "block", "tube", "wheel", "cam")],
        "joint": [
            {"name": "hinge", "kind": "revolute", "child": "arm", "start": {"position": 0.1, "velocity": 2}} | axes,
            {"name": "slide", "kind": "prismatic", "child": "block", "start": {"position": 0.2, "velocity": 3}} | axes,
            {
                "name": "both",
                "kind": "cylindrical",
                "child": "tube",
                "drive": {
                    "position": {"law": "constant", "position": 0.01, "velocity": 0.4},
                    "angle": {"law": "harmonic", "mean": 0.3, "amplitude": 0.5, "frequency": 2.0},
                },
            }
            | axes,
            {"name": "wheel", "kind": "revolute", "child": "wheel", "drive": {"law": "constant", "velocity": 6}} | axes,
            {"name": "cam", "kind": "revolute", "child": "cam", "drive": {"law": "table", "points": [(0, 0), (1.5, 0.25)]}} | axes,
        ],
        "motor": [{"name": "m", "joint": "hinge", "torque": 0.7}, {"name": "n", "joint": "slide", "force": 8, "damping": 9}],
    }
    machine["joint_spring"] = [{"name": "curved", "joint": "hinge", "characteristic": [(-0.2, -3), (0, 0), (0.6, 4)]}]
    machine["motor"][1]["target"] = {"law": "constant", "position": 0.05, "velocity": 0.0}
    toml = jp.Scene.from_dict(machine).toml
    for line in [
        'position = "0.1 rad"',
        'velocity = "2 rad/s"',
        'position = "0.2 m"',
        'velocity = "3 m/s"',
        'position = "0.01 m"',
        'velocity = "0.4 m/s"',
        'mean = "0.3 rad"',
        'amplitude = "0.5 rad"',
        'velocity = "6 rad/s"',
        'damping = "9 N s/m"',
        'position = "0.05 m"',
        '"1.5 s", "0.25 rad"',
        '"-0.2 rad", "-3 N m"',
    ]:
        assert line in toml, toml


@pytest.mark.parametrize(
    "change, message",
    [
        ({"body": [{"name": "L0", "mass": object()}]}, r"body\[0\].mass: expected a number"),
        ({"body": [{"name": "L0", "mass": float("nan")}]}, r"body\[0\].mass: expected a finite number"),
        ({"body": [{"name": "L0", "mess": 1.0}]}, "mass"),
        ({"contact": {"clearance": -1.0}}, "allowed"),
        ({"sprung": [{}]}, "spring"),
        ({"motor": [{"name": "m", "joint": "nowhere", "stiffness": 5.0}]}, r"motor\[0\].stiffness: the unit depends"),
    ],
)
def test_errors_name_their_cause(change, message):
    with pytest.raises(jp.JointplayError, match=message):
        jp.Scene.from_dict(chain(1, 1e-4) | change)
