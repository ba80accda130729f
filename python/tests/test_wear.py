"""Wear over many cycles: closed form, cycle jumps against a direct run, what is refused."""

import numpy as np
import pytest

import jointplay as jp

PIN = """
gravity = { x = 0, y = 0, z = "-10 m/s^2" }
[contact]
friction_law = "none"
wear_coefficient = "1e-10 m^2/N"
[solver]
method = "dopri5"
tolerance = 1e-9
[[body]]
name = "pin"
mass = "1 kg"
inertia = "5e-5 1.6e-4 1.6e-4 kg m^2"
[[joint]]
name = "J"
kind = "revolute"
child = "pin"
axis = [1, 0, 0]
play = { radial = "0.1 mm", length = "24 mm", radius = "10 mm", ends = "pin", stiffness = "1e10 N/m^1.5" }
start = { velocity = "100 rad/s", offset = "0 0 -0.101 mm" }
"""
TURN = 2.0 * np.pi / 100.0
# k N 2 pi r over 2 pi r L, m.
DEPTH = 1e-10 * 10.0 / 0.024


def flores(wear):
    """The slider-crank of Flores with little play and restitution: its motion nearly repeats."""
    changes = {"contact.normal_law": "gonthier", "contact.restitution": 0.3, "contact.clearance": "0.1 mm"}
    return jp.Scene.load("flores").set(changes | {"contact.wear_coefficient": wear, "solver.tolerance": "1e-7"})


def test_a_pin_under_its_weight_wears_by_the_closed_form():
    scene = jp.Scene.from_toml(PIN)
    seen = []
    found = jp.wear(scene, 500, period=TURN, progress=seen.append)
    assert found.cycles[0] == 0.0 and found.cycles[-1] == pytest.approx(500.0, rel=1e-12)
    assert found.depth["joint.J.play.radial"] == pytest.approx(DEPTH * found.cycles, rel=1e-5)
    assert found.clearance["joint.J.play.radial"] == pytest.approx(1e-4 + DEPTH * found.cycles, rel=1e-5)
    assert found.peak_force["J"] == pytest.approx(np.full(len(found.cycles), 10.0), rel=0.02)
    assert found.tip_error is None and found.difference.max() < 1e-4 and seen == sorted(seen) and seen[-1] == 1.0
    assert found.scene["joint.J.play.radial"] == found.clearance["joint.J.play.radial"][-1]
    assert found.scene["contact.wear_coefficient"] == scene["contact.wear_coefficient"]
    assert found.scene["joint.J.wear_coefficient"] == scene["contact.wear_coefficient"]
    # The run itself tells the same.
    run = scene.run(10 * TURN, channels=["J.worn", "J.clearance"])
    own = run.statistics["joints"]["J"]
    assert own["worn"] == [pytest.approx(10 * DEPTH, rel=1e-3), 0.0]
    assert own["worn_volume"][0] == pytest.approx(own["worn"][0] * 2.0 * np.pi * 0.01 * 0.024, rel=1e-12)
    assert run["J.worn"][-1] == own["worn"][0] and np.all(np.diff(run["J.worn"]) >= 0.0)
    assert np.allclose(run["J.clearance"] - run["J.worn"], 1e-4, rtol=1e-12)


def test_jumps_agree_with_a_direct_run_over_a_hundred_cycles():
    scene = flores("1e-11 m^2/N")
    direct = scene.run(1.2, 0.012, channels=["S.worn"], warn=False)["S.worn"]
    assert direct[-1] > 0.2 * 1e-4
    found = jp.wear(scene, 100, period="12 ms", jump=50, tolerance=0.05, settle=4, observe=4)
    assert found.cycles.tolist() == [0.0, 50.0, 100.0] and found.runs == 5
    depth = found.depth["joint.S.clearance"]
    assert depth[-1] == pytest.approx(direct[-1], rel=0.02) and depth[1] == pytest.approx(direct[50], rel=0.02)


def test_the_play_of_a_slider_crank_grows_and_its_forces_with_it():
    found = jp.wear(flores("1e-13 m^2/N"), 1e5, period="12 ms", tolerance=0.1, settle=4, observe=4)
    clearance, force = found.clearance["joint.S.clearance"], found.peak_force["S"]
    assert np.all(np.diff(clearance) > 0.0) and clearance[-1] > 2e-4
    assert force[-1] > 2.0 * force[0]
    table = found.to_pandas()
    assert list(table.columns) == ["cycles", "joint.S.clearance_m", "S_peak_N", "difference"]
    assert np.array_equal(table["joint.S.clearance_m"], clearance)
    axes = found.plot()
    assert [own.get_ylabel() for own in axes] == ["clearance, mm", "peak force, N"]
    assert np.array_equal(axes[1].get_lines()[0].get_ydata(), force)
    assert f"{len(found.cycles) - 1} jumps" in repr(found)


def test_rates_that_scatter_are_doubted():
    with pytest.warns(jp.DoubtWarning, match="flores: a jump and two halves of it differ by .* observe more periods"):
        jp.wear(flores("1e-13 m^2/N"), 1000, period="12 ms", jump=1000, tolerance=1e-5)


