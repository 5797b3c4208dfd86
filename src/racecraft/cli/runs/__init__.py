"""Commands for any run: report, export."""
