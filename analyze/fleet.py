"""Many jobs: one after the other, or on the workers of a `distributed` cluster."""

import asyncio
import logging
from collections.abc import Generator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack
from typing import Any

import click

from analyze.checks import WrongUse
from analyze.interrupt import ignored
from analyze.job import Failed, Job, Outcome, run
from reports.fleet import Failure

LOGS = ("distributed", "distributed.client")  # the library gives each a level of its own
CONNECT_S = 10.0  # a scheduler that is there answers within a second, a lost one does not come back


def outcomes(
    jobs: Sequence[Job], *, workers: int, scheduler: str | None
) -> Generator[Outcome, None, None]:
    """What came of each job, in the order in which they end.

    Args:
        jobs: what is to be done.
        workers: processes of this machine; 1 works in this process.
        scheduler: address of a running `distributed` scheduler instead, whose workers see the
            same paths.

    Raises:
        WrongUse: no scheduler answers at that address.
    """
    if scheduler is None and (workers == 1 or len(jobs) == 1):
        yield from map(run, jobs)
    else:
        yield from _distributed(jobs, min(workers, len(jobs)), scheduler)


def _distributed(
    jobs: Sequence[Job], workers: int, scheduler: str | None
) -> Generator[Outcome, None, None]:
    import dask
    from distributed import Client, LocalCluster, as_completed

    with ExitStack() as stack:
        for log in map(logging.getLogger, LOGS):
            stack.callback(log.setLevel, log.level)
            log.setLevel(logging.CRITICAL + 1)  # what a user must know is said by the outcomes
        stack.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": 1}))
        cluster: Any = scheduler
        if scheduler is None:
            cluster = stack.enter_context(
                LocalCluster(  # type: ignore[no-untyped-call]
                    n_workers=workers,
                    threads_per_worker=1,  # a job has its process to itself
                    dashboard_address=None,
                    silence_logs=logging.CRITICAL,
                )
            )
        else:
            _find(scheduler)
        client = stack.enter_context(
            Client(cluster, timeout=CONNECT_S)  # type: ignore[no-untyped-call]
        )
        if scheduler is None:
            client.run(ignored)
        elif not client.nthreads():
            click.echo(f"--scheduler {scheduler}: no workers yet: waiting for one", err=True)
        waiting = {future: job for job in jobs for future in [client.submit(run, job, pure=False)]}
        for future in as_completed(list(waiting)):  # type: ignore[no-untyped-call]
            job = waiting.pop(future)
            yield _outcome(job, future)
            future.release()


def _find(scheduler: str) -> None:
    """WrongUse if no scheduler answers at that address.

    Asked before there is a client: one that cannot connect is never closed, and blocks whichever
    thread collects it.
    """
    from distributed import Security
    from distributed.comm.core import connect

    async def ask() -> None:
        how = Security().get_connection_args("client")  # type: ignore[no-untyped-call]
        comm = await connect(scheduler, timeout=CONNECT_S, **how)  # type: ignore[no-untyped-call]
        await comm.close()

    try:
        asyncio.run(ask())
    except (OSError, ValueError) as e:  # ValueError: it is no address
        raise WrongUse(f"--scheduler {scheduler}: no Dask scheduler answers there: {e}") from e


def _outcome(job: Job, future: Any) -> Outcome:
    """The result of a future; `run` raises nothing, so an error is that of a worker or its loss."""
    try:
        outcome: Outcome = future.result()
    except CancelledError:
        reason = "the connection to the scheduler was lost before its worker had an answer"
    except Exception as e:
        reason = f"the worker was lost ({type(e).__name__}): out of memory, or it crashed"
    else:
        return outcome
    return Failed(job=job, failure=Failure(file=job.shown, code="worker_lost", reason=reason))
