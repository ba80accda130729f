"""Sweeps: the bytes of the program's archive, in this and other processes, and with a worker killed half-way."""

import _thread
import os
import pickle
import signal
import threading
import time

import distributed
import joblib
import numpy as np
import pandas
import pytest

import jointplay as jp

CASES = [
    (
        "slider-crank-driven",
        {"contact.clearance": "0.1mm..0.3mm:4"},
        {"periods": 4, "discard": 1},
        ["--periods", "4", "--discard", "1"],
    ),
    (
        "pendulum",
        {"contact.clearance": "0.05mm..0.2mm:3:log", "contact.normal_law": "hertz,flores"},
        {"duration": "20 ms", "from_": "5 ms", "keep": ["S1.normal:max", "energy.kinetic:mean"]},
        ["--duration", "20ms", "--from", "5ms", "--keep", "S1.normal:max,energy.kinetic:mean"],
    ),
    (
        "slider-crank-driven",
        {"contact.friction": "0.1..0.2:3"},
        {"periods": 3, "discard": 1, "start": ["cold", "follow-up"], "exponent": False, "phase": "90deg"},
        ["--phase", "90deg", "--periods", "3", "--discard", "1", "--start", "cold,follow-up", "--no-exponent"],
    ),
]


def archive(program, tmp_path, name, vary, options):
    path = tmp_path / "sweep.npz"
    varied = [f"--vary={key}={values}" for key, values in vary.items()]
    program("sweep", name, *varied, *options, "--out", path, "--quiet", "--force")
    return np.load(path)


def assert_same(result, written):
    assert list(result) == [name for name in written.files if name not in ("meta", "start")]
    for name, array in result.items():
        assert array.shape == written[name].shape and array.dtype.kind == written[name].dtype.kind, name
        if array.dtype.kind == "U":
            assert array.tolist() == written[name].tolist(), name
        else:
            assert array.tobytes() == written[name].tobytes(), name


@pytest.mark.parametrize("name, vary, options, arguments", CASES)
def test_arrays_are_those_of_the_program(name, vary, options, arguments, program, tmp_path):
    written = archive(program, tmp_path, name, vary, arguments)
    sweep = jp.Sweep(jp.Scene.load(name), vary, **options)
    for threads in [1, 3, -1]:
        assert_same(sweep.run(threads), written)
    assert_same(sweep.assemble(sweep.compute(block) for block in range(sweep.blocks)), written)


def test_listed_values_are_numbers_or_texts():
    scene = jp.Scene.load("pendulum")
    for values in [np.linspace(1e-4, 2e-4, 3), ["0.1 mm", "0.15 mm", "0.2 mm"]]:
        result = jp.sweep(scene, {"contact.clearance": values}, duration="2 ms", keep="S1.normal:max")
        assert np.allclose(result.axes["contact.clearance"], [1e-4, 1.5e-4, 2e-4], rtol=1e-15)
    table = result.to_pandas()
    assert list(table.columns) == ["contact.clearance", "status", "stopped_at_s", "doubts", "energy_residual", "S1_normal_max_N"]
    assert len(table) == 3


def test_a_table_has_one_point_per_row():
    scene = jp.Scene.load("pendulum")
    table = pandas.DataFrame({"contact.clearance": [1e-4, 2e-4], "contact.normal_law": ["hertz", "flores"]}, index=[7, 9])
    options = {"duration": "2 ms", "keep": "S1.normal:max"}
    result = jp.sweep(scene, points=table, **options)
    crossed = jp.sweep(scene, {key: table[key].tolist() for key in table}, **options)
    assert result["S1_normal_max_N"].tolist() == np.diag(crossed["S1_normal_max_N"]).tolist()
    assert jp.sweep(scene, points=dict(table), **options)["S1_normal_max_N"].tolist() == result["S1_normal_max_N"].tolist()


