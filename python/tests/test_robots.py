"""Robot descriptions as scenes, compared with MuJoCo's own numbers."""

import math
import os
import pickle
import re
import struct
import warnings
from pathlib import Path
from xml.etree import ElementTree

import jointplay as jp
import numpy as np
import pytest
from jointplay.__main__ import main

mujoco = pytest.importorskip("mujoco")

ROOT = Path(__file__).resolve().parents[2]

BALL = '<geom size="0.1"/>'


def mjcf(body, more=""):
    return f"<mujoco>\n{more}\n<worldbody>\n{body}\n</worldbody>\n</mujoco>"


def link(name, mass=1.0, inertia="0.1 0.1 0.1", more=""):
    xx, yy, zz = inertia.split()
    moments = f'<inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>'
    return f'<link name="{name}"><inertial><origin xyz="0.1 0.2 -0.3"/><mass value="{mass}"/>{moments}</inertial>{more}</link>'


def joint(name, kind, parent, child, more=""):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>'


def robot(*parts):
    return f'<robot name="r">\n<link name="base"/>\n{chr(10).join(parts)}\n</robot>'


def imported(source, kind="mjcf"):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jp.OmissionWarning)
        return getattr(jp.Scene, f"from_{kind}")(source)


def note(scene, what):
    found = [line.rsplit(": ", 1)[1] for line in scene.notes if line.startswith(what)]
    assert len(found) <= 1, scene.notes
    return found[0].split(", ") if found else []


def simulation_of(scene, body):
    """A simulation that reports the accelerations of `body`."""
    text = re.sub(r'(?m)^    \{ form = "mesh".*\n', "", scene.toml)
    text = re.sub(r"(?m)^\[\[fixed_shape\]\]\n(?:.+\n)+", "", text)
    return jp.Simulation(jp.Scene.from_toml(text.replace("\n[gravity]\n", f'\n[output]\nbody = "{body}"\n\n[gravity]\n', 1)))


def acceleration(scene, body):
    """Acceleration of the origin, m/s^2, and angular acceleration, rad/s^2, of a body at t = 0, in the world's axes."""
    simulation = simulation_of(scene, body)
    return np.array([simulation[f"{body}.{kind}.{axis}"] for kind in ("acceleration", "angular_acceleration") for axis in "xyz"])


def without_omitted(model):
    """The model without what a scene leaves out: armature, friction, limits, actuators, contact, tendons and couplings."""
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= int(flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_ACTUATION | flags.mjDSBL_FRICTIONLOSS)
    model.dof_armature[:] = 0.0
    model.tendon_stiffness[:] = 0.0
    is_kept = np.isin(model.eq_type, [mujoco.mjtEq.mjEQ_CONNECT.value, mujoco.mjtEq.mjEQ_WELD.value])
    model.eq_active0[~is_kept] = False
    return model


def mujoco_accelerations(model):
    """The same of all bodies by name, as MuJoCo computes them."""
    data = mujoco.MjData(model)
    model.opt.iterations, model.opt.tolerance = 1000, 0.0
    mujoco.mj_forward(model, data)
    mujoco.mj_rnePostConstraint(model, data)
    is_heavy = not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
    found = {}
    for b in range(1, model.nbody):
        both = np.zeros(6)
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, b, both, 0)
        # MuJoCo reports what an accelerometer shows.
        found[model.body(b).name] = np.concatenate([both[3:] + is_heavy * model.opt.gravity, both[:3]])
    return found


