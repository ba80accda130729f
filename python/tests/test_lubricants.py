"""Lubricants: one whose viscosity changes while it carries a turning journal."""

import numpy as np
import pytest

import jointplay as jp

def test_a_thinner_oil_carries_a_journal_farther_out():
    simulation = jp.Simulation(jp.Scene.load("oiled"))
    oil = simulation.lubricants["thin"]
    ratios = []
    for viscosity in (0.02, 0.01, 0.005):
        oil.viscosity = viscosity
        assert oil.viscosity == viscosity
        simulation.step_until(simulation.time + 0.6)
        frame = simulation.frame()
        # It carries the whole weight, without contact.
        assert np.allclose(frame.lubricant_forces[0], [0.0, 0.0, 10.0], atol=1e-2), frame.lubricant_forces
        assert not frame.normal_forces[0].any()
        assert np.isclose(np.linalg.norm(frame.lubricant_forces[0]), np.linalg.norm([simulation[f"thin.force.{axis}"] for axis in "xyz"]))
        ratios.append(np.linalg.norm(frame.eccentricities[0]) / 1e-4)
        # Sommerfeld, film of half a turn: the attitude angle falls with the eccentricity.
        _, y, z = frame.eccentricities[0]
        attitude = np.arctan2(np.pi * np.sqrt(1.0 - ratios[-1] ** 2), 2.0 * ratios[-1])
        assert np.arctan2(abs(y), -z) == pytest.approx(attitude, abs=2e-3)
    assert ratios[0] < ratios[1] < ratios[2] < 1.0


def test_what_a_lubricant_cannot_be_is_refused():
    simulation = jp.Simulation(jp.Scene.load("oiled"))
    with pytest.raises(jp.OptionError, match="viscosity of thin = -1; allowed 0"):
        simulation.lubricants["thin"].viscosity = -1.0
    with pytest.raises(jp.OptionError, match="no lubricant is called"):
        simulation.lubricants["water"]
    assert simulation.set("lubricant.thin.viscosity", "30 mPa s") == "now"
    assert simulation.lubricants["thin"].viscosity == 0.03
