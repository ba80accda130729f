"""Simulations: steps, changes, states, threads."""

import _thread
import copy
import gc
import pickle
import threading

import numpy as np
import psutil
import pytest

import jointplay as jp
from jointplay import _native


def test_the_end_of_a_run_is_that_of_the_program(summary):
    expected = summary("run", "four-bar", "--duration", "20ms")
    simulation = jp.Simulation(jp.Scene.load("four-bar"))
    simulation.step_until("20 ms")
    assert (simulation.hash, simulation.time) == (expected["state_hash"], 0.02)
    assert simulation.statistics["steps"] == expected["steps"] and simulation.ledger == expected["energy_J"]


def test_single_steps_equal_steps_in_one_call():
    scene = jp.Scene.load("four-bar")
    one, many = jp.Simulation(scene), jp.Simulation(scene)
    for _ in range(300):
        one.step()
    many.step(300)
    assert one.hash == many.hash and one.time == many.time > 0.0
    assert one.statistics["steps"] == 300


def test_a_restored_state_continues_with_the_same_bits():
    simulation = jp.Simulation(jp.Scene.load("four-bar"))
    simulation.step_until("5 ms")
    state = simulation.state
    ends = []
    for _ in range(2):
        simulation.restore(state)
        assert (simulation.time, simulation.hash) == (state.time, state.hash)
        simulation.step(500)
        ends.append(simulation.hash)
    other = jp.Simulation(jp.Scene.load("four-bar"))
    other.restore(state)
    other.step(500)
    assert ends == [other.hash] * 2
    with pytest.raises(jp.OptionError, match="`four-bar`.*`pendulum`"):
        jp.Simulation(jp.Scene.load("pendulum")).restore(state)


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "falling"])
def test_a_pickled_or_copied_state_continues_with_the_same_bits(name, falling):
    scene = jp.Scene.from_toml(falling) if name == "falling" else jp.Scene.load(name).set(friction=0.12)
    simulation = jp.Simulation(scene)
    simulation.step_until("5 ms")
    assert simulation.set("contact.friction", 0.3) == "now"
    assert simulation.set("contact.clearance", "0 mm") == "at reset"
    simulation.step(20)
    state = simulation.state
    again = pickle.loads(pickle.dumps(state))
    ends = []
    for one in [state, again, pickle.loads(pickle.dumps(again)), copy.copy(state), copy.deepcopy(state)]:
        assert (one.time, one.hash) == (state.time, state.hash)
        other = jp.Simulation(scene)
        other.restore(one)
        other.step(500)
        stepped = (other.hash, other.ledger, other.statistics, other.take_impacts().tolist())
        # The reset applies the pending change.
        other.reset()
        other.step_until("5 ms")
        ends.append((stepped, other.hash))
    assert ends == [ends[0]] * 5
    with pytest.raises(jp.OptionError, match=f"`{scene.name}`.*`pendulum`"):
        jp.Simulation(jp.Scene.load("pendulum")).restore(again)
    # Into a scene with other parameters, where it starts.
    other = jp.Simulation(scene.set(friction=0.2))
    other.restore(again)
    # Loops are closed there to the last digits.
    assert np.allclose(other.vector, simulation.vector, rtol=0.0, atol=1e-13) and other.statistics["steps"] == 0


def test_a_pickled_state_has_the_machine_of_its_last_reset():
    scene = jp.Scene.load("chain").set({"chain.links": 2})
    simulation = jp.Simulation(scene)
    simulation.set("chain.links", 5)
    simulation.reset()
    simulation.set("chain.links", 3)
    simulation.step_until("10 ms")
    other = jp.Simulation(scene)
    other.restore(pickle.loads(pickle.dumps(simulation.state)))
    assert other.channels == simulation.channels and other.frame().positions.shape == (5, 3)
    for one in [simulation, other]:
        one.step(100)
    assert other.hash == simulation.hash
    other.reset()
    assert other.frame().positions.shape == (3, 3)


