"""`racecraft gym`."""

import typer

app = typer.Typer()
