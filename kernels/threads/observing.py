"""A step that several threads observe: each counts the visits in its rows of pixels,
and the first does all else.
"""

from kernels.coverage import mark_share
from kernels.jit import jit
from kernels.recording import Record, begin_step, end_step
from kernels.state import Flock, World
from kernels.threads.barrier import wait
from kernels.threads.team import Team, gather


@jit
def observe(flock: Flock, world: World, record: Record, team: Team) -> bool:
    """`kernels.recording.observe`, called by all threads of a team; False for all of
    them if numbers are not finite, or if a thread is lost.
    """
    is_first = team.rank == 0
    if is_first:
        gather(record, team)
        team.going[0] = begin_step(flock, record)
        if team.going[0] and not record.covering:
            end_step(flock, world, record)
    if not wait(team) or not team.going[0]:
        return False
    if record.covering:
        for i in range(flock.x.size):
            mark_share(record.coverage, flock.x[i], flock.y[i], team.rank, team.size)
        if not wait(team):
            return False
        if is_first:
            gather(record, team)
            end_step(flock, world, record)
        return wait(team)
    return True
