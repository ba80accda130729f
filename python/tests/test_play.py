"""Joints with play other than balls: pins and blocks."""

import numpy as np
import pytest

import jointplay as jp

LENGTH, RADIUS, PLAY, SPEED = 24e-3, 10e-3, 1e-4, 0.2

# A pin of 0.1 kg in a fixed bearing, thrown level across its play.
PIN = """
[gravity]
z = 0
[contact]
friction_law = "none"
restitution = 0.9
youngs_modulus = "206 GPa"
poisson_ratio = 0.3
approach_speed = "start"
[solver]
method = "dopri5"
tolerance = 1e-11
[[body]]
name = "pin"
mass = "0.1 kg"
inertia = "5e-6 1.6e-5 1.6e-5 kg m^2"
[[joint]]
name = "J"
kind = "cylindrical"
child = "pin"
axis = [1, 0, 0]
start = { offset_velocity = "0 0 -0.2 m/s" }
play = { radial = "0.1 mm", length = "24 mm", radius = "10 mm" }
"""


def largest_force():
    """Of an end: half of the stiffness on half of the mass, by the law of Lankarani and Nikravesh. With s the rate over that at the
    start, its work gives (2/5) K d^2.5 = m v^2 ((1 - s)/chi - ln((1 + chi)/(1 + chi s))/chi^2), and F = K d^1.5 (1 + chi s)."""
    modulus = 206e9 / (2 * (1 - 0.3**2))
    k = 0.5 * 4 / 3 * modulus * np.sqrt(RADIUS * (RADIUS + PLAY) / PLAY)
    mass, chi = 0.05, 0.75 * (1 - 0.9**2)
    s = np.linspace(-0.5, 0.9, 2_000_001)
    lost = (1 - s) / chi - np.log((1 + chi) / (1 + chi * s)) / chi**2
    return float((k**0.4 * (2.5 * mass * SPEED**2 * lost) ** 0.6 * (1 + chi * s)).max())


def test_both_ends_of_a_level_pin_strike_with_the_force_of_the_closed_form():
    scene = jp.Scene.from_toml(PIN)
    assert scene.ball_joints == ["J"] and scene.sites == {"J": ["J.a", "J.b"]}
    impacts = scene.run("0.7 ms", warn=False).impacts
    assert sorted(impacts["site"]) == ["J.a", "J.b"] and set(impacts["joint"]) == {"J"}
    expected = largest_force()
    assert abs(expected - 589.7017740) < 1e-7
    # Steps leave 1e-9 of a peak at this tolerance; the grid of the closed form, its square.
    assert np.all(np.abs(impacts["peak_N"] / expected - 1) < 1e-8), impacts["peak_N"]
    assert np.allclose(impacts["start_s"], PLAY / SPEED, rtol=1e-9)


def test_channels_of_an_end_and_frames_agree():
    scene = jp.Scene.from_toml(PIN)
    run = scene.run("0.6 ms", every="1 us", channels=["J.*"], warn=False)
    # The ends carry half each: level, they share everything.
    assert run["J.a.normal"].max() > 500
    assert np.allclose(run["J.a.normal"] + run["J.b.normal"], run["J.normal"], rtol=1e-9, atol=1e-9)
    assert np.allclose(run["J.gap"], np.minimum(run["J.a.gap"], run["J.b.gap"]))
    simulation = jp.Simulation(scene)
    simulation.step_until("0.53 ms")
    frame = simulation.frame()
    assert frame.tilts.shape == frame.axial.shape == (1,)
    assert abs(frame.tilts[0] - simulation["J.tilt"]) < 1e-15 and abs(frame.axial[0]) < 1e-12
    assert np.isclose(np.linalg.norm(frame.normal_forces[0]), simulation["J.normal"])
    # e = c + delta straight down.
    assert np.allclose(frame.eccentricities[0], [0, 0, -PLAY + simulation["J.a.gap"]], atol=1e-15)


