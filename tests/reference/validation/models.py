"""Independent models of the cases of docs/validation.md, written down again without the program, in coordinates of their own.

    pip install numpy==2.* scipy==1.17.1
    python tests/reference/validation/models.py > tests/physics/validation/models.toml

Integrations have a relative tolerance of 1e-13, that with contacts of 1e-12. Every number is SI. Takes half a minute. The cases of joints
with play other than balls are read from tables of another program, which is not here.
"""

import csv
from pathlib import Path

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ellipj, ellipk

G = 9.81


def integrate(rate, y, end, **options):
    """The solution of y' = rate(t, y) from 0 to `end`, by the method of order 8 of Dormand and Prince."""
    solution = solve_ivp(rate, (0.0, end), y, method="DOP853", rtol=1e-13, atol=1e-15, **options)
    assert solution.success, solution.message
    return solution


def pendulum(time):
    """A point mass on 1 m, from the level: sin(phi / 2) = k cd(w t | k^2) with k = sin(pi / 4), phi from the lowest point."""
    sn, cn, dn, _ = ellipj(np.sqrt(G) * time, 0.5)
    phi = 2.0 * np.arcsin(np.sqrt(0.5) * cn / dn)
    return {"x": -np.sin(phi), "z": -np.cos(phi)}


def four_bars(time, windows=2):
    """Parallel cranks (1/3 kg m^2 each) and couplers that only travel: one equation for the angle from the upright."""
    torque = G * ((windows + 1) / 2 + windows)
    inertia = (windows + 1) / 3 + windows
    solution = integrate(lambda _, y: [y[1], torque / inertia * np.sin(y[0])], [0.0, 1.0], time)
    return {"angle": solution.y[0, -1], "rate": solution.y[1, -1]}


def squeezer(time):
    """Seven bodies in absolute coordinates (x, y, angle) and ten pins: constrained Newton-Euler equations, whose multipliers are
    eliminated at every evaluation."""
    angle = [-0.0617138900142764496358948458001, 0.0, 0.455279819163070380255912382449, 0.222668390165885884674473185609]
    angle += [0.487364979543842550225598953530, -0.222668390165885884674473185609, 1.23054744454982119249735015568]
    beta, theta, gamma, phi, delta, omega, epsilon = angle
    mass = np.array([43.25, 3.65, 23.73, 7.06, 70.5, 7.06, 54.98]) * 1e-3
    inertia = np.array([2.194e-6, 4.41e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5])
    # Centroids in frames whose origins are F's crank O, F, B, G, A, H, A.
    centre = np.array([[0.92, 0], [-11.5, 0], [10.43, -18.74], [0, -5.79], [23.08, 9.16], [5.79, 0], [-4.49, -12.28]]) * 1e-3
    a, b, c = np.array([-69.34, -2.27]) * 1e-3, np.array([-36.35, 32.73]) * 1e-3, np.array([14.0, 72.0]) * 1e-3
    f, e2, e3, e4 = [7e-3, 0], [-28e-3, 0], [0, -35e-3], [0, -20e-3]
    e6, d, g, h = [20e-3, 0], [20e-3, -18e-3], [40e-3, 0], [0, -40e-3]
    ground = -1
    # Body and point, body and point: O, F, B, A, G, A, H, and E three times.
    pins = [(0, [0, 0], ground, [0, 0]), (0, f, 1, [0, 0]), (2, [0, 0], ground, b), (4, [0, 0], ground, a), (4, g, 3, [0, 0])]
    pins += [(6, [0, 0], ground, a), (6, h, 5, [0, 0]), (1, e2, 2, e3), (1, e2, 3, e4), (1, e2, 5, e6)]

    def turn(t):
        return np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]])

    turned = np.array([beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon])
    origin = [np.zeros(2), turn(beta) @ f, b, a + turn(delta) @ g, a, a + turn(epsilon) @ h, a]
    q = np.concatenate([[*(origin[i] + turn(turned[i]) @ centre[i]), turned[i]] for i in range(7)])
    matrix = np.diag(np.ravel(np.column_stack([mass, mass, inertia])))

    def accelerate(_, y):
        q, v = y[:21].reshape(7, 3), y[21:].reshape(7, 3)
        rows, right = np.zeros((20, 21)), np.zeros(20)
        for k, (i, at_i, j, at_j) in enumerate(pins):
            for body, at, sign in [(i, at_i, 1.0), (j, at_j, -1.0)]:
                if body == ground:
                    continue
                arm = turn(q[body, 2]) @ (np.array(at) - centre[body])
                rows[2 * k : 2 * k + 2, 3 * body : 3 * body + 2] += sign * np.eye(2)
                rows[2 * k : 2 * k + 2, 3 * body + 2] += sign * np.array([-arm[1], arm[0]])
                right[2 * k : 2 * k + 2] += sign * arm * v[body, 2] ** 2
        force = np.zeros(21)
        force[2] = 0.033
        arm = turn(q[2, 2]) @ (np.array(d) - centre[2])
        line = q[2, :2] + arm - c
        length = np.hypot(*line)
        pull = -4530.0 * (length - 0.07785) * line / length
        force[6:8] += pull
        force[8] += arm[0] * pull[1] - arm[1] * pull[0]
        system = np.block([[matrix, rows.T], [rows, np.zeros((20, 20))]])
        return np.concatenate([y[21:], np.linalg.solve(system, np.concatenate([force, right]))[:21]])

    y = integrate(accelerate, np.concatenate([q, np.zeros(21)]), time).y[:, -1]
    out = {}
    for word, y in [("", y[:21]), ("_rate", y[21:])]:
        t = y[2::3]
        angles = [t[0], t[1] - t[0], t[2], t[3] - t[4], t[4], t[5] - t[6], t[6]]
        names = ["beta", "theta", "gamma", "phi", "delta", "omega", "epsilon"]
        out |= {name + word: value for name, value in zip(names, angles)}
    # The published solution of the Test Set for IVP Solvers.
    known = [15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948]
    known += [0.5244099658805304, 0.5347301163226948, 1.048080741042263]
    assert all(abs(out[name] - right) < 2e-9 for name, right in zip(names, known)), out
    return {name: value for name, value in out.items() if name == "beta" or name.endswith("_rate")}


