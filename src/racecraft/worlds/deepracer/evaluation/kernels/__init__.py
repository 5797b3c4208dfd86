"""Bodies of judgement that walk over many rows."""