def test_a_pickle_has_the_text_of_a_state_file(summary, tmp_path):
    simulation = jp.Simulation(jp.Scene.load("four-bar"))
    simulation.step_until("5 ms")
    _, (text, changes) = simulation.state.__reduce__()
    file = tmp_path / "state"
    file.write_text(text)
    simulation.step_until("20 ms")
    expected = summary("run", "four-bar", "--duration", "20ms", "--from-state", file)
    assert expected["state_hash"] == simulation.hash
    summary("run", "four-bar", "--duration", "5ms", "--save-state", tmp_path / "own")
    other = jp.Simulation(jp.Scene.load("four-bar"))
    other.restore(_native.State((tmp_path / "own").read_text(), changes))
    other.step_until("20 ms")
    assert other.hash == summary("run", "four-bar", "--duration", "20ms")["state_hash"]
    for damaged, message in [
        (text.replace('"time_s":0.005', '"time_s":0.006'), "state: damaged: the checksum"),
        (text.replace('"version":"', '"version":"9'), "state: written by version 9"),
        (text[:-2], "state: not a state that `run --save-state` wrote, or a damaged one"),
        ("{}", "state: not a state"),
    ]:
        with pytest.raises(jp.OptionError, match=message):
            _native.State(damaged, changes)
    with pytest.raises(jp.OptionError, match="do not describe a state of this scene"):
        _native.State(text, [[], [], [("contact.friction", "0.3")]])


def test_a_reset_may_change_the_number_of_bodies():
    simulation = jp.Simulation(jp.Scene.load("chain").set({"chain.links": 2}))
    simulation.step(100)
    before, channels = simulation.state, simulation.channels
    assert simulation.set("chain.links", 5) == "at reset"
    simulation.reset()
    simulation.step_until("50 ms")
    assert len(simulation.channels) > len(channels) and simulation.frame().positions.shape == (5, 3)
    assert len(set(simulation.take_impacts()["joint"])) > 2
    simulation.restore(before)
    assert simulation.channels == channels and simulation.frame().positions.shape == (2, 3)


def test_a_live_change_takes_effect_now_or_at_the_reset():
    scene = jp.Scene.load("pendulum")
    simulation = jp.Simulation(scene)
    simulation.step_until("50 ms")
    assert simulation.set("contact.friction", 0.3) == "now"
    assert simulation.set("contact.clearance", "0 mm") == "at reset"
    assert simulation["S1.clearance"] > 0.0
    simulation.reset()
    assert simulation.time == 0.0
    simulation.step_until("50 ms")
    fresh = jp.Simulation(scene.set(friction=0.3, clearance=0.0))
    fresh.step_until("50 ms")
    assert simulation.hash == fresh.hash
    for key, value in [("contact.clearence", 1e-4), ("contact.clearance", "5 kg"), ("contact.clearance", -1.0)]:
        with pytest.raises(jp.SceneError, match=key):
            simulation.set(key, value)
    with pytest.raises(jp.OptionError):
        simulation.set("contact.friction", None)


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda simulation: pickle.loads(pickle.dumps(simulation))])
def test_a_copied_or_pickled_simulation_continues_with_the_same_bits(again):
    simulation = jp.Simulation(jp.Scene.load("four-bar").set(clearance="0.2 mm"))
    simulation.step_until("5 ms")
    simulation.set("contact.friction", 0.3)
    simulation.set("contact.clearance", "0.3 mm")
    other = again(simulation)
    assert (other.time, other.hash, other.scene) == (simulation.time, simulation.hash, simulation.scene)
    for one in [simulation, other]:
        one.step(500)
    assert other.hash == simulation.hash and other is not simulation
    other.step()
    assert other.time > simulation.time
    for one in [simulation, other]:
        one.reset()
        one.step_until("5 ms")
    assert other.hash == simulation.hash and other["A.clearance"] == 0.3e-3


