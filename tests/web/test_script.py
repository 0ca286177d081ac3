"""The page's modules as one text: what becomes of imports, exports and types."""

from pathlib import Path

import pytest

from sweep.web import page

NEEDED = """
/** @typedef {{ x: number }} Place */

// A place that is seen.
/**
 * @param {Place} place
 */
export function seen(place) {
  return [
    /** @type {const} */ (
      place.x
    ),
  ];
}

/** @type {number} */
export const most = 3;

export async function later() {}
"""
ENTRY = """
import {
  most,
  seen,
} from "./needed.js";

/** @import { Place } from "./needed.js" */

export const shown = seen({ x: most });
"""
TEXT = """const needed_js = (() => {


// A place that is seen.
function seen(place) {
  return [
    /** @type {const} */ (
      place.x
    ),
  ];
}

const most = 3;

async function later() {}
return { seen, most, later };
})();

const { most,
  seen } = needed_js;


export const shown = seen({ x: most });
"""


def test_a_module_stands_after_what_it_needs_and_without_its_types(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "needed.js").write_text(NEEDED)
    (tmp_path / "entry.js").write_text(ENTRY)
    monkeypatch.setattr(page, "STATIC", tmp_path)
    assert page.script("entry") == TEXT


@pytest.mark.parametrize("name", ["view", "widget", "recording", "supplement"])
def test_neither_an_import_nor_a_type_is_left_in_the_text(name: str) -> None:
    lines = page.script(name).splitlines()
    assert [line for line in lines if line.startswith(("import ", "} from "))] == []
    assert [line for line in lines if "@param" in line or "@import" in line] == []