def assert_same(scene, model, tolerance=1e-10):
    """Positions and accelerations of the moving bodies; the tolerance is that of rounding in both programs."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    expected = mujoco_accelerations(without_omitted(model))
    frame = jp.Simulation(scene).frame()
    scale = max(1.0, *(np.abs(value).max() for value in expected.values()))
    compared = 0
    for k, name in enumerate(scene.bodies):
        if name in expected:
            compared += 1
            assert np.allclose(frame.positions[k], data.body(name).xpos, rtol=0, atol=1e-12)
            assert np.allclose(frame.rotations[k].ravel(), data.body(name).xmat, rtol=0, atol=1e-12)
            error = np.abs(acceleration(scene, name) - expected[name]).max() / scale
            assert error < tolerance, (name, error, acceleration(scene, name), expected[name])
    assert compared == sum(model.body(name).jntnum[0] > 0 for name in expected)
    return expected


ARM = """<body name="upper" pos="0 0.1 1" euler="10 20 30"><joint name="hip_x" axis="1 0 0" pos="0 0 0.02"/>
    <joint name="hip_z" axis="0 0 1" pos="0.01 0 0"/><joint name="rail" type="slide" axis="0 1 1"/>
    <geom type="capsule" fromto="0 0 0 0.05 0.01 -0.34" size="0.06"/>
    <body name="plate" pos="0 0 -0.2" euler="0 40 0"><geom type="box" size="0.1 0.05 0.01" pos="0.2 0 0"/>
        <body name="lower" pos="0 0.02 -0.2"><joint name="knee" axis="0 -1 0"/><geom type="box" size="0.03 0.04 0.2"/></body>
    </body></body>"""


@pytest.mark.parametrize(
    ("body", "more"),
    [
        (ARM, ""),
        (ARM, '<option gravity="1 2 -3"/><compiler angle="radian" eulerseq="ZYX"/>'),
        (ARM, '<option><flag gravity="disable"/></option><default><joint stiffness="3" springref="20"/></default>'),
        # Springs beyond half a turn, and joints whose coordinate is not 0 as drawn.
        ('<body name="b"><joint stiffness="2" springref="400" axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/></body>', ""),
        ('<body name="b"><joint stiffness="2" springref="30" ref="50" axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/></body>', ""),
        ('<body name="b"><joint type="slide" stiffness="20" springref="0.2" ref="-0.3"/><geom size="0.1"/></body>', ""),
        (
            '<body name="b"><joint stiffness="2" springref="30"/><geom size="0.1"/></body>',
            '<option><flag spring="disable"/></option>',
        ),
        ('<body name="b" pos="0 0 1"><freejoint/><geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0"/></body>', ""),
        (
            '<body name="b" pos="0 0 1" euler="10 20 30"><joint type="free" stiffness="7"/><geom size="0.1" pos="0.1 0 0"/></body>',
            "",
        ),
        (
            (
                f'<body name="a" euler="0 30 0"><joint axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/><body name="b" pos="0.5 0 0" '
                f'euler="5 6 7"><joint type="ball" pos="0 0.1 0"/>{BALL}<geom size="0.05" pos="0.2 0 0.1"/></body></body>'
            ),
            "",
        ),
        (
            '<frame euler="0 0 30" pos="1 0 0"><body name="b"><joint axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/></body></frame>',
            "",
        ),
        (
            (
                '<replicate count="3" offset="1 0 0" euler="0 0 20"><body name="b"><joint axis="0 1 0"/>'
                '<geom size="0.1" pos="0.3 0 0"/></body></replicate>'
            ),
            "",
        ),
        (
            (
                '<body name="a" childclass="stiff"><joint name="one"/><geom size="0.1" pos="0.1 0.2 0"/><body name="b" pos="1 0 0">'
                '<joint class="main" axis="0 0 1"/><geom size="0.1" pos="0.3 0.1 0"/></body></body>'
            ),
            (
                '<default><geom density="2000"/><default class="stiff"><joint stiffness="20" springref="33" axis="0 1 0"/></default>'
                "</default>"
            ),
        ),
        ('<body name="b" gravcomp="0.7" euler="0 9 0"><joint axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/></body>', ""),
    ],
)
def test_a_scene_accelerates_as_in_mujoco(body, more):
    text = mjcf(body, more)
    scene = imported(text)
    expected = assert_same(scene, mujoco.MjModel.from_xml_string(text))
    assert max(np.abs(value).max() for value in expected.values()) > 0.1 or "disable" in more


def test_a_scene_moves_as_in_mujoco():
    """Half a second of a chain with springs and dampers, also on a ball joint, and of a free body that is held elastically."""
    springs = ARM.replace('name="knee"', 'name="knee" damping="0.3" stiffness="4" springref="200"')
    box = '<geom type="box" size="0.05 0.1 0.02" pos="0.1 0 0"/>'
    end = f'<body name="end" pos="0 0 -0.3"><joint type="ball" stiffness="2" damping="0.1"/>{box}</body>'
    buoy = (
        f'<body name="buoy" pos="1 2 3" euler="10 20 30"><joint type="free" stiffness="9" damping="0.5" pos="0 0 0"/>{box}</body>'
    )
    text = springs.replace('name="rail"', 'name="rail" damping="5"').replace(
        'size="0.03 0.04 0.2"/>', f'size="0.03 0.04 0.2"/>{end}'
    )
    text = mjcf(text + buoy)
    model = without_omitted(mujoco.MjModel.from_xml_string(text))
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 1e-4
    data = mujoco.MjData(model)
    while data.time < 0.5 - 1e-9:
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)
    scene = imported(text)
    simulation = jp.Simulation(scene.set(tolerance=1e-9))
    simulation.step_until(0.5)
    frame = simulation.frame()
    for k, name in enumerate(scene.bodies):
        if name in ("upper", "lower", "end", "buoy"):
            # Steps of 0.1 ms, of order 4, and a relative error of 1e-9 a step.
            assert np.allclose(frame.positions[k], data.body(name).xpos, rtol=0, atol=1e-6), name
            assert np.allclose(frame.rotations[k].ravel(), data.body(name).xmat, rtol=0, atol=1e-5), name
    assert np.abs(data.qvel).max() > 1.0


def test_a_body_has_the_mass_of_its_parts():
    text = mjcf(ARM)
    scene, model = imported(text), mujoco.MjModel.from_xml_string(text)
    upper, plate = model.body("upper"), model.body("plate")
    assert scene["body.upper.mass"] == pytest.approx(upper.mass[0] + plate.mass[0], rel=1e-14)
    assert note(scene, "part of another body") == ["plate of upper"]
    # The inertia of both about the origin of the world, as drawn, by MuJoCo's composite inertia about the centre of the tree.
    alone = mujoco.MjModel.from_xml_string(mjcf(re.sub(r'<body name="lower".*?</body>', "", ARM, flags=re.DOTALL)))
    data = mujoco.MjData(alone)
    mujoco.mj_forward(alone, data)
    xx, yy, zz, xy, xz, yz = data.crb[1][:6]
    turn = data.body("upper").xmat.reshape(3, 3)
    expected = turn.T @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn
    # Its reference point is the centre of mass of the whole tree, here of both parts.
    numbers = {
        key: [float(x) for x in re.search(rf'{key} = "([^"]*)"', scene.toml)[1].split()[:3]] for key in ("inertia", "products")
    }
    assert np.allclose(numbers["inertia"], np.diag(expected), rtol=1e-12)
    assert np.allclose(numbers["products"], -expected[[0, 0, 1], [1, 2, 2]], rtol=1e-10)


BARS = """<body name="left"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.4" size="0.01"/>
    <body name="coupler" pos="0 0 0.4"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.01"/>
        <site name="eye" pos="0.5 0 0" euler="0 20 0"/></body></body>
    <body name="right" pos="0.6 0 0" euler="0 10 0"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.4" size="0.01"/>
        <site name="pin" pos="-0.1736481776669303 0 0.38"/></body>"""


def assert_same_loop(scene, text):
    """MuJoCo's loops yield in proportion to (1 - d) / d, d up to 0.9999: extrapolated to 0, what remains is of second order."""
    softness = (1e-4 / 0.9999, 3e-4 / 0.9997)
    texts = (text.replace("/></equality>", f' solimp="{d} {d}"/></equality>') for d in (0.9999, 0.9997))
    stiff, soft = (mujoco_accelerations(without_omitted(mujoco.MjModel.from_xml_string(one))) for one in texts)
    for name in scene.bodies:
        expected = stiff[name] - (soft[name] - stiff[name]) * softness[0] / (softness[1] - softness[0])
        assert np.allclose(acceleration(scene, name), expected, rtol=1e-4, atol=1e-4), (name, acceleration(scene, name), expected)