def test_a_frame_has_the_values_of_a_run():
    scene = jp.Scene.load("four-bar")
    simulation = jp.Simulation(scene)
    simulation.step_until("10 ms")
    frame = simulation.frame()
    run = scene.run("10 ms", every="10 ms", channels=["*"])
    assert frame.time == 0.01
    for name, value in zip(simulation.channels, frame.values):
        assert np.array_equal(value, run[name][-1], equal_nan=True), name
        assert np.array_equal(simulation[name], value, equal_nan=True), name
    crank = scene.bodies.index("crank")
    assert frame.positions[crank].tolist() == [run[f"crank.pose.{axis}"][-1] for axis in "xyz"]
    assert np.allclose(frame.rotations @ frame.rotations.transpose(0, 2, 1), np.eye(3), atol=1e-12)
    a = scene.ball_joints.index("A")
    assert np.isclose(np.linalg.norm(frame.normal_forces[a]), simulation["A.normal"], rtol=1e-12)
    assert np.allclose(frame.eccentricities[a], run["A.eccentricity"][-1], rtol=0, atol=0)
    with pytest.raises(jp.ChannelError, match="did you mean"):
        simulation["A.nromal"]
    with pytest.raises(jp.ChannelError, match="A.force.x"):
        simulation["A.force"]


def test_impacts_are_taken_once():
    simulation = jp.Simulation(jp.Scene.load("four-bar"))
    taken = []
    for _ in range(100):
        simulation.step(20)
        taken.extend(simulation.take_impacts().tolist())
    end = simulation.time
    of_run = [tuple(row) for row in jp.Scene.load("four-bar").run(end).impacts.tolist()]
    assert taken[: len(of_run) - 1] == of_run[: len(of_run) - 1] and len(taken) > 3
    assert len(simulation.take_impacts()) == 0


def test_a_stopped_simulation_keeps_its_last_good_state():
    wild = jp.Scene.load("spcmm").set({"solver.method": "rk4", "solver.step": "1 ms", "contact.clearance": "0.5 mm"})
    simulation = jp.Simulation(wild)
    with pytest.raises(jp.Stopped) as caught:
        simulation.step_until(1.0)
    assert caught.value.time == simulation.time and np.all(np.isfinite(simulation.vector))


def test_threads_give_the_same_bits_as_one():
    scenes = [jp.Scene.load("four-bar"), jp.Scene.load("spcmm")]
    expected = [scene.run("30 ms", warn=False).hash for scene in scenes]
    simulations = [jp.Simulation(scene) for scene in scenes]
    threads = [threading.Thread(target=simulation.step_until, args=(0.03,)) for simulation in simulations]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert [simulation.hash for simulation in simulations] == expected


def test_stepping_lets_other_threads_run():
    simulation = jp.Simulation(jp.Scene.load("four-bar"))
    thread = threading.Thread(target=simulation.step, args=(100_000,))
    thread.start()
    turns = 0
    while thread.is_alive():
        turns += 1
    # If the step held the interpreter's lock, this loop would not run before its end.
    assert turns > 100
    thread.join()


def test_a_simulation_in_use_is_refused_to_another_thread():
    simulation = jp.Simulation(jp.Scene.load("four-bar"))
    thread = threading.Thread(target=simulation.step, args=(100_000,))
    thread.start()
    assert issubclass(jp.InUseError, RuntimeError)
    with pytest.raises(jp.InUseError, match="in use in another thread; give each thread its own"):
        while thread.is_alive():
            assert simulation.time >= 0.0
        raise AssertionError("the step ended too soon")
    thread.join()
    simulation.step()


def test_ctrl_c_ends_steps_and_the_simulation_continues():
    simulation = jp.Simulation(jp.Scene.load("four-bar"))
    threading.Timer(0.2, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        simulation.step_until("1000 s")
    time = simulation.time
    simulation.step()
    assert simulation.time > time > 0.0


def test_a_million_steps_leak_nothing():
    kinematic = jp.Scene.load("pendulum").set({"solver.method": "rk4", "solver.step": "1 us"})
    simulation = jp.Simulation(kinematic)

    def work(count):
        for _ in range(count):
            simulation.step()
        gc.collect()
        return psutil.Process().memory_info().rss

    first = work(10_000)
    # A leak of one object per step would be 16 MB or more.
    assert work(1_000_000) - first < 4 << 20


def test_a_simulation_is_freed():
    scene = jp.Scene.load("four-bar")

    def work(count):
        for _ in range(count):
            simulation = jp.Simulation(scene)
            simulation.step()
            simulation.state
        gc.collect()
        return psutil.Process().memory_info().rss

    first = work(50)
    assert work(500) - first < 8 << 20
