"""The files that a shell reads to know the dr- commands: bash and zsh, and PowerShell. Begin with `shell_file`."""

from __future__ import annotations

VERBS = (
    "upload-custom-files", "download-custom-files", "start-training", "increment-training", "stop-training",
    "start-evaluation", "stop-evaluation", "logs-sagemaker", "logs-robomaker", "start-viewer", "stop-viewer",
    "start-loganalysis", "start-metrics", "upload-model", "increment-upload-model", "download-model", "upload-car-zip",
    "summary", "local-aws", "update", "reload", "find-sagemaker", "find-robomaker", "get-robomaker-stats",
    "start-tournament", "list-aws-models", "set-upload-model", "stop-loganalysis", "url-loganalysis",
    "logs-loganalysis", "stop-metrics", "stop-all", "update-viewer", "view-stream",
)  # fmt: skip
"""Every dr- command that only hands its words on. `dr-update-env` does more: it changes the shell."""

MARK = "# The dr- commands of DeepRacer for Cloud, done by racecraft."
"""First line of a file of ours: one without it is somebody else's and stays."""

_SH = """\
@MARK@ Made by `racecraft init`; for bash and zsh:
#
#     source bin/activate.sh [-e EXPERIMENT | RUN.env]

if [ -n "${ZSH_VERSION:-}" ]; then
    eval '_dr_file="${(%):-%x}"'
else
    _dr_file="${BASH_SOURCE[0]}"
fi
DR_DIR="$(cd "$(dirname "$_dr_file")/.." && pwd)"
export DR_DIR
unset _dr_file DR_CONFIG RACECRAFT_DR_EXPERIMENT

if ! command -v racecraft > /dev/null 2>&1; then
    echo "racecraft is not on the path of this shell; expected the environment it is installed in." >&2
    echo "Activate that environment first, then read this file again." >&2
    return 1
fi

dr-update-env() {
    local _dr_lines
    _dr_lines="$(racecraft dr env --shell sh)" || return $?
    eval "$_dr_lines"
}

for _dr_verb in @VERBS@; do
    eval "dr-$_dr_verb() { racecraft dr $_dr_verb \\"\\$@\\"; }"
done
unset _dr_verb

if [ "${1:-}" = "-e" ] && [ -n "${2:-}" ]; then
    export RACECRAFT_DR_EXPERIMENT="$2"
elif [ -n "${1:-}" ] && [ -f "${1:-}" ]; then
    DR_CONFIG="$(cd "$(dirname "$1")" && pwd)/$(basename "$1")"
    export DR_CONFIG
elif [ -n "${1:-}" ]; then
    echo "- '$1' is neither a file nor -e EXPERIMENT, so run.env counts" >&2
fi
dr-update-env
"""

_POWERSHELL = """\
@MARK@ Made by `racecraft init`; for PowerShell:
#
#     . bin/activate.ps1 [-e EXPERIMENT | RUN.env]

param([string]$Config = "", [string]$Experiment = "")

$env:DR_DIR = Convert-Path -LiteralPath (Join-Path $PSScriptRoot "..")
Remove-Item Env:DR_CONFIG -ErrorAction SilentlyContinue
Remove-Item Env:RACECRAFT_DR_EXPERIMENT -ErrorAction SilentlyContinue

if (-not (Get-Command racecraft -ErrorAction SilentlyContinue)) {
    Write-Error "racecraft is not on the path of this shell; expected the environment it is installed in."
    return
}

function global:dr-update-env {
    $lines = (racecraft dr env --shell powershell) -join "`n"
    if ($LASTEXITCODE -eq 0) { Invoke-Expression $lines }
}
@FUNCTIONS@

if ($Experiment) {
    $env:RACECRAFT_DR_EXPERIMENT = $Experiment
} elseif ($Config -and (Test-Path -LiteralPath $Config -PathType Leaf)) {
    $env:DR_CONFIG = Convert-Path -LiteralPath $Config
} elseif ($Config) {
    Write-Warning "'$Config' is neither a file nor -e EXPERIMENT, so run.env counts."
}
dr-update-env
"""
"""Plain to the letter, for no PowerShell has run it: a function a line, lines joined and not formatted, paths as other
programs know them (`Convert-Path`, on a share or a drive of PowerShell's own, too), nothing a strict mode refuses."""


def shell_file(shell: str) -> str:
    """Return the text of activate.sh ("sh") or activate.ps1 ("powershell")."""
    text = {"sh": _SH, "powershell": _POWERSHELL}[shell]
    functions = "\n".join(f"function global:dr-{verb} {{ racecraft dr {verb} @args }}" for verb in VERBS)
    return text.replace("@MARK@", MARK).replace("@VERBS@", " ".join(VERBS)).replace("@FUNCTIONS@", functions)
