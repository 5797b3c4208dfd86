"""Metrics over HTTP: what Prometheus fetches, and who may."""

import json
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


def test_another_name_is_answered_only_where_other_machines_may_ask():
    registry = LiveMetrics("car").registry
    with (
        closing(MetricsServer(registry, "127.0.0.1", 0)) as here,
        closing(MetricsServer(registry, "0.0.0.0", 0)) as wide,
    ):
        with pytest.raises(urllib.error.HTTPError) as refused:
            ask(here.address, "laptop.example")
        with refused.value as answer:
            assert (answer.code, json.load(answer)["error"]) == (403, "foreign_host")
        with ask(wide.address.replace("0.0.0.0", "127.0.0.1"), "laptop.example") as answer:
            assert answer.status == 200