def bricard(time):
    """The chain of five rods in its hinge angles, the sixth hinge as five conditions of rank four: the motion along their null
    space."""
    axes = [np.array(v, float) for v in [[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]]
    along = [np.array(v, float) for v in [[1, 0, 0], [0, -1, 0], [0, 0, 1], [-1, 0, 0], [0, 1, 0]]]

    def about(axis, angle):
        k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)

    def chain(q, v):
        """Of every rod: rotation, hinge, axis, angular velocity, and angular acceleration and acceleration of the hinge at q'' = 0."""
        rotation, at, omega, alpha, acceleration = np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
        links = []
        for i in range(5):
            axis = rotation @ axes[i]
            alpha = alpha + np.cross(omega, axis * v[i])
            omega = omega + axis * v[i]
            rotation = rotation @ about(axes[i], q[i])
            links.append((rotation, at, axis, omega, alpha, acceleration))
            arm = rotation @ along[i]
            acceleration = acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
            at = at + arm
        return links, at, acceleration

    def accelerate(_, y):
        q, v = y[:5], y[5:]
        links, end, end_bias = chain(q, v)
        matrix, force = np.zeros((5, 5)), np.zeros(5)
        for i, (rotation, at, _, omega, alpha, bias) in enumerate(links):
            # Square section of 0.1 m.
            own = np.diag(1.01 / 12 - (1.01 / 12 - 1 / 600) * along[i] ** 2)
            inertia = rotation @ own @ rotation.T
            arm = rotation @ along[i] / 2
            turning, moving = np.zeros((3, 5)), np.zeros((3, 5))
            for j in range(i + 1):
                turning[:, j] = links[j][2]
                moving[:, j] = np.cross(links[j][2], at + arm - links[j][1])
            matrix += moving.T @ moving + turning.T @ inertia @ turning
            bias = bias + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
            force += moving.T @ (np.array([0, -G, 0]) - bias)
            force -= turning.T @ (inertia @ alpha + np.cross(omega, inertia @ omega))
        rotation, _, _, omega, alpha, _ = links[4]
        pin = rotation @ np.array([1.0, 0, 0])
        rows, right = np.zeros((5, 5)), np.zeros(5)
        for j in range(5):
            rows[:3, j] = np.cross(links[j][2], end - links[j][1])
            rows[3:, j] = np.cross(links[j][2], pin)[1:]
        right[:3] = -end_bias
        right[3:] = -(np.cross(alpha, pin) + np.cross(omega, np.cross(omega, pin)))[1:]
        free = np.linalg.svd(rows)[2][4]
        particular = np.linalg.lstsq(rows, right, rcond=1e-7)[0]
        along_free = free @ (force - matrix @ particular) / (free @ matrix @ free)
        return np.concatenate([v, particular + free * along_free])

    y = integrate(accelerate, np.zeros(10), time).y[:, -1]
    links, end, _ = chain(y[:5], y[5:])
    # The loop is still closed.
    assert np.abs(end - [0, 0, 1]).max() < 1e-9, end
    return dict(zip(["x", "y", "z"], links[2][1]))


