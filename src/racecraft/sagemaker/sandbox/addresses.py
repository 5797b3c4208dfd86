"""The cloud's addresses as addresses of this machine. Begin with `localised`.

https://NAME.notebook.REGION.sagemaker.aws/notebooks/PATH         file of the notebook's folder
https://console.aws.amazon.com/sagemaker/…/notebook-instances/…   the notebook's folder
https://API.execute-api.REGION.amazonaws.com/STAGE/PATH           where `racecraft snakes serve` listens; its
                                                                      /status (the starter pack's) is / there
s3://BUCKET/KEY                                                   stays: scripts inside `racecraft run` find it
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

SNAKE_ADDRESS = "http://127.0.0.1:8000/"
"""Where `racecraft snakes serve` listens, unless --port says else."""
NAME = r"(?P<name>[A-Za-z0-9][A-Za-z0-9-]*)"
_NOTEBOOK_FILE = re.compile(
    rf"https://{NAME}\.notebook\.[\w-]+\.sagemaker\.aws(?:/(?:lab/)?(?:notebooks|tree|edit))?(?P<path>/[^\s\"'?#]*)?"
)
_NOTEBOOK_PAGE = re.compile(
    rf"https://[\w.-]*console\.aws\.amazon\.com/sagemaker/[^\s\"']*#/notebook-instances/(?:openNotebook/)?{NAME}"
    r"(?:\?[^\s\"']*)?"
)
_API = re.compile(r"https://[\w-]+\.execute-api\.[\w-]+\.amazonaws\.com(?:/[\w-]+)?/?(?P<path>[^\s\"']*)")


def localised(text: str, notebooks: Mapping[str, Path]) -> str:
    """Return a text with every address of the cloud that has an equivalent here replaced by it.

    Args:
        text: A value, or a file's text.
        notebooks: Absolute folders by the notebook instance's name.

    >>> localised("https://abc.execute-api.local.amazonaws.com/snake/status", {})
    'http://127.0.0.1:8000/'
    """

    def file(found: re.Match[str]) -> str:
        folder = notebooks.get(found["name"])
        path = (found.groupdict().get("path") or "").strip("/")
        return found[0] if folder is None else (folder / path if path else folder).as_uri()

    text = _NOTEBOOK_PAGE.sub(file, _NOTEBOOK_FILE.sub(file, text))
    return _API.sub(lambda found: SNAKE_ADDRESS + found["path"].removeprefix("status"), text)
