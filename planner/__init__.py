"""Pure planning: detection curves, residual risk, spacing, sweeps, strips and paths. Imports nothing of ours."""
