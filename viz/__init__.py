"""Rerun recorder, blueprint and report."""
