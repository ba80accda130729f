"""Writes the tables of docs/mujoco.md: two machines with play in Jointplay and in MuJoCo, their accuracy and their time.

    pip install ./python mujoco && python -P python/mujoco_comparison.py

Takes some minutes. Times are medians of runs that take turns, so that other load falls on all of them alike.
"""

import inspect
import math
import os
import platform
import re
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

import jointplay as jp

PAGE = Path(__file__).parents[1] / "docs" / "mujoco.md"
ROUNDS = 9
SPAN = 0.5
ROW = 1e-4
"""Time between the positions compared, s: a multiple of every step."""

ROD_TOML = """
name = "hanging-rod"
[gravity]
z = "-9.81 m/s^2"
[contact]
friction = 0
restitution = 0.9
[output]
body = "rod"
[[body]]
name = "rod"
mass = "0.384 kg"
inertia = "1.92e-3 1.92e-3 1.58e-5 kg m^2"
[[joint]]
name = "S"
kind = "spherical"
child = "rod"
child_point = "0 0 100 mm"
rotation = { axis = [0, 1, 0], angle = "-30 deg" }
play = { radial = "0.2 mm", radius = "10 mm" }
"""

ROD_MJCF = """
<mujoco model="hanging rod">
  <option timestep="{step}" integrator="{integrator}"><flag diagexact="{exact}"/></option>
  <worldbody>
    <site name="socket"/>
    <body name="rod" euler="0 -30 0">
      <freejoint/>
      <inertial pos="0 0 -0.1" mass="0.384" diaginertia="1.92e-3 1.92e-3 1.58e-5"/>
      <site name="ball"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="play" range="0 0.2e-3" solreflimit="{stiffness} {damping}" solimplimit="1e-3 1e-3 1e-3">
      <site site="socket"/>
      <site site="ball"/>
    </spatial>
  </tendon>
  <sensor>
    <tendonlimitfrc tendon="play"/>
    <tendonpos tendon="play"/>
    <framepos objtype="body" objname="rod"/>
  </sensor>
</mujoco>
"""

CRANK_TOML = """
name = "loose-crank-pin"
[gravity]
z = "-9.81 m/s^2"
[contact]
friction = 0
restitution = 0.9
[output]
body = "block"
[[body]]
name = "flywheel"
mass = "2 kg"
inertia = "5e-3 5e-3 5e-3 kg m^2"
[[joint]]
name = "crank"
kind = "revolute"
child = "flywheel"
axis = [0, -1, 0]
start = { velocity = "240 rpm" }
[[body]]
name = "block"
mass = "0.14 kg"
inertia = "1e-4 1e-4 1e-4 kg m^2"
[[joint]]
name = "guide"
kind = "prismatic"
child = "block"
axis = [1, 0, 0]
start = { position = "200 mm" }
[[body]]
name = "rod"
mass = "0.26 kg"
inertia = "4e-6 4.9e-4 4.9e-4 kg m^2"
[[joint]]
name = "wrist-pin"
kind = "revolute"
parent = "block"
child = "rod"
child_point = "75 0 0 mm"
axis = [0, -1, 0]
start = { velocity = "-80 rpm" }
[[joint]]
name = "P"
kind = "revolute"
parent = "rod"
child = "flywheel"
parent_point = "-75 0 0 mm"
child_point = "50 0 0 mm"
axis = [0, -1, 0]
closes_loop = true
play = { radial = "0.2 mm", radius = "10 mm", planar = true }
"""

CRANK_MJCF = """
<mujoco model="loose crank pin">
  <option timestep="{step}" integrator="{integrator}"><flag diagexact="{exact}"/></option>
  <worldbody>
    <body name="flywheel">
      <joint name="crank" axis="0 -1 0"/>
      <inertial pos="0 0 0" mass="2" diaginertia="5e-3 5e-3 5e-3"/>
      <site name="pin" pos="0.05 0 0"/>
    </body>
    <body name="block" pos="0.2 0 0">
      <joint name="guide" type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="0.14" diaginertia="1e-4 1e-4 1e-4"/>
      <body name="rod">
        <joint name="wrist-pin" axis="0 -1 0"/>
        <inertial pos="-0.075 0 0" mass="0.26" diaginertia="4e-6 4.9e-4 4.9e-4"/>
        <site name="bearing" pos="-0.15 0 0"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="play" range="0 0.2e-3" solreflimit="{stiffness} {damping}" solimplimit="1e-3 1e-3 1e-3">
      <site site="bearing"/>
      <site site="pin"/>
    </spatial>
  </tendon>
  <sensor>
    <tendonlimitfrc tendon="play"/>
    <tendonpos tendon="play"/>
    <framepos objtype="body" objname="block"/>
  </sensor>
  <keyframe>
    <key qvel="25.132741228718345 0 -8.377580409572781"/>
  </keyframe>
</mujoco>
"""