def governor(time):
    """Angle of the shaft, of both arms below the level, and height of the slider: Lagrange's equations; the first has an integral."""
    axial, transverse = 5e-6, 0.30003 / 12
    swing = 5.0 + 0.3 * 0.25 + transverse

    def turning(a):
        arm = 5 * (0.05 + np.cos(a)) ** 2 + 0.3 * (0.05 + 0.5 * np.cos(a)) ** 2
        return 5e-6 + 5e-3 + 2 * (arm + axial * np.sin(a) ** 2 + transverse * np.cos(a) ** 2)

    def turning_slope(a):
        arm = -10 * (0.05 + np.cos(a)) * np.sin(a) - 0.3 * (0.05 + 0.5 * np.cos(a)) * np.sin(a)
        return 2 * (arm + (axial - transverse) * np.sin(2 * a))

    start = np.radians(30)
    momentum = turning(start) * 2 * np.pi

    def accelerate(_, y):
        _, a, s, a_rate, s_rate = y
        rate = momentum / turning(a)
        across, up = 0.5 * np.cos(a), 1 - 0.5 * np.sin(a) - s
        length = np.hypot(across, up)
        by_a = (-across * 0.5 * np.sin(a) - up * 0.5 * np.cos(a)) / length
        by_s = -up / length
        tension = 8e5 * (length - 0.5) + 4e4 * (by_a * a_rate + by_s * s_rate)
        # Of both arms: 2 swing a'' = ...
        weight = 2 * G * (5 + 0.15) * np.cos(a)
        a_force = 0.5 * turning_slope(a) * rate**2 + weight - 2 * tension * by_a
        s_force = -3 * G - 2 * tension * by_s
        return [rate, a_rate, s_rate, a_force / (2 * swing), s_force / 3]

    y = integrate(accelerate, [0.0, start, 0.5, 0.0, 0.0], time).y[:, -1]
    return {"s": y[2], "shaft_angle": y[0], "arm_angle": y[1]}


def flip():
    """Landau and Lifshitz, Mechanics, section 37, for an angular momentum below that of the middle axis at this energy: I1 and I3
    change places."""
    i1, i2, i3 = 1e-5, 2e-5, 3e-5
    tilt, m = np.radians(1), 2e-4
    twice = m**2 * (np.sin(tilt) ** 2 / i1 + np.cos(tilt) ** 2 / i2)
    square = (i2 - i3) * (twice * i1 - m**2) / ((i1 - i2) * (m**2 - twice * i3))
    rate = np.sqrt((i1 - i2) * (m**2 - twice * i3) / (i1 * i2 * i3))
    period = 4 * ellipk(square) / rate
    # Euler's equations themselves: the middle component passes zero upwards.
    def euler(_, w):
        return [(i2 - i3) * w[1] * w[2] / i1, (i3 - i1) * w[2] * w[0] / i2, (i1 - i2) * w[0] * w[1] / i3]

    def middle(_, w):
        return w[1]

    middle.direction = 1
    found = integrate(euler, [m * np.sin(tilt) / i1, m * np.cos(tilt) / i2, 0], 9, events=middle)
    crossings = found.t_events[0]
    assert abs(crossings[1] - crossings[0] - period) < 1e-9, (crossings, period)
    return {"period": period}


