"""`python -m racecraft.jobs`: work at the jobs of this account until all are done; `submit.py` starts it.

It is no command of `racecraft`, which would import them all first: whoever begins a training waits for it.
"""

import sys

from racecraft.contract.errors import RacecraftError, UserInputError
from racecraft.jobs.home import JobHome
from racecraft.jobs.supervisor import supervise

if __name__ == "__main__":
    try:
        supervise(JobHome.of_user())
    except RacecraftError as error:
        print(f"racecraft: {error}", file=sys.stderr)
        sys.exit(2 if isinstance(error, UserInputError) else 1)