@pytest.mark.parametrize(
    "by", ['body1="coupler" body2="right" anchor="0.5 0 0"', 'body1="right" body2="coupler" anchor="-0.1 0 0.38"']
)
def test_a_connection_closes_a_loop(by):
    text = mjcf(BARS).replace("</mujoco>", f'<equality><connect name="tip" {by}/></equality></mujoco>')
    scene = imported(text)
    assert scene.ball_joints == ["tip"] and scene.check().degrees_of_freedom == 1
    assert note(scene, "rigid here") == ["tip"]
    assert_same_loop(scene, text)


@pytest.mark.parametrize(
    "weld",
    [
        'body1="rod" body2="weight"',
        'body1="weight" body2="rod" anchor="0.3 0 0"',
        'site1="tip" site2="eye"',
        'body1="rod" body2="weight" anchor="-0.1 0 0" relpose="0.5 0 0 0.9659258262890683 0 0.25881904510252074 0"',
        'body1="rod" body2="weight" anchor="-0.1 0 0" torquescale="0"',
        'body1="weight" anchor="0.58 0 -0.05"',
    ],
)
def test_a_weld_holds_two_bodies_together(weld):
    x, z = 0.5 + 0.1 * math.cos(math.pi / 6), -0.1 * math.sin(math.pi / 6)
    text = mjcf(
        '<body name="rod"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.02"/>'
        f'<site name="tip" pos="0.5 0 0" euler="0 45 0"/></body><body name="weight" pos="{x!r} 0 {z!r}" euler="0 30 0"><freejoint/>'
        '<geom type="box" size="0.1 0.05 0.02"/><site name="eye" pos="-0.1 0 0" euler="0 15 0"/></body>'
    )
    text = text.replace("</mujoco>", f'<equality><weld name="w" {weld}/></equality></mujoco>')
    scene = imported(text)
    assert scene.ball_joints == (["w"] if "torquescale" in weld else [])
    assert_same_loop(scene, text)
    relaxed = imported(text.replace('name="w"', 'name="w" active="false"'))
    assert note(relaxed, "omitted: inactive equality of kind weld") == ["w"] and relaxed.check().degrees_of_freedom == 7


TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]


def stl(triangles):
    records = (struct.pack("<12fH", 0, 0, 0, *np.ravel(triangle), 0) for triangle in triangles)
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(records)


def corners_of(content):
    rows = np.frombuffer(content[84:], dtype=[("normal", "<3f4"), ("corners", "<9f4"), ("unused", "<u2")])
    return rows["corners"].reshape(-1, 3)


def test_includes_and_meshes_are_found_beside_the_file(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "wedge.stl").write_bytes(stl(TETRAHEDRON))
    (tmp_path / "legs.xml").write_text(
        '<mujocoinclude><body name="b" pos="0 0 1"><joint axis="0 1 0"/><geom type="mesh" mesh="wedge" pos="0.1 0 0" euler="0 0 30"/>'
        '<geom type="mesh" mesh="wedge" group="3" mass="0"/></body></mujocoinclude>'
    )
    text = mjcf(
        '<include file="legs.xml"/>', '<compiler meshdir="."/><asset><mesh file="parts/wedge.stl" scale="0.1 0.1 0.3"/></asset>'
    )
    (tmp_path / "robot.xml").write_text(text)
    scene = imported(tmp_path / "robot.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    # A tetrahedron of 1 g/cm^3.
    assert scene["body.b.mass"] == pytest.approx(1000.0 * 0.1 * 0.1 * 0.3 / 6.0, rel=1e-6)
    assert_same(scene, model)
    assert scene.toml.count("wedge.stl") == 1, "a geom of a hidden group is not drawn"
    assert pickle.loads(pickle.dumps(scene)) == scene, "the scene holds its meshes"

    main(["import", str(tmp_path / "robot.xml"), "--out", str(tmp_path / "out" / "robot.toml")])
    again = jp.Scene.load(tmp_path / "out" / "robot.toml")
    assert jp.Simulation(again).hash != "" and again.bodies == ["b"]
    # Corners in the frame of the body: those of the file, scaled, turned and shifted.
    place = re.search(r'position = "([^"]*) m".*quaternion = \[([^\]]*)\]', again.toml)
    position, quaternion = (np.array([float(x) for x in re.split("[ ,]+", part)]) for part in place.groups())
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    found = corners_of((tmp_path / "out" / "robot-meshes" / "wedge.stl").read_bytes()) @ turn.reshape(3, 3).T + position
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    expected = TETRAHEDRON.reshape(-1, 3) * (0.1, 0.1, 0.3) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + (0.1, 0, 0)
    # Meshes are in single precision.
    assert np.allclose(found, expected, rtol=0, atol=1e-7)


def test_large_meshes_are_drawn_coarser(tmp_path):
    """A sheet of more triangles than a scene may have: fewer remain, within a cell of the grid of the originals."""
    n = 300
    x, y = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    a = np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3).astype(float)
    ones = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]], float)
    triangles = (a[:, None, None] + ones).reshape(-1, 3, 3)
    triangles[:, :, 2] += np.sin(triangles[:, :, 0] / 20) * 10
    (tmp_path / "sheet.stl").write_bytes(stl(triangles))
    body = f'<body name="b"><joint/>{BALL}<geom type="mesh" mesh="sheet" mass="0" contype="0" conaffinity="0"/></body>'
    (tmp_path / "r.xml").write_text(mjcf(body, '<asset><mesh file="sheet.stl" inertia="shell"/></asset>'))
    main(["import", str(tmp_path / "r.xml"), "--out", str(tmp_path / "r.toml")])
    scene = jp.Scene.load(tmp_path / "r.toml")
    assert note(scene, "drawn coarser") == ["sheet"]
    content = (tmp_path / "r-meshes" / "sheet.stl").read_bytes()
    assert 10_000 < (len(content) - 84) // 50 < len(triangles) and len(content) <= 8 << 20
    corners = corners_of(content)
    # Turned to principal axes; a cell is a 64th of the sheet at most.
    assert np.allclose(np.sort(np.ptp(corners, 0)), np.sort(np.ptp(triangles.reshape(-1, 3), 0)), rtol=0, atol=300 / 64)