def test_an_interrupted_sweep_resumes_from_its_record(tmp_path):
    # So many points that a busy computer does not finish them before it stops.
    points, record = {"contact.friction": np.linspace(0.1, 0.4, 2000)}, tmp_path / "sweep.record"
    sweep = jp.Sweep(jp.Scene.load("four-bar"), points, duration="5 ms")

    def stop(part):
        if part > 0.01:
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        sweep.run(1, stop, record=record)
    kept = len(record.read_text().splitlines()) - 1
    assert 1 <= kept < 2000
    parts = []
    result = sweep.run(1, parts.append, record=record)
    assert parts[0] >= kept / 2000 and result["A_peak_N"].tobytes() == sweep.run()["A_peak_N"].tobytes()
    other = jp.Sweep(jp.Scene.load("four-bar"), points, duration="10 ms")
    with pytest.raises(jp.OptionError, match=r"other settings \(duration_s: 0.005 there, 0.01 now\)"):
        other.run(record=record)
    with pytest.raises(OSError, match="not a regular file"):
        sweep.run(record=tmp_path)


@pytest.mark.parametrize(
    "vary, options, message",
    [
        ({"contact.clearance": "0.1mm..0.2mm:3"}, {}, "give periods and discard, or a duration"),
        ({"contact.clearance": "0.1mm..0.2mm"}, {"duration": 0.01}, "expected"),
        (None, {"duration": 0.01}, "either as vary or as points"),
        (None, {"duration": 0.01, "points": {"contact.clearance": [1e-4], "contact.friction": []}}, "empty"),
        ({"contact.clearence": [1e-4]}, {"duration": 0.01}, "did you mean"),
        ({"contact.clearance": [-1.0]}, {"duration": 0.01}, "allowed"),
        ({"contact.clearance": [1e-4]}, {"duration": "1 mm"}, "duration"),
        ({"contact.clearance": [1e-4]}, {"duration": 0.01, "from_": 0.02}, "before the end"),
        ({"contact.clearance": [1e-4]}, {"duration": 0.01, "keep": "S1.nromal:max"}, "did you mean"),
        ({"contact.clearance": [1e-4]}, {"duration": 0.01, "start": "warm"}, "no such start"),
        ({"contact.clearance": [1e-4]}, {"periods": 3, "discard": 1}, "driven"),
        ({}, {"duration": 0.01}, "at least one"),
    ],
)
def test_bad_sweeps_are_refused(vary, options, message):
    with pytest.raises(jp.JointplayError, match=message):
        jp.Sweep(jp.Scene.load("pendulum"), vary, **options)


def test_missing_blocks_are_an_error():
    sweep = jp.Sweep(jp.Scene.load("pendulum"), {"contact.clearance": [1e-4, 2e-4]}, duration="1 ms")
    with pytest.raises(jp.OptionError, match="1 given"):
        sweep.assemble([sweep.compute(0)])
    with pytest.raises(jp.OptionError, match="blocks 0 to 1"):
        sweep.compute(2)


def test_ctrl_c_ends_a_sweep_and_progress_rises():
    scene = jp.Scene.load("four-bar")
    parts = []
    jp.sweep(scene, {"contact.friction": [0.1, 0.2, 0.3]}, duration="5 ms", progress=parts.append)
    assert parts == sorted(parts) and parts[-1] == 1.0
    threading.Timer(0.5, _thread.interrupt_main).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        jp.sweep(scene, {"contact.friction": [0.1, 0.2, 0.3]}, duration="1000 s")
    assert time.monotonic() - start < 60.0


def test_a_sweep_computes_the_same_after_pickling():
    sweep = jp.Sweep(jp.Scene.load("pendulum"), {"contact.clearance": [1e-4, 2e-4]}, duration="5 ms")
    again = pickle.loads(pickle.dumps(sweep))
    assert again.compute(1).tobytes() == sweep.compute(1).tobytes()


def test_joblib_computes_the_same(program, tmp_path):
    name, vary, options, arguments = CASES[0]
    sweep = jp.Sweep(jp.Scene.load(name), vary, **options)
    blocks = joblib.Parallel(n_jobs=2)(joblib.delayed(sweep.compute)(block) for block in range(sweep.blocks))
    assert_same(sweep.assemble(blocks), archive(program, tmp_path, name, vary, arguments))


