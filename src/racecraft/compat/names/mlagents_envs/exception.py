"""What can go wrong, under ML-Agents' names. Each is raised from the letter of ours that says it."""


class UnityException(Exception):  # noqa: N818 (the name is theirs)
    """Anything ML-Agents raises."""


class UnityEnvironmentException(UnityException):
    """The environment cannot be started or reached."""


class UnityCommunicationException(UnityException):
    """The conversation with the player broke."""


class UnityCommunicatorStoppedException(UnityException):
    """The player ended the conversation."""


class UnityObservationException(UnityException):
    """An observation that cannot be read."""


class UnityActionException(UnityException):
    """An action that cannot be sent."""


class UnityTimeOutException(UnityException):
    """The player is silent."""


class UnitySideChannelException(UnityException):
    """A side channel was used in a way that cannot be."""


class UnityPolicyException(UnityException):
    """A policy cannot be used."""


class UnityWorkerInUseException(UnityException):
    """The port of this worker id is taken."""

    def __init__(self, worker_id: int) -> None:
        super().__init__(
            f"the port of worker {worker_id} is in use. Take another worker_id, or leave base_port out: a free port "
            "is then found."
        )
