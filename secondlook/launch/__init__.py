"""Running a mission: processes started, watched over and ended, on one host or on several."""
