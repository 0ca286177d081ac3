"""The progress of a search, as that of a launch, with what it has found so far."""

from sweep.campaigns.progress import Progress, SearchProgress
from sweep.cli.progress import ProgressBar


class SearchBar(ProgressBar):
    """Shows what ProgressBar does, and what has been found."""

    found = ""
    begun = False

    def show(self, progress: Progress) -> None:
        """Show `progress`, as ProgressBar does."""
        if isinstance(progress, SearchProgress):
            self.found = progress.found
        super().show(progress)

    def _pace(self, new: int) -> str:
        return ", ".join(filter(None, [super()._pace(new), self.found]))

    def _first(self, progress: Progress) -> None:
        if not self.begun:
            self._line(
                f"at most {progress.trials:,} trials;"
                " what is stored already does not run again"
            )
        self.begun = True
