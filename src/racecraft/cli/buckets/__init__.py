"""Commands about buckets, and what trainings and dr- commands do with those that are S3."""
