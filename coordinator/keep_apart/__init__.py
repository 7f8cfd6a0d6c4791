"""Who gives way to whom, so that no two vehicles come too close."""
