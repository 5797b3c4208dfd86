"""`racecraft bench`."""

import typer

app = typer.Typer()