def test_a_urdf_accelerates_as_in_mujoco():
    text = robot(
        link("arm", 2.0, "0.02 0.03 0.04"),
        link("flange", 0.5),
        link("hand", 0.7, "0.01 0.02 0.02"),
        link("knob", 0.3, "0.01 0.02 0.02"),
        '<link name="tool"/>',
        joint("turn", "continuous", "base", "arm", '<origin xyz="0 0 1" rpy="0.1 0.2 0.3"/><axis xyz="0 1 0"/>'),
        joint("bolted", "fixed", "arm", "flange", '<origin xyz="0.3 0 0" rpy="0 0.5 0"/>'),
        joint("rail", "prismatic", "flange", "hand", '<axis xyz="1 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/>'),
        joint("ball", "spherical", "hand", "knob", '<origin xyz="0 0 0.2"/>'),
        joint("end", "fixed", "knob", "tool"),
    )
    scene = imported(text, "urdf")
    options = '<mujoco><compiler fusestatic="false"/></mujoco></robot>'
    plain = (
        text.replace('<link name="tool"/>', "").replace(joint("end", "fixed", "knob", "tool"), "").replace("</robot>", options)
    )
    assert_same(scene, mujoco.MjModel.from_xml_string(plain))
    assert scene["body.arm.mass"] == pytest.approx(2.5, rel=1e-14)
    assert scene.ball_joints == ["ball"]
    assert note(scene, "part of another body") == ["flange of arm", "tool of knob"]
    assert note(scene, "omitted: range") == ["rail"]
    assert scene.set(clearance="0.2 mm").check().contacts == 1


def test_links_without_mass_connect_joints():
    """A car on two crossed rails, 2 kg, with a hinge: a link without mass at its end has no effect."""
    text = robot(
        '<link name="rail"/><link name="sled"/><link name="needle"/>',
        link("car", 2.0),
        joint("x", "prismatic", "base", "rail", '<origin rpy="0 0.3 0"/><axis xyz="1 0 0"/>'),
        joint("y", "prismatic", "rail", "sled", '<axis xyz="0 1 0"/>'),
        joint("turn", "continuous", "sled", "car", '<axis xyz="0 0 1"/>'),
        joint("pointer", "continuous", "car", "needle", '<axis xyz="0 0 1"/>'),
    )
    scene = imported(text, "urdf")
    assert note(scene, "omitted: link without mass") == ["needle"]
    assert [scene[f"body.{name}.mass"] for name in ("rail", "sled", "car")] == [0.0, 0.0, 2.0]
    # Along the inclined rail; gravity has no moment about the hinge's normal beyond that.
    one_body = mjcf(
        '<body name="car" euler="0 17.188733853924695 0"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
        '<joint axis="0 0 1"/><inertial pos="0.1 0.2 -0.3" mass="2" diaginertia="0.1 0.1 0.1"/></body>'
    )
    expected = mujoco_accelerations(mujoco.MjModel.from_xml_string(one_body))["car"]
    assert np.allclose(acceleration(scene, "car"), expected, rtol=0, atol=1e-10) and np.abs(expected).max() > 2.0


def test_a_link_without_inertial_has_no_mass_in_a_urdf():
    """MuJoCo would compute one from the collision shapes: 33.5 kg for this ball, at the end of a rod of 1 kg."""
    ball = '<collision><geometry><sphere radius="0.2"/></geometry></collision>'
    text = robot(
        link("rod"),
        f'<link name="shield">{ball}</link>',
        '<link name="odd"><inertial><mass value="0"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>',
        joint("a", "continuous", "base", "rod", '<axis xyz="0 1 0"/>'),
        joint("b", "fixed", "rod", "shield", '<origin xyz="1 0 0"/>'),
        joint("c", "fixed", "rod", "odd"),
    )
    scene = imported(text, "urdf")
    assert scene["body.rod.mass"] == 1.0
    assert note(scene, "omitted: contact of body") == ["shield"]
    assert note(scene, "altered to 0: inertia of link without mass") == ["odd"]
    # m g x / (I + m (x^2 + z^2)), about the hinge.
    assert acceleration(scene, "rod")[4] == pytest.approx(9.81 * 0.1 / (0.1 + 0.1**2 + 0.3**2), rel=1e-12)


