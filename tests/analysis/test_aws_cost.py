"""What a run would have cost on AWS, summed by hand, in every world and for every choice of a cluster."""

import pytest
from tests.page_reader import words_of

from racecraft.actions.report import ReportRequest, report
from racecraft.analysis.aws_cost import AwsUse, costs_of, total_usd
from racecraft.formats.run_folder import RunFolder


def test_the_bill_of_2019_comes_out_again():
    """Half an hour of training, 3.8 unit hours, two days and 5 GB: 0.30, 1.52, 2 (the bill: 2.10) and 0.05 USD."""
    used = AwsUse(training_hours=0.5, simulation_unit_hours=3.8, nat_days=2, transfer_gigabytes=5.0, how="")
    costs = costs_of(used)
    assert [line.usd for line in costs] == pytest.approx([0.30, 1.52, 0.0, 2.0, 0.05])
    assert total_usd(costs) == pytest.approx(3.87)


@pytest.mark.parametrize(
    ("kind", "cluster", "usd"),
    [
        ("gymnasium", None, 3.0),
        ("battlesnake", {"asked": "auto", "workers": 9, "machines": 3}, 9.0),
        ("unity", None, 3.0),
    ],
)
def test_every_world_s_report_has_a_bill(tmp_path, kind, cluster, usd):
    """Five hours × 0.60 USD on one instance, and on three."""
    run = RunFolder.create(
        tmp_path / "run", {"kind": kind, "settings": {}, **({"cluster": cluster} if cluster else {})}
    )
    run.append_metrics({"iteration": 1, "steps": 10, "seconds": 18_000.0, "training_score": -3.0})
    done = report(ReportRequest(run=run.path))
    assert done.aws_usd == pytest.approx(usd)
    lines = {line.service: (line.amount, line.usd) for line in done.aws_costs}
    assert lines["training (SageMaker)"] == (pytest.approx(usd / 0.6), pytest.approx(usd))
    assert lines["notebook (SageMaker)"] == (5.0, None)
    assert lines["NAT gateway"] == lines["data transfer"] == lines["simulation (RoboMaker)"] == (0.0, 0.0)
    words = words_of(done.report)
    assert f"About {usd:.2f} USD on AWS, without the notebook (SageMaker)." in words
    assert "An estimate" in words