def test_dask_loses_no_point_with_a_worker(program, tmp_path):
    name, options, arguments = "pendulum", {"duration": "0.4 s"}, ["--duration", "0.4s"]
    vary = {"contact.clearance": "0.1mm..0.3mm:24"}
    sweep = jp.Sweep(jp.Scene.load(name), vary, **options)
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(tmp_path))
    with cluster, distributed.Client(cluster) as client:
        futures = client.map(sweep.compute, range(sweep.blocks), pure=False)
        # Half-way, kills a worker that has finished blocks and is computing one.
        distributed.wait(futures[: sweep.blocks // 3])
        victim = client.run(os.getpid)
        os.kill(next(iter(victim.values())), signal.SIGKILL)
        assert any(not future.done() for future in futures), "the worker was killed too late"
        result = sweep.assemble(client.gather(futures))
    assert_same(result, archive(program, tmp_path, name, vary, arguments))


@pytest.mark.parametrize(
    "vary, options, message",
    [
        ({"contact.clearance": "1mm..0.1mm:3"}, {"periods": 2, "discard": 1}, "^vary: contact.clearance=1mm..0.1mm:3: the range"),
        ({"contact.clearance": []}, {"periods": 2, "discard": 1}, "^vary: contact.clearance: the range is empty"),
        ({}, {"periods": 2, "discard": 1}, "^vary: a sweep varies at least one parameter"),
        ({"contact.clearance": [1e-4]}, {"periods": 2, "discard": 2}, "^periods = 2, discard = 2: .* discard must be less than"),
        (
            {"contact.clearance": [2e-4, 1e-4]},
            {"periods": 2, "discard": 1, "start": "follow-up"},
            "^start = follow-up: .*; use start = cold, or name a range last$",
        ),
    ],
)
def test_errors_name_arguments_and_no_options_of_the_command_line(vary, options, message):
    with pytest.raises(jp.OptionError, match=message) as caught:
        jp.Sweep(jp.Scene.load("spcmm"), vary, **options)
    assert "--" not in str(caught.value)


def test_a_dataset_has_a_dimension_per_parameter_with_its_unit():
    scene = jp.Scene.load("slider-crank-driven")
    vary = {"contact.clearance": [1e-4, 3e-4], "contact.friction": [0.1, 0.15, 0.2]}
    result = jp.sweep(scene, vary, periods=3, discard=1, exponent=False, start=["cold", "follow-up"])
    data = result.to_xarray()
    assert dict(data.sizes) == {"start": 2, "contact.clearance": 2, "contact.friction": 3, "section": 2}
    assert data["contact.clearance"].attrs["units"] == "m" and data["B_peak_kept_N"].attrs["units"] == "N"
    assert data["section_vx_m_s"].dims[-1] == "section" and data["section_vx_m_s"].attrs["units"] == "m/s"
    chosen = data["B_peak_kept_N"].sel({"start": "follow-up", "contact.clearance": 3e-4, "contact.friction": 0.15})
    assert chosen == result["B_peak_kept_N"][1, 1, 1]
    points = {"contact.clearance": [1e-4, 3e-4], "contact.friction": [0.1, 0.2]}
    table = jp.sweep(scene, points=points, duration="2 ms").to_xarray()
    assert table["status"].dims == ("point",) == table["contact.friction"].dims


@pytest.mark.parametrize(
    "vary, options, message",
    [
        ({"contact.clearance": 1e-4}, {}, "contact.clearance = 0.0001: expected a list of numbers or texts"),
        ({"contact.clearance": [1e-4]}, {"periods": 2.5}, "periods = 2.5: expected a whole number"),
        ({"contact.clearance": [1e-4]}, {"threads": 0}, "threads = 0: allowed whole numbers"),
        ({"contact.clearance": [1e-4]}, {"phase": "90 mm"}, "phase = '90 mm': "),
        ({"contact.clearance": [1e-4]}, {"phase": []}, "phase = ..: expected a fraction of the period, or text"),
    ],
)
def test_wrong_arguments_are_refused_in_sentences(vary, options, message):
    with pytest.raises(jp.OptionError, match=message):
        jp.sweep(jp.Scene.load("pendulum"), vary, duration="1 ms", **options)
