"""A server with a certificate answers by https alone, and its cookies are for https alone."""

import http.client
import shutil
import ssl
import subprocess

import pytest

from racecraft.web.access import opened
from racecraft.web.application import make_application
from racecraft.web.server import ServerThread, Tls, TlsError


@pytest.fixture
def tls(tmp_path):
    if shutil.which("openssl") is None:
        pytest.skip("no openssl here, which makes the certificate")
    made = Tls(tmp_path / "cert.pem", tmp_path / "key.pem")
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "1",
         "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", made.key, "-out",
         made.certificate],
        check=True, capture_output=True,
    )  # fmt: skip
    return made


def test_with_a_certificate_only_https_is_answered_and_cookies_are_secure(tls):
    server = ServerThread(make_application([], opened("token")), "tls", tls)
    port = server.start("127.0.0.1", 0)
    trusting = ssl.create_default_context(cafile=str(tls.certificate))
    connection = http.client.HTTPSConnection("127.0.0.1", port, context=trusting, timeout=60)
    connection.request("GET", "/?token=token")
    answer = connection.getresponse()
    assert answer.status == 303
    assert "Secure" in answer.headers["set-cookie"]
    connection.close()
    plain = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    plain.request("GET", "/?token=token")
    with pytest.raises((http.client.HTTPException, OSError)):
        plain.getresponse()
    server.close()


def test_a_key_that_does_not_belong_to_the_certificate_is_named(tls, tmp_path):
    with pytest.raises(TlsError, match="cert.pem"):
        ServerThread(make_application([]), "tls", Tls(tls.key, tls.certificate))
    with pytest.raises(TlsError, match="none.pem"):
        ServerThread(make_application([]), "tls", Tls(tmp_path / "none.pem", tls.key))
