"""The worlds that racecraft brings, a package each; none imports another."""