def bounces(asked=0.5):
    """m x'' = -K x^1.5 (1 + chi x' / v0): rebound over approach speed, which K, m and v0 do not change, with the damping factor
    chi of each law as its authors give it."""
    # Gonthier et al. 2004: chi = d / e, where d solves (1 + d / e) / (1 - d) = exp(d (1 + 1 / e)).
    gonthier = brentq(lambda d: np.log((1 + d / asked) / (1 - d)) - d * (1 + 1 / asked), 1e-3, 1 - 1e-12, xtol=1e-15)
    factors = {
        "hertz": 0.0,
        "lankarani_nikravesh": 3 * (1 - asked**2) / 4,
        "hunt_crossley": 3 * (1 - asked) / 2,
        "flores": 8 * (1 - asked) / (5 * asked),
        "gonthier": gonthier / asked,
    }

    def rebound(chi):
        def out(_, y):
            return y[0]

        out.terminal, out.direction = True, -1
        # From a depth of zero on: the first instant is no crossing.
        def rate(_, y):
            return [y[1], -max(y[0], 0) ** 1.5 * (1 + chi * y[1])]

        return -integrate(rate, [0.0, 1.0], 20.0, events=out).y_events[0][0][1]

    return {law: rebound(chi) for law, chi in factors.items()}


def flores():
    """The rod's angle and the slider's place; contact begins and ends at located instants."""
    crank, length, centre, speed, play = 0.05, 0.12, 0.06, 5000 * 2 * np.pi / 60, 0.5e-3
    mass, inertia, slider = 0.21, 2.5e-4, 0.14
    ball = 9.5e-3
    k = 4 / (3 * 2 * (1 - 0.3**2) / 207e9) * np.sqrt(ball * (ball + play) / play)
    chi = 3 * (1 - 0.9**2) / 4

    def gap(t, y):
        """Depth, its rate, and the normal from the socket's centre to the ball's."""
        angle, x, angle_rate, x_rate = y
        pin = crank * np.array([np.cos(speed * t), np.sin(speed * t)])
        pin_rate = crank * speed * np.array([-np.sin(speed * t), np.cos(speed * t)])
        off = pin + length * np.array([np.cos(angle), np.sin(angle)]) - [x, 0]
        rate = pin_rate + length * angle_rate * np.array([-np.sin(angle), np.cos(angle)]) - [x_rate, 0]
        distance = np.hypot(*off)
        normal = off / distance if distance > 0 else np.zeros(2)
        return distance - play, normal @ rate, normal

    def accelerate(t, y, approach):
        angle, _, angle_rate, x_rate = y
        force, normal = 0.0, np.zeros(2)
        if approach is not None:
            depth, rate, normal = gap(t, y)
            # A trial step may go anywhere; its error then rejects it.
            force = k * min(max(depth, 0.0), ball) ** 1.5 * max(0.0, 1 + chi * rate / approach)
        pin = -(speed**2) * crank * np.array([np.cos(speed * t), np.sin(speed * t)])
        across = np.array([-np.sin(angle), np.cos(angle)])
        turn = -mass * centre * (across @ pin) - length * force * (across @ normal)
        return [angle_rate, x_rate, turn / (inertia + mass * centre**2), force * normal[0] / slider]

    def touch(t, y, _):
        return gap(t, y)[0]

    touch.terminal = True
    t, y, approach, end = 0.0, [0.0, crank + length, -crank * speed / length, 0.0], None, 2e-3
    out, number = {}, 0
    while t < end:
        touch.direction = 1 if approach is None else -1
        # Steps so short that no contact begins and ends within one.
        options = {"rtol": 1e-12, "atol": 1e-14, "max_step": 1e-6, "events": touch, "dense_output": True}
        found = solve_ivp(accelerate, (t, end), y, "DOP853", args=(approach,), **options)
        assert found.success, found.message
        if approach is not None:
            forces = []
            for at in np.linspace(t, found.t[-1], 20_001):
                depth, rate, _ = gap(at, found.sol(at))
                forces.append(k * max(depth, 0.0) ** 1.5 * (1 + chi * rate / approach))
            out[f"peak_{number}"] = max(forces)
        t, y = found.t[-1], found.y[:, -1]
        if found.status == 0:
            break
        if approach is None:
            number += 1
            approach = gap(t, y)[1]
            out[f"start_{number}"], out[f"approach_{number}"] = t, approach
        else:
            approach = None
    # The first two impacts, and the slider after all of them.
    kept = {key: value for key, value in out.items() if key[-1] in "12"}
    assert number == 7, number
    return kept | {"x": y[1]}