def test_inertias_that_no_body_has_are_balanced_and_named():
    # Placeholders of sensors have all six numbers alike: moments 0, 0 and 3e-3.
    alike = "".join(f'{key}="0.001" ' for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    text = robot(
        link("flat", 1.0, "0.1 0.1 0.5"),
        f'<link name="sensor"><inertial><mass value="1"/><inertia {alike}/></inertial></link>',
        link("good", 1.0),
        joint("a", "continuous", "base", "flat"),
        joint("b", "continuous", "flat", "sensor"),
        joint("c", "continuous", "sensor", "good"),
    )
    scene = imported(text, "urdf")
    # MuJoCo takes the mean of the three moments.
    flat, sensor = note(scene, "altered by balanceinertia")
    assert flat == "flat (0.1 0.1 0.5 to 0.2333 0.2333 0.2333 kg m^2)"
    assert sensor.startswith("sensor (") and sensor.endswith("0.003 to 0.001 0.001 0.001 kg m^2)")
    model = mujoco.MjModel.from_xml_string(
        robot(link("flat", 1.0, "0.1 0.1 0.5"), joint("a", "continuous", "base", "flat")).replace(
            "</robot>", '<mujoco><compiler balanceinertia="true"/></mujoco></robot>'
        )
    )
    inertia = float(re.search(r'name = "flat"\n.*\n.*\ninertia = "(\S+)', scene.toml)[1])
    assert inertia == pytest.approx(model.body("flat").inertia[0], rel=1e-12)


def test_meshes_of_packages_are_found_and_equal_names_are_told_apart(tmp_path, capsys):
    for folder, scale in (("visual", 1.0), ("other", 2.0)):
        (tmp_path / "pkg" / folder).mkdir(parents=True)
        (tmp_path / "pkg" / folder / "part.stl").write_bytes(stl(scale * TETRAHEDRON))
    (tmp_path / "pkg" / "urdf").mkdir()

    def shape(name):
        return f'<visual name="same"><geometry><mesh filename="{name}"/></geometry></visual>'

    (tmp_path / "pkg" / "broken.stl").write_bytes(b"nothing")
    names = ("visual/part.stl", "other/part.stl", "visual/part.dae", "none.stl", "broken.stl")
    shapes = [shape(f"package://pkg/{name}") for name in names]
    file = tmp_path / "pkg" / "urdf" / "r.urdf"
    file.write_text(robot(link("arm", more="".join(shapes)), joint("a", "continuous", "base", "arm")))
    scene = imported(file, "urdf")
    assert note(scene, "not drawn: mesh that is missing") == ["package://pkg/visual/part.dae", "package://pkg/none.stl"]
    assert note(scene, "not drawn: mesh that MuJoCo refuses") == ["broken-2.stl"]
    main(["import", str(file)])
    assert len(note(jp.Scene.from_toml(capsys.readouterr().out), "not drawn, because no folder is given")) == 2
    main(["import", str(file), "--out", str(tmp_path / "r.toml")])
    spans = sorted(float(np.ptp(corners_of(path.read_bytes()), 0).max()) for path in (tmp_path / "r-meshes").iterdir())
    # Turned to principal axes, an edge of a tetrahedron spans between 1 and sqrt(2) times its length.
    assert len(spans) == 2 and 1.9 < spans[1] / spans[0] < 2.1


def test_what_a_scene_does_not_have_is_named_by_element():
    text = mjcf(
        f"""<geom name="ground" type="plane" size="1 1 1"/><body name="dot" mocap="true"><geom size="0.01" contype="0" conaffinity="0"/></body>
        <body name="a"><joint name="j" range="-10 10" armature="0.1" frictionloss="0.2" damping="0.1 2"/>{BALL}
        <geom name="egg" type="ellipsoid" size="0.1 0.2 0.3" contype="0" conaffinity="0"/>
        <body name="b" pos="1 0 0"><joint name="k" actuatorgravcomp="true"/>{BALL}</body></body>""",
        '<option density="3"/>',
    ).replace(
        "</mujoco>",
        """<actuator><motor name="m" joint="j"/><position joint="k" kp="3"/></actuator>
        <tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>
        <equality><joint name="pair" joint1="j" joint2="k"/></equality><sensor><jointpos joint="j"/></sensor>
        <keyframe><key name="home" qpos="0 0"/></keyframe></mujoco>""",
    )
    with pytest.warns(jp.OmissionWarning, match="omitted: range of joint: j"):
        scene = jp.Scene.from_mjcf(text)
    for what, elements in {
        "omitted: range of joint": ["j"],
        "omitted: armature of joint": ["j"],
        "omitted: friction of joint": ["j"],
        "omitted: higher powers or yield of damping of joint": ["j"],
        "omitted: actuator": ["m", "actuator1"],
        "omitted: tendon": ["t"],
        "omitted: equality of kind joint": ["pair"],
        "omitted: keyframe": ["home"],
        "omitted: contact of body": ["world", "a", "b"],
        "omitted: motion by mocap of body": ["dot"],
        "omitted: resistance of the medium": ["density"],
        "not drawn: plane": ["ground of world"],
        "not drawn: ellipsoid": ["egg of a"],
    }.items():
        assert note(scene, what) == elements, (what, scene.notes)
    assert len(scene.notes) == 14, scene.notes
    assert imported(mjcf(f'<body name="a"><joint/>{BALL}</body>')).notes == [f"From description by MuJoCo {mujoco.__version__}."]
    assert scene.set(clearance=0.0).notes == scene.notes


def test_names_become_those_of_scenes():
    long = "n" * 50
    bodies = "".join(
        f'<body name="{name}"><joint name="{name}"/>{BALL}</body>' for name in ("left arm", "left_arm", "world_1", long)
    )
    scene = imported(mjcf(bodies + f"<body><joint/>{BALL}</body>"))
    assert scene.bodies == ["left_arm", "left_arm_2", "world_1", "n" * 40, "body5"]
    assert note(scene, "renamed") == ["left arm is left_arm", "left_arm is left_arm_2", f"{long} is {'n' * 40}"]


def body(inside):
    return mjcf(f'<body name="b">{inside}</body>')


@pytest.mark.parametrize(
    ("kind", "text", "expected"),
    [
        ("mjcf", "<scene/>", "description: its first element is <scene>; allowed <mujoco> (MJCF)"),
        ("urdf", "<mujoco/>", "description: its first element is <mujoco>; allowed <robot> (URDF)"),
        ("mjcf", "<!-- nothing -->", "description: is not an XML file: it has no element"),
        ("mjcf", "<mujoco>\n<worldbody></mujoco>", "is not an XML file: mismatched element"),
        ("urdf", "<robot>\n<link></robot>", "description:2: is not an XML file: mismatched tag"),
        (
            "mjcf",
            "<mujoco>\n<worldbody>\n<boddy/></worldbody></mujoco>",
            "description:3: Schema violation: unrecognized element Element 'boddy'",
        ),
        ("mjcf", body('<joint class="hnge"/>' + BALL), "description:4: unknown default class name 'hnge' Element 'joint'"),
        (
            "mjcf",
            body("<joint/>"),
            "description:4: mass and inertia of moving bodies must be larger than mjMINVAL Element name 'b', id 1",
        ),
        ("mjcf", body(f'<joint/><geom type="mesh" mesh="m"/>{BALL}'), "mesh 'm'"),
        ("mjcf", mjcf("", '<asset><mesh file="gone.stl"/></asset>'), "gone.stl"),
        ("mjcf", '<mujoco>\n<include file="gone.xml"/></mujoco>', "Error opening file 'gone.xml'"),
        ("mjcf", body(BALL), "description: no body with mass has a joint"),
        (
            "mjcf",
            body(f'<joint type="slide"/><joint type="ball"/>{BALL}'),
            "description: body b: in a scene a ball joint is the only joint of its body",
        ),
        (
            "mjcf",
            mjcf(f'<body name="b"><joint/>{BALL}</body>', '<option gravity="0 0 -2000"/>'),
            "a scene cannot hold this machine: ",
        ),
        (
            "mjcf",
            mjcf(
                '<replicate count="10001" offset="1 0 0"><body><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></replicate>'
            ),
            "10000",
        ),
        (
            "urdf",
            robot('<link name="a"/><xacro:arm xmlns:xacro="http://ros.org/wiki/xacro"/>'),
            "<xacro:arm> is a macro: expand the file first",
        ),
        ("urdf", robot(link("a"), joint("j", "screw", "base", "a")), "invalid joint type in URDF"),
        ("urdf", robot(link("a"), joint("j", "continuous", "base", "x")), "URDF joint parent or child missing"),
        ("urdf", robot(link("a", "heavy"), joint("j", "continuous", "base", "a")), "link a: <mass> has heavy; expected numbers"),
        ("urdf", robot(), "no body with mass has a joint"),
    ],
)
def test_wrong_descriptions_are_refused_in_one_sentence(kind, text, expected):
    with pytest.raises(jp.SceneError) as raised:
        imported(text, kind)
    message = str(raised.value)
    assert expected in message and "\n" not in message, message
    assert raised.value.file == "description"


def test_the_command_writes_a_scene_or_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "arm.xml"
    file.write_text(mjcf(ARM))
    assert main(["import", str(file)]) == 0
    printed = capsys.readouterr()
    scene = imported(file)
    assert printed.out == scene.toml and printed.err.splitlines() == scene.notes
    assert jp.Scene.from_toml(printed.out) == scene
    out = tmp_path / "arm.toml"
    assert main(["import", str(file), "--out", str(out)]) == 0 and out.read_text() == printed.out
    out.write_text("mine")
    assert main(["import", str(file), "--out", str(out)]) == 2 and out.read_text() == "mine"
    assert "exists already; --force replaces it" in capsys.readouterr().err
    assert main(["import", str(file), "--out", str(out), "--force"]) == 0 and out.read_text() == printed.out
    assert main(["import", str(file), "--out", str(tmp_path / "x.toml"), "--meshes", "/elsewhere/m"]) == 2
    (tmp_path / "bad.xml").write_text(mjcf("<body/><joint/>"))
    assert main(["import", str(tmp_path / "bad.xml"), "--out", str(tmp_path / "bad.toml")]) == 2
    assert main(["import", str(tmp_path / "missing.xml")]) == 1
    assert main(["import", "/dev/zero"]) == 2
    assert "bad.xml:4: " in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.toml", "arm.xml", "bad.xml"]


def test_warnings_of_mujoco_are_notes(tmp_path, monkeypatch, capfd):
    """MuJoCo itself prints them, and appends them to a file in the current folder."""
    monkeypatch.chdir(tmp_path)
    limits = '<limit lower="0" upper="0" effort="1" velocity="1"/>'
    scene = imported(robot(link("arm"), joint("j", "revolute", "base", "arm", limits)), "urdf")
    assert note(scene, "MuJoCo") == ["joint 'j' has equal lower and upper limits", "limit ignored"]
    scene = imported(mjcf(f'<body name="b"><joint/>{BALL}</body>', '<compiler settotalmass="3"/>'))
    assert scene["body.b.mass"] == pytest.approx(3.0, rel=1e-14) and "settotalmass" in scene.notes[1]
    assert not list(tmp_path.iterdir()) and capfd.readouterr().err == ""


def test_without_mujoco_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setattr("jointplay._robots.mujoco", None)
    with pytest.raises(jp.OptionError, match=r"^a robot description needs mujoco: pip install 'jointplay\[robots\]'$"):
        jp.Scene.from_mjcf("<mujoco/>")


ROBOTS = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "robots"
NO_MACHINE = {
    "lqr.xml": "bodies are added by the code that loads it",
    "iris_simple.urdf": "one link",
    "quadrotor_base.urdf": "one link",
    "ur3.urdf": "no link",
}
UNDETERMINED = {"icub.urdf": "a head without inertia about the axis of its hinge, on which its centre lies"}


def public_model(path):
    """MuJoCo's own model of a file: of a URDF without shapes, which have no mass in that format, and with bounds for masses of 0."""
    if path.suffix == ".xml":
        return mujoco.MjModel.from_xml_path(str(path))
    root = ElementTree.parse(path).getroot()
    for link in root.findall("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
        mass = link.find("inertial/mass")
        if mass is not None and float(mass.get("value")) == 0.0:
            # Bounded below, like those of links without <inertial>.
            link.remove(link.find("inertial"))
        inertia = link.find("inertial/inertia")
        if inertia is not None:
            xx, yy, zz, xy, xz, yz = (float(inertia.get(key)) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
            if np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0] < 2e-14:
                # MuJoCo refuses it, with its option to balance inertias too, which takes the mean of the moments.
                mean = str((xx + yy + zz) / 3.0)
                inertia.attrib.update(ixx=mean, iyy=mean, izz=mean, ixy="0", ixz="0", iyz="0")
    for joint_with in root.findall("joint/mimic/.."):
        joint_with.remove(joint_with.find("mimic"))
    for settings in root.findall("mujoco"):
        root.remove(settings)
    settings = {"balanceinertia": "true", "fusestatic": "false", "boundmass": "2e-14", "boundinertia": "2e-14"}
    ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler", settings)
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(root, "unicode"))


@pytest.mark.long
def test_public_descriptions_accelerate_as_in_mujoco(tmp_path, monkeypatch):
    """Every description of gymnasium, dm_control's suite and example-robot-data; a table with `-s`."""
    files = [*(ROBOTS / "gymnasium/envs/mujoco/assets").glob("*.xml"), *(ROBOTS / "dm_control/suite").glob("*.xml")]
    files += (ROBOTS / "cmeel.prefix/share/example-robot-data").rglob("*.urdf")
    assert len(files) > 100, f"no packages in {ROBOTS}: ./test long installs them"
    # MuJoCo writes its warnings into the current folder.
    monkeypatch.chdir(tmp_path)
    failed = {}
    for path in sorted(files):
        try:
            scene = imported(path, "urdf" if path.suffix == ".urdf" else "mjcf")
            scene.check()
            names = dict(reversed(line.split(" is ")) for line in note(scene, "renamed"))
            found = mujoco_accelerations(without_omitted(public_model(path)))
            expected = {name: found.get(names.get(name, name)) for name in scene.bodies}
            named = [name for name in scene.bodies if expected[name] is not None]
            scale = max([9.81, *(np.abs(expected[name]).max() for name in named)])
            error = max(np.abs(acceleration(scene, name) - expected[name]).max() for name in named) / scale
            print(f"{path.name:36} {len(scene.bodies):4} bodies, {len(named):4} compared, {error:.1e}")
            # Hands of some grams on heavy arms lose eight digits to rounding.
            if error > 1e-8:
                failed[path.name] = error
        except (jp.SceneError, ValueError) as error:
            failed[path.name] = str(error)
    print(failed)
    assert failed.keys() == NO_MACHINE.keys() | UNDETERMINED.keys(), failed
