"""All examples: their list, and their studies as they stand."""

import math
import re
from pathlib import Path

import pytest

from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.own_code.reading import load_spec
from tests.examples.flown import EXAMPLES, flown

SPECS = sorted(EXAMPLES.glob("*.yaml"))


def test_the_readme_lists_them_all() -> None:
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"\]\(([\w.]+)\)", text))
    files = {path.name for path in EXAMPLES.iterdir() if path.is_file()}
    assert listed == files - {"README.md"}


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.stem)
def test_a_study_flies_the_model_of_its_file(spec: Path) -> None:
    study = load_spec(spec)
    assert (study.name, study.model) == (f"my/{spec.stem}", spec.stem)
    last = flown(Jobs(study, expand(study))[-1]).last
    assert list(last) == list(study.record.names)
    assert all(map(math.isfinite, last.values()))
