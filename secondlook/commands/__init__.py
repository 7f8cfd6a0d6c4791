"""The commands of `secondlook`, one a module."""
