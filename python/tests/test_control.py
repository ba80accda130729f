"""Controllers: motors, loads and springs set between steps; states set and analysed."""

import copy
import math
import pickle

import numpy as np
import pytest

import jointplay as jp

ARM = """
name = "arm"
gravity = { x = 0, y = 0, z = "-9.81 m/s^2" }
[[parameter]]
name = "push"
value = "0 N m"
[[body]]
name = "upper"
mass = "2 kg"
inertia = "0.02 0.03 0.04 kg m^2"
centre = "0.15 0 0 m"
[[body]]
name = "lower"
mass = "1 kg"
inertia = "0.01 0.012 0.013 kg m^2"
centre = "0.15 0 0 m"
[[joint]]
name = "shoulder"
kind = "revolute"
child = "upper"
axis = [0, 1, 0]
[[joint]]
name = "elbow"
kind = "revolute"
parent = "upper"
parent_point = "0.3 0 0 m"
child = "lower"
axis = [0, 1, 0]
start = { position = "30 deg" }
[[motor]]
name = "shoulder_motor"
joint = "shoulder"
torque = 0
stiffness = 0
target = { law = "constant", position = 0, velocity = 0 }
[[motor]]
name = "elbow_motor"
joint = "elbow"
torque = "push"
[[joint_spring]]
name = "coil"
joint = "elbow"
stiffness = "1 N m/rad"
[[load]]
name = "tip"
on = { body = "lower", at = "0.3 0 0 m" }
force = [0, 0, 0]
"""


@pytest.fixture
def scene():
    return jp.Scene.from_toml(ARM)


def test_parameters_of_motors_loads_and_springs_act_now(scene):
    simulation = jp.Simulation(scene)
    simulation.step_until("1 ms")
    for key, value in {
        "motor.shoulder_motor.torque": 3.0,
        "motor.shoulder_motor.stiffness": 2.0,
        "motor.shoulder_motor.target.position": 0.1,
        "parameter.push": "1 N m",
        "joint_spring.coil.stiffness": 5.0,
    }.items():
        assert simulation.set(key, value) == "now", key
    assert simulation.motors["elbow_motor"].torque == 1.0
    assert simulation.springs["coil"].stiffness == 5.0
    simulation.step_until("2 ms")


def test_computed_torque_follows_a_path_that_mass_matrix_and_forces_predict(scene):
    simulation = jp.Simulation(scene.set({"solver.tolerance": 1e-9, "joint_spring.coil.stiffness": "1e-9 N m/rad"}))
    motors = [simulation.motors["shoulder_motor"], simulation.motors["elbow_motor"]]
    names = ("shoulder.angle", "elbow.angle")
    period, gain = 1e-3, 400.0

    def path(t):
        return np.array([0.5 * math.sin(3.0 * t), 0.5 * math.cos(2.0 * t)])

    errors = []
    for k in range(1500):
        t = k * period
        q, v = (np.array([state[name] for name in names]) for state in (simulation.q, simulation.v))
        (target, before, after) = (path(t), path(t - 1e-4), path(t + 1e-4))
        rate, acceleration = (after - before) / 2e-4, (after - 2.0 * target + before) / 1e-8
        own = np.array([motor.torque for motor in motors])
        wanted = acceleration + 2.0 * math.sqrt(gain) * (rate - v) + gain * (target - q)
        torques = simulation.mass_matrix() @ wanted - (simulation.forces() - own)
        for motor, torque in zip(motors, torques, strict=True):
            motor.torque = torque
        simulation.step_until((k + 1) * period)
        errors.append(np.abs(target - q).max())
    # From 0.5 rad away to what holding the torque for a period leaves.
    assert errors[0] > 0.02 and max(errors[1000:]) < 5e-3
    assert abs(simulation.ledger["relative_residual"]) < 1e-4


def test_loads_and_targets_are_set_and_read(scene):
    simulation = jp.Simulation(scene)
    simulation.step_until(0.1)
    load, motor = simulation.loads["tip"], simulation.motors["shoulder_motor"]
    load.force = (1.0, 2.0, -3.0)
    load.torque = np.array([0.1, 0.0, 0.0])
    motor.target, motor.target_rate, motor.stiffness, motor.limit = 0.3, 2.0, 5.0, math.inf
    assert load.force.tolist() == [1.0, 2.0, -3.0] and load.torque[0] == 0.1
    assert (motor.target, motor.limit) == (pytest.approx(0.3), math.inf)
    simulation.step_until(0.2)
    assert motor.target == pytest.approx(0.5) and motor.target_rate == 2.0
    assert list(simulation.motors) == ["shoulder_motor", "elbow_motor"] and len(simulation.springs) == 1