def level_pin():
    """An end of a pin thrown level: half of K on half of the mass. With s the rate over that at the start, the work of
    F = K d^1.5 (1 + chi s) gives (2/5) K d^2.5 = m v^2 ((1 - s) / chi - ln((1 + chi) / (1 + chi s)) / chi^2)."""
    modulus = 206e9 / (2.0 * (1.0 - 0.3**2))
    k = 0.5 * 4.0 / 3.0 * modulus * np.sqrt(0.01 * 0.0101 / 1e-4)
    mass, speed, chi = 0.05, 0.2, 0.75 * (1.0 - 0.9**2)

    def force(s):
        lost = (1.0 - s) / chi - np.log((1.0 + chi) / (1.0 + chi * s)) / chi**2
        return k**0.4 * (2.5 * mass * speed**2 * lost) ** 0.6 * (1.0 + chi * s)

    found = minimize_scalar(lambda s: -force(s), bounds=(-0.5, 0.9), method="bounded", options={"xatol": 1e-10})
    return {"peak": -found.fun}


def belt():
    """m x'' = -k x + mu(v - x') m g while the block slips, x' = v while it sticks, without compliance: the spring breaks it away where
    it pulls as hard as friction at rest holds. The highest place, and the period."""
    speed, stiffness, weight, kinetic, ratio, stribeck = 0.05, 200.0, 9.81, 0.15, 1.6, 2e-3

    def rate(_, y):
        friction = kinetic * weight * (1.0 + (ratio - 1.0) * np.exp(-(((speed - y[1]) / stribeck) ** 2)))
        return [y[1], friction - stiffness * y[0]]

    def stops(_, y):
        return y[1]

    def sticks(t, y):
        return speed - y[1] if t > 1e-3 else 1.0

    sticks.terminal = True
    breaks = ratio * kinetic * weight / stiffness
    slip = integrate(rate, [breaks, speed], 1.0, events=[stops, sticks])
    turns, caught = slip.y_events[0][:, 0], slip.y_events[1][0, 0]
    return {"period": slip.t_events[1][0] + (breaks - caught) / speed, "highest": turns.max()}


def groove():
    """A pin that turns under its weight and cuts its own circle into its bearing: how far its axis sinks until the crescent between the
    unworn circle and its own holds what k F s has removed, both as cosines in the play; and as deep in the wall as half of its weight
    presses each end."""
    clearance, radius, length = 1e-4, 1e-2, 24e-3
    area = 2.0 * np.pi * radius * length
    mean = 1e-7 * 10.0 * 100.0 * radius * 0.1 / area

    def crescent(reach):
        edge = np.arccos(clearance / reach)
        return (reach * np.sin(edge) - clearance * edge) / np.pi - mean

    reach = brentq(crescent, clearance * (1.0 + 1e-12), 1e-2)
    return {"worn": mean, "off": reach + (5.0 / 0.5e10) ** (2.0 / 3.0)}


