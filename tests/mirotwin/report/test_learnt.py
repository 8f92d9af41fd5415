"""What a run's summary and table say of that which its host learnt."""

import json

LEARNING = (
    *("--set", "camera.self_calibration=lines", "--set", "duration_s=2.0"),
    *("--set", "network.robot.controller={law = 'body_frame'}", "--set", "network.robot.estimator={kind = 'ekf'}"),
)  # fmt: skip


def test_camera_and_wheels_stand_beside_the_truth(mirotwin, tmp_path):
    code, out, _ = mirotwin("run", "fig6", "--out", tmp_path, "--no-figure", *LEARNING)
    assert code == 0
    summary = json.loads((tmp_path / "summary.json").read_bytes())
    (camera,) = summary["calibrations"]
    assert camera["worst_learnt_cm"] < 0.1 < 2.3 < camera["worst_told_cm"] < 2.5
    focal = camera["parameters"]["focal_px"]
    assert abs(focal["learnt"] - focal["true"]) < 0.2 < 2.0 < abs(focal["told"] - focal["true"])
    (wheels,) = summary["wheels"]
    for side in ("left", "right"):
        assert abs(wheels[side]["learnt"] - wheels[side]["true"]) < 0.006
    assert "2.40 cm wrong at worst" in out
    assert "radius left " in out


def test_a_host_that_learns_nothing_says_nothing_of_it(mirotwin, tmp_path):
    mirotwin("run", "fig6", "--out", tmp_path, "--no-figure", "--set", "duration_s=0.2")
    summary = json.loads((tmp_path / "summary.json").read_bytes())
    assert "calibrations" not in summary
    assert "wheels" not in summary
