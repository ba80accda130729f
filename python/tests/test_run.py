"""Runs: the same bits as those of the program, arrays without copies, doubts, errors, interruption."""

import _thread
import gc
import pickle
import threading
import warnings

import numpy as np
import psutil
import pytest

import jointplay as jp

SCENES = [("four-bar", {}), ("spcmm", {"contact.clearance": "0.5 mm"}), ("slider-crank-driven", {"solver.method": "radau5"})]


@pytest.mark.parametrize("name, changes", SCENES)
def test_bits_are_those_of_the_program(name, changes, summary, tmp_path):
    files = [tmp_path / "rows.npz", tmp_path / "impacts.npz"]
    options = [f"--set={key}={value}" for key, value in changes.items()]
    expected = summary("run", name, *options, "--duration", "20ms", "--every", "0.1ms", "--out", files[0], "--impacts", files[1])
    run = jp.Scene.load(name).set(changes).run("20 ms", every="0.1 ms", warn=False)
    assert run.hash == expected["state_hash"]
    rows = np.load(files[0])
    columns = [column for _, column, _, _ in run._channels]
    assert [column for column in rows.files if column != "meta"] == columns
    for column in columns:
        assert rows[column].tobytes() == run[column].tobytes(), column
    impacts = np.load(files[1])
    assert len(run.impacts) == len(impacts["start_s"]) > 0
    for column in ["start_s", "end_s", "peak_N", "steps"]:
        assert np.array_equal(impacts[column], run.impacts[column]), column
    assert run.ledger == expected["energy_J"] and run.doubts == expected["doubts"]
    assert run.statistics["steps"] == expected["steps"]
    assert {name: joint["peak_normal"] for name, joint in run.statistics["joints"].items()} == expected["peak_normal_N"]


def test_arrays_share_the_memory_of_the_run_and_outlive_it():
    run = jp.Scene.load("four-bar").run("10 ms", every="0.1 ms")
    normal, force = run["A.normal"], run["A.force"]
    assert np.shares_memory(normal, run["A_normal_N"]) and np.shares_memory(force[:, 1], run["A.force.y"])
    assert normal.shape == (101,) and force.shape == (101, 3) and normal.flags.c_contiguous
    for array in [normal, force, run.time]:
        assert not array.flags.writeable
        with pytest.raises(ValueError):
            array[0] = 1.0
        with pytest.raises(ValueError):
            array.flags.writeable = True
    copy = normal.copy()
    del run, force
    gc.collect()
    ballast = [np.ones(1000) for _ in range(1000)]
    assert np.array_equal(normal, copy) and len(ballast) == 1000


def test_a_run_survives_pickling():
    run = jp.Scene.load("four-bar").run("2 ms", every="1 ms")
    again = pickle.loads(pickle.dumps(run))
    assert (again.hash, again.scene, again.channels) == (run.hash, run.scene, run.channels)
    assert again["A.force"].tobytes() == run["A.force"].tobytes() and not again["A.force"].flags.writeable


def test_rows_are_at_the_requested_times():
    scene = jp.Scene.load("pendulum")
    assert np.allclose(scene.run("10 ms", every="3 ms").time, [0.0, 0.003, 0.006, 0.009], rtol=1e-15)
    assert len(scene.run(0.02).time) == 1001 and len(scene.run(0).time) == 1
    # Rows change no step.
    assert scene.run("20 ms", every="7 us").hash == scene.run("20 ms", every="5 ms").hash


def test_channels_are_chosen_by_name_and_pattern():
    run = jp.Scene.load("four-bar").run("2 ms", every="1 ms", channels=["?.normal", "crank.reaction"])
    names = ["time", "A.normal", "B.normal", "crank.reaction.x", "crank.reaction.y", "crank.reaction.z"]
    assert run.channels == names and list(run) == names and run.units["A.normal"] == "N"
    assert np.all(np.isfinite(run["crank.reaction"]))
    for wrong, message in [
        ("A.nromal", "did you mean `A.normal`?"),
        ("A.penetration", "was not recorded"),
        ("crank", "several channels"),
    ]:
        with pytest.raises(jp.ChannelError) as caught:
            run[wrong]
        assert message in str(caught.value) and isinstance(caught.value, KeyError)
    with pytest.raises(jp.OptionError, match="A.froce"):
        jp.Scene.load("four-bar").run("2 ms", channels=["A.froce"])


def test_a_table_has_the_columns_of_the_program():
    run = jp.Scene.load("four-bar").run("2 ms", every="1 ms")
    table = run.to_pandas()
    assert list(table.columns[:2]) == ["t_s", "x_m"] and len(table) == 3
    assert table["A_normal_N"].to_numpy().tobytes() == run["A.normal"].tobytes()


def test_impacts_name_their_joints():
    impacts = jp.Scene.load("four-bar").run("50 ms").impacts
    assert set(impacts["joint"]) == {"A", "B"} and impacts["disturbed"].dtype == bool
    assert np.all(impacts["end_s"] > impacts["start_s"]) and np.all(np.diff(impacts["end_s"]) >= 0)


def test_doubts_are_warnings():
    coarse = jp.Scene.load("four-bar").set({"solver.method": "rk4", "solver.step": "20 us"})
    with pytest.warns(jp.DoubtWarning, match="four-bar: ") as caught:
        run = coarse.run("20 ms")
    assert [str(one.message) for one in caught] == [f"four-bar: {doubt}" for doubt in run.doubts]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        coarse.run("20 ms", warn=False)