@pytest.mark.parametrize(
    ("set_it", "why"),
    [
        (lambda s: setattr(s.motors["elbow_motor"], "force", 1.0), "acts on a hinge: set its torque"),
        (lambda s: setattr(s.motors["elbow_motor"], "torque", math.nan), "force of elbow_motor = NaN; allowed"),
        (lambda s: setattr(s.motors["elbow_motor"], "torque", "3 N m"), "'3 N m': expected a number in SI units"),
        (lambda s: setattr(s.springs["coil"], "stiffness", -1.0), "stiffness of coil = -1; allowed 0"),
        (lambda s: setattr(s.springs["coil"], "length", 1.0), "coil has no length"),
        (lambda s: setattr(s.loads["tip"], "force", (1.0, 2.0)), "expected three numbers"),
        (lambda s: s.motors["wrist"], "no motor is called 'wrist'; there are: shoulder_motor, elbow_motor"),
        (lambda s: s.set_state({"wrist.angle": 1.0}), "no coordinate is called wrist.angle; there are shoulder.angle"),
        (lambda s: s.set_state({"elbow.angle": [1.0, 2.0]}), "expected a number, SI"),
        (lambda s: s.set_state([1.0]), r"q = \[1.0\]: expected 2 numbers, SI"),
        (lambda s: s.set_state({"elbow.angle": math.inf}), "number 1 .from 0. is inf"),
        (lambda s: s.rhs(0.0, [1.0]), "1 numbers; the state has 4"),
    ],
)
def test_what_cannot_be_set_is_refused_in_a_sentence_and_changes_nothing(scene, set_it, why):
    simulation = jp.Simulation(scene)
    simulation.step_until("1 ms")
    before = simulation.hash
    with pytest.raises(jp.OptionError, match=why):
        set_it(simulation)
    assert simulation.hash == before and simulation.motors["elbow_motor"].torque == 0.0


def test_a_state_is_written_by_name_and_as_a_whole(scene):
    simulation = jp.Simulation(scene)
    simulation.step_until("50 ms")
    assert list(simulation.q) == list(simulation.v) == ["shoulder.angle", "elbow.angle"]
    simulation.set_state(q={"elbow.angle": 0.2}, v=[0.1, 0.0], time=0.0)
    assert (simulation.time, simulation.q["elbow.angle"]) == (0.0, 0.2)
    assert dict(simulation.v) == {"shoulder.angle": 0.1, "elbow.angle": 0.0}
    assert simulation.statistics["steps"] == 0
    other = jp.Simulation(scene)
    other.set_state(q=np.array([simulation.q["shoulder.angle"], 0.2]), v={"shoulder.angle": 0.1})
    for run in (simulation, other):
        run.step_until("20 ms")
    assert simulation.hash == other.hash
    free = jp.Simulation(jp.Scene.load("pendulum"))
    (pose,) = free.q.values()
    assert pose.shape == (7,) and free.v.keys() == free.q.keys()


def test_arrays_that_are_handed_out_are_read_only(scene):
    simulation = jp.Simulation(scene)
    frame = simulation.frame()
    for array in (simulation.vector, frame.positions, frame.rotations, frame.values, frame.normal_forces):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
    with pytest.raises(TypeError):
        simulation.q["elbow.angle"] = 0.0


def test_a_state_is_restored_into_a_scene_with_other_parameters(scene):
    simulation = jp.Simulation(scene)
    simulation.step_until("30 ms")
    other = jp.Simulation(scene.set({"parameter.push": "3 N m"}))
    other.restore(simulation.state)
    assert other.time == simulation.time and np.array_equal(other.vector, simulation.vector)
    assert other.motors["elbow_motor"].torque == 3.0
    other.step_until("40 ms")
    with pytest.raises(jp.OptionError, match="coordinates differ"):
        jp.Simulation(jp.Scene.load("pendulum")).restore(simulation.state)


def test_copies_and_pickles_hold_what_was_set(scene):
    simulation = jp.Simulation(scene)
    simulation.step_until("10 ms")
    simulation.motors["elbow_motor"].torque = 0.7
    copies = [copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))]
    for run in (simulation, *copies):
        assert run.motors["elbow_motor"].torque == 0.7
        run.step_until("30 ms")
    assert len({run.hash for run in (simulation, *copies)}) == 1


def test_the_right_hand_side_and_the_linearisation_agree(scene):
    simulation = jp.Simulation(scene.set({"gravity.z": 0}))
    simulation.set_state(q={"elbow.angle": 0.0})
    y = np.array(simulation.vector)
    assert np.allclose(simulation.rhs(0.0, y), 0.0)
    linear = simulation.linearise()
    step = 1e-6
    for column in range(4):
        moved = y.copy()
        moved[column] += step
        assert np.allclose(simulation.rhs(0.0, moved) / step, linear.matrix[:, column], atol=1e-6)
    stiffness = np.zeros((2, 2))
    stiffness[1, 1] = 1.0
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(simulation.mass_matrix(), stiffness)))
    assert linear.frequencies == pytest.approx(np.sqrt(squares[1:]) / (2.0 * np.pi), rel=1e-6)
    assert linear.directions.tolist() == np.eye(2).tolist()


def test_bristles_are_no_velocities_and_begin_anew_with_a_state():
    sim = jp.Simulation(jp.Scene.load("belt"))
    sim.step_until("0.3 s")
    numbers = np.concatenate([np.atleast_1d(own) for own in sim.v.values()])
    places = np.concatenate([np.atleast_1d(own) for own in sim.q.values()])
    bristles = sim.vector[len(places) + len(numbers) :]
    assert len(bristles) == 12 and np.abs(bristles).max() > 0
    sim.set_state(v=numbers, time=0.3)
    assert np.all(sim.vector[len(places) + len(numbers) :] == 0)
