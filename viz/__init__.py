"""Rerun recorder, blueprint and pictures of recordings."""