def test_the_tip_error_of_a_machine_is_that_of_its_run():
    scene = jp.Scene.load("spcmm").set({"contact.wear_coefficient": "1e-14 m^2/N", "joint.S3.wear_coefficient": 0.0})
    found = jp.wear(scene, 2, period="10 ms", jump=2, settle=0, rows=50, tolerance=1.0)
    assert list(found.clearance) == ["joint.S1.clearance", "joint.S2.clearance"] == list(found.depth)
    run = scene.set({"contact.wear_coefficient": 0.0}).run("10 ms", every="0.2 ms", channels=["tip_error"])
    assert found.tip_error[0] == pytest.approx(run["tip_error"].max(), rel=1e-6)
    assert "tip_error_m" in found.to_pandas() and len(found.plot()) == 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"cycles": 0}, "cycles = 0: allowed numbers from 1 to 1e"),
        ({"period": 0.0}, "period = 0.0: allowed times above 0 s"),
        ({"period": "2 mm"}, "unit"),
        ({"jump": 0.5}, "jump = 0.5: allowed"),
        ({"tolerance": 2.0}, "tolerance = 2.0: allowed numbers from 1e-06 to 1"),
        ({"observe": 0}, "observe = 0: allowed whole numbers from 1"),
        ({"rows": 5}, "rows = 5: allowed whole numbers from 10"),
    ],
)
def test_arguments_are_checked(options, words):
    with pytest.raises(jp.JointplayError, match=words):
        jp.wear(jp.Scene.from_toml(PIN), **({"cycles": 10, "period": TURN} | options))


def test_a_scene_in_which_nothing_wears_is_refused():
    with pytest.raises(jp.OptionError, match="nothing wears; set contact.wear_coefficient"):
        jp.wear(jp.Scene.load("pendulum"), 10, period=1.0)
    ideal = jp.Scene.load("pendulum").set({"contact.clearance": 0.0, "contact.wear_coefficient": "1e-13 m^2/N"})
    with pytest.raises(jp.OptionError, match="nothing wears"):
        jp.wear(ideal, 10, period=1.0)


def test_walls_wear_by_direction_and_jumps_follow_a_direct_run():
    changes = {"contact.wear_shape": "profile", "contact.wear_coefficient": "1e-9 m^2/N"}
    scene = jp.Scene.from_toml(PIN).set(changes | {"contact.normal_law": "gonthier", "contact.restitution": 0.2})
    direct = scene.run(20 * TURN, channels=["J.worn", "J.clearance"], warn=False)
    walls = direct.worn_walls["J"]
    assert [len(wall) for wall in walls] == [72, 72]
    assert np.mean(walls) == pytest.approx(direct["J.worn"][-1], rel=1e-12) and np.all(direct["J.clearance"] == 1e-4)
    found = jp.wear(scene, 20, period=TURN, jump=10, tolerance=1.0, settle=2)
    assert found.runs == 5 and found.depth["joint.J.play.radial"][-1] == pytest.approx(direct["J.worn"][-1], rel=0.02)
    assert np.all(found.clearance["joint.J.play.radial"][1:] > 1e-4) and found.scene["joint.J.play.radial"] == 1e-4
    for mine, other in zip(found.worn_walls["J"], walls, strict=True):
        assert np.max(mine) == pytest.approx(np.max(other), rel=0.05) and np.argmax(mine) == pytest.approx(np.argmax(other), abs=1)
    # The worn machine: the pin falls into its groove.
    worn = found.scene.run("50 ms", channels=["J.eccentricity", "J.worn"], worn=found.worn_walls, warn=False)
    assert worn["J.worn"][0] == pytest.approx(np.mean(found.worn_walls["J"]), rel=1e-12)
    assert worn["J.eccentricity.z"][-1] < -1e-4 - 0.9 * np.max(found.worn_walls["J"])


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_nothing_wears_in_a_period_of_one_long_step_without_a_touch():
    changes = {"contact.wear_shape": "profile", "contact.wear_coefficient": "1e-9 m^2/N"}
    found = jp.wear(jp.Scene.load("ball").set(changes), 10, period="1 ms")
    assert all(np.all(depth == 0.0) for depth in found.depth.values()) and np.all(found.difference == 0.0)


def test_walls_that_the_scene_does_not_have_are_refused():
    scene = jp.Scene.from_toml(PIN).set({"contact.wear_shape": "profile"})
    wall = np.zeros(72)
    for worn, words in (
        ({"K": [wall, wall]}, "no joint with play named `K`"),
        ({"J": [wall]}, r"J has 2 walls that wear by direction .*, of \[72, 72\] depths; given are \[72\]"),
        ({"J": [wall, wall - 1e-6]}, "a worn depth of -1e-6 m; allowed 0 m to 1e-3 m, a tenth of the radius"),
        ({"J": [wall, wall + 0.01]}, "a worn depth of 1e-2 m"),
        ({"J": [wall, wall + np.nan]}, "a worn depth of NaN m"),
        ({"J": wall}, "one-dimensional"),
        ({"J": 1.0}, "as in Run.worn_walls"),
        ([wall], "as in Run.worn_walls"),
    ):
        with pytest.raises(jp.OptionError, match=words):
            scene.run("1 ms", worn=worn)
    assert jp.Scene.from_toml(PIN).run("1 ms").worn_walls == {}
