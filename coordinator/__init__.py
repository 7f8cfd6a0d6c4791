"""Strips, their allocation to vehicles and the ledger of tasks."""
