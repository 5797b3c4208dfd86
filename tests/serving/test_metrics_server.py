"""Metrics over HTTP: what Prometheus fetches, and who may."""

import urllib.error
import urllib.request
from contextlib import closing

import pytest
from prometheus_client.parser import text_string_to_metric_families

from racecraft.serving.metrics_server import MetricsServer
from racecraft.training.live_metrics import LiveMetrics
from racecraft.web.ports import PortError


def ask(address, host=""):
    return urllib.request.urlopen(urllib.request.Request(address, headers={"Host": host} if host else {}), timeout=60)


def test_prometheus_reads_what_the_training_tells():
    live = LiveMetrics("car")
    with closing(MetricsServer(live.registry, "127.0.0.1", 0)) as server:
        live.begin("title", "laps", "progress %")
        with ask(server.address) as answer:
            assert answer.headers["Content-Type"].startswith("text/plain; version=")
            (family,) = text_string_to_metric_families(answer.read().decode())
        with pytest.raises(PortError, match="choose another"):
            MetricsServer(live.registry, "127.0.0.1", int(server.address.split(":")[2].split("/")[0]))
    assert (family.name, family.samples[0].value) == ("racecraft_training_running", 1.0)
