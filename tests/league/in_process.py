"""A judge's process that is none, for tests of what is judged."""

from racecraft.contract.errors import UserInputError
from racecraft.league.drive_process import DriveError
from racecraft.league.world_part import league_world, no_progress


class InProcess:
    """Drives and plays in the test's own process; what a fresh one gives is tested once for each world."""

    layers = ()

    def __init__(self, kind, readable=()):
        self.kind = kind

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def close(self):
        pass

    def drive(self, order, recorded=None, on_progress=no_progress):
        world = league_world(self.kind)
        try:
            return world.drive(order, on_progress) if recorded is None else world.redrive(order, recorded)
        except UserInputError as error:
            raise DriveError(str(error)) from error