def oiled():
    """Films from the pressure itself, in units of mu r^2 / c^3. A journal whose gap opens and closes as it turns: h^3 p' = -12 u (cos(theta) +
    constant) over the half that closes, with p = 0 at both ends, u = e omega / 2, and theta from the thinnest place. Where its force carries
    the weight, it rests, and then lies at the angle at which that force is upright. A ball that sinks: p = 3 (1 / h^2 - 1) u / eps over the
    half below, and its equation of motion from a fifth of the play on."""
    clearance, radius, length, omega = 1e-4, 1e-2, 24e-3, 100.0

    def journal(ratio):
        h = lambda theta: 1.0 - ratio * np.cos(theta)
        # The part moves across, towards theta = 90 degrees: the film lies from 0 to 180.
        sine = lambda theta: np.sin(theta - np.pi / 2)
        constant = -quad(lambda t: sine(t) / h(t) ** 3, 0, np.pi)[0] / quad(lambda t: h(t) ** -3, 0, np.pi)[0]
        slope = lambda theta: -12.0 * (sine(theta) + constant) / h(theta) ** 3
        options = {"epsabs": 1e-13, "epsrel": 1e-13, "limit": 200}
        along = quad(lambda t: slope(t) * np.sin(t), 0, np.pi, **options)[0]
        across = -quad(lambda t: slope(t) * np.cos(t), 0, np.pi, **options)[0]
        return 5e-3 * length * radius**3 / clearance**3 * 0.5 * omega * ratio * clearance * np.array([along, across])

    ratio = brentq(lambda ratio: np.hypot(*journal(ratio)) - 10.0, 0.05, 0.95, xtol=1e-14)
    along, across = journal(ratio)
    attitude = np.arctan2(abs(across), abs(along))

    def sinks(_, y):
        x = y[0] / clearance
        force = quad(lambda u: u * (1.0 / (1.0 - x * u) ** 2 - 1.0) / x, 0, 1, epsabs=1e-12, epsrel=1e-12)[0]
        return [y[1], 10.0 - 6.0 * np.pi * 0.05 * radius**4 / clearance**3 * force * y[1] / 0.1]

    solution = solve_ivp(sinks, (0.0, 1.0), [0.2 * clearance, 0.0], method="Radau", rtol=1e-11, atol=1e-16)
    y, z = ratio * clearance * np.sin(attitude), -ratio * clearance * np.cos(attitude)
    return {"y": y, "z": z, "depth": solution.y[0, -1]}


JOINTS = Path(__file__).parents[2] / "physics" / "joints"


def contacts(name):
    """The first and the fifth contact to end of a run of another program (free rigid bodies with quaternions, DOP853 at a tolerance of
    1e-13, located contacts), from its table of contacts."""
    with open(JOINTS / f"{name}-contacts.csv") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: float(row["end_s"]))
    first, fifth = rows[0], rows[4]
    return {
        "start_1": first["start_s"],
        "approach_1": first["approach_m_s"],
        "peak_1": first["peak_N"],
        "peak_5": fifth["peak_N"],
    }


CASES = {
    "pendulum": lambda: pendulum(10.0),
    "four_bars": lambda: four_bars(10.0),
    "squeezer": lambda: squeezer(0.03),
    "bricard": lambda: bricard(9.0),
    "governor": lambda: governor(10.0),
    "flip": flip,
    "bounces": bounces,
    "flores": flores,
    "level_pin": level_pin,
    "belt": belt,
    "groove": groove,
    "oiled": oiled,
    **{name: lambda name=name: contacts(name.removeprefix("joint_")) for name in (
        "joint_a", "joint_a_shaft", "joint_b", "joint_h", "joint_c", "joint_c_nofric", "joint_d1", "joint_d2"
    )},
}

if __name__ == "__main__":
    print("# Made by tests/reference/validation/models.py, which says what each number is; SI units.")
    for name, case in CASES.items():
        print(f"\n[{name}]")
        for word, value in case().items():
            print(f"{word} = {float(value):.14g}")
