"""The package as installed: versions, the guard on its sibling, provenance."""

import tomllib
from pathlib import Path

import pytest

import sweep
from sweep.provenance import git_state

ROOT = Path(__file__).parent.parent


def test_one_version_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == sweep.__version__
    assert f"version: {sweep.__version__}" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


@pytest.mark.parametrize("found", [None, "/elsewhere/site-packages/kernels/__init__.py"])
def test_another_package_named_kernels_is_refused(found: str | None) -> None:
    with pytest.raises(ImportError, match="needs its own package `kernels`"):
        sweep.check_sibling(found, sweep.__file__)


def test_our_own_kernels_are_accepted() -> None:
    sweep.check_sibling(str(ROOT / "kernels" / "__init__.py"), sweep.__file__)


def test_code_outside_a_repository_has_no_git_state(tmp_path: Path) -> None:
    assert git_state(tmp_path) == {}


def test_constraints_pin_exactly_and_name_no_address() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").split()
    assert lines
    assert all(line.count("==") == 1 and "/" not in line and "@" not in line for line in lines)
