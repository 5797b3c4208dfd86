"""What is laid round a learner hands on what it has no say in."""

from types import SimpleNamespace

from racecraft.algorithms.learner_wrapper import LearnerWrapper


class Annealed(SimpleNamespace):
    """A learner whose figures change over the training."""

    def anneal(self, done):
        self.heard = done


def test_schedules_and_rows_that_ended_reach_the_inner_learner_and_one_without_schedules_is_left_alone():
    inner = Annealed(spec="spec", experience="rollout", device="cpu", reset_state=lambda rows: forgotten.append(rows))
    forgotten, laid = [], LearnerWrapper(inner)
    laid.anneal(0.25)
    laid.reset_state("rows")
    assert (inner.heard, forgotten) == (0.25, ["rows"])
    assert (laid.spec, laid.experience, laid.device) == ("spec", "rollout", "cpu")
    LearnerWrapper(SimpleNamespace(spec="spec", experience="rollout", device="cpu")).anneal(0.5)
