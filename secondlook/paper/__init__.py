"""The paper beside the program: its three experiments flown, its tables and figures made anew."""