def test_plays_are_parameters_that_a_run_changes():
    scene = jp.Scene.from_toml(PIN)
    keys = scene.parameters
    assert keys["joint.J.play.radial"].value == PLAY and "joint.J.clearance" not in keys
    assert "joint.J.friction" in keys and "joint.J.friction_velocity" in keys
    assert scene.set({"joint.J.play.length": "30 mm"})["joint.J.play.length"] == 0.03
    simulation = jp.Simulation(scene)
    assert simulation.set("joint.J.play.radial", "0.2 mm") == "now"
    assert simulation.set("joint.J.play.length", 0.03) == "at reset"
    # In flight the gap widens at once; the pin flies on and has farther to go.
    simulation.step_until("10 ms")
    impacts = simulation.take_impacts()
    assert np.isclose(impacts["start_s"].min(), 2 * PLAY / SPEED, rtol=1e-9)
    # All of them are there, though two at a time peak in turns.
    assert len(impacts) == simulation.statistics["joints"]["J"]["impacts"] == 8
    with pytest.raises(jp.SceneError, match=r"joint.J.play.radial.*allowed 0 mm to 1 mm"):
        scene.set({"joint.J.play.radial": "1.2 mm"}).check()


def test_a_sweep_keeps_statistics_of_ends():
    scene = jp.Scene.from_toml(PIN)
    gaps = np.array([0.5e-4, 1e-4, 2e-4])
    swept = jp.sweep(scene, {"joint.J.play.radial": gaps}, duration="1.2 ms", keep="J.a.normal:max,J.normal:max")
    forces = swept["J.a_normal_max_N"]
    # At the same speed only the stiffness changes: K grows as the root of R r/c, the force with K^0.4.
    expected = forces[1] * (((RADIUS + gaps) / gaps) / ((RADIUS + PLAY) / PLAY)) ** 0.2
    # A step near the peak misses it by less than this.
    assert np.allclose(forces, expected, rtol=1e-3), (forces, expected)
    assert np.allclose(swept["J_normal_max_N"], 2 * forces, rtol=1e-3)


def test_corners_of_a_block_are_named():
    sites = jp.Scene.load("slider-crank-worn").sites
    assert sites["guide"] == ["guide.1y", "guide.3y", "guide.5y", "guide.7y"] and sites["crank-pin"] == ["crank-pin"]


def test_a_fit_is_that_of_the_pin():
    # H7/g6 at 20 mm: radial clearances of 3.5 um to 20.5 um (ISO 286-2, tables 2 and 4).
    shared = PIN.replace('radial = "0.1 mm", ', "")
    for text, key, name in [
        (PIN, "joint.J.play.radial", "joint.J.play.radial"),
        (PIN, "joint.*.play.radial", "joint.J.play.radial"),
        (shared, "contact.clearance", "contact.clearance"),
    ]:
        found = jp.sensitivity(jp.Scene.from_toml(text), {key: "H7/g6"}, "peak-force", rows=0, duration="1 us")
        study = found.alone["peak-force"][name]
        assert (1e6 * study.low, 1e6 * study.high) == pytest.approx((3.5, 20.5), rel=1e-12)
    with pytest.raises(jp.OptionError, match="a fit gives a clearance"):
        jp.sensitivity(jp.Scene.from_toml(PIN), {"joint.J.play.length": "H7/g6"}, "peak-force", rows=0, duration="1 us")


def test_a_study_says_which_pin_costs_most():
    # Half of the stray of the teeth comes from each pin: see the lesson on worn hinges.
    scene = jp.Scene.load("excavator")
    assert {"joint.boom-pin.play.radial", "joint.stick-pin.play.radial"} <= set(scene.parameters)
    stray = {}
    for name in ("boom-pin", "stick-pin"):
        run = scene.set({f"joint.{name}.play.radial": 0.0}).run("1 s", every="5 ms", channels=["bucket.pose.y"], warn=False)
        stray[name] = abs(run["bucket.pose.y"]).max()
    whole = abs(scene.run("1 s", every="5 ms", channels=["bucket.pose.y"], warn=False)["bucket.pose.y"]).max()
    assert sum(stray.values()) == pytest.approx(whole, rel=0.02)