def test_a_stopped_run_has_its_rows():
    wild = jp.Scene.load("spcmm").set({"solver.method": "rk4", "solver.step": "1 ms", "contact.clearance": "0.5 mm"})
    with pytest.raises(jp.Stopped, match="stopped at t = ") as caught:
        wild.run("1 s", every="1 ms", warn=False)
    error = caught.value
    assert isinstance(error, RuntimeError) and 0.0 <= error.time < 1.0 and "solver" in error.advice
    assert 0 < len(error.run.time) < 1001 and error.run.end == error.time and np.all(np.isfinite(error.run["S1.normal"]))


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("20",), "duration"),
        (("20 mm",), "duration"),
        ((-1.0,), "negative"),
        ((float("nan"),), "not negative"),
        (("1e9 s",), "at most"),
        (([],), "text with a unit"),
        ((True,), "text with a unit"),
        (("1 ms", 0.0), "every = 0"),
        (("1 ms", "2 ms"), "every = 0.002 s is longer than duration = 0.001 s"),
    ],
)
def test_times_are_checked(arguments, message):
    with pytest.raises(jp.OptionError, match=message):
        jp.Scene.load("pendulum").run(*arguments)


def test_a_run_is_a_mapping_of_its_channels():
    run = jp.Scene.load("four-bar").run("2 ms", every="1 ms")
    assert list(run) == run.channels and len(run) == len(dict(run)) == len(run.channels)
    assert all(dict(run)[name].tobytes() == run[name].tobytes() for name in run)
    assert "A.force" in run and "A.nromal" not in run and run == run and run != run.scene.run("2 ms", every="1 ms")
    table = np.asarray(run)
    assert table.shape == (3,) and table.dtype.names == tuple(run.channels)
    assert np.array_equal(table["A.normal"], run["A.normal"])
    with pytest.raises(ValueError, match="is a copy"):
        np.array(run, copy=False)


def test_curves_name_their_channels_and_units():
    run = jp.Scene.load("four-bar").run("2 ms", every="1 ms")
    axes = run.plot("A_normal_N")
    (line,) = axes.get_lines()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time, s", "A.normal, N")
    assert np.array_equal(line.get_ydata(), run["A.normal"]) and np.array_equal(line.get_xdata(), run.time)
    assert run.plot("A.force", "A.penetration", axes=axes) is axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "A.normal, N",
        *(f"A.force.{axis}, N" for axis in "xyz"),
        "A.penetration, m",
    ]
    with pytest.raises(jp.ChannelError, match="did you mean `A.normal`"):
        run.plot("A.nromal")


def test_poses_are_those_of_the_simulation():
    scene = jp.Scene.load("spcmm").set(clearance="0.5 mm")
    run = scene.run("10 ms", every="5 ms", channels=["*.pose.*"], warn=False)
    simulation = jp.Simulation(scene)
    simulation.step_until("10 ms")
    poses = simulation.frame().transforms
    assert run.transforms.shape == (3, len(scene.bodies), 4, 4)
    assert np.allclose(run.transforms[-1], poses, rtol=0.0, atol=1e-14) and (poses[:, 3] == [0.0, 0.0, 0.0, 1.0]).all()
    with pytest.raises(jp.ChannelError, match="was not recorded"):
        scene.run("1 ms", warn=False).transforms


def test_a_run_moves_in_a_notebook():
    scene = jp.Scene.load("four-bar")
    # Also of a run that has not recorded the poses.
    recorded = scene.run("4 ms", every="1 ms", channels=["*.pose.*"])
    for run in [recorded, scene.run("4 ms", every="2 ms")]:
        animation = run.animate(3, slower=50)
        page = animation._repr_html_()
        assert page.count("data:image/png") == 3 and "<script" in page and 'src="http' not in page.replace("https://maxcdn", "")
        assert animation._interval == pytest.approx(1e3 * 50 * 4e-3 / 3)
    animation._draw_frame(2)
    assert animation._fig.axes[0].get_title() == "four-bar, t = 4.000 ms"
    with pytest.raises(jp.OptionError, match="^frames = 1: "):
        run.animate(1)


def test_tables_have_units():
    run = jp.Scene.load("four-bar").run("20 ms", every="1 ms")
    data = run.to_xarray()
    assert data["A.normal"].dims == ("time",) and data["A.normal"].attrs["units"] == "N" and data["time"].attrs["units"] == "s"
    assert np.array_equal(data["A.normal"].sel(time=0.01, method="nearest"), run["A.normal"][10])
    impacts = run.impacts_to_pandas()
    assert len(impacts) == len(run.impacts) > 0 and set(impacts["joint"]) <= {"A", "B"}
    assert impacts["peak_N"].to_numpy().tobytes() == run.impacts["peak_N"].tobytes()


def test_more_rows_than_memory_are_refused():
    with pytest.raises(MemoryError, match="rows of"):
        jp.Scene.load("pendulum").run("1e6 s", every="1e-12 s")


def test_progress_rises_to_one_and_its_errors_end_the_run():
    parts = []
    fine = jp.Scene.load("four-bar").set({"solver.method": "rk4", "solver.step": "1 us"})
    fine.run("20 ms", progress=parts.append)
    assert parts == sorted(parts) and len(parts) > 2 and parts[-1] == 1.0

    def fails(part):
        raise LookupError(part)

    with pytest.raises(LookupError):
        fine.run("20 ms", progress=fails)


def test_ctrl_c_ends_a_run():
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        jp.Scene.load("four-bar").run("1000 s", every="1 s")


def test_runs_leak_nothing():
    scene = jp.Scene.load("pendulum")

    def work(count):
        for _ in range(count):
            scene.run("5 ms", every="10 us")
        gc.collect()
        return psutil.Process().memory_info().rss

    first = work(20)
    # The rows of one run are 200 kB; 200 runs that leak would need 40 MB.
    assert work(200) - first < 8 << 20
