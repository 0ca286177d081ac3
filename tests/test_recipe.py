"""The recipe of the conda package says what pyproject.toml says."""

import tomllib

from ruamel.yaml import YAML

from tests import ROOT

RECIPE = YAML(typ="safe").load(ROOT / "docs" / "conda" / "recipe.yaml")
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]


def test_it_needs_what_the_package_needs() -> None:
    needed = [f"python{PROJECT['requires-python']}", *PROJECT["dependencies"]]
    run = RECIPE["requirements"]["run"]
    assert [one.replace(" ", "") for one in run] == needed


def test_it_is_built_as_the_wheel_is() -> None:
    host = RECIPE["requirements"]["host"]
    assert host[0].replace(" ", "") == f"python{PROJECT['requires-python']}"
    assert set(PYPROJECT["build-system"]["requires"]) <= set(host)
    scripts = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert RECIPE["build"]["python"]["entry_points"] == scripts


def test_it_bears_the_name_version_and_licence() -> None:
    about = RECIPE["package"] | RECIPE["about"]
    for key, value in (
        ("name", PROJECT["name"]),
        ("version", PROJECT["version"]),
        ("summary", PROJECT["description"]),
        ("license", PROJECT["license"]),
    ):
        assert about[key] == value
    assert (ROOT / about["license_file"]).is_file()
