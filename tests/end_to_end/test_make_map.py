"""Buildings and worlds made from the command line."""

from pathlib import Path

import pytest

from clo_fleet.cli import main


@pytest.mark.parametrize(
    "words",
    [["grid", "--columns", "2", "--rows", "3"], ["ring", "--rooms", "4", "--spacing-m", "15"], ["line", "--two-lane"]],
)
def test_a_made_map_is_sound(tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    """``validate`` finds nothing, in the map and its network."""
    assert main(["make-map", *words, "-o", str(tmp_path), "--name", "plant"]) == 0
    assert "plant.yaml: " in capsys.readouterr().out
    assert main(["validate", str(tmp_path / "plant.yaml")]) == 0
    assert "a sound map" in capsys.readouterr().out


def test_what_cannot_be_made_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Sizes out of range and maps that are there already are bad input."""
    assert main(["make-map", "line", "--rooms", "5000", "-o", str(tmp_path)]) == 2
    assert "rooms: got 5000, expected 2 to 1024" in capsys.readouterr().err
    assert main(["make-map", "line", "--name", "../out", "-o", str(tmp_path)]) == 2
    assert main(["make-map", "line", "-o", str(tmp_path)]) == 0
    assert main(["make-map", "line", "-o", str(tmp_path)]) == 2
    assert "nothing was overwritten" in capsys.readouterr().err


def test_a_made_world_runs_on_a_made_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From nothing to goals that are reached, in three commands."""
    world = str(tmp_path / "worlds" / "drawn.yaml")
    assert main(["make-map", "line", "--rooms", "3", "--two-lane", "-o", str(tmp_path / "maps")]) == 0
    words = ["make-world", str(tmp_path / "maps" / "line-3.yaml"), "--robots", "2", "--objects", "3", "-o", world]
    assert main([*words, "--seed", "4"]) == 0
    assert "2 robots, 3 objects" in capsys.readouterr().out
    assert main(words) == 2
    assert "nothing was overwritten" in capsys.readouterr().err
    assert main(["validate", world]) == 0
    assert main(["run", world, "--out", str(tmp_path / "run")]) == 0
