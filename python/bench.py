"""Speed of the package: a step called from Python, a period of a controller, and two simulations in two threads.

    pip install ./python && python -P python/bench.py

The package built by `./test python` is not optimised; its calls take some microseconds.
"""

import statistics
import threading
import time

import jointplay as jp

STEPS = 100_000
REPETITIONS = 7


def seconds(work):
    """Shortest of several times, s; other load on the machine only adds."""
    times = []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def cost_of_a_call():
    """Time that a call adds to a step, s: steps one by one minus the same steps in one call."""
    scene = jp.Scene.load("pendulum").set({"solver.method": "rk4", "solver.step": "1 us"})
    simulation = jp.Simulation(scene)
    state = simulation.state

    def one_by_one():
        simulation.restore(state)
        step = simulation.step
        for _ in range(STEPS):
            step()

    def at_once():
        simulation.restore(state)
        simulation.step(STEPS)

    differences = [(seconds(one_by_one) - seconds(at_once)) / STEPS for _ in range(3)]
    return statistics.median(differences)


ARM = """
[[body]]
name = "arm"
mass = "1 kg"
inertia = "0.1 0.1 0.1 kg m^2"
[[joint]]
name = "elbow"
kind = "revolute"
child = "arm"
axis = [0, 1, 0]
[[motor]]
name = "elbow_motor"
joint = "elbow"
torque = 0
"""


def cost_of_a_period():
    """Time that a controller adds to a millisecond of the run, s: it reads angle and rate and sets a torque."""
    simulation = jp.Simulation(jp.Scene.from_toml(ARM).set({"solver.method": "rk4", "solver.step": "1 ms"}))
    state, periods = simulation.state, 10_000

    def controlled():
        simulation.restore(state)
        motor = simulation.motors["elbow_motor"]
        for k in range(1, periods + 1):
            motor.torque = 5.0 * (0.5 - simulation.q["elbow.angle"]) - simulation.v["elbow.angle"]
            simulation.step_until(k * 1e-3)

    def free():
        simulation.restore(state)
        simulation.step_until(periods * 1e-3)

    differences = [(seconds(controlled) - seconds(free)) / periods for _ in range(3)]
    return statistics.median(differences)


def speed_of_two_threads():
    """Time of two simulations in sequence over their time in two threads."""
    simulations = [jp.Simulation(jp.Scene.load("four-bar")) for _ in range(2)]
    states = [simulation.state for simulation in simulations]

    def work(simulation, state):
        simulation.restore(state)
        simulation.step_until(0.5)

    def in_turn():
        for simulation, state in zip(simulations, states):
            work(simulation, state)

    def in_threads():
        threads = [threading.Thread(target=work, args=pair) for pair in zip(simulations, states)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    return seconds(in_turn) / seconds(in_threads)


if __name__ == "__main__":
    print(f"a call adds {cost_of_a_call() * 1e6:.2f} us to a step")
    print(f"a period of a controller adds {cost_of_a_period() * 1e6:.2f} us to a millisecond of the run")
    print(f"two threads are {speed_of_two_threads():.2f} times as fast as one")
