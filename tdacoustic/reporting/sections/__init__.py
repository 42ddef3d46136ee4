"""The sections of the report, one module each; they lay out results and compute none."""
