"""How much a benchmark does: all of it, or little, as the test of all benchmarks."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Scale:
    """The share of its usual steps, sizes and rounds that a benchmark does."""

    share: float

    def of(self, usual: int) -> int:
        """The share of a usual number, and 1 at least."""
        return max(1, round(self.share * usual))

    def boids(self, usual: int) -> int:
        """The share of a usual flock, and 100 boids at least: worlds have the density
        of so many in 800 x 600, and smaller ones have no room for a start.
        """
        return max(100, self.of(usual))


FULL, SMALL = Scale(1.0), Scale(0.01)