@dataclass(frozen=True)
class Machine:
    title: str
    toml: str
    mjcf: str
    output: str
    """The body whose position is compared."""


ROD = Machine("A rod that hangs on a loose ball", ROD_TOML, ROD_MJCF, "rod")
CRANK = Machine("A slider-crank with a loose crank pin", CRANK_TOML, CRANK_MJCF, "block")


def run_jointplay(toml, changes, output, span):
    run = jp.Scene.from_toml(toml).set(changes).run(span, every=ROW)
    positions = np.stack([run[f"{output}.pose.{axis}"] for axis in "xyz"], axis=1)
    return positions, run.impacts


def run_mujoco(mjcf, span):
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    start = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    _, sensors = rollout.rollout(model, data, start, nstep=round(span / model.opt.timestep))
    force, depth = np.abs(sensors[0, :, 0]), sensors[0, :, 1] - model.tendon_range[0, 1]
    edges = np.flatnonzero(np.diff((depth > 0).astype(int)))
    crossings = model.opt.timestep * (edges - depth[edges] / (depth[edges + 1] - depth[edges]))
    ends = zip(crossings[::2], crossings[1::2], edges[::2], edges[1::2])
    impacts = [Impact(start, end, force[first : last + 2].max()) for start, end, first, last in ends]
    return sensors[0, :: round(ROW / model.opt.timestep), 2:5], impacts


@dataclass(frozen=True)
class Impact:
    start: float
    """Time at which it begins, s."""
    end: float
    """Time at which it ends, s."""
    peak: float
    """Largest force, N."""


def limit_of(machine, impacts, match, exact):
    """Keys of the limit with which the first impact in MuJoCo has the duration or the peak, and the restitution, of that in Jointplay."""
    wanted = Impact(*(impacts[0][name] for name in ("start_s", "end_s", "peak_N")))
    ratio = 0.0
    for _ in range(20):
        ratio = -math.log(impacts[0]["restitution_law"]) / (math.pi - 2 * ratio)
    stiffness, duration = (math.pi / (wanted.end - wanted.start)) ** 2, wanted.end - wanted.start
    for _ in range(8):
        limit = {"stiffness": -stiffness, "damping": -2 * ratio * stiffness * duration / math.pi, "exact": exact}
        first = run_mujoco(machine.mjcf.format(step=1e-6, integrator="Euler", **limit), wanted.end + 1e-4)[1][0]
        duration = first.end - first.start
        by = duration / (wanted.end - wanted.start) if match == "duration" else wanted.peak / first.peak
        stiffness *= by**2
    return limit


def closed_form(clearance=0.2e-3, mass=0.384, inertia=1.92e-3, arm=0.1, tilt=math.pi / 6, gravity=9.81):
    """First impact of the rod: start, s, and approach speed, m/s, by the fall through the gap; largest force, N, by the energy of the
    impact, without the weight and with it.

    The force K d^1.5 (1 + chi u/v) takes a ball of effective mass m from the speed v to u at the depth d:
    K d^2.5 / 2.5 = m v^2 ((1 - u/v) / chi - ln((1 + chi) / (1 + chi u/v)) / chi^2) + integral of m g / (1 + chi u/v) over d.
    """
    speed = math.sqrt(2 * gravity * clearance)
    effective = 1 / (1 / mass + (arm * math.sin(tilt)) ** 2 / inertia)
    youngs, poisson, radius = 206e9, 0.3, 10e-3
    stiffness = 4 / (6 * (1 - poisson**2) / youngs) * math.sqrt(radius * (radius + clearance) / clearance)
    chi = 3 * (1 - 0.9**2) / 4
    u = np.linspace(1, 0, 100_001)
    kinetic = effective * speed**2 * ((1 - u) / chi - np.log((1 + chi) / (1 + chi * u)) / chi**2)
    weight, peaks = 0.0, []
    for _ in range(8):
        depth = (2.5 * (np.maximum(kinetic, 0) + weight) / stiffness) ** 0.4
        peaks.append((stiffness * depth**1.5 * (1 + chi * u)).max())
        slope = effective * gravity / (1 + chi * u)
        weight = np.append(0, np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(depth)))
    return math.sqrt(2 * clearance / gravity), speed, peaks[0], peaks[-1]


PRESETS = ("real-time", "accurate", "reference")
TUNED = {"duration": ("duration", "disable"), "duration, by mass": ("duration", "enable"), "peak": ("peak", "disable")}
"""What the first impact is tuned to, and whether the limit scales with the effective mass of each impact (`diagexact`)."""

MUJOCO = [(match, "Euler", step) for match in TUNED for step in (2e-5, 1e-5, 5e-6, 1e-6)]
MUJOCO += [(match, "RK4", step) for match in TUNED for step in (2e-5, 5e-6)]
MUJOCO += [("duration", "Euler", 1e-4), ("duration", "RK4", 1e-4), ("duration", "implicitfast", 5e-6), ("duration", "discrete", 5e-6)]


