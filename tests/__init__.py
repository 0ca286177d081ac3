"""Tests: a folder for each package; what concerns the whole project lies here."""

from pathlib import Path

ROOT = Path(__file__).parent.parent
"""The checkout."""
