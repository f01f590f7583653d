"""README's example of a domain of one's own is what happens."""

import re
from pathlib import Path

from clo_fleet.study.run import Run
from clo_fleet.study.shipped import copy_out
from clo_fleet.world.world_file import read_world

ROOT = Path(__file__).resolve().parents[2]
SECTION = (ROOT / "README.md").read_text(encoding="utf-8").partition("## Your own domain")[2]


def test_the_domain_in_the_readme_runs_as_it_stands(tmp_path: Path) -> None:
    """Typed into two files beside the copied worlds: r2 checks a room, and r1 need not."""
    copy_out(tmp_path)
    for kind in ("pddl", "yaml"):
        text = re.findall(rf"```{kind}\n(.*?)```", SECTION, re.DOTALL)[0]
        (tmp_path / "worlds" / f"patrol.{kind}").write_text(text, encoding="utf-8")
    with Run(read_world(tmp_path / "worlds" / "patrol.yaml"), "clo") as run:
        result = run.finish()
    assert result.outcome == "goals_reached"
    assert [(help_.by, help_.fact, help_.dropped) for help_ in result.helps] == [
        ("r2", "(checked l2)", ("go(r1, l1, l2)", "check(r1, l2)"))
    ]