@dataclass
class Result:
    label: str
    peaks: np.ndarray
    """Largest forces of the first five impacts, N."""
    positions: np.ndarray
    steps: int
    """Of the whole span."""
    work: Callable[[], float]
    """Steps through the span and returns the time that it took, s."""
    times: list


def stepping_jointplay(toml, changes):
    simulation = jp.Simulation(jp.Scene.from_toml(toml).set(changes))
    start = simulation.state

    def work():
        simulation.restore(start)
        before = time.perf_counter()
        simulation.step_until(SPAN)
        return time.perf_counter() - before

    return work


def stepping_mujoco(mjcf):
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)

    def work():
        mujoco.mj_resetData(model, data)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        before = time.perf_counter()
        mujoco.mj_step(model, data, round(SPAN / model.opt.timestep))
        return time.perf_counter() - before

    return work


def measure(machine):
    """Results of all methods, the reference last of those of Jointplay; the reference at 1e-12; the tuned numbers."""
    results = []
    for preset in PRESETS:
        changes = {"solver.preset": preset}
        positions, impacts = run_jointplay(machine.toml, changes, machine.output, 0.05)
        steps = jp.Scene.from_toml(machine.toml).set(changes).run(SPAN, warn=False).statistics["steps"]
        work = stepping_jointplay(machine.toml, changes)
        results.append(Result(f"Jointplay, `{preset}`", impacts["peak_N"][:5], positions, steps, work, []))
    reference = impacts
    tighter = run_jointplay(machine.toml, {"solver.method": "dopri5", "solver.tolerance": "1e-12"}, machine.output, 0.05)
    limits = {match: limit_of(machine, reference, *how) for match, how in TUNED.items()}
    for match, integrator, step in MUJOCO:
        mjcf = machine.mjcf.format(step=step, integrator=integrator, **limits[match])
        positions, impacts = run_mujoco(mjcf, 0.05)
        peaks = np.array([impact.peak for impact in impacts[:5]])
        label = f"MuJoCo, {match}, `{integrator}` {step * 1e6:g} us"
        results.append(Result(label, peaks, positions, round(SPAN / step), stepping_mujoco(mjcf), []))
    repeats = [max(1, round(0.1 / result.work())) for result in results]
    for _ in range(ROUNDS):
        for result, count in zip(results, repeats):
            result.times.append(statistics.mean(result.work() for _ in range(count)))
    return results, reference, tighter, limits


def markdown(heads, rows):
    columns = heads.split(" | ")
    return "".join("| " + " | ".join(cells) + " |\n" for cells in [columns, ["---"] * len(columns), *rows]).replace(" --- ", "---")


def exponent(value):
    return f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e")


def three(value):
    """With about three digits, never as a power of ten."""
    return f"{value:.2f}" if value < 10 else f"{value:.1f}" if value < 100 else f"{value:.0f}"


def errors(result, reference, positions):
    """Largest relative error of the first five peaks, and of the position until the fifth impact begins, m; None if the run diverged."""
    until = int(reference["start_s"][4] / ROW) + 1
    differences = np.linalg.norm(result.positions[:until] - positions[:until], axis=1)
    if len(result.peaks) < 5 or not differences.max() < 1e-2:
        return None
    return np.abs(result.peaks / reference["peak_N"][:5] - 1).max(), differences.max()


def rows_of(results, reference):
    """The page's rows. Times are ratios to `real-time`, paired within each round."""
    base, positions = results[0].times, results[len(PRESETS) - 1].positions
    rows = []
    for result in results:
        ratio = statistics.median(own / other for own, other in zip(result.times, base))
        first = f"{(result.peaks[0] / reference['peak_N'][0] - 1) * 100:+.2g} %"
        found = errors(result, reference, positions)
        cells = ["diverges"] * 3 if found is None else [f"{result.peaks.max():.1f}", exponent(found[0]), exponent(found[1] * 1e6)]
        if result is results[len(PRESETS) - 1]:
            cells[1:], first = ["-", "-"], "-"
        spent = ["-", "-"] if found is None else [three(statistics.median(result.times) * 1e3), three(ratio)]
        rows.append([result.label, *spent, f"{result.peaks[0]:.1f}", first, *cells])
    return rows


def lines(text):
    return sum(bool(line.strip()) for line in text.splitlines())


def lines_table():
    """Lines of the models above, of the functions that run them and of the one that tunes."""
    running, others, tuning = (str(lines(inspect.getsource(function))) for function in (run_jointplay, run_mujoco, limit_of))
    counts = [
        ["Jointplay", str(lines(ROD_TOML)), str(lines(CRANK_TOML)), running, "0"],
        ["MuJoCo", str(lines(ROD_MJCF)), str(lines(CRANK_MJCF)), others, tuning],
    ]
    return markdown("Program | Rod | Slider-crank | Run, positions and impacts | Tuning", counts)


