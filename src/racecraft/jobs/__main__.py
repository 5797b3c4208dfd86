"""`python -m racecraft.jobs`: work at the jobs of this account until all are done; `submit.py` starts it.

It is no command of `racecraft`, which would import them all first: whoever begins a training waits for it. So the
process of a job that was announced is started before anything else is imported.
"""

import sys

from racecraft.contract.errors import RacecraftError, UserInputError
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.preload import PreloadedProcess

if __name__ == "__main__":
    home = JobPaths.of_user()
    spare = PreloadedProcess.if_awaited(home)
    from racecraft.jobs.supervisor import supervise

    try:
        supervise(home, spare=spare)
    except RacecraftError as error:
        print(f"racecraft: {error}", file=sys.stderr)
        sys.exit(2 if isinstance(error, UserInputError) else 1)
