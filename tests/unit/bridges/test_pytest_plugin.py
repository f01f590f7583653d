"""The plugin in the projects of others: it costs nothing unused, closes what tests leave open, and reads well."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

pytest_plugins = "pytester"
PLUGIN = ("-p", "clo_fleet.bridges.pytest_plugin")

ENGINES = {"libsumo", "pymunk", "pyrvo", "unified_planning", "shapely", "numpy", "networkx", "pydantic", "duckdb"}


def test_loading_it_imports_next_to_nothing() -> None:
    """Neither an engine nor any chapter of clo_fleet but its own: coverage of those begins with their first line."""
    code = "import sys, pytest; before = set(sys.modules); import clo_fleet.bridges.pytest_plugin; "
    code += "print(*sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    loaded = set(done.stdout.split())
    assert loaded == {"clo_fleet", "clo_fleet.bridges", "clo_fleet.bridges.pytest_plugin"}


def test_it_is_loaded_once_whichever_way(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """Installed, by ``-p``, or both: the entry point has the module's name, under which pytest knows it already."""
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (point,) = project["entry-points"]["pytest11"].items()
    installed = pytester.mkdir("installed") / "other-0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 0\n")
    (installed / "entry_points.txt").write_text(f"[pytest11]\n{point[0]} = {point[1]}\n")
    monkeypatch.setenv("PYTHONPATH", str(installed.parent), prepend=os.pathsep)
    pytester.makepyfile("def test_it(fleet_world, run_fleet): pass")
    for arguments in ((), PLUGIN):
        pytester.runpytest_subprocess(*arguments, "-W", "error").assert_outcomes(passed=1)


def test_another_project_asserts_about_its_fleet_without_a_world_file(pytester: pytest.Pytester) -> None:
    """The example of clo_fleet.testing passes, and a failing assertion shows what happened, not our code."""
    pytester.makepyfile(
        """
        from clo_fleet.testing import assert_goals_reached, assert_helped

        def world(fleet_world):
            return (
                fleet_world("kitchen", "hall", "office")
                .robot("r1", "office", wants="(holding r1 cup)")
                .robot("r2", "kitchen", wants="(prepared cup)")
                .thing("cup", "kitchen")
            )

        def test_help(fleet_world, run_fleet):
            run = run_fleet(world(fleet_world))
            run.finish()
            assert_goals_reached(run)
            assert_helped(run, by="r2", robot="r1", fact="(prepared cup)")

        def test_no_help(fleet_world, run_fleet):
            run = run_fleet(world(fleet_world), strategy="clo-improve", seed=3)
            assert run.mission.world.seed == 3
            run.finish()
            assert_helped(run, by="r3")
        """
    )
    result = pytester.runpytest_subprocess(*PLUGIN)
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(
        [
            '>       assert_helped(run, by="r3")',
            "E       AssertionError: r3 did not help anybody; the run ended as goals_reached after * s (*)",
            "E       who helped whom:",
            "E         * s: r2 helped r1 with (prepared cup) (prepared); needless: *",
        ]
    )
    result.stdout.no_fnmatch_line("*_fail*")


def test_whatever_a_test_does_sumo_is_closed_and_nobody_plans_for_it_any_more(pytester: pytest.Pytester) -> None:
    """After a failing test the next one has SUMO for itself; idle planners are kept, and ended with the session."""
    pytester.makepyfile(
        """
        import os
        import libsumo
        import pytest
        from pathlib import Path
        from clo_fleet.sim.corridors import CorridorsOpenError

        def children():
            tasks = Path(f"/proc/{os.getpid()}/task").iterdir()
            found = [child for task in tasks for child in (task / "children").read_text().split()]
            Path("children").write_text(" ".join(found))
            return found

        def world(fleet_world):
            return fleet_world(on_map="hello").robot("r1", "west", wants="(at-robot r1 east)")

        def test_fails(fleet_world, run_fleet):
            run = run_fleet(world(fleet_world))
            run.step(40)
            assert libsumo.isLoaded()
            run.mission.questions.ask("r1", run.robot("r1").beliefs, [("at-robot", "r1", "west")], run.time)
            raise SystemExit("the test breaks off while a planner is at work")

        def test_next(fleet_world, run_fleet):
            assert not libsumo.isLoaded()
            assert len(children()) == 1
            run = run_fleet(world(fleet_world))
            with pytest.raises(CorridorsOpenError):
                run_fleet(world(fleet_world))
            run.finish()
            with run_fleet(world(fleet_world)) as again:  # the first has ended, so that it makes way
                again.finish()
                assert again.log == run.log

        def test_last():
            assert not libsumo.isLoaded()
            assert len(children()) == 2
        """
    )
    result = pytester.runpytest_subprocess(*PLUGIN)
    result.assert_outcomes(passed=2, failed=1)
    planners = (pytester.path / "children").read_text().split()
    assert not any(Path(f"/proc/{planner}").exists() for planner in planners)