def main():
    mujoco.set_mju_user_warning(lambda _: None)        # of the runs that diverge
    page = PAGE.read_text(encoding="utf-8")

    def insert(name, content):
        nonlocal page
        page, count = re.subn(rf"(<!-- {name} -->\n).*?(<!-- end -->)", lambda found: found[1] + content + found[2], page, flags=re.DOTALL)
        assert count == 1, name

    load = os.getloadavg()[0]
    model = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))[1]
    found, stated = {}, []
    for name, machine in (("rod", ROD), ("crank", CRANK)):
        results, reference, tighter, limits = measure(machine)
        found[name] = results, reference, tighter
        heads = "Method | Time, ms | Ratio | First peak, N | Error | Largest of five, N | Largest error of five | Position error, um"
        insert(name, markdown(heads, rows_of(results, reference)))
        stated += [[machine.title, match, f"{limit['stiffness']:.4g}", f"{limit['damping']:.4g}"] for match, limit in limits.items()]
    insert("limits", markdown("Machine | Tuned to | Stiffness in `solreflimit`, 1/s^2 | Damping, 1/s", stated))

    equal = []
    for machine, (results, reference, _) in zip((ROD, CRANK), found.values()):
        exact = results[len(PRESETS) - 1].positions
        rated = [(errors(result, reference, exact), result) for result in results[len(PRESETS) :]]
        kept = [(error, result) for error, result in rated if error is not None]
        own = errors(results[0], reference, exact)
        for what, index, unit in (("position", 1, 1e6), ("five peaks", 0, 1.0)):
            least = min(error[index] for error, _ in kept)
            near = [(error, result) for error, result in kept if error[index] <= 2 * least]
            error, best = min(near, key=lambda pair: statistics.median(pair[1].times))
            ratios = [theirs / ours for theirs, ours in zip(best.times, results[0].times)]
            spread = np.percentile(ratios, [25, 75])
            numbers = [exponent(error[index] * unit), exponent(own[index] * unit)]
            word = f"{what}, um" if index == 1 else f"{what}, relative"
            spread = f"{three(spread[0])} to {three(spread[1])}"
            equal.append([machine.title, word, best.label, *numbers, three(statistics.median(ratios)), spread])
    heads = "Machine | Error of | Fastest of MuJoCo within twice its least | Its error | Error of `real-time` | Time ratio | Quartiles"
    insert("equal", markdown(heads, equal))

    checks = []
    for machine, (results, reference, (positions, impacts)) in zip((ROD, CRANK), found.values()):
        until = int(reference["start_s"][4] / ROW) + 1
        peak = np.abs(impacts["peak_N"][:5] / reference["peak_N"][:5] - 1).max()
        place = np.linalg.norm(positions[:until] - results[len(PRESETS) - 1].positions[:until], axis=1).max()
        checks.append([f"{machine.title}: tolerance 1e-12", f"five peaks {exponent(peak)}, position {exponent(place * 1e6)} um"])
    start, speed, light, peak = closed_form()
    first = found["rod"][1][0]
    checks += [
        ["First flight ends at sqrt(2 c/g)", f"{exponent(abs(first['start_s'] / start - 1))} of {start * 1e3:.4f} ms"],
        ["Approach speed sqrt(2 g c)", f"{exponent(abs(first['approach_m_s'] / speed - 1))} of {speed * 1e3:.4f} mm/s"],
        ["First peak by the energy of the impact", f"{exponent(abs(first['peak_N'] / peak - 1))} of {peak:.2f} N"],
        ["The same without the weight", f"{exponent(abs(first['peak_N'] / light - 1))} of {light:.2f} N"],
    ]
    insert("reference", markdown("Check | Difference from `reference`", checks))

    insert("lines", lines_table())

    speeds = []
    shown = ["Jointplay, `real-time`", "Jointplay, `accurate`", *(f"MuJoCo, duration, `{name}` 5 us" for name in ("Euler", "RK4"))]
    for result in found["crank"][0]:
        if result.label in shown:
            each = statistics.median(result.times) / result.steps * 1e6
            speeds.append([result.label, str(result.steps), f"{each:.2g}"])
    insert("steps", markdown("Slider-crank | Steps | Time of a step, us", speeds))
    insert(
        "machine",
        f"Measured on: {model}, {os.cpu_count()} processors, {platform.system()} {platform.machine()}, Python {platform.python_version()},\n"
        f"MuJoCo {mujoco.__version__}; load average {load:.1f} at the start, {os.getloadavg()[0]:.1f} at the end (the machine was shared); "
        f"medians of {ROUNDS} rounds.\n",
    )
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
